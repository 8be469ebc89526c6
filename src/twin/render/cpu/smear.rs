//! Into how many slices a row's exposure must be cut so that nothing moves by more than a pixel in
//! any of them.

use crate::twin::geometry::Body;
use crate::twin::render::{Job, View};
use nalgebra::Point3;

/// Motion within a slice.
const STEP_PX: f64 = 1.0;
/// Beyond it the steps are as long as they become.
const MOST_SLICES: f64 = 256.0;
/// No wall is taken to be nearer to a camera that moves.
const NEAREST_M: f64 = 1.5;

/// For all rows of a view.
pub(super) fn slices(job: &Job, view: &View) -> usize {
    let bodies = job.bodies.iter().map(|body| body_px(job, view, body));
    let most_px = bodies.fold(camera_px(view), f64::max);
    (most_px / STEP_PX).ceil().clamp(1.0, MOST_SLICES) as usize
}

/// How far the nearest wall may move in the image during a row's exposure: the most of the frame's
/// first, middle and last row.
fn camera_px(view: &View) -> f64 {
    let camera = &view.camera;
    if view.motion.poses.len() < 2 {
        return 0.0;
    }
    let last = f64::from(camera.intrinsics.height_px.max(1) - 1);
    let moved = [0.0, 0.5 * last, last].map(|v| {
        let open = camera.shutter.row_open(view.start, v);
        let from = view.motion.pose_at(open);
        let to = view.motion.pose_at(open.plus(camera.shutter.exposure_s));
        let way_m = (to.translation.vector - from.translation.vector).norm();
        way_m / NEAREST_M + from.rotation.angle_to(&to.rotation)
    });
    focal_px(view) * moved.into_iter().fold(0.0, f64::max)
}

/// The same for a body's nearest point.
fn body_px(job: &Job, view: &View, body: &Body) -> f64 {
    let mid_s = 0.5
        * view
            .camera
            .shutter
            .frame_span_s(view.camera.intrinsics.height_px);
    let time = view.start.plus(mid_s);
    let pose = view.motion.pose_at(time);
    let centre = body.world_from_body.translation.vector + body.velocity_mps * time.since(job.time);
    let seen = pose.inverse_transform_point(&Point3::from(centre));
    let nearest_m = seen.coords.norm() - body.shape.half_extents_m().norm();
    let way_m = body.velocity_mps.norm() * view.camera.shutter.exposure_s;
    focal_px(view) * way_m / nearest_m.max(NEAREST_M)
}

fn focal_px(view: &View) -> f64 {
    let lens = &view.camera.intrinsics;
    lens.fx_px.max(lens.fy_px)
}
