//! A scene as renderers draw it: painted, and with its lamps as they are at a time.

use super::daylight::{Daylight, Surroundings};
use super::lamp_field::LampField;
use super::paint::Paintings;
use super::scene::Scene;
use crate::bus::SimTime;
use crate::track::{CrossSection, Track};
use crate::twin::air::Air;
use crate::twin::geometry::{EndWall, TunnelCaster, TunnelEnd};
use crate::twin::lights::LampLight;
use crate::twin::reflectance::Wet;
use nalgebra::Point3;
use std::sync::Arc;

/// In tunnels the ambient light on bodies and lamps is that of this track.
pub const BODIES_TRACK: usize = 0;

/// A scene with what is worked out of it once.
pub struct LitScene {
    /// The tracks with their cross-sections.
    pub tracks: Vec<Arc<Track>>,
    /// What there is to see through.
    pub air: Air,
    /// Where bed and rails mirror.
    pub wet: Wet,
    /// What the tunnel's surfaces look like.
    pub paintings: Paintings,
    /// Light in the open; `None` at night.
    pub daylight: Option<Daylight>,
    /// Walls across the line, by track.
    pub end_walls: Vec<Vec<EndWall>>,
    /// What is beyond the begin and the end of each track.
    pub ends: Vec<[TunnelEnd; 2]>,
    /// The lamps as they are now.
    pub lamps: LampField,
    /// With all that becomes of them.
    all_lamps: Vec<LampLight>,
    /// So many of their changes are over.
    passed: usize,
}

impl LitScene {
    /// At time 0.
    pub fn new(scene: Scene) -> Self {
        let paintings = Paintings::of(&scene.tracks);
        Self::painted(scene, paintings)
    }

    fn painted(scene: Scene, paintings: Paintings) -> Self {
        let tunnel = TunnelCaster::new(&scene.tracks);
        let numbers = 0..scene.tracks.len();
        let end_walls = numbers
            .clone()
            .map(|k| tunnel.end_walls(k).cloned().collect());
        let ends: Vec<_> = numbers.map(|k| tunnel.ends(k)).collect();
        Self {
            end_walls: end_walls.collect(),
            daylight: Daylight::of(&scene.tracks, &ends),
            ends,
            tracks: scene.tracks,
            air: scene.air,
            wet: scene.wet,
            paintings,
            lamps: LampField::new(&scene.lamps, scene.air),
            all_lamps: scene.lamps,
            passed: 0,
        }
    }

    /// Takes another scene; whether it had to be painted anew.
    pub fn replace(&mut self, scene: Scene) -> bool {
        let now = self.tracks.iter().map(|track| &track.sections);
        let anew = !now.eq(scene.tracks.iter().map(|track| &track.sections));
        let paintings = if anew {
            Paintings::of(&scene.tracks)
        } else {
            std::mem::take(&mut self.paintings)
        };
        *self = Self::painted(scene, paintings);
        anew
    }

    /// Takes the lamps as they are at a time; whether any has changed since the last call. Until one
    /// does, all that they light stays as it is: a lamp changes between two jobs, never within one.
    pub fn follow_lamps(&mut self, time: SimTime) -> bool {
        let changes = self.all_lamps.iter().flat_map(|lamp| &lamp.changes);
        let passed = changes.filter(|change| change.at <= time).count();
        let changed = passed != self.passed;
        if changed {
            self.passed = passed;
            let lamps: Vec<_> = self.all_lamps.iter().map(|lamp| lamp.at(time)).collect();
            self.lamps = LampField::new(&lamps, self.air);
        }
        changed
    }

    /// Luminance of endless air about a chainage of a track.
    pub fn airlight_cd_m2(&self, track: usize, s_m: f64) -> f64 {
        let track = &self.tracks[track];
        let place = track.alignment.at(s_m).origin;
        let ambient_lx = match self.daylight_at(&place) {
            Some(daylight) => daylight.outside().mean_lx,
            None => track.ambient_lx,
        };
        self.lamps.airlight_cd_m2(track, s_m, ambient_lx)
    }

    /// What is about a place on a track.
    pub fn surroundings_on(&self, track: usize, p: &Point3<f64>) -> Surroundings<'_> {
        let daylight = self.daylight_at(p);
        daylight.map_or_else(|| self.inside(track), Surroundings::Open)
    }

    /// What is about a surface of a cross-section of a track.
    pub fn surroundings_in(
        &self,
        (track, section): (usize, &CrossSection),
        p: &Point3<f64>,
    ) -> Surroundings<'_> {
        match &self.daylight {
            Some(daylight) if section.is_open() => Surroundings::Open(daylight),
            Some(_) if section.is_shared() => self.surroundings_on(track, p),
            _ => self.inside(track),
        }
    }

    fn inside(&self, track: usize) -> Surroundings<'_> {
        Surroundings::Tunnel {
            ambient_lx: self.tracks[track].ambient_lx,
            daylight: self.daylight.as_ref(),
        }
    }

    fn daylight_at(&self, p: &Point3<f64>) -> Option<&Daylight> {
        self.daylight
            .as_ref()
            .filter(|daylight| daylight.reaches(p))
    }
}
