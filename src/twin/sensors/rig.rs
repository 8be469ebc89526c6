//! The stereo rig at an end of a train, from degrees and millimetres to a calibration.
//!
//! **Why the rig looks where it does.** A lamp 1.7 m to the left and 1.5 m above the left eye is
//! to be seen whole, by both eyes, over a full unit of 10 m. Without a pitch, psi =
//! atan(10/1.7) - 64/2 = 49 deg is the smallest that reaches far enough, but then lamps nearer than
//! 4.3 m are above the picture. A pitch of 22 deg brings them in from 1.0 m on; it also turns the
//! far lamps outwards, so that psi has to grow to 51 deg (yaw 39). The visible interval is
//! then 1.04 m to 11.46 m ahead on straight track, 10.4 m of 10 ([`visible_interval`](super::visible_interval)); with
//! psi = 49 deg no pitch gives more than 8.4 m.
//!
//! **Two eyes.** They share a kind of sensor and its timing. Each has a lens of its own: the right
//! one's focal length, principal point and distortion may differ ([`RightEye`]), it may look past
//! the left one and be triggered later. All that is on the calibration sheet, and the stack has to
//! live with it.
//!
//! **What a calibration misses.** [`RigError`]: of both eyes focal length, principal point,
//! distortion of r^2, line time; the baseline; the attitude of the rig; the right eye's attitude
//! against the left and its trigger. Of the angles between the eyes one enters every disparity, the
//! vergence: f times it, 0.07 px for 0.004 deg, which at 10 m puts a lamp off by 5 cm. A trigger
//! that is late by 0.1 ms, at 100 km/h, is a baseline off by 2.8 mm of 120.
//!
//! **What it does not do.** The right eye sits on the left one's x axis. What a calibration misses
//! of the lenses it misses of both alike. Both eyes share the jitter of the trigger, and one line
//! time: it does not drift. Nothing changes with temperature or vibration.

use super::camera::{
    CameraSettings, EXPOSURE_US, FOCAL_ERROR_MM, FOCAL_MM, FRAMES_PER_S, JITTER_US,
    LINE_TIME_ERROR_US, LINE_TIME_US, PIXEL_UM, ReadOut, SIDE_PX, check_half, mounted,
};
use super::{ClockSettings, ExposureSettings, WaysideError};
use crate::bus::{DistortionCoefficients, RigCalibration, TrainEnd};
use crate::settings::{Checker, settings};
use crate::twin::render::{BLUR_PX, LensSettings, SensorSettings};
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// Distances of the eyes, mm: a train is 3 m wide.
const BASELINE_MM: RangeInclusive<f64> = 1.0..=3000.0;

/// The side of a train on which a rig looks out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MountSide {
    /// To the left, as one looks out of the cab.
    #[default]
    Left,
    /// To the right.
    Right,
}

settings! {
    /// The stereo rig at an end of a train: where it is mounted, what it sees, when.
    pub struct RigSettings {
        /// Focal length of the left eye, mm. Default 3.9 (1040 px).
        focal_length_mm: f64 = 3.9, in FOCAL_MM;
        /// Width and height of a pixel, um.
        pixel_um: f64 = 3.75, in PIXEL_UM;
        /// Columns of either eye's image.
        width_px: u32 = 1280, in SIDE_PX;
        /// Rows of either eye's image.
        height_px: u32 = 720, in SIDE_PX;
        /// Left eye's principal point right of the picture's middle, px.
        principal_u_px: f64 = 0.0;
        /// Left eye's principal point below the picture's middle, px.
        principal_v_px: f64 = 0.0;
        /// Distortion of the left eye's lens, as OpenCV has it. Default: none.
        distortion: DistortionCoefficients = DistortionCoefficients::default();
        /// By how much the right eye differs from the left one. Default: not at all.
        right: RightEye = RightEye::default(), nested;
        /// Distance between the eyes, mm; the right eye sits that far along the left eye's right
        /// hand axis.
        baseline_mm: f64 = 120.0, in BASELINE_MM;
        /// Time from the opening of a row to the opening of the next, us; 0 for a global shutter.
        line_time_us: f64 = 22.2, in LINE_TIME_US;
        /// Whether rows are read downwards or upwards, in both eyes.
        read_out: ReadOut = ReadOut::Down;
        /// How long every row collects light, us. Longer than a chip of the lamps' code (45 us in
        /// the shipped tunnels) it blurs the stripes away.
        exposure_us: f64 = 30.0, in EXPOSURE_US;
        /// Pairs of images a second.
        pairs_per_s: f64 = 30.0, in FRAMES_PER_S;
        /// By how much later than the left eye the right one is triggered, us; negative: earlier.
        /// Its frames say so.
        trigger_offset_us: f64 = 0.0, in MOST_OFFSET_US;
        /// Standard deviation of a pair's true start about the one that its frames say, us, drawn
        /// anew for each and the same for both eyes; held at four times that.
        frame_jitter_us: f64 = 0.0, in JITTER_US;
        /// The end of the train that it is at, with the inertial unit. At the rear end it looks back:
        /// what is ahead and left of it is behind the train and on its right.
        end: TrainEnd = TrainEnd::Front;
        /// The side of the train that it is made for: `right` mirrors `lateral_m` and `yaw_deg`.
        side: MountSide = MountSide::Left;
        /// Left eye, m ahead of the end of the train (negative: behind the windscreen).
        forward_m: f64 = -0.5, in -5.0..=5.0;
        /// Left eye, m to the left of the centreline.
        lateral_m: f64 = 1.0, in -2.0..=2.0;
        /// Left eye, m above top of rail.
        height_m: f64 = 1.7, in 0.01..=6.0;
        /// Turn of the optical axis from straight ahead, deg, left positive; psi = 90 - yaw.
        yaw_deg: f64 = 39.0, in -180.0..=180.0;
        /// Tilt of the optical axis, deg, up positive.
        pitch_deg: f64 = 22.0, in -89.0..=89.0;
        /// By how much the mount really differs from the calibration that the stack is given.
        /// Default: not at all.
        calibration_error: RigError = RigError::default(), nested;
        /// The glass of either eye.
        lens: LensSettings = LensSettings::default(), nested;
        /// From photons to digital numbers.
        sensor: SensorSettings = SensorSettings::default(), nested;
        /// Exposure and gain that follow the light. Default: fixed.
        exposure_control: ExposureSettings = ExposureSettings::default(), nested;
        /// Its clock.
        clock: ClockSettings = ClockSettings::default(), nested;
    }
    also check_together
}

settings! {
    /// By how much the right eye differs from the left, as the calibration sheet has it: its value
    /// less the left eye's.
    #[derive(Copy)]
    pub struct RightEye {
        /// Focal length, mm.
        focal_length_mm: f64 = 0.0, in FOCAL_ERROR_MM;
        /// Principal point, px to the right.
        principal_u_px: f64 = 0.0;
        /// Principal point, px down.
        principal_v_px: f64 = 0.0;
        /// Coefficients of distortion.
        distortion: DistortionCoefficients = DistortionCoefficients::default();
        /// Turn of its optical axis in the left eye's frame, deg, to the left: positive where the
        /// eyes converge.
        yaw_deg: f64 = 0.0, in -20.0..=20.0;
        /// Tilt of its optical axis in the left eye's frame, deg, up positive.
        pitch_deg: f64 = 0.0, in -20.0..=20.0;
        /// Turn about its optical axis, deg, clockwise as it looks.
        roll_deg: f64 = 0.0, in -20.0..=20.0;
    }
}

settings! {
    /// What a calibration got wrong: the true value less the calibrated one.
    #[derive(Copy)]
    pub struct RigError {
        /// Focal length, mm.
        focal_length_mm: f64 = 0.0, in FOCAL_ERROR_MM;
        /// Principal point of both eyes, px to the right.
        principal_u_px: f64 = 0.0, in -100.0..=100.0;
        /// Principal point of both eyes, px down.
        principal_v_px: f64 = 0.0, in -100.0..=100.0;
        /// Distortion of r^2 of both lenses.
        k1: f64 = 0.0, in -1.0..=1.0;
        /// Blur of both lenses, px (`lens.blur_px`); the sum is 0 to 50.
        blur_px: f64 = 0.0;
        /// Line time, us.
        line_time_us: f64 = 0.0, in LINE_TIME_ERROR_US;
        /// How much later the right eye is triggered than its frames say, us.
        trigger_offset_us: f64 = 0.0, in MOST_OFFSET_US;
        /// Baseline, mm.
        baseline_mm: f64 = 0.0, in -1000.0..=1000.0;
        /// Yaw, deg.
        yaw_deg: f64 = 0.0, in -45.0..=45.0;
        /// Pitch, deg.
        pitch_deg: f64 = 0.0, in -45.0..=45.0;
        /// Yaw of the right eye against the left, deg, positive where the eyes converge more than
        /// the sheet has it.
        vergence_deg: f64 = 0.0, in -5.0..=5.0;
        /// Pitch of the right eye against the left, deg, up positive.
        right_pitch_deg: f64 = 0.0, in -5.0..=5.0;
        /// Roll of the right eye against the left, deg, clockwise as it looks.
        right_roll_deg: f64 = 0.0, in -5.0..=5.0;
    }
}

impl RigSettings {
    /// The calibration sheet, which the stack gets.
    pub fn calibration(&self) -> RigCalibration {
        let mirror = match self.side {
            MountSide::Left => 1.0,
            MountSide::Right => -1.0,
        };
        RigCalibration {
            left: self.left_eye().camera(),
            right: self.right_eye().camera(),
            left_from_right: self.left_from_right(),
            vehicle_from_left: mounted(
                Vector3::new(self.forward_m, mirror * self.lateral_m, self.height_m),
                mirror * self.yaw_deg.to_radians(),
                self.pitch_deg.to_radians(),
            ),
        }
    }

    /// The rig as it really is, through which the world is drawn.
    pub fn actual(&self) -> RigCalibration {
        self.as_built().calibration()
    }

    /// By how much later than the left eye the right one is triggered, as the sheet has it.
    pub fn trigger_offset_s(&self) -> f64 {
        1e-6 * self.trigger_offset_us
    }

    /// From the start of an eye's frame to the closing of its last row, with the longest exposure
    /// that it may have.
    pub fn longest_span_s(&self) -> f64 {
        self.left_eye().longest_span_s()
    }

    /// From the start that a pair says to the closing of its last row, at the latest.
    pub fn pair_span_s(&self) -> f64 {
        self.longest_span_s() + self.trigger_offset_s().max(0.0) + self.left_eye().most_jitter_s()
    }

    /// These settings with their errors of calibration put into the values.
    pub fn as_built(&self) -> Self {
        let error = self.calibration_error;
        Self {
            focal_length_mm: self.focal_length_mm + error.focal_length_mm,
            principal_u_px: self.principal_u_px + error.principal_u_px,
            principal_v_px: self.principal_v_px + error.principal_v_px,
            distortion: DistortionCoefficients {
                k1: self.distortion.k1 + error.k1,
                ..self.distortion
            },
            lens: LensSettings {
                blur_px: self.lens.blur_px + error.blur_px,
                ..self.lens
            },
            line_time_us: self.line_time_us + error.line_time_us,
            trigger_offset_us: self.trigger_offset_us + error.trigger_offset_us,
            baseline_mm: self.baseline_mm + error.baseline_mm,
            yaw_deg: self.yaw_deg + error.yaw_deg,
            pitch_deg: self.pitch_deg + error.pitch_deg,
            right: RightEye {
                yaw_deg: self.right.yaw_deg + error.vergence_deg,
                pitch_deg: self.right.pitch_deg + error.right_pitch_deg,
                roll_deg: self.right.roll_deg + error.right_roll_deg,
                ..self.right
            },
            calibration_error: RigError::default(),
            ..self.clone()
        }
    }

    /// Where the right eye is, in the left eye's frame (x right, y down, z ahead).
    fn left_from_right(&self) -> Isometry3<f64> {
        let turn = |axis: &Unit<Vector3<f64>>, deg: f64| {
            UnitQuaternion::from_axis_angle(axis, deg.to_radians())
        };
        let eye = &self.right;
        Isometry3::from_parts(
            Translation3::new(1e-3 * self.baseline_mm, 0.0, 0.0),
            turn(&Vector3::y_axis(), -eye.yaw_deg)
                * turn(&Vector3::x_axis(), eye.pitch_deg)
                * turn(&Vector3::z_axis(), eye.roll_deg),
        )
    }

    fn check_together(&self, check: &mut Checker<'_>) {
        let left = self.left_eye();
        left.check_camera("pairs_per_s", check);
        self.right.check_eye(&left, &mut check.below("right"));
        self.check_errors(&mut check.below("calibration_error"));
        self.check_built(check);
    }

    fn check_errors(&self, check: &mut Checker<'_>) {
        let error = self.calibration_error;
        check_half(
            "focal_length_mm",
            error.focal_length_mm,
            self.focal_length_mm,
            check,
        );
        check_half("line_time_us", error.line_time_us, self.line_time_us, check);
        check_half("baseline_mm", error.baseline_mm, self.baseline_mm, check);
        // The lens with its error must blur as a lens can.
        let (sheet_px, (least_px, most_px)) = (self.lens.blur_px, BLUR_PX.into_inner());
        if BLUR_PX.contains(&sheet_px) {
            check.within(
                "blur_px",
                error.blur_px,
                least_px - sheet_px..=most_px - sheet_px,
            );
        }
    }

    /// Both eyes as they really are. What holds for both is said once.
    fn check_built(&self, check: &mut Checker<'_>) {
        let built = self.as_built();
        for (actual, sheet) in [
            (built.left_eye(), self.left_eye()),
            (built.right_eye(), self.right_eye()),
        ] {
            let sheet = sheet.exposed_longest();
            actual.exposed_longest().check_actual(&sheet, check);
        }
    }

    fn right_eye(&self) -> CameraSettings {
        self.right.camera(&self.left_eye())
    }

    /// The left eye as a camera of its own.
    pub(super) fn left_eye(&self) -> CameraSettings {
        CameraSettings {
            focal_length_mm: self.focal_length_mm,
            pixel_um: self.pixel_um,
            width_px: self.width_px,
            height_px: self.height_px,
            principal_u_px: self.principal_u_px,
            principal_v_px: self.principal_v_px,
            distortion: self.distortion,
            read_out: self.read_out,
            line_time_us: self.line_time_us,
            exposure_us: self.exposure_us,
            frames_per_s: self.pairs_per_s,
            frame_jitter_us: self.frame_jitter_us,
            calibration_error: WaysideError::default(),
            lens: self.lens,
            sensor: self.sensor,
            exposure_control: self.exposure_control,
            clock: self.clock,
        }
    }
}

/// Further apart two triggers are not one pair's.
const MOST_OFFSET_US: RangeInclusive<f64> = -10_000.0..=10_000.0;

impl RightEye {
    /// The right eye, where the left one is `left`.
    fn camera(&self, left: &CameraSettings) -> CameraSettings {
        let (own, left_lens) = (self.distortion, left.distortion);
        CameraSettings {
            focal_length_mm: left.focal_length_mm + self.focal_length_mm,
            principal_u_px: left.principal_u_px + self.principal_u_px,
            principal_v_px: left.principal_v_px + self.principal_v_px,
            distortion: DistortionCoefficients {
                k1: left_lens.k1 + own.k1,
                k2: left_lens.k2 + own.k2,
                k3: left_lens.k3 + own.k3,
                p1: left_lens.p1 + own.p1,
                p2: left_lens.p2 + own.p2,
            },
            ..*left
        }
    }

    fn check_eye(&self, left: &CameraSettings, check: &mut Checker<'_>) {
        let (own_mm, left_mm) = (self.focal_length_mm, left.focal_length_mm);
        check_half("focal_length_mm", own_mm, left_mm, check);
        self.camera(left).check_lens(check);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::settings::{Problem, Settings};
    use nalgebra::Point3;

    /// A turn to the wrong side, pitch before yaw, mirrored camera axes.
    #[test]
    fn yaw_is_to_the_left_and_pitch_is_up() {
        let rig = RigSettings::default();
        let vehicle_from_left = rig.calibration().vehicle_from_left;
        let (yaw, pitch) = (rig.yaw_deg.to_radians(), rig.pitch_deg.to_radians());
        let axis = Vector3::new(
            pitch.cos() * yaw.cos(),
            pitch.cos() * yaw.sin(),
            pitch.sin(),
        );
        assert!((vehicle_from_left * Vector3::z() - axis).norm() < 1e-12);
        // Rows stay level: the right hand axis has no height, and points to the right.
        let right = Vector3::new(yaw.sin(), -yaw.cos(), 0.0);
        assert!((vehicle_from_left * Vector3::x() - right).norm() < 1e-12);
    }

    /// The errors belong to the rig as built, not to its calibration sheet.
    #[test]
    fn calibration_error_moves_the_actual_rig_only() {
        let exact = RigSettings::default().calibration();
        let rig = RigSettings {
            calibration_error: RigError {
                baseline_mm: 1.0,
                k1: 0.01,
                principal_u_px: 2.0,
                line_time_us: 0.1,
                right_roll_deg: 0.2,
                ..RigError::default()
            },
            ..RigSettings::default()
        };
        assert_eq!(rig.calibration(), exact);
        let actual = rig.actual();
        assert!((actual.baseline_m() - 0.121).abs() < 1e-12);
        for eye in [actual.left, actual.right] {
            let k1 = eye.intrinsics.distortion.coefficients().k1;
            assert!((k1 - 0.01).abs() < 1e-12);
            assert!((eye.intrinsics.cx_px - exact.left.intrinsics.cx_px - 2.0).abs() < 1e-12);
            assert!((eye.shutter.line_time_s - 22.3e-6).abs() < 1e-12);
        }
        let turned = actual.left_from_right.rotation.angle();
        assert!((turned - 0.2_f64.to_radians()).abs() < 1e-12);
    }

    /// Eyes that converge see a smaller disparity, by f (1 + x^2) times the angle with x = (u -
    /// cx) / f in the right eye: a turn to the wrong side, degrees for radians, eyes exchanged.
    #[test]
    fn vergence_takes_from_the_disparity() {
        let mut rig = RigSettings::default();
        let lamp = Point3::new(4.0, 2.0, 8.0);
        let camera = rig.left_eye().camera().intrinsics;
        let right_u_px = |rig: &RigSettings| {
            let seen = rig.actual().left_from_right.inverse() * lamp;
            camera.project(&seen).unwrap().x
        };
        let parallel = right_u_px(&rig);
        assert!((parallel - camera.cx_px - camera.fx_px * 3.88 / 8.0).abs() < 1e-9);
        rig.calibration_error.vergence_deg = 0.01;
        let x: f64 = 3.88 / 8.0;
        let off_px = camera.fx_px * (1.0 + x * x) * 0.01_f64.to_radians();
        assert!((right_u_px(&rig) - parallel - off_px).abs() < 1e-4);
    }

    /// A right eye that is pitched up sees things lower, one rolled clockwise sees what is right of
    /// its axis higher: wrong signs, axes exchanged.
    #[test]
    fn the_right_eye_turns_as_it_says() {
        let seen = |right: RightEye, x: f64| {
            let rig = RigSettings {
                right,
                ..RigSettings::default()
            };
            rig.left_from_right().rotation.inverse() * Vector3::new(x, 0.0, 1.0)
        };
        let eye = RightEye::default();
        let up = RightEye {
            pitch_deg: 1.0,
            ..eye
        };
        assert!((seen(up, 0.0).y - 1_f64.to_radians().sin()).abs() < 1e-12);
        let clockwise = RightEye {
            roll_deg: 1.0,
            ..eye
        };
        assert!((seen(clockwise, 0.5).y + 0.5 * 1_f64.to_radians().sin()).abs() < 1e-12);
        let left = RightEye {
            yaw_deg: 1.0,
            ..eye
        };
        assert!((seen(left, 0.0).x - 1_f64.to_radians().sin()).abs() < 1e-12);
    }

    fn problems(text: &str) -> Vec<Problem> {
        let rig: RigSettings = toml::from_str(text).unwrap();
        let mut problems = Vec::new();
        rig.check("rig", &mut problems);
        problems
    }

    /// Each thing that no camera can be is refused where it is said, with the numbers; what is
    /// just about possible is not.
    #[test]
    fn impossible_cameras_are_refused() {
        for (text, key, what) in [
            (
                "focal_length_mm = 0.0",
                "focal_length_mm",
                "0 mm is out of range",
            ),
            (
                "exposure_us = 40000.0",
                "exposure_us",
                "an exposure of 40000 us is longer than the frame, 33333 us at 30 pairs_per_s",
            ),
            (
                "height_px = 1600",
                "height_px",
                "1600 rows of 22.2 us take 35528 us, but a frame lasts 33333 us at 30 pairs_per_s",
            ),
            (
                "principal_u_px = 700.0",
                "principal_u_px",
                "700 px is out of range",
            ),
            (
                "distortion = { k1 = -0.6 }",
                "distortion",
                "it turns back at r = 0.707 (35.3 deg off the axis), which is seen 515 px from the \
                 principal point, inside the picture: pixel (1279, 719) is 734 px from it",
            ),
            (
                "distortion = { p1 = 1.0 }",
                "distortion.p1",
                "1 is out of range",
            ),
            (
                "right = { distortion = { k1 = -0.6 } }",
                "right.distortion",
                "it turns back at r = 0.707",
            ),
            (
                "right = { focal_length_mm = -3.9 }",
                "right.focal_length_mm",
                "-3.9 mm",
            ),
            (
                "right = { yaw_deg = 30.0 }",
                "right.yaw_deg",
                "30 deg is out of range",
            ),
            (
                "trigger_offset_us = 20000.0",
                "trigger_offset_us",
                "20000 us is out of range",
            ),
            (
                "frame_jitter_us = 5000.0",
                "frame_jitter_us",
                "5000 us is out of range",
            ),
            (
                "frame_jitter_us = -1.0",
                "frame_jitter_us",
                "-1 us is out of range",
            ),
            (
                "calibration_error = { k1 = -0.6 }",
                "calibration_error",
                "it turns back",
            ),
            (
                "calibration_error = { blur_px = -0.6 }",
                "calibration_error.blur_px",
                "-0.6 px is out of range",
            ),
            (
                "lens = { blur_px = 2.0 }\ncalibration_error = { blur_px = 48.5 }",
                "calibration_error.blur_px",
                "48.5 px is out of range",
            ),
            (
                "calibration_error = { blur_px = nan }",
                "calibration_error.blur_px",
                "NaN px is out of range",
            ),
            (
                "right = { distortion = { k1 = -0.2 } }\ncalibration_error = { k1 = -0.2 }",
                "calibration_error",
                "it turns back at r = 0.866",
            ),
            (
                "exposure_control = { mode = 'auto', max_exposure_us = 20000.0 }",
                "exposure_control.max_exposure_us",
                "exposed for 20000 us, 720 rows of 22.2 us take 35962 us, but a frame lasts 33333 us",
            ),
            (
                "exposure_control = { mode = 'auto', max_exposure_us = 17300.0 }\n\
                 calibration_error = { line_time_us = 0.3 }",
                "calibration_error.line_time_us",
                "the line time is really 22.5 us, in which 720 rows take 33477 us",
            ),
            (
                "exposure_us = 5.0\nexposure_control = { mode = 'auto' }",
                "exposure_control.min_exposure_us",
                "10 us is out of range",
            ),
            (
                "height_px = 1490\ncalibration_error = { line_time_us = 1.0 }",
                "calibration_error.line_time_us",
                "the line time is really 23.2 us, in which 1490 rows take 34575 us",
            ),
        ] {
            let found = problems(text);
            let said = |p: &Problem| {
                p.key == format!("rig.{key}") && p.what.starts_with(what) && !p.remedy.is_empty()
            };
            assert!(found.iter().any(said), "{text}: {found:?}");
        }
        for fine in [
            "",
            "line_time_us = 0.0",
            "width_px = 8192\nheight_px = 8192\nline_time_us = 0.0",
            "calibration_error = { blur_px = -0.5 }",
            "exposure_us = 5.0\nexposure_control = { max_exposure_us = 20000.0 }",
            "exposure_control = { mode = 'auto', max_exposure_us = 17300.0 }",
            "read_out = \"up\"\ntrigger_offset_us = -500.0\nframe_jitter_us = 20.0",
            "focal_length_mm = 2.93\ndistortion = { k1 = -0.283, k2 = 0.074, p1 = 2e-4 }",
            "right = { roll_deg = -0.5, principal_v_px = 12.0, distortion = { k1 = 0.01 } }",
        ] {
            assert_eq!(problems(fine), [], "{fine}");
        }
    }
}
