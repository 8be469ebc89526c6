//! Cameras as a user mounts them, and the camera of a wayside device, from degrees and millimetres
//! to calibrations.
//!
//! A mount turns by yaw about the vertical (left positive) and then by pitch about its own right
//! hand axis (up positive). Zhang et al. 2023 measure psi from the lateral direction: psi = 90 deg - yaw.

use super::{ClockSettings, ExposureSettings};
use crate::bus::{CameraModel, DistortionCoefficients, Intrinsics, Shutter, WaysideCalibration};
use crate::settings::{Checker, settings};
use crate::track::{Track, TrackId, TrackPoint, WaysideSite};
use crate::twin::render::{LensSettings, SensorSettings};
use nalgebra::{Isometry3, Matrix3, Point2, Rotation3, Translation3, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::de::{DeserializeOwned, Error};
use serde::{Deserialize, Deserializer, Serialize};
use std::ops::RangeInclusive;

/// Which row of a rolling shutter opens first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReadOut {
    /// The top one.
    #[default]
    Down,
    /// The bottom one, as behind a sensor that is mounted upside down.
    Up,
}

/// Columns and rows: at most the widest texture that every graphics adapter has.
pub(super) const SIDE_PX: RangeInclusive<f64> = 16.0..=8192.0;

/// Frames a second. The world remembers poses for a minute at most: twice a frame of 10 s, with all
/// that makes images late, fits into it. More than one in a step of the physics (1 ms) show nothing new.
pub(super) const FRAMES_PER_S: RangeInclusive<f64> = 0.1..=1000.0;
/// Exposures, us: the shortest of electronic shutters is over 0.1 us, and for all of an exposure the
/// pose of every millisecond is kept.
pub(super) const EXPOSURE_US: RangeInclusive<f64> = 0.1..=1e7;
/// Line times, us: at 10 s a line no frame fits any more.
pub(super) const LINE_TIME_US: RangeInclusive<f64> = 0.0..=1e7;
/// Jitter, us: a tenth of the longest frame; frames that would overtake each other are refused too.
pub(super) const JITTER_US: RangeInclusive<f64> = 0.0..=1e7;
/// Errors of the line time, us.
pub(super) const LINE_TIME_ERROR_US: RangeInclusive<f64> = -1e7..=1e7;
/// Focal lengths, mm: from less than the smallest lens to telescopes.
pub(super) const FOCAL_MM: RangeInclusive<f64> = 0.1..=10_000.0;
/// Differences of focal lengths, mm.
pub(super) const FOCAL_ERROR_MM: RangeInclusive<f64> = -1000.0..=1000.0;
/// Pixels, um: wider than any sensor's.
pub(super) const PIXEL_UM: RangeInclusive<f64> = 0.1..=1000.0;

/// Draws of jitter farther off than this many standard deviations are held there.
pub(super) const MOST_SIGMAS: f64 = 4.0;

impl CameraSettings {
    /// The camera alone.
    pub fn camera(&self) -> CameraModel {
        let f_px = self.focal_length_mm * 1e3 / self.pixel_um;
        let centred = Intrinsics::centred(self.width_px, self.height_px, f_px);
        CameraModel {
            intrinsics: Intrinsics {
                cx_px: centred.cx_px + self.principal_u_px,
                cy_px: centred.cy_px + self.principal_v_px,
                distortion: self.distortion.into(),
                ..centred
            },
            shutter: Shutter {
                line_time_s: self.line_time_us * 1e-6,
                exposure_s: self.exposure_us * 1e-6,
                first_row: match self.read_out {
                    ReadOut::Down => 0,
                    ReadOut::Up => self.height_px.saturating_sub(1),
                },
            },
            blur_px: self.lens.blur_px,
        }
    }

    /// All of it but the errors of calibration; `rate_key` is what the frames a second are called.
    pub(super) fn check_camera(&self, rate_key: &str, check: &mut Checker<'_>) {
        self.check_optics(rate_key, check);
        self.check_jitter(check);
        self.check_control(rate_key, check);
    }

    fn check_optics(&self, rate_key: &str, check: &mut Checker<'_>) {
        for (key, value, range) in [
            ("focal_length_mm", self.focal_length_mm, FOCAL_MM),
            ("pixel_um", self.pixel_um, PIXEL_UM),
            ("exposure_us", self.exposure_us, EXPOSURE_US),
            (rate_key, self.frames_per_s, FRAMES_PER_S),
            ("line_time_us", self.line_time_us, LINE_TIME_US),
        ] {
            check.within(key, value, range);
        }
        self.check_frame_time(rate_key, check);
        self.check_lens(check);
    }

    /// Principal point and distortion.
    pub(super) fn check_lens(&self, check: &mut Checker<'_>) {
        for (key, value, size_px) in [
            ("principal_u_px", self.principal_u_px, self.width_px),
            ("principal_v_px", self.principal_v_px, self.height_px),
        ] {
            let half_px = 0.5 * f64::from(size_px);
            check.within(key, value, -half_px..=half_px);
        }
        let DistortionCoefficients { k1, k2, k3, p1, p2 } = self.distortion;
        for (key, value) in [("k1", k1), ("k2", k2), ("k3", k3)] {
            check.within(&format!("distortion.{key}"), value, -10.0..=10.0);
        }
        for (key, value) in [("p1", p1), ("p2", p2)] {
            check.within(&format!("distortion.{key}"), value, -0.2..=0.2);
        }
        self.check_reach("distortion", check);
    }

    /// The polynomial must hold all over the picture.
    fn check_reach(&self, key: &str, check: &mut Checker<'_>) {
        let lens = self.camera().intrinsics;
        let (right, bottom) = (
            f64::from(self.width_px) - 1.0,
            f64::from(self.height_px) - 1.0,
        );
        let reach = lens.distortion.reach();
        let corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)];
        let beyond = corners
            .into_iter()
            .map(|(u, v)| (u, v, lens.ray(u, v).xy().norm()))
            .filter(|(.., radius)| radius.is_finite() && *radius > reach);
        let Some((u, v, radius)) = beyond.max_by(|a, b| a.2.total_cmp(&b.2)) else {
            return;
        };
        let towards = lens.ray(u, v).xy() * (reach / radius);
        let rim = lens.project(&towards.push(1.0).into());
        let middle = Point2::new(lens.cx_px, lens.cy_px);
        let rim_px = rim.map_or(0.0, |p| (p - middle).norm());
        let corner_px = (Point2::new(u, v) - middle).norm();
        check.problem(
            key,
            format!(
                "it turns back at r = {reach:.3} ({:.1} deg off the axis), which is seen \
                 {rim_px:.0} px from the principal point, inside the picture: pixel ({u}, {v}) is \
                 {corner_px:.0} px from it",
                reach.atan().to_degrees()
            ),
            "take coefficients that were fitted out to the corners, or a longer focal length or \
             fewer pixels",
        );
    }

    /// Whether nothing is wrong.
    fn is_sound(&self) -> bool {
        let mut problems = Vec::new();
        self.check_optics("", &mut Checker::new("", &mut problems));
        problems.is_empty()
    }

    /// What the errors of calibration spoil of a camera that is sound by its sheet.
    pub(super) fn check_actual(&self, sheet: &Self, check: &mut Checker<'_>) {
        if !sheet.is_sound() {
            return;
        }
        self.check_reach("calibration_error", check);
        let (span_us, frame_us) = (self.span_us(), 1e6 / self.frames_per_s);
        if span_us > frame_us {
            check.problem(
                "calibration_error.line_time_us",
                format!(
                    "the line time is really {} us, in which {} rows take {span_us:.0} us, but a \
                     frame lasts {frame_us:.0} us",
                    self.line_time_us, self.height_px
                ),
                "give a smaller error",
            );
        }
    }

    /// This camera with the longest exposure that its control may choose.
    pub(super) fn exposed_longest(&self) -> Self {
        Self {
            exposure_us: self.exposure_control.longest_us(self.exposure_us),
            ..*self
        }
    }

    /// A control may lengthen the exposure: what holds for the written one holds for the longest.
    fn check_control(&self, rate_key: &str, check: &mut Checker<'_>) {
        let mut control = check.below("exposure_control");
        self.exposure_control
            .check_limits(self.exposure_us, &mut control);
        let longest = self.exposed_longest();
        let (span_us, frame_us) = (longest.span_us(), 1e6 / self.frames_per_s);
        // Of a written one that is too long, the camera's own check tells.
        if self.span_us() <= frame_us && span_us > frame_us {
            control.problem(
                "max_exposure_us",
                format!(
                    "exposed for {} us, {} rows of {} us take {span_us:.0} us, but a frame lasts \
                     {frame_us:.0} us at {} {rate_key}",
                    longest.exposure_us, self.height_px, self.line_time_us, self.frames_per_s,
                ),
                format!(
                    "give at most {:.0} us, or lower height_px, line_time_us or {rate_key}",
                    (frame_us - span_us + longest.exposure_us).floor(),
                ),
            );
        }
    }

    /// The latest that a frame can start after the time that it says.
    pub(super) fn most_jitter_s(&self) -> f64 {
        1e-6 * MOST_SIGMAS * self.frame_jitter_us
    }

    /// Jitter must not let frames overtake each other.
    fn check_jitter(&self, check: &mut Checker<'_>) {
        let most_us = 1e6 / (2.0 * MOST_SIGMAS * self.frames_per_s);
        if most_us.is_finite() && most_us > 0.0 {
            check.within(
                "frame_jitter_us",
                self.frame_jitter_us,
                0.0..=most_us.floor(),
            );
        }
    }

    /// From the opening of the first row to the closing of the last.
    pub(super) fn span_s(&self) -> f64 {
        self.camera().shutter.frame_span_s(self.height_px)
    }

    fn span_us(&self) -> f64 {
        1e6 * self.span_s()
    }

    /// The last row must close before the next frame's first one opens.
    fn check_frame_time(&self, rate_key: &str, check: &mut Checker<'_>) {
        let frame_us = 1e6 / self.frames_per_s;
        if !(frame_us.is_finite() && frame_us > 0.0) {
            return;
        }
        let span_us = self.span_us();
        let read_us = span_us - self.exposure_us;
        if self.exposure_us > frame_us {
            check.problem(
                "exposure_us",
                format!(
                    "an exposure of {} us is longer than the frame, {frame_us:.0} us at {} {rate_key}",
                    self.exposure_us, self.frames_per_s
                ),
                format!(
                    "expose for at most {:.0} us, or lower {rate_key}",
                    (frame_us - read_us).max(0.0)
                ),
            );
            return;
        }
        if span_us > frame_us {
            let fits = ((frame_us - self.exposure_us) / self.line_time_us).floor() + 1.0;
            check.problem(
                "height_px",
                format!(
                    "{} rows of {} us take {span_us:.0} us, but a frame lasts {frame_us:.0} us at {} {rate_key}",
                    self.height_px, self.line_time_us, self.frames_per_s
                ),
                format!(
                    "expose for at most {:.0} us, read at most {fits:.0} rows, or lower line_time_us or {rate_key}",
                    (frame_us - read_us).max(0.0)
                ),
            );
        }
    }
}

settings! {
    /// The camera of a wayside device. Where it hangs and looks is in the tunnel file.
    // The eyes of a rig are worked out as cameras, too.
    #[derive(Copy)]
    pub struct CameraSettings {
        /// Focal length, mm. Default 4.1 (1093 px: 83 deg across).
        focal_length_mm: f64 = 4.1, in FOCAL_MM;
        /// Width and height of a pixel, um.
        pixel_um: f64 = 3.75, in PIXEL_UM;
        /// Columns.
        width_px: u32 = 1920, in SIDE_PX;
        /// Rows.
        height_px: u32 = 1080, in SIDE_PX;
        /// Principal point right of the picture's middle, px.
        principal_u_px: f64 = 0.0;
        /// Principal point below the picture's middle, px.
        principal_v_px: f64 = 0.0;
        /// Distortion of the lens, as OpenCV has it. Default: none.
        distortion: DistortionCoefficients = DistortionCoefficients::default();
        /// Time from the opening of a row to the opening of the next, us.
        line_time_us: f64 = 14.8, in LINE_TIME_US;
        /// Whether rows are read downwards or upwards.
        read_out: ReadOut = ReadOut::Down;
        /// How long every row collects light, us.
        exposure_us: f64 = 16_000.0, in EXPOSURE_US;
        /// Frames a second.
        frames_per_s: f64 = 10.0, in FRAMES_PER_S;
        /// Standard deviation of a frame's true start about the one that it says, us, drawn anew
        /// for each; held at four times that.
        frame_jitter_us: f64 = 0.0, in JITTER_US;
        /// By how much the device really differs from the calibration that the stack is given.
        /// Default: not at all.
        calibration_error: WaysideError = WaysideError::default(), nested;
        /// The glass. What is left out is as with the rig, but `f_number`, whose default is 1.0.
        #[serde(deserialize_with = "wayside_lens")]
        lens: LensSettings = LensSettings { f_number: 1.0, ..LensSettings::default() },
            nested;
        /// From photons to digital numbers. What is left out is as with the rig, but `gain_db`,
        /// whose default is 9.4.
        #[serde(deserialize_with = "wayside_sensor")]
        sensor: SensorSettings = SensorSettings { gain_db: 9.4, ..SensorSettings::default() },
            nested;
        /// Exposure and gain that follow the light. Default: fixed.
        exposure_control: ExposureSettings = ExposureSettings::default(), nested;
        /// Its clock.
        clock: ClockSettings = ClockSettings::default(), nested;
    }
    also check_together
}

fn wayside_lens<'de, D: Deserializer<'de>>(input: D) -> Result<LensSettings, D::Error> {
    over(CameraSettings::default().lens, input)
}

fn wayside_sensor<'de, D: Deserializer<'de>>(input: D) -> Result<SensorSettings, D::Error> {
    over(CameraSettings::default().sensor, input)
}

/// Reads a table whose missing keys are those of `base`, not those of its type.
fn over<'de, D, T>(base: T, input: D) -> Result<T, D::Error>
where
    D: Deserializer<'de>,
    T: Serialize + DeserializeOwned,
{
    let given = toml::Table::deserialize(input)?;
    let mut whole = toml::Table::try_from(base).map_err(Error::custom)?;
    whole.extend(given);
    whole.try_into().map_err(Error::custom)
}

settings! {
    /// What survey and calibration of a wayside device got wrong: the true value less the
    /// calibrated one. A lidar in the same housing is off by the same.
    #[derive(Copy)]
    pub struct WaysideError {
        /// Focal length, mm.
        focal_length_mm: f64 = 0.0, in FOCAL_ERROR_MM;
        /// Principal point, px to the right.
        principal_u_px: f64 = 0.0, in -100.0..=100.0;
        /// Principal point, px down.
        principal_v_px: f64 = 0.0, in -100.0..=100.0;
        /// Distortion of r^2.
        k1: f64 = 0.0, in -1.0..=1.0;
        /// Line time, us.
        line_time_us: f64 = 0.0, in LINE_TIME_ERROR_US;
        /// Yaw, deg, left positive.
        yaw_deg: f64 = 0.0, in -45.0..=45.0;
        /// Pitch, deg, up positive.
        pitch_deg: f64 = 0.0, in -45.0..=45.0;
        /// Place along the line, m.
        chainage_m: f64 = 0.0, in -1.0..=1.0;
        /// Place across the line, m to the left.
        lateral_m: f64 = 0.0, in -0.5..=0.5;
        /// Place in height, m.
        height_m: f64 = 0.0, in -0.5..=0.5;
    }
}

impl CameraSettings {
    /// The device as surveyed: this camera at that site, with a lidar in the same housing where
    /// `with_lidar`. `None` where the tunnel has no balise of the name that the site gives.
    pub fn calibration(
        &self,
        site: &WaysideSite,
        (id, track): (TrackId, &Track),
        with_lidar: bool,
    ) -> Option<WaysideCalibration> {
        let sheet = Self {
            calibration_error: WaysideError::default(),
            ..*self
        };
        sheet.actual(site, (id, track), with_lidar)
    }

    /// The device as it really hangs and looks, through which the world is drawn.
    pub fn actual(
        &self,
        site: &WaysideSite,
        (id, track): (TrackId, &Track),
        with_lidar: bool,
    ) -> Option<WaysideCalibration> {
        let balise = track.balise(&site.balise)?;
        let error = self.calibration_error;
        let place = TrackPoint {
            s_m: site.chainage_m + error.chainage_m,
            l_m: site.lateral_m + error.lateral_m,
            h_m: site.height_m + error.height_m,
        };
        let yaw_rad = site.yaw_deg.to_radians() + error.yaw_deg.to_radians();
        let pitch_rad = site.pitch_deg.to_radians() + error.pitch_deg.to_radians();
        let heading_rad = track.alignment.at(place.s_m).heading_rad + yaw_rad;
        // Forward, left, up at the device's axis.
        let world_from_housing = Isometry3::from_parts(
            Translation3::from(track.alignment.world_from_track(place)),
            yaw_pitch(heading_rad, pitch_rad),
        );
        Some(WaysideCalibration {
            name: site.name.clone(),
            camera: self.actual_camera().camera(),
            world_from_camera: world_from_housing * forward_from_camera(),
            world_from_lidar: with_lidar.then(|| world_from_housing * forward_from_lidar()),
            track: id,
            chainage_m: place.s_m,
            balise_chainage_m: balise.chainage_m,
        })
    }

    /// This camera as it really is; its errors are now in its values.
    fn actual_camera(&self) -> Self {
        let error = self.calibration_error;
        Self {
            focal_length_mm: self.focal_length_mm + error.focal_length_mm,
            principal_u_px: self.principal_u_px + error.principal_u_px,
            principal_v_px: self.principal_v_px + error.principal_v_px,
            distortion: DistortionCoefficients {
                k1: self.distortion.k1 + error.k1,
                ..self.distortion
            },
            line_time_us: self.line_time_us + error.line_time_us,
            calibration_error: WaysideError::default(),
            ..*self
        }
    }

    fn check_together(&self, check: &mut Checker<'_>) {
        self.check_camera("frames_per_s", check);
        let (error, mut below) = (self.calibration_error, check.below("calibration_error"));
        let (error_mm, focal_mm) = (error.focal_length_mm, self.focal_length_mm);
        check_half("focal_length_mm", error_mm, focal_mm, &mut below);
        check_half(
            "line_time_us",
            error.line_time_us,
            self.line_time_us,
            &mut below,
        );
        let actual = self.actual_camera().exposed_longest();
        actual.check_actual(&self.exposed_longest(), check);
    }

    /// From the start of a frame to the closing of its last row, with the longest exposure that it
    /// may have.
    pub fn longest_span_s(&self) -> f64 {
        self.actual_camera().exposed_longest().span_s()
    }
}

/// An error, or a difference, must leave half of what is calibrated.
pub(super) fn check_half(key: &str, error: f64, calibrated: f64, check: &mut Checker<'_>) {
    let half = 0.5 * calibrated.abs();
    check.within(key, error, -half..=half);
}

/// A camera at `place` of a frame with x forward, y left, z up.
pub(super) fn mounted(place: Vector3<f64>, yaw_rad: f64, pitch_rad: f64) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::from(place), yaw_pitch(yaw_rad, pitch_rad))
        * forward_from_camera()
}

fn yaw_pitch(yaw_rad: f64, pitch_rad: f64) -> UnitQuaternion<f64> {
    // Up is a negative turn about the left hand axis.
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad)
        * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -pitch_rad)
}

/// Camera axes (x right, y down, z forward) in axes x forward, y left, z up.
fn forward_from_camera() -> Isometry3<f64> {
    axes(Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0))
}

/// Lidar axes (x right, y along the axis, z up) in axes x forward, y left, z up.
fn forward_from_lidar() -> Isometry3<f64> {
    axes(Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0))
}

fn axes(columns: Matrix3<f64>) -> Isometry3<f64> {
    let rotation = Rotation3::from_matrix_unchecked(columns);
    Isometry3::from_parts(
        Translation3::identity(),
        UnitQuaternion::from_rotation_matrix(&rotation),
    )
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::settings::{Problem, Settings};
    use crate::track::Tunnel;

    /// A table with one key that takes the rig's sensor and glass for the rest.
    #[test]
    fn what_is_left_out_is_the_wayside_cameras_own() {
        let text = "sensor = { bits = 12 }\nlens = { focus_m = 20.0 }\n";
        let camera: CameraSettings = toml::from_str(text).unwrap();
        let mut expected = CameraSettings::default();
        expected.sensor.bits = 12;
        expected.lens.focus_m = Some(20.0);
        assert_eq!(camera, expected);
        let wrong = toml::from_str::<CameraSettings>("sensor = { bitz = 12 }").unwrap_err();
        assert!(
            wrong.to_string().contains("unknown field `bitz`"),
            "{wrong}"
        );
    }

    /// The error moves the device, camera and lidar alike, and leaves its calibration sheet.
    #[test]
    fn calibration_error_moves_the_actual_device_only() {
        let text = include_str!("../../../tunnels/chengdu_line1.toml");
        let track = Track::clone(Tunnel::from_toml(text).unwrap().first_track());
        let site = &track.wayside[0];
        let mut camera = CameraSettings::default();
        let exact = camera
            .calibration(site, (TrackId(0), &track), true)
            .unwrap();
        assert_eq!(
            camera.actual(site, (TrackId(0), &track), true),
            Some(exact.clone())
        );
        camera.calibration_error.pitch_deg = 0.5;
        camera.calibration_error.height_m = 0.02;
        assert_eq!(
            camera.calibration(site, (TrackId(0), &track), true),
            Some(exact.clone())
        );
        let actual = camera.actual(site, (TrackId(0), &track), true).unwrap();
        let turned = |a: &Isometry3<f64>, b: &Isometry3<f64>| a.rotation.angle_to(&b.rotation);
        let half_deg = 0.5f64.to_radians();
        let by = turned(&actual.world_from_camera, &exact.world_from_camera);
        assert!((by - half_deg).abs() < 1e-9, "{by}");
        let (is, said) = (actual.world_from_lidar, exact.world_from_lidar);
        assert!((turned(&is.unwrap(), &said.unwrap()) - half_deg).abs() < 1e-9);
        let up = actual.world_from_camera.translation.z - exact.world_from_camera.translation.z;
        assert!((up - 0.02).abs() < 1e-9, "{up}");
    }

    /// As for the rig: lens, read-out, errors and jitter are refused where they are said.
    #[test]
    fn impossible_cameras_are_refused() {
        let problems = |text: &str| {
            let camera: CameraSettings = toml::from_str(text).unwrap();
            let mut problems = Vec::new();
            camera.check("camera", &mut problems);
            problems
        };
        for (text, key, what) in [
            (
                "distortion = { k1 = -0.28, k3 = -0.05 }",
                "distortion",
                "it turns back at r = 0.912 (42.4 deg off the axis), which is seen 736 px",
            ),
            (
                "calibration_error = { k1 = -0.4 }",
                "calibration_error",
                "it turns back at r = 0.866 (40.9 deg off the axis)",
            ),
            (
                "line_time_us = 80.0\nexposure_us = 13000.0\n\
                 calibration_error = { line_time_us = 1.0 }",
                "calibration_error.line_time_us",
                "the line time is really 81 us, in which 1080 rows take 100399 us",
            ),
            (
                "exposure_control = { mode = 'auto', max_exposure_us = 90000.0 }",
                "exposure_control.max_exposure_us",
                "exposed for 90000 us, 1080 rows of 14.8 us take 105969 us",
            ),
            (
                "frame_jitter_us = 2e4",
                "frame_jitter_us",
                "20000 us is out of range",
            ),
            (
                "principal_v_px = -600.0",
                "principal_v_px",
                "-600 px is out of range",
            ),
        ] {
            let found = problems(text);
            let said = |p: &Problem| {
                p.key == format!("camera.{key}") && p.what.starts_with(what) && !p.remedy.is_empty()
            };
            assert!(found.iter().any(said), "{text}: {found:?}");
        }
        let wide = "distortion = { k1 = -0.283, k2 = 0.074 }\nread_out = \"up\"\n";
        assert_eq!(problems(wide), []);
    }

    /// Camera and lidar of a housing look the same way, which is the site's yaw and pitch.
    #[test]
    fn a_wayside_housing_looks_where_its_site_says() {
        let text = include_str!("../../../tunnels/chengdu_line1.toml");
        let track = Track::clone(Tunnel::from_toml(text).unwrap().first_track());
        let site = &track.wayside[0];
        let device = CameraSettings::default()
            .calibration(site, (TrackId(0), &track), true)
            .unwrap();
        let axis = device.world_from_camera * Vector3::z();
        let lidar = device.world_from_lidar.unwrap();
        assert!((axis - lidar * Vector3::y()).norm() < 1e-12);
        assert!((axis.z - site.pitch_deg.to_radians().sin()).abs() < 1e-12);
        let line = track.alignment.at(site.chainage_m).world_from_line() * Vector3::x();
        let along = axis.dot(&Vector3::new(line.x, line.y, 0.0).normalize());
        assert!(
            (along - site.pitch_deg.to_radians().cos() * site.yaw_deg.to_radians().cos()).abs()
                < 1e-9
        );
    }
}
