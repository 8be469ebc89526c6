//! A track in plan, and the points of its elements.

use super::agreement::TrackSpot;
use super::course::AngleAt;
use super::draft::ElementShape;
use super::through::ThroughPlaces;
use crate::track::import::plane::along_m;
use nalgebra::{Point2, Vector2};

/// From point to point of a curve: a chord is 6 mm off one of 500 m.
const CURVE_STEP_M: f64 = 5.0;
/// And where the track is almost straight.
const STEP_M: f64 = 25.0;
/// A map has at most so many points, about; longer steps are made of longer tracks.
const MOST_POINTS: f64 = 1e6;
/// Two places nearer to each other are one, metres.
const SAME_M: f64 = 0.01;
/// Headings are taken over so much of a track, metres.
const HEADING_M: f64 = 1.0;

/// A track in plan.
pub(super) enum Line {
    /// With the curvature that is stated.
    Curved(ThroughPlaces),
    /// Straight from place to place, and on.
    Straight(Vec<(f64, Point2<f64>)>),
}

impl Line {
    pub(super) fn at(&self, at_m: f64) -> Point2<f64> {
        match self {
            Self::Curved(fit) => fit.at(at_m),
            Self::Straight(places) => {
                let last = places.len().saturating_sub(2);
                let k = places
                    .partition_point(|place| place.0 <= at_m)
                    .saturating_sub(1)
                    .min(last);
                match (places.get(k), places.get(k + 1)) {
                    (Some((a_m, a)), Some((b_m, b))) => {
                        let t = (at_m - a_m) / (b_m - a_m);
                        // Beyond its ends it is as long as stated.
                        let scale = if (0.0..=1.0).contains(&t) {
                            1.0
                        } else {
                            (b_m - a_m) / (b - a).norm().max(SAME_M)
                        };
                        let from = if t > 1.0 {
                            (b, at_m - b_m)
                        } else {
                            (a, at_m - a_m)
                        };
                        from.0 + (b - a) * (from.1 / (b_m - a_m) * scale)
                    }
                    (Some((_, only)), None) => *only,
                    _ => Point2::origin(),
                }
            }
        }
    }

    pub(super) fn heading(&self, at_m: f64) -> f64 {
        let way = self.at(at_m + HEADING_M) - self.at(at_m - HEADING_M);
        way.y.atan2(way.x)
    }

    /// A stretch of it, of a map whose tracks are so long together.
    pub(super) fn shape(&self, [from_m, to_m]: [f64; 2], total_m: f64) -> ElementShape {
        let coarse = (total_m / CURVE_STEP_M / MOST_POINTS).max(1.0);
        let mut places = vec![from_m, to_m];
        match self {
            Self::Curved(fit) => places.extend(fit.changes([from_m, to_m])),
            Self::Straight(known) => {
                let first = known.partition_point(|place| place.0 < from_m);
                let inside = known.get(first..).unwrap_or_default().iter();
                let inside = inside.take_while(|place| place.0 <= to_m);
                places.extend(inside.map(|place| place.0));
            }
        }
        places.sort_by(f64::total_cmp);
        places.dedup();
        let mut all = Vec::new();
        for pair in places.windows(2) {
            let [a, b] = [pair[0], pair[1]];
            all.push(a);
            if let Self::Curved(_) = self {
                let off = (self.heading(a + HEADING_M) - self.heading(b - HEADING_M)).abs();
                let step_m = if off > 1e-3 { CURVE_STEP_M } else { STEP_M };
                let steps = ((b - a) / (step_m * coarse)).ceil().clamp(1.0, MOST_POINTS) as u32;
                all.extend((1..steps).map(|k| a + (b - a) * f64::from(k) / f64::from(steps)));
            }
        }
        all.push(to_m);
        let points: Vec<Point2<f64>> = all.iter().map(|at_m| self.at(*at_m)).collect();
        let stations = all.into_iter().zip(along_m(&points)).collect();
        ElementShape { points, stations }
    }
}

/// Straight from place to place; through one place alone, in a direction.
pub(super) fn straight(spots: &[TrackSpot], heading: Option<AngleAt>) -> Option<Line> {
    let mut places: Vec<(f64, Point2<f64>)> = Vec::new();
    for spot in spots {
        if places
            .last()
            .is_none_or(|last| last.0 < spot.at_m && last.1 != spot.place)
        {
            places.push((spot.at_m, spot.place));
        }
    }
    if let ([(at_m, place)], Some(heading)) = (places.as_slice(), heading) {
        places.push((
            at_m + 1.0,
            place + Vector2::new(heading.rad.cos(), heading.rad.sin()),
        ));
    }
    (places.len() > 1).then_some(Line::Straight(places))
}
