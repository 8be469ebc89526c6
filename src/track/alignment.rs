//! Where the track runs: plan from straights, clothoids and arcs, profile from grades and
//! parabolic vertical curves, cant.
//!
//! Plan: curvature k is linear in chainage within every element, so the heading a is a parabola
//! and the position its Fresnel integral. With the plane as complex numbers, w = exp(i a) obeys
//! w' = i k w, which gives the power series of w and of the position, its integral, term by term.
//! Elements are cut into pieces of at most 25 m and 0.1 rad at their sharpest curvature; 16 terms
//! then leave less than 1e-13 m even where the curvature changes sides within one piece (the
//! term 0.1^8 / 8! of exp(i k' s^2 / 2)). A place costs a polynomial and no trigonometry. For
//! straights and arcs the series is that of their closed form.
//!
//! Profile: straight grades joined by parabolas, as railways are set out. Chainage is measured in
//! plan, as surveyors do; at 30 permille it is 0.45 mm short of the slope length a metre.
//!
//! Cant: half of it is taken from raising the outer rail and half from lowering the inner one
//! (GB 50157 for tunnels), so the centreline at top of rail stays on the profile.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

/// One element of the plan: curvature runs linearly from `start_per_m` to `end_per_m`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanElement {
    /// Length in plan.
    pub length_m: f64,
    /// Curvature at its start, positive to the left.
    pub start_per_m: f64,
    /// Curvature at its end.
    pub end_per_m: f64,
    /// Height of the right rail over the left one at its start.
    pub start_cant_m: f64,
    /// And at its end.
    pub end_cant_m: f64,
}

/// A grade that begins at a chainage, led in by a vertical curve centred on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grade {
    /// Where the tangents of the grades meet.
    pub from_m: f64,
    /// Rise over run.
    pub slope: f64,
    /// Radius of the vertical curve there (0 for none). Its ends are `radius_m` times half the
    /// change of slope away.
    pub radius_m: f64,
}

impl PlanElement {
    /// Without curvature and cant.
    pub fn straight(length_m: f64) -> Self {
        Self::arc(length_m, 0.0, 0.0)
    }

    /// Constant curvature (positive to the left) and cant (of the right rail over the left one).
    pub fn arc(length_m: f64, curvature_per_m: f64, cant_m: f64) -> Self {
        Self {
            length_m,
            start_per_m: curvature_per_m,
            end_per_m: curvature_per_m,
            start_cant_m: cant_m,
            end_cant_m: cant_m,
        }
    }
}

/// Chainage, left, up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackPoint {
    /// Chainage along the centreline in plan.
    pub s_m: f64,
    /// Left of the centreline.
    pub l_m: f64,
    /// Above top of rail.
    pub h_m: f64,
}

/// The track at one chainage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackFrame {
    /// Chainage.
    pub s_m: f64,
    /// Centreline at top of rail, world.
    pub origin: Point3<f64>,
    /// Direction up the line in plan, from east to north.
    pub heading_rad: f64,
    /// Rise over run.
    pub slope: f64,
    /// Plan curvature, positive to the left.
    pub curvature_per_m: f64,
    /// Roll by cant about the direction up the line, left side up positive: negative in curves
    /// to the left, where the right rail is the higher one.
    pub roll_rad: f64,
}

impl TrackFrame {
    /// Axes along the rails (x up the line along the slope, y left, z up), without cant.
    pub fn world_from_line(&self) -> Isometry3<f64> {
        Isometry3::from_parts(Translation3::from(self.origin), self.rotation(0.0))
    }

    /// Axes of the rail plane: as [`Self::world_from_line`], rolled by the cant.
    pub fn world_from_rails(&self) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::from(self.origin),
            self.rotation(self.roll_rad),
        )
    }

    fn rotation(&self, roll: f64) -> UnitQuaternion<f64> {
        // Pitch up by the slope is a negative turn about y (left).
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.heading_rad)
            * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -self.slope.atan())
            * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), roll)
    }

    /// Unit vector up the line in plan.
    pub fn ahead(&self) -> Vector3<f64> {
        let (sin, cos) = self.heading_rad.sin_cos();
        Vector3::new(cos, sin, 0.0)
    }

    /// Unit vector to the left.
    pub fn left(&self) -> Vector3<f64> {
        let (sin, cos) = self.heading_rad.sin_cos();
        Vector3::new(-sin, cos, 0.0)
    }

    /// World position of a point (l, h) of the vertical plane at this chainage.
    pub fn world_from_section(&self, l_m: f64, h_m: f64) -> Point3<f64> {
        self.origin + self.left() * l_m + Vector3::new(0.0, 0.0, h_m)
    }
}

/// The base over which cant is measured: nominally the distance of the rails' centre lines
/// (EN 13848-1), whatever the width of their heads.
pub const CANT_BASE_M: f64 = 1.5;

/// Terms of the position's power series.
const TERMS: usize = 16;
/// Longest curved piece.
const PIECE_M: f64 = 25.0;
/// Most that a piece turns.
const PIECE_RAD: f64 = 0.1;
/// No element is cut into more (an arc of 1000 km would have as many).
const MOST_PIECES: f64 = 40_000.0;

/// A stretch of the plan, from `s0` to where the next begins; the first and the last one run on
/// for ever.
#[derive(Clone, Copy, Debug)]
struct Piece {
    s0: f64,
    heading0: f64,
    curvature0: f64,
    curvature_rate: f64,
    cant0: f64,
    cant_rate: f64,
    /// Position as polynomials of the distance from `s0`, lowest power first.
    x: [f64; TERMS],
    y: [f64; TERMS],
}

impl Piece {
    fn new(s0: f64, start: (f64, f64), heading0: f64, curvature: Linear, cant: Linear) -> Self {
        let (mut x, mut y) = ([0.0; TERMS], [0.0; TERMS]);
        (x[0], y[0]) = start;
        // (n + 1) w[n + 1] = i (curvature0 w[n] + rate w[n - 1]), position[n + 1] = w[n] / (n + 1)
        let (sin, cos) = heading0.sin_cos();
        let (mut w, mut before) = ((cos, sin), (0.0, 0.0));
        for n in 1..TERMS {
            x[n] = w.0 / n as f64;
            y[n] = w.1 / n as f64;
            let re = curvature.start * w.0 + curvature.rate * before.0;
            let im = curvature.start * w.1 + curvature.rate * before.1;
            before = w;
            w = (-im / n as f64, re / n as f64);
        }
        Self {
            s0,
            heading0,
            curvature0: curvature.start,
            curvature_rate: curvature.rate,
            cant0: cant.start,
            cant_rate: cant.rate,
            x,
            y,
        }
    }

    fn curvature(&self, ds: f64) -> f64 {
        self.curvature0 + self.curvature_rate * ds
    }

    fn heading(&self, ds: f64) -> f64 {
        self.heading0 + ds * (self.curvature0 + 0.5 * self.curvature_rate * ds)
    }

    fn cant(&self, ds: f64) -> f64 {
        self.cant0 + self.cant_rate * ds
    }

    fn position(&self, ds: f64) -> (f64, f64) {
        let terms = self.x.iter().zip(&self.y).rev();
        terms.fold((0.0, 0.0), |(x, y), (cx, cy)| (x * ds + cx, y * ds + cy))
    }

    /// The piece that begins `ds` further.
    fn next(&self, ds: f64, curvature: Linear, cant: Linear) -> Self {
        let (s0, heading0) = (self.s0 + ds, self.heading(ds));
        Self::new(s0, self.position(ds), heading0, curvature, cant)
    }
}

/// A number that changes linearly along the line.
#[derive(Clone, Copy)]
struct Linear {
    start: f64,
    rate: f64,
}

impl Linear {
    fn constant(start: f64) -> Self {
        Self { start, rate: 0.0 }
    }

    /// From `start` to `end` over a length, looked at from `into` on.
    fn between(start: f64, end: f64, length_m: f64, into_m: f64) -> Self {
        let rate = (end - start) / length_m;
        Self {
            start: start + rate * into_m,
            rate,
        }
    }
}

/// How many pieces an element needs.
fn pieces(e: &PlanElement) -> f64 {
    let sharpest = e.start_per_m.abs().max(e.end_per_m.abs());
    if sharpest > 0.0 {
        let by_turn = sharpest * e.length_m / PIECE_RAD;
        let by_length = e.length_m / PIECE_M;
        by_turn.max(by_length).ceil().clamp(1.0, MOST_PIECES)
    } else {
        1.0
    }
}

/// A stretch of the profile: a parabola from `s0` to where the next begins.
#[derive(Clone, Copy, Debug)]
struct Parabola {
    s0: f64,
    z0: f64,
    slope0: f64,
    /// Change of slope a metre.
    bend_per_m: f64,
}

impl Parabola {
    fn at(&self, s_m: f64) -> (f64, f64) {
        let d = s_m - self.s0;
        (
            self.z0 + d * (self.slope0 + 0.5 * self.bend_per_m * d),
            self.slope0 + self.bend_per_m * d,
        )
    }
}

/// The centreline.
///
/// ```
/// use metrotwin::track::{Alignment, PlanElement, TrackPoint};
/// use nalgebra::Point3;
///
/// let quarter = PlanElement::arc(500.0 * std::f64::consts::FRAC_PI_2, 1.0 / 500.0, 0.1);
/// let line = Alignment::new(Point3::origin(), 0.0, &[quarter], &[]);
/// let end = line.at(line.length_m()).origin;
/// assert!((end - Point3::new(500.0, 500.0, 0.0)).norm() < 1e-9);
///
/// let lamp = TrackPoint { s_m: 100.0, l_m: 2.7, h_m: 3.2 };
/// let again = line.track_from_world(&line.world_from_track(lamp), 95.0);
/// assert!((again.s_m - lamp.s_m).abs() < 1e-9);
/// ```
#[derive(Clone, Debug)]
pub struct Alignment {
    /// Never empty: a straight that leads in, the elements, a straight that leads out.
    plan: Vec<Piece>,
    /// Never empty.
    profile: Vec<Parabola>,
    length_m: f64,
}

impl Alignment {
    /// From its elements, starting at `start` with `heading_rad`. The first grade holds from
    /// ever; none means level. Beyond both ends the line runs on straight. Elements without
    /// length are left out.
    pub fn new(
        start: Point3<f64>,
        heading_rad: f64,
        elements: &[PlanElement],
        grades: &[Grade],
    ) -> Self {
        let elements: Vec<&PlanElement> = elements
            .iter()
            .filter(|e| e.length_m > 0.0 && e.length_m.is_finite())
            .collect();
        let level = elements.first().map_or(0.0, |e| e.start_cant_m);
        let straight = Linear::constant(0.0);
        let begin = (start.x, start.y);
        let lead_in = Piece::new(0.0, begin, heading_rad, straight, Linear::constant(level));
        let mut plan = vec![lead_in];
        let (mut last, mut last_m) = (lead_in, 0.0);
        // Lengths are summed by element, so that a user finds his own chainages.
        let mut begin_m = 0.0;
        for e in elements {
            let count = pieces(e);
            let step_m = e.length_m / count;
            for k in 0..count as usize {
                let into_m = k as f64 * step_m;
                let curvature = Linear::between(e.start_per_m, e.end_per_m, e.length_m, into_m);
                let cant = Linear::between(e.start_cant_m, e.end_cant_m, e.length_m, into_m);
                last = last.next(last_m, curvature, cant);
                last.s0 = begin_m + into_m;
                last_m = step_m;
                plan.push(last);
            }
            begin_m += e.length_m;
        }
        let mut lead_out = last.next(last_m, straight, Linear::constant(last.cant(last_m)));
        lead_out.s0 = begin_m;
        plan.push(lead_out);
        Self {
            plan,
            profile: profile(start.z, grades),
            length_m: begin_m,
        }
    }

    /// Length in plan.
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// The track at a chainage (extended straight beyond both ends).
    pub fn at(&self, s_m: f64) -> TrackFrame {
        let k = self.plan.partition_point(|p| p.s0 <= s_m);
        let piece = &self.plan[k.saturating_sub(1)];
        let ds = s_m - piece.s0;
        let (x, y) = piece.position(ds);
        let k = self.profile.partition_point(|p| p.s0 <= s_m);
        let (z, slope) = self.profile[k.saturating_sub(1)].at(s_m);
        TrackFrame {
            s_m,
            origin: Point3::new(x, y, z),
            heading_rad: piece.heading(ds),
            slope,
            curvature_per_m: piece.curvature(ds),
            roll_rad: -(piece.cant(ds) / CANT_BASE_M).clamp(-1.0, 1.0).asin(),
        }
    }

    /// World position of a point on the line.
    pub fn world_from_track(&self, p: TrackPoint) -> Point3<f64> {
        self.at(p.s_m).world_from_section(p.l_m, p.h_m)
    }

    /// Point on the line of a world position, by Newton's method from a chainage nearby (the
    /// lateral offset must stay under the radius of the curve, as inside any tunnel it does).
    pub fn track_from_world(&self, p: &Point3<f64>, near_s_m: f64) -> TrackPoint {
        let mut s_m = near_s_m;
        for _ in 0..32 {
            let f = self.at(s_m);
            let to = p - f.origin;
            let step_m =
                to.dot(&f.ahead()) / (1.0 - f.curvature_per_m * to.dot(&f.left())).max(0.1);
            s_m += step_m.clamp(-50.0, 50.0);
            if step_m.abs() < 1e-12 * (1.0 + s_m.abs()) {
                break;
            }
        }
        let f = self.at(s_m);
        let to = p - f.origin;
        TrackPoint {
            s_m,
            l_m: to.dot(&f.left()),
            h_m: to.z,
        }
    }
}

/// Grades and the parabolas between them as one chain. Every vertical curve adds its bend where
/// it begins and takes it away where it ends, so curves that overlap add up.
fn profile(start_z: f64, grades: &[Grade]) -> Vec<Parabola> {
    // Chainage, change of slope at once, change of bend.
    let mut changes: Vec<(f64, f64, f64)> = Vec::with_capacity(2 * grades.len());
    for pair in grades.windows(2) {
        let (from_m, change) = (pair[1].from_m, pair[1].slope - pair[0].slope);
        let half_m = 0.5 * pair[1].radius_m * change.abs();
        if half_m > 0.0 {
            let bend = change / (2.0 * half_m);
            changes.push((from_m - half_m, 0.0, bend));
            changes.push((from_m + half_m, 0.0, -bend));
        } else {
            changes.push((from_m, change, 0.0));
        }
    }
    changes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut last = Parabola {
        s0: 0.0,
        z0: start_z,
        slope0: grades.first().map_or(0.0, |g| g.slope),
        bend_per_m: 0.0,
    };
    let mut pieces = vec![last];
    for (s0, kink, bend) in changes {
        let (z0, slope) = last.at(s0);
        last = Parabola {
            s0,
            z0,
            slope0: slope + kink,
            bend_per_m: last.bend_per_m + bend,
        };
        pieces.push(last);
    }
    pieces
}

#[cfg(test)]
mod tests {
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
    fn winding() -> Alignment {
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
        assert!(
            odd.at(f64::INFINITY).heading_rad.is_nan() || odd.at(1e300).heading_rad.is_finite()
        );
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
}
