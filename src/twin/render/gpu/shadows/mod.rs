//! Shadows that bodies throw, laid over the finished background.
//!
//! What is hidden of a light is defined in [`photometry`](crate::twin::render::photometry) and
//! counted by the shader, pixel by pixel. Here is found where it has to look: the tunnel's surface is taken in
//! cells, and where the ball around a cell meets the cone behind a body that a light shines on, the
//! tiles of the picture that show the cell get the number of that light and body. All other tiles
//! are left alone; a view without bodies in the light of a lamp costs nothing.
//!
//! Walls that show the blinking of a lamp are shaded as in its mean light, and what moves in the
//! exposure throws its shadow from where it is in the middle.

mod candidates;
mod casts;
mod occluder;
mod region;
mod shader_data;
mod tiles;

use super::adapter::Gpu;
use super::chunks::Chunk;
use super::detail::CHUNK_M;
use super::layout::{
    Blocker, MAX_BLOCKERS, MAX_SLABS, MAX_SOURCES, MAX_WORDS, ShadowSource, Slab, Tile,
};
use super::upload::Upload;
use super::view::Framed;
use crate::track::Tunnel;
use crate::twin::geometry::Shape;
use crate::twin::render::lit_scene::LitScene;
use crate::twin::render::scene::Job;
use candidates::{Candidates, TileLists, has};
use casts::Ball;
use region::Region;
use shader_data::{blocker, source, tile};
use std::collections::BTreeMap;
use std::sync::Arc;
use tiles::{Marks, SurfaceCell, TILE_PX};

/// Cells are no finer than they would be at this distance.
const NEAREST_M: f64 = 1.0;

/// The shadows in a view.
pub struct ViewShadows {
    pub tiles: Upload<Tile>,
    /// So many of them have capsules only; they come first.
    pub capsule_tiles: usize,
    pub lists: Upload<u32>,
    pub sources: Upload<ShadowSource>,
    pub blockers: Upload<Blocker>,
    pub slabs: Upload<Slab>,
}

/// Finds what tiles show.
struct Marker<'a> {
    framed: &'a Framed<'a>,
    candidates: &'a Candidates<'a>,
    marks: Marks,
    /// A stack of lists of casts, each narrowed from the one under it.
    casts: Vec<usize>,
    set: Vec<u64>,
}

impl Marker<'_> {
    /// Puts the casts that may fall on anything in a region on top of the stack, out of those from
    /// `first` on.
    fn narrow(&mut self, first: usize, region: Region<'_>) {
        for at in first..self.casts.len() {
            if self.candidates.may_fall_on(self.casts[at], region) {
                self.casts.push(self.casts[at]);
            }
        }
    }

    /// Begins the stack with all casts.
    fn take_all(&mut self) -> usize {
        self.casts.clear();
        self.casts.extend(0..self.candidates.casts.len());
        self.casts.len()
    }

    fn mark_tunnel(&mut self, tunnel: &Tunnel, in_sight: &[Arc<Chunk>]) {
        for chunk in in_sight {
            let first = self.take_all();
            self.narrow(0, Region::around(&chunk.origin, chunk.radius_m));
            if self.casts.len() > first {
                for cell in SurfaceCell::of(tunnel, chunk.key.start_m(), CHUNK_M) {
                    self.mark_cell(&cell, first);
                }
            }
        }
    }

    /// Marks a cell on which may fall what is in `casts` from `first` on.
    fn mark_cell(&mut self, cell: &SurfaceCell, first: usize) {
        let (framed, candidates) = (self.framed, self.candidates);
        let region = cell.region();
        if !framed.may_see(&cell.centre, region.radius_m)
            || cell.turns_away(candidates.eye)
            || candidates.hides(region)
        {
            return;
        }
        let end = self.casts.len();
        self.narrow(first, region);
        if self.casts.len() > end {
            let away_m = (cell.centre - framed.reference()).norm().max(NEAREST_M);
            let f_px = framed.view.camera.intrinsics.fx_px;
            let size_px = 2.0 * f_px * cell.half_diagonal_m() / away_m;
            if size_px > f64::from(TILE_PX) {
                // What is large in the picture is looked at in quarters.
                for quarter in cell.quarters() {
                    self.mark_cell(&quarter, end);
                }
            } else {
                candidates.collect(&self.casts[end..], region, &mut self.set);
                (self.marks).add_cell(framed, &candidates.eyes, cell, &self.set);
            }
        }
        self.casts.truncate(end);
    }

    fn mark_bodies(&mut self) {
        let (framed, candidates) = (self.framed, self.candidates);
        for of_body in candidates.bodies.balls.chunk_by(|a, b| a.body == b.body) {
            let number = of_body[0].body;
            let body = candidates.bodies.all[number];
            // Nothing convex shades itself.
            let falls = |k: &usize| {
                let mut regions = of_body.iter().map(Ball::region);
                candidates.casts[*k].body != number
                    && regions.any(|region| candidates.may_fall_on(*k, region))
            };
            self.casts.clear();
            (self.casts).extend((0..candidates.casts.len()).filter(falls));
            if self.casts.is_empty() {
                continue;
            }
            if let Shape::Box(half) = &body.shape {
                for cell in SurfaceCell::of_box(body, half, candidates.bodies.exposed_s) {
                    self.mark_cell(&cell, 0);
                }
            } else {
                for ball in of_body {
                    candidates.collect(&self.casts, ball.region(), &mut self.set);
                    (self.marks).add_body(framed, &candidates.eyes, body, &self.set);
                }
            }
        }
    }
}

impl ViewShadows {
    /// None.
    pub fn new(gpu: &Gpu) -> Self {
        let uniform = wgpu::BufferUsages::UNIFORM;
        Self {
            tiles: Upload::storage(gpu),
            capsule_tiles: 0,
            lists: Upload::new(gpu, uniform, MAX_WORDS),
            sources: Upload::new(gpu, uniform, MAX_SOURCES),
            blockers: Upload::new(gpu, uniform, MAX_BLOCKERS),
            slabs: Upload::new(gpu, uniform, MAX_SLABS),
        }
    }

    /// Finds the shadows on the chunks in sight and on the bodies, and sends them.
    pub fn fill(
        &mut self,
        gpu: &Gpu,
        framed: &Framed<'_>,
        job: &Job,
        scene: &LitScene,
        in_sight: &[Arc<Chunk>],
    ) {
        self.tiles.items.clear();
        self.capsule_tiles = 0;
        if job.bodies.is_empty() {
            return;
        }
        let Some(candidates) = Candidates::of(framed, job, &scene.lamps) else {
            return;
        };
        let lens = &framed.view.camera.intrinsics;
        let numbers = 2 * candidates.lights.len() + candidates.casts.len();
        let mut marker = Marker {
            framed,
            candidates: &candidates,
            marks: Marks::new((lens.width_px, lens.height_px), numbers),
            casts: Vec::new(),
            set: Vec::new(),
        };
        marker.mark_tunnel(&scene.tunnel, in_sight);
        marker.mark_bodies();
        self.list(&marker, job, scene.tunnel.ambient_lx);
        self.place(framed, &candidates);
        self.tiles.send(gpu);
        self.lists.send(gpu);
        self.sources.send(gpu);
        self.blockers.send(gpu);
        self.slabs.send(gpu);
    }

    /// Makes the tiles and their lists. What does not fit the lists is not shaded.
    fn list(&mut self, marker: &Marker<'_>, job: &Job, ambient_lx: f64) {
        let candidates = marker.candidates;
        self.lists.items.clear();
        let mut known: BTreeMap<&[u64], TileLists> = BTreeMap::new();
        let mut with_others = Vec::new();
        let lights = candidates.lights.len();
        for (column, row, set) in marker.marks.tiles() {
            if !(lights..lights + candidates.casts.len()).any(|k| has(set, k)) {
                continue;
            }
            let make = || candidates.list(set, &mut self.lists.items);
            let list = known.entry(set).or_insert_with(make);
            if list.end as usize > MAX_WORDS {
                continue;
            }
            let tiles = if list.others {
                &mut with_others
            } else {
                &mut self.tiles.items
            };
            tiles.push(Tile {
                shaded: list.shaded,
                plain: list.plain,
                end: list.end,
                ambient_lx: ambient_lx as f32,
                ..tile(marker.framed, job, column, row)
            });
        }
        self.lists.items.truncate(MAX_WORDS);
        self.capsule_tiles = self.tiles.items.len();
        self.tiles.items.append(&mut with_others);
    }

    /// Lights and bodies for the shader.
    fn place(&mut self, framed: &Framed<'_>, candidates: &Candidates<'_>) {
        let reference = framed.reference();
        self.sources.items.clear();
        self.blockers.items.clear();
        self.slabs.items.clear();
        self.sources.items.extend(
            candidates
                .lights
                .iter()
                .map(|light| source(light, &reference)),
        );
        for (body, occluder) in candidates.bodies.all.iter().zip(&candidates.bodies.solids) {
            let mut made = blocker(body, occluder, &reference, &mut self.slabs.items);
            if self.slabs.items.len() > MAX_SLABS {
                self.slabs.items.truncate(made.first_slab as usize);
                // Nothing is inside of it.
                made = Blocker::default();
            }
            self.blockers.items.push(made);
        }
    }
}
