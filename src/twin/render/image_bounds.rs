//! Where in an image a box may be seen.

use crate::bus::Intrinsics;
use nalgebra::{Isometry3, Point2, Point3, Vector2, Vector3};
use std::ops::Range;

/// Parts nearer to the camera's plane than this have no bounds in the image.
const NEAREST_M: f64 = 0.01;
/// A lens bends the edges of a box out of the rectangle around its corners by less than this
/// share of the rectangle's longer side.
const BEND: f64 = 0.1;

/// Where in an image something may be.
#[derive(Clone, Copy)]
pub enum ImageBounds {
    /// Behind the camera.
    Behind,
    /// In this rectangle.
    Around(Point2<f64>, Point2<f64>),
    /// Anywhere: a part of it is beside the camera.
    Everywhere,
}

impl ImageBounds {
    /// Around a box with these corners.
    pub fn of(corners: [Point3<f64>; 8], camera: &Intrinsics, pose: &Isometry3<f64>) -> Self {
        let corners = corners.map(|c| pose.inverse_transform_point(&c));
        if corners.iter().all(|c| c.z <= 0.0) {
            return Self::Behind;
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
    pub fn cube(centre: &Point3<f64>, half_m: f64) -> [Point3<f64>; 8] {
        std::array::from_fn(|k| {
            let side = |bit: usize| if k >> bit & 1 == 1 { half_m } else { -half_m };
            centre + Vector3::new(side(0), side(1), side(2))
        })
    }

    /// Around both.
    pub fn with(self, other: Self) -> Self {
        match (self, other) {
            (Self::Behind, one) | (one, Self::Behind) => one,
            (Self::Around(a, b), Self::Around(c, d)) => Self::Around(a.inf(&c), b.sup(&d)),
            _ => Self::Everywhere,
        }
    }

    /// Columns of row `v` in an image of that width.
    pub fn columns(&self, v: usize, width: usize) -> Range<usize> {
        match self {
            Self::Behind => 0..0,
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
