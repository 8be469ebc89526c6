//! How far bodies as a whole extend in an image.

use super::projection::Projection;
use crate::twin::geometry::{Body, Solid};
use crate::twin::render::image_bounds::ImageBounds;
use nalgebra::{Point2, Point3};
use rayon::prelude::*;

/// Pixels looked at for an extent; of larger ones every second, third, ... is looked at.
const WHOLE_PX: f64 = 250_000.0;

/// How far a body as a whole extends in the image plane, hidden parts and those beyond the
/// image's frame included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Whole {
    /// First column and row that it covers.
    pub low: Point2<f64>,
    /// Last column and row.
    pub high: Point2<f64>,
    /// Pixels that it covers.
    pub pixels: f64,
    /// Those of them in the frame.
    pub in_frame: f64,
}

/// The extent of bodies that belong together, each row with its own time, rows beyond the frame
/// going on in time. `None` where they reach behind the camera or are not in its picture at all;
/// what is farther out of the frame than the frame is wide or high is left out.
pub fn whole(bodies: &[&Body], projection: &Projection<'_>) -> Option<Whole> {
    let camera = &projection.view.camera.intrinsics;
    let (width, height) = (f64::from(camera.width_px), f64::from(camera.height_px));
    let mid = 0.5 * (height - 1.0);
    let (pose, after_s) = (projection.pose(mid), projection.after_s(mid));
    let mut around = ImageBounds::Behind;
    for body in bodies {
        let bounds = ImageBounds::of(Solid::at(body, after_s).corners(), camera, &pose);
        around = around.with(bounds);
    }
    let ImageBounds::Around(low, high) = around else {
        return None;
    };
    let low = low.sup(&Point2::new(-width, -height));
    let high = high.inf(&Point2::new(2.0 * width, 2.0 * height));
    let size = high - low;
    if size.min() < 0.0 {
        return None;
    }
    let step = (size.x * size.y / WHOLE_PX).sqrt().ceil().max(1.0);
    let [columns, rows] = [(low.x, high.x), (low.y, high.y)]
        .map(|(from, to)| ((from / step).floor() as i64)..=((to / step).ceil() as i64));
    let rows: Vec<_> = rows.collect();
    let covered = |i: &i64| -> Vec<Point2<f64>> {
        let v = *i as f64 * step;
        let (pose, after_s) = (projection.pose(v), projection.after_s(v));
        let eye = Point3::from(pose.translation.vector);
        let solids: Vec<_> = bodies.iter().map(|b| Solid::at(b, after_s)).collect();
        let meets = |u: &f64| {
            let ray = pose * camera.ray(*u, v);
            solids.iter().any(|s| s.cast(&eye, &ray).is_some())
        };
        let columns = columns.clone().map(|j| j as f64 * step);
        columns.filter(meets).map(|u| Point2::new(u, v)).collect()
    };
    let covered: Vec<_> = rows.par_iter().flat_map_iter(covered).collect();
    let first = *covered.first()?;
    let in_frame = covered.iter().filter(|p| projection.contains(p)).count();
    Some(Whole {
        low: covered.iter().fold(first, |a, p| a.inf(p)),
        high: covered.iter().fold(first, |a, p| a.sup(p)),
        pixels: covered.len() as f64 * step * step,
        in_frame: in_frame as f64 * step * step,
    })
}
