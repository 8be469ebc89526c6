//! Cameras as a user mounts them, and the camera of a wayside device, from degrees and millimetres
//! to calibrations.
//!
//! A mount turns by yaw about the vertical (left positive) and then by pitch about its own right
//! hand axis (up positive). The papers measure psi from the lateral direction: psi = 90 deg - yaw.

use super::ExposureSettings;
use crate::bus::{CameraModel, Intrinsics, Shutter, WaysideCalibration};
use crate::track::{Checker, Problem, TrackPoint, Tunnel, WaysideSite};
use crate::twin::render::{LensSettings, SensorSettings};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Shape and timing of one image sensor behind its lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Optics {
    pub focal_length_mm: f64,
    pub pixel_um: f64,
    pub width_px: u32,
    pub height_px: u32,
    pub line_time_us: f64,
    pub exposure_us: f64,
    pub frames_per_s: f64,
    pub rate_key: &'static str,
}

impl Optics {
    pub fn camera(&self) -> CameraModel {
        CameraModel {
            intrinsics: Intrinsics::centred(
                self.width_px,
                self.height_px,
                self.focal_length_mm * 1e3 / self.pixel_um,
            ),
            shutter: Shutter {
                line_time_s: self.line_time_us * 1e-6,
                exposure_s: self.exposure_us * 1e-6,
                first_row: 0,
            },
        }
    }

    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        positive(
            problems,
            at,
            "focal_length_mm",
            self.focal_length_mm,
            "mm",
            3.9,
        );
        positive(problems, at, "pixel_um", self.pixel_um, "um", 3.75);
        positive(problems, at, "exposure_us", self.exposure_us, "us", 30.0);
        positive(problems, at, self.rate_key, self.frames_per_s, "1/s", 30.0);
        let mut check = Checker::new(at, problems);
        for (key, value) in [("width_px", self.width_px), ("height_px", self.height_px)] {
            check.within(key, f64::from(value), 16.0..=8192.0, "px");
        }
        if !(self.line_time_us.is_finite() && self.line_time_us >= 0.0) {
            problems.push(Problem::new(
                format!("{at}.line_time_us"),
                format!(
                    "a row cannot open {} us after the one before",
                    self.line_time_us
                ),
                "give the time from row to row in us, 0 for a global shutter",
            ));
        }
        self.check_frame_time(at, problems);
    }

    /// The last row must close before the next frame's first one opens.
    fn check_frame_time(&self, at: &str, problems: &mut Vec<Problem>) {
        let frame_us = 1e6 / self.frames_per_s;
        if !(frame_us.is_finite() && frame_us > 0.0) {
            return;
        }
        if self.exposure_us > frame_us {
            problems.push(Problem::new(
                format!("{at}.exposure_us"),
                format!(
                    "an exposure of {} us is longer than the frame, {frame_us:.0} us at {} {}",
                    self.exposure_us, self.frames_per_s, self.rate_key
                ),
                format!(
                    "expose for less than {frame_us:.0} us, or lower {}",
                    self.rate_key
                ),
            ));
            return;
        }
        let span_us = self.camera().shutter.frame_span_s(self.height_px) * 1e6;
        if span_us > frame_us {
            let fits = ((frame_us - self.exposure_us) / self.line_time_us).floor() + 1.0;
            problems.push(Problem::new(
                format!("{at}.height_px"),
                format!(
                    "{} rows of {} us take {span_us:.0} us, but a frame lasts {frame_us:.0} us at {} {}",
                    self.height_px, self.line_time_us, self.frames_per_s, self.rate_key
                ),
                format!("read at most {fits:.0} rows, or lower line_time_us or {}", self.rate_key),
            ));
        }
    }
}

/// The camera of a wayside device. Where it hangs and looks is in the tunnel file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct WaysideCameraSettings {
    /// Focal length, mm. Default 4.1 (1093 px: 82 deg across).
    pub focal_length_mm: f64,
    /// Width and height of a pixel, um. Default 3.75.
    pub pixel_um: f64,
    /// Columns. Default 1920.
    pub width_px: u32,
    /// Rows. Default 1080.
    pub height_px: u32,
    /// Time from the opening of a row to the opening of the next, us. Default 14.8.
    pub line_time_us: f64,
    /// How long every row collects light, us. Default 16000.
    pub exposure_us: f64,
    /// Frames a second. Default 10.
    pub frames_per_s: f64,
    /// By how much the device really differs from the calibration that the stack is given.
    /// Default: not at all.
    pub calibration_error: WaysideError,
    /// The glass.
    pub lens: LensSettings,
    /// From photons to digital numbers.
    pub sensor: SensorSettings,
    /// Exposure and gain that follow the light. Default: fixed.
    pub exposure_control: ExposureSettings,
}

impl Default for WaysideCameraSettings {
    fn default() -> Self {
        Self {
            focal_length_mm: 4.1,
            pixel_um: 3.75,
            width_px: 1920,
            height_px: 1080,
            line_time_us: 14.8,
            exposure_us: 16_000.0,
            frames_per_s: 10.0,
            calibration_error: WaysideError::default(),
            lens: LensSettings {
                f_number: 1.0,
                ..LensSettings::default()
            },
            sensor: SensorSettings {
                gain_db: 9.4,
                ..SensorSettings::default()
            },
            exposure_control: ExposureSettings::default(),
        }
    }
}

/// What survey and calibration of a wayside device got wrong: the true value less the calibrated
/// one. A lidar in the same housing is off by the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct WaysideError {
    /// Focal length, mm. Default 0.
    pub focal_length_mm: f64,
    /// Yaw, deg, left positive. Default 0.
    pub yaw_deg: f64,
    /// Pitch, deg, up positive. Default 0.
    pub pitch_deg: f64,
    /// Place along the line, m. Default 0.
    pub chainage_m: f64,
    /// Place across the line, m to the left. Default 0.
    pub lateral_m: f64,
    /// Place in height, m. Default 0.
    pub height_m: f64,
}

impl WaysideCameraSettings {
    /// The camera alone.
    pub fn camera(&self) -> CameraModel {
        self.optics().camera()
    }

    /// The device as surveyed: this camera at that site, with a lidar in the same housing where
    /// `with_lidar`. `None` where the tunnel has no balise of the name that the site gives.
    pub fn calibration(
        &self,
        site: &WaysideSite,
        tunnel: &Tunnel,
        with_lidar: bool,
    ) -> Option<WaysideCalibration> {
        let balise = tunnel.balises.iter().find(|b| b.name == site.balise)?;
        let world_from_housing = world_from_housing(site, tunnel);
        Some(WaysideCalibration {
            name: site.name.clone(),
            camera: self.camera(),
            world_from_camera: world_from_housing * forward_from_camera(),
            world_from_lidar: with_lidar.then(|| world_from_housing * forward_from_lidar()),
            chainage_m: site.chainage_m,
            balise_chainage_m: balise.chainage_m,
        })
    }

    /// The device as it really hangs and looks, through which the world is drawn.
    pub fn actual(
        &self,
        site: &WaysideSite,
        tunnel: &Tunnel,
        with_lidar: bool,
    ) -> Option<WaysideCalibration> {
        let error = self.calibration_error;
        let camera = Self {
            focal_length_mm: self.focal_length_mm + error.focal_length_mm,
            ..self.clone()
        };
        let site = WaysideSite {
            chainage_m: site.chainage_m + error.chainage_m,
            lateral_m: site.lateral_m + error.lateral_m,
            height_m: site.height_m + error.height_m,
            yaw_rad: site.yaw_rad + error.yaw_deg.to_radians(),
            pitch_rad: site.pitch_rad + error.pitch_deg.to_radians(),
            ..site.clone()
        };
        camera.calibration(&site, tunnel, with_lidar)
    }

    /// Appends what is wrong.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        self.optics().check(at, problems);
        self.sensor.check(&format!("{at}.sensor"), problems);
        self.lens.check(&format!("{at}.lens"), problems);
        let frame_us = 1e6 / self.frames_per_s;
        let control = format!("{at}.exposure_control");
        (self.exposure_control).check(&control, self.exposure_us, frame_us, problems);
        let error = self.calibration_error;
        let at = format!("{at}.calibration_error");
        let mut check = Checker::new(&at, problems);
        let mut within = |key: &str, value: f64, unit: &str, most: f64| {
            check.within(key, value, -most..=most, unit);
        };
        let half_focal = 0.5 * self.focal_length_mm.abs();
        within("focal_length_mm", error.focal_length_mm, "mm", half_focal);
        within("yaw_deg", error.yaw_deg, "deg", 45.0);
        within("pitch_deg", error.pitch_deg, "deg", 45.0);
        within("chainage_m", error.chainage_m, "m", 1.0);
        within("lateral_m", error.lateral_m, "m", 0.5);
        within("height_m", error.height_m, "m", 0.5);
    }

    fn optics(&self) -> Optics {
        Optics {
            focal_length_mm: self.focal_length_mm,
            pixel_um: self.pixel_um,
            width_px: self.width_px,
            height_px: self.height_px,
            line_time_us: self.line_time_us,
            exposure_us: self.exposure_us,
            frames_per_s: self.frames_per_s,
            rate_key: "frames_per_s",
        }
    }
}

/// Forward, left, up at the device's axis.
fn world_from_housing(site: &WaysideSite, tunnel: &Tunnel) -> Isometry3<f64> {
    let place = TrackPoint {
        s_m: site.chainage_m,
        l_m: site.lateral_m,
        h_m: site.height_m,
    };
    let heading = tunnel.alignment.at(site.chainage_m).heading_rad + site.yaw_rad;
    Isometry3::from_parts(
        Translation3::from(tunnel.alignment.world_from_track(place)),
        yaw_pitch(heading, site.pitch_rad),
    )
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

/// Complains unless a number is greater than 0; `usual` is one that is.
pub(super) fn positive(
    problems: &mut Vec<Problem>,
    at: &str,
    key: &str,
    value: f64,
    unit: &str,
    usual: f64,
) {
    if !(value.is_finite() && value > 0.0) {
        problems.push(Problem::new(
            format!("{at}.{key}"),
            format!("{value} {unit} is not greater than 0"),
            format!("give a positive number of {unit}, usually {usual}"),
        ));
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    /// The error moves the device, camera and lidar alike, and leaves its calibration sheet.
    #[test]
    fn calibration_error_moves_the_actual_device_only() {
        let text = include_str!("../../../tunnels/chengdu_line1.toml");
        let tunnel = Tunnel::from_toml(text).unwrap();
        let site = &tunnel.wayside[0];
        let mut camera = WaysideCameraSettings::default();
        let exact = camera.calibration(site, &tunnel, true).unwrap();
        assert_eq!(camera.actual(site, &tunnel, true), Some(exact.clone()));
        camera.calibration_error.pitch_deg = 0.5;
        camera.calibration_error.height_m = 0.02;
        assert_eq!(camera.calibration(site, &tunnel, true), Some(exact.clone()));
        let actual = camera.actual(site, &tunnel, true).unwrap();
        let turned = |a: &Isometry3<f64>, b: &Isometry3<f64>| a.rotation.angle_to(&b.rotation);
        let half_deg = 0.5f64.to_radians();
        let by = turned(&actual.world_from_camera, &exact.world_from_camera);
        assert!((by - half_deg).abs() < 1e-9, "{by}");
        let (is, said) = (actual.world_from_lidar, exact.world_from_lidar);
        assert!((turned(&is.unwrap(), &said.unwrap()) - half_deg).abs() < 1e-9);
        let up = actual.world_from_camera.translation.z - exact.world_from_camera.translation.z;
        assert!((up - 0.02).abs() < 1e-9, "{up}");
    }

    /// Camera and lidar of a housing look the same way, which is the site's yaw and pitch.
    #[test]
    fn a_wayside_housing_looks_where_its_site_says() {
        let text = include_str!("../../../tunnels/chengdu_line1.toml");
        let tunnel = Tunnel::from_toml(text).unwrap();
        let site = &tunnel.wayside[0];
        let device = WaysideCameraSettings::default()
            .calibration(site, &tunnel, true)
            .unwrap();
        let axis = device.world_from_camera * Vector3::z();
        let lidar = device.world_from_lidar.unwrap();
        assert!((axis - lidar * Vector3::y()).norm() < 1e-12);
        assert!((axis.z - site.pitch_rad.sin()).abs() < 1e-12);
        let line = tunnel.alignment.at(site.chainage_m).world_from_line() * Vector3::x();
        let along = axis.dot(&Vector3::new(line.x, line.y, 0.0).normalize());
        assert!((along - site.pitch_rad.cos() * site.yaw_rad.cos()).abs() < 1e-9);
    }
}
