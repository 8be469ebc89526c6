use super::*;
use crate::stack::occupancy::Fix;
use crate::track::plan::TrackElement;

/// A train at 10 m/s between or on two tracks 4 m apart, after fixes so far to the left of the first one and with such a
/// standard deviation, the last one a second before.
fn after_run(seconds: u32, beside_m: f64, sigma_m: f64) -> Occupancy {
    let lines = [("one", 0.0), ("other", 4.0)]
        .map(|(id, y)| TrackElement::new(id, vec![Point2::new(0.0, y), Point2::new(3000.0, y)]));
    let network = PlanNetwork::new(None, lines.into_iter().flatten().collect(), &[]);
    let mut occupancy = Occupancy::new(network.into(), OccupancySettings::default());
    for second in 0..seconds {
        let time = SimTime::from_secs(f64::from(second));
        occupancy.on_speed(time, 10.0);
        occupancy.on_fix(&Fix {
            time,
            place: Point2::new(10.0 * f64::from(second), beside_m),
            covariance_m2: Matrix2::identity() * sigma_m.powi(2),
        });
    }
    occupancy
}

fn on(element: usize, along_m: f64) -> ElementPlace {
    ElementPlace { element, along_m }
}

/// Fails where a train that was put on a wrong track with certainty stays there although it reads two groups of balises
/// of the other one; or where it leaves it for a single group, which may be foreign, however many balises that has.
#[test]
fn two_groups_of_balises_refute_a_certainty() {
    let mut occupancy = after_run(200, 4.2, 0.1);
    let wrong = occupancy.decision();
    assert!(
        wrong.is_identified() && wrong.tracks[0].element == 1,
        "{wrong:?}"
    );
    let antenna_m = wrong.tracks[0].along_m;
    let mut read = |farther_m: f64| {
        let time = SimTime::from_secs(199.0 + farther_m / 10.0);
        occupancy.on_speed(time, 10.0);
        occupancy.on_balise(time, on(0, antenna_m + 10.0 + farther_m));
        occupancy.decision()
    };
    for balise in 0..5 {
        let one = read(3.0 * f64::from(balise));
        assert!(
            one.tracks[0].element == 1 && !one.is_identified(),
            "{balise}: {one:?}"
        );
    }
    let two = read(60.0);
    assert!(
        two.tracks[0].element == 0 && two.tracks[0].probability > 0.99,
        "{two:?}"
    );
}

/// Fails where a group of balises makes a track certain, however many it has and however little the place is known: it may
/// be foreign.
#[test]
fn one_group_tells_no_more_than_that_it_may_be_foreign() {
    for sigma_m in [1.0, 5.0, 10.0] {
        let mut occupancy = after_run(100, 2.0, sigma_m);
        for balise in 0..8 {
            let farther_m = 6.0 + 3.0 * f64::from(balise);
            let time = SimTime::from_secs(99.0 + farther_m / 10.0);
            occupancy.on_speed(time, 10.0);
            occupancy.on_balise(time, on(0, 990.0 + 10.0 + farther_m));
            let decision = occupancy.decision();
            let doubt = 1.0 - decision.tracks[0].probability;
            assert!(decision.tracks[0].element == 0, "{decision:?}");
            assert!(
                (1e-8..1e-5).contains(&doubt) && !decision.is_identified(),
                "{sigma_m} m, balise {balise}: {doubt}"
            );
        }
    }
}

/// Fails where a train that has read a balise of the other track by cross-talk does not learn its place from its own.
#[test]
fn a_groups_place_is_taken_after_one_abreast_was_foreign() {
    let mut occupancy = after_run(200, 4.0, 0.3);
    let at = |second: f64| SimTime::from_secs(199.0 + second);
    occupancy.on_speed(at(0.6), 10.0);
    occupancy.on_balise(at(0.6), on(0, 2006.0));
    for second in 1..60 {
        occupancy.on_slide(at(f64::from(second)), 0.0);
    }
    let before = occupancy.decision().tracks[0];
    assert!(before.element == 1 && before.sigma_m > 50.0, "{before:?}");
    occupancy.on_balise(at(60.0), on(1, 2007.0));
    let after = occupancy.decision().tracks[0];
    assert!(after.element == 1 && after.sigma_m < 0.6, "{after:?}");
    assert!((after.along_m - 1997.0).abs() < 0.6, "{after:?}");
}
