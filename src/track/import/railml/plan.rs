//! Tracks in plan, through the coordinates that a file states.

use super::RailMlError;
use super::agreement::{TrackSpot, agree, agreeing};
use super::course::{AngleAt, TrackCourse};
use super::draft::{CutEnd, Draft, DraftPlan, DraftTrack, ElementShape};
use super::line::{Line, straight};
use super::place::KnownPlace;
use super::report::Fates;
use super::stated::{SAME_M, SAME_POINT_M};
use super::swapped::refuse_swapped;
use super::through::ThroughPlaces;
use crate::track::geodesy::Datum;
use crate::track::import::{MapStep, PlanCheck};
use nalgebra::Vector2;
use std::f64::consts::PI;

/// Turns of headings that are no reading error, radians, all together.
const LEAST_TURN: f64 = 0.02;

/// Draws all tracks. The datum is the first place of the file with coordinates.
pub(super) fn draw(draft: &Draft<'_>, fates: &mut Fates) -> Result<DraftPlan, RailMlError> {
    let places = draft.tracks.iter().flat_map(|track| &track.places);
    let first = places.min_by_key(|place| place.item.number());
    let first = first.ok_or(RailMlError::NoTracks)?;
    let datum = Datum {
        place: first.place,
        heading_deg: 0.0,
    };
    refuse_swapped(&draft.tracks, &datum)?;
    let spots = spots(draft, &datum, fates);
    let stated = draft.turns_are_known.then_some(1.0);
    let turn = stated.or_else(|| turn(draft, &spots));
    let mut drawn = DrawnTracks {
        draft,
        turn,
        spots,
        lines: draft.tracks.iter().map(|_| None).collect(),
    };
    drawn.draw_all(&datum)?;
    Ok(DraftPlan {
        datum: Some(datum),
        shapes: drawn.shapes(),
        checks: drawn.checks(&datum, fates),
        turn,
    })
}

/// Multiplied by 1 or -1, as positive curvature turns to the left or to the right.
fn turned_by(turn: f64, steps: &[MapStep]) -> Vec<MapStep> {
    let turned = steps.iter().map(|step| MapStep {
        value: turn * step.value,
        ..*step
    });
    turned.collect()
}

/// The places that each track runs through, and those of its neighbours where it is joined to them, as far as they
/// agree.
fn spots(draft: &Draft<'_>, datum: &Datum, fates: &mut Fates) -> Vec<Vec<TrackSpot>> {
    let own = |(source, track): (usize, &DraftTrack<'_>)| -> Vec<TrackSpot> {
        let spot = |known: &KnownPlace<'_>| TrackSpot {
            at_m: known.at_m,
            place: known.in_plane(datum),
            weight: known.weight,
            source,
        };
        track.places.iter().map(spot).collect()
    };
    let own: Vec<Vec<TrackSpot>> = draft.tracks.iter().enumerate().map(own).collect();
    let mut all = own.clone();
    for (a, b) in &draft.joints {
        for (from, onto) in [(*a, *b), (*b, *a)] {
            let (from_m, onto_m) = (from.at_m(&draft.tracks), onto.at_m(&draft.tracks));
            let there = own.get(from.track).map_or(&[][..], Vec::as_slice);
            let there = there.get(there.partition_point(|spot| spot.at_m < from_m - SAME_M)..);
            let there = there.unwrap_or_default().iter();
            let there = there.take_while(|spot| spot.at_m < from_m + SAME_M);
            let Some(spots) = all.get_mut(onto.track) else {
                continue;
            };
            spots.extend(there.map(|spot| TrackSpot {
                at_m: onto_m,
                ..spot.clone()
            }));
        }
    }
    for ((spots, track), own) in all.iter_mut().zip(&draft.tracks).zip(&own) {
        spots.sort_by(|a, b| a.at_m.total_cmp(&b.at_m).then(a.source.cmp(&b.source)));
        let course = track.curvatures().map(|steps| TrackCourse::new(0.0, steps));
        let chord_m =
            |[a, b]: [&TrackSpot; 2]| course.as_ref().map(|c| c.chord([a.at_m, b.at_m]).norm());
        let chosen = agreeing(spots, |pair| agree(pair, chord_m(pair)));
        let kept: Vec<TrackSpot> = chosen
            .iter()
            .filter_map(|k| spots.get(*k).cloned())
            .collect();
        for (place, spot) in track.places.iter().zip(own) {
            let same = kept.get(kept.partition_point(|kept| kept.at_m < spot.at_m)..);
            let mut same = same.unwrap_or_default().iter();
            let mut same = same.by_ref().take_while(|kept| kept.at_m <= spot.at_m);
            match same.any(|kept| kept == spot) {
                true => fates.take(place.item),
                false => fates.leave(
                    place.item,
                    "lies off by more than lengths along its track allow",
                ),
            }
        }
        *spots = kept;
        // Of places that are one, tracks that are joined there take the same.
        spots
            .dedup_by(|b, a| b.at_m - a.at_m < SAME_M && (b.place - a.place).norm() < SAME_POINT_M);
    }
    all
}

/// Why a track is not drawn: its places contradict each other, or there are none.
fn not_drawn(track: &DraftTrack<'_>, datum: &Datum) -> RailMlError {
    let mut places: Vec<&KnownPlace<'_>> = track.places.iter().collect();
    places.sort_by(|a, b| a.at_m.total_cmp(&b.at_m));
    match (places.first(), places.last()) {
        (Some(a), Some(b)) if b.at_m - a.at_m > SAME_M => b.item.fault(format!(
            "its coordinates are {:.1} m from those of {} (line {}), and the track between them is stated to be {:.1} m long: \
             correct the coordinates, or the stated length (`pos` in railML 2, `length` in railML 3)",
            (b.in_plane(datum) - a.in_plane(datum)).norm(),
            a.what,
            a.item.line(),
            b.at_m - a.at_m
        )),
        _ => track.item.fault(
            "nothing says where it lies: other tracks have coordinates, so it needs those of its begin or end, or a connection to a track that has them",
        ),
    }
}

/// Which way positive curvature turns, by how evenly headings then run through the known places of all tracks.
fn turn(draft: &Draft<'_>, spots: &[Vec<TrackSpot>]) -> Option<f64> {
    let uneven = |turn: f64| -> f64 {
        let of_tracks = draft.tracks.iter().zip(spots).map(|(track, spots)| {
            let steps = track.curvatures().unwrap_or_default();
            let turns = TrackCourse::new(0.0, &turned_by(turn, steps)).turns(spots);
            turns
                .windows(2)
                .map(|pair| (pair[1].1 - pair[0].1).abs())
                .sum::<f64>()
        });
        of_tracks.sum()
    };
    let [left, right] = [uneven(1.0), uneven(-1.0)];
    match left.max(right) > LEAST_TURN && left.min(right) < 0.5 * left.max(right) {
        true if left < right => Some(1.0),
        true => Some(-1.0),
        false => None,
    }
}

/// Tracks as far as they are drawn.
struct DrawnTracks<'d, 'a> {
    draft: &'d Draft<'a>,
    turn: Option<f64>,
    spots: Vec<Vec<TrackSpot>>,
    lines: Vec<Option<Line>>,
}

impl DrawnTracks<'_, '_> {
    /// First tracks of which places are known, those of which most are first; then those that are joined to one that is
    /// drawn, from there on.
    fn draw_all(&mut self, datum: &Datum) -> Result<(), RailMlError> {
        let mut joined: Vec<Vec<(CutEnd, CutEnd)>> =
            self.lines.iter().map(|_| Vec::new()).collect();
        for (a, b) in &self.draft.joints {
            for (from, onto) in [(*a, *b), (*b, *a)] {
                if let Some(joints) = joined.get_mut(onto.track) {
                    joints.push((from, onto));
                }
            }
        }
        let mut order: Vec<usize> = (0..self.lines.len()).collect();
        order.sort_by_key(|track| std::cmp::Reverse(self.spots.get(*track).map_or(0, Vec::len)));
        let mut fresh: Vec<usize> = Vec::new();
        for track in order {
            let has_spots = self.spots.get(track).is_some_and(|spots| !spots.is_empty());
            if has_spots && self.draw(track, joined.get(track).map_or(&[], Vec::as_slice)) {
                fresh.push(track);
            }
        }
        while let Some(track) = fresh.pop() {
            for (onto, from) in joined.get(track).into_iter().flatten() {
                let is_missing = self.lines.get(onto.track).is_some_and(Option::is_none);
                if is_missing && self.draw(onto.track, &[(*from, *onto)]) {
                    fresh.push(onto.track);
                }
            }
        }
        let missing = self
            .lines
            .iter()
            .zip(&self.draft.tracks)
            .find(|(line, _)| line.is_none());
        match missing {
            Some((_, track)) => Err(not_drawn(track, datum)),
            None => Ok(()),
        }
    }

    /// Draws a track; tells whether it could. At its ends it has the heading of tracks that are drawn and joined to it.
    fn draw(&mut self, number: usize, joints: &[(CutEnd, CutEnd)]) -> bool {
        let (Some(track), Some(spots)) = (self.draft.tracks.get(number), self.spots.get(number))
        else {
            return false;
        };
        let mut spots = spots.clone();
        let mut headings: Vec<AngleAt> = Vec::new();
        for (from, onto) in joints {
            let Some(Some(line)) = self.lines.get(from.track) else {
                continue;
            };
            let (from_m, onto_m) = (from.at_m(&self.draft.tracks), onto.at_m(&self.draft.tracks));
            let is_end = onto_m <= 0.0 || onto_m >= track.length_m;
            if is_end
                && headings
                    .iter()
                    .all(|heading| (heading.at_m - onto_m).abs() > 0.0)
            {
                // A train that leaves by one end enters by the other.
                let turned = if from.way == onto.way { PI } else { 0.0 };
                headings.push(AngleAt {
                    at_m: onto_m,
                    rad: line.heading(from_m) + turned,
                });
            }
            if spots.is_empty() {
                let (weight, source) = (1, from.track);
                spots.push(TrackSpot {
                    at_m: onto_m,
                    place: line.at(from_m),
                    weight,
                    source,
                });
            }
        }
        let line = match (self.turn, track.curvatures()) {
            (Some(turn), Some(steps)) => {
                let steps = turned_by(turn, steps);
                ThroughPlaces::new(&steps, &spots, &headings).map(Line::Curved)
            }
            _ => straight(&spots, headings.first().copied()),
        };
        let is_drawn = line.is_some();
        if let Some(place) = self.lines.get_mut(number) {
            *place = line;
        }
        is_drawn
    }

    fn shapes(&self) -> Vec<Vec<ElementShape>> {
        let total_m: f64 = self.draft.tracks.iter().map(|track| track.length_m).sum();
        let tracks = self.draft.tracks.iter().zip(&self.lines);
        let of_track = tracks.map(|(track, line)| {
            let pieces = (0..track.pieces()).map(|piece| match line {
                Some(line) => line.shape(track.bounds(piece), total_m),
                None => ElementShape {
                    points: Vec::new(),
                    stations: Vec::new(),
                },
            });
            pieces.collect()
        });
        of_track.collect()
    }

    /// Places beside tracks, as seen from where they are stated to be.
    fn checks(&self, datum: &Datum, fates: &mut Fates) -> Vec<(usize, f64, PlanCheck)> {
        let mut checks = Vec::new();
        for ((number, track), line) in self.draft.tracks.iter().enumerate().zip(&self.lines) {
            for (known, line) in track.beside.iter().zip(line.iter().cycle()) {
                let heading = line.heading(known.at_m);
                let forward = Vector2::new(heading.cos(), heading.sin());
                let to = known.in_plane(datum) - line.at(known.at_m);
                fates.take(known.item);
                let check = PlanCheck {
                    line: known.item.line(),
                    what: known.what.clone(),
                    element: 0,
                    along_m: to.dot(&forward),
                    left_m: forward.perp(&to),
                };
                checks.push((number, known.at_m, check));
            }
        }
        checks
    }
}
