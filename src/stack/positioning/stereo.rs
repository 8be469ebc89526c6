//! A lamp in front of the left eye, from two images or from one.
//!
//! **Stereo.** Of rectified eyes d = u_l - u_r, z = f b / d, x = (u - cx) z / f, y = (v - cy) z / f.
//! Real eyes are not rectified: their lenses distort, differently, and they look a little past
//! each other. Here the points are rectified, not the images, whose rows are times: both lines of
//! sight, free of distortion, are turned into the one frame whose x axis is the baseline and whose
//! z axis is nearest to the left eye's, and d / f is the difference of their x at depth 1.
//! An error of the disparity scales the whole vector, so its share along the track is
//! (p . x / |x|) sigma_d / d: at 8.4 m depth, 10 m ahead, 0.67 m a pixel; at 3 m 0.06 m a pixel.
//! Equal eyes expose the same row at the same time, and motion does not enter the disparity. Where
//! they do not, the train runs on in between (28 mm in 1 ms at 100 km/h), and that is a part of the
//! baseline: the right eye is where it was when it saw the lamp.
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
//!
//! **Distortion.** Centres and outlines come in ideal pixels ([`Intrinsics::ideal`]), so that this
//! file knows pinholes only; but rows are those that were read.

use crate::bus::{CameraModel, Distortion, Ellipse, Intrinsics};
use nalgebra::{Isometry3, Matrix2, Matrix3, Point2, Rotation3, SymmetricEigen, Vector2, Vector3};

/// Depths that a rig can be asked for.
const DEPTHS_M: std::ops::RangeInclusive<f64> = 0.3..=60.0;

/// Two images of a lamp, put together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pairing {
    /// The lamp, in the left eye's frame.
    pub lamp: Vector3<f64>,
    /// Disparity over focal length, after rectification.
    pub disparity: f64,
    /// By how much the rows miss each other after it, over focal length.
    pub miss: f64,
    /// x of the right eye's line of sight at depth 1, after it.
    pub right_x: f64,
}

/// Triangulates two lines of sight, each in its eye's frame; `None` where they are no pair.
pub fn triangulate(
    left_from_right: &Isometry3<f64>,
    left: &Vector3<f64>,
    right: &Vector3<f64>,
) -> Option<Pairing> {
    let baseline = left_from_right.translation.vector;
    let left_from_rectified = rectified_axes(&baseline)?;
    let rectified = |ray: &Vector3<f64>| {
        let ray = left_from_rectified.tr_mul(ray);
        (ray.z > 1e-3).then(|| ray.xy() / ray.z)
    };
    let (l, r) = (
        rectified(left)?,
        rectified(&(left_from_right.rotation * right))?,
    );
    let disparity = l.x - r.x;
    // The row is known twice.
    let ray = Vector3::new(l.x, 0.5 * (l.y + r.y), 1.0);
    let lamp = left_from_rectified * ray * (baseline.norm() / disparity);
    DEPTHS_M.contains(&lamp.z).then_some(Pairing {
        lamp,
        disparity,
        miss: (l.y - r.y).abs(),
        right_x: r.x,
    })
}

/// Axes of the rectified frame, in the left eye's; `None` for eyes one behind the other.
fn rectified_axes(baseline: &Vector3<f64>) -> Option<Matrix3<f64>> {
    let x = baseline.try_normalize(1e-6)?;
    let z = (Vector3::z() - x * x.z).try_normalize(1e-3)?;
    Some(Matrix3::from_columns(&[x, z.cross(&x), z]))
}

/// The camera without its distortion.
pub fn pinhole(c: &Intrinsics) -> Intrinsics {
    Intrinsics {
        distortion: Distortion::default(),
        ..*c
    }
}

/// Lamp of a known diameter from its outline in one image of a pinhole.
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
/// if all its rows were read at the time of its centre's row. Outlines are in ideal pixels.
pub fn at_rest(
    camera: &CameraModel,
    outline: &Ellipse,
    lamp: &Vector3<f64>,
    velocity: &Vector3<f64>,
) -> Option<Ellipse> {
    let c = &camera.intrinsics;
    let moved = (velocity.xy() - lamp.xy() * (velocity.z / lamp.z)) / lamp.z;
    let a_row = camera.shutter.row_step_s();
    let step = Vector2::new(c.fx_px * moved.x * a_row, c.fy_px * moved.y * a_row);
    // still = read - step (rows under the centre), and back.
    let rows = rows_by_ideal(c, &outline.centre);
    let still_from_read = Matrix2::identity() - step * rows.transpose();
    let read_from_still = still_from_read.try_inverse()?;
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

/// By how many rows an ideal pixel's image moves for one to the right and for one down: (0, 1) but
/// for the distortion.
fn rows_by_ideal(c: &Intrinsics, at: &Point2<f64>) -> Vector2<f64> {
    if c.distortion.is_none() {
        return Vector2::y();
    }
    let row = |du: f64, dv: f64| c.seen(&(at + Vector2::new(du, dv))).y;
    0.5 * Vector2::new(
        row(1.0, 0.0) - row(-1.0, 0.0),
        row(0.0, 1.0) - row(0.0, -1.0),
    )
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
    let b = Vector2::new(q[(0, 2)], q[(1, 2)]);
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
    use crate::stack::led::testing::{rig, wide_rig};
    use nalgebra::Point3;
    use std::f64::consts::TAU;

    /// Projects and triangulates back, through eyes that are equal or that differ, turned and
    /// shifted against each other.
    #[test]
    fn triangulation_inverts_projection() {
        for rig in [rig(), wide_rig()] {
            for p in [Vector3::new(5.0, 2.4, 8.4), Vector3::new(-0.6, -0.5, 2.3)] {
                let sight = |eye: &CameraModel, p: Point3<f64>| {
                    let pixel = eye.intrinsics.project(&p).unwrap();
                    eye.intrinsics.ray(pixel.x, pixel.y)
                };
                let left = sight(&rig.left, p.into());
                let seen = rig.left_from_right.inverse() * Point3::from(p);
                let right = sight(&rig.right, seen);
                let found = triangulate(&rig.left_from_right, &left, &right).unwrap();
                assert!((found.lamp - p).norm() < 1e-9, "{}", found.lamp);
                assert!(found.miss < 1e-12, "{}", found.miss);
            }
            let ray = Vector3::new(0.2, 0.1, 1.0);
            let parallel = rig.left_from_right.rotation.inverse() * ray;
            assert_eq!(triangulate(&rig.left_from_right, &ray, &parallel), None);
            let apart = parallel + Vector3::x() * 0.1;
            assert_eq!(triangulate(&rig.left_from_right, &ray, &apart), None);
            let behind = Isometry3::translation(0.0, 0.0, 0.12);
            assert_eq!(triangulate(&behind, &ray, &(ray * 1.1)), None);
        }
    }

    /// What the header says: disparity, after rectification, is f b / z over the focal length.
    #[test]
    fn rectified_eyes_have_the_papers_disparity() {
        let rig = rig();
        let (left, right) = (Vector3::new(0.4, 0.2, 1.0), Vector3::new(0.385, 0.2, 1.0));
        let found = triangulate(&rig.left_from_right, &left, &right).unwrap();
        assert!((found.disparity - 0.015).abs() < 1e-12);
        assert!((found.lamp - left * (0.12 / 0.015)).norm() < 1e-9);
    }

    /// A disc far off the axis, facing anywhere: range by size within the first-order error.
    #[test]
    fn size_gives_the_range_off_the_axis_too() {
        let c = rig().left.intrinsics;
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
    /// read, downwards or upwards, through a straight or a wide lens: the range of one or the
    /// other is off by per cents, and right when the motion is taken off.
    #[test]
    fn a_passing_disc_keeps_its_size() {
        let velocity = Vector3::new(-21.6, 6.0, -16.3);
        for (rig, first_row) in [(rig(), 0), (rig(), 719), (wide_rig(), 0), (wide_rig(), 719)] {
            let mut camera = rig.left;
            camera.shutter.first_row = first_row;
            let c = &camera.intrinsics;
            let mut uncorrected: f64 = 0.0;
            for lamp in [Vector3::new(-0.4, -0.3, 2.5), Vector3::new(1.5, -0.2, 4.0)] {
                let seen = |p: Vector3<f64>| c.project(&Point3::from(p)).unwrap();
                let centre = seen(lamp);
                let drawn = |rim: Vector3<f64>| {
                    let mut pixel = seen(lamp + rim);
                    for _ in 0..20 {
                        let late_s = (pixel.y - centre.y) * camera.shutter.row_step_s();
                        pixel = seen(lamp + rim + velocity * late_s);
                    }
                    c.ideal(&pixel)
                };
                let points: Vec<_> = (0..90)
                    .map(|k| (TAU * f64::from(k) / 90.0).sin_cos())
                    .map(|(s, c)| drawn(Vector3::new(0.125 * c, 0.125 * s, 0.0)))
                    .collect();
                let read = fit_ellipse(&points).unwrap().ellipse;
                let still = at_rest(&camera, &read, &lamp, &velocity).unwrap();
                let error = |e: &Ellipse| {
                    let found = from_size(&pinhole(c), &c.ideal(&centre), e, 0.25).unwrap();
                    found.norm() / lamp.norm() - 1.0
                };
                uncorrected = uncorrected.max(error(&read).abs());
                assert!(error(&still).abs() < 0.002, "{}", error(&still));
            }
            assert!(uncorrected > 0.03, "{uncorrected}");
        }
    }
}
