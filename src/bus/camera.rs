//! Cameras as their calibration sheets describe them, and the frames that they deliver.

use super::{Distortion, SimTime};
use image::GrayImage;
use nalgebra::{Isometry3, Point2, Point3, Vector3};
use serde::{Deserialize, Serialize};

/// A camera's projection: a pinhole behind a lens that distorts. Pixel coordinates have the centre of the top left pixel at (0, 0), u to the
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
        (p.z > 1e-9).then(|| self.pixel(self.distortion.distort([p.x / p.z, p.y / p.z])))
    }

    /// Direction of a pixel in the camera's frame, scaled to z = 1.
    pub fn ray(&self, u: f64, v: f64) -> Vector3<f64> {
        let [x, y] = self.distortion.undistort(self.at_depth_1(u, v));
        Vector3::new(x, y, 1.0)
    }

    /// Where a pixel would be if the lens had no distortion.
    pub fn ideal(&self, pixel: &Point2<f64>) -> Point2<f64> {
        if self.distortion.is_none() {
            return *pixel;
        }
        let ray = self.ray(pixel.x, pixel.y);
        self.pixel([ray.x, ray.y])
    }

    /// Where a pixel of a lens without distortion is seen: the inverse of [`Self::ideal`].
    pub fn seen(&self, ideal: &Point2<f64>) -> Point2<f64> {
        if self.distortion.is_none() {
            return *ideal;
        }
        self.pixel(self.distortion.distort(self.at_depth_1(ideal.x, ideal.y)))
    }

    /// Pixel of a point at depth 1, as it is seen.
    fn pixel(&self, [x, y]: [f64; 2]) -> Point2<f64> {
        Point2::new(self.fx_px * x + self.cx_px, self.fy_px * y + self.cy_px)
    }

    /// The point at depth 1 of a pixel, as it is seen.
    fn at_depth_1(&self, u: f64, v: f64) -> [f64; 2] {
        [(u - self.cx_px) / self.fx_px, (v - self.cy_px) / self.fy_px]
    }

    /// Whether a pixel is in the picture.
    pub fn contains(&self, pixel: &Point2<f64>) -> bool {
        (0.0..=f64::from(self.width_px) - 1.0).contains(&pixel.x)
            && (0.0..=f64::from(self.height_px) - 1.0).contains(&pixel.y)
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
    /// Whether all rows open at once, so that what blinks shows no stripes.
    pub fn is_global(&self) -> bool {
        self.line_time_s <= 0.0
    }

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
    /// Standard deviation of the lens's point spread in focus, pixels, as a slanted edge shows it (ISO
    /// 12233).
    pub blur_px: f64,
}

/// The stereo rig on the train head: two cameras, each with intrinsics and a shutter of its own.
/// This is the sheet; the rig as it is built may differ from it. When an eye was triggered is said
/// by each [`Frame`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RigCalibration {
    /// Left eye.
    pub left: CameraModel,
    /// Right eye.
    pub right: CameraModel,
    /// The right eye in the left eye's frame: x right, y down, z ahead.
    pub left_from_right: Isometry3<f64>,
    /// The left eye on the leading car. The vehicle frame is fixed to that car's body; with the
    /// car at rest on straight level track its origin is on the centreline, at top of rail, under
    /// the train head.
    pub vehicle_from_left: Isometry3<f64>,
}

impl RigCalibration {
    /// Both eyes the same, parallel, the right one `baseline_m` along the left one's x axis.
    pub fn rectified(
        camera: CameraModel,
        baseline_m: f64,
        vehicle_from_left: Isometry3<f64>,
    ) -> Self {
        Self {
            left: camera,
            right: camera,
            left_from_right: Isometry3::translation(baseline_m, 0.0, 0.0),
            vehicle_from_left,
        }
    }

    /// Distance between the eyes.
    pub fn baseline_m(&self) -> f64 {
        self.left_from_right.translation.vector.norm()
    }
}

/// One image as read out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Counts up from 0, gaps are lost frames.
    pub number: u32,
    /// When its first row opened, as the camera says.
    pub start: SimTime,
    /// How long every row collected light, as the camera says.
    pub exposure_s: f64,
    /// Gain before the converter, as the camera says.
    pub gain_db: f64,
    /// 8-bit grey; 0 x 0 where the camera has delivered none.
    #[serde(with = "super::image_serde")]
    pub image: GrayImage,
}

/// Both eyes, triggered together or one a known time after the other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StereoPair {
    /// Left eye.
    pub left: Frame,
    /// Right eye.
    pub right: Frame,
}
