//! Shadows that bodies throw, laid over the finished background.
//!
//! What is hidden of a light is defined in [`photometry`](crate::twin::render::photometry) and
//! counted by the shader, pixel by pixel. Here is found where it has to look: the tunnel's surface
//! is taken in cells, and where the ball around a cell meets the cone behind a body that a light
//! shines on, the tiles of the picture that show the cell get the number of that light and body.
//! All other tiles are left alone; a view without bodies in the light of a lamp costs nothing.
//!
//! Walls that show the blinking of a lamp are shaded as in its mean light, and what moves in the
//! exposure throws its shadow from where it is in the middle.

mod candidates;
mod casts;
mod occluder;
mod shader_data;

use super::chunks::Chunk;
use super::detail::CHUNK_M;
use super::layout::{Blocker, MAX_SLABS, MAX_WORDS, ShadowSource, Slab, Tile};
use super::rectangle::Rectangle;
use super::region::Region;
use super::surface::SurfaceCell;
use super::tiles::{Marks, TILE_PX, TileBounds, TileGrid};
use super::view::Framed;
use crate::track::Track;
use crate::twin::geometry::Shape;
use crate::twin::render::daylight::AmbientLight;
use crate::twin::render::lit_scene::{BODIES_TRACK, LitScene};
use crate::twin::render::scene::Job;
use candidates::{Candidates, TileLists, has};
use nalgebra::{Point3, Vector3};
use shader_data::{blocker, source, tile};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Cells are no finer than they would be at this distance.
const NEAREST_M: f64 = 1.0;

/// The shadows in a view.
#[derive(Default)]
pub struct ViewShadows {
    pub tiles: Vec<Tile>,
    /// So many of them have capsules only; they come first.
    pub capsule_tiles: usize,
    pub lists: Vec<u32>,
    pub sources: Vec<ShadowSource>,
    pub blockers: Vec<Blocker>,
    pub slabs: Vec<Slab>,
}

/// Finds what tiles show.
struct Marker<'a> {
    framed: &'a Framed<'a>,
    candidates: &'a Candidates<'a>,
    marks: Marks,
    ambient: TileAmbient<'a>,
}

/// Ambient light in the mean over the cells that a tile may show.
struct TileAmbient<'a> {
    scene: &'a LitScene,
    grid: TileGrid,
    /// Sum and number, by tile.
    sums: Vec<(AmbientLight, u32)>,
}

impl<'a> TileAmbient<'a> {
    fn new(scene: &'a LitScene, grid: TileGrid) -> Self {
        Self {
            scene,
            grid,
            sums: vec![Default::default(); grid.count()],
        }
    }

    /// Takes a surface of a track into account that tiles may show: a place on it, and its normal.
    fn add_part(&mut self, part: &Rectangle, track: usize, p: &Point3<f64>, normal: &Vector3<f64>) {
        let light = self.scene.surroundings_on(track, p).ambient(p, normal);
        for tile in self.grid.tiles_of(part) {
            let (sum, count) = &mut self.sums[tile];
            sum.mean_lx += light.mean_lx;
            sum.upward_lx += light.upward_lx;
            *count += 1;
        }
    }

    /// By tile: in the mean over all directions, and what a normal upward adds.
    fn lx(&self) -> impl Iterator<Item = [f32; 2]> {
        self.sums.iter().map(|(sum, count)| {
            let mean = |sum_lx: f64| (sum_lx / f64::from((*count).max(1))) as f32;
            [mean(sum.mean_lx), mean(sum.upward_lx)]
        })
    }
}

impl Marker<'_> {
    fn mark_tunnel(&mut self, tracks: &[Arc<Track>], in_sight: &[Arc<Chunk>]) {
        let all: Vec<usize> = (0..self.candidates.casts.len()).collect();
        for chunk in in_sight {
            let around = Region::around(chunk.origin, chunk.radius_m);
            let casts = self.candidates.falling_on(&all, &around);
            if !casts.is_empty() {
                for cell in SurfaceCell::of(
                    (chunk.key.track, &tracks[chunk.key.track]),
                    chunk.key.start_m(),
                    CHUNK_M,
                ) {
                    self.mark_cell(&cell, &casts, chunk.key.track);
                }
            }
        }
    }

    /// Marks a cell, of a track or of a body, on which some of these casts may fall.
    fn mark_cell(&mut self, cell: &SurfaceCell, casts: &[usize], track: usize) {
        let (framed, candidates) = (self.framed, self.candidates);
        let region = cell.region();
        if !framed.may_see(&cell.centre, region.radius_m)
            || cell.turns_away(candidates.eye)
            || candidates.hides(&region)
        {
            return;
        }
        let casts = candidates.falling_on(casts, &region);
        if casts.is_empty() {
            return;
        }
        let away_m = (cell.centre - framed.reference()).norm().max(NEAREST_M);
        let f_px = framed.view.camera.intrinsics.fx_px;
        let size_px = 2.0 * f_px * cell.half_diagonal_m() / away_m;
        if size_px > f64::from(TILE_PX) {
            // What is large in the picture is looked at in quarters.
            for quarter in cell.quarters() {
                self.mark_cell(&quarter, &casts, track);
            }
        } else {
            let bounds = TileBounds::of_cell(framed, &candidates.eyes, cell);
            let part = bounds.rectangle(framed.size_px());
            (self.marks).add_part(&part, &candidates.collect(&casts, &region));
            let normal = cell.normal.unwrap_or(Vector3::z());
            self.ambient.add_part(&part, track, &cell.centre, &normal);
        }
    }

    fn mark_bodies(&mut self) {
        let (framed, candidates) = (self.framed, self.candidates);
        let bodies = candidates.bodies.all.iter().zip(&candidates.bodies.balls);
        for (number, (body, balls)) in bodies.enumerate() {
            // Nothing convex shades itself.
            let falls = |k: &usize| {
                candidates.casts[*k].body != number
                    && balls.iter().any(|ball| candidates.may_fall_on(*k, ball))
            };
            let casts: Vec<_> = (0..candidates.casts.len()).filter(falls).collect();
            if casts.is_empty() {
                continue;
            }
            if let Shape::Box(half) = &body.shape {
                for cell in SurfaceCell::of_box(body, half, candidates.bodies.exposed_s) {
                    self.mark_cell(&cell, &casts, BODIES_TRACK);
                }
            } else {
                let bounds = TileBounds::of_body(framed, &candidates.eyes, body);
                let part = bounds.rectangle(framed.size_px());
                for ball in balls {
                    self.marks
                        .add_part(&part, &candidates.collect(&casts, ball));
                }
                let place = Point3::from(body.world_from_body.translation.vector);
                let towards = (framed.reference() - place).normalize();
                self.ambient.add_part(&part, BODIES_TRACK, &place, &towards);
            }
        }
    }
}

impl ViewShadows {
    /// On the chunks in sight and on the bodies.
    pub fn new(framed: &Framed<'_>, job: &Job, scene: &LitScene, in_sight: &[Arc<Chunk>]) -> Self {
        let mut shadows = Self::default();
        let Some(candidates) = Candidates::of(framed, job, &scene.lamps) else {
            return shadows;
        };
        let grid = TileGrid::new(framed.size_px());
        let numbers = 2 * candidates.lights.len() + candidates.casts.len();
        let mut marker = Marker {
            framed,
            candidates: &candidates,
            marks: Marks::new(grid, numbers),
            ambient: TileAmbient::new(scene, grid),
        };
        marker.mark_tunnel(&scene.tracks, in_sight);
        marker.mark_bodies();
        shadows.list(&marker, job);
        shadows.place(framed, &candidates);
        shadows
    }

    /// Makes the tiles and their lists. What does not fit the lists is not shaded.
    fn list(&mut self, marker: &Marker<'_>, job: &Job) {
        let candidates = marker.candidates;
        let mut known: BTreeMap<&[u64], TileLists> = BTreeMap::new();
        let mut with_others = Vec::new();
        let lights = candidates.lights.len();
        let tiles = marker.marks.tiles().zip(marker.ambient.lx());
        for ((column, row, set), ambient_lx) in tiles {
            if !(lights..lights + candidates.casts.len()).any(|k| has(set, k)) {
                continue;
            }
            let make = || candidates.list(set, &mut self.lists);
            let list = known.entry(set).or_insert_with(make);
            if list.end as usize > MAX_WORDS {
                continue;
            }
            let tiles = if list.others {
                &mut with_others
            } else {
                &mut self.tiles
            };
            tiles.push(Tile {
                shaded: list.shaded,
                plain: list.plain,
                end: list.end,
                ambient_lx,
                ..tile(marker.framed, job, column, row)
            });
        }
        self.lists.truncate(MAX_WORDS);
        self.capsule_tiles = self.tiles.len();
        self.tiles.append(&mut with_others);
    }

    /// Lights and bodies for the shader.
    fn place(&mut self, framed: &Framed<'_>, candidates: &Candidates<'_>) {
        let reference = framed.reference();
        self.sources.extend(
            candidates
                .lights
                .iter()
                .map(|light| source(light, &reference)),
        );
        for (body, occluder) in candidates.bodies.all.iter().zip(&candidates.bodies.solids) {
            let mut made = blocker(body, occluder, &reference, &mut self.slabs);
            if self.slabs.len() > MAX_SLABS {
                self.slabs.truncate(made.first_slab as usize);
                // Nothing is inside of it.
                made = Blocker::default();
            }
            self.blockers.push(made);
        }
    }
}
