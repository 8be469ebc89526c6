//! Triangles, and the triangles of the bodies' shapes.

use super::bend;
use super::layout::Vertex;
use crate::twin::geometry::{Body, Hull, Shape};
use crate::twin::render::daylight::Surroundings;
use crate::twin::render::lamp_field::LampField;
use crate::twin::render::scene::View;
use nalgebra::{Point3, Vector3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Faces and straight sides are cut to this size, so that light varies little over one cell.
const CELL_M: f64 = 0.5;
const MAX_CELLS: f64 = 48.0;
/// Corners around a round shape are so many that its outline errs by less than this in the
/// picture, but no more than these.
const OUTLINE_PX: f64 = 0.04;
const MAX_SECTORS: usize = 32;

/// How finely a body is cut.
#[derive(Clone, Copy, Debug)]
pub struct Fineness {
    /// A metre of its near side takes so many pixels at most.
    pub px_per_m: f64,
    /// Largest cell.
    pub cell_m: f64,
}

impl Fineness {
    /// For the views of a job.
    pub fn of(body: &Body, views: &[View]) -> Self {
        let coarse = Self {
            px_per_m: 0.0,
            cell_m: CELL_M,
        };
        views.iter().fold(coarse, |all, view| {
            let lens = &view.camera.intrinsics;
            let eye = view.motion.pose_at(view.start).translation.vector;
            let away_m = (body.world_from_body.translation.vector - eye).norm();
            let near_m = (away_m - body.shape.half_extents_m().norm()).max(0.1);
            Self {
                px_per_m: all.px_per_m.max(lens.fx_px / near_m),
                cell_m: bend::cell_share(lens).map_or(all.cell_m, |q| all.cell_m.min(q * near_m)),
            }
        })
    }

    /// Cells along a length.
    fn cells(&self, length_m: f64) -> usize {
        (length_m / self.cell_m).ceil().clamp(1.0, MAX_CELLS) as usize
    }
}

/// Vertices, and triangles as triples of them.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Corners.
    pub vertices: Vec<Vertex>,
    /// Three a triangle.
    pub indices: Vec<u32>,
}

impl Mesh {
    /// Two triangles for each cell of a grid of `rows` by `columns` vertices that starts at vertex
    /// `first`. Both begin with the cell's lowest vertex, whose flat attributes hold for the cell.
    pub fn add_quads(&mut self, first: u32, rows: u32, columns: u32) {
        for r in 1..rows {
            for c in 1..columns {
                let d = first + r * columns + c;
                let (a, b) = (d - columns - 1, d - columns);
                self.indices.extend([a, b, d, a, d, d - 1]);
            }
        }
    }

    /// Triangles between two lines of vertices, one after the other from vertex `first` on, at
    /// ascending `places` along them that need not be the same. Each begins with its lowest
    /// vertex, whose flat attributes hold for it.
    pub fn add_ribbon(&mut self, first: u32, places: [&[f64]; 2]) {
        let [left, right] = places;
        let (mut i, mut j) = (0, 0);
        while i + 1 < left.len() || j + 1 < right.len() {
            let (a, b) = (first + i as u32, first + (left.len() + j) as u32);
            let right_next = match (left.get(i + 1), right.get(j + 1)) {
                (Some(l), Some(r)) => r <= l,
                (_, r) => r.is_some(),
            };
            let next = if right_next { b + 1 } else { a + 1 };
            self.indices.extend(if right[j] < left[i] {
                [b, next, a]
            } else {
                [a, b, next]
            });
            if right_next {
                j += 1;
            } else {
                i += 1;
            }
        }
    }

    /// Distance of the farthest vertex from the origin.
    pub fn radius_m(&self) -> f64 {
        self.vertices
            .iter()
            .map(|v| Vector3::from(v.position_m).norm())
            .fold(0.0, f32::max)
            .into()
    }

    /// Appends a body, lit where it stands.
    pub fn add_body(
        &mut self,
        body: &Body,
        lamps: &LampField,
        surroundings: Surroundings<'_>,
        fineness: Fineness,
    ) {
        let from = self.vertices.len() as u32;
        let mut corner = |p: Vector3<f64>, n: Vector3<f64>| {
            let at = body.world_from_body * Point3::from(p);
            let normal = body.world_from_body * n;
            let out = body.world_from_body.rotation * p;
            let light_lx =
                lamps.irradiance_lx(&at, &normal) + surroundings.on_surface_lx(&at, &normal);
            self.vertices.push(Vertex {
                position_m: out.map(|x| x as f32).into(),
                light_lx: [light_lx as f32, 0.0],
                normal: normal.map(|x| x as f32).into(),
                paint: body.albedo as f32,
                albedo: body.albedo as f32,
                luminance_cd_m2: body.luminance_cd_m2 as f32,
                ..Vertex::default()
            });
        };
        let round = |r: f64| sectors(r * fineness.px_per_m);
        let capsule = |r: f64, h: f64| capsule_profile(r, h, round(r), fineness);
        let grids = match &body.shape {
            Shape::Box(half) => box_grids(half, fineness, &mut corner),
            Shape::Cylinder(r, h) => {
                turned(&cylinder_profile(*r, *h, fineness), round(*r), &mut corner)
            }
            Shape::Sphere(r) => turned(&capsule(*r, 0.0), round(*r), &mut corner),
            Shape::Capsule(r, h) => turned(&capsule(*r, *h), round(*r), &mut corner),
            Shape::Hull(hull) => {
                let corners = hull_triangles(hull, fineness, &mut corner);
                self.indices.extend(corners.iter().map(|k| from + k));
                return;
            }
        };
        let total: usize = grids.iter().map(|(rows, columns)| rows * columns).sum();
        let mut first = self.vertices.len() - total;
        for (rows, columns) in grids {
            self.add_quads(first as u32, rows as u32, columns as u32);
            first += rows * columns;
        }
    }
}

/// Corners around a circle of a radius in pixels: with n of them the outline is off by
/// r (1 - cos(pi / n)), about r pi^2 / (2 n^2).
fn sectors(radius_px: f64) -> usize {
    let n = PI * (0.5 * radius_px / OUTLINE_PX).sqrt();
    // A multiple of four: a quarter of them is from a pole to the equator.
    (n.ceil() as usize)
        .clamp(8, MAX_SECTORS)
        .next_multiple_of(4)
}

/// Rows and columns of a grid of vertices.
type Grid = (usize, usize);

fn box_grids(
    half: &Vector3<f64>,
    fineness: Fineness,
    corner: &mut impl FnMut(Vector3<f64>, Vector3<f64>),
) -> Vec<Grid> {
    let mut grids = Vec::with_capacity(6);
    for axis in 0..3 {
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        let (rows, columns) = (fineness.cells(2.0 * half[i]), fineness.cells(2.0 * half[j]));
        for side in [-1.0, 1.0] {
            let mut normal = Vector3::zeros();
            normal[axis] = side;
            for r in 0..=rows {
                for c in 0..=columns {
                    let mut p = normal * half[axis];
                    p[i] = half[i] * (2.0 * r as f64 / rows as f64 - 1.0);
                    p[j] = half[j] * (2.0 * c as f64 / columns as f64 - 1.0);
                    corner(p, normal);
                }
            }
            grids.push((rows + 1, columns + 1));
        }
    }
    grids
}

/// Faces as fans of triangles, cut into equal smaller ones; yields their corners.
fn hull_triangles(
    hull: &Hull,
    fineness: Fineness,
    corner: &mut impl FnMut(Vector3<f64>, Vector3<f64>),
) -> Vec<u32> {
    let mut indices = Vec::new();
    let mut first = 0;
    for face in hull.faces() {
        let ring: Vec<_> = face
            .corners
            .iter()
            .map(|k| hull.corners()[*k].coords)
            .collect();
        for k in 2..ring.len() {
            let [a, b, c] = [ring[0], ring[k - 1], ring[k]];
            let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
            let n = fineness.cells(longest) as u32;
            // Row r from the corner a on has r + 1 vertices.
            let row = |r: u32| first + r * (r + 1) / 2;
            for r in 0..=n {
                for j in 0..=r {
                    let (u, v) = (f64::from(r - j) / f64::from(n), f64::from(j) / f64::from(n));
                    corner(a + (b - a) * u + (c - a) * v, face.normal);
                }
                for j in 0..r {
                    indices.extend([row(r - 1) + j, row(r) + j, row(r) + j + 1]);
                    if j > 0 {
                        indices.extend([row(r - 1) + j - 1, row(r) + j, row(r - 1) + j]);
                    }
                }
            }
            first = row(n + 1);
        }
    }
    indices
}

/// A point of the outline of a body of revolution: radius, height, and its normal in that plane.
struct ProfilePoint {
    radius_m: f64,
    z_m: f64,
    normal: [f64; 2],
}

/// Bottom to top: one line for every smooth piece.
fn cylinder_profile(radius_m: f64, half_m: f64, fineness: Fineness) -> Vec<Vec<ProfilePoint>> {
    let point = |radius_m, z_m, normal| ProfilePoint {
        radius_m,
        z_m,
        normal,
    };
    let steps = fineness.cells(2.0 * half_m);
    let cap = |side: f64| {
        [0.0, radius_m]
            .map(|r| point(r, side * half_m, [0.0, side]))
            .into()
    };
    let side = (0..=steps)
        .map(|k| half_m * (2.0 * k as f64 / steps as f64 - 1.0))
        .map(|z| point(radius_m, z, [1.0, 0.0]))
        .collect();
    vec![cap(-1.0), side, cap(1.0)]
}

fn capsule_profile(
    radius_m: f64,
    half_m: f64,
    sectors: usize,
    fineness: Fineness,
) -> Vec<Vec<ProfilePoint>> {
    let rings = sectors / 4;
    let dome = |side: f64| {
        (0..=rings).map(move |k| {
            let k = if side < 0.0 { k } else { rings - k };
            let (up, out) = (FRAC_PI_2 * (1.0 - k as f64 / rings as f64)).sin_cos();
            ProfilePoint {
                radius_m: radius_m * out,
                z_m: side * (half_m + radius_m * up),
                normal: [out, side * up],
            }
        })
    };
    let steps = fineness.cells(2.0 * half_m);
    let side = (1..steps).map(|k| ProfilePoint {
        radius_m,
        z_m: half_m * (2.0 * k as f64 / steps as f64 - 1.0),
        normal: [1.0, 0.0],
    });
    vec![dome(-1.0).chain(side).chain(dome(1.0)).collect()]
}

/// Turns outlines about z.
fn turned(
    pieces: &[Vec<ProfilePoint>],
    sectors: usize,
    corner: &mut impl FnMut(Vector3<f64>, Vector3<f64>),
) -> Vec<Grid> {
    for point in pieces.iter().flatten() {
        for k in 0..=sectors {
            let (sin, cos) = (TAU * (k % sectors) as f64 / sectors as f64).sin_cos();
            let around = |r: f64, z: f64| Vector3::new(r * cos, r * sin, z);
            corner(
                around(point.radius_m, point.z_m),
                around(point.normal[0], point.normal[1]),
            );
        }
    }
    pieces.iter().map(|p| (p.len(), sectors + 1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::air::Air;
    use nalgebra::Isometry3;
    use std::sync::Arc;

    fn mesh(shape: Shape) -> Mesh {
        let body = Body {
            shape,
            world_from_body: Isometry3::translation(5.0, 6.0, 7.0),
            velocity_mps: Vector3::zeros(),
            albedo: 0.5,
            luminance_cd_m2: 0.0,
        };
        let mut mesh = Mesh::default();
        let fineness = Fineness {
            px_per_m: 1e4,
            cell_m: CELL_M,
        };
        let lamps = LampField::new(&[], Air::default());
        let surroundings = Surroundings::Tunnel {
            ambient_lx: 1.0,
            daylight: None,
        };
        mesh.add_body(&body, &lamps, surroundings, fineness);
        mesh
    }

    /// Volume by the divergence theorem over triangles turned outwards by their normals.
    fn volume(mesh: &Mesh) -> f64 {
        mesh.indices
            .chunks(3)
            .map(|t| {
                let corner =
                    |k: u32| Vector3::from(mesh.vertices[k as usize].position_m).cast::<f64>();
                let (a, b, c) = (corner(t[0]), corner(t[1]), corner(t[2]));
                let area = (b - a).cross(&(c - a)) * 0.5;
                let normal: Vector3<f64> = t
                    .iter()
                    .map(|k| Vector3::from(mesh.vertices[*k as usize].normal).cast::<f64>())
                    .sum();
                area.dot(&normal).signum() * area.dot(&(a + b + c)) / 9.0
            })
            .sum()
    }

    /// Provokes holes, wrong sizes and normals that point inwards.
    #[test]
    fn volumes_are_those_of_the_shapes() {
        let pi = PI;
        let cases = [
            (Shape::Box(Vector3::new(0.5, 1.0, 2.0)), 8.0, 1e-6),
            (Shape::Cylinder(0.5, 1.5), pi * 0.25 * 3.0, 0.01),
            (Shape::Sphere(2.0), pi * 32.0 / 3.0, 0.02),
            (
                Shape::Capsule(0.5, 1.0),
                pi * (0.25 * 2.0 + 0.5 / 3.0),
                0.02,
            ),
        ];
        let corners = [[3.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];
        let tetrahedron = Hull::around(&corners.map(Point3::from)).map(Arc::new);
        let hull = tetrahedron.map(|hull| (Shape::Hull(hull), 1.0, 1e-6));
        assert!(hull.is_some());
        for (shape, exact, tolerance) in cases.into_iter().chain(hull) {
            let v = volume(&mesh(shape.clone()));
            assert!(
                (v / exact - 1.0).abs() < tolerance,
                "{shape:?}: {v} {exact}"
            );
        }
    }
}
