//! Arcs and straights by stated curvature, and how chords between known places turn them.

use super::agreement::TrackSpot;
use crate::track::import::MapStep;
use crate::track::import::plane::turn_rad;
use nalgebra::{Point2, Vector2};

/// Chords at least so long tell a heading, metres.
const CHORD_M: f64 = 20.0;
/// Half the turn of an arc below which it is as long as its chord.
const STRAIGHT: f64 = 1e-9;
/// What a straight takes of a turn, radians a metre, against the stated turn of curves.
const LEAST_BEND_PER_M: f64 = 1e-7;

/// Arcs and straights from a place on.
#[derive(Clone, Debug)]
pub(super) struct TrackCourse {
    knots: Vec<ArcBegin>,
}

#[derive(Clone, Copy, Debug)]
struct ArcBegin {
    at_m: f64,
    place: Point2<f64>,
    heading: f64,
    curvature: f64,
}

impl ArcBegin {
    fn run(&self, at_m: f64) -> (Point2<f64>, f64) {
        let length_m = at_m - self.at_m;
        let turned = self.curvature * length_m;
        let chord_m = match (turned / 2.0).abs() < STRAIGHT {
            true => length_m,
            false => length_m * (turned / 2.0).sin() / (turned / 2.0),
        };
        let (sin, cos) = (self.heading + turned / 2.0).sin_cos();
        (
            self.place + Vector2::new(cos, sin) * chord_m,
            self.heading + turned,
        )
    }
}

/// An angle at a place along a track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AngleAt {
    pub(super) at_m: f64,
    pub(super) rad: f64,
}

/// How much of a turn a track has made, whichever way, up to a place along it.
pub(super) struct StatedTurn {
    /// Place, turn up to it, and turn a metre from there on.
    knots: Vec<(f64, f64, f64)>,
}

impl StatedTurn {
    pub(super) fn new(steps: &[MapStep]) -> Self {
        let mut knots = vec![(0.0, 0.0, LEAST_BEND_PER_M)];
        let mut last = (0.0, 0.0, LEAST_BEND_PER_M);
        for step in steps {
            let turn = last.1 + (step.from_m - last.0) * last.2;
            last = (step.from_m, turn, step.value.abs() + LEAST_BEND_PER_M);
            knots.push(last);
        }
        Self { knots }
    }

    fn knot(&self, after: usize) -> (f64, f64, f64) {
        let knot = self.knots.get(after.saturating_sub(1));
        knot.copied().unwrap_or((0.0, 0.0, LEAST_BEND_PER_M))
    }

    fn up_to(&self, at_m: f64) -> f64 {
        let (from_m, turn, rate) = self.knot(self.knots.partition_point(|knot| knot.0 <= at_m));
        turn + (at_m - from_m) * rate
    }

    /// Between two places, where half of the turn between them is made.
    pub(super) fn middle(&self, [a_m, b_m]: [f64; 2]) -> f64 {
        let half = (self.up_to(a_m) + self.up_to(b_m)) / 2.0;
        let (from_m, turn, rate) = self.knot(self.knots.partition_point(|knot| knot.1 <= half));
        from_m + (half - turn) / rate
    }
}

impl TrackCourse {
    /// From the origin in a direction, straight where no curvature is stated; steps are in their order along it.
    pub(super) fn new(heading: f64, steps: &[MapStep]) -> Self {
        let mut last = ArcBegin {
            at_m: 0.0,
            place: Point2::origin(),
            heading,
            curvature: 0.0,
        };
        let mut knots = vec![last];
        for step in steps {
            let (place, heading) = last.run(step.from_m);
            last = ArcBegin {
                at_m: step.from_m,
                place,
                heading,
                curvature: step.value,
            };
            knots.push(last);
        }
        Self { knots }
    }

    /// Where a place along it is, and the heading there.
    pub(super) fn at(&self, at_m: f64) -> (Point2<f64>, f64) {
        let after = self.knots.partition_point(|knot| knot.at_m <= at_m);
        let knot = self.knots.get(after.saturating_sub(1));
        knot.map_or((Point2::origin(), 0.0), |knot| knot.run(at_m))
    }

    pub(super) fn chord(&self, [a_m, b_m]: [f64; 2]) -> Vector2<f64> {
        self.at(b_m).0 - self.at(a_m).0
    }

    /// Places in a stretch at which curvature changes.
    pub(super) fn changes(&self, [from_m, to_m]: [f64; 2]) -> impl Iterator<Item = f64> {
        let first = self.knots.partition_point(|knot| knot.at_m < from_m);
        let inside = self.knots.get(first..).unwrap_or_default().iter();
        let inside = inside.map(|knot| knot.at_m);
        inside.take_while(move |at_m| *at_m <= to_m)
    }

    /// By how much each chord between known places is turned against the course's, of those long enough: its begin and
    /// end, and the angle, which does not jump from one to the next.
    pub(super) fn turns(&self, known: &[TrackSpot]) -> Vec<([f64; 2], f64)> {
        let mut turns: Vec<([f64; 2], f64)> = Vec::new();
        let mut begin: Option<&TrackSpot> = None;
        for spot in known {
            let Some(from) = begin else {
                begin = Some(spot);
                continue;
            };
            if spot.at_m - from.at_m < CHORD_M {
                continue;
            }
            let own = self.chord([from.at_m, spot.at_m]);
            let asked = spot.place - from.place;
            let angle = asked.y.atan2(asked.x) - own.y.atan2(own.x);
            let near = turns.last().map_or(0.0, |(_, angle)| *angle);
            turns.push(([from.at_m, spot.at_m], near + turn_rad(near, angle)));
            begin = Some(spot);
        }
        turns
    }
}

/// Steps of curvature, with the heading turned by angles at places, and between these in proportion to the bend.
pub(super) fn turned(steps: &[MapStep], turns: &[AngleAt], bend: &StatedTurn) -> Vec<MapStep> {
    let parts = turns.windows(2).filter_map(|pair| match pair {
        [a, b] if b.at_m > a.at_m => Some(MapStep {
            from_m: a.at_m,
            value: (b.rad - a.rad) / (bend.up_to(b.at_m) - bend.up_to(a.at_m)),
        }),
        _ => None,
    });
    let end = turns.last().map(|turn| MapStep {
        from_m: turn.at_m,
        value: 0.0,
    });
    let parts: Vec<MapStep> = parts.chain(end).collect();
    let value = |steps: &[MapStep], at_m: f64| {
        let after = steps.partition_point(|step| step.from_m <= at_m);
        let held = after.checked_sub(1).and_then(|k| steps.get(k));
        held.map_or(0.0, |step| step.value)
    };
    let mut places: Vec<f64> = steps.iter().chain(&parts).map(|step| step.from_m).collect();
    places.sort_by(f64::total_cmp);
    places.dedup();
    let sum = |from_m: f64| {
        let own = value(steps, from_m);
        MapStep {
            from_m,
            value: own + value(&parts, from_m) * (own.abs() + LEAST_BEND_PER_M),
        }
    };
    places.into_iter().map(sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn an_arc_is_exact() {
        // A quarter of a circle to the left, then straight on to the north.
        let steps = [(0.0, 1.0 / 200.0), (100.0 * PI, 0.0)];
        let course = TrackCourse::new(0.0, &steps.map(|(from_m, value)| MapStep { from_m, value }));
        let (end, heading) = course.at(100.0 * PI + 50.0);
        assert!((end - Point2::new(200.0, 250.0)).norm() < 1e-9, "{end}");
        assert!((heading - PI / 2.0).abs() < 1e-12);
    }
}
