//! A lamp in front of the left eye, from two images or from one.
//!
//! **Stereo.** Rectified eyes: d = u_l - u_r, z = f b / d, x = (u - cx) z / f, y = (v - cy) z / f.
//! An error of the disparity scales the whole vector, so its share along the track is
//! (p . x / |x|) sigma_d / d: at 8.4 m depth, 10 m ahead, 0.67 m a pixel; at 3 m 0.06 m a pixel.
//! Both eyes expose the same row at the same time, so motion does not enter the disparity.
//!
//! **Mono.** Seen from anywhere, a disc of diameter D has one diameter square to the line of sight,
//! and that is its longest. In an image turned to look straight at the lamp its ellipse therefore
//! has the major half axis f D / (2 r) at range r (to first order in D/r). The image is turned by
//! turning the ellipse's cone: with Q its conic in normalised coordinates, Q' = R Q R^T.
//!
//! **Motion.** Rows are read one after the other, and a lamp that passes is sheared: at 60 km/h and
//! 2.5 m its 110 rows take 2.4 ms, in which it moves by a tenth of its width, and its longest
//! diameter grows by some 2 %. With p' the image's motion in a line time, a point that is n rows
//! under the centre is drawn n p' too far; [`at_rest`] takes that off.

use crate::bus::{CameraModel, Ellipse, Intrinsics, RigCalibration};
use nalgebra::{Matrix2, Matrix3, Point2, Rotation3, SymmetricEigen, Vector3};

/// Depths that a rig can be asked for.
const DEPTHS_M: std::ops::RangeInclusive<f64> = 0.3..=60.0;

/// Triangulates two centres; `None` where they are no pair.
pub fn triangulate(
    rig: &RigCalibration,
    left: &Point2<f64>,
    right: &Point2<f64>,
) -> Option<Vector3<f64>> {
    let c = &rig.camera.intrinsics;
    let disparity = left.x - right.x;
    let z = c.fx_px * rig.baseline_m / disparity;
    // The row is known twice.
    let v = 0.5 * (left.y + right.y);
    DEPTHS_M.contains(&z).then(|| c.ray(left.x, v) * z)
}

/// Lamp of a known diameter from its outline in one image.
pub fn from_size(
    c: &Intrinsics,
    centre: &Point2<f64>,
    outline: &Ellipse,
    diameter_m: f64,
) -> Option<Vector3<f64>> {
    let ray = c.ray(centre.x, centre.y);
    let turned = turned_major(c, outline, &ray)?;
    let range = 0.5 * diameter_m / turned;
    let lamp = ray.normalize() * range;
    DEPTHS_M.contains(&lamp.z).then_some(lamp)
}

/// The outline that a lamp at `lamp`, moving at `velocity` (both in the camera's frame), would have
/// if all its rows were read at the time of its centre's row.
pub fn at_rest(
    camera: &CameraModel,
    outline: &Ellipse,
    lamp: &Vector3<f64>,
    velocity: &Vector3<f64>,
) -> Option<Ellipse> {
    let c = &camera.intrinsics;
    let moved = (velocity.xy() - lamp.xy() * (velocity.z / lamp.z)) / lamp.z;
    let a_row = camera.shutter.line_time_s;
    let (du, dv) = (c.fx_px * moved.x * a_row, c.fy_px * moved.y * a_row);
    // still = read - (du, dv) (rows under the centre), and back.
    let read_from_still = Matrix2::new(1.0, -du, 0.0, 1.0 - dv).try_inverse()?;
    let squares = read_from_still.transpose() * conic(outline) * read_from_still;
    let eigen = SymmetricEigen::new(squares);
    let k = eigen.eigenvalues.imin();
    let (long, short) = (eigen.eigenvalues[k], eigen.eigenvalues[1 - k]);
    let axis = eigen.eigenvectors.column(k);
    (long > 0.0).then(|| Ellipse {
        semi_major_px: long.sqrt().recip(),
        semi_minor_px: short.sqrt().recip(),
        angle_rad: (axis[1] / axis[0]).atan(),
        ..*outline
    })
}

/// S of p^T S p = 1 about an ellipse's centre, pixels.
fn conic(e: &Ellipse) -> Matrix2<f64> {
    let (sin, cos) = e.angle_rad.sin_cos();
    let axes = Matrix2::new(cos, -sin, sin, cos);
    let squares = Matrix2::new(e.semi_major_px.powi(-2), 0.0, 0.0, e.semi_minor_px.powi(-2));
    axes * squares * axes.transpose()
}

/// Major half axis, over focal length, of an outline seen by a camera turned to look along `ray`.
fn turned_major(c: &Intrinsics, e: &Ellipse, ray: &Vector3<f64>) -> Option<f64> {
    // (p - m)^T S (p - m) = 1 in pixels, then p = K ray.
    let s = conic(e);
    let m = e.centre.coords;
    let sm = s * m;
    let pixels = Matrix3::new(
        s[(0, 0)],
        s[(0, 1)],
        -sm.x, //
        s[(1, 0)],
        s[(1, 1)],
        -sm.y, //
        -sm.x,
        -sm.y,
        m.dot(&sm) - 1.0,
    );
    let k = Matrix3::new(c.fx_px, 0.0, c.cx_px, 0.0, c.fy_px, c.cy_px, 0.0, 0.0, 1.0);
    let turn = Rotation3::rotation_between(ray, &Vector3::z())?.into_inner();
    let q = turn * (k.transpose() * pixels * k) * turn.transpose();
    let a = Matrix2::new(q[(0, 0)], q[(0, 1)], q[(0, 1)], q[(1, 1)]);
    let b = nalgebra::Vector2::new(q[(0, 2)], q[(1, 2)]);
    let level = b.dot(&(a.try_inverse()? * b)) - q[(2, 2)];
    let flattest = SymmetricEigen::new(a).eigenvalues.min();
    let square = level / flattest;
    (square > 0.0).then(|| square.sqrt())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::stack::led::fit_ellipse;
    use crate::stack::led::testing::rig;
    use nalgebra::Point3;
    use std::f64::consts::TAU;

    /// Projects and triangulates back.
    #[test]
    fn triangulation_inverts_projection() {
        let rig = rig();
        for p in [Vector3::new(5.0, 2.4, 8.4), Vector3::new(-0.6, -0.5, 2.3)] {
            let c = &rig.camera.intrinsics;
            let left = c.project(&Point3::from(p)).unwrap();
            let right = c
                .project(&Point3::from(p - Vector3::x() * rig.baseline_m))
                .unwrap();
            assert!((triangulate(&rig, &left, &right).unwrap() - p).norm() < 1e-9);
        }
        let p = Point2::new(300.0, 300.0);
        assert_eq!(triangulate(&rig, &p, &p), None);
        assert_eq!(triangulate(&rig, &p, &Point2::new(310.0, 300.0)), None);
    }

    /// A disc far off the axis, facing anywhere: range by size within the first-order error.
    #[test]
    fn size_gives_the_range_off_the_axis_too() {
        let c = rig().camera.intrinsics;
        let facings = [
            Vector3::new(-0.2, -0.1, -1.0),
            Vector3::new(-0.9, 0.3, -0.6),
            Vector3::new(0.5, 0.5, -1.0),
        ];
        for (lamp, facing) in [Vector3::new(5.0, 2.4, 8.4), Vector3::new(-1.0, 0.7, 3.0)]
            .into_iter()
            .flat_map(|p| facings.map(|f| (p, f)))
        {
            let x = facing.cross(&Vector3::new(0.3, 1.0, 0.1)).normalize();
            let y = facing.normalize().cross(&x);
            let outline: Vec<_> = (0..60)
                .map(|k| (TAU * f64::from(k) / 60.0).sin_cos())
                .map(|(s, c)| lamp + 0.125 * (x * c + y * s))
                .map(|p| c.project(&Point3::from(p)).unwrap())
                .collect();
            let fit = fit_ellipse(&outline).unwrap();
            let centre = c.project(&Point3::from(lamp)).unwrap();
            let found = from_size(&c, &centre, &fit.ellipse, 0.25).unwrap();
            let error = (found - lamp).norm() / lamp.norm();
            assert!(
                error < 2.0 * (0.125 / lamp.norm()).powi(2) + 1e-6,
                "{error}"
            );
        }
    }

    /// A disc that passes at 100 km/h, each point of its outline drawn where it is when its row is
    /// read: the range is too short by per cents, and right when the motion is taken off.
    #[test]
    fn a_passing_disc_keeps_its_size() {
        let camera = rig().camera;
        let c = &camera.intrinsics;
        let velocity = Vector3::new(-21.6, 6.0, -16.3);
        for lamp in [Vector3::new(-0.4, -0.3, 2.5), Vector3::new(1.5, -0.2, 4.0)] {
            let centre = c.project(&Point3::from(lamp)).unwrap();
            let drawn = |rim: Vector3<f64>| {
                let mut pixel = c.project(&Point3::from(lamp + rim)).unwrap();
                for _ in 0..20 {
                    let late_s = (pixel.y - centre.y) * camera.shutter.line_time_s;
                    let there = lamp + rim + velocity * late_s;
                    pixel = c.project(&Point3::from(there)).unwrap();
                }
                pixel
            };
            let points: Vec<_> = (0..90)
                .map(|k| (TAU * f64::from(k) / 90.0).sin_cos())
                .map(|(s, c)| drawn(Vector3::new(0.125 * c, 0.125 * s, 0.0)))
                .collect();
            let read = fit_ellipse(&points).unwrap().ellipse;
            let still = at_rest(&camera, &read, &lamp, &velocity).unwrap();
            let error =
                |e: &Ellipse| from_size(c, &centre, e, 0.25).unwrap().norm() / lamp.norm() - 1.0;
            assert!(error(&read) < -0.02, "{}", error(&read));
            assert!(error(&still).abs() < 0.006, "{}", error(&still));
        }
    }
}
