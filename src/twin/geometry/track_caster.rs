//! A ray down the tunnel of one track.
//!
//! The tunnel is a chain of segments between the vertical planes across the line at its stations,
//! one a metre and where a cross-section ends. Inside a segment the surface is ruled from station to
//! station, so in the segment's own axes (x along the chord, y left, z up less the slope) it is a
//! prism over the outline. A ray is followed from segment to segment; in each it is a straight line
//! in the plane across.
//!
//! A prism leaves out two things: the cosine of half the turn between stations (1.4e-6 of the lateral
//! distance at a radius of 300 m), and the difference of slope times chord between inner and outer
//! side (0.15 mm at 30 permille and that radius). Where a cross-section ends and the next is narrower,
//! an [`EndWall`] closes what it leaves open.

use super::end_wall::{EndWall, Plane};
use super::section::SectionCaster;
use crate::track::{CrossSection, Direction, Material, Track};
use nalgebra::{Point2, Point3, Vector2, Vector3};

/// The swept tunnel of a track with its rails, ready for rays.
#[derive(Clone, Debug)]
pub(super) struct TrackCaster {
    pub(super) stations: Vec<Station>,
    pub(super) segments: Vec<Segment>,
    pub(super) sections: Vec<SectionCaster>,
    /// Each with its station.
    pub(super) end_walls: Vec<(usize, EndWall)>,
    /// Middle and radius of a circle in plan around all stations.
    around: (Point2<f64>, f64),
}

#[derive(Clone, Debug)]
pub(super) struct Station {
    pub s_m: f64,
    pub origin: Point3<f64>,
    /// Up the line in plan: the normal of the station's plane.
    pub forward: Vector2<f64>,
}

#[derive(Clone, Debug)]
pub(super) struct Segment {
    pub chord: Vector2<f64>,
    pub left: Vector2<f64>,
    /// Rise over run from station to station.
    pub slope: f64,
    pub section: Option<usize>,
}

/// What becomes of a ray that is followed down a tunnel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Followed {
    /// It meets the surface.
    Hit(TrackHit),
    /// It leaves the free space of the track where one cross-section ends, or at the end of the track.
    Left {
        /// Along the ray, in lengths of its direction.
        t: f64,
        /// Whether the cross-section that ends is open.
        open: bool,
    },
    /// It meets nothing within its reach.
    Nothing {
        /// Whether it ends in an open cross-section.
        open: bool,
    },
}

/// Where a ray met the tunnel of a track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackHit {
    /// Along the ray, in lengths of its direction.
    pub t: f64,
    /// The segment that it is in.
    pub segment: u32,
    pub(super) on: Surface,
}

/// What a ray meets in a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Surface {
    /// By its number in the cross-section.
    Edge(u16),
    /// By its number on the track.
    EndWall(u16),
}

/// Stations of the tunnel surface lie at multiples of this chainage; between them it is ruled.
pub const STATION_STEP_M: f64 = 1.0;
/// A segment begins this much early, so that rounding opens no crack between two of them.
const OVERLAP_M: f64 = 0.05;

impl TrackCaster {
    /// Sweeps the cross-sections of a track with a number along its line.
    pub(super) fn new(track: &Track, number: usize) -> Self {
        let stations: Vec<_> = station_chainages(track)
            .into_iter()
            .map(|s_m| {
                let frame = track.alignment.at(s_m);
                let (sin, cos) = frame.heading_rad.sin_cos();
                Station {
                    s_m,
                    origin: frame.origin,
                    forward: Vector2::new(cos, sin),
                }
            })
            .collect();
        let segments = stations
            .windows(2)
            .map(|pair| {
                let mid = 0.5 * (pair[0].s_m + pair[1].s_m);
                let step = pair[1].origin - pair[0].origin;
                let length = step.xy().norm();
                let chord = step.xy() / length;
                Segment {
                    chord,
                    left: Vector2::new(-chord.y, chord.x),
                    slope: step.z / length,
                    section: track
                        .sections
                        .iter()
                        .position(|r| r.from_m <= mid && mid < r.to_m),
                }
            })
            .collect();
        Self {
            around: circle_around(&stations),
            end_walls: Vec::new(),
            stations,
            segments,
            sections: track
                .sections
                .iter()
                .map(|r| SectionCaster::new(r, number))
                .collect(),
        }
    }

    /// Whether the surface at a hit lies level and may mirror: bed, or top of a rail.
    pub(super) fn is_level(&self, hit: &TrackHit) -> bool {
        let outline = self.segments[hit.segment as usize].section;
        let (Some(range), Surface::Edge(edge)) = (outline, hit.on) else {
            return false;
        };
        let edge = &self.sections[range].edges[edge as usize];
        edge.normal.y > 0.5 && matches!(edge.material, Material::Bed | Material::Rail)
    }

    /// Where a segment begins.
    pub(super) fn chainage_m(&self, segment: usize) -> f64 {
        self.stations[segment].s_m
    }

    /// The segment that a place is in: from a segment close by, or else by search for the nearest
    /// station.
    pub(super) fn segment_of(&self, p: &Point3<f64>, near: Option<usize>) -> usize {
        let mut k = near
            .unwrap_or_else(|| self.nearest(p))
            .min(self.segments.len() - 1);
        for _ in 0..self.segments.len() {
            if k > 0 && self.ahead_of(k, p) < 0.0 {
                k -= 1;
            } else if k + 1 < self.segments.len() && self.ahead_of(k + 1, p) >= 0.0 {
                k += 1;
            } else {
                break;
            }
        }
        k
    }

    fn nearest(&self, p: &Point3<f64>) -> usize {
        let away = |k: &usize| (p - self.stations[*k].origin).norm_squared();
        (0..self.stations.len())
            .min_by(|a, b| away(a).total_cmp(&away(b)))
            .unwrap_or(0)
    }

    /// Distance of a place up the line from the plane of a station.
    pub(super) fn ahead_of(&self, station: usize, p: &Point3<f64>) -> f64 {
        let s = &self.stations[station];
        s.forward.dot(&(p - s.origin).xy())
    }

    /// Follows the ray o + t d from t = `from`, where it is in a segment, up to `reach`. Rays from outside the
    /// line's ends meet nothing.
    pub(super) fn follow(
        &self,
        segment: usize,
        (o, d): (&Point3<f64>, &Vector3<f64>),
        from: f64,
        reach: f64,
    ) -> Followed {
        let begin = o + d * from;
        if segment >= self.segments.len()
            || self.ahead_of(segment, &begin) < -1e-6
            || self.ahead_of(segment + 1, &begin) > 1e-6
        {
            return Followed::Nothing { open: false };
        }
        let (d2, overlap) = (d.xy(), OVERLAP_M / d.norm());
        let (mut k, mut entry) = (segment, from);
        // Each station's plane is crossed once; the bound is for rays that are not numbers.
        for _ in 0..self.segments.len() {
            let exit_down = exit(-self.ahead_of(k, o), -self.stations[k].forward.dot(&d2));
            let exit_up = exit(
                self.ahead_of(k + 1, o),
                self.stations[k + 1].forward.dot(&d2),
            );
            let leave = exit_up.min(exit_down);
            let (o_across, d_across) = self.across(k, o, d);
            let (near, far) = ((entry - overlap).max(0.0), leave.min(reach));
            if let Some(i) = self.segments[k].section
                && let Some((t, edge)) = self.sections[i].first_hit(&o_across, &d_across, near, far)
            {
                return Followed::Hit(TrackHit {
                    t,
                    segment: k as u32,
                    on: Surface::Edge(edge),
                });
            }
            let open = self.is_open(k);
            if leave >= reach {
                return Followed::Nothing { open };
            }
            let (next, border) = match exit_up < exit_down {
                true => (k + 1, (k + 1, Direction::Up)),
                false => (k.wrapping_sub(1), (k, Direction::Down)),
            };
            if let Some(wall) = self.end_wall_at(border, &(o_across + d_across * leave)) {
                return Followed::Hit(TrackHit {
                    t: leave,
                    segment: k as u32,
                    on: Surface::EndWall(wall),
                });
            }
            let Some(beyond) = self.segments.get(next) else {
                return Followed::Left { t: leave, open };
            };
            if beyond.section != self.segments[k].section
                && let Some(i) = beyond.section
                && !self.sections[i].contains(&(o_across + d_across * leave))
            {
                return Followed::Left { t: leave, open };
            }
            (k, entry) = (next, leave);
        }
        Followed::Nothing { open: false }
    }

    /// Whether a segment lies in the open.
    fn is_open(&self, segment: usize) -> bool {
        self.own_section(segment)
            .is_some_and(|(_, section)| section.is_open())
    }

    /// The end wall at a station that a ray meets which runs along the line.
    fn end_wall_at(
        &self,
        (station, looking): (usize, Direction),
        across: &Vector2<f64>,
    ) -> Option<u16> {
        let found = self.end_walls.iter().position(|(at, wall)| {
            *at == station && wall.seen_looking == looking && wall.contains(across)
        });
        found.map(|number| number as u16)
    }

    /// Stations at which one cross-section ends, the ends of the track among them.
    pub(super) fn borders(&self) -> impl Iterator<Item = usize> + '_ {
        let section = |k: usize| self.segments.get(k).and_then(|segment| segment.section);
        (0..self.stations.len()).filter(move |k| {
            let before = k.checked_sub(1).and_then(section);
            before != section(*k)
        })
    }

    /// The plane across the line at a station.
    pub(super) fn plane(&self, station: usize) -> Plane {
        let Station {
            origin, forward, ..
        } = self.stations[station];
        Plane { origin, forward }
    }

    /// The track's own cross-section in a segment, with its number.
    pub(super) fn own_section(&self, segment: usize) -> Option<(usize, &CrossSection)> {
        let range = self.segments.get(segment)?.section?;
        let section = &self.sections[range].section;
        (!section.is_shared()).then_some((range, section))
    }

    /// The first rail or strip of bed that a ray meets on stretches whose section is that of another track.
    pub(super) fn first_in_shared(
        &self,
        (o, d): (&Point3<f64>, &Vector3<f64>),
        reach: f64,
    ) -> Option<TrackHit> {
        let (mut k, mut entry) = self.enters(o, d)?;
        for _ in 0..self.segments.len() {
            if entry >= reach {
                return None;
            }
            let d2 = d.xy();
            let exit_down = exit(-self.ahead_of(k, o), -self.stations[k].forward.dot(&d2));
            let exit_up = exit(
                self.ahead_of(k + 1, o),
                self.stations[k + 1].forward.dot(&d2),
            );
            let leave = exit_up.min(exit_down);
            if let Some(i) = self.segments[k]
                .section
                .filter(|i| self.sections[*i].is_shared())
            {
                let (o_across, d_across) = self.across(k, o, d);
                let hit = self.sections[i].first_hit(&o_across, &d_across, entry, leave.min(reach));
                if let Some((t, edge)) = hit {
                    return Some(TrackHit {
                        t,
                        segment: k as u32,
                        on: Surface::Edge(edge),
                    });
                }
            }
            let next = if exit_up < exit_down {
                k + 1
            } else {
                k.wrapping_sub(1)
            };
            if next >= self.segments.len() {
                return None;
            }
            (k, entry) = (next, leave);
        }
        None
    }

    /// Where a ray comes between the planes of the line's ends: the segment, and when.
    fn enters(&self, o: &Point3<f64>, d: &Vector3<f64>) -> Option<(usize, f64)> {
        let last = self.segments.len().checked_sub(1)?;
        let d2 = d.xy();
        let (before, after) = (self.ahead_of(0, o), self.ahead_of(last + 1, o));
        if before < 0.0 {
            let t = exit(before, self.stations[0].forward.dot(&d2));
            return t.is_finite().then_some((0, t));
        }
        if after > 0.0 {
            let t = exit(-after, -self.stations[last + 1].forward.dot(&d2));
            return t.is_finite().then_some((last, t));
        }
        Some((self.segment_of(o, None), 0.0))
    }

    /// Whether a place is in the free space of a segment, which is that of this track alone.
    pub(super) fn holds(&self, segment: usize, p: &Point3<f64>) -> bool {
        let along = self.ahead_of(segment, p) >= -1e-6 && self.ahead_of(segment + 1, p) <= 1e-6;
        let section = self.segments[segment].section.map(|i| &self.sections[i]);
        let (across, _) = self.across(segment, p, &Vector3::zeros());
        along && section.is_some_and(|section| section.covers(&across))
    }

    /// Distance in plan from the circle around its stations; negative inside of it.
    pub(super) fn away_m(&self, p: &Point3<f64>) -> f64 {
        let (middle, radius_m) = self.around;
        (p.xy() - middle).norm() - radius_m
    }

    /// Whether it has a stretch whose section is that of another track.
    pub(super) fn shares(&self) -> bool {
        self.sections.iter().any(SectionCaster::is_shared)
    }

    /// Whether it has no surface at all.
    pub(super) fn is_empty(&self) -> bool {
        self.segments.is_empty()
    }

    /// A ray in the plane across a segment's chord.
    pub(super) fn across(
        &self,
        k: usize,
        o: &Point3<f64>,
        d: &Vector3<f64>,
    ) -> (Vector2<f64>, Vector2<f64>) {
        let segment = &self.segments[k];
        let v = o - self.stations[k].origin;
        let (v2, d2) = (v.xy(), d.xy());
        (
            Vector2::new(
                segment.left.dot(&v2),
                v.z - segment.slope * segment.chord.dot(&v2),
            ),
            Vector2::new(
                segment.left.dot(&d2),
                d.z - segment.slope * segment.chord.dot(&d2),
            ),
        )
    }
}

/// A circle around all stations, about the middle of the box around them.
fn circle_around(stations: &[Station]) -> (Point2<f64>, f64) {
    let places = || stations.iter().map(|station| station.origin.xy().coords);
    let low = places().fold(Vector2::repeat(f64::MAX), |a, b| a.inf(&b));
    let high = places().fold(Vector2::repeat(f64::MIN), |a, b| a.sup(&b));
    let middle = 0.5 * (low + high);
    let radius_m = places().fold(0.0, |radius: f64, p| radius.max((p - middle).norm()));
    (Point2::from(middle), radius_m)
}

/// Multiples of the step, and the ends of cross-sections, which may lie between them.
fn station_chainages(track: &Track) -> Vec<f64> {
    let begin = track.sections.first().map_or(0.0, |r| r.from_m);
    let end = track.sections.last().map_or(0.0, |r| r.to_m);
    let (first, last) = (
        (begin / STATION_STEP_M).ceil() as i64,
        (end / STATION_STEP_M).floor() as i64,
    );
    let steps = (first..=last).map(|k| k as f64 * STATION_STEP_M);
    let ends = track.sections.iter().flat_map(|r| [r.from_m, r.to_m]);
    let mut all: Vec<f64> = steps.chain(ends).collect();
    all.sort_by(f64::total_cmp);
    all.dedup_by(|b, a| *b - *a < 1e-6);
    all
}

/// When a point `past` a plane and going past it at `speed` crossed or will cross it.
fn exit(past: f64, speed: f64) -> f64 {
    if speed > 0.0 {
        -past / speed
    } else {
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests;
