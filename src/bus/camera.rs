//! Cameras as their calibration sheets describe them, and the frames that they deliver.

use super::SimTime;
use image::GrayImage;
use nalgebra::{Isometry3, Point2, Point3, Vector3};
use serde::{Deserialize, Serialize};

/// A pinhole camera. Pixel coordinates have the centre of the top left pixel at (0, 0), u to the
/// right and v down, as OpenCV has them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Intrinsics {
    /// Image width.
    pub width_px: u32,
    /// Image height.
    pub height_px: u32,
    /// Focal length over pixel width.
    pub fx_px: f64,
    /// Focal length over pixel height.
    pub fy_px: f64,
    /// Principal point, u.
    pub cx_px: f64,
    /// Principal point, v.
    pub cy_px: f64,
    /// Of the lens.
    pub distortion: Distortion,
}

impl Intrinsics {
    /// Square pixels and the principal point in the image's centre.
    pub fn centred(width_px: u32, height_px: u32, f_px: f64) -> Self {
        Self {
            width_px,
            height_px,
            fx_px: f_px,
            fy_px: f_px,
            cx_px: (f64::from(width_px) - 1.0) / 2.0,
            cy_px: (f64::from(height_px) - 1.0) / 2.0,
            distortion: Distortion::default(),
        }
    }

    /// Pixel of a point given in the camera's frame; `None` at or behind the camera's plane.
    pub fn project(&self, p: &Point3<f64>) -> Option<Point2<f64>> {
        (p.z > 1e-9).then(|| {
            let [x, y] = self.distortion.distort([p.x / p.z, p.y / p.z]);
            Point2::new(self.fx_px * x + self.cx_px, self.fy_px * y + self.cy_px)
        })
    }

    /// Direction of a pixel in the camera's frame, scaled to z = 1.
    pub fn ray(&self, u: f64, v: f64) -> Vector3<f64> {
        let seen = [(u - self.cx_px) / self.fx_px, (v - self.cy_px) / self.fy_px];
        let [x, y] = self.distortion.undistort(seen);
        Vector3::new(x, y, 1.0)
    }
}

/// Distortion of a lens after Brown and Conrady, in OpenCV's five coefficients: with
/// r^2 = x^2 + y^2 at depth 1, a point (x, y) is seen at
///
/// ```text
/// x' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2)
/// y' = y (1 + k1 r^2 + k2 r^4 + k3 r^6) + p1 (r^2 + 2 y^2) + 2 p2 x y
/// ```
///
/// Beyond [`Self::reach`], where a polynomial turns back and would show a point twice, the factor
/// of the radius stays as it is there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Distortion {
    /// Radial, of r^2.
    pub k1: f64,
    /// Radial, of r^4.
    pub k2: f64,
    /// Radial, of r^6.
    pub k3: f64,
    /// Tangential.
    pub p1: f64,
    /// Tangential.
    pub p2: f64,
}

/// Steps of Newton's method; each doubles the digits.
const NEWTON_STEPS: usize = 8;
/// Radii beyond this are 84 deg off the axis, outside any picture of this projection.
const MAX_RADIUS: f64 = 10.0;

impl Distortion {
    /// Whether there is any.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Where a point (x, y) at depth 1 is seen.
    pub fn distort(&self, p: [f64; 2]) -> [f64; 2] {
        if self.is_none() {
            return p;
        }
        let reach2 = self.reach().powi(2);
        self.distort_within(reach2, p)
    }

    fn distort_within(&self, reach2: f64, [x, y]: [f64; 2]) -> [f64; 2] {
        let r2 = (x * x + y * y).min(reach2);
        let radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3));
        [
            x * radial + 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x),
            y * radial + self.p1 * (r2 + 2.0 * y * y) + 2.0 * self.p2 * x * y,
        ]
    }

    /// The point at depth 1 that is seen at (x', y'), by Newton's method.
    pub fn undistort(&self, seen: [f64; 2]) -> [f64; 2] {
        if self.is_none() {
            return seen;
        }
        let reach2 = self.reach().powi(2);
        let [mut x, mut y] = seen;
        for _ in 0..NEWTON_STEPS {
            let [u, v] = self.distort_within(reach2, [x, y]);
            let (du, dv) = (seen[0] - u, seen[1] - v);
            let r2 = x * x + y * y;
            let inside = r2 < reach2;
            let r2 = r2.min(reach2);
            let radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3));
            let slope = if inside {
                self.k1 + r2 * (2.0 * self.k2 + r2 * 3.0 * self.k3)
            } else {
                0.0
            };
            // The derivative, which is symmetric but for the clamp's share.
            let a = radial + 2.0 * x * x * slope + 2.0 * self.p1 * y + 6.0 * self.p2 * x;
            let b = 2.0 * x * y * slope + 2.0 * self.p1 * x + 2.0 * self.p2 * y;
            let d = radial + 2.0 * y * y * slope + 6.0 * self.p1 * y + 2.0 * self.p2 * x;
            let det = a * d - b * b;
            if det.abs() < 1e-12 {
                break;
            }
            x += (d * du - b * dv) / det;
            y += (a * dv - b * du) / det;
        }
        [x, y]
    }

    /// The radius at depth 1 up to which a larger radius is seen farther out: where
    /// r (1 + k1 r^2 + k2 r^4 + k3 r^6) first stops growing.
    pub fn reach(&self) -> f64 {
        let slope = |r: f64| {
            let r2 = r * r;
            1.0 + r2 * (3.0 * self.k1 + r2 * (5.0 * self.k2 + r2 * 7.0 * self.k3))
        };
        let steps = 1000;
        let step = MAX_RADIUS / f64::from(steps);
        (1..=steps)
            .map(|k| step * f64::from(k))
            .find(|r| slope(*r) <= 0.0)
            .map_or(MAX_RADIUS, |r| r - step)
    }
}

/// Rolling shutter: rows open one after the other, all for the same time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Shutter {
    /// From the opening of a row to the opening of the next; 0 for a global shutter.
    pub line_time_s: f64,
    /// How long every row collects light.
    pub exposure_s: f64,
    /// Row that opens first, at the frame's start: 0 where the sensor is read downwards, its last
    /// row where it is read upwards.
    pub first_row: u32,
}

impl Shutter {
    /// From the frame's start to the opening of row `v`.
    pub fn delay_s(&self, v: f64) -> f64 {
        let rows = if self.first_row == 0 {
            v
        } else {
            f64::from(self.first_row) - v
        };
        rows * self.line_time_s
    }

    /// From the opening of a row to that of the row below it: negative where the sensor is read
    /// upwards.
    pub fn row_step_s(&self) -> f64 {
        if self.first_row == 0 {
            self.line_time_s
        } else {
            -self.line_time_s
        }
    }

    /// When row `v` opens in a frame that starts at `start`.
    pub fn row_open(&self, start: SimTime, v: f64) -> SimTime {
        start.plus(self.delay_s(v))
    }

    /// The middle of the exposure of row `v`.
    pub fn row_mid(&self, start: SimTime, v: f64) -> SimTime {
        start.plus(self.delay_s(v) + 0.5 * self.exposure_s)
    }

    /// From the opening of the first row to the closing of the last of `rows`.
    pub fn frame_span_s(&self, rows: u32) -> f64 {
        f64::from(rows.saturating_sub(1)) * self.line_time_s + self.exposure_s
    }
}

/// One camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraModel {
    /// Geometry of the image.
    pub intrinsics: Intrinsics,
    /// When each row sees.
    pub shutter: Shutter,
}

/// The stereo rig on the train head, rectified: both eyes share intrinsics and orientation, and
/// the right eye sits `baseline_m` along the left eye's x axis. This is the sheet; the rig as it is
/// built may differ from it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RigCalibration {
    /// Either eye.
    pub camera: CameraModel,
    /// Distance between the eyes.
    pub baseline_m: f64,
    /// The left eye on the leading car. The vehicle frame is fixed to that car's body; with the
    /// car at rest on straight level track its origin is on the centreline, at top of rail, under
    /// the train head.
    pub vehicle_from_left: Isometry3<f64>,
}

impl RigCalibration {
    /// The right eye in the left one's frame.
    pub fn left_from_right(&self) -> Isometry3<f64> {
        Isometry3::translation(self.baseline_m, 0.0, 0.0)
    }
}

/// One image as read out.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Counts up from 0, gaps are lost frames.
    pub number: u32,
    /// When row 0 opened.
    pub start: SimTime,
    /// 8-bit grey; 0 x 0 where the camera has delivered none.
    pub image: GrayImage,
}

/// Both eyes, triggered together.
#[derive(Clone, Debug, PartialEq)]
pub struct StereoPair {
    /// Left eye.
    pub left: Frame,
    /// Right eye.
    pub right: Frame,
}
