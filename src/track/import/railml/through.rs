//! A track through known places, with its stated curvature between them.
//!
//! Curvature that holds from place to place makes arcs and straights, whose chords are exact. Stated radii leave out
//! transitions and are rounded, so that heading drifts in curves: it is turned by what the chords between known places
//! ask for, from the middle of one chord's turn to that of the next, in proportion to the stated turn. So straights
//! stay straight, and curves become tighter or wider. What is then left at the known places is taken away by a monotone
//! cubic along the track (F. Fritsch, J. Butland, "A method for constructing local monotone piecewise cubic
//! interpolants", SIAM J. Sci. Stat. Comput. 5, 1984), which does not swing where known places are near each other. So
//! the track runs through them without a bend.

use super::agreement::TrackSpot;
use super::course::{AngleAt, StatedTurn, TrackCourse, turned};
use crate::track::import::MapStep;
use crate::track::import::plane::turn_rad;
use nalgebra::{Point2, Vector2};

/// A heading at an end turns the course by less than the chord beside it and this, radians.
const MOST_HELD: f64 = 0.2;
/// As often is the course turned by what its chords still ask for.
const TURNS: usize = 8;

/// A course through known places.
#[derive(Clone, Debug)]
pub(super) struct ThroughPlaces {
    course: TrackCourse,
    origin: Vector2<f64>,
    /// What is left at the known places: place, rest, and its slope there.
    rest: Vec<(f64, Vector2<f64>, Vector2<f64>)>,
}

impl ThroughPlaces {
    /// Through at least one place, in their order along the track, with headings at places at its ends.
    pub(super) fn new(
        steps: &[MapStep],
        known: &[TrackSpot],
        headings: &[AngleAt],
    ) -> Option<Self> {
        let first = known.first()?;
        let bend = StatedTurn::new(steps);
        let mut course = TrackCourse::new(0.0, steps);
        let chords = course.turns(known);
        let middle = |(chord_m, rad): &([f64; 2], f64)| AngleAt {
            at_m: bend.middle(*chord_m),
            rad: *rad,
        };
        let mut turns: Vec<AngleAt> = chords.iter().map(middle).collect();
        let held = held(&course, &turns, headings);
        if turns.is_empty() && held.is_empty() {
            course = TrackCourse::new(by_chord(&course, known)?, steps);
        }
        for _ in 0..TURNS {
            let mut all: Vec<AngleAt> = turns.iter().chain(&held).copied().collect();
            all.sort_by(|a, b| a.at_m.total_cmp(&b.at_m));
            let Some(start) = all.first() else {
                break;
            };
            course = TrackCourse::new(start.rad, &turned(steps, &all, &bend));
            let more = course.turns(known);
            for (turn, (_, more)) in turns.iter_mut().zip(more) {
                turn.rad += more;
            }
        }
        let origin = first.place - course.at(first.at_m).0;
        let mut left: Vec<(f64, Vector2<f64>)> = Vec::new();
        for spot in known {
            if left.last().is_none_or(|(at_m, _)| *at_m < spot.at_m) {
                left.push((spot.at_m, spot.place - (course.at(spot.at_m).0 + origin)));
            }
        }
        Some(Self {
            course,
            origin,
            rest: sloped(&left),
        })
    }

    pub(super) fn at(&self, at_m: f64) -> Point2<f64> {
        self.course.at(at_m).0 + self.origin + self.rest(at_m)
    }

    fn rest(&self, at_m: f64) -> Vector2<f64> {
        let after = self.rest.partition_point(|(rest_m, ..)| *rest_m <= at_m);
        let before = after.checked_sub(1).and_then(|k| self.rest.get(k));
        match (before, self.rest.get(after)) {
            (Some((a_m, a, slope_a)), Some((b_m, b, slope_b))) => {
                let length_m = b_m - a_m;
                let t = (at_m - a_m) / length_m;
                let (t2, t3) = (t * t, t * t * t);
                a * (2.0 * t3 - 3.0 * t2 + 1.0)
                    + slope_a * (length_m * (t3 - 2.0 * t2 + t))
                    + b * (3.0 * t2 - 2.0 * t3)
                    + slope_b * (length_m * (t3 - t2))
            }
            (Some((_, rest, _)), None) | (None, Some((_, rest, _))) => *rest,
            (None, None) => Vector2::zeros(),
        }
    }

    /// Places in a stretch at which curvature changes.
    pub(super) fn changes(&self, stretch_m: [f64; 2]) -> impl Iterator<Item = f64> {
        self.course.changes(stretch_m)
    }
}

/// By how much headings at ends of a track turn its course, near to what the chords beside them ask for.
fn held(course: &TrackCourse, turns: &[AngleAt], headings: &[AngleAt]) -> Vec<AngleAt> {
    let held = headings.iter().filter_map(|heading| {
        let at_m = heading.at_m;
        let is_before = turns.first().is_none_or(|turn| turn.at_m > at_m);
        let is_after = turns.last().is_none_or(|turn| turn.at_m < at_m);
        let beside = if is_before {
            turns.first()
        } else {
            turns.last()
        };
        let near = beside.map_or(0.0, |turn| turn.rad);
        let more = turn_rad(near, heading.rad - course.at(at_m).1);
        // A neighbour that lies quite otherwise is no neighbour that a train runs to.
        let fits = beside.is_none() || more.abs() < MOST_HELD;
        let rad = near + more;
        ((is_before || is_after) && fits).then_some(AngleAt { at_m, rad })
    });
    let count = if turns.is_empty() { 1 } else { 2 };
    held.take(count).collect()
}

/// By how much a course is to be turned where no chord is long: by what chord there is.
fn by_chord(course: &TrackCourse, known: &[TrackSpot]) -> Option<f64> {
    let (first, last) = (known.first()?, known.last()?);
    let own = course.chord([first.at_m, last.at_m]);
    let asked = last.place - first.place;
    (last.at_m > first.at_m).then(|| asked.y.atan2(asked.x) - own.y.atan2(own.x))
}

/// Slopes of a monotone cubic through values, by component: the harmonic mean of those on both sides, or none where
/// these differ in sign; the line's own at its ends.
fn sloped(values: &[(f64, Vector2<f64>)]) -> Vec<(f64, Vector2<f64>, Vector2<f64>)> {
    let slope = |k: usize| match (values.get(k), values.get(k + 1)) {
        (Some((a_m, a)), Some((b_m, b))) => Some(((b - a) / (b_m - a_m), b_m - a_m)),
        _ => None,
    };
    let at = |k: usize| match (k.checked_sub(1).and_then(slope), slope(k)) {
        (Some((before, before_m)), Some((after, after_m))) => before.zip_map(&after, |a, b| {
            let (wa, wb) = (2.0 * after_m + before_m, after_m + 2.0 * before_m);
            match a * b > 0.0 {
                true => (wa + wb) / (wa / a + wb / b),
                false => 0.0,
            }
        }),
        (Some((only, _)), None) | (None, Some((only, _))) => only,
        (None, None) => Vector2::zeros(),
    };
    values
        .iter()
        .enumerate()
        .map(|(k, (at_m, value))| (*at_m, *value, at(k)))
        .collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn spot(at_m: f64, place: Point2<f64>) -> TrackSpot {
        TrackSpot {
            at_m,
            place,
            weight: 1,
            source: 0,
        }
    }

    fn step(from_m: f64, value: f64) -> MapStep {
        MapStep { from_m, value }
    }

    fn heading(at_m: f64, rad: f64) -> AngleAt {
        AngleAt { at_m, rad }
    }

    /// A curve of stated radius between known places 250 m apart is that curve: within millimetres of the truth, where
    /// chords are 23 m off.
    #[test]
    fn a_stated_curve_is_a_curve() {
        let steps = [step(100.0, -1.0 / 350.0), step(500.0, 0.0)];
        let truth = TrackCourse::new(2.0, &steps);
        let moved = Vector2::new(1234.0, -77.0);
        let known: Vec<TrackSpot> = [0.0, 250.0, 500.0, 600.0]
            .map(|s| spot(s, truth.at(s).0 + moved))
            .into();
        let fit = ThroughPlaces::new(&steps, &known, &[]).unwrap();
        for s in (0..=700).map(f64::from) {
            assert!((fit.at(s) - (truth.at(s).0 + moved)).norm() < 2e-3, "{s}");
        }
    }

    /// Round and round: angles of chords are not told from those of a turn more.
    #[test]
    fn a_track_may_turn_all_the_way_round() {
        let steps = [step(0.0, 1.0 / 200.0)];
        let truth = TrackCourse::new(3.0, &steps);
        let known: Vec<TrackSpot> = (0..20)
            .map(|k| spot(150.0 * f64::from(k), truth.at(150.0 * f64::from(k)).0))
            .collect();
        let fit = ThroughPlaces::new(&steps, &known, &[]).unwrap();
        for s in (0..2850).map(f64::from) {
            assert!((fit.at(s) - truth.at(s).0).norm() < 1e-6, "{s}");
        }
    }

    /// Radii without their transitions, and one rounded by 2 %, drift by metres within a kilometre; through places known
    /// to a centimetre, near to and far from each other, the track is nowhere farther off than a metre, and has no bend.
    #[test]
    fn what_radii_leave_out_is_taken_from_known_places() {
        let mut true_steps: Vec<MapStep> = (0..40)
            .map(|k| step(300.0 + 2.0 * f64::from(k), f64::from(k) / 40.0 / 600.0))
            .collect();
        true_steps.push(step(380.0, 1.0 / 600.0));
        true_steps.extend(
            (0..40).map(|k| step(700.0 + 2.0 * f64::from(k), f64::from(39 - k) / 40.0 / 600.0)),
        );
        let truth = TrackCourse::new(-1.0, &true_steps);
        let steps = [step(340.0, 1.0 / 612.0), step(740.0, 0.0)];
        let places = [0.0, 200.0, 201.5, 420.0, 640.0, 650.0, 900.0, 1400.0];
        let noise = |s: f64| Vector2::new((s * 1.7).sin(), (s * 2.3).cos()) * 0.01;
        let known: Vec<TrackSpot> = places.map(|s| spot(s, truth.at(s).0 + noise(s))).into();
        let fit = ThroughPlaces::new(&steps, &known, &[]).unwrap();
        let drift = TrackCourse::new(-1.0, &steps).at(1400.0).0 - truth.at(1400.0).0;
        assert!(drift.norm() > 8.0, "{drift}");
        let mut worst: f64 = 0.0;
        for s in (0..=1400).map(f64::from) {
            worst = worst.max((fit.at(s) - truth.at(s).0).norm());
            let [a, b] = [fit.at(s) - fit.at(s - 0.1), fit.at(s + 0.1) - fit.at(s)];
            assert!(a.angle(&b) < 1e-2, "bend at {s}: {}", a.angle(&b));
        }
        assert!(worst < 1.0, "{worst}");
        for spot in &known {
            assert!((fit.at(spot.at_m) - spot.place).norm() < 1e-9);
        }
    }

    /// Radii rounded by 2 % between two places alone: with the heading at one of them the track is nearer to the truth.
    #[test]
    fn a_heading_at_an_end_tells_where_the_turn_is() {
        let truth = TrackCourse::new(
            0.5,
            &[
                step(300.0, 1.0 / 500.0),
                step(600.0, 0.0),
                step(1200.0, -1.0 / 400.0),
                step(1400.0, 0.0),
            ],
        );
        let steps = [
            step(300.0, 1.0 / 510.0),
            step(600.0, 0.0),
            step(1200.0, -1.0 / 400.0),
            step(1400.0, 0.0),
        ];
        let known = [0.0, 2000.0].map(|s| spot(s, truth.at(s).0));
        let worst = |headings: &[AngleAt]| {
            let fit = ThroughPlaces::new(&steps, &known, headings).unwrap();
            let off = (0..=2000)
                .map(f64::from)
                .map(|s| (fit.at(s) - truth.at(s).0).norm());
            off.fold(0.0, f64::max)
        };
        let (alone, held) = (worst(&[]), worst(&[heading(0.0, 0.5)]));
        assert!(held < 0.5 * alone, "{held} {alone}");
        // The other way round it is no heading of this track.
        assert!((worst(&[heading(0.0, 0.5 + PI)]) - alone).abs() < 1e-9);
    }

    #[test]
    fn one_place_needs_a_heading() {
        let known = [spot(10.0, Point2::new(5.0, 5.0))];
        assert!(ThroughPlaces::new(&[], &known, &[]).is_none());
        let fit = ThroughPlaces::new(&[], &known, &[heading(10.0, PI / 2.0)]).unwrap();
        assert!((fit.at(30.0) - Point2::new(5.0, 25.0)).norm() < 1e-9);
    }
}
