//! What there is to see, and through which camera.

use super::gloss::Wet;
use super::hull::Hull;
use super::sensor::{LensSettings, SensorSettings};
use super::surface::SATURATION;
use crate::bus::{CameraModel, SimTime};
use crate::track::Tunnel;
use crate::track::waveform::{Ripple, Waveform};
use crate::twin::random::Stream;
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use std::sync::Arc;

/// All that stands still for a whole run.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The line with its cross-sections.
    pub tunnel: Arc<Tunnel>,
    /// The lamps as they really are (the survey may be wrong about them).
    pub lamps: Vec<LampLight>,
    /// What there is to see through.
    pub air: Air,
    /// Where bed and rails mirror.
    pub wet: Wet,
}

/// The tunnel's air: clear, or full of mist or dust. What it does to light is told in
/// [`light`](super::light).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// Share of light that is lost on a metre (k in e^(-k d)); 0 is clear.
    pub extinction_per_m: f64,
    /// Share of the lost light that goes on in another direction: near 1 for the drops of mist,
    /// 0.6 to 0.9 for mineral dust; the rest is absorbed.
    pub scattered_share: f64,
}

/// Contrast that an eye just sees, as usual with Koschmieder's law (WMO-No. 8 takes 0.05 for its
/// meteorological optical range, which is 0.77 of the visibility here).
const JUST_SEEN: f64 = 0.02;

impl Default for Air {
    fn default() -> Self {
        Self {
            extinction_per_m: 0.0,
            scattered_share: 1.0,
        }
    }
}

impl Air {
    /// Mist in which a black body before lit air is just seen at a distance: k = 3.912 / V.
    ///
    /// ```
    /// use metrotwin::twin::render::Air;
    /// let air = Air::of_visibility(100.0);
    /// assert!((air.extinction_per_m - 0.039_12).abs() < 1e-5);
    /// ```
    pub fn of_visibility(visibility_m: f64) -> Self {
        Self {
            extinction_per_m: -JUST_SEEN.ln() / visibility_m,
            ..Self::default()
        }
    }

    /// Whether nothing is lost.
    pub fn is_clear(&self) -> bool {
        self.extinction_per_m <= 0.0
    }

    /// Share of light that is left after a distance.
    pub fn transmission(&self, distance_m: f64) -> f64 {
        if self.is_clear() {
            1.0
        } else {
            (-self.extinction_per_m * distance_m).exp()
        }
    }
}

/// A lamp: a luminous disc that blinks.
#[derive(Clone, Debug, PartialEq)]
pub struct LampLight {
    /// Centre of the disc, world.
    pub centre: Point3<f64>,
    /// Normal of the disc, on the luminous side.
    pub facing: Unit<Vector3<f64>>,
    /// Radius of the disc.
    pub radius_m: f64,
    /// Luminance along the normal while on, cd/m^2. Seen at angle a from the normal it is this
    /// times cos(a)^(exponent - 1).
    pub luminance_cd_m2: f64,
    /// Exponent m of the intensity pattern I = I0 cos(a)^m.
    pub exponent: f64,
    /// When it is on.
    pub waveform: Waveform,
    /// Its light as a share of that of a good lamp: 1 good, 0 dead, between them dim.
    pub level: f64,
    /// What the mains leave in its light.
    pub ripple: Ripple,
    /// What level and ripple become later, in order of time.
    pub changes: Vec<LampChange>,
}

/// A lamp fails, or recovers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LampChange {
    /// When.
    pub at: SimTime,
    /// Its level from then on.
    pub level: f64,
    /// Its ripple from then on.
    pub ripple: Ripple,
}

impl LampLight {
    /// The lamp as it is at a time.
    #[must_use]
    pub fn at(&self, time: SimTime) -> Self {
        let passed = self.changes.iter().take_while(|c| c.at <= time);
        let (level, ripple) = passed
            .last()
            .map_or((self.level, self.ripple), |c| (c.level, c.ripple));
        Self {
            level,
            ripple,
            ..self.clone()
        }
    }
}

/// Follows the lamps of a scene through time. Between changes all that they light stays as it is,
/// so a renderer may keep it; a lamp changes between two jobs, never within one.
#[derive(Clone, Debug)]
pub struct LampsInTime {
    lamps: Vec<LampLight>,
    changes: Vec<SimTime>,
    /// Of the changes, so many were over when it was asked last.
    passed: usize,
}

impl LampsInTime {
    /// At time 0.
    pub fn new(lamps: &[LampLight]) -> Self {
        let changes = lamps.iter().flat_map(|lamp| &lamp.changes);
        let mut changes: Vec<_> = changes.map(|change| change.at).collect();
        changes.sort_unstable();
        changes.dedup();
        Self {
            lamps: lamps.to_vec(),
            changes,
            passed: 0,
        }
    }

    /// All lamps as they are at a time, if any differs from what it was when this was asked last.
    pub fn changed(&mut self, time: SimTime) -> Option<Vec<LampLight>> {
        let passed = self.changes.partition_point(|at| *at <= time);
        let before = std::mem::replace(&mut self.passed, passed);
        (before != passed).then(|| self.lamps.iter().map(|lamp| lamp.at(time)).collect())
    }
}

/// A solid shape, centred on its body's origin.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Half extents.
    Box(Vector3<f64>),
    /// Radius and half height, along z.
    Cylinder(f64, f64),
    /// Radius.
    Sphere(f64),
    /// Radius and half length of the straight part, along z.
    Capsule(f64, f64),
    /// Corners and flat faces.
    Hull(Arc<Hull>),
}

impl Shape {
    /// How far it extends from its origin in a direction of length 1 (its support function).
    pub fn reach_m(&self, direction: &Vector3<f64>) -> f64 {
        let (level, up) = (direction.xy().norm(), direction.z.abs());
        match self {
            Self::Box(half) => half.dot(&direction.abs()),
            Self::Cylinder(radius, half) => radius * level + half * up,
            Self::Sphere(radius) => *radius,
            Self::Capsule(radius, half) => radius + half * up,
            Self::Hull(hull) => hull.reach_m(direction),
        }
    }

    /// Half extents along its axes; of a hull, which may be lopsided, those of its farther side.
    pub fn half_extents_m(&self) -> Vector3<f64> {
        match self {
            Self::Box(half) => *half,
            Self::Cylinder(r, h) => Vector3::new(*r, *r, *h),
            Self::Sphere(r) => Vector3::repeat(*r),
            Self::Capsule(r, h) => Vector3::new(*r, *r, h + r),
            Self::Hull(hull) => hull.half_extents_m(),
        }
    }
}

/// Something that may move: obstacle, limb of a worker, part of a train.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Its shape.
    pub shape: Shape,
    /// Where it is at `Job::time`.
    pub world_from_body: Isometry3<f64>,
    /// Where it goes meanwhile, world.
    pub velocity_mps: Vector3<f64>,
    /// Share of light reflected (Lambert), 0 to 1.
    pub albedo: f64,
    /// Luminance of its own, cd/m^2 (a headlight's lens).
    pub luminance_cd_m2: f64,
}

/// A lamp on a train that lights what is in front.
#[derive(Clone, Debug, PartialEq)]
pub struct Headlight {
    /// Where it is and where it looks (along its x axis).
    pub world_from_light: Isometry3<f64>,
    /// Intensity along the axis.
    pub intensity_cd: f64,
    /// Exponent of its pattern I = I0 cos(a)^m.
    pub exponent: f64,
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
    /// Headlights that are lit. On a graphics adapter the nearest eight light a view.
    pub headlights: Vec<Headlight>,
    /// One image each.
    pub views: Vec<View>,
    /// Whether raw images are wanted, for [`Renderer::collect_raw`](super::Renderer::collect_raw).
    pub raw: bool,
}
