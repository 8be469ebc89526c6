//! What convex bodies hide from a light, or from the eye, exactly where balls would be generous.

use crate::twin::geometry::{Body, Shape};
use crate::twin::render::gpu::region::Region;
use nalgebra::{Point3, Vector3};

/// Wider than any scene.
pub const WIDE_M: f64 = 1e6;
/// Surfaces lie this near to the cells that stand for them, and rays begin this near.
const SLACK_M: f64 = 5e-3;

/// Of the lines from a ball to a ball, how many a body cuts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinesCut {
    None,
    Some,
    All,
}

/// A body as what lies between pairs of planes: normal, least and largest distance from the centre.
pub struct Occluder {
    centre: Point3<f64>,
    /// None of spheres and capsules.
    pub slabs: Vec<(Vector3<f64>, f64, f64)>,
    /// Whether it is all of what lies there.
    is_whole: bool,
    /// How far it goes either way while the view is exposed.
    travel_m: f64,
    /// Radius of the ball around it.
    pub radius_m: f64,
}

impl Occluder {
    /// Of a body that is in the middle of the exposure `mid_s` after the job's time, and exposed for
    /// `half_s` before and after.
    pub fn of(body: &Body, mid_s: f64, half_s: f64) -> Self {
        let rotation = body.world_from_body.rotation;
        let (slabs, is_whole) = match &body.shape {
            Shape::Box(half) => {
                let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
                let slab = |(axis, half): (Vector3<f64>, &f64)| (rotation * axis, -half, *half);
                (axes.into_iter().zip(half.iter()).map(slab).collect(), true)
            }
            Shape::Hull(hull) => {
                let slab = |normal: Vector3<f64>, offset_m| (rotation * normal, -WIDE_M, offset_m);
                let faces = hull.faces().iter();
                (faces.map(|f| slab(f.normal, f.offset_m)).collect(), true)
            }
            Shape::Cylinder(_, half) => (vec![(rotation * Vector3::z(), -half, *half)], false),
            Shape::Sphere(_) | Shape::Capsule(..) => (Vec::new(), false),
        };
        Self {
            centre: (body.world_from_body.translation.vector + body.velocity_mps * mid_s).into(),
            slabs,
            is_whole,
            travel_m: body.velocity_mps.norm() * half_s,
            radius_m: body.shape.half_extents_m().norm(),
        }
    }

    /// Cuts of all lines from the one ball into the other that begin outside of it. At the share t of the
    /// way, a line is as far from that between the centres as both radii allow; where all that fits
    /// into the body, all lines pass through it, and where nothing of it does, none.
    pub fn cut(&self, from: &Region, to: &Region) -> LinesCut {
        let a = from.centre - self.centre;
        let way = to.centre - from.centre;
        let wide_m = from.radius_m + self.travel_m + SLACK_M;
        let wider_m = to.radius_m - from.radius_m;
        let (mut some, mut all) = ([0.0, 1.0], [0.0, 1.0]);
        let mut begins_outside = false;
        for (normal, low_m, high_m) in &self.slabs {
            let (at, slope) = (normal.dot(&a), normal.dot(&way));
            for (over_m, slope) in [(at - high_m, slope), (low_m - at, -slope)] {
                begins_outside |= over_m > wide_m;
                shorten(&mut some, over_m - wide_m, slope - wider_m);
                shorten(&mut all, over_m + wide_m, slope + wider_m);
            }
        }
        if some[0] > some[1] {
            LinesCut::None
        } else if self.is_whole && begins_outside && all[0] <= all[1] {
            LinesCut::All
        } else {
            LinesCut::Some
        }
    }
}

/// To the part of a span of t in which over + slope t <= 0.
fn shorten(span: &mut [f64; 2], over: f64, slope: f64) {
    if slope > 0.0 {
        span[1] = span[1].min(-over / slope);
    } else if slope < 0.0 {
        span[0] = span[0].max(-over / slope);
    } else if over > 0.0 {
        *span = [f64::INFINITY, f64::NEG_INFINITY];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::random::Stream;
    use nalgebra::{Isometry3, UnitQuaternion};

    fn body(stream: &Stream) -> Body {
        let x = |k| 2.0 * stream.uniform(k) - 1.0;
        let turn = UnitQuaternion::from_euler_angles(3.0 * x(0), 3.0 * x(1), 3.0 * x(2));
        Body {
            shape: Shape::Box(Vector3::new(
                0.5 + x(3).abs(),
                0.2 + x(4).abs(),
                0.2 + x(5).abs(),
            )),
            world_from_body: Isometry3::from_parts(Vector3::new(x(6), x(7), x(8)).into(), turn),
            velocity_mps: Vector3::zeros(),
            albedo: 0.5,
            luminance_cd_m2: 0.0,
        }
    }

    /// Whether a line meets the body, by walking along it.
    fn meets(body: &Body, from: Point3<f64>, to: Point3<f64>) -> bool {
        let Shape::Box(half) = &body.shape else {
            return false;
        };
        (0..=400).any(|k| {
            let at = from + (to - from) * (f64::from(k) / 400.0);
            let own = body.world_from_body.inverse_transform_point(&at).coords;
            own.abs().iter().zip(half.iter()).all(|(x, h)| x <= h)
        })
    }

    /// No line of those that are said to be cut goes by, and none of those that are not is cut; and
    /// each is said often enough to be of use.
    #[test]
    fn cuts_are_those_of_lines() {
        let mut seen = [0; 3];
        for trial in 0..400 {
            let stream = Stream::new(9, trial, "solid");
            let body = body(&stream);
            let solid = Occluder::of(&body, 0.0, 0.0);
            let around = |k: u64| {
                let x = |n| 2.0 * stream.uniform(20 + 3 * k + n) - 1.0;
                Vector3::new(x(0), x(1), x(2)).normalize()
            };
            let from = around(0) * 4.0;
            let to = Point3::from(2.0 * around(1) - from);
            let from = Point3::from(from);
            let (r0, r1) = (0.4 * stream.uniform(17), 0.4 * stream.uniform(18));
            let cut = solid.cut(&Region::around(from, r0), &Region::around(to, r1));
            seen[cut as usize] += 1;
            for k in 0..40 {
                let line = [from + around(2 + 2 * k) * r0, to + around(3 + 2 * k) * r1];
                match cut {
                    LinesCut::None => assert!(!meets(&body, line[0], line[1]), "trial {trial}"),
                    LinesCut::All => assert!(meets(&body, line[0], line[1]), "trial {trial}"),
                    LinesCut::Some => {}
                }
            }
        }
        assert!(seen.iter().all(|n| *n > 20), "{seen:?}");
    }
}
