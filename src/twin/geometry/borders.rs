//! Where cross-sections end: which walls across the line close them.
//!
//! Such a wall is the free space on its side of a station's plane without that beyond it, whichever track
//! that is of. Where nothing goes on, as at the ends of a line, there is none: the tunnel leads into the
//! dark. An open section is taken to end [`PARAPET_M`] over the highest tunnel that it meets, so that a portal has
//! a headwall.

use super::end_wall::{EndWall, Plane, WallPaint};
use super::free_space::{difference, free_space};
use super::track_caster::{Segment, TrackCaster};
use crate::track::{BED_M, CrossSection, Direction};
use nalgebra::{Vector2, Vector3};

/// A headwall rises this far over the tunnel.
const PARAPET_M: f64 = 1.0;
/// So far beyond a plane other tracks are looked for that go on there.
const BEGINS_M: f64 = 0.05;
/// Tracks at an angle of a smaller cosine to the line have no part in a wall.
const LEAST_COSINE: f64 = 0.5;
/// Spaces that overlap by less are apart.
const MEETS_M: f64 = 0.1;
/// Tracks whose stations are all farther away are not looked at.
const ASIDE_M: f64 = 60.0;

/// All end walls, each with its track and station.
pub(super) fn end_walls(tracks: &[TrackCaster]) -> Vec<(usize, usize, EndWall)> {
    let mut walls = Vec::new();
    for (number, track) in tracks.iter().enumerate() {
        for station in track.borders() {
            for looking in [Direction::Up, Direction::Down] {
                let border = Border {
                    tracks,
                    number,
                    station,
                    looking,
                };
                walls.extend(border.wall().map(|wall| (number, station, wall)));
            }
        }
    }
    walls
}

/// What is beyond the begin and the end of a track.
pub(super) fn ends(tracks: &[TrackCaster], number: usize) -> [TunnelEnd; 2] {
    let last = tracks[number].stations.len().saturating_sub(1);
    [(0, Direction::Down), (last, Direction::Up)].map(|(station, looking)| {
        let border = Border {
            tracks,
            number,
            station,
            looking,
        };
        let others = border.others();
        let sections = others.iter().filter_map(|(track, k)| track.own_section(*k));
        let are_open: Vec<bool> = sections.map(|(_, section)| section.is_open()).collect();
        match (others.is_empty(), are_open.is_empty()) {
            (true, _) => TunnelEnd::Nothing,
            (false, false) if are_open.iter().all(|open| *open) => TunnelEnd::Open,
            (false, _) => TunnelEnd::Tunnel,
        }
    })
}

/// What is beyond an end of a track.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TunnelEnd {
    /// Nothing is known of it: a tunnel leads into the dark.
    Nothing,
    /// Other tracks in the open only.
    Open,
    /// Other tracks, one of them at least in a tunnel.
    Tunnel,
}

/// One side of a place at which a cross-section of a track ends.
struct Border<'a> {
    tracks: &'a [TrackCaster],
    number: usize,
    station: usize,
    looking: Direction,
}

impl Border<'_> {
    fn wall(&self) -> Option<EndWall> {
        let track = &self.tracks[self.number];
        let [here, beyond] = self.segments();
        let (range, section) = track.own_section(here?)?;
        let next = beyond.and_then(|segment| track.own_section(segment));
        let others = self.others();
        let sections = || {
            let others = others.iter().filter_map(|(track, k)| track.own_section(*k));
            next.into_iter().chain(others).map(|(_, section)| section)
        };
        sections().next()?;
        let top_m = top_m(section, sections());
        let own = next.map(|(_, section)| free_space(section, top_m));
        let plane = track.plane(self.station);
        let others = others
            .iter()
            .filter_map(|(track, k)| track.free_space_in(*k, &plane, top_m));
        let beyond: Vec<_> = own.into_iter().chain(others).collect();
        let pieces = difference(&free_space(section, top_m), &beyond);
        let paint = WallPaint::of(range, section)
            .or_else(|| next.and_then(|(range, section)| WallPaint::of(range, section)))?;
        (!pieces.is_empty()).then(|| EndWall {
            s_m: track.stations[self.station].s_m,
            seen_looking: self.looking,
            range,
            pieces,
            paint,
        })
    }

    /// The track's segments on its side of the plane and beyond it.
    fn segments(&self) -> [Option<usize>; 2] {
        let before = self.station.checked_sub(1);
        match self.looking {
            Direction::Up => [before, Some(self.station)],
            Direction::Down => [Some(self.station), before],
        }
    }

    /// Other tracks that go on just beyond the plane with space that meets that of this one, each with its segment
    /// there.
    fn others(&self) -> Vec<(&TrackCaster, usize)> {
        let plane = self.tracks[self.number].plane(self.station);
        let ahead = Vector3::new(plane.forward.x, plane.forward.y, 0.0);
        let place = plane.origin + ahead * (BEGINS_M * self.looking.sign());
        let others = self.tracks.iter().enumerate();
        let near = others.filter(|(k, track)| {
            *k != self.number && !track.is_empty() && track.away_m(&place) < ASIDE_M
        });
        let at = near.map(|(_, track)| (track, track.segment_of(&place, None)));
        let goes_on = |track: &TrackCaster, segment: usize| {
            let chord = &track.segments[segment].chord;
            track.ahead_of(segment, &place) >= 0.0
                && track.ahead_of(segment + 1, &place) <= 0.0
                && chord.dot(&plane.forward).abs() > LEAST_COSINE
        };
        at.filter(|(track, segment)| goes_on(track, *segment) && self.meets(track, *segment))
            .collect()
    }

    /// Whether the space of another track overlaps with that of this one in the plane; where either has none of its
    /// own it does.
    fn meets(&self, other: &TrackCaster, segment: usize) -> bool {
        let track = &self.tracks[self.number];
        let own = self.segments()[0].and_then(|segment| track.own_section(segment));
        let (Some((_, own)), Some((_, section))) = (own, other.own_section(segment)) else {
            return true;
        };
        let top_m = top_m(own, std::iter::once(section));
        let Some(carried) = other.free_space_in(segment, &track.plane(self.station), top_m) else {
            return true;
        };
        let [(low, high), (other_low, other_high)] = [free_space(own, top_m), carried].map(extent);
        let overlap = high.inf(&other_high) - low.sup(&other_low);
        overlap.min() > MEETS_M
    }
}

/// The least and the largest coordinates of a polygon.
fn extent(polygon: Vec<Vector2<f64>>) -> (Vector2<f64>, Vector2<f64>) {
    let first = Vector2::repeat(f64::INFINITY);
    polygon.iter().fold((first, -first), |(low, high), corner| {
        (low.inf(corner), high.sup(corner))
    })
}

/// Where the free space of open sections ends that meet others.
fn top_m<'a>(section: &'a CrossSection, others: impl Iterator<Item = &'a CrossSection>) -> f64 {
    let highest = |section: &CrossSection| {
        let heights = section.points.iter().map(|p| p.h_m);
        let parapet_m = if section.closed { PARAPET_M } else { 0.0 };
        heights.fold(BED_M, f64::max) + parapet_m
    };
    others.map(highest).fold(highest(section), f64::max)
}

impl TrackCaster {
    /// The free space of a segment, carried along it into a plane: left and up of the plane's origin.
    fn free_space_in(
        &self,
        segment: usize,
        plane: &Plane,
        top_m: f64,
    ) -> Option<Vec<Vector2<f64>>> {
        let (_, section) = self.own_section(segment)?;
        let (
            origin,
            Segment {
                chord, left, slope, ..
            },
        ) = (self.stations[segment].origin, &self.segments[segment]);
        let along = Vector3::new(chord.x, chord.y, *slope);
        let carried = |lh: Vector2<f64>| {
            let from = origin + Vector3::new(left.x * lh.x, left.y * lh.x, lh.y);
            let past_m = plane.forward.dot(&(from - plane.origin).xy());
            let at = from - along * (past_m / plane.forward.dot(chord));
            let (l_m, h_m) = plane.across(&at);
            Vector2::new(l_m, h_m)
        };
        Some(
            free_space(section, top_m)
                .into_iter()
                .map(carried)
                .collect(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::{Alignment, PlanElement, SectionRange, Track};
    use crate::twin::geometry::TunnelCaster;
    use nalgebra::Point3;
    use std::sync::Arc;

    /// A straight track eastwards, so far to the north, in one cross-section.
    fn track([from_m, length_m]: [f64; 2], north_m: f64, section: CrossSection) -> Arc<Track> {
        let start = Point3::new(from_m, north_m, 0.0);
        let plan = [PlanElement::straight(length_m)];
        let mut track = Track::bare("t", Alignment::new(start, 0.0, &plan, &[]));
        track.sections.push(SectionRange {
            from_m: 0.0,
            to_m: length_m,
            missing_rail: None,
            section,
        });
        track.into()
    }

    fn bored() -> CrossSection {
        CrossSection::rectangular(2.5, 2.5, 4.6, None, None)
    }

    /// Fails where a tunnel beside a dead end passes for its continuation, and where a portal at a joint of tracks
    /// is none.
    #[test]
    fn what_is_beyond_an_end() {
        let own = track([0.0, 50.0], 0.0, bored());
        for (beside, expected, walls) in [
            (track([0.0, 100.0], 6.0, bored()), TunnelEnd::Nothing, 0),
            (track([0.0, 100.0], 4.5, bored()), TunnelEnd::Tunnel, 1),
            (track([50.0, 50.0], 0.0, bored()), TunnelEnd::Tunnel, 0),
            (
                track([50.0, 50.0], 0.0, CrossSection::open(20.0)),
                TunnelEnd::Open,
                0,
            ),
        ] {
            let tunnel = TunnelCaster::new(&[Arc::clone(&own), beside]);
            assert_eq!(tunnel.ends(0), [TunnelEnd::Nothing, expected]);
            assert_eq!(tunnel.end_walls(0).count(), walls, "{expected:?}");
        }
    }
}
