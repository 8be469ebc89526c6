//! What there is to see, and through which camera.

use super::constants::SATURATION;
use super::sensor::{LensSettings, SensorSettings};
use crate::bus::{CameraModel, SimTime};
use crate::track::Track;
use crate::twin::air::Air;
use crate::twin::geometry::Body;
use crate::twin::lights::{Headlight, LampLight};
use crate::twin::random::Stream;
use crate::twin::reflectance::Wet;
use nalgebra::Isometry3;
use std::sync::Arc;

/// All that stands still for a whole run.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The tracks with their cross-sections. There is at least one.
    pub tracks: Vec<Arc<Track>>,
    /// The lamps as they really are (the survey may be wrong about them).
    pub lamps: Vec<LampLight>,
    /// What there is to see through.
    pub air: Air,
    /// Where bed and rails mirror.
    pub wet: Wet,
}

/// Poses of a camera through a frame, at equal steps; between them position runs linearly and
/// attitude by spherical interpolation.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraMotion {
    /// Time of the first pose.
    pub first: SimTime,
    /// From pose to pose.
    pub step_s: f64,
    /// `world_from_camera`.
    pub poses: Vec<Isometry3<f64>>,
}

impl CameraMotion {
    /// A camera that does not move.
    pub fn still(pose: Isometry3<f64>) -> Self {
        Self {
            first: SimTime::ZERO,
            step_s: 1.0,
            poses: vec![pose],
        }
    }

    /// `world_from_camera` at a time; held beyond the ends.
    pub fn pose_at(&self, time: SimTime) -> Isometry3<f64> {
        let last = self.poses.len() - 1;
        let x = (time.since(self.first) / self.step_s).clamp(0.0, last as f64);
        let k = (x.floor() as usize).min(last.saturating_sub(1));
        match self.poses.get(k + 1) {
            Some(next) => self.poses[k].lerp_slerp(next, x - k as f64),
            None => self.poses[k],
        }
    }
}

/// Names the noise of a frame: pixel noise is a hash of stream, frame and pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoiseKey {
    /// Of the camera.
    pub stream: Stream,
    /// Frame number.
    pub frame: u32,
}

/// One image to draw.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Geometry and shutter.
    pub camera: CameraModel,
    /// When row 0 opens.
    pub start: SimTime,
    /// Where the camera is, row by row.
    pub motion: CameraMotion,
    /// Width and height of a pixel.
    pub pixel_m: f64,
    /// The glass in front of the sensor.
    pub lens: LensSettings,
    /// The sensor.
    pub sensor: SensorSettings,
    /// Its noise.
    pub noise: NoiseKey,
}

impl View {
    /// The middle of the exposure of the middle row.
    pub fn mid(&self) -> SimTime {
        let rows = self.camera.intrinsics.height_px;
        let row = 0.5 * (f64::from(rows) - 1.0);
        self.camera.shutter.row_mid(self.start, row)
    }

    /// Width of the entrance pupil.
    pub fn pupil_m(&self) -> f64 {
        self.camera.intrinsics.fx_px * self.pixel_m / self.lens.f_number
    }

    /// Diameter of the disc that the lens makes of a point at a depth: the circle of confusion of a
    /// thin lens, `pupil f |1 / focus - 1 / depth|` with the focal length in pixels as calibrated.
    pub fn confusion_px(&self, depth_m: f64) -> f64 {
        let f_px = self.camera.intrinsics.fx_px;
        self.lens.focus_m.map_or(0.0, |focus_m| {
            self.pupil_m() * f_px * (1.0 / focus_m - 1.0 / depth_m).abs()
        })
    }

    /// Photo-electrons that a luminance of 1 cd/m^2 on the axis gives in a row's exposure.
    pub fn electrons_per_cd_m2(&self) -> f64 {
        let lux_s = self.lens.lux_per_cd_m2() * self.camera.shutter.exposure_s;
        lux_s * self.sensor.electrons_per_lux_s(self.pixel_m)
    }

    /// Grey levels of 255 that a luminance of 1 cd/m^2 on the axis gives.
    pub fn grey_per_cd_m2(&self) -> f64 {
        self.sensor.grey_per_e() * self.electrons_per_cd_m2()
    }

    /// Sets the sensor's gain so that a luminance on the axis gives that many grey levels over
    /// black. Where that takes less gain than none, which would show a full well instead of white,
    /// the lens passes less light instead.
    pub fn set_gain_for(&mut self, luminance_cd_m2: f64, grey: f64) {
        let now = self.grey_per_cd_m2() * luminance_cd_m2;
        let gain_db = self.sensor.gain_db + 20.0 * (grey / now).log10();
        self.sensor.gain_db = gain_db.max(0.0);
        self.lens.transmission *= 10f64.powf(gain_db.min(0.0) / 20.0);
    }

    /// Most electrons that a pixel's signal is followed to: beyond it everything is white.
    pub fn saturation_e(&self) -> f64 {
        SATURATION * self.sensor.full_well_e
    }
}

/// Images of one instant, and what moves in them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Job {
    /// Time of the bodies' poses.
    pub time: SimTime,
    /// Everything solid that is not the tunnel.
    pub bodies: Vec<Body>,
    /// Headlights that are lit. On a graphics adapter the nearest sixteen light a view.
    pub headlights: Vec<Headlight>,
    /// One image each.
    pub views: Vec<View>,
}
