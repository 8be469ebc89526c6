//! Convex bodies with flat faces, from any cloud of points.

use nalgebra::{Point3, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::shape::{ConvexPolyhedron, Shape};

/// The convex hull of some points; its origin is the centre of mass at even density.
#[derive(Clone, Debug, PartialEq)]
pub struct Hull {
    corners: Vec<Point3<f64>>,
    faces: Vec<Face>,
    volume_m3: f64,
}

/// A flat face.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// Unit normal, outwards.
    pub normal: Vector3<f64>,
    /// Distance of its plane from the origin.
    pub offset_m: f64,
    /// Its corners among the hull's, counter-clockwise seen from outside.
    pub corners: Vec<usize>,
}

impl Hull {
    /// The hull around points; `None` where they span no volume or are no numbers.
    pub fn around(points: &[Point3<f64>]) -> Option<Self> {
        if !points
            .iter()
            .all(|p| p.coords.iter().all(|x| x.is_finite()))
        {
            return None;
        }
        let points: Vec<Vector> = points.iter().map(|p| Vector::new(p.x, p.y, p.z)).collect();
        let solid = ConvexPolyhedron::from_convex_hull(&points)?;
        let mass = solid.mass_properties(1.0);
        let volume_m3 = mass.mass();
        let usable = volume_m3.is_finite() && volume_m3 > 0.0;
        if !usable {
            return None;
        }
        let centre = mass.local_com;
        let own = |p: &Vector| Point3::new(p.x - centre.x, p.y - centre.y, p.z - centre.z);
        let corners: Vec<Point3<f64>> = solid.points().iter().map(own).collect();
        let around = solid.vertices_adj_to_face();
        let faces = solid.faces().iter().map(|face| {
            let first = face.first_vertex_or_edge as usize;
            let ring = &around[first..first + face.num_vertices_or_edges as usize];
            let normal = Vector3::new(face.normal.x, face.normal.y, face.normal.z);
            let ring: Vec<usize> = ring.iter().map(|k| *k as usize).collect();
            // Where faces that are almost in one plane were made one, the outermost corner counts.
            let offset = ring.iter().map(|k| normal.dot(&corners[*k].coords));
            Face {
                normal,
                offset_m: offset.fold(f64::MIN, f64::max),
                corners: ring,
            }
        });
        Some(Self {
            faces: faces.collect(),
            corners,
            volume_m3,
        })
    }

    /// Corners.
    pub fn corners(&self) -> &[Point3<f64>] {
        &self.corners
    }

    /// Faces.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// Volume.
    pub fn volume_m3(&self) -> f64 {
        self.volume_m3
    }

    /// How far it extends from its origin in a direction (its support function, times the length
    /// of the direction).
    pub fn reach_m(&self, direction: &Vector3<f64>) -> f64 {
        let along = self.corners.iter().map(|c| direction.dot(&c.coords));
        along.fold(f64::MIN, f64::max)
    }

    /// Half extents along its axes, about its origin: of the farther of both sides.
    pub fn half_extents_m(&self) -> Vector3<f64> {
        self.corners
            .iter()
            .fold(Vector3::zeros(), |half, c| half.sup(&c.coords.abs()))
    }

    /// The same body, larger or smaller; `None` where `scale` is not positive.
    pub fn scaled(&self, scale: f64) -> Option<Self> {
        (scale.is_finite() && scale > 0.0).then(|| Self {
            corners: self.corners.iter().map(|c| c * scale).collect(),
            faces: (self.faces.iter())
                .map(|face| Face {
                    offset_m: face.offset_m * scale,
                    ..face.clone()
                })
                .collect(),
            volume_m3: self.volume_m3 * scale.powi(3),
        })
    }

    /// Where the ray o + t d enters, t >= 0, and the normal there: a convex body is where the half
    /// spaces of all its faces overlap, so the ray is clipped by one plane after the other.
    pub fn cast(&self, o: &Vector3<f64>, d: &Vector3<f64>) -> Option<(f64, Vector3<f64>)> {
        let (mut enter, mut leave, mut normal) = (f64::NEG_INFINITY, f64::INFINITY, None);
        for face in &self.faces {
            let toward = face.normal.dot(d);
            let inside_m = face.offset_m - face.normal.dot(o);
            if toward.abs() < 1e-300 {
                if inside_m < 0.0 {
                    return None;
                }
                continue;
            }
            let t = inside_m / toward;
            if toward > 0.0 {
                leave = leave.min(t);
            } else if t > enter {
                enter = t;
                normal = Some(face.normal);
            }
        }
        normal
            .filter(|_| enter >= 0.0 && enter <= leave)
            .map(|normal| (enter, normal))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]
    use super::*;

    /// Fails where the centre is not that of mass, an inner point becomes a corner, or a face of
    /// coplanar triangles stays cut: a pyramid has its centre at a quarter of its height.
    #[test]
    fn a_pyramid_stands_on_its_centre_of_mass() {
        let base = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];
        let mut points: Vec<Point3<f64>> =
            base.iter().map(|(x, y)| Point3::new(*x, *y, 3.0)).collect();
        points.extend([Point3::new(0.0, 0.0, 5.0), Point3::new(0.0, 0.0, 3.5)]);
        let hull = Hull::around(&points).unwrap();
        assert_eq!((hull.corners().len(), hull.faces().len()), (5, 5));
        assert!((hull.volume_m3() - 8.0 / 3.0).abs() < 1e-9);
        assert!((hull.reach_m(&Vector3::z()) - 1.5).abs() < 1e-9);
        assert!((hull.reach_m(&-Vector3::z()) - 0.5).abs() < 1e-9);
        for face in hull.faces() {
            let [a, b, c] = [0, 1, 2].map(|k| hull.corners()[face.corners[k]]);
            let turn = (b - a).cross(&(c - a));
            assert!(turn.dot(&face.normal) > 0.0, "clockwise, or normal inwards");
        }
        let twice = hull.scaled(2.0).unwrap();
        assert!((twice.volume_m3() - 64.0 / 3.0).abs() < 1e-9);
    }

    /// Fails where flat clouds, too few points or numbers that are none become bodies, or panic.
    #[test]
    fn what_has_no_volume_has_no_hull() {
        let flat: Vec<_> = (0..9)
            .map(|k| Point3::new(f64::from(k % 3), f64::from(k / 3), 0.0))
            .collect();
        assert_eq!(Hull::around(&flat), None);
        assert_eq!(Hull::around(&flat[..3]), None);
        assert_eq!(Hull::around(&[]), None);
        let mut broken = flat;
        broken.push(Point3::new(0.0, 0.0, f64::NAN));
        assert_eq!(Hull::around(&broken), None);
    }
}
