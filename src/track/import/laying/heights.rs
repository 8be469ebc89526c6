//! Heights and grades of tracks, from the grades that a map has along its elements.
//!
//! Grades of a map add up to other heights on different ways to one place. So places where tracks meet have the heights
//! that differ least from all rises between them (least squares, by the method of Gauss and Seidel), and one slope, the
//! mean of those of their tracks. Between its ends each track has the map's grades, all changed by as much as it takes to
//! come to the height of its end. Vertical curves are as wide as there is room for.

use super::joining::Meeting;
use super::plans::rounded;
use super::{Laying, TrackEnd};
use crate::track::Direction;
use crate::track::file::GradeEntry;
use std::collections::{BTreeMap, VecDeque};

/// Sweeps over all places where tracks meet.
const SWEEPS: usize = 500;
/// A track for which the map has no grade says as little of heights as one of this many times its length.
const UNKNOWN_FACTOR: f64 = 100.0;
/// The slope of an end holds over this distance, or a quarter of the track.
const END_M: f64 = 10.0;
/// Grades that differ by less are one, permille.
const SAME_PERMILLE: f64 = 0.05;
/// Steepest grade of a tunnel file, permille.
const STEEPEST_PERMILLE: f64 = 60.0;
/// Widest radius of vertical curves.
const VERTICAL_RADIUS_M: f64 = 3000.0;

/// Height of the begin of each track, and its grades.
pub(super) struct Heights {
    pub begin_m: Vec<f64>,
    pub grades: Vec<Vec<GradeEntry>>,
}

/// A slope from one chainage to another.
#[derive(Clone, Copy)]
struct Rise {
    from_m: f64,
    to_m: f64,
    slope: f64,
}

/// Of a track.
struct Profile {
    rises: Vec<Rise>,
    is_known: bool,
    length_m: f64,
}

impl Profile {
    fn rise_m(&self) -> f64 {
        let rises = self.rises.iter();
        rises
            .map(|rise| (rise.to_m - rise.from_m) * rise.slope)
            .sum()
    }

    /// Up the track at one of its ends.
    fn slope(&self, way: Direction) -> f64 {
        let rise = match way {
            Direction::Down => self.rises.first(),
            Direction::Up => self.rises.last(),
        };
        rise.map_or(0.0, |rise| rise.slope)
    }
}

/// Heights of all tracks; none where the map has no grades, or none that a track can have.
pub(super) fn heights(laying: &Laying<'_>) -> Option<Heights> {
    let profiles: Vec<Profile> = (0..laying.plans.len()).map(|k| laying.profile(k)).collect();
    if !profiles.iter().any(|profile| profile.is_known) {
        return None;
    }
    let meetings = &laying.joined.meetings;
    let mut at: BTreeMap<TrackEnd, usize> = BTreeMap::new();
    for (k, meeting) in meetings.iter().enumerate() {
        at.extend(meeting.ends().into_iter().map(|end| (end, k)));
    }
    let heights_m = heights_of_meetings(&profiles, &at, meetings.len());
    let slopes = slopes_of_ends(&profiles, meetings);
    let mut found = Heights {
        begin_m: Vec::new(),
        grades: Vec::new(),
    };
    for (k, profile) in profiles.iter().enumerate() {
        let [begin, end] = [Direction::Down, Direction::Up].map(|way| end_of(k, way));
        let height_m = |end: TrackEnd| at.get(&end).and_then(|k| heights_m.get(*k)).copied();
        let (begin_m, end_m) = (height_m(begin)?, height_m(end)?);
        let [begin_m, end_m] = [begin_m, end_m].map(|m| rounded(m, 3));
        let ends = [slopes.get(&begin)?, slopes.get(&end)?];
        found.begin_m.push(begin_m);
        found
            .grades
            .push(grades(profile, ends.map(|slope| *slope), end_m - begin_m)?);
    }
    Some(found)
}

fn end_of(track: usize, way: Direction) -> TrackEnd {
    TrackEnd {
        track: crate::track::TrackId(track as u16),
        way,
    }
}

/// Heights that differ least from all rises.
fn heights_of_meetings(
    profiles: &[Profile],
    at: &BTreeMap<TrackEnd, usize>,
    count: usize,
) -> Vec<f64> {
    // From each place: to which other, how much higher that is, and how much that counts.
    let mut rises: Vec<Vec<(usize, f64, f64)>> = vec![Vec::new(); count];
    for (k, profile) in profiles.iter().enumerate() {
        let [begin, end] = [Direction::Down, Direction::Up].map(|way| at.get(&end_of(k, way)));
        let (Some(begin), Some(end)) = (begin, end) else {
            continue;
        };
        let factor = if profile.is_known {
            1.0
        } else {
            UNKNOWN_FACTOR
        };
        let weight = 1.0 / (factor * profile.length_m.max(1.0));
        rises[*begin].push((*end, profile.rise_m(), weight));
        rises[*end].push((*begin, -profile.rise_m(), weight));
    }
    let mut heights_m: Vec<Option<f64>> = vec![None; count];
    let mut first = vec![false; count];
    for k in 0..count {
        if heights_m[k].is_some() {
            continue;
        }
        (heights_m[k], first[k]) = (Some(0.0), true);
        let mut queue = VecDeque::from([k]);
        while let Some(k) = queue.pop_front() {
            let own_m = heights_m[k].unwrap_or(0.0);
            for (other, rise_m, _) in &rises[k] {
                if heights_m[*other].is_none() {
                    heights_m[*other] = Some(own_m + rise_m);
                    queue.push_back(*other);
                }
            }
        }
    }
    let mut heights_m: Vec<f64> = heights_m.into_iter().map(|m| m.unwrap_or(0.0)).collect();
    for _ in 0..SWEEPS {
        for k in (0..count).filter(|k| !first[*k]) {
            let terms = rises[k].iter();
            let sums = terms
                .map(|(other, rise_m, weight)| (weight * (heights_m[*other] - rise_m), *weight));
            let (sum, weights) =
                sums.fold((0.0, 0.0), |sum, term| (sum.0 + term.0, sum.1 + term.1));
            if weights > 0.0 {
                heights_m[k] = sum / weights;
            }
        }
    }
    heights_m
}

/// Slope at each end, up its track.
fn slopes_of_ends(profiles: &[Profile], meetings: &[Meeting]) -> BTreeMap<TrackEnd, f64> {
    let mut slopes = BTreeMap::new();
    // Of the way out of the track at an end.
    let outward = |end: TrackEnd| {
        let slope = profiles
            .get(usize::from(end.track.0))
            .map_or(0.0, |p| p.slope(end.way));
        sign(end.way) * slope
    };
    for meeting in meetings {
        // The first end is on one side, the others are on the other.
        let ends = meeting.ends();
        let sides = ends
            .iter()
            .enumerate()
            .map(|(k, end)| (*end, if k == 0 { 1.0 } else { -1.0 }));
        let is_known = |end: &TrackEnd| {
            profiles
                .get(usize::from(end.track.0))
                .is_some_and(|p| p.is_known)
        };
        let known: Vec<f64> = sides
            .clone()
            .filter(|(end, _)| is_known(end))
            .map(|(end, side)| side * outward(end))
            .collect();
        let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
        // As it is written.
        let mean = rounded(mean * 1e3, 3) / 1e3;
        slopes.extend(sides.map(|(end, side)| (end, sign(end.way) * side * mean)));
    }
    slopes
}

fn sign(way: Direction) -> f64 {
    match way {
        Direction::Up => 1.0,
        Direction::Down => -1.0,
    }
}

/// Grades between two slopes that come to a height; none where they would be too steep.
fn grades(profile: &Profile, ends: [f64; 2], height_m: f64) -> Option<Vec<GradeEntry>> {
    let length_m = profile.length_m;
    let end_m = END_M.min(0.25 * length_m);
    let (low_m, high_m) = (rounded(end_m, 3), rounded(length_m - end_m, 3));
    let inner = profile.rises.iter().map(|rise| Rise {
        from_m: rise.from_m.max(low_m),
        to_m: rise.to_m.min(high_m),
        ..*rise
    });
    let inner: Vec<Rise> = inner
        .filter(|rise| rise.to_m - rise.from_m > 1e-3)
        .collect();
    let mut slopes: Vec<(f64, f64)> = vec![(0.0, ends[0])];
    for rise in &inner {
        let same = |(_, slope): &(f64, f64)| 1e3 * (slope - rise.slope).abs() < SAME_PERMILLE;
        if slopes.len() == 1 || !slopes.last().is_some_and(same) {
            slopes.push((
                if slopes.len() == 1 {
                    low_m
                } else {
                    rounded(rise.from_m, 3)
                },
                rise.slope,
            ));
        }
    }
    slopes.push((high_m, ends[1]));
    let until_m = |k: usize| slopes.get(k + 1).map_or(length_m, |next| next.0);
    let rise_m: f64 = (0..slopes.len())
        .map(|k| (until_m(k) - slopes[k].0) * slopes[k].1)
        .sum();
    let change = (height_m - rise_m) / (high_m - low_m).max(1e-6);
    let last = slopes.len() - 1;
    for (_, slope) in slopes.get_mut(1..last)? {
        *slope += change;
    }
    let room_m = |k: usize| {
        let [before, own] = [k - 1, k].map(|k| slopes[k].0);
        (own - before).min(slopes.get(k + 1).map_or(length_m, |next| next.0) - own)
    };
    let entries = slopes.iter().enumerate().map(|(k, (from_m, slope))| {
        let step = k
            .checked_sub(1)
            .map_or(0.0, |before| (slope - slopes[before].1).abs());
        let radius_m = match k {
            0 => 0.0,
            // Half of the curve on either side, in half of the room.
            k if step > 1e-9 => (0.98 * room_m(k) / step).min(VERTICAL_RADIUS_M),
            _ => 0.0,
        };
        GradeEntry {
            from_m: *from_m,
            grade_permille: rounded(slope * 1e3, 6),
            vertical_radius_m: radius_m.floor(),
        }
    });
    let mut entries: Vec<GradeEntry> = entries.collect();
    entries.dedup_by(|own, before| (own.grade_permille - before.grade_permille).abs() < 1e-9);
    let fits = entries
        .iter()
        .all(|entry| entry.grade_permille.abs() <= STEEPEST_PERMILLE);
    fits.then_some(entries)
}

impl Laying<'_> {
    /// What the map says of a track's grades.
    fn profile(&self, k: usize) -> Profile {
        let length_m = self.plans[k].length_m;
        let scale = length_m / self.drawn_m(k);
        let mut profile = Profile {
            rises: Vec::new(),
            is_known: false,
            length_m,
        };
        let mut begin_m = 0.0;
        for (element, way) in &self.joined.tracks[k].pieces {
            let own_m = self.map.network.elements[*element].length_m();
            let known = &self.map.along[*element].grades_permille;
            profile.is_known |= !known.is_empty();
            // The first one holds from the begin on.
            let froms = known.iter().enumerate().map(|(k, grade)| match k {
                0 => 0.0,
                _ => grade.from_m.clamp(0.0, own_m),
            });
            let tos = known
                .iter()
                .skip(1)
                .map(|grade| grade.from_m.clamp(0.0, own_m))
                .chain([own_m]);
            let mut rises: Vec<Rise> = froms
                .zip(tos)
                .zip(known)
                .map(|((from_m, to_m), grade)| Rise {
                    from_m,
                    to_m,
                    slope: grade.value / 1e3,
                })
                .collect();
            if rises.is_empty() {
                rises.push(Rise {
                    from_m: 0.0,
                    to_m: own_m,
                    slope: 0.0,
                });
            }
            if *way == Direction::Down {
                rises.reverse();
                for rise in &mut rises {
                    (rise.from_m, rise.to_m) = (own_m - rise.to_m, own_m - rise.from_m);
                    rise.slope = -rise.slope;
                }
            }
            profile.rises.extend(rises.into_iter().map(|rise| Rise {
                from_m: (begin_m + rise.from_m) * scale,
                to_m: (begin_m + rise.to_m) * scale,
                slope: rise.slope,
            }));
            begin_m += own_m;
        }
        profile
    }
}
