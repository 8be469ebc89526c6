//! The short table at the end of a run.

use super::fault::Failure;
use crate::record::render;
use crate::session::{CameraFigures, Summary};
use serde::Serialize;
use std::path::Path;

/// Faults of a camera that the table lists.
const FAULTS: usize = 4;

#[derive(Serialize)]
struct RunTable<'a> {
    run: &'a Summary,
    cameras: Vec<String>,
    out: String,
}

/// The figures that one looks at first; all of them are in summary.json.
pub(super) fn of(run: &Summary, out: &Path) -> Result<String, Failure> {
    let cameras = run.cameras.iter();
    let table = RunTable {
        run,
        cameras: cameras.filter_map(|(name, c)| camera(name, c)).collect(),
        out: out.display().to_string(),
    };
    render("run.txt", include_str!("texts/run.txt"), table).map_err(Failure::run)
}

/// Only of a camera that had something.
fn camera(name: &str, camera: &CameraFigures) -> Option<String> {
    let mut parts = Vec::new();
    if camera.lost_frames > 0 {
        parts.push(format!("{} frames lost", camera.lost_frames));
    }
    let shown = camera.faults.iter().take(FAULTS);
    parts.extend(shown.map(|span| match span.to_s {
        Some(to_s) => format!("{} from {:.2} to {to_s:.2} s", span.fault, span.from_s),
        None => format!("{} from {:.2} s to the end", span.fault, span.from_s),
    }));
    if camera.faults.len() > FAULTS {
        parts.push(format!("{} faults in all", camera.faults.len()));
    }
    (!parts.is_empty()).then(|| format!("{name}: {}", parts.join(", ")))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::bus::{CameraFault, Method, SimTime, TrainId};
    use crate::session::{
        Cost, End, ErrorStatistics, FaultSpan, ObstacleScore, Physics, Positioning,
        ProtectionFigures, TrainFigures, WallShares, Wayside,
    };
    use crate::twin::physics::{Damage, Impact, Incident, IncidentKind};
    use crate::twin::render::Backend;
    use std::collections::BTreeMap;

    /// A run with nothing but its speed.
    fn bare() -> Summary {
        Summary {
            incidents: Vec::new(),
            scenario: "gallery".into(),
            seed: 7,
            end: End::Complete,
            simulated_s: 60.04,
            wall_s: 12.06,
            real_time_factor: 4.978,
            renderer: Backend {
                backend: "vulkan".into(),
                adapter: "llvmpipe".into(),
            },
            stereo_frames: 0,
            wayside_frames: 3,
            physics: Physics { us_per_step: 80.25 },
            wall_shares_s: WallShares {
                physics_s: 0.0,
                submit_s: 0.0,
                wait_s: 0.0,
                stack_s: 0.0,
                record_s: 0.0,
            },
            positioning: BTreeMap::new(),
            wayside: None,
            cameras: BTreeMap::new(),
            dark_lamps: Vec::new(),
            occupancy: None,
            protection: None,
            train: None,
            trains: Vec::new(),
        }
    }

    /// A run with everything that the table has a place for.
    fn full() -> Summary {
        let method = |error_m: Option<f64>| Positioning {
            fixes: 12,
            availability: error_m.map(|_| 0.923),
            uid_decode_rate: error_m,
            wrong_uid: 0,
            error_m: error_m.map(|e| ErrorStatistics {
                mean: e,
                p50: e,
                p75: 2.0 * e,
                p95: 3.0 * e,
                p99: 3.5 * e,
                max: 4.0 * e,
            }),
            ms_per_frame: error_m.map(|e| Cost { p50: e, p99: e }),
            nees_mean: None,
        };
        let span = |fault, to_s| FaultSpan {
            fault,
            from_s: 1.0,
            to_s,
        };
        let faults = [(CameraFault::Missing, Some(2.5)), (CameraFault::Late, None)];
        let faults = faults.into_iter().cycle().take(5);
        let impact = Impact {
            train: TrainId(0),
            time: SimTime::from_secs(31.5),
            with: "toolbox".into(),
            speed_mps: 10.0,
            momentum_n_s: 1234.5,
            energy_j: 5000.0,
            energy_lost_j: 1500.0,
            damage: Damage::BeyondDesign,
        };
        let obstacle = |first_detected_s| ObstacleScore {
            name: "toolbox".into(),
            size_m: 0.4,
            first_detected_s,
            latency_s: None,
            placed_latency_s: None,
            distance_error_m: first_detected_s,
        };
        let incident = |stated_chainage, track: &str| Incident {
            time: SimTime::from_secs(12.5),
            kind: IncidentKind::RunThrough,
            train: TrainId(1),
            other: None,
            switch: Some("W1".to_owned()),
            track: track.to_owned(),
            chainage_m: 460.0,
            stated_chainage,
        };
        Summary {
            positioning: [
                (Method::Mono, method(None)),
                (Method::Stereo, method(Some(0.0123))),
            ]
            .into(),
            wayside: Some(Wayside {
                obstacles: vec![obstacle(Some(4.25)), obstacle(None)],
                false_alarms: 2,
                misplaced_alarms: 3,
                ms_per_frame: None,
            }),
            cameras: [
                ("rig.left".into(), CameraFigures::default()),
                (
                    "W1530".into(),
                    CameraFigures {
                        lost_frames: 3,
                        faults: faults.map(|(fault, to_s)| span(fault, to_s)).collect(),
                    },
                ),
            ]
            .into(),
            dark_lamps: (1..=9).map(|k| format!("1-{k}")).collect(),
            protection: Some(ProtectionFigures {
                brake_commanded_s: Some(20.0),
                emergency_brake_s: Some(20.5),
                stopped_s: Some(30.006),
                stop_margin_m: Some(-1.25),
                collision: true,
                impacts: vec![impact; 11],
            }),
            incidents: vec![
                incident(None, "u4"),
                incident(Some("YDK12+460.0".to_owned()), "u1"),
            ],
            train: Some(TrainFigures {
                run_m: 512.34,
                stop_error_m: Some(-0.256),
                least_wheel_load_share: 0.876,
                most_slip_mps: 0.123,
                most_lateral_n: 12_340.0,
                floor_accel_rms_mps2: [0.1, 0.2, 0.3456],
                ..TrainFigures::default()
            }),
            ..bare()
        }
    }

    /// Fails where a template asks for what is not there, or a part of the table is lost.
    #[test]
    fn the_table_shows_what_there_is() {
        let text = |run: &Summary| of(run, Path::new("out/x")).unwrap();
        assert_eq!(
            text(&bare()),
            "gallery: 60.0 s simulated in 12.1 s (4.98 x real time), seed 7\n\
             0 stereo pairs and 3 wayside frames by llvmpipe (vulkan); physics 80.2 us a step\n\
             \nresults in out/x"
        );
        let text = text(&full());
        for line in [
            "paper           12  92.3 %   1.2 %      1.2    2.5    3.7    4.9 cm 0.01 ms",
            "mono            12       -       -        -      -      -      - cm       -",
            "toolbox      0.40 m      4.25 s        -            -       4.25 m",
            "false alarms: 2 by the picture, 3 by place; - a frame",
            "camera W1530: 3 frames lost, no image from 1.00 to 2.50 s, too late from 1.00 s to the end, \
             no image from 1.00 to 2.50 s, too late from 1.00 s to the end, 5 faults in all",
            "9 dark lamps: 1-1, 1-2, 1-3, 1-4, 1-5, 1-6, 1-7, 1-8, ...",
            "braked for what was ahead from 20.00 s, emergency brake at 20.50 s, stood at 30.01 s, it lacked \
             1.2 m to stop in; COLLISION",
            "  hit toolbox at 31.50 s with 36.0 km/h: 1234 N s, 1.50 kJ of 5.00 kJ lost, beyond design damage",
            "  and 1 more hits: see summary.json",
            "train ran 512.3 m; floor 0.346 m/s^2 vertical, 0.200 lateral (RMS); wheel load down to 88 %; \
             slip up to 0.12 m/s; pressed aside by up to 12 kN; stopped 0.26 m short of the mark",
            "   12.50 s: switch W1, run through, train 1, at 460.0 m of track u4",
            "   12.50 s: switch W1, run through, train 1, at YDK12+460.0 of track u1",
        ] {
            assert!(text.lines().any(|l| l == line), "{line}\n{text}");
        }
    }
}
