//! The centreline against closed forms, and against itself.

use super::*;
use std::f64::consts::FRAC_PI_2;

fn clothoid(length_m: f64, start_per_m: f64, end_per_m: f64) -> PlanElement {
    PlanElement {
        length_m,
        start_per_m,
        end_per_m,
        start_cant_m: 50.0 * start_per_m,
        end_cant_m: 50.0 * end_per_m,
    }
}

fn grade(from_m: f64, slope: f64, radius_m: f64) -> Grade {
    Grade {
        from_m,
        slope,
        radius_m,
    }
}

/// Both ways round, compound, with a tight radius, on a grade.
pub(super) fn winding() -> Alignment {
    let elements = [
        PlanElement::straight(120.0),
        clothoid(60.0, 0.0, 1.0 / 350.0),
        PlanElement::arc(200.0, 1.0 / 350.0, 50.0 / 350.0),
        clothoid(60.0, 1.0 / 350.0, 0.0),
        clothoid(45.0, 0.0, -1.0 / 150.0),
        PlanElement::arc(100.0, -1.0 / 150.0, -50.0 / 150.0),
        clothoid(70.0, -1.0 / 150.0, -1.0 / 800.0),
        PlanElement::arc(150.0, -1.0 / 800.0, -50.0 / 800.0),
        clothoid(40.0, -1.0 / 800.0, 0.0),
        PlanElement::straight(80.0),
    ];
    let grades = [
        grade(0.0, 0.002, 0.0),
        grade(200.0, -0.028, 3000.0),
        grade(600.0, 0.024, 5000.0),
    ];
    Alignment::new(Point3::new(1000.0, -2000.0, -15.0), 0.7, &elements, &grades)
}

#[test]
fn straights_and_arcs_have_their_closed_forms() {
    let line = Alignment::new(
        Point3::new(3.0, 4.0, 5.0),
        FRAC_PI_2,
        &[
            PlanElement::straight(100.0),
            PlanElement::arc(200.0, -1.0 / 400.0, 0.0),
        ],
        &[],
    );
    assert!((line.at(60.0).origin - Point3::new(3.0, 64.0, 5.0)).norm() < 1e-12);
    for s in [100.0, 130.0, 250.0, 299.999] {
        let turn: f64 = (s - 100.0) / 400.0;
        // To the right of north is east.
        let truth = Point3::new(
            3.0 + 400.0 * (1.0 - turn.cos()),
            104.0 + 400.0 * turn.sin(),
            5.0,
        );
        assert!((line.at(s).origin - truth).norm() < 1e-11, "{s}");
        assert!((line.at(s).heading_rad - (FRAC_PI_2 - turn)).abs() < 1e-14);
    }
}

/// Power series of the Fresnel integrals: for curvature s / A^2 the position is the sum of
/// (-1)^n L^(4n+1) / ((2n)! (4n+1) (2 A^2)^(2n)) and its like for y.
#[test]
fn val_clothoid_is_the_fresnel_series() {
    for (length, radius) in [(60.0, 350.0), (200.0, 150.0), (80.0, 50.0)] {
        let line = Alignment::new(
            Point3::origin(),
            0.0,
            &[clothoid(length, 0.0, 1.0 / radius)],
            &[],
        );
        for s in [0.1 * length, 0.47 * length, length] {
            let q = s * s / (2.0 * radius * length);
            let (mut x, mut y, mut term) = (0.0, 0.0, s);
            // term is s q^k / k!, cosine and sine terms by turns.
            for k in 0..40 {
                let value = term / f64::from(2 * k + 1);
                match k % 4 {
                    0 => x += value,
                    1 => y += value,
                    2 => x -= value,
                    _ => y -= value,
                }
                term *= q / f64::from(k + 1);
            }
            let p = line.at(s).origin;
            assert!((p - Point3::new(x, y, 0.0)).norm() < 1e-11, "{length} {s}");
        }
    }
}

/// Provokes: pieces or parabolas that do not join. A step of 2e-7 m may move by no more.
#[test]
fn position_heading_and_slope_are_continuous() {
    let line = winding();
    let joints = line.plan.iter().map(|p| p.s0);
    for s in joints.chain(line.profile.iter().map(|p| p.s0)) {
        let (a, b) = (line.at(s - 1e-7), line.at(s + 1e-7));
        assert!((a.origin - b.origin).norm() < 2.1e-7, "{s}");
        assert!((a.heading_rad - b.heading_rad).abs() < 1e-8);
        assert!((a.slope - b.slope).abs() < 1e-9);
        assert!((a.roll_rad - b.roll_rad).abs() < 1e-8);
    }
}

/// Provokes: a heading that is not the direction of motion, a slope or curvature that is not
/// the derivative it claims to be.
#[test]
fn frames_are_derivatives_of_positions() {
    let line = winding();
    let d = 1e-4;
    for k in 0..185 {
        let s = 2.5 + 5.0 * f64::from(k);
        let (a, m, b) = (line.at(s - d), line.at(s), line.at(s + d));
        let v = (b.origin - a.origin) / (2.0 * d);
        assert!(
            (v - m.ahead() - Vector3::z() * m.slope).norm() < 1e-7,
            "{s}"
        );
        let turn = (b.heading_rad - a.heading_rad) / (2.0 * d);
        assert!((turn - m.curvature_per_m).abs() < 1e-9);
    }
}

#[test]
fn world_and_track_invert_each_other() {
    let line = winding();
    for k in -20..200 {
        let s_m = 5.0 * f64::from(k) + 0.123;
        for (l_m, h_m) in [(0.0, 0.0), (2.9, 3.2), (-2.9, 4.0), (6.0, -1.0)] {
            let p = TrackPoint { s_m, l_m, h_m };
            for off in [-30.0, 0.0, 12.0] {
                let q = line.track_from_world(&line.world_from_track(p), s_m + off);
                let worst = (q.s_m - s_m)
                    .abs()
                    .max((q.l_m - l_m).abs())
                    .max((q.h_m - h_m).abs());
                assert!(worst < 1e-9, "{p:?} {q:?}");
            }
        }
    }
}

/// Between its ends the profile is a parabola with the radius asked for, and the middle of
/// a vertical curve is off the corner of the tangents by t^2 / 2R.
#[test]
fn val_vertical_curve_has_its_radius() {
    let grades = [grade(0.0, 0.01, 0.0), grade(500.0, -0.02, 4000.0)];
    let line = Alignment::new(
        Point3::origin(),
        0.0,
        &[PlanElement::straight(1000.0)],
        &grades,
    );
    let z = |s: f64| line.at(s).origin.z;
    let tangent_m = 0.5 * 4000.0 * 0.03;
    assert!((z(500.0) - (5.0 - tangent_m * tangent_m / (2.0 * 4000.0))).abs() < 1e-12);
    let bend = (z(510.0) - 2.0 * z(500.0) + z(490.0)) / 100.0;
    assert!((bend + 1.0 / 4000.0).abs() < 1e-12);
    assert!((z(1000.0) - (5.0 - 10.0)).abs() < 1e-12);
    assert!((line.at(500.0 - tangent_m - 0.01).slope - 0.01).abs() < 1e-15);
}

/// Provokes: cant with the wrong sign. In a curve to the left the right rail is higher, so
/// the plane of the rails leans to the left, towards the inside.
#[test]
fn cant_raises_the_outer_rail() {
    let line = winding();
    for (s, outer) in [(250.0, -0.7525), (530.0, 0.7525)] {
        let frame = line.at(s);
        assert!(frame.curvature_per_m * outer < 0.0);
        let rail = |l: f64| (frame.world_from_rails() * Point3::new(0.0, l, 0.0)).z;
        assert!(rail(outer) > rail(-outer) + 0.1);
        let level = frame.world_from_line() * Point3::new(0.0, 1.0, 0.0);
        assert!((level.z - frame.origin.z).abs() < 1e-12);
    }
    let frame = line.at(250.0);
    let rise = 2.0 * (frame.world_from_rails() * Point3::new(0.0, -0.75, 0.0) - frame.origin).z;
    // On a slope the vertical share of the cant is its cosine.
    let truth = 50.0 / 350.0 * frame.slope.atan().cos();
    assert!((rise - truth).abs() < 1e-12);
}

/// Provokes: the x axis of the frames not along the rails.
#[test]
fn frames_pitch_up_with_the_grade() {
    let frame = winding().at(700.0);
    let x = frame.world_from_rails() * Vector3::x();
    let along = (frame.ahead() + Vector3::z() * frame.slope).normalize();
    assert!((x - along).norm() < 1e-12);
}

/// Provokes: panics and NaN where there is nothing or nonsense to run along.
#[test]
fn odd_lines_do_not_panic() {
    let empty = Alignment::new(Point3::new(1.0, 2.0, 3.0), 0.0, &[], &[]);
    assert!((empty.at(7.0).origin - Point3::new(8.0, 2.0, 3.0)).norm() < 1e-12);
    assert!((empty.at(-7.0).origin - Point3::new(-6.0, 2.0, 3.0)).norm() < 1e-12);
    let odd = Alignment::new(
        Point3::origin(),
        0.0,
        &[
            clothoid(0.0, 0.0, 0.01),
            PlanElement::straight(10.0),
            PlanElement::straight(f64::NAN),
            PlanElement::straight(-4.0),
        ],
        &[grade(0.0, 0.0, 0.0), grade(5.0, 0.01, 0.0)],
    );
    assert!((odd.length_m() - 10.0).abs() < 1e-12);
    assert!((odd.at(10.0).origin.z - 0.05).abs() < 1e-12);
    assert!(odd.at(5.0).origin.x.is_finite());
    assert!(odd.at(f64::NAN).origin.x.is_nan());
    assert!(odd.at(f64::INFINITY).heading_rad.is_nan() || odd.at(1e300).heading_rad.is_finite());
}

/// Beyond its ends the line is straight.
#[test]
fn ends_run_on_straight() {
    let line = winding();
    let end = line.at(line.length_m());
    let beyond = line.at(line.length_m() + 40.0);
    let truth = end.origin + (end.ahead() + Vector3::z() * end.slope) * 40.0;
    assert!((beyond.origin - truth).norm() < 1e-9);
    assert!((line.at(-3.0).heading_rad - 0.7).abs() < 1e-15);
}

/// Provokes: a place, heading, curvature, slope or cant of the reversed line that is not the line's,
/// within it and beyond its ends.
#[test]
fn the_reversed_line_is_the_same_curve() {
    let line = winding();
    let reversed = line.reversed();
    let twice = reversed.reversed();
    let length_m = line.length_m();
    assert!((reversed.length_m() - length_m).abs() < 1e-12);
    for k in 0..2000 {
        let s = -50.0 + (length_m + 100.0) * (0.618_034 * f64::from(k)).fract();
        let (a, b, c) = (line.at(s), reversed.at(length_m - s), twice.at(s));
        assert!((a.origin - b.origin).norm() < 1e-9, "{s}");
        assert!((a.ahead() + b.ahead()).norm() < 1e-12, "{s}");
        assert!((a.slope + b.slope).abs() < 1e-12, "{s}");
        assert!((a.curvature_per_m + b.curvature_per_m).abs() < 1e-12);
        assert!((a.roll_rad + b.roll_rad).abs() < 1e-12, "{s}");
        let turn = a.world_from_rails().rotation.inverse() * b.world_from_rails().rotation;
        assert!((turn * Vector3::x() + Vector3::x()).norm() < 1e-9, "{s}");
        assert!((turn * Vector3::z() - Vector3::z()).norm() < 1e-9, "{s}");
        assert!((a.origin - c.origin).norm() < 1e-9, "{s}");
        assert!((a.ahead() - c.ahead()).norm() < 1e-9, "{s}");
        assert!((a.slope - c.slope).abs() < 1e-9, "{s}");
        assert!((a.curvature_per_m - c.curvature_per_m).abs() < 1e-9);
        assert!((a.roll_rad - c.roll_rad).abs() < 1e-9, "{s}");
    }
}
