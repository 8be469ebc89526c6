//! How far things extend in an image: a quick bound for a row, and the extent of bodies as a whole.

use super::Sight;
use crate::bus::Intrinsics;
use crate::twin::geometry::{Body, Solid};
use nalgebra::{Isometry3, Point2, Point3, Vector2, Vector3};
use rayon::prelude::*;
use std::ops::Range;

/// Parts nearer to the camera's plane than this have no outline in the image.
const NEAREST_M: f64 = 0.01;
/// A lens bends the edges of a box out of the rectangle around its corners by less than this
/// share of the rectangle's longer side.
const BEND: f64 = 0.1;
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
pub fn whole(bodies: &[&Body], sight: &Sight<'_>) -> Option<Whole> {
    let camera = &sight.view.camera.intrinsics;
    let (width, height) = (f64::from(camera.width_px), f64::from(camera.height_px));
    let mid = 0.5 * (height - 1.0);
    let (pose, after_s) = (sight.pose(mid), sight.after_s(mid));
    let mut around = Outline::Beside;
    for body in bodies {
        let outline = Outline::of(Solid::at(body, after_s).corners(), camera, &pose);
        around = around.with(outline);
    }
    let Outline::Around(low, high) = around else {
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
        let (pose, after_s) = (sight.pose(v), sight.after_s(v));
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
    let in_frame = covered.iter().filter(|p| sight.contains(p)).count();
    Some(Whole {
        low: covered.iter().fold(first, |a, p| a.inf(p)),
        high: covered.iter().fold(first, |a, p| a.sup(p)),
        pixels: covered.len() as f64 * step * step,
        in_frame: in_frame as f64 * step * step,
    })
}

/// Where in an image something may be.
#[derive(Clone, Copy)]
pub(super) enum Outline {
    /// Behind the camera.
    Beside,
    /// In this rectangle.
    Around(Point2<f64>, Point2<f64>),
    /// Anywhere: a part of it is beside the camera.
    Everywhere,
}

impl Outline {
    /// Around a box with these corners.
    pub(super) fn of(
        corners: [Point3<f64>; 8],
        camera: &Intrinsics,
        pose: &Isometry3<f64>,
    ) -> Self {
        let corners = corners.map(|c| pose.inverse_transform_point(&c));
        if corners.iter().all(|c| c.z <= 0.0) {
            return Self::Beside;
        }
        let mut low = Point2::new(f64::INFINITY, f64::INFINITY);
        let mut high = -low;
        for corner in &corners {
            let Some(p) = camera.project(corner).filter(|_| corner.z > NEAREST_M) else {
                return Self::Everywhere;
            };
            (low, high) = (low.inf(&p), high.sup(&p));
        }
        let margin = Vector2::repeat((high - low).max() * BEND + 1.0);
        Self::Around(low - margin, high + margin)
    }

    /// Corners of a cube around a place.
    pub(super) fn cube(centre: &Point3<f64>, half_m: f64) -> [Point3<f64>; 8] {
        std::array::from_fn(|k| {
            let side = |bit: usize| if k >> bit & 1 == 1 { half_m } else { -half_m };
            centre + Vector3::new(side(0), side(1), side(2))
        })
    }

    fn with(self, other: Self) -> Self {
        match (self, other) {
            (Self::Beside, one) | (one, Self::Beside) => one,
            (Self::Around(a, b), Self::Around(c, d)) => Self::Around(a.inf(&c), b.sup(&d)),
            _ => Self::Everywhere,
        }
    }

    /// Columns of row `v` in an image of that width.
    pub(super) fn columns(&self, v: usize, width: usize) -> Range<usize> {
        match self {
            Self::Beside => 0..0,
            Self::Everywhere => 0..width,
            Self::Around(low, high) => {
                if (v as f64) < low.y || v as f64 > high.y {
                    return 0..0;
                }
                let begin = (low.x.max(0.0) as usize).min(width);
                begin..((high.x + 1.0).max(0.0) as usize).clamp(begin, width)
            }
        }
    }
}
