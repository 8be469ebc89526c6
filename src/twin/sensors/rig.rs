//! The stereo rig on the train head, from degrees and millimetres to a calibration, and from where
//! it sees a lamp.
//!
//! **Why the rig looks where it does.** A lamp 1.7 m to the left and 1.5 m above the left eye is
//! to be seen whole, by both eyes, over a full unit of 10 m. Without a pitch, psi =
//! atan(10/1.7) - 64/2 = 49 deg is the smallest that reaches far enough, but then lamps nearer than
//! 4.3 m are above the picture. A pitch of 22 deg brings them in from 1.0 m on; it also turns the
//! far lamps outwards, so that psi has to grow to 51 deg (yaw 39). The visible interval is
//! then 1.04 m to 11.46 m ahead on straight track, 10.4 m of 10 ([`visible_interval`]); with
//! psi = 49 deg no pitch gives more than 8.4 m.
//!
//! **What a calibration misses.** [`RigError`]: focal length and baseline of both eyes, attitude of
//! the rig, and the vergence of its eyes, the one angle between them that enters every disparity:
//! f times it, 0.07 px for 0.004 deg, which at 10 m puts a lamp off by 5 cm.
//!
//! **What it does not do.** The eyes have no distortion, nor what a calibration leaves of it; they
//! share one focal length and one principal point; the right eye is neither rolled nor pitched
//! against the left, nor off the baseline's line; both trigger at the same time.

use super::ExposureSettings;
use super::camera::{Optics, mounted, positive};
use crate::bus::RigCalibration;
use crate::track::{Checker, LampSite, Problem, Tunnel};
use crate::twin::render::{LensSettings, SensorSettings};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The stereo rig on the train head: where it is mounted, what it sees, when.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RigSettings {
    /// Focal length of either eye, mm. Default 3.9 (1040 px).
    pub focal_length_mm: f64,
    /// Width and height of a pixel, um. Default 3.75.
    pub pixel_um: f64,
    /// Columns of either eye's image. Default 1280.
    pub width_px: u32,
    /// Rows of either eye's image. Default 720.
    pub height_px: u32,
    /// Distance between the eyes, mm; the right eye sits that far along the left eye's right hand
    /// axis. Default 120.
    pub baseline_mm: f64,
    /// Time from the opening of a row to the opening of the next, us; 0 for a global shutter.
    /// Default 22.2.
    pub line_time_us: f64,
    /// How long every row collects light, us. Longer than a chip of the lamps' code (45 us in the shipped tunnels)
    /// it blurs the stripes away. Default 30.
    pub exposure_us: f64,
    /// Pairs of images a second. Default 30.
    pub pairs_per_s: f64,
    /// Left eye, m ahead of the train head (negative: behind the windscreen). Default -0.5.
    pub forward_m: f64,
    /// Left eye, m to the left of the centreline. Default 1.0.
    pub lateral_m: f64,
    /// Left eye, m above top of rail. Default 1.7.
    pub height_m: f64,
    /// Turn of the optical axis from straight ahead, deg, left positive; psi = 90 - yaw.
    /// Default 39.
    pub yaw_deg: f64,
    /// Tilt of the optical axis, deg, up positive. Default 22.
    pub pitch_deg: f64,
    /// By how much the mount really differs from the calibration that the stack is given.
    /// Default: not at all.
    pub calibration_error: RigError,
    /// The glass of either eye.
    pub lens: LensSettings,
    /// From photons to digital numbers.
    pub sensor: SensorSettings,
    /// Exposure and gain that follow the light. Default: fixed.
    pub exposure_control: ExposureSettings,
}

impl Default for RigSettings {
    fn default() -> Self {
        Self {
            focal_length_mm: 3.9,
            pixel_um: 3.75,
            width_px: 1280,
            height_px: 720,
            baseline_mm: 120.0,
            line_time_us: 22.2,
            exposure_us: 30.0,
            pairs_per_s: 30.0,
            forward_m: -0.5,
            lateral_m: 1.0,
            height_m: 1.7,
            yaw_deg: 39.0,
            pitch_deg: 22.0,
            calibration_error: RigError::default(),
            lens: LensSettings::default(),
            sensor: SensorSettings::default(),
            exposure_control: ExposureSettings::default(),
        }
    }
}

/// What a calibration got wrong: the true value less the calibrated one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RigError {
    /// Focal length, mm. Default 0.
    pub focal_length_mm: f64,
    /// Baseline, mm. Default 0.
    pub baseline_mm: f64,
    /// Yaw, deg. Default 0.
    pub yaw_deg: f64,
    /// Pitch, deg. Default 0.
    pub pitch_deg: f64,
    /// Yaw of the right eye against the left, deg, positive where the eyes converge. The
    /// calibration sheet has them parallel. Default 0.
    pub vergence_deg: f64,
}

impl RigSettings {
    /// The calibration sheet, which the stack gets.
    pub fn calibration(&self) -> RigCalibration {
        RigCalibration {
            camera: self.optics().camera(),
            baseline_m: self.baseline_mm * 1e-3,
            vehicle_from_left: mounted(
                Vector3::new(self.forward_m, self.lateral_m, self.height_m),
                self.yaw_deg.to_radians(),
                self.pitch_deg.to_radians(),
            ),
        }
    }

    /// The rig as it really is, through which the world is drawn.
    pub fn actual(&self) -> RigCalibration {
        let error = self.calibration_error;
        Self {
            focal_length_mm: self.focal_length_mm + error.focal_length_mm,
            baseline_mm: self.baseline_mm + error.baseline_mm,
            yaw_deg: self.yaw_deg + error.yaw_deg,
            pitch_deg: self.pitch_deg + error.pitch_deg,
            ..self.clone()
        }
        .calibration()
    }

    /// Where the right eye really is, in the left eye's frame (x right, y down, z ahead). The
    /// calibration has it at `baseline_m` on the x axis and parallel.
    pub fn left_from_right(&self) -> Isometry3<f64> {
        let to_the_left = -self.calibration_error.vergence_deg.to_radians();
        Isometry3::from_parts(
            Translation3::new(self.actual().baseline_m, 0.0, 0.0),
            UnitQuaternion::from_axis_angle(&Vector3::y_axis(), to_the_left),
        )
    }

    /// Appends what is wrong.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        self.optics().check(at, problems);
        self.lens.check(&format!("{at}.lens"), problems);
        let frame_us = 1e6 / self.pairs_per_s;
        let control = format!("{at}.exposure_control");
        (self.exposure_control).check(&control, self.exposure_us, frame_us, problems);
        self.sensor.check(&format!("{at}.sensor"), problems);
        positive(problems, at, "baseline_mm", self.baseline_mm, "mm", 120.0);
        positive(problems, at, "height_m", self.height_m, "m", 1.7);
        let mut check = Checker::new(at, problems);
        check.within("forward_m", self.forward_m, -5.0..=5.0, "m");
        check.within("lateral_m", self.lateral_m, -2.0..=2.0, "m");
        check.within("yaw_deg", self.yaw_deg, -180.0..=180.0, "deg");
        check.within("pitch_deg", self.pitch_deg, -89.0..=89.0, "deg");
        let error = self.calibration_error;
        let at = format!("{at}.calibration_error");
        let half_focal = 0.5 * self.focal_length_mm.abs();
        let half_baseline = 0.5 * self.baseline_mm.abs();
        let mut check = Checker::new(&at, problems);
        check.within(
            "focal_length_mm",
            error.focal_length_mm,
            -half_focal..=half_focal,
            "mm",
        );
        check.within(
            "baseline_mm",
            error.baseline_mm,
            -half_baseline..=half_baseline,
            "mm",
        );
        check.within("yaw_deg", error.yaw_deg, -45.0..=45.0, "deg");
        check.within("pitch_deg", error.pitch_deg, -45.0..=45.0, "deg");
        check.within("vergence_deg", error.vergence_deg, -5.0..=5.0, "deg");
    }

    fn optics(&self) -> Optics {
        Optics {
            focal_length_mm: self.focal_length_mm,
            pixel_um: self.pixel_um,
            width_px: self.width_px,
            height_px: self.height_px,
            line_time_us: self.line_time_us,
            exposure_us: self.exposure_us,
            frames_per_s: self.pairs_per_s,
            rate_key: "pairs_per_s",
        }
    }
}

/// Train positions, as metres from the head to the lamp, at which both eyes see the whole disc
/// from its luminous side: the longest stretch, nearest and farthest end. The vehicle stands on
/// the track without vibration. `None` where the rig never sees the lamp.
pub fn visible_interval(
    rig: &RigCalibration,
    tunnel: &Tunnel,
    lamp: &LampSite,
) -> Option<(f64, f64)> {
    let rim = rim(lamp);
    let mut best: Option<(f64, f64)> = None;
    let mut run: Option<(f64, f64)> = None;
    for k in REACH_STEPS {
        let ahead_m = f64::from(k) * REACH_STEP_M;
        if !sees(rig, tunnel, lamp, &rim, lamp.chainage_m - ahead_m) {
            run = None;
            continue;
        }
        let now = (run.map_or(ahead_m, |r| r.0), ahead_m);
        run = Some(now);
        if best.is_none_or(|b| now.1 - now.0 > b.1 - b.0) {
            best = Some(now);
        }
    }
    best
}

/// Whether both eyes ever see the whole disc.
pub fn ever_sees(rig: &RigCalibration, tunnel: &Tunnel, lamp: &LampSite) -> bool {
    let rim = rim(lamp);
    REACH_STEPS
        .step_by(4)
        .map(|k| lamp.chainage_m - f64::from(k) * REACH_STEP_M)
        .any(|head_m| sees(rig, tunnel, lamp, &rim, head_m))
}

/// A lamp is looked for from 5 m behind the head to 80 m ahead of it.
const REACH_STEPS: std::ops::Range<i32> = -100..1600;
const REACH_STEP_M: f64 = 0.05;

fn rim(lamp: &LampSite) -> [Point3<f64>; 16] {
    let n = lamp.facing.into_inner();
    let across = n
        .cross(&n.map(|x| if x.abs() < 0.6 { 1.0 } else { 0.0 }))
        .normalize();
    let along = n.cross(&across);
    std::array::from_fn(|k| {
        let (sin, cos) = (k as f64 * std::f64::consts::TAU / 16.0).sin_cos();
        lamp.centre + 0.5 * lamp.diameter_m * (cos * across + sin * along)
    })
}

fn sees(
    rig: &RigCalibration,
    tunnel: &Tunnel,
    lamp: &LampSite,
    rim: &[Point3<f64>],
    head_m: f64,
) -> bool {
    let world_from_left = tunnel.alignment.at(head_m).world_from_rails() * rig.vehicle_from_left;
    let left_from_world = world_from_left.inverse();
    let towards = Point3::from(world_from_left.translation.vector) - lamp.centre;
    let camera = &rig.camera.intrinsics;
    let inside = |p: Point3<f64>| {
        p.z > 0.1
            && camera.project(&p).is_some_and(|uv| {
                (0.0..=f64::from(camera.width_px) - 1.0).contains(&uv.x)
                    && (0.0..=f64::from(camera.height_px) - 1.0).contains(&uv.y)
            })
    };
    towards.dot(&lamp.facing) > 0.0
        && rim.iter().all(|p| {
            let left = left_from_world * p;
            inside(left) && inside(left - Vector3::new(rig.baseline_m, 0.0, 0.0))
        })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    fn bench() -> Tunnel {
        Tunnel::from_toml(include_str!("../../../tunnels/test_bench.toml")).unwrap()
    }

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

    /// What the defaults are chosen for: a whole unit of 10 m, and the figures of the header.
    #[test]
    fn the_reference_rig_sees_a_whole_unit() {
        let tunnel = bench();
        let rig = RigSettings::default();
        let see = |rig: &RigSettings| {
            visible_interval(&rig.calibration(), &tunnel, &tunnel.lamps[0]).unwrap()
        };
        let (near_m, far_m) = see(&rig);
        // The eye is 0.5 m behind the head; steps of 5 cm.
        assert!((near_m - (1.04 - 0.5)).abs() < 0.1, "{near_m}");
        assert!((far_m - (11.46 - 0.5)).abs() < 0.1, "{far_m}");
        assert!(far_m - near_m > 10.0);
        // With the paper's psi = 49 deg no pitch does it.
        for pitch_deg in [0.0, 10.0, 18.0, 22.0, 26.0, 30.0] {
            let (near_m, far_m) = see(&RigSettings {
                yaw_deg: 41.0,
                pitch_deg,
                ..rig.clone()
            });
            assert!(
                far_m - near_m < 8.5,
                "pitch {pitch_deg}: {near_m} to {far_m}"
            );
        }
    }

    /// The error belongs to the rig as built, not to its calibration sheet.
    #[test]
    fn calibration_error_moves_the_actual_rig_only() {
        let mut rig = RigSettings::default();
        rig.calibration_error.baseline_mm = 1.0;
        assert!((rig.calibration().baseline_m - 0.120).abs() < 1e-12);
        assert!((rig.actual().baseline_m - 0.121).abs() < 1e-12);
    }

    /// Eyes that converge see a smaller disparity, by f (1 + x^2) times the angle with x = (u -
    /// cx) / f in the right eye: a turn to the wrong side, degrees for radians, eyes exchanged.
    #[test]
    fn vergence_takes_from_the_disparity() {
        let mut rig = RigSettings::default();
        let lamp = Point3::new(4.0, 2.0, 8.0);
        let camera = rig.optics().camera().intrinsics;
        let right_u_px = |rig: &RigSettings| {
            let seen = rig.left_from_right().inverse() * lamp;
            camera.project(&seen).unwrap().x
        };
        let parallel = right_u_px(&rig);
        assert!((parallel - camera.cx_px - camera.fx_px * 3.88 / 8.0).abs() < 1e-9);
        rig.calibration_error.vergence_deg = 0.01;
        let x: f64 = 3.88 / 8.0;
        let off_px = camera.fx_px * (1.0 + x * x) * 0.01_f64.to_radians();
        assert!((right_u_px(&rig) - parallel - off_px).abs() < 1e-4);
    }
}
