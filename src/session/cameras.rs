//! When cameras trigger, and what the renderer needs to know to draw their frames.

use crate::bus::{Frame, RigCalibration, SimTime, StereoPair, WaysideCalibration};
use crate::twin::random::Stream;
use crate::twin::render::{CameraMotion, NoiseKey, View};
use crate::twin::sensors::{RigSettings, WaysideCameraSettings};
use image::GrayImage;
use nalgebra::Isometry3;

/// Spacing of the poses handed to the renderer: the step of the physics.
pub const POSE_STEP_S: f64 = 1e-3;

/// Counts frames at a fixed rate, frame k at k / rate.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    rate_hz: f64,
    next: u32,
}

impl Clock {
    /// Frame 0 is due at time zero.
    pub fn new(rate_hz: f64) -> Self {
        Self { rate_hz, next: 0 }
    }

    /// The next frame's number and time.
    pub fn next(&self) -> (u32, SimTime) {
        (
            self.next,
            SimTime::from_secs(f64::from(self.next) / self.rate_hz),
        )
    }

    /// Moves on to the frame after.
    pub fn advance(&mut self) {
        self.next += 1;
    }

    /// Whether the next frame is due, `delay_s` after its time; moves on if so.
    pub fn due(&mut self, now: SimTime, delay_s: f64) -> Option<(u32, SimTime)> {
        let (number, time) = self.next();
        (now >= time.plus(delay_s)).then(|| {
            self.advance();
            (number, time)
        })
    }
}

/// How many poses, [`POSE_STEP_S`] apart, cover a frame of `span_s`.
fn poses_in(span_s: f64) -> usize {
    (span_s / POSE_STEP_S).ceil() as usize + 1
}

/// The stereo camera as it is built: its true mount may differ from the calibration.
#[derive(Clone, Debug)]
pub struct StereoCamera {
    /// Both eyes and the left one's true mount.
    pub rig: RigCalibration,
    /// The right eye's true pose in the left one's frame.
    pub left_from_right: Isometry3<f64>,
    /// Pixels, glass and sensor of either eye.
    pub settings: RigSettings,
    /// Noise of the left and right eye.
    pub streams: [Stream; 2],
}

impl StereoCamera {
    /// The rig as it really is, with the noise of a run's seed.
    pub fn new(rig: &RigSettings, seed: u64) -> Self {
        Self {
            rig: rig.actual(),
            left_from_right: rig.left_from_right(),
            settings: rig.clone(),
            streams: ["stereo/left", "stereo/right"].map(|eye| Stream::new(seed, 0, eye)),
        }
    }

    /// From the opening of the first row to the last pose that drawing a pair needs.
    pub fn delay_s(&self) -> f64 {
        let shutter = self.rig.camera.shutter;
        let span_s = shutter.frame_span_s(self.rig.camera.intrinsics.height_px);
        (poses_in(span_s) - 1) as f64 * POSE_STEP_S
    }

    /// The views of a pair, left then right, for a vehicle that moves as `vehicle_at` says.
    /// `None` where its pose is unknown at some time.
    pub fn views(
        &self,
        number: u32,
        start: SimTime,
        vehicle_at: impl Fn(SimTime) -> Option<Isometry3<f64>>,
    ) -> Option<[View; 2]> {
        let count = (self.delay_s() / POSE_STEP_S).round() as usize + 1;
        let left: Option<Vec<_>> = (0..count)
            .map(|k| {
                let vehicle = vehicle_at(start.plus(k as f64 * POSE_STEP_S))?;
                Some(vehicle * self.rig.vehicle_from_left)
            })
            .collect();
        let left = left?;
        let right = left
            .iter()
            .map(|pose| pose * self.left_from_right)
            .collect();
        let view = |poses, stream| View {
            camera: self.rig.camera,
            start,
            motion: CameraMotion {
                first: start,
                step_s: POSE_STEP_S,
                poses,
            },
            pixel_m: 1e-6 * self.settings.pixel_um,
            lens: self.settings.lens,
            sensor: self.settings.sensor,
            noise: NoiseKey {
                stream,
                frame: number,
            },
        };
        Some([view(left, self.streams[0]), view(right, self.streams[1])])
    }
}

/// Puts two images together as the camera delivers them.
pub fn pair(number: u32, start: SimTime, images: [GrayImage; 2]) -> StereoPair {
    let [left, right] = images.map(|image| Frame {
        number,
        start,
        image,
    });
    StereoPair { left, right }
}

/// The view of a wayside camera.
pub fn wayside_view(
    calibration: &WaysideCalibration,
    camera: &WaysideCameraSettings,
    stream: Stream,
    number: u32,
    start: SimTime,
) -> View {
    View {
        camera: calibration.camera,
        start,
        motion: CameraMotion::still(calibration.world_from_camera),
        pixel_m: 1e-6 * camera.pixel_um,
        lens: camera.lens,
        sensor: camera.sensor,
        noise: NoiseKey {
            stream,
            frame: number,
        },
    }
}
