//! Where the track runs: plan from straights, clothoids and arcs, profile from grades and
//! parabolic vertical curves, cant.
//!
//! Plan: curvature is linear in chainage within every element, so the heading is a parabola and
//! the position its Fresnel integral, taken by Gauss-Legendre quadrature (error under 1e-12 m for
//! the lengths and radii of railways). Chainage is measured in plan, as surveyors do; at 30
//! permille it is 0.45 mm short of the slope length a metre.

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

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
    /// Radius of the vertical curve there (0 for none).
    pub radius_m: f64,
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
    /// Roll by cant about the direction up the line, left side up positive.
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
        let r = Rotation3::from_axis_angle(&Vector3::z_axis(), self.heading_rad)
            * Rotation3::from_axis_angle(&Vector3::y_axis(), -self.slope.atan())
            * Rotation3::from_axis_angle(&Vector3::x_axis(), roll);
        UnitQuaternion::from_rotation_matrix(&r)
    }
}

/// Distance between the rail centre lines, which turns cant into roll.
pub const RAIL_CENTRES_M: f64 = 1.5;

#[derive(Clone, Copy, Debug)]
struct Placed {
    element: PlanElement,
    s0: f64,
    x0: f64,
    y0: f64,
    heading0: f64,
}

impl Placed {
    fn curvature(&self, ds: f64) -> f64 {
        let e = &self.element;
        e.start_per_m + (e.end_per_m - e.start_per_m) * ds / e.length_m
    }

    fn heading(&self, ds: f64) -> f64 {
        let e = &self.element;
        self.heading0 + ds * (e.start_per_m + 0.5 * (e.end_per_m - e.start_per_m) * ds / e.length_m)
    }

    fn position(&self, ds: f64) -> (f64, f64) {
        // Panels of at most 50 m keep the quadrature at rounding error.
        let panels = (ds.abs() / 50.0).ceil().max(1.0);
        let h = ds / panels;
        let (mut x, mut y) = (self.x0, self.y0);
        for k in 0..panels as usize {
            let mid = (k as f64 + 0.5) * h;
            for (node, weight) in GAUSS_LEGENDRE_8 {
                let a = self.heading(mid + 0.5 * h * node);
                x += 0.5 * h * weight * a.cos();
                y += 0.5 * h * weight * a.sin();
            }
        }
        (x, y)
    }
}

const GAUSS_LEGENDRE_8: [(f64, f64); 8] = [
    (-0.960_289_856_497_536_2, 0.101_228_536_290_376_26),
    (-0.796_666_477_413_626_7, 0.222_381_034_453_374_47),
    (-0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (-0.183_434_642_495_649_8, 0.362_683_783_378_361_97),
    (0.183_434_642_495_649_8, 0.362_683_783_378_361_97),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_47),
    (0.960_289_856_497_536_2, 0.101_228_536_290_376_26),
];

/// The centreline.
#[derive(Clone, Debug)]
pub struct Alignment {
    plan: Vec<Placed>,
    grades: Vec<Grade>,
    start_z: f64,
    length_m: f64,
}

impl Alignment {
    /// From its elements, starting at `start` with `heading_rad`. The first grade must begin at or
    /// before 0. Beyond both ends the line runs on straight.
    pub fn new(
        start: Point3<f64>,
        heading_rad: f64,
        elements: &[PlanElement],
        grades: &[Grade],
    ) -> Self {
        let mut plan = Vec::with_capacity(elements.len());
        let (mut s0, mut x0, mut y0, mut heading0) = (0.0, start.x, start.y, heading_rad);
        for &element in elements {
            let placed = Placed {
                element,
                s0,
                x0,
                y0,
                heading0,
            };
            (x0, y0) = placed.position(element.length_m);
            heading0 = placed.heading(element.length_m);
            s0 += element.length_m;
            plan.push(placed);
        }
        Self {
            plan,
            grades: grades.to_vec(),
            start_z: start.z,
            length_m: s0,
        }
    }

    /// Length in plan.
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// The track at a chainage (extended straight beyond both ends).
    pub fn at(&self, s_m: f64) -> TrackFrame {
        let placed = self.element_at(s_m);
        let inside = (s_m - placed.s0).clamp(0.0, placed.element.length_m);
        let heading_rad = placed.heading(inside);
        let (mut x, mut y) = placed.position(inside);
        let beyond = s_m - placed.s0 - inside;
        x += beyond * heading_rad.cos();
        y += beyond * heading_rad.sin();
        let outside = s_m < 0.0 || s_m > self.length_m;
        let (z, slope) = self.profile(s_m);
        let e = &placed.element;
        let cant = e.start_cant_m + (e.end_cant_m - e.start_cant_m) * inside / e.length_m;
        TrackFrame {
            s_m,
            origin: Point3::new(x, y, z),
            heading_rad,
            slope,
            curvature_per_m: if outside {
                0.0
            } else {
                placed.curvature(inside)
            },
            roll_rad: (cant / RAIL_CENTRES_M).asin(),
        }
    }

    /// World position of a point on the line.
    pub fn world_from_track(&self, p: TrackPoint) -> Point3<f64> {
        let f = self.at(p.s_m);
        Point3::new(
            f.origin.x - p.l_m * f.heading_rad.sin(),
            f.origin.y + p.l_m * f.heading_rad.cos(),
            f.origin.z + p.h_m,
        )
    }

    /// Point on the line of a world position, by Newton's method from a chainage nearby (the
    /// lateral offset must stay under the radius of the curve, as inside any tunnel it does).
    pub fn track_from_world(&self, p: &Point3<f64>, near_s_m: f64) -> TrackPoint {
        let mut s_m = near_s_m;
        for _ in 0..32 {
            let f = self.at(s_m);
            let (sin, cos) = f.heading_rad.sin_cos();
            let (dx, dy) = (p.x - f.origin.x, p.y - f.origin.y);
            let along = dx * cos + dy * sin;
            let left = dy * cos - dx * sin;
            let step = along / (1.0 - f.curvature_per_m * left).max(0.1);
            s_m += step.clamp(-50.0, 50.0);
            if step.abs() < 1e-12 * (1.0 + s_m.abs()) {
                break;
            }
        }
        let f = self.at(s_m);
        let (sin, cos) = f.heading_rad.sin_cos();
        TrackPoint {
            s_m,
            l_m: (p.y - f.origin.y) * cos - (p.x - f.origin.x) * sin,
            h_m: p.z - f.origin.z,
        }
    }

    fn element_at(&self, s_m: f64) -> &Placed {
        let k = self.plan.partition_point(|p| p.s0 <= s_m);
        &self.plan[k.saturating_sub(1)]
    }

    /// Height and slope at a chainage: tangents, less the parabola where one grade leads over
    /// into the next.
    fn profile(&self, s_m: f64) -> (f64, f64) {
        let mut z = self.start_z;
        let mut slope = self.grades.first().map_or(0.0, |g| g.slope);
        z += slope * s_m;
        for pair in self.grades.windows(2) {
            let (before, g) = (pair[0].slope, pair[1]);
            let change = g.slope - before;
            let half = 0.5 * g.radius_m * change.abs();
            let d = s_m - g.from_m;
            if d >= half {
                z += change * d;
                slope += change;
            } else if d > -half {
                let into = d + half;
                z += change * into * into / (4.0 * half);
                slope += change * into / (2.0 * half);
            }
        }
        (z, slope)
    }
}
