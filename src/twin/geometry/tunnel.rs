//! A ray down the tunnel.
//!
//! The tunnel is a chain of segments between the vertical planes across the line at its stations,
//! one a metre and where a cross-section ends. Inside a segment the surface is ruled from station to
//! station, so in the segment's own axes (x along the chord, y left, z up less the slope) it is a
//! prism over the outline. A ray is followed from segment to segment; in each it is a straight line
//! in the plane across.
//!
//! A prism leaves out two things: the cosine of half the turn between stations (1.4e-6 of the lateral
//! distance at a radius of 300 m), and the difference of slope times chord between inner and outer
//! side (0.15 mm at 30 permille and that radius). Where two cross-sections meet, the step between
//! them is not drawn and stays dark.

use super::section::SectionCaster;
use crate::track::{Material, Track};
use nalgebra::{Point3, Vector2, Vector3};

/// The swept tunnel with its rails, ready for rays.
#[derive(Clone, Debug)]
pub struct TunnelCaster {
    stations: Vec<Station>,
    segments: Vec<Segment>,
    sections: Vec<SectionCaster>,
}

#[derive(Clone, Debug)]
struct Station {
    s_m: f64,
    origin: Point3<f64>,
    /// Up the line in plan: the normal of the station's plane.
    forward: Vector2<f64>,
}

#[derive(Clone, Debug)]
struct Segment {
    chord: Vector2<f64>,
    left: Vector2<f64>,
    /// Rise over run from station to station.
    slope: f64,
    section: Option<usize>,
}

/// Where a ray met the tunnel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TunnelHit {
    /// Along the ray, in lengths of its direction.
    pub t: f64,
    /// The segment that it is in.
    pub segment: u32,
    edge: u16,
}

/// The surface at a hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// In the world.
    pub position: Point3<f64>,
    /// Unit normal of the facet, towards free space.
    pub normal: Vector3<f64>,
    /// Chainage.
    pub s_m: f64,
    /// Left of the centreline.
    pub l_m: f64,
    /// Along the outline from its first point.
    pub q_m: f64,
    /// What it is made of.
    pub material: Material,
    /// Which of the tunnel's section ranges it belongs to.
    pub range: usize,
    /// How s and q grow with the position, per metre.
    pub gradients: [Vector3<f64>; 2],
}

impl SurfacePoint {
    /// Up the line.
    pub fn along(&self) -> Vector3<f64> {
        self.gradients[0]
    }
}

/// Stations of the tunnel surface lie at multiples of this chainage; between them it is ruled.
pub const STATION_STEP_M: f64 = 1.0;
/// A segment begins this much early, so that rounding opens no crack between two of them.
const OVERLAP_M: f64 = 0.05;

impl TunnelCaster {
    /// Sweeps the cross-sections of a tunnel along its line.
    pub fn new(track: &Track) -> Self {
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
            stations,
            segments,
            sections: track
                .sections
                .iter()
                .map(|r| SectionCaster::new(&r.section))
                .collect(),
        }
    }

    /// Whether the surface at a hit lies level and may mirror: bed, or top of a rail.
    pub fn is_level(&self, hit: &TunnelHit) -> bool {
        let outline = self.segments[hit.segment as usize].section;
        outline.is_some_and(|range| {
            let edge = &self.sections[range].edges[hit.edge as usize];
            edge.normal.y > 0.5 && matches!(edge.material, Material::Bed | Material::Rail)
        })
    }

    /// Where a segment begins.
    pub fn chainage_m(&self, segment: usize) -> f64 {
        self.stations[segment].s_m
    }

    /// The segment that a place is in: from a segment close by, or else by search for the nearest
    /// station.
    pub fn segment_of(&self, p: &Point3<f64>, near: Option<usize>) -> usize {
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
    fn ahead_of(&self, station: usize, p: &Point3<f64>) -> f64 {
        let s = &self.stations[station];
        s.forward.dot(&(p - s.origin).xy())
    }

    /// First surface that the ray o + t d meets for t up to `reach`; `segment` is that of o. Rays
    /// from outside the line's ends meet nothing.
    pub fn cast(
        &self,
        segment: usize,
        o: &Point3<f64>,
        d: &Vector3<f64>,
        reach: f64,
    ) -> Option<TunnelHit> {
        if segment >= self.segments.len()
            || self.ahead_of(segment, o) < -1e-6
            || self.ahead_of(segment + 1, o) > 1e-6
        {
            return None;
        }
        let (d2, overlap) = (d.xy(), OVERLAP_M / d.norm());
        let (mut k, mut entry) = (segment, 0.0f64);
        // Each station's plane is crossed once; the bound is for rays that are not numbers.
        for _ in 0..self.segments.len() {
            let exit_down = exit(-self.ahead_of(k, o), -self.stations[k].forward.dot(&d2));
            let exit_up = exit(
                self.ahead_of(k + 1, o),
                self.stations[k + 1].forward.dot(&d2),
            );
            let leave = exit_up.min(exit_down);
            let (o_across, d_across) = self.across(k, o, d);
            let (from, to) = ((entry - overlap).max(0.0), leave.min(reach));
            if let Some(i) = self.segments[k].section
                && let Some((t, edge)) = self.sections[i].first_hit(&o_across, &d_across, from, to)
            {
                return Some(TunnelHit {
                    t,
                    segment: k as u32,
                    edge,
                });
            }
            if leave >= reach {
                return None;
            }
            let next = if exit_up < exit_down {
                k + 1
            } else {
                k.wrapping_sub(1)
            };
            let beyond = self.segments.get(next)?;
            if beyond.section != self.segments[k].section
                && let Some(i) = beyond.section
                && !self.sections[i].contains(&(o_across + d_across * leave))
            {
                return None;
            }
            (k, entry) = (next, leave);
        }
        None
    }

    /// A ray in the plane across a segment's chord.
    fn across(&self, k: usize, o: &Point3<f64>, d: &Vector3<f64>) -> (Vector2<f64>, Vector2<f64>) {
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

    /// The surface where the ray o + t d hit.
    pub fn surface_at(&self, o: &Point3<f64>, d: &Vector3<f64>, hit: &TunnelHit) -> SurfacePoint {
        let k = hit.segment as usize;
        let segment = &self.segments[k];
        let (o_across, d_across) = self.across(k, o, d);
        let position = o + d * hit.t;
        let lh = o_across + d_across * hit.t;
        let (near_m, far_m) = (self.stations[k].s_m, self.stations[k + 1].s_m);
        let (past, before) = (
            self.ahead_of(k, &position),
            -self.ahead_of(k + 1, &position),
        );
        let range = segment.section.unwrap_or(0);
        let edge = &self.sections[range].edges[hit.edge as usize];
        // Across the edge and across the ruling, which climbs with the slope.
        let (n, along) = (edge.normal, -edge.normal.y * segment.slope);
        let level = segment.left * n.x + segment.chord * along;
        // How metres along the edge grow with the position: the transpose of what
        // [`Self::across`] does to directions.
        let climb = segment.slope * edge.along.y;
        let up_edge = segment.left * edge.along.x - segment.chord * climb;
        SurfacePoint {
            position,
            normal: Vector3::new(level.x, level.y, n.y).normalize(),
            s_m: near_m + (far_m - near_m) * past / (past + before),
            l_m: lh.x,
            q_m: edge.q_m + edge.along.dot(&(lh - edge.start)),
            material: edge.material,
            range,
            gradients: [
                Vector3::new(segment.chord.x, segment.chord.y, 0.0)
                    * ((far_m - near_m) / (past + before)),
                Vector3::new(up_edge.x, up_edge.y, edge.along.y),
            ],
        }
    }
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
