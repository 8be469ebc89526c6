//! When cameras trigger, and what the renderer needs to know to draw their frames.

use crate::bus::{CameraModel, Frame, RigCalibration, SimTime, StereoPair, WaysideCalibration};
use crate::twin::random::Stream;
use crate::twin::render::{CameraMotion, NoiseKey, View};
use crate::twin::sensors::{Exposed, RigSettings, Trigger, WaysideCameraSettings};
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

/// A frame that a camera has taken: what it says of it, and so all of it but the image.
#[derive(Clone, Copy, Debug)]
pub struct Taken {
    /// Number of the frame.
    pub number: u32,
    /// When it started, by the camera's clock.
    pub start: SimTime,
    /// What it was taken with.
    pub with: Exposed,
}

impl Taken {
    /// With its image.
    pub fn frame(&self, image: GrayImage) -> Frame {
        Frame {
            number: self.number,
            start: self.start,
            exposure_s: self.with.exposure_s,
            gain_db: self.with.gain_db,
            image,
        }
    }
}

/// The stereo camera as it is built: it may differ from the calibration.
#[derive(Clone, Debug)]
pub struct StereoCamera {
    /// Both eyes and the mount as they really are.
    pub rig: RigCalibration,
    /// Pixels, glass and sensor of either eye, and what the sheet says of the trigger.
    settings: RigSettings,
    trigger: Trigger,
    /// How much later than the left eye the right one is really triggered.
    right_later_s: f64,
    /// How many poses, [`POSE_STEP_S`] apart, cover a frame of the longest exposure that it may have.
    poses: usize,
    /// Noise of the left and right eye.
    streams: [Stream; 2],
}

impl StereoCamera {
    /// The rig as it really is, with the noise of a run's seed.
    pub fn new(rig: &RigSettings, seed: u64) -> Self {
        let trigger = Stream::new(seed, 0, "stereo/trigger");
        Self {
            rig: rig.actual(),
            settings: rig.clone(),
            trigger: Trigger::new(trigger, rig.frame_jitter_us),
            right_later_s: rig.as_built().trigger_offset_s(),
            poses: (rig.as_built().longest_span_s() / POSE_STEP_S).ceil() as usize + 1,
            streams: ["stereo/left", "stereo/right"].map(|eye| Stream::new(seed, 0, eye)),
        }
    }

    /// From the start of a pair to the last pose that drawing it needs.
    pub fn delay_s(&self) -> f64 {
        let poses_s = (self.poses - 1) as f64 * POSE_STEP_S;
        poses_s + self.right_later_s.max(0.0) + self.trigger.latest_s()
    }

    /// The views of a pair, left then right, for a vehicle that moves as `vehicle_at` says.
    /// `None` where its pose is unknown at some time.
    pub fn views(
        &self,
        number: u32,
        start: SimTime,
        vehicle_at: impl Fn(SimTime) -> Option<Isometry3<f64>>,
    ) -> Option<[View; 2]> {
        let start = self.trigger.really(number, start);
        let right_start = start.plus(self.right_later_s).max(SimTime::ZERO);
        let left_at = |time| Some(vehicle_at(time)? * self.rig.vehicle_from_left);
        let right_at = |time| Some(left_at(time)? * self.rig.left_from_right);
        let left = (&self.rig.left, self.streams[0]);
        let right = (&self.rig.right, self.streams[1]);
        Some([
            self.view(left, number, start, left_at)?,
            self.view(right, number, right_start, right_at)?,
        ])
    }

    fn view(
        &self,
        (eye, stream): (&CameraModel, Stream),
        number: u32,
        start: SimTime,
        eye_at: impl Fn(SimTime) -> Option<Isometry3<f64>>,
    ) -> Option<View> {
        let poses = (0..self.poses).map(|k| eye_at(start.plus(k as f64 * POSE_STEP_S)));
        Some(View {
            camera: *eye,
            start,
            motion: CameraMotion {
                first: start,
                step_s: POSE_STEP_S,
                poses: poses.collect::<Option<_>>()?,
            },
            pixel_m: 1e-6 * self.settings.pixel_um,
            lens: self.settings.lens,
            sensor: self.settings.sensor,
            noise: NoiseKey {
                stream,
                frame: number,
            },
        })
    }

    /// Puts two images together as the camera delivers them, with the times that its sheet has.
    pub fn pair(&self, taken: &Taken, [left, right]: [GrayImage; 2]) -> StereoPair {
        let right_taken = Taken {
            start: taken.start.plus(self.settings.trigger_offset_s()),
            ..*taken
        };
        StereoPair {
            left: taken.frame(left),
            right: right_taken.frame(right),
        }
    }
}

/// The view of a wayside camera whose frame really starts at `start`.
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

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::twin::sensors::{ExposureMode, ExposureSettings, ReadOut, RigError};

    /// A train that runs along x at 30 m/s from time zero on.
    fn running(time: SimTime) -> Option<Isometry3<f64>> {
        let run = Isometry3::translation(30.0 * time.secs(), 0.0, 0.0);
        (time >= SimTime::ZERO).then_some(run)
    }

    /// What the frames say is the sheet; what is drawn is the truth: with its own start and lens
    /// for either eye, at the place where the train is by then.
    #[test]
    fn frames_say_what_the_sheet_says() {
        let rig = RigSettings {
            trigger_offset_us: 1000.0,
            read_out: ReadOut::Up,
            calibration_error: RigError {
                trigger_offset_us: 200.0,
                k1: -0.01,
                ..RigError::default()
            },
            ..RigSettings::default()
        };
        let camera = StereoCamera::new(&rig, 1);
        let start = SimTime::from_secs(0.5);
        let [left, right] = camera.views(3, start, running).unwrap();
        assert_eq!(left.start, start);
        assert_eq!(right.start, start.plus(1.2e-3));
        assert_eq!(right.camera.shutter.first_row, 719);
        let k1 = right.camera.intrinsics.distortion.coefficients().k1;
        assert!((k1 + 0.01).abs() < 1e-12);
        let row = |view: &View, v: f64| {
            let time = view.camera.shutter.row_open(view.start, v);
            view.motion.pose_at(time).translation.x
        };
        let apart_m = row(&right, 719.0) - row(&left, 719.0);
        let eyes_m = (rig.calibration().vehicle_from_left * camera.rig.left_from_right)
            .translation
            .x
            + 0.5;
        assert!(
            (apart_m - eyes_m - 0.036).abs() < 1e-9,
            "{apart_m} {eyes_m}"
        );
        let taken = Taken {
            number: 3,
            start,
            with: Exposed {
                exposure_s: 20e-6,
                gain_db: 6.0,
            },
        };
        let pair = camera.pair(&taken, [GrayImage::new(1, 1), GrayImage::new(1, 1)]);
        for eye in [&pair.left, &pair.right] {
            assert!((eye.exposure_s - 20e-6).abs() < 1e-12 && (eye.gain_db - 6.0).abs() < 1e-12);
        }
        assert_eq!(pair.left.start, start);
        assert_eq!(pair.right.start, start.plus(1e-3));
        assert!(rig.calibration().left.intrinsics.distortion.is_none());
    }

    /// An exposure that a control may lengthen is drawn from the train's own poses to its end, which
    /// the session waits for.
    #[test]
    fn poses_cover_the_longest_exposure() {
        let rig = RigSettings {
            exposure_control: ExposureSettings {
                mode: ExposureMode::Auto,
                max_exposure_us: Some(12_000.0),
                ..ExposureSettings::default()
            },
            ..RigSettings::default()
        };
        let camera = StereoCamera::new(&rig, 1);
        let span_s = 719.0 * 22.2e-6 + 12e-3;
        assert!((camera.delay_s() - span_s).abs() < POSE_STEP_S);
        let [left, right] = camera.views(0, SimTime::ZERO, running).unwrap();
        for view in [left, right] {
            let [start, end] = [0.0, span_s].map(|s| {
                let pose = view.motion.pose_at(view.start.plus(s));
                pose.translation.x
            });
            assert!((end - start - 30.0 * span_s).abs() < 1e-9);
        }
    }

    /// Frames start about the time that they say, with the spread that was asked for, never before
    /// time zero, never later than the poses are waited for; the pair's eyes alike.
    #[test]
    fn frames_jitter_about_their_times() {
        let rig = RigSettings {
            frame_jitter_us: 100.0,
            trigger_offset_us: -400.0,
            ..RigSettings::default()
        };
        let camera = StereoCamera::new(&rig, 1);
        let mut squares = 0.0;
        for number in 0..500 {
            let start = SimTime::from_secs(f64::from(number) / 30.0);
            let [left, right] = camera.views(number, start, running).unwrap();
            let late_s = left.start.since(start);
            if number > 0 {
                assert!((right.start.since(left.start) + 4e-4).abs() < 1e-9);
                squares += late_s * late_s / 499.0;
            }
            for view in [&left, &right] {
                assert!(view.start >= SimTime::ZERO);
                let last = view
                    .start
                    .plus(0.001 * (view.motion.poses.len() - 1) as f64);
                assert!(last.since(start) <= camera.delay_s() + 1e-9);
            }
        }
        let sigma_us = 1e6 * squares.sqrt();
        assert!((90.0..110.0).contains(&sigma_us), "{sigma_us}");
    }
}
