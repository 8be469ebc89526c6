//! Bodies: obstacles, limbs of workers, parts of trains.

use super::hull::Hull;
use nalgebra::{Isometry3, Vector3};
use std::sync::Arc;

/// A solid shape, centred on its body's origin.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Half extents.
    Box(Vector3<f64>),
    /// Radius and half height, along z.
    Cylinder(f64, f64),
    /// Radius.
    Sphere(f64),
    /// Radius and half length of the straight part, along z.
    Capsule(f64, f64),
    /// Corners and flat faces.
    Hull(Arc<Hull>),
}

impl Shape {
    /// How far it extends from its origin in a direction of length 1 (its support function).
    pub fn reach_m(&self, direction: &Vector3<f64>) -> f64 {
        let (level, up) = (direction.xy().norm(), direction.z.abs());
        match self {
            Self::Box(half) => half.dot(&direction.abs()),
            Self::Cylinder(radius, half) => radius * level + half * up,
            Self::Sphere(radius) => *radius,
            Self::Capsule(radius, half) => radius + half * up,
            Self::Hull(hull) => hull.reach_m(direction),
        }
    }

    /// Half extents along its axes; of a hull, which may be lopsided, those of its farther side.
    pub fn half_extents_m(&self) -> Vector3<f64> {
        match self {
            Self::Box(half) => *half,
            Self::Cylinder(r, h) => Vector3::new(*r, *r, *h),
            Self::Sphere(r) => Vector3::repeat(*r),
            Self::Capsule(r, h) => Vector3::new(*r, *r, h + r),
            Self::Hull(hull) => hull.half_extents_m(),
        }
    }
}

/// Something that may move: obstacle, limb of a worker, part of a train.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Its shape.
    pub shape: Shape,
    /// Where it is, at the time that its list is of.
    pub world_from_body: Isometry3<f64>,
    /// Where it goes meanwhile, world.
    pub velocity_mps: Vector3<f64>,
    /// Share of light reflected (Lambert), 0 to 1.
    pub albedo: f64,
    /// Luminance of its own, cd/m^2 (a headlight's lens).
    pub luminance_cd_m2: f64,
}
