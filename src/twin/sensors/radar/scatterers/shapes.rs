//! The surface of a shape as flat pieces.

use super::facet::Facet;
use crate::twin::geometry::{Hull, Shape};
use nalgebra::{Point3, Vector3};
use std::f64::consts::{PI, TAU};

/// Faces of boxes are cut into pieces no longer than this, or a half or a quarter of it.
const PIECE_M: f64 = 1.5;
const HALVINGS: u32 = 2;
/// Flat pieces around something round.
const AROUND: u32 = 12;

/// How long pieces may be for a radar so far away: what a lobe of their slopes lights, as near as there are sizes.
pub fn piece_m(slope_rad: f64, away_m: f64) -> f64 {
    let lit_m = 2.0 * slope_rad * away_m;
    let halved = (0..HALVINGS).take_while(|k| PIECE_M / f64::from(1 << k) > lit_m);
    PIECE_M / f64::from(1 << halved.count())
}

/// The pieces of a shape, in its own axes; those of boxes no longer than a size.
pub fn facets(shape: &Shape, piece_m: f64) -> Vec<Facet> {
    match shape {
        Shape::Box(half) => box_facets(half, piece_m),
        Shape::Sphere(radius) => ball_facets(*radius, 0.0),
        Shape::Cylinder(radius, half) => {
            let mut facets = tube_facets(*radius, *half);
            facets.extend([1.0, -1.0].map(|way| Facet {
                place: Point3::new(0.0, 0.0, way * half),
                normal: Vector3::z() * way,
                area_m2: PI * radius * radius,
                round_rad: 0.0,
            }));
            facets
        }
        Shape::Capsule(radius, half) => {
            let mut facets = tube_facets(*radius, *half);
            facets.extend(ball_facets(*radius, *half));
            facets
        }
        Shape::Hull(hull) => hull_facets(hull),
    }
}

fn box_facets(half: &Vector3<f64>, piece_m: f64) -> Vec<Facet> {
    let mut facets = Vec::new();
    for axis in 0..3 {
        let (across, up) = ((axis + 1) % 3, (axis + 2) % 3);
        let pieces = [across, up].map(|side| (2.0 * half[side] / piece_m).ceil().clamp(1.0, 64.0));
        let size = [2.0 * half[across] / pieces[0], 2.0 * half[up] / pieces[1]];
        for way in [1.0, -1.0] {
            for i in 0..pieces[0] as u32 {
                for j in 0..pieces[1] as u32 {
                    let mut place = Vector3::zeros();
                    place[axis] = way * half[axis];
                    place[across] = (f64::from(i) + 0.5) * size[0] - half[across];
                    place[up] = (f64::from(j) + 0.5) * size[1] - half[up];
                    facets.push(Facet {
                        place: place.into(),
                        normal: Vector3::from_fn(|k, _| if k == axis { way } else { 0.0 }),
                        area_m2: size[0] * size[1],
                        round_rad: 0.0,
                    });
                }
            }
        }
    }
    facets
}

/// The round side of a tube about z: its pieces are as rough as they turn.
fn tube_facets(radius: f64, half: f64) -> Vec<Facet> {
    let piece = |k: u32| {
        let (sin, cos) = (TAU * f64::from(k) / f64::from(AROUND)).sin_cos();
        let normal = Vector3::new(cos, sin, 0.0);
        Facet {
            place: Point3::from(normal * radius),
            normal,
            area_m2: TAU * radius * 2.0 * half / f64::from(AROUND),
            round_rad: 0.5 * TAU / f64::from(AROUND),
        }
    };
    (0..AROUND).map(piece).collect()
}

/// A ball, its halves apart by twice a height: the faces of a cube and its corners cut off, of equal areas.
fn ball_facets(radius: f64, half: f64) -> Vec<Facet> {
    let mut normals = Vec::new();
    for x in [-1.0, 0.0, 1.0] {
        for y in [-1.0, 0.0, 1.0] {
            for z in [-1.0f64, 0.0, 1.0] {
                normals.push(Vector3::new(x, y, z));
            }
        }
    }
    normals.retain(|n| n.norm() > 0.5);
    let area_m2 = 4.0 * PI * radius * radius / normals.len() as f64;
    let piece = |n: Vector3<f64>| {
        let normal = n.normalize();
        let middle = Vector3::new(0.0, 0.0, half * n.z.signum() * n.z.abs());
        Facet {
            place: Point3::from(middle + normal * radius),
            normal,
            area_m2,
            round_rad: 0.4,
        }
    };
    normals.into_iter().map(piece).collect()
}

fn hull_facets(hull: &Hull) -> Vec<Facet> {
    let corners = hull.corners();
    let of_face = |ring: &[usize], normal: Vector3<f64>| {
        let (first, rest) = ring.split_first()?;
        let first = corners.get(*first)?.coords;
        let (mut area_m2, mut moment) = (0.0, Vector3::zeros());
        for pair in rest.windows(2) {
            let (a, b) = (corners.get(pair[0])?.coords, corners.get(pair[1])?.coords);
            let piece = 0.5 * (a - first).cross(&(b - first)).norm();
            area_m2 += piece;
            moment += (first + a + b) * (piece / 3.0);
        }
        (area_m2 > 0.0).then(|| Facet {
            place: Point3::from(moment / area_m2),
            normal,
            area_m2,
            round_rad: 0.0,
        })
    };
    let faces = hull.faces().iter();
    faces
        .filter_map(|face| of_face(&face.corners, face.normal))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::facet::EchoSurface;
    use super::*;
    use std::sync::Arc;

    fn area(shape: &Shape) -> f64 {
        facets(shape, PIECE_M).iter().map(|f| f.area_m2).sum()
    }

    /// Surfaces by hand.
    #[test]
    fn pieces_make_the_whole_surface() {
        let is = |value: f64, expected: f64| (value / expected - 1.0).abs() < 1e-9;
        let half = Vector3::new(1.0, 0.5, 2.0);
        assert!(is(area(&Shape::Box(half)), 8.0 * (0.5 + 2.0 + 1.0)));
        assert!(is(area(&Shape::Sphere(0.5)), PI));
        assert!(is(area(&Shape::Cylinder(0.5, 1.0)), TAU + 0.5 * PI));
        assert!(is(area(&Shape::Capsule(0.5, 1.0)), TAU + PI));
        let corners: Vec<Point3<f64>> = (0..8)
            .map(|k| Point3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)))
            .collect();
        let cube = Hull::around(&corners).map(|hull| area(&Shape::Hull(Arc::new(hull))));
        assert!(cube.is_some_and(|area| is(area, 6.0)), "{cube:?}");
    }

    /// Near ones are cut finer, and the whole stays as large.
    #[test]
    fn pieces_are_as_long_as_lobes_light() {
        let sizes = [100.0, 8.0, 1.0].map(|away_m| piece_m(0.05, away_m));
        let expected = [1.5, 0.75, 0.375];
        assert!(
            sizes
                .iter()
                .zip(expected)
                .all(|(size, e)| (size - e).abs() < 1e-12),
            "{sizes:?}"
        );
        let wall = Shape::Box(Vector3::new(0.1, 1.4, 1.7));
        let [whole, fine] = [1.5, 0.375].map(|size| facets(&wall, size));
        let sum = |facets: &[Facet]| facets.iter().map(|f| f.area_m2).sum::<f64>();
        assert!(fine.len() > 8 * whole.len() && (sum(&fine) / sum(&whole) - 1.0).abs() < 1e-9);
    }

    /// A metal ball echoes pi r^2 from all sides, within the graininess of its pieces.
    #[test]
    fn val_a_ball_echoes_its_shadow() {
        let surface = EchoSurface {
            reflectivity: 1.0,
            slope_rad: 0.05,
            diffuse: 0.3,
        };
        let ball = facets(&Shape::Sphere(0.4), PIECE_M);
        let n = 500;
        let golden = PI * (3.0 - 5f64.sqrt());
        let sections: Vec<f64> = (0..n)
            .map(|k| {
                let z = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(n);
                let (sin, cos) = (golden * f64::from(k)).sin_cos();
                let level = (1.0 - z * z).sqrt();
                let towards = Vector3::new(level * cos, level * sin, z);
                ball.iter()
                    .map(|f| f.section_m2(&towards, &surface, 4e-3))
                    .sum()
            })
            .collect();
        let shadow = PI * 0.16;
        let mean = sections.iter().sum::<f64>() / f64::from(n);
        assert!((mean / shadow - 1.0).abs() < 0.1, "{mean} for {shadow}");
        assert!(sections.iter().all(|s| (0.6..1.6).contains(&(s / shadow))));
    }
}
