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
//! Profile: straight grades joined by parabolas, see `profile.rs`. Chainage is measured in plan, as
//! surveyors do; at 30 permille it is 0.45 mm short of the slope length a metre.
//!
//! Cant: half of it is taken from raising the outer rail and half from lowering the inner one
//! (GB 50157 for tunnels), so the centreline at top of rail stays on the profile.

mod piece;
mod profile;
mod stretch;
#[cfg(test)]
mod tests;

pub use profile::Grade;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector2, Vector3};
use piece::{LinearChange, PlanPiece, pieces};
use profile::{Parabola, profile};

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

/// The point nearest to a position is looked for from stations this far apart.
const STATION_M: f64 = 20.0;

/// A chain from its last stretch to its first, each turned round knowing where it ends. The last one
/// runs on for ever, and so does the first one of the result: it ends, and begins, in one place.
fn backwards<T>(chain: &[T], begin_m: impl Fn(&T) -> f64, turn: impl Fn(&T, f64) -> T) -> Vec<T> {
    let ends_m = chain.iter().skip(1).chain(chain.last()).map(begin_m);
    let mut turned: Vec<T> = chain
        .iter()
        .zip(ends_m)
        .map(|(t, end_m)| turn(t, end_m))
        .collect();
    turned.reverse();
    turned
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
    plan: Vec<PlanPiece>,
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
        let straight = LinearChange::constant(0.0);
        let begin = Vector2::new(start.x, start.y);
        let lead_in = PlanPiece::new(
            0.0,
            begin,
            heading_rad,
            straight,
            LinearChange::constant(level),
        );
        let mut plan = vec![lead_in];
        let (mut last, mut last_m) = (lead_in, 0.0);
        // Lengths are summed by element, so that a user finds his own chainages.
        let mut begin_m = 0.0;
        for e in elements {
            let count = pieces(e);
            let step_m = e.length_m / count;
            for k in 0..count as usize {
                let into_m = k as f64 * step_m;
                let curvature =
                    LinearChange::between(e.start_per_m, e.end_per_m, e.length_m, into_m);
                let cant = LinearChange::between(e.start_cant_m, e.end_cant_m, e.length_m, into_m);
                last = last.next(last_m, curvature, cant);
                last.s0 = begin_m + into_m;
                last_m = step_m;
                plan.push(last);
            }
            begin_m += e.length_m;
        }
        let mut lead_out = last.next(
            last_m,
            straight,
            LinearChange::constant(last.cant.at(last_m)),
        );
        lead_out.s0 = begin_m;
        plan.push(lead_out);
        Self {
            plan,
            profile: profile(start.z, grades),
            length_m: begin_m,
        }
    }

    /// The same line as met by who runs down it: chainage counts from its end, its left is right.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let length_m = self.length_m;
        let plan = backwards(&self.plan, |p| p.s0, |p, end_m| p.reversed(end_m, length_m));
        let profile = &self.profile;
        let profile = backwards(profile, |p| p.s0, |p, end_m| p.reversed(end_m, length_m));
        Self {
            plan,
            profile,
            length_m,
        }
    }

    /// The same line with more cant: by `more_m(chainage)` at the ends of each piece of the plan, linear
    /// between them.
    #[must_use]
    pub fn canted_more(&self, more_m: impl Fn(f64) -> f64) -> Self {
        let mut line = self.clone();
        for k in 0..line.plan.len() {
            let from_m = line.plan[k].s0;
            let to_m = line.plan.get(k + 1).map(|next| next.s0);
            let piece = &mut line.plan[k];
            let start = more_m(from_m);
            piece.cant.start += start;
            // The lead-in has no beginning, the lead-out no end.
            if let Some(to_m) = to_m.filter(|to_m| k > 0 && *to_m > from_m) {
                piece.cant.rate += (more_m(to_m) - start) / (to_m - from_m);
            }
        }
        line
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
        let place = piece.position(ds);
        let k = self.profile.partition_point(|p| p.s0 <= s_m);
        let (z, slope) = self.profile[k.saturating_sub(1)].at(s_m);
        TrackFrame {
            s_m,
            origin: Point3::new(place.x, place.y, z),
            heading_rad: piece.heading(ds),
            slope,
            curvature_per_m: piece.curvature.at(ds),
            roll_rad: -(piece.cant.at(ds) / CANT_BASE_M).clamp(-1.0, 1.0).asin(),
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

    /// The point of the line that is square to a world position; none where that lies beyond the line's ends.
    pub fn nearest(&self, world: &Point3<f64>) -> Option<TrackPoint> {
        self.point_near(world, self.near_m(world))
    }

    /// The same, looked for from a chainage near it.
    pub fn point_near(&self, world: &Point3<f64>, near_s_m: f64) -> Option<TrackPoint> {
        let point = self.track_from_world(world, near_s_m);
        (-1e-9..=self.length_m + 1e-9)
            .contains(&point.s_m)
            .then_some(point)
    }

    /// Chainage of the line's station nearest to a world position.
    pub fn near_m(&self, world: &Point3<f64>) -> f64 {
        let count = (self.length_m / STATION_M).ceil().max(1.0);
        let station = |k: u32| self.length_m * f64::from(k) / count;
        let away_m = |s_m: f64| (self.at(s_m).origin - world).xy().norm();
        (0..=count as u32)
            .map(station)
            .min_by(|a, b| f64::total_cmp(&away_m(*a), &away_m(*b)))
            .unwrap_or(0.0)
    }
}
