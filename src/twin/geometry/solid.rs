//! A ray against the solid shapes, in closed form.

use super::body::{Body, Shape};
use nalgebra::{Isometry3, Point3, Vector3};

/// A body where it is at one instant, ready for rays.
#[derive(Clone, Copy, Debug)]
pub struct Solid<'a> {
    body: &'a Body,
    world_from_body: Isometry3<f64>,
}

impl<'a> Solid<'a> {
    /// The body `after_s` seconds after its pose was true.
    pub fn at(body: &'a Body, after_s: f64) -> Self {
        let mut world_from_body = body.world_from_body;
        world_from_body.translation.vector += body.velocity_mps * after_s;
        Self {
            body,
            world_from_body,
        }
    }

    /// What it is.
    pub fn body(&self) -> &'a Body {
        self.body
    }

    /// Where the ray o + t d enters, for t >= 0, and the unit normal there. A ray that starts
    /// inside meets nothing.
    pub fn cast(&self, o: &Point3<f64>, d: &Vector3<f64>) -> Option<(f64, Vector3<f64>)> {
        let o = self.world_from_body.inverse_transform_point(o).coords;
        let d = self.world_from_body.inverse_transform_vector(d);
        let (t, n) = match self.body.shape {
            Shape::Hull(ref hull) => hull.cast(&o, &d),
            Shape::Box(half) => cast_box(&o, &d, &half),
            Shape::Sphere(radius) => cast_sphere(&o, &d, radius),
            Shape::Cylinder(radius, half) => first(
                cast_tube(&o, &d, radius, half),
                cast_caps(&o, &d, radius, half),
            ),
            Shape::Capsule(radius, half) => {
                let up = Vector3::new(0.0, 0.0, half);
                first(
                    cast_tube(&o, &d, radius, half),
                    first(
                        // Only the half of each sphere that sticks out.
                        cast_sphere(&(o - up), &d, radius).filter(|(_, n)| n.z >= 0.0),
                        cast_sphere(&(o + up), &d, radius).filter(|(_, n)| n.z <= 0.0),
                    ),
                )
            }
        }?;
        Some((t, self.world_from_body * n))
    }

    /// A place of the world in the body's own axes.
    pub fn in_body(&self, place: &Point3<f64>) -> Point3<f64> {
        self.world_from_body.inverse_transform_point(place)
    }

    /// Corners of a box around it, in the world.
    pub fn corners(&self) -> [Point3<f64>; 8] {
        let half = self.body.shape.half_extents_m();
        std::array::from_fn(|k| {
            let sign = |bit: usize| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
            let corner = half.component_mul(&Vector3::new(sign(0), sign(1), sign(2)));
            self.world_from_body * Point3::from(corner)
        })
    }
}

type Entry = Option<(f64, Vector3<f64>)>;

fn first(a: Entry, b: Entry) -> Entry {
    match (a, b) {
        (Some(a), Some(b)) => Some(if a.0 <= b.0 { a } else { b }),
        (a, b) => a.or(b),
    }
}

fn cast_box(o: &Vector3<f64>, d: &Vector3<f64>, half: &Vector3<f64>) -> Entry {
    let (mut enter, mut leave, mut face) = (f64::NEG_INFINITY, f64::INFINITY, Vector3::zeros());
    for axis in 0..3 {
        if d[axis].abs() < 1e-300 {
            if o[axis].abs() > half[axis] {
                return None;
            }
            continue;
        }
        let side = d[axis].signum();
        let near = (-side * half[axis] - o[axis]) / d[axis];
        leave = leave.min((side * half[axis] - o[axis]) / d[axis]);
        if near > enter {
            enter = near;
            face = Vector3::zeros();
            face[axis] = -side;
        }
    }
    (enter >= 0.0 && enter <= leave).then_some((enter, face))
}

/// Smaller root of a t^2 + 2 b t + c = 0.
fn enters(a: f64, b: f64, c: f64) -> Option<f64> {
    let discriminant = b * b - a * c;
    (a > 0.0 && discriminant >= 0.0)
        .then(|| (-b - discriminant.sqrt()) / a)
        .filter(|t| *t >= 0.0)
}

fn cast_sphere(o: &Vector3<f64>, d: &Vector3<f64>, radius: f64) -> Entry {
    let t = enters(
        d.norm_squared(),
        o.dot(d),
        o.norm_squared() - radius * radius,
    )?;
    Some((t, (o + d * t) / radius))
}

/// The side of a cylinder along z.
fn cast_tube(o: &Vector3<f64>, d: &Vector3<f64>, radius: f64, half: f64) -> Entry {
    let (o2, d2) = (o.xy(), d.xy());
    let t = enters(
        d2.norm_squared(),
        o2.dot(&d2),
        o2.norm_squared() - radius * radius,
    )?;
    let p = o + d * t;
    (p.z.abs() <= half).then(|| (t, Vector3::new(p.x / radius, p.y / radius, 0.0)))
}

/// The flat ends of a cylinder along z.
fn cast_caps(o: &Vector3<f64>, d: &Vector3<f64>, radius: f64, half: f64) -> Entry {
    let side = -d.z.signum();
    let t = (side * half - o.z) / d.z;
    let p = o + d * t;
    (t >= 0.0 && p.xy().norm_squared() <= radius * radius).then(|| (t, Vector3::z() * side))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]
    use super::super::hull::Hull;
    use super::*;
    use crate::twin::random::Stream;
    use nalgebra::{Translation3, UnitQuaternion};
    use parry3d_f64::math::Vector as DVec3;
    use parry3d_f64::query::{Ray, RayCast};
    use parry3d_f64::shape::{Ball, Capsule, ConvexPolyhedron, Cuboid, Cylinder};
    use std::sync::Arc;

    fn parry(shape: &Shape) -> Box<dyn RayCast> {
        // parry's cylinder stands along y: rays for it are turned below.
        match *shape {
            Shape::Box(h) => Box::new(Cuboid::new(DVec3::new(h.x, h.z, h.y))),
            Shape::Cylinder(r, h) => Box::new(Cylinder::new(h, r)),
            Shape::Sphere(r) => Box::new(Ball::new(r)),
            Shape::Capsule(r, h) => Box::new(Capsule::new_y(h, r)),
            Shape::Hull(ref hull) => {
                let corners = hull.corners().iter();
                let corners: Vec<_> = corners.map(|p| DVec3::new(p.x, p.z, p.y)).collect();
                Box::new(ConvexPolyhedron::from_convex_hull(&corners).unwrap())
            }
        }
    }

    /// Fails where a root, an end cap or a sign is wrong: another library's casts of random rays.
    #[test]
    fn shapes_meet_rays_where_parry_says() {
        let shapes = [
            Shape::Box(Vector3::new(0.3, 0.7, 1.1)),
            Shape::Cylinder(0.4, 0.9),
            Shape::Sphere(0.8),
            Shape::Capsule(0.35, 0.6),
            Shape::Hull(Arc::new(wedge())),
        ];
        let random = Stream::new(7, 0, "rays");
        for (index, shape) in shapes.into_iter().enumerate() {
            let other = parry(&shape);
            let body = Body {
                shape,
                world_from_body: Isometry3::from_parts(
                    Translation3::new(1.0, -2.0, 3.0),
                    UnitQuaternion::from_euler_angles(0.3, -0.8, 1.9),
                ),
                velocity_mps: Vector3::new(2.0, 0.0, -4.0),
                albedo: 0.5,
                luminance_cd_m2: 0.0,
            };
            let solid = Solid::at(&body, 0.5);
            let moved = Translation3::new(1.0, 0.0, -2.0) * body.world_from_body;
            let mut hits = 0;
            for k in 0..4000u64 {
                let number = |j: u64| 2.0 * random.uniform(8 * k + j) - 1.0;
                let o = Point3::new(3.0 * number(0), 3.0 * number(1), 3.0 * number(2));
                let target = Point3::new(number(3), number(4), number(5));
                let d = target - o;
                let inside = (o.coords).norm() < 1.6;
                if inside {
                    continue;
                }
                let theirs = other.cast_local_ray_and_get_normal(
                    &Ray::new(DVec3::new(o.x, o.z, o.y), DVec3::new(d.x, d.z, d.y)),
                    100.0,
                    true,
                );
                let ours = solid.cast(&(moved * o), &(moved * d));
                match (ours, theirs) {
                    (Some((t, n)), Some(hit)) => {
                        hits += 1;
                        assert!(
                            (t - hit.time_of_impact).abs() < 1e-5,
                            "shape {index} ray {k}"
                        );
                        let n = moved.inverse_transform_vector(&n);
                        let at = o + d * t;
                        // On an edge either face may be named.
                        let flat = matches!(
                            body.shape,
                            Shape::Box(_) | Shape::Cylinder(..) | Shape::Hull(_)
                        );
                        let cos = n.dot(&Vector3::new(hit.normal.x, hit.normal.z, hit.normal.y));
                        assert!(flat || cos > 1.0 - 1e-4, "shape {index} at {at}: {cos}");
                        assert!(n.dot(&d) <= 0.0 && (n.norm() - 1.0).abs() < 1e-9);
                    }
                    (None, None) => {}
                    // Grazing rays may go either way in an iterative cast.
                    (ours, theirs) => {
                        let t = ours.map_or_else(|| theirs.unwrap().time_of_impact, |(t, _)| t);
                        assert!(
                            grazes(&body.shape, &(o + d * t), &d),
                            "shape {index} ray {k}"
                        );
                    }
                }
            }
            assert!(hits > 800, "{hits}");
        }
    }

    /// A lopsided hull of seven corners.
    fn wedge() -> Hull {
        let corners = [
            [1.0, 0.8, -0.6],
            [1.1, -0.7, -0.6],
            [-0.9, -0.9, -0.5],
            [-1.0, 0.7, -0.6],
            [0.4, 0.2, 0.9],
            [-0.5, 0.3, 0.7],
            [0.1, -0.8, 0.5],
        ];
        Hull::around(&corners.map(Point3::from)).unwrap()
    }

    /// Whether the ray is within 1e-3 of the shape's silhouette at this point: it leaves the
    /// shape again within that depth.
    fn grazes(shape: &Shape, p: &Point3<f64>, d: &Vector3<f64>) -> bool {
        let inward = p + d.normalize() * 2e-3;
        let r = inward.xy_norm();
        match *shape {
            Shape::Box(h) => (0..3).any(|k| (inward[k].abs() - h[k]).abs() < 4e-3),
            Shape::Cylinder(radius, h) => {
                (r - radius).abs() < 4e-3 || (inward.z.abs() - h).abs() < 4e-3
            }
            Shape::Sphere(radius) => (inward.coords.norm() - radius).abs() < 4e-3,
            Shape::Capsule(radius, h) => {
                let z = (inward.z.abs() - h).max(0.0);
                (r.hypot(z) - radius).abs() < 4e-3
            }
            Shape::Hull(ref hull) => (hull.faces().iter())
                .any(|f| (f.normal.dot(&inward.coords) - f.offset_m).abs() < 4e-3),
        }
    }

    trait AcrossNorm {
        fn xy_norm(&self) -> f64;
    }

    impl AcrossNorm for Point3<f64> {
        fn xy_norm(&self) -> f64 {
            self.x.hypot(self.y)
        }
    }
}
