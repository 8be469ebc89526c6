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

mod buffers;
mod candidates;
mod casts;
mod occluder;
mod shader_data;
mod tiles;

pub use buffers::ShadowBuffers;

use super::chunks::Chunk;
use super::detail::{CHUNK_M, ChunkKey};
use super::layout::{Blocker, MAX_SLABS, MAX_WORDS, Slab, Source, Tile};
use super::view::Framed;
use crate::track::Tunnel;
use crate::twin::geometry::Shape;
use crate::twin::render::lit_scene::LitScene;
use crate::twin::render::scene::Job;
use candidates::{Candidates, List, has};
use shader_data::{blocker, source, tile};
use std::collections::BTreeMap;
use tiles::{Cell, Marks, TILE_PX};

/// Cells are no finer than they would be at this distance.
const NEAREST_M: f64 = 1.0;

/// The shadows in a view, and the buffers to find them in.
#[derive(Default)]
pub struct Shadows {
    tiles: Vec<Tile>,
    /// So many of them have capsules only; they come first.
    capsule_tiles: usize,
    others: Vec<Tile>,
    lists: Vec<u32>,
    known: BTreeMap<Vec<u64>, List>,
    sources: Vec<Source>,
    blockers: Vec<Blocker>,
    slabs: Vec<Slab>,
    marks: Marks,
    cells: Vec<Cell>,
    set: Vec<u64>,
}

impl Shadows {
    /// Finds the shadows on the chunks in sight and on the bodies.
    pub fn fill<'c>(
        &mut self,
        framed: &Framed<'_>,
        job: &Job,
        scene: &LitScene,
        in_sight: impl Iterator<Item = (ChunkKey, &'c Chunk)>,
    ) {
        self.tiles.clear();
        if job.bodies.is_empty() {
            return;
        }
        let Some(candidates) = Candidates::of(framed, job, &scene.lamps) else {
            return;
        };
        let lens = &framed.view.camera.intrinsics;
        let numbers = 2 * candidates.lights.len() + candidates.casts.len();
        self.marks.reset((lens.width_px, lens.height_px), numbers);
        self.mark_tunnel(framed, &candidates, &scene.tunnel, in_sight);
        self.mark_bodies(framed, &candidates);
        self.list(framed, job, &candidates, scene.tunnel.ambient_lx);
        if !self.tiles.is_empty() {
            self.place(framed, &candidates);
        }
    }

    fn mark_tunnel<'c>(
        &mut self,
        framed: &Framed<'_>,
        candidates: &Candidates<'_>,
        tunnel: &Tunnel,
        in_sight: impl Iterator<Item = (ChunkKey, &'c Chunk)>,
    ) {
        let mut casts = Vec::new();
        for (key, chunk) in in_sight {
            casts.clear();
            candidates.narrow(&mut casts, None, (&chunk.origin, chunk.radius_m, None));
            if casts.is_empty() {
                continue;
            }
            Cell::of(tunnel, key.start_m(), CHUNK_M, &mut self.cells);
            let cells = std::mem::take(&mut self.cells);
            for cell in &cells {
                self.mark_cell(framed, candidates, cell, &mut casts, 0);
            }
            self.cells = cells;
        }
    }

    /// Marks a cell on which may fall what is in `casts` from `first` on.
    fn mark_cell(
        &mut self,
        framed: &Framed<'_>,
        candidates: &Candidates<'_>,
        cell: &Cell,
        casts: &mut Vec<usize>,
        first: usize,
    ) {
        let radius_m = cell.radius_m();
        if !framed.may_see(&cell.centre, radius_m)
            || cell.turns_away(candidates.eye)
            || candidates.hides(&cell.centre, radius_m)
        {
            return;
        }
        let ball = (&cell.centre, radius_m, cell.normal.as_ref());
        let end = casts.len();
        candidates.narrow(casts, Some(first), ball);
        if casts.len() > end {
            let away_m = (cell.centre - framed.reference()).norm().max(NEAREST_M);
            let size_px =
                2.0 * framed.view.camera.intrinsics.fx_px * cell.half_diagonal_m() / away_m;
            if size_px > f64::from(TILE_PX) {
                // What is large in the picture is looked at in quarters.
                for quarter in cell.quarters() {
                    self.mark_cell(framed, candidates, &quarter, casts, end);
                }
            } else {
                candidates.collect(&casts[end..], ball, &mut self.set);
                self.marks
                    .add_cell(framed, &candidates.eyes, cell, &self.set);
            }
        }
        casts.truncate(end);
    }

    fn mark_bodies(&mut self, framed: &Framed<'_>, candidates: &Candidates<'_>) {
        let mut casts = Vec::new();
        for of_body in candidates.bodies.balls.chunk_by(|a, b| a.body == b.body) {
            let number = of_body[0].body;
            let body = candidates.bodies.all[number];
            casts.clear();
            for ball in of_body {
                candidates.narrow(&mut casts, None, ball.around());
            }
            casts.sort_unstable();
            casts.dedup();
            // Nothing convex shades itself.
            casts.retain(|k| candidates.casts[*k].body != number);
            if casts.is_empty() {
                continue;
            }
            if let Shape::Box(half) = &body.shape {
                Cell::of_box(body, half, candidates.bodies.exposed_s, &mut self.cells);
                let cells = std::mem::take(&mut self.cells);
                for cell in &cells {
                    self.mark_cell(framed, candidates, cell, &mut casts, 0);
                }
                self.cells = cells;
            } else {
                for ball in of_body {
                    candidates.collect(&casts, ball.around(), &mut self.set);
                    self.marks
                        .add_body(framed, &candidates.eyes, body, &self.set);
                }
            }
        }
    }

    /// Makes the tiles and their lists. What does not fit the lists is not shaded.
    fn list(
        &mut self,
        framed: &Framed<'_>,
        job: &Job,
        candidates: &Candidates<'_>,
        ambient_lx: f64,
    ) {
        self.lists.clear();
        self.known.clear();
        let lights = candidates.lights.len();
        for (column, row, set) in self.marks.tiles() {
            if !(lights..lights + candidates.casts.len()).any(|k| has(set, k)) {
                continue;
            }
            let list = match self.known.get(set) {
                Some(list) => *list,
                None => {
                    let list = candidates.list(set, &mut self.lists);
                    self.known.insert(set.to_vec(), list);
                    list
                }
            };
            if list.end as usize > MAX_WORDS {
                continue;
            }
            let tiles = if list.others {
                &mut self.others
            } else {
                &mut self.tiles
            };
            tiles.push(Tile {
                shaded: list.shaded,
                plain: list.plain,
                end: list.end,
                ambient_lx: ambient_lx as f32,
                ..tile(framed, job, column, row)
            });
        }
        self.lists.truncate(MAX_WORDS);
        self.capsule_tiles = self.tiles.len();
        self.tiles.append(&mut self.others);
    }

    /// Lights and bodies for the shader.
    fn place(&mut self, framed: &Framed<'_>, candidates: &Candidates<'_>) {
        let reference = framed.reference();
        self.sources.clear();
        self.blockers.clear();
        self.slabs.clear();
        self.sources.extend(
            candidates
                .lights
                .iter()
                .map(|light| source(light, &reference)),
        );
        for body in &candidates.bodies.all {
            let mut made = blocker(body, &reference, &mut self.slabs);
            if self.slabs.len() > MAX_SLABS {
                self.slabs.truncate(made.first_slab as usize);
                // Nothing is inside of it.
                made = Blocker::default();
            }
            self.blockers.push(made);
        }
    }
}
