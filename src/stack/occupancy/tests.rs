//! The filter where a train goes back through a switch.

use super::*;
use crate::track::Direction;
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

/// A train at 10 m/s along the stem, with fixes that are so far beside it, to the decimetre.
fn run_along_stem(occupancy: &mut Occupancy, seconds: std::ops::Range<u32>, beside_m: f64) {
    for second in seconds {
        let time = SimTime::from_secs(f64::from(second));
        occupancy.on_speed(time, 10.0);
        occupancy.on_fix(&Fix {
            time,
            place: Point2::new(10.0 * f64::from(second), beside_m),
            covariance_m2: Matrix2::identity() * 0.01,
        });
    }
}

/// Fails where a track is named although no fix was on the map, or where the right ones do not help afterwards.
#[test]
fn nothing_is_decided_before_map_and_fixes_agree() {
    let mut occupancy = Occupancy::new(network(), OccupancySettings::default());
    run_along_stem(&mut occupancy, 0..12, 150.0);
    assert_eq!(occupancy.decision(), Decision::default());
    run_along_stem(&mut occupancy, 12..25, 0.2);
    let decision = occupancy.decision();
    assert_eq!(decision.tracks[0].element, 0, "{decision:?}");
}

/// Fails where reflections move a train, or cost it the identification.
#[test]
fn reflections_do_not_move_a_train() {
    let mut occupancy = Occupancy::new(network(), OccupancySettings::default());
    run_along_stem(&mut occupancy, 0..20, 0.2);
    run_along_stem(&mut occupancy, 20..24, 60.0);
    run_along_stem(&mut occupancy, 24..25, 0.2);
    let decision = occupancy.decision();
    assert!(decision.is_identified(), "{decision:?}");
    assert!(
        (decision.tracks[0].along_m - 240.0).abs() < 1.0,
        "{decision:?}"
    );
}

/// Fails where a train without a speed is held to stand: from 10 m/s it may be anywhere between a stop at once and
/// 100 m on.
#[test]
fn a_place_is_uncertain_after_a_silence() {
    let mut occupancy = Occupancy::new(network(), OccupancySettings::default());
    run_along_stem(&mut occupancy, 0..10, 0.2);
    let before = occupancy.decision().tracks[0];
    // However often something else comes.
    for k in 0..=500 {
        occupancy.on_yaw_rate(SimTime::from_secs(12.0 + 0.02 * f64::from(k)), 0.0);
    }
    let after = occupancy.decision().tracks[0];
    let gone_m = after.along_m - before.along_m;
    assert!(gone_m - 2.0 * after.sigma_m < 50.0, "{before:?} {after:?}");
    assert!(gone_m + 2.0 * after.sigma_m > 120.0, "{before:?} {after:?}");
}

/// Fails where a train that was put on a wrong track with certainty stays there although fixes say otherwise.
#[test]
fn a_wrong_certainty_is_given_up() {
    let lines = [("one", 0.0), ("other", 20.0)]
        .map(|(id, y)| TrackElement::new(id, vec![Point2::new(0.0, y), Point2::new(3000.0, y)]));
    let network = PlanNetwork::new(None, lines.into_iter().flatten().collect(), &[]);
    let mut occupancy = Occupancy::new(network.into(), OccupancySettings::default());
    run_along_stem(&mut occupancy, 0..60, 20.0);
    let wrong = occupancy.decision();
    assert!(
        wrong.is_identified() && wrong.tracks[0].element == 1,
        "{wrong:?}"
    );
    run_along_stem(&mut occupancy, 60..120, 0.2);
    let right = occupancy.decision();
    assert_eq!(right.tracks[0].element, 0, "{right:?}");
}

/// A straight of 300 m, a curve with a radius of 200 m, and a straight.
fn curved() -> Arc<PlanNetwork> {
    let turned = |m: f64| (m - 300.0).clamp(0.0, 100.0) / 200.0;
    let mut points = vec![Point2::new(0.0, 0.0)];
    for k in 0..700 {
        let (sin, cos) = turned(f64::from(k) + 0.5).sin_cos();
        points.push(points[points.len() - 1] + Vector2::new(cos, sin));
    }
    let elements = TrackElement::new("line", points).into_iter().collect();
    PlanNetwork::new(None, elements, &[]).into()
}

/// Fails where a car's heading is compared at the antenna instead of the car's middle, which turns sooner or later:
/// a curve then says that the train is elsewhere.
#[test]
fn a_curve_tells_the_place_wherever_the_antenna_is() {
    let network = curved();
    for antenna_behind_head_m in [1.0, 10.0, 18.0] {
        let settings = OccupancySettings {
            antenna_behind_head_m,
            ..OccupancySettings::default()
        };
        let mut occupancy = Occupancy::new(Arc::clone(&network), settings);
        let place = |head_m: f64| network.elements[0].at(head_m - antenna_behind_head_m).0;
        let heading = |head_m: f64| {
            let bogie = |m: f64| network.elements[0].at(head_m - 10.0 + m).0;
            let chord = bogie(7.5) - bogie(-7.5);
            chord.y.atan2(chord.x)
        };
        for k in 0..450u32 {
            let time = SimTime::from_secs(0.1 * f64::from(k));
            let head_m = 100.0 + f64::from(k);
            occupancy.on_speed(time, 10.0);
            occupancy.on_yaw_rate(time, (heading(head_m + 0.1) - heading(head_m - 0.1)) * 50.0);
            // Into a tunnel before the curve.
            if head_m < 250.0 && k % 10 == 0 {
                occupancy.on_fix(&Fix {
                    time,
                    place: place(head_m),
                    covariance_m2: Matrix2::identity(),
                });
            }
        }
        occupancy.carry_on(SimTime::from_secs(44.9));
        let told = occupancy.decision().tracks[0];
        let error_m = told.along_m - (549.0 - antenna_behind_head_m);
        assert!(
            error_m.abs() < 1.0 && told.sigma_m < 3.0,
            "{antenna_behind_head_m}: {error_m} {}",
            told.sigma_m
        );
    }
}

/// A train that takes the diverging leg at 12 m/s, with fixes of 1 m, whose yaw rate is missing between two distances
/// from the toe: classes of fixes behind the toe, wrong and certain first, then right and certain.
fn diverging_without_yaw_rate(missing_m: [f64; 2]) -> [usize; 2] {
    let network = network();
    let mut occupancy = Occupancy::new(Arc::clone(&network), OccupancySettings::default());
    let place = |m: f64| match m < STEM_M {
        true => network.elements[0].at(m).0,
        false => network.elements[2].at(m - STEM_M).0,
    };
    let heading = |m: f64| {
        let chord = place(m + 7.5) - place(m - 7.5);
        chord.y.atan2(chord.x)
    };
    let mut certain = [0; 2];
    for k in 0..4000u32 {
        let (time, m) = (
            SimTime::from_secs(0.01 * f64::from(k)),
            20.0 + 0.12 * f64::from(k),
        );
        occupancy.on_speed(time, 12.0);
        let rate_radps = (heading(m + 0.5) - heading(m - 0.5)) * 12.0;
        if !(missing_m[0]..missing_m[1]).contains(&(m - STEM_M)) {
            occupancy.on_yaw_rate(time, rate_radps);
        }
        if k % 20 == 0 {
            occupancy.on_fix(&Fix {
                time,
                place: place(m),
                covariance_m2: Matrix2::identity(),
            });
            let decision = occupancy.decision();
            if m > STEM_M && decision.is_identified() {
                certain[usize::from(decision.tracks[0].element == 2)] += 1;
            }
        }
    }
    certain
}

/// Fails where a yaw rate that is not there is taken for one of a train that runs straight on.
#[test]
fn a_yaw_rate_that_is_missing_says_nothing() {
    for missing_m in [
        [0.0, 0.0],
        [-100.0, 1e9],
        [-20.0, 45.0],
        [2.0, 35.0],
        [-1e9, 5.0],
    ] {
        let [wrong, right] = diverging_without_yaw_rate(missing_m);
        assert_eq!(wrong, 0, "{missing_m:?}");
        assert!(right > 20, "{missing_m:?}: {right}");
    }
}

/// Fails where fixes that say next to nothing make a place known that a slide has made unsure.
#[test]
fn poor_fixes_do_not_make_up_for_a_speed() {
    let sigma_m = |fix_sigma_m: Option<f64>| {
        let mut occupancy = Occupancy::new(network(), OccupancySettings::default());
        run_along_stem(&mut occupancy, 0..5, 0.2);
        for k in 0..=100u32 {
            let time = SimTime::from_secs(4.1 + 0.1 * f64::from(k));
            occupancy.on_slide(time, 10.0);
            if let Some(fix_sigma_m) = fix_sigma_m {
                occupancy.on_fix(&Fix {
                    time,
                    place: Point2::new(40.0 + f64::from(k), 0.0),
                    covariance_m2: Matrix2::identity() * fix_sigma_m.powi(2),
                });
            }
        }
        occupancy.carry_on(SimTime::from_secs(14.1));
        occupancy.decision().tracks[0].sigma_m
    };
    let without_m = sigma_m(None);
    // At most 1 m/s after the wheel, after 10 s: a place within 60 m.
    assert!((30.0..90.0).contains(&without_m), "{without_m}");
    assert!(sigma_m(Some(1000.0)) > 0.8 * without_m);
    assert!(sigma_m(Some(1.0)) < 2.0);
}

/// Fails where a wheel that slips from the start on leaves the train where it stands.
#[test]
fn a_wheel_that_slips_at_once_makes_the_place_unsure() {
    let mut occupancy = Occupancy::new(network(), OccupancySettings::default());
    occupancy.on_fix(&Fix {
        time: SimTime::ZERO,
        place: Point2::new(10.0, 0.0),
        covariance_m2: Matrix2::identity(),
    });
    for k in 1..=100u32 {
        occupancy.on_slide(SimTime::from_secs(0.1 * f64::from(k)), 10.0);
    }
    occupancy.carry_on(SimTime::from_secs(10.0));
    let told = occupancy.decision().tracks[0];
    for true_m in [10.0, 110.0] {
        let off_m = (told.along_m - true_m).abs();
        assert!(off_m < 2.0 * told.sigma_m, "{true_m} m: {told:?}");
    }
}
