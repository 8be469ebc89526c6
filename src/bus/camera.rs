//! Cameras as their calibration sheets describe them, and the frames that they deliver.
//!
//! Not modelled: distortion of a lens (frames are taken as undistorted and rectified, without
//! what that leaves), and an error of the eyes' synchronisation (both trigger at the same time).

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
        }
    }

    /// Pixel of a point given in the camera's frame; `None` at or behind the camera's plane.
    pub fn project(&self, p: &Point3<f64>) -> Option<Point2<f64>> {
        (p.z > 1e-9).then(|| {
            Point2::new(
                self.fx_px * p.x / p.z + self.cx_px,
                self.fy_px * p.y / p.z + self.cy_px,
            )
        })
    }

    /// Direction of a pixel in the camera's frame, scaled to z = 1.
    pub fn ray(&self, u: f64, v: f64) -> Vector3<f64> {
        Vector3::new(
            (u - self.cx_px) / self.fx_px,
            (v - self.cy_px) / self.fy_px,
            1.0,
        )
    }
}

/// Rolling shutter: rows open one after the other from the top, all for the same time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shutter {
    /// From the opening of a row to the opening of the next; 0 for a global shutter.
    pub line_time_s: f64,
    /// How long every row collects light.
    pub exposure_s: f64,
}

impl Shutter {
    /// When row `v` opens in a frame whose row 0 opens at `start`.
    pub fn row_open(&self, start: SimTime, v: f64) -> SimTime {
        start.plus(v * self.line_time_s)
    }

    /// The middle of the exposure of row `v`.
    pub fn row_mid(&self, start: SimTime, v: f64) -> SimTime {
        start.plus(v * self.line_time_s + 0.5 * self.exposure_s)
    }

    /// From the opening of row 0 to the closing of the last of `rows`.
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

/// One image as read out.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Counts up from 0, gaps are lost frames.
    pub number: u32,
    /// When row 0 opened.
    pub start: SimTime,
    /// 8-bit grey.
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
