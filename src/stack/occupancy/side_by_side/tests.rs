use crate::bus::SimTime;
use crate::stack::occupancy::{Decision, Fix, Occupancy, OccupancySettings};
use crate::track::Direction;
use crate::track::plan::{ElementEnd, PlanNetwork, TrackElement};
use nalgebra::{Matrix2, Point2, Vector2};
use std::sync::Arc;

/// A run of 3 km at 20 m/s, with fixes so far to the left of x, on a map of two tracks with these places.
fn run(tracks_m: [fn(f64) -> f64; 2], beside_m: impl Fn(f64) -> f64) -> Decision {
    let tracks = tracks_m.map(|y| {
        let points = (0..=150).map(|k| Point2::new(20.0 * f64::from(k), y(20.0 * f64::from(k))));
        TrackElement::new("track", points.collect())
    });
    let network = PlanNetwork::new(None, tracks.into_iter().flatten().collect(), &[]);
    let mut occupancy = Occupancy::new(network.into(), OccupancySettings::default());
    for k in 1..740 {
        let (time, x_m) = (SimTime::from_secs(0.2 * f64::from(k)), 4.0 * f64::from(k));
        occupancy.on_speed(time, 20.0);
        occupancy.on_fix(&Fix {
            time,
            place: Point2::new(x_m, beside_m(x_m)),
            covariance_m2: Matrix2::identity(),
        });
    }
    occupancy.decision()
}

/// By 0.4 m to both sides, once in 240 m.
fn wavy_m(x_m: f64) -> f64 {
    0.4 * (x_m * std::f64::consts::TAU / 240.0).sin()
}

/// Fails where of two tracks, with fixes in the middle between them, the one that is mapped straight is taken for the
/// train's, or the one that is mapped with the waves that the fixes happen to have.
#[test]
fn what_a_map_has_wrong_of_a_distance_tells_no_track() {
    for fixes in [
        |_| 2.0,
        |x_m| 2.0 + 0.5 * wavy_m(x_m),
        |x_m| 2.0 + wavy_m(x_m),
    ] {
        let decision = run([|_| 0.0, |x_m| 4.0 + wavy_m(x_m)], fixes);
        let least = decision
            .tracks
            .iter()
            .map(|t| t.probability)
            .fold(1.0, f64::min);
        assert!(decision.tracks.len() == 2 && least > 0.1, "{decision:?}");
    }
}

/// Fails where tracks that part slowly are held for parallel ones: from 4 to 16 m over 3 km, less than a map may have
/// wrong of headings.
#[test]
fn tracks_that_part_slowly_are_told() {
    for (track, share) in [(0, 0.0), (1, 1.0)] {
        let decision = run([|_| 0.0, |x_m| 4.0 + 0.004 * x_m], |x_m| {
            share * (4.0 + 0.004 * x_m)
        });
        assert!(
            decision.is_identified() && decision.tracks[0].element == track,
            "{decision:?}"
        );
    }
}

/// Where a track with a switch lies beside a straight one: this, 4 m to the left the track to the switch, the leg that goes
/// straight on, and the one that turns to the left.
struct BesideSwitch {
    network: Arc<PlanNetwork>,
}

const SWITCH_M: f64 = 600.0;

impl BesideSwitch {
    /// With the radius of the turning leg, and the angle that it turns by.
    fn new(radius_m: f64, angle_rad: f64) -> Self {
        let straight = |id: &str, y: f64, [from, to]: [f64; 2]| {
            TrackElement::new(id, vec![Point2::new(from, y), Point2::new(to, y)])
        };
        let mut leg = vec![Point2::new(SWITCH_M, 4.0)];
        for k in 0..900 {
            let heading_rad = ((f64::from(k) + 0.5) / radius_m).min(angle_rad);
            let (sin, cos) = heading_rad.sin_cos();
            leg.push(leg[leg.len() - 1] + Vector2::new(cos, sin));
        }
        let elements = [
            straight("beside", 0.0, [0.0, 2000.0]),
            straight("to the switch", 4.0, [0.0, SWITCH_M]),
            straight("straight on", 4.0, [SWITCH_M, 2000.0]),
            TrackElement::new("turning", leg),
        ];
        let end = |element, way| ElementEnd { element, way };
        let joints = [2, 3].map(|leg| (end(1, Direction::Up), end(leg, Direction::Down)));
        let elements = elements.into_iter().flatten().collect();
        Self {
            network: PlanNetwork::new(None, elements, &joints).into(),
        }
    }

    /// A run at 20 m/s over the turning leg or along the straight tracks, to a place that is so far along. Fixes come every so
    /// many seconds up to a place, and are to the left of the true track.
    fn run(&self, turns: bool, to_m: f64, fixes: (f64, f64), left_m: f64) -> Decision {
        let (every_s, until_m) = fixes;
        let mut occupancy = Occupancy::new(Arc::clone(&self.network), OccupancySettings::default());
        let at = |m: f64| {
            let element = if m < SWITCH_M {
                1
            } else {
                2 + usize::from(turns)
            };
            let from_m = if m < SWITCH_M { 0.0 } else { SWITCH_M };
            self.network.elements[element].at(m - from_m)
        };
        let heading = |m: f64| {
            let chord = at(m + 7.5).0 - at(m - 7.5).0;
            chord.y.atan2(chord.x)
        };
        let mut next_s = 0.0;
        for k in 0..((to_m - 20.0) / 2.0) as u32 {
            let (seconds, m) = (0.1 * f64::from(k), 20.0 + 2.0 * f64::from(k));
            let time = SimTime::from_secs(seconds);
            occupancy.on_speed(time, 20.0);
            occupancy.on_yaw_rate(time, (heading(m + 0.5) - heading(m - 0.5)) * 20.0);
            if seconds >= next_s && m < until_m {
                next_s += every_s;
                let (place, forward) = at(m);
                occupancy.on_fix(&Fix {
                    time,
                    place: place + Vector2::new(-forward.y, forward.x) * left_m,
                    covariance_m2: Matrix2::identity(),
                });
            }
        }
        occupancy.decision()
    }
}

/// Fails where a turn onto a leg says nothing without fixes because the track was beside another one before.
#[test]
fn a_turn_without_fixes_tells_the_leg() {
    let switch = BesideSwitch::new(300.0, 0.5);
    for left_m in [-2.3, -1.7] {
        let decision = switch.run(true, 800.0, (1.0, 500.0), left_m);
        assert!(
            decision.is_identified() && decision.tracks[0].element == 3,
            "{left_m}: {decision:?}"
        );
    }
}

/// Fails where a track loses by a leg that turns away from the one beside it, and not the leg alone: the train runs straight
/// on, without fixes.
#[test]
fn a_leg_that_is_not_taken_says_nothing_of_the_track_beside() {
    let switch = BesideSwitch::new(300.0, 0.5);
    for left_m in [-2.3, -1.7] {
        let before = switch.run(false, 590.0, (1.0, 500.0), left_m);
        let after = switch.run(false, 900.0, (1.0, 500.0), left_m);
        let of = |decision: &Decision| {
            let found = decision.tracks.iter().find(|track| track.element == 0);
            found.map_or(0.0, |track| track.probability)
        };
        // Half of the other track's probability went to the leg, and is gone.
        assert!(
            of(&after) > of(&before) && of(&after) < 0.95,
            "{before:?} {after:?}"
        );
    }
}

/// Fails where the true leg is lost from one of few fixes to the next.
#[test]
fn few_fixes_tell_a_leg_beside_another_track() {
    let switch = BesideSwitch::new(190.0, 1.0 / 9.0);
    for every_s in [0.2, 1.0, 5.0] {
        for to_m in [660.0, 700.0, 760.0] {
            let decision = switch.run(true, to_m, (every_s, 2000.0), 0.3);
            let best = decision.tracks[0];
            assert!(
                best.element == 3 && best.probability > 0.99,
                "{every_s} {to_m}: {decision:?}"
            );
        }
    }
}
