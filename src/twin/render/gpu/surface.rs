//! Pieces of surfaces: what is known of them before anything is drawn.

use super::region::Region;
use crate::track::{CrossSection, RAIL_OFFSET_M, Track, TrackFrame};
use crate::twin::geometry::{Body, surface_of};
use nalgebra::{Point3, Vector3};

/// Cells of a tunnel's surface are no longer and wider than this.
const CELL_M: f64 = 1.0;

/// A parallelogram of a surface.
#[derive(Clone, Debug)]
pub struct SurfaceCell {
    pub centre: Point3<f64>,
    /// Half of its sides.
    half: [Vector3<f64>; 2],
    /// None where it stands for something that faces several ways.
    pub normal: Option<Vector3<f64>>,
    /// It is there in the middle of the exposure, and goes this way.
    pub velocity_mps: Vector3<f64>,
    travel_m: f64,
}

/// A piece of a tunnel's surface.
#[derive(Clone, Debug)]
pub struct Patch {
    pub cell: SurfaceCell,
    /// More luminance than any of it has by the lamps.
    pub peak_cd_m2: f32,
    /// The most luminance that a lux makes there, cd/m^2.
    pub reflected_per_lx: f32,
    /// Whether it mirrors.
    pub glossy: bool,
}

impl SurfaceCell {
    /// That does not move.
    pub fn still(
        centre: Point3<f64>,
        half: [Vector3<f64>; 2],
        normal: Option<Vector3<f64>>,
    ) -> Self {
        Self {
            centre,
            half,
            normal,
            velocity_mps: Vector3::zeros(),
            travel_m: 0.0,
        }
    }

    /// What it is in, wherever it goes in the exposure.
    pub fn region(&self) -> Region {
        Region {
            centre: self.centre,
            radius_m: self.half_diagonal_m() + self.travel_m,
            normal: self.normal,
        }
    }

    /// Half of its longer diagonal.
    pub fn half_diagonal_m(&self) -> f64 {
        let [a, b] = self.half;
        (a + b).norm().max((a - b).norm())
    }

    /// Whether it is seen from its back, from wherever the camera is about a place.
    pub fn turns_away(&self, (eye, travel_m): (Point3<f64>, f64)) -> bool {
        let to = eye - self.centre;
        self.normal
            .is_some_and(|n| n.dot(&to) < -self.travel_m - travel_m)
    }

    /// The same surface in four parts.
    pub fn quarters(&self) -> [Self; 4] {
        [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)].map(|(x, y)| Self {
            centre: self.point(x, y),
            half: self.half.map(|side| 0.5 * side),
            ..*self
        })
    }

    /// All of a stretch of the tunnel, rails too.
    pub fn of((number, track): (usize, &Track), from_m: f64, length_m: f64) -> Vec<Self> {
        let mut cells = Vec::new();
        let steps = (length_m / CELL_M).ceil().max(1.0);
        let half_m = 0.5 * length_m / steps;
        for k in 0..steps as u32 {
            let s_m = from_m + (2.0 * f64::from(k) + 1.0) * half_m;
            let Some(section) = track.section_at(s_m) else {
                continue;
            };
            let frame = track.alignment.at(s_m);
            Self::of_walls(&surface_of(section, number), &frame, half_m, &mut cells);
            for l_m in [-RAIL_OFFSET_M, RAIL_OFFSET_M] {
                let [foot, head] = [-0.2, 0.1].map(|h_m| frame.world_from_section(l_m, h_m));
                let half = [frame.ahead() * half_m, 0.5 * (head - foot)];
                cells.push(Self::still(nalgebra::center(&foot, &head), half, None));
            }
        }
        cells
    }

    fn of_walls(section: &CrossSection, frame: &TrackFrame, half_m: f64, cells: &mut Vec<Self>) {
        for edge in section.edges() {
            let [a, b] = [edge.a, edge.b].map(|p| frame.world_from_section(p.l_m, p.h_m));
            let count = (edge.length_m() / CELL_M).ceil().clamp(1.0, 64.0);
            let (l, h) = edge.normal();
            let half = 0.5 / count * (b - a);
            let normal = frame.left() * l + Vector3::z() * h;
            cells.extend((0..count as u32).map(|k| {
                let centre = a + half * (2.0 * f64::from(k) + 1.0);
                Self::still(centre, [frame.ahead() * half_m, half], Some(normal))
            }));
        }
    }

    /// The six sides of a box.
    pub fn of_box(body: &Body, half: &Vector3<f64>, [mid_s, half_s]: [f64; 2]) -> Vec<Self> {
        let mut cells = Vec::new();
        let rotation = body.world_from_body.rotation;
        let centre =
            Point3::from(body.world_from_body.translation.vector + body.velocity_mps * mid_s);
        for axis in 0..3 {
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3].map(|k| {
                let count = (2.0 * half[k] / CELL_M).ceil().clamp(1.0, 64.0);
                let side = rotation * Vector3::ith(k, half[k] / count);
                (side, count as i32)
            });
            for sign in [-1.0, 1.0] {
                let normal = rotation * Vector3::ith(axis, sign);
                for (i, j) in (0..u.1).flat_map(|i| (0..v.1).map(move |j| (i, j))) {
                    let along = |k: i32, count: i32| f64::from(2 * k + 1 - count);
                    let aside = u.0 * along(i, u.1) + v.0 * along(j, v.1);
                    cells.push(Self {
                        centre: centre + normal * half[axis] + aside,
                        half: [u.0, v.0],
                        normal: Some(normal),
                        velocity_mps: body.velocity_mps,
                        travel_m: body.velocity_mps.norm() * half_s,
                    });
                }
            }
        }
        cells
    }

    /// Its corners.
    pub fn corners(&self) -> [Point3<f64>; 4] {
        [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(x, y)| self.point(x, y))
    }

    /// A place on it, from -1 to 1 each way.
    pub fn point(&self, x: f64, y: f64) -> Point3<f64> {
        self.centre + self.half[0] * x + self.half[1] * y
    }
}
