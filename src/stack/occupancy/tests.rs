//! The filter on measurements drawn by the models that it believes in: a switch, a parallel track, a way back.

#![allow(clippy::print_stdout, reason = "a test prints its figures")]

use super::*;
use crate::track::plan::TrackElement;
use crate::twin::random::Stream;
use nalgebra::Vector2;

const STEM_M: f64 = 300.0;
/// Of the diverging leg: 1 in 9 with a radius of 200 m, to a track 4 m beside.
const RADIUS_M: f64 = 200.0;
const BESIDE_M: f64 = 4.0;

/// A stem that parts into a straight and a track beside it; both legs come together again after 600 m.
fn network() -> Arc<PlanNetwork> {
    let angle = (1.0f64 / 9.0).atan();
    let arc_m = RADIUS_M * angle;
    let straight_m = (BESIDE_M - 2.0 * RADIUS_M * (1.0 - angle.cos())) / angle.sin();
    let heading = |m: f64| match m {
        m if m < arc_m => m / RADIUS_M,
        m if m < arc_m + straight_m => angle,
        m if m < 2.0 * arc_m + straight_m => angle - (m - arc_m - straight_m) / RADIUS_M,
        _ => 0.0,
    };
    let mut leg = vec![Point2::new(STEM_M, 0.0)];
    for k in 0..600 {
        let (sin, cos) = heading(f64::from(k) + 0.5).sin_cos();
        leg.push(leg[leg.len() - 1] + Vector2::new(cos, sin));
    }
    let line = |from: f64, to: f64, y: f64| vec![Point2::new(from, y), Point2::new(to, y)];
    let elements = [
        TrackElement::new("stem", line(0.0, STEM_M, 0.0)),
        TrackElement::new("through", line(STEM_M, STEM_M + 600.0, 0.0)),
        TrackElement::new("diverging", leg),
    ];
    let end = |element, way| ElementEnd { element, way };
    let joints = [1, 2].map(|leg| (end(0, Direction::Up), end(leg, Direction::Down)));
    PlanNetwork::new(None, elements.into_iter().flatten().collect(), &joints).into()
}

/// What a train is given that runs up the stem and on over a leg.
struct Run {
    leg: usize,
    speed_mps: f64,
    with_gyro: bool,
    seed: u64,
}

impl Run {
    /// Goes 500 m beyond the toe; calls `look` after each fix with the distance beyond the toe.
    fn go(&self, settings: OccupancySettings, mut look: impl FnMut(f64, &Decision)) {
        let network = network();
        let mut occupancy = Occupancy::new(Arc::clone(&network), settings);
        let stream = Stream::new(self.seed, self.leg as u64, "occupancy test");
        let normal = |what: u64, k: u64| stream.normal(what * 1_000_000 + k);
        let at = |m: f64| match m < STEM_M {
            true => network.elements[0].at(m),
            false => network.elements[self.leg].at(m - STEM_M),
        };
        // One metre an axis, as the filter believes it: four fifths of the variance change slowly.
        let (slow, white) = (0.8f64.sqrt(), 0.2f64.sqrt());
        let (rate_hz, mut error) = (10.0, Vector2::new(normal(0, 0), normal(1, 0)) * slow);
        let scale = 1.0 + 0.01 * normal(2, 0);
        let yaw_offset = 5e-4 * normal(3, 0);
        let keep = (-1.0 / (rate_hz * settings.correlation_s)).exp();
        let mut heading_rad = 0.0;
        let count = ((STEM_M + 500.0 - 100.0) / self.speed_mps * rate_hz) as u64;
        for k in 1..count {
            let time = SimTime::from_secs(k as f64 / rate_hz);
            let m = 100.0 + self.speed_mps * k as f64 / rate_hz;
            let chord = at(m + 7.5).0 - at(m - 7.5).0;
            let now_rad = chord.y.atan2(chord.x);
            let turned_radps = (now_rad - heading_rad) * rate_hz;
            heading_rad = now_rad;
            occupancy.on_speed(time, self.speed_mps * scale + 0.05 * normal(4, k));
            if self.with_gyro {
                let noise = yaw_offset + 1e-3 * normal(5, k);
                occupancy.on_yaw_rate(time, turned_radps + noise);
            }
            let step =
                Vector2::new(normal(6, k), normal(7, k)) * (slow * (1.0 - keep * keep).sqrt());
            error = error * keep + step;
            let place = at(m).0 + error + Vector2::new(normal(8, k), normal(9, k)) * white;
            occupancy.on_fix(&Fix {
                time,
                place,
                covariance_m2: Matrix2::identity(),
            });
            look(m - STEM_M, &occupancy.decision());
        }
    }
}

/// Fails where a leg is told too late, or the wrong one is: 20 runs over each leg at two speeds.
#[test]
fn a_yaw_rate_tells_the_leg_soon() {
    let mut distances_m = Vec::new();
    for seed in 0..20 {
        for (leg, speed_mps) in [(1, 8.0), (2, 8.0), (1, 22.0), (2, 22.0)] {
            let run = Run {
                leg,
                speed_mps,
                with_gyro: true,
                seed,
            };
            let mut told_m = f64::INFINITY;
            run.go(OccupancySettings::default(), |beyond_m, decision| {
                let best = &decision.tracks[0];
                if beyond_m > 5.0 && decision.is_identified() {
                    assert_eq!(best.element, leg, "{seed} {leg} {speed_mps}: at {beyond_m}");
                    told_m = told_m.min(beyond_m);
                }
            });
            distances_m.push(told_m);
        }
    }
    let mean_m = distances_m.iter().sum::<f64>() / distances_m.len() as f64;
    let worst_m = distances_m.iter().copied().fold(0.0, f64::max);
    println!("identified {mean_m:.1} m beyond the toe in the mean, {worst_m:.1} m at worst");
    assert!(mean_m < 30.0, "{mean_m}");
    assert!(worst_m < 60.0, "{worst_m}");
}

/// Fails where fixes that are wrong for a minute are taken for as many measurements as they are: without a yaw rate
/// the wrong leg may be the more probable one, but is never the only one left, and is as often wrong as it says.
#[test]
fn correlated_errors_make_no_false_certainty() {
    let (mut said, mut right, mut count) = (0.0, 0.0, 0);
    for seed in 0..60 {
        for leg in [1, 2] {
            let run = Run {
                leg,
                speed_mps: 15.0,
                with_gyro: false,
                seed,
            };
            let mut last = None;
            run.go(OccupancySettings::default(), |beyond_m, decision| {
                let best = decision.tracks[0];
                if beyond_m > 5.0 && decision.is_identified() {
                    assert_eq!(best.element, leg, "{seed} {leg}: at {beyond_m}");
                }
                last = Some(best);
            });
            let best = last.unwrap();
            said += best.probability;
            right += f64::from(u8::from(best.element == leg));
            count += 1;
        }
    }
    let [said, right] = [said, right].map(|sum| sum / f64::from(count));
    println!("the more probable leg: {said:.3} by its own word, {right:.3} right");
    // Three standard deviations of the share of 120 runs.
    let sigma = (said * (1.0 - said) / f64::from(count)).sqrt();
    assert!(
        (said - right).abs() < 3.0 * sigma.max(0.01),
        "{said} {right}"
    );
}

/// Fails where the seed's method takes its match elsewhere than on the track, or never decides.
#[test]
fn matches_alone_tell_legs_of_good_fixes() {
    for method in [Method::Pedal, Method::Perpendicular] {
        let settings = OccupancySettings {
            method,
            correlation_s: 1e-3,
            ..OccupancySettings::default()
        };
        for leg in [1, 2] {
            let run = Run {
                leg,
                speed_mps: 15.0,
                with_gyro: false,
                seed: 3,
            };
            let mut told_m = f64::INFINITY;
            run.go(settings, |beyond_m, decision| {
                if beyond_m > 5.0 && decision.is_identified() {
                    assert_eq!(decision.tracks[0].element, leg, "{method:?} at {beyond_m}");
                    told_m = told_m.min(beyond_m);
                }
            });
            assert!(told_m < 150.0, "{method:?}: {told_m}");
        }
    }
}

/// Fails where a train that goes back through a switch is held on the leg that it came from, although the switch may
/// have been thrown; or where it is not found again.
#[test]
fn a_train_may_come_back_onto_the_other_leg() {
    let network = network();
    let mut occupancy = Occupancy::new(Arc::clone(&network), OccupancySettings::default());
    let mut time_s = 0.0;
    let mut drive =
        |occupancy: &mut Occupancy, element: usize, from_m: f64, speed_mps: f64, seconds: u32| {
            for k in 0..10 * seconds {
                time_s += 0.1;
                let time = SimTime::from_secs(time_s);
                occupancy.on_speed(time, speed_mps);
                let m = from_m + 0.1 * f64::from(k + 1) * speed_mps;
                let (place, _) = network.elements[element].at(m);
                occupancy.on_fix(&Fix {
                    time,
                    place,
                    covariance_m2: Matrix2::identity() * 0.01,
                });
            }
            occupancy.decision()
        };
    let on = |decision: &Decision, element: usize| {
        assert!(
            decision.is_identified() && decision.tracks[0].element == element,
            "{decision:?}"
        );
    };
    let ahead = drive(&mut occupancy, 0, 100.0, 10.0, 20);
    assert_eq!(ahead.tracks[0].facing, Direction::Up);
    on(&drive(&mut occupancy, 1, 0.0, 10.0, 20), 1);
    drive(&mut occupancy, 1, 200.0, -10.0, 20);
    on(&drive(&mut occupancy, 0, STEM_M, -10.0, 10), 0);
    on(&drive(&mut occupancy, 0, 200.0, 10.0, 9), 0);
    on(&drive(&mut occupancy, 2, 0.0, 10.0, 20), 2);
}
