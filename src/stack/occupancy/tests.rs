//! The filter where a train goes back through a switch.

use super::*;
use crate::track::plan::TrackElement;
use nalgebra::Vector2;

const STEM_M: f64 = 300.0;
/// Of the diverging leg: 1 in 9 with a radius of 200 m, to a track 4 m beside.
const RADIUS_M: f64 = 200.0;
const BESIDE_M: f64 = 4.0;

/// A stem that parts into a straight and a track beside it.
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
