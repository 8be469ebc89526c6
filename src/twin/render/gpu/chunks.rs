//! Chunks of the tunnel on the adapter: meshed when first seen, dropped when long unseen.

use super::adapter::Gpu;
use super::bend::Bend;
use super::detail::{CHUNK_M, ChunkKey, Detail};
use super::layout::Vertex;
use super::sky;
use super::track_search::TrackSearch;
use super::tunnel::{ChunkMesh, ChunkSide, chunk_mesh};
use super::view::Framed;
use crate::track::{SectionRange, TrackPoint};
use crate::twin::geometry::TunnelEnd;
use crate::twin::render::constants::SIGHT_M;
use crate::twin::render::lit_scene::LitScene;
use nalgebra::{Point3, Vector3};
use std::collections::BTreeMap;
use std::f32::consts::PI;
use std::sync::Arc;

/// Drawn behind a camera; before it, what is in sight.
const BEHIND_M: f64 = 20.0;
/// Jobs after which an unseen chunk is dropped.
const KEEP_JOBS: u64 = 64;

/// On one side of a border of two chunks, this far from it.
const BESIDE_M: f64 = 1e-3;

/// A mesh on the adapter.
pub struct Chunk {
    /// Which it is.
    pub key: ChunkKey,
    /// Its origin in the world.
    pub origin: Point3<f64>,
    /// Distance of the farthest vertex from the origin.
    pub radius_m: f64,
    /// Corners.
    pub vertices: wgpu::Buffer,
    /// Triangles.
    pub indices: wgpu::Buffer,
    /// The lamp whose blinking shows on its walls.
    pub lamp: Option<usize>,
    /// Ranges of indices.
    pub parts: Vec<ChunkSide>,
    /// Some of its corners.
    pub probes: Vec<Probe>,
    /// Some of the corners that mirror, in the world.
    pub glossy: Vec<Point3<f64>>,
    /// Up the track at its origin.
    pub along: Vector3<f64>,
    /// Whether there are edges across the line in it: where one cross-section ends, or wet ground.
    pub crossed: bool,
    /// Whether any of it lies in the open.
    pub open: bool,
}

/// A place of a chunk's surface, in the world.
pub struct Probe {
    pub at: Point3<f64>,
    pub normal: Vector3<f64>,
    /// The most luminance that a lux makes there, cd/m^2.
    pub reflected_per_lx: f32,
}

/// What a camera may see of the tunnel.
#[derive(Clone)]
pub struct InSight {
    /// The track that the camera is nearest to.
    pub track: usize,
    /// The camera's chainage on it.
    pub s_m: f64,
    /// Near ones first.
    pub chunks: Vec<Arc<Chunk>>,
    /// Behind them, where any lies in the open by day.
    pub sky: Option<Arc<Chunk>>,
}

/// One corner in so many is a probe.
const PROBE_EVERY: usize = 16;

/// The same of those that mirror.
const GLOSSY_EVERY: usize = 4;

/// All chunks in use.
#[derive(Default)]
pub struct Chunks {
    /// Each with the latest job in which a camera was near it.
    made: BTreeMap<ChunkKey, (Arc<Chunk>, u64)>,
    sky: Option<Arc<Chunk>>,
    /// By track.
    searches: Vec<TrackSearch>,
    job: u64,
}

impl Chunks {
    /// Begins a job; what no camera has been near for long goes.
    pub fn next_job(&mut self) {
        self.job += 1;
        let job = self.job;
        self.made
            .retain(|_, (_, near_in)| job - *near_in < KEEP_JOBS);
    }

    /// What is in sight of a camera.
    pub fn in_sight(&mut self, gpu: &Gpu, scene: &LitScene, framed: &Framed<'_>) -> InSight {
        let eye = framed.reference();
        let mut chunks = Vec::new();
        let mut nearest = (f64::INFINITY, 0, 0.0);
        if self.searches.len() != scene.tracks.len() {
            self.searches = scene.tracks.iter().map(|t| TrackSearch::new(t)).collect();
        }
        for (number, track) in scene.tracks.iter().enumerate() {
            let Some(place) = self.searches[number].place(track, &eye) else {
                continue;
            };
            let on_track_m = place.s_m.clamp(0.0, track.alignment.length_m());
            let away_m = (track.alignment.at(on_track_m).origin - eye).norm();
            if away_m < nearest.0 {
                nearest = (away_m, number, place.s_m);
            }
            for key in keys_in_sight(scene, number, &place, framed) {
                let make = || (Arc::new(Chunk::of_track(gpu, scene, key)), self.job);
                let (chunk, near_in) = self.made.entry(key).or_insert_with(make);
                // Kept whether it is in the picture or beside it: the next view may turn there.
                *near_in = self.job;
                if framed.may_see(&chunk.origin, chunk.radius_m) {
                    let middle_m = key.start_m() + 0.5 * CHUNK_M;
                    chunks.push(((middle_m - place.s_m).abs(), Arc::clone(chunk)));
                }
            }
        }
        chunks.sort_by(|a, b| f64::total_cmp(&a.0, &b.0));
        let (_, track, s_m) = nearest;
        let chunks: Vec<Arc<Chunk>> = chunks.into_iter().map(|(_, chunk)| chunk).collect();
        InSight {
            track,
            s_m,
            sky: self.sky(gpu, scene, &chunks),
            chunks,
        }
    }

    /// The sky, if any of some chunks lies in the open by day.
    fn sky(&mut self, gpu: &Gpu, scene: &LitScene, chunks: &[Arc<Chunk>]) -> Option<Arc<Chunk>> {
        let daylight = scene.daylight.as_ref()?;
        chunks.iter().find(|chunk| chunk.open)?;
        let make = || Arc::new(Chunk::new(gpu, sky::KEY, sky::sky_mesh(daylight)));
        Some(Arc::clone(self.sky.get_or_insert_with(make)))
    }
}

/// The chunks of a track that may be in sight of a camera at a place.
fn keys_in_sight(
    scene: &LitScene,
    track_number: usize,
    place: &TrackPoint,
    framed: &Framed<'_>,
) -> impl Iterator<Item = ChunkKey> {
    let (track, s_m) = (&scene.tracks[track_number], place.s_m);
    let frame = track.alignment.at(s_m);
    let ahead = framed.middle.rotation * Vector3::z();
    let (sin, cos) = frame.heading_rad.sin_cos();
    let (back_m, forth_m) = if ahead.x * cos + ahead.y * sin >= 0.0 {
        (BEHIND_M, SIGHT_M)
    } else {
        (SIGHT_M, BEHIND_M)
    };
    let first = ((s_m - back_m) / CHUNK_M).floor() as i64;
    let last = ((s_m + forth_m) / CHUNK_M).floor() as i64;
    let end = (track.alignment.length_m() / CHUNK_M).ceil() as i64;
    // Where a track ends before the camera, `place` is its end; chunks out of sight are left out.
    let eye = framed.reference();
    let beyond_m = |index: i64| (track.alignment.at(index as f64 * CHUNK_M).origin - eye).norm();
    let near = |index: &i64| beyond_m(*index).min(beyond_m(index + 1)) <= SIGHT_M;
    let (first, last) = (first.max(0), last.min(end - 1));
    let first = (first..=last).find(near).unwrap_or(end);
    let last = (first..=last).rev().find(near).unwrap_or(first - 1);
    let closed_at = |m: f64| track.section_at(m).is_some_and(|section| section.closed);
    let dark_at = move |m: f64| scene.daylight.is_some() && closed_at(m);
    let [begin_dark, end_dark] = scene.ends[track_number].map(|end| end == TunnelEnd::Nothing);
    let moves = !framed.rests();
    let bend = Bend::of(&framed.view.camera.intrinsics, place);
    (first..=last).map(move |index| {
        let from_m = index as f64 * CHUNK_M;
        let away_m = (from_m - s_m).max(s_m - from_m - CHUNK_M).max(0.0);
        ChunkKey {
            track: track_number,
            index,
            detail: Detail::at(away_m, moves || bend.is_some()),
            bend,
            dark: [
                index == first && (first > 0 || begin_dark) && dark_at(from_m),
                index == last && (last < end - 1 || end_dark) && dark_at(from_m + CHUNK_M),
            ],
        }
    })
}

impl Chunk {
    /// Of a mesh, which may be anywhere.
    fn new(gpu: &Gpu, key: ChunkKey, made: ChunkMesh) -> Self {
        let ChunkMesh {
            origin,
            mesh,
            lamp,
            parts,
        } = made;
        let place = |v: &Vertex| origin + Vector3::from(v.position_m).cast();
        Self {
            key,
            origin,
            radius_m: mesh.radius_m(),
            vertices: gpu.upload(wgpu::BufferUsages::VERTEX, &mesh.vertices, 1),
            indices: gpu.upload(wgpu::BufferUsages::INDEX, &mesh.indices, 1),
            lamp,
            parts,
            probes: (mesh.vertices.iter().step_by(PROBE_EVERY))
                .map(|v| Probe {
                    at: place(v),
                    normal: Vector3::from(v.normal).cast(),
                    // As of white.
                    reflected_per_lx: v.paint / PI,
                })
                .collect(),
            glossy: (mesh.vertices.iter())
                .filter(|v| v.gloss[0] > 0.0)
                .step_by(GLOSSY_EVERY)
                .map(place)
                .collect(),
            along: Vector3::zeros(),
            crossed: false,
            open: false,
        }
    }

    /// A part of a track.
    fn of_track(gpu: &Gpu, scene: &LitScene, key: ChunkKey) -> Self {
        let track = &scene.tracks[key.track];
        let (sin, cos) = track.alignment.at(key.start_m()).heading_rad.sin_cos();
        let to_m = key.start_m() + CHUNK_M;
        let within = |range: &&SectionRange| range.from_m < to_m && range.to_m > key.start_m();
        let mut sections = track.sections.iter().filter(within);
        Self {
            along: Vector3::new(cos, sin, 0.0),
            crossed: is_crossed(scene, key.track, key.start_m()),
            open: sections.any(|range| range.section.is_open()),
            ..Self::new(gpu, key, chunk_mesh(scene, key))
        }
    }
}

/// See [`Chunk::crossed`].
fn is_crossed(scene: &LitScene, track: usize, from_m: f64) -> bool {
    let to_m = from_m + CHUNK_M;
    let borders = scene.tracks[track]
        .sections
        .iter()
        .flat_map(|r| [r.from_m, r.to_m]);
    let ends = |m: f64| scene.wet.at(track, m - BESIDE_M) != scene.wet.at(track, m + BESIDE_M);
    borders.into_iter().any(|m| (from_m..=to_m).contains(&m)) || ends(from_m) || ends(to_m)
}
