use super::*;
use crate::track::alignment::{Alignment, PlanElement};
use nalgebra::Point3;

/// Straight, clothoid, arc, clothoid, straight.
fn drawn(radius_m: f64) -> Alignment {
    let clothoid = |from, to| PlanElement {
        start_per_m: from,
        end_per_m: to,
        ..PlanElement::straight(40.0)
    };
    let k = 1.0 / radius_m;
    let plan = [
        PlanElement::straight(150.0),
        clothoid(0.0, k),
        PlanElement::arc(120.0, k, 0.0),
        clothoid(k, 0.0),
        PlanElement::straight(150.0),
    ];
    Alignment::new(Point3::new(20.0, 30.0, 0.0), 0.6, &plan, &[])
}

/// Points every so many metres, to either side by turns and by up to so much.
fn sampled(line: &Alignment, apart_m: f64, noise_m: f64) -> Vec<Point2<f64>> {
    let count = (line.length_m() / apart_m).ceil() as u32;
    let points = (0..=count).map(|k| {
        let frame = line.at(line.length_m() * f64::from(k) / f64::from(count));
        // As even as random numbers, and the same in every run: multiples of the golden section.
        let noise = 2.0 * (f64::from(k) * 0.618_033_988_75).fract() - 1.0;
        frame.world_from_section(noise_m * noise, 0.0).xy()
    });
    points.collect()
}

fn task<'a>(points: &'a [Point2<f64>], sigma_m: f64) -> FitTask<'a> {
    FitTask {
        points,
        rules: [EndRule::default(); 2],
        sigma_m,
    }
}

/// From the drawn line, at the most.
fn away_m(chain: &ArcChain, line: &Alignment) -> f64 {
    let at_m: Vec<f64> = (0..=100)
        .map(|k| chain.length_m * f64::from(k) / 100.0)
        .collect();
    let places = chain.places(&at_m).into_iter();
    let away = places.map(|place| {
        let world = Point3::new(place.place.x, place.place.y, 0.0);
        line.track_from_world(&world, place.s_m).l_m.abs()
    });
    away.fold(0.0, f64::max)
}

/// Provokes: a curve of another radius, far from the line, or one that follows the noise.
#[test]
fn a_drawn_curve_is_found_again() {
    for radius_m in [200.0, 350.0, -600.0] {
        let line = drawn(radius_m);
        for (noise_m, sigma_m) in [(0.0, 0.1), (0.3, 0.2), (0.6, 0.4)] {
            let points = sampled(&line, 20.0, noise_m);
            let fit = task(&points, sigma_m).fit().unwrap();
            // Over the drawn arc of 120 m.
            let of_arc = fit
                .chain
                .places(&[-60.0, 60.0].map(|m| 0.5 * fit.chain.length_m + m));
            let middle = (of_arc[1].heading_rad - of_arc[0].heading_rad) / 120.0;
            let away_m = away_m(&fit.chain, &line);
            println!(
                "R {radius_m} noise {noise_m}: {} arcs, middle R {:.0}, {away_m:.2} m from the line, rms {:.2} m",
                fit.chain.per_m.len(),
                1.0 / middle,
                fit.rms_m
            );
            assert!(fit.rms_m <= sigma_m && fit.most_m <= 2.5 * sigma_m);
            assert!(away_m < 2.5 * sigma_m, "{away_m}");
            // A chord whose middle is moved by so much has its curvature changed by 8 times that over its square.
            let allowed_per_m = 8.0 * (noise_m + 2.5 * sigma_m) / (120.0 * 120.0);
            assert!(
                (middle - 1.0 / radius_m).abs() < allowed_per_m,
                "{}",
                1.0 / middle
            );
            assert!((fit.chain.length_m - line.length_m()).abs() < 1.0);
        }
    }
}

/// Provokes: ends that are not met, in place, direction or curvature.
#[test]
fn ends_are_met_exactly() {
    let line = drawn(300.0);
    let points = sampled(&line, 25.0, 0.5);
    let pose = |s_m: f64| {
        let frame = line.at(s_m);
        EndPose {
            place: frame.world_from_section(0.4, 0.0).xy(),
            heading_rad: frame.heading_rad + 0.01,
        }
    };
    let rules = [(0.0, None), (line.length_m(), Some(0.0))].map(|(s_m, per_m)| EndRule {
        pose: Some(pose(s_m)),
        per_m,
        is_kinked: false,
    });
    let task = FitTask {
        rules,
        ..task(&points, 0.3)
    };
    let chain = task.fit().unwrap().chain;
    let ends = chain.places(&[0.0, chain.length_m]);
    for (end, rule) in ends.iter().zip(rules) {
        let pose = rule.pose.unwrap();
        assert!((end.place - pose.place).norm() < 1e-6);
        assert!((end.heading_rad - pose.heading_rad).abs() < 1e-8);
    }
    assert!(ends[1].per_m.abs() < 1e-12);
}

/// Provokes: a curve that depends on the end from which it is looked at.
#[test]
fn from_its_other_end_it_is_the_mirrored_curve() {
    let points = sampled(&drawn(250.0), 20.0, 0.4);
    let there = task(&points, 0.3).fit().unwrap().chain;
    let reversed: Vec<_> = points.iter().rev().copied().collect();
    let back = task(&reversed, 0.3).fit().unwrap().chain;
    assert!((there.length_m - back.length_m).abs() < 1e-3);
    for k in 0..=50 {
        let s_m = there.length_m * f64::from(k) / 50.0;
        let [a, b] =
            [(&there, s_m), (&back, back.length_m - s_m)].map(|(c, m)| c.places(&[m])[0].clone());
        assert!(
            (a.place - b.place).norm() < 1e-2,
            "{}",
            (a.place - b.place).norm()
        );
        assert!((a.per_m + b.per_m).abs() < 1e-5);
    }
}

/// Provokes: straights that bend, by a little or by noise.
#[test]
fn a_straight_is_one() {
    let line = Alignment::new(Point3::origin(), 0.3, &[PlanElement::straight(400.0)], &[]);
    let points = sampled(&line, 30.0, 0.4);
    let chain = task(&points, 0.3).fit().unwrap().chain;
    assert!(
        chain.per_m.iter().all(|k| k.abs() < 1e-12),
        "{:?}",
        chain.per_m
    );
}

/// Provokes: a corner that is taken for a curve of some radius, or points far beside the curve that are not told.
#[test]
fn corners_are_no_curves() {
    let along = (0..=8).map(|k| Point2::new(5.0 * f64::from(k), 0.0));
    let up = (1..=8).map(|k| Point2::new(40.0, 5.0 * f64::from(k)));
    let corner: Vec<_> = along.chain(up).collect();
    match task(&corner, 0.05).fit() {
        Ok(fit) => assert!(fit.most_m > 0.5, "{}", fit.most_m),
        Err(error) => assert!(matches!(error, FitError::TooTight(_))),
    }
}
