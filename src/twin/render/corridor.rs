//! What is beside and over a stretch of a line, to tell whether a place is about it.

use crate::track::Track;
use nalgebra::Point3;
use std::ops::RangeInclusive;

/// From point to point of a centreline.
const STEP_M: f64 = 5.0;

/// A stretch of a line with what is between two distances from it and between two heights.
#[derive(Clone, Debug)]
pub struct Corridor {
    /// Along its centreline.
    points: Vec<Point3<f64>>,
    /// To its left.
    lateral_m: RangeInclusive<f64>,
    /// Over top of rail.
    heights_m: RangeInclusive<f64>,
}

impl Corridor {
    /// About a stretch of a track, which may reach beyond its ends.
    pub fn along(
        track: &Track,
        [from_m, to_m]: [f64; 2],
        lateral_m: RangeInclusive<f64>,
        heights_m: RangeInclusive<f64>,
    ) -> Self {
        let length_m = to_m - from_m;
        let steps = (length_m / STEP_M).ceil().max(1.0);
        let at = |k: u32| from_m + length_m * f64::from(k) / steps;
        let points = (0..=steps as u32).map(|k| track.alignment.at(at(k)).origin);
        Self {
            points: points.collect(),
            lateral_m,
            heights_m,
        }
    }

    /// Along its centreline.
    pub fn points(&self) -> &[Point3<f64>] {
        &self.points
    }

    /// Whether a place is beside or over it, neither before its begin nor beyond its end.
    pub fn holds(&self, p: &Point3<f64>) -> bool {
        let last = self.points.len().saturating_sub(2);
        let pieces = self.points.windows(2).enumerate().map(|(k, pair)| {
            let (along, to) = ((pair[1] - pair[0]).xy(), (p - pair[0]).xy());
            let share = along.dot(&to) / along.norm_squared();
            // On the outside of a bend a place may be between two pieces.
            let away_m = (to - along * share.clamp(0.0, 1.0)).norm();
            let left_m = away_m.copysign(along.perp(&to));
            let is_outside = (k == 0 && share < 0.0) || (k == last && share > 1.0);
            let rail_m = pair[0].z + share.clamp(0.0, 1.0) * (pair[1].z - pair[0].z);
            (away_m, left_m, is_outside, p.z - rail_m)
        });
        let nearest = pieces.min_by(|a, b| a.0.total_cmp(&b.0));
        nearest.is_some_and(|(_, left_m, is_outside, height_m)| {
            !is_outside && self.lateral_m.contains(&left_m) && self.heights_m.contains(&height_m)
        })
    }
}
