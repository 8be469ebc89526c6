//! Whether latitude and longitude are swapped, by the lengths of tracks.
//!
//! The other way round, places are elsewhere on the earth, and distances are others: across the meridian by the cosines of
//! latitude and longitude, along it by the cosine of the longitude alone. So a track that runs from south to north is a
//! quarter of a percent too short at 4 degrees of longitude, and 3 % at 15. That is less than what a curve takes, so that
//! such pairs of places count where one of both ways gives the stated length and the other does not.

use super::RailMlError;
use super::agreement::{TrackSpot, agree};
use super::course::TrackCourse;
use super::draft::DraftTrack;
use super::place::KnownPlace;
use super::stated::SAME_POINT_M;
use crate::track::geodesy::{Datum, Geodetic};

/// Two distances differ if they are farther apart than this, metres, plus `APART` of the length.
const APART_M: f64 = 0.5;
/// Scales of projections and heights over the sea change lengths by less.
const APART: f64 = 0.001;
/// A distance is as stated if it is off by no more than this, metres, a digit of coordinates in millionths of a degree, plus
/// `EXACT` of the length.
const EXACT_M: f64 = 0.1;
/// See `EXACT_M`.
const EXACT: f64 = 0.0005;
/// The distance the other way round must be off by more than so many times as much.
const CLEARLY: f64 = 4.0;

/// Two places that follow each other along a track, by their distance there and on the earth.
struct PairLengths<'p, 'a> {
    from: &'p KnownPlace<'a>,
    to: &'p KnownPlace<'a>,
    length_m: f64,
    /// Of the stated curves, or the length.
    chord_m: f64,
    as_read: bool,
    the_other_way: bool,
    read_m: f64,
    swapped_m: f64,
}

/// The two systems in which the same places lie.
struct BothWays {
    read: Datum,
    swapped: Datum,
}

/// Fails where distances are as stated only with the coordinates the other way round.
pub(super) fn refuse_swapped(tracks: &[DraftTrack<'_>], datum: &Datum) -> Result<(), RailMlError> {
    let places = tracks.iter().flat_map(|track| &track.places);
    let Some(place) = places.filter_map(|place| place.swapped).next() else {
        return Ok(());
    };
    let both = BothWays {
        read: *datum,
        swapped: Datum {
            place,
            heading_deg: 0.0,
        },
    };
    let pairs: Vec<PairLengths<'_, '_>> =
        tracks.iter().flat_map(|track| both.pairs(track)).collect();
    let count = |is: &dyn Fn(&&PairLengths<'_, '_>) -> bool| pairs.iter().filter(is).count();
    let roughly = [
        count(&|pair| pair.as_read),
        count(&|pair| pair.the_other_way),
    ];
    let apart = count(&|pair| pair.is_told_apart());
    let exactly = [
        count(&|pair| pair.is_as_stated(pair.read_m, pair.swapped_m)),
        count(&|pair| pair.is_as_stated(pair.swapped_m, pair.read_m)),
    ];
    let is_rough = |[read, swapped]: [usize; 2]| 2 * read < pairs.len() && 2 * read < swapped;
    let is_exact =
        |[read, swapped]: [usize; 2]| swapped > 0 && 2 * swapped >= apart && 4 * read <= swapped;
    let example = pairs
        .iter()
        .find(|pair| pair.off(pair.swapped_m) < pair.off(pair.read_m));
    match example {
        Some(pair) if is_rough(roughly) => Err(pair.swapped(roughly, pairs.len())),
        Some(pair) if is_exact(exactly) => Err(pair.swapped(exactly, apart)),
        _ => Ok(()),
    }
}

impl BothWays {
    fn pairs<'p, 'a>(&self, track: &'p DraftTrack<'a>) -> Vec<PairLengths<'p, 'a>> {
        let mut places: Vec<&KnownPlace<'a>> = track.places.iter().collect();
        places.sort_by(|a, b| a.at_m.total_cmp(&b.at_m));
        let course = track.curvatures().map(|steps| TrackCourse::new(0.0, steps));
        let of_pair = |pair: &[&'p KnownPlace<'a>]| {
            let [from, to] = *pair else { return None };
            let (swapped_from, swapped_to) = (from.swapped?, to.swapped?);
            let length_m = to.at_m - from.at_m;
            let chord = course
                .as_ref()
                .map(|c| c.chord([from.at_m, to.at_m]).norm());
            let spots = |datum: &Datum, places: [&Geodetic; 2]| {
                let [a, b] = places.map(|place| datum.world(place).xy());
                [(from.at_m, a), (to.at_m, b)].map(|(at_m, place)| TrackSpot {
                    at_m,
                    place,
                    weight: 1,
                    source: 0,
                })
            };
            let [a, b] = spots(&self.read, [&from.place, &to.place]);
            let [c, d] = spots(&self.swapped, [&swapped_from, &swapped_to]);
            (length_m >= SAME_POINT_M).then(|| PairLengths {
                from,
                to,
                length_m,
                chord_m: chord.unwrap_or(length_m),
                as_read: agree([&a, &b], None).is_some(),
                the_other_way: agree([&c, &d], None).is_some(),
                read_m: (b.place - a.place).norm(),
                swapped_m: (d.place - c.place).norm(),
            })
        };
        places.windows(2).filter_map(of_pair).collect()
    }
}

impl PairLengths<'_, '_> {
    fn off(&self, found_m: f64) -> f64 {
        (found_m - self.chord_m).abs()
    }

    fn is_told_apart(&self) -> bool {
        (self.read_m - self.swapped_m).abs() > APART_M + APART * self.length_m
    }

    /// Of two distances that are told apart, the first is as stated, and the other is not.
    fn is_as_stated(&self, this_m: f64, other_m: f64) -> bool {
        let (this, other) = (self.off(this_m), self.off(other_m));
        self.is_told_apart() && this <= EXACT_M + EXACT * self.length_m && CLEARLY * this < other
    }

    /// That coordinates seem to be swapped, with how many distances are as stated as read and the other way round.
    fn swapped(&self, [read, swapped]: [usize; 2], of: usize) -> RailMlError {
        self.from.item.fault(format!(
            "{read} of {of} distances between coordinates are as long as the track between them, and {swapped} with the \
             coordinates the other way round: are they swapped? To {} (line {}) it is {:.1} m as stated, {:.1} m as read, and \
             {:.1} m the other way round; let the first number be the latitude, or correct the stated lengths",
            self.to.what,
            self.to.item.line(),
            self.chord_m,
            self.read_m,
            self.swapped_m
        ))
    }
}
