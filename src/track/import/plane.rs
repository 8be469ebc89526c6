//! Lengths along points and turns between headings, in plan.

use nalgebra::Point2;
use std::f64::consts::{PI, TAU};

/// Length of the straights between points, metres.
pub(super) fn length_m(points: &[Point2<f64>]) -> f64 {
    steps_m(points).sum()
}

/// How far along the straights between points each of them is, metres.
pub(super) fn along_m(points: &[Point2<f64>]) -> Vec<f64> {
    let mut reached_m = 0.0;
    let steps_m = std::iter::once(0.0).chain(steps_m(points));
    let along_m = steps_m.take(points.len()).map(|step_m| {
        reached_m += step_m;
        reached_m
    });
    along_m.collect()
}

fn steps_m(points: &[Point2<f64>]) -> impl Iterator<Item = f64> + '_ {
    points.windows(2).map(|pair| (pair[1] - pair[0]).norm())
}

/// By how much a train turns that runs in one direction and then in another: from half a turn to the right to half a
/// turn to the left.
pub(super) fn turn_rad(from_rad: f64, to_rad: f64) -> f64 {
    (to_rad - from_rad + PI).rem_euclid(TAU) - PI
}
