//! From where a rig sees a lamp whole.

use crate::bus::{CameraModel, RigCalibration};
use crate::track::{LampSite, Track};
use nalgebra::Point3;

/// Train positions, as metres from the head to the lamp, at which both eyes see the whole disc
/// from its luminous side: the longest stretch, nearest and farthest end. The vehicle stands on
/// the track without vibration. `None` where the rig never sees the lamp.
pub fn visible_interval(
    rig: &RigCalibration,
    track: &Track,
    lamp: &LampSite,
) -> Option<(f64, f64)> {
    let rim = rim(lamp);
    let mut best: Option<(f64, f64)> = None;
    let mut run: Option<(f64, f64)> = None;
    for k in REACH_STEPS {
        let ahead_m = f64::from(k) * REACH_STEP_M;
        if !sees(rig, track, lamp, &rim, lamp.chainage_m - ahead_m) {
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
pub fn ever_sees(rig: &RigCalibration, track: &Track, lamp: &LampSite) -> bool {
    let rim = rim(lamp);
    REACH_STEPS
        .step_by(4)
        .map(|k| lamp.chainage_m - f64::from(k) * REACH_STEP_M)
        .any(|head_m| sees(rig, track, lamp, &rim, head_m))
}

/// A lamp is looked for from 5 m behind the head to 80 m ahead of it.
const REACH_STEPS: std::ops::Range<i32> = -100..1600;
const REACH_STEP_M: f64 = 0.05;

/// Cosine of the angle to a lamp's axis from where its disc is too narrow to be seen: 80 degrees.
const GRAZING: f64 = 0.17;

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
    track: &Track,
    lamp: &LampSite,
    rim: &[Point3<f64>],
    head_m: f64,
) -> bool {
    let world_from_left = track.alignment.at(head_m).world_from_rails() * rig.vehicle_from_left;
    let left_from_world = world_from_left.inverse();
    let towards = Point3::from(world_from_left.translation.vector) - lamp.centre;
    let right_from_left = rig.left_from_right.inverse();
    let inside = |eye: &CameraModel, p: Point3<f64>| {
        let lens = &eye.intrinsics;
        p.z > 0.1 && lens.project(&p).is_some_and(|pixel| lens.contains(&pixel))
    };
    towards.dot(&lamp.facing) > GRAZING * towards.norm()
        && rim.iter().all(|p| {
            let left = left_from_world * p;
            inside(&rig.left, left) && inside(&rig.right, right_from_left * left)
        })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::super::RigSettings;
    use super::*;
    use crate::track::Tunnel;

    fn bench() -> Track {
        Track::clone(
            Tunnel::from_toml(include_str!("../../../tunnels/test_bench.toml"))
                .unwrap()
                .first_track(),
        )
    }

    /// What the defaults are chosen for: a whole unit of 10 m, and the figures of the header.
    #[test]
    fn the_reference_rig_sees_a_whole_unit() {
        let track = bench();
        let rig = RigSettings::default();
        let see = |rig: &RigSettings| {
            visible_interval(&rig.calibration(), &track, &track.lamps[0]).unwrap()
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
}
