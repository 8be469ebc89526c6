//! The border between rapier's vectors (glam) and nalgebra's.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use rapier3d_f64::math::{Pose, Rotation, Vector};

pub(super) fn vector(v: Vector3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

pub(super) fn point(p: Point3<f64>) -> Vector {
    Vector::new(p.x, p.y, p.z)
}

pub(super) fn vector3(v: Vector) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

pub(super) fn point3(v: Vector) -> Point3<f64> {
    Point3::new(v.x, v.y, v.z)
}

pub(super) fn rotation(q: &UnitQuaternion<f64>) -> Rotation {
    Rotation::from_xyzw(q.i, q.j, q.k, q.w)
}

pub(super) fn pose(p: &Isometry3<f64>) -> Pose {
    Pose::from_parts(vector(p.translation.vector), rotation(&p.rotation))
}

pub(super) fn isometry(p: Vector, q: Rotation) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::from(vector3(p)),
        UnitQuaternion::from_quaternion(Quaternion::new(q.w, q.x, q.y, q.z)),
    )
}
