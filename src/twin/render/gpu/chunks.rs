//! Chunks of the tunnel on the adapter: meshed when first seen, dropped when long unseen.

use super::adapter::Gpu;
use super::bend::Bend;
use super::detail::{CHUNK_M, ChunkKey, Detail};
use super::layout::Vertex;
use super::tunnel::{ChunkMesh, ChunkSide, chunk_mesh};
use super::view::Framed;
use crate::track::Track;
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
/// Steps of the search for a camera far from where one was last.
const SEARCH_STEP_M: f64 = 20.0;
/// Farther from the line than this the chainage found is not believed.
const NEAR_LINE_M: f64 = 30.0;

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
    /// The camera's chainage.
    pub s_m: f64,
    /// Near ones first.
    pub chunks: Vec<Arc<Chunk>>,
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
    last_seen_s_m: f64,
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
        let track = &scene.track;
        let eye = framed.reference();
        let s_m = self.locate(track, &eye);
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
        let moves = !framed.rests();
        let place = track.alignment.track_from_world(&eye, s_m);
        let bend = Bend::of(&framed.view.camera.intrinsics, &place);
        let mut chunks = Vec::new();
        for index in first..=last {
            let from_m = index as f64 * CHUNK_M;
            let away_m = (from_m - s_m).max(s_m - from_m - CHUNK_M).max(0.0);
            let key = ChunkKey {
                index,
                detail: Detail::at(away_m, moves || bend.is_some()),
                bend,
            };
            let make = || (Arc::new(upload(gpu, scene, key)), self.job);
            let (chunk, near_in) = self.made.entry(key).or_insert_with(make);
            // Kept whether it is in the picture or beside it: the next view may turn there.
            *near_in = self.job;
            if framed.may_see(&chunk.origin, chunk.radius_m) {
                chunks.push(Arc::clone(chunk));
            }
        }
        let away_m = |chunk: &Chunk| (chunk.key.start_m() + 0.5 * CHUNK_M - s_m).abs();
        chunks.sort_by(|a, b| f64::total_cmp(&away_m(a), &away_m(b)));
        InSight { s_m, chunks }
    }

    /// Chainage of a camera: by Newton's method from where the last one was, else by search.
    fn locate(&mut self, track: &Track, eye: &Point3<f64>) -> f64 {
        let on_line = |s_m: f64| {
            let t = track.alignment.track_from_world(eye, s_m);
            (t.l_m.abs() < NEAR_LINE_M && (t.s_m - s_m).abs() < 4.0 * SEARCH_STEP_M)
                .then_some(t.s_m)
        };
        let s_m = on_line(self.last_seen_s_m).unwrap_or_else(|| {
            let near = nearest_station(track, eye);
            on_line(near).unwrap_or(near)
        });
        self.last_seen_s_m = s_m;
        s_m
    }
}

fn nearest_station(track: &Track, eye: &Point3<f64>) -> f64 {
    let from_m = track.sections.first().map_or(0.0, |r| r.from_m);
    let to_m = track.sections.last().map_or(0.0, |r| r.to_m);
    let steps = ((to_m - from_m) / SEARCH_STEP_M).ceil().clamp(1.0, 1e5) as u32;
    (0..=steps)
        .map(|k| from_m + (to_m - from_m) * f64::from(k) / f64::from(steps))
        .map(|s_m| ((track.alignment.at(s_m).origin - eye).norm(), s_m))
        .min_by(|a, b| f64::total_cmp(&a.0, &b.0))
        .map_or(from_m, |(_, s_m)| s_m)
}

fn upload(gpu: &Gpu, scene: &LitScene, key: ChunkKey) -> Chunk {
    let ChunkMesh {
        origin,
        mesh,
        lamp,
        parts,
    } = chunk_mesh(scene, key);
    let heading_rad = scene.track.alignment.at(key.start_m()).heading_rad;
    let (sin, cos) = heading_rad.sin_cos();
    let place = |v: &Vertex| origin + Vector3::from(v.position_m).cast();
    Chunk {
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
        along: Vector3::new(cos, sin, 0.0),
        crossed: is_crossed(scene, key.start_m()),
    }
}

/// See [`Chunk::crossed`].
fn is_crossed(scene: &LitScene, from_m: f64) -> bool {
    let to_m = from_m + CHUNK_M;
    let borders = scene.track.sections.iter().flat_map(|r| [r.from_m, r.to_m]);
    let ends = |m: f64| scene.wet.at(m - BESIDE_M) != scene.wet.at(m + BESIDE_M);
    borders.into_iter().any(|m| (from_m..=to_m).contains(&m)) || ends(from_m) || ends(to_m)
}
