//! A ray in a network of tunnels: from one track's tunnel to another's where their cross-sections open into each
//! other, and over the rails of tracks that share a cross-section.

use super::borders::{TunnelEnd, end_walls, ends};
use super::end_wall::EndWall;
use super::track_caster::{Followed, TrackCaster, TrackHit};
use super::track_surface::SurfacePoint;
use crate::track::Track;
use nalgebra::{Point3, Vector3};
use std::sync::Arc;

/// All tracks with their tunnels, ready for rays.
#[derive(Clone, Debug)]
pub struct TunnelCaster {
    pub(super) tracks: Vec<TrackCaster>,
}

/// Where a ray begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayStart {
    /// By number.
    pub track: usize,
    segment: usize,
}

/// Where a ray met the tunnel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TunnelHit {
    /// Along the ray, in lengths of its direction.
    pub t: f64,
    /// The track whose tunnel it is.
    pub track: usize,
    hit: TrackHit,
}

/// What is seen along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sight {
    /// A tunnel's surface.
    Surface(TunnelHit),
    /// No surface within reach, over a track in the open.
    Open,
    /// No surface within reach, in a tunnel.
    Dark,
}

impl Sight {
    fn beyond(open: bool) -> Self {
        match open {
            true => Self::Open,
            false => Self::Dark,
        }
    }
}

/// Rails farther beside a ray's begin are not looked for.
const RAILS_M: f64 = 250.0;
/// A ray passes from track to track no more often.
const MOST_TRACKS: usize = 32;
/// So far beyond where a ray has left one track it is looked for on others.
const BEYOND_M: f64 = 1e-3;

impl TunnelCaster {
    /// Sweeps the cross-sections of all tracks along their lines.
    pub fn new(tracks: &[Arc<Track>]) -> Self {
        let mut tracks: Vec<_> = (tracks.iter().enumerate())
            .map(|(number, track)| TrackCaster::new(track, number))
            .collect();
        for (track, station, wall) in end_walls(&tracks) {
            tracks[track].end_walls.push((station, wall));
        }
        Self { tracks }
    }

    /// The walls across the line where cross-sections of a track end.
    pub fn end_walls(&self, track: usize) -> impl Iterator<Item = &EndWall> {
        self.tracks[track].end_walls.iter().map(|(_, wall)| wall)
    }

    /// What is beyond the begin and the end of a track.
    pub fn ends(&self, track: usize) -> [TunnelEnd; 2] {
        ends(&self.tracks, track)
    }

    /// Whether the surface at a hit lies level and may mirror: bed, or top of a rail.
    pub fn is_level(&self, hit: &TunnelHit) -> bool {
        self.tracks[hit.track].is_level(&hit.hit)
    }

    /// Chainage at which the segment that rays begin in begins.
    pub fn chainage_m(&self, ray_start: RayStart) -> f64 {
        self.tracks[ray_start.track].chainage_m(ray_start.segment)
    }

    /// Where rays from a place begin: on the track that others close by begin on if that is open there, else on the
    /// one that is open there, or is the nearest.
    pub fn ray_start(&self, p: &Point3<f64>, near: Option<RayStart>) -> RayStart {
        let near = near.unwrap_or_default();
        let on = |track: usize, segment: Option<usize>| RayStart {
            track,
            segment: self.tracks[track].segment_of(p, segment),
        };
        if self.tracks.len() == 1 {
            return on(0, Some(near.segment).filter(|segment| *segment > 0));
        }
        let same =
            (!self.tracks[near.track].is_empty()).then(|| on(near.track, Some(near.segment)));
        if let Some(same) =
            same.filter(|ray_start| self.tracks[ray_start.track].holds(ray_start.segment, p))
        {
            return same;
        }
        if let Some(other) = self.open_at(p, usize::MAX) {
            return other;
        }
        let with_surface = (0..self.tracks.len()).filter(|k| !self.tracks[*k].is_empty());
        let away_m = |k: &usize| self.tracks[*k].away_m(p);
        let nearest = with_surface.min_by(|a, b| away_m(a).total_cmp(&away_m(b)));
        nearest.map_or(near, |k| on(k, None))
    }

    /// The track other than `without` in whose free space a place is.
    fn open_at(&self, p: &Point3<f64>, without: usize) -> Option<RayStart> {
        let others = self.tracks.iter().enumerate();
        let mut others = others.filter(|(k, track)| *k != without && !track.is_empty());
        others.find_map(|(track, caster)| {
            let segment = caster.segment_of(p, None);
            caster
                .holds(segment, p)
                .then_some(RayStart { track, segment })
        })
    }

    /// First surface that the ray o + t d meets for t up to `reach`; `ray_start` is that of o.
    pub fn cast(
        &self,
        ray_start: RayStart,
        o: &Point3<f64>,
        d: &Vector3<f64>,
        reach: f64,
    ) -> Option<TunnelHit> {
        match self.look(ray_start, o, d, reach) {
            Sight::Surface(hit) => Some(hit),
            Sight::Open | Sight::Dark => None,
        }
    }

    /// The same; without a surface, whether that is in the open.
    pub fn look(
        &self,
        ray_start: RayStart,
        o: &Point3<f64>,
        d: &Vector3<f64>,
        reach: f64,
    ) -> Sight {
        let wall = self.first_wall(ray_start, (o, d), reach);
        if self.tracks.len() == 1 {
            return wall;
        }
        let reach = match wall {
            Sight::Surface(wall) => wall.t,
            Sight::Open | Sight::Dark => reach,
        };
        let others = self.tracks.iter().enumerate();
        let others = others.filter(|(_, track)| track.shares() && track.away_m(o) < RAILS_M);
        let rails = others.filter_map(|(track, caster)| {
            let hit = caster.first_in_shared((o, d), reach)?;
            let t = hit.t;
            Some(TunnelHit { t, track, hit })
        });
        let rail = rails.min_by(|a, b| a.t.total_cmp(&b.t));
        rail.filter(|rail| rail.t < reach)
            .map_or(wall, Sight::Surface)
    }

    /// The first wall, bed or rail of a track's own section.
    fn first_wall(
        &self,
        mut ray_start: RayStart,
        (o, d): (&Point3<f64>, &Vector3<f64>),
        reach: f64,
    ) -> Sight {
        let (mut from, mut in_open) = (0.0, false);
        for _ in 0..MOST_TRACKS {
            let RayStart { track, segment } = ray_start;
            match self.tracks[track].follow(segment, (o, d), from, reach) {
                Followed::Hit(hit) => {
                    let t = hit.t;
                    return Sight::Surface(TunnelHit { t, track, hit });
                }
                Followed::Nothing { open } => return Sight::beyond(open),
                Followed::Left { t, open } => {
                    (from, in_open) = (t + BEYOND_M / d.norm(), open);
                    match self.open_at(&(o + d * from), track) {
                        Some(next) => ray_start = next,
                        None => break,
                    }
                }
            }
        }
        Sight::beyond(in_open)
    }

    /// The surface where the ray o + t d hit.
    pub fn surface_at(&self, o: &Point3<f64>, d: &Vector3<f64>, hit: &TunnelHit) -> SurfacePoint {
        SurfacePoint {
            track: hit.track,
            ..self.tracks[hit.track].surface_at(o, d, &hit.hit)
        }
    }
}
