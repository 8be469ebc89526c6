//! A lens out of focus: its picture is the mean of those from many points of its pupil.
//!
//! A point (a, b) of the pupil is a pinhole there. What lies in the plane in focus, at a depth z, must
//! be seen where the middle of the pupil sees it: the principal point moves by f a / z and f b / z.

use crate::twin::render::View;
use crate::twin::render::disc::disc_points;
use nalgebra::{Point3, Translation3, Vector3};

/// A circle of confusion smaller than this is that of a sharp picture.
const SHARP_PX: f64 = 0.2;
/// The nearest surface that is blurred as far as it should be.
const NEAREST_M: f64 = 1.0;
/// Points of the pupil lie so close that their pictures are this far apart.
const APART_PX: f64 = 0.5;
/// Most points.
const MOST: usize = 256;

/// Whether all of the pupil sees the same.
pub(super) fn is_small(view: &View) -> bool {
    widest_px(view) < SHARP_PX
}

/// The view from points spread evenly over the pupil.
pub(super) fn pinholes(view: &View) -> Vec<View> {
    let Some(focus_m) = view.lens.focus_m.filter(|_| !is_small(view)) else {
        return vec![view.clone()];
    };
    let count = ((widest_px(view) / APART_PX).powi(2).ceil() as usize).clamp(16, MOST);
    let radius_m = 0.5 * view.pupil_m();
    disc_points(&Point3::origin(), &Vector3::z(), radius_m, count)
        .map(|point| through(view, &point, focus_m))
        .collect()
}

fn widest_px(view: &View) -> f64 {
    let ends = [NEAREST_M, f64::INFINITY].map(|depth_m| view.confusion_px(depth_m));
    ends[0].max(ends[1])
}

/// The view through a pinhole at a point of the pupil, in the camera's frame.
fn through(view: &View, point: &Point3<f64>, focus_m: f64) -> View {
    let mut view = view.clone();
    for pose in &mut view.motion.poses {
        *pose *= Translation3::from(point.coords);
    }
    let lens = &mut view.camera.intrinsics;
    lens.cx_px += lens.fx_px * point.x / focus_m;
    lens.cy_px += lens.fy_px * point.y / focus_m;
    view
}
