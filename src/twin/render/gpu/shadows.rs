//! Shadows that bodies throw, laid over the finished background.
//!
//! What is hidden of a light is defined in [`photometry`](crate::twin::render::photometry) and counted by the
//! shader, pixel by pixel. Here is found where it has to look: the tunnel's surface is taken in
//! cells, and where the ball around a cell meets the cone behind a body that a light shines on, the
//! tiles of the picture that show the cell get the number of that light and body. All other tiles
//! are left alone; a view without bodies in the light of a lamp costs nothing.
//!
//! Walls that show the blinking of a lamp are shaded as in its mean light, and what moves in the
//! exposure throws its shadow from where it is in the middle.

mod falling;
mod occluder;
mod tiles;

use super::adapter::Gpu;
use super::chunks::Chunk;
use super::detail::{CHUNK_M, ChunkKey};
use super::layout::{
    Blocker, Corner, MAX_BLOCKERS, MAX_SLABS, MAX_SOURCES, MAX_WORDS, Slab, Source, Tile,
};
use super::passes::{ViewBuffers, begin};
use super::pipeline::{Pipelines, bind};
use super::target::Target;
use super::upload::Upload;
use super::view::{Framed, single};
use crate::track::Tunnel;
use crate::twin::geometry::{Body, Shape};
use crate::twin::render::disc::disc_places;
use crate::twin::render::lamp_field::LampField;
use crate::twin::render::scene::Job;
use falling::{Around, Bodies, Cast, Light};
use nalgebra::{Point3, Vector3};
use occluder::{Cut, End};
use std::collections::BTreeMap;
use std::mem::size_of;
use std::ops::Range;
use tiles::{Cell, Eyes, Marks, TILE_PX};

/// Cells are no finer than they would be at this distance.
const NEAREST_M: f64 = 1.0;
/// Wider than any scene: a tube that holds everything.
const WIDE_M: f32 = 1e6;

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

/// What matters in a tile, in the lists: where its hidden lights begin, and its shaded ones, from `shaded`
/// on; others from `plain` on.
#[derive(Clone, Copy)]
struct List {
    shaded: u32,
    plain: u32,
    end: u32,
    /// Whether there are any bodies but capsules.
    others: bool,
}

/// Who may shade what.
struct Falling<'j> {
    lights: Vec<Light<'j>>,
    bodies: Bodies<'j>,
    casts: Vec<Cast>,
    of_light: Vec<Range<usize>>,
    eyes: Eyes,
    /// Where the camera is in the middle of the frame, and how far it goes from there.
    eye: (Point3<f64>, f64),
}

impl Shadows {
    /// Finds the shadows on the chunks in sight and on the bodies.
    pub fn fill<'c>(
        &mut self,
        framed: &Framed<'_>,
        job: &Job,
        (tunnel, field): (&Tunnel, &LampField),
        in_sight: impl Iterator<Item = (ChunkKey, &'c Chunk)>,
    ) {
        self.tiles.clear();
        if job.bodies.is_empty() {
            return;
        }
        let bodies = falling::bodies(framed, job);
        let lights = falling::lights(framed, job, field);
        let (casts, of_light) = falling::casts(&lights, &bodies);
        if casts.is_empty() {
            return;
        }
        let eyes = Eyes::of(framed, job.time);
        let falling = Falling {
            lights,
            bodies,
            casts,
            of_light,
            eye: (framed.reference(), eyes.travel_m(&framed.reference())),
            eyes,
        };
        let lens = &framed.view.camera.intrinsics;
        let numbers = 2 * falling.lights.len() + falling.casts.len();
        self.marks.reset((lens.width_px, lens.height_px), numbers);
        self.mark_tunnel(framed, &falling, tunnel, in_sight);
        self.mark_bodies(framed, &falling);
        self.list(framed, job, &falling, tunnel.ambient_lx);
        if !self.tiles.is_empty() {
            self.place(framed, &falling);
        }
    }

    fn mark_tunnel<'c>(
        &mut self,
        framed: &Framed<'_>,
        falling: &Falling<'_>,
        tunnel: &Tunnel,
        in_sight: impl Iterator<Item = (ChunkKey, &'c Chunk)>,
    ) {
        let mut casts = Vec::new();
        for (key, chunk) in in_sight {
            casts.clear();
            falling.narrow(&mut casts, None, (&chunk.origin, chunk.radius_m, None));
            if casts.is_empty() {
                continue;
            }
            Cell::of(tunnel, key.start_m(), CHUNK_M, &mut self.cells);
            let cells = std::mem::take(&mut self.cells);
            for cell in &cells {
                self.mark_cell(framed, falling, cell, &mut casts, 0);
            }
            self.cells = cells;
        }
    }

    /// Marks a cell on which may fall what is in `casts` from `first` on.
    fn mark_cell(
        &mut self,
        framed: &Framed<'_>,
        falling: &Falling<'_>,
        cell: &Cell,
        casts: &mut Vec<usize>,
        first: usize,
    ) {
        let radius_m = cell.radius_m();
        if !framed.may_see(&cell.centre, radius_m)
            || cell.turns_away(falling.eye)
            || falling.hides(&cell.centre, radius_m)
        {
            return;
        }
        let ball = (&cell.centre, radius_m, cell.normal.as_ref());
        let end = casts.len();
        falling.narrow(casts, Some(first), ball);
        if casts.len() > end {
            let away_m = (cell.centre - framed.reference()).norm().max(NEAREST_M);
            let size_px =
                2.0 * framed.view.camera.intrinsics.fx_px * cell.half_diagonal_m() / away_m;
            if size_px > f64::from(TILE_PX) {
                // What is large in the picture is looked at in quarters.
                for quarter in cell.quarters() {
                    self.mark_cell(framed, falling, &quarter, casts, end);
                }
            } else {
                falling.collect(&casts[end..], ball, &mut self.set);
                self.marks.add_cell(framed, &falling.eyes, cell, &self.set);
            }
        }
        casts.truncate(end);
    }

    fn mark_bodies(&mut self, framed: &Framed<'_>, falling: &Falling<'_>) {
        let mut casts = Vec::new();
        for of_body in falling.bodies.balls.chunk_by(|a, b| a.body == b.body) {
            let number = of_body[0].body;
            let body = falling.bodies.all[number];
            casts.clear();
            for ball in of_body {
                falling.narrow(&mut casts, None, ball.around());
            }
            casts.sort_unstable();
            casts.dedup();
            // Nothing convex shades itself.
            casts.retain(|k| falling.casts[*k].body != number);
            if casts.is_empty() {
                continue;
            }
            if let Shape::Box(half) = &body.shape {
                Cell::of_box(body, half, falling.bodies.exposed_s, &mut self.cells);
                let cells = std::mem::take(&mut self.cells);
                for cell in &cells {
                    self.mark_cell(framed, falling, cell, &mut casts, 0);
                }
                self.cells = cells;
            } else {
                for ball in of_body {
                    falling.collect(&casts, ball.around(), &mut self.set);
                    self.marks.add_body(framed, &falling.eyes, body, &self.set);
                }
            }
        }
    }

    /// Makes the tiles and their lists. What does not fit the lists is not shaded.
    fn list(&mut self, framed: &Framed<'_>, job: &Job, falling: &Falling<'_>, ambient_lx: f64) {
        self.lists.clear();
        self.known.clear();
        let lights = falling.lights.len();
        for (column, row, set) in self.marks.tiles() {
            if !(lights..lights + falling.casts.len()).any(|k| has(set, k)) {
                continue;
            }
            let list = match self.known.get(set) {
                Some(list) => *list,
                None => {
                    let list = falling.list(set, &mut self.lists);
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
    fn place(&mut self, framed: &Framed<'_>, falling: &Falling<'_>) {
        let reference = framed.reference();
        self.sources.clear();
        self.blockers.clear();
        self.slabs.clear();
        self.sources
            .extend(falling.lights.iter().map(|light| source(light, &reference)));
        for body in &falling.bodies.all {
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

impl Falling<'_> {
    /// Appends those casts, of all or of the list from `first` on, that may fall on anything in a
    /// ball.
    fn narrow(&self, casts: &mut Vec<usize>, first: Option<usize>, around: Around<'_>) {
        let (centre, radius_m, normal) = around;
        let falls = |k: usize| {
            let cast = &self.casts[k];
            let light = &self.lights[cast.light];
            light.may_light(centre, radius_m, normal) && cast.may_fall_on(light, centre, radius_m)
        };
        match first {
            None => casts.extend((0..self.casts.len()).filter(|k| falls(*k))),
            Some(first) => {
                for at in first..casts.len() {
                    if falls(casts[at]) {
                        casts.push(casts[at]);
                    }
                }
            }
        }
    }

    /// Makes the set of some casts, and of the lights on a surface in a ball: those casts that fall on it
    /// in part or in whole, the lights, and those lights that no body hides in whole.
    fn collect(&self, casts: &[usize], around: Around<'_>, set: &mut Vec<u64>) {
        let (centre, radius_m, normal) = around;
        let lights = self.lights.len();
        set.clear();
        set.resize((2 * lights + self.casts.len()).div_ceil(64), 0);
        for (k, light) in self.lights.iter().enumerate() {
            if light.may_light(centre, radius_m, normal) {
                put(set, k);
                put(set, self.open(k));
            }
        }
        let ball = End { centre, radius_m };
        for k in casts {
            let cast = &self.casts[*k];
            let light = &self.lights[cast.light];
            let disc = End {
                centre: &light.centre,
                radius_m: light.radius_m,
            };
            let cut = self.bodies.solids[cast.body].cut(ball, disc);
            if cut != Cut::None {
                put(set, lights + k);
            }
            if cut == Cut::All {
                take(set, self.open(cast.light));
            }
        }
    }

    /// The number of a light that is not hidden in whole.
    fn open(&self, light: usize) -> usize {
        self.lights.len() + self.casts.len() + light
    }

    /// Whether a body hides all that is in a ball from the camera.
    fn hides(&self, centre: &Point3<f64>, radius_m: f64) -> bool {
        let ball = End { centre, radius_m };
        let eye = End {
            centre: &self.eye.0,
            radius_m: self.eye.1,
        };
        let mut large = self.bodies.solids.iter().filter(|s| s.radius_m > radius_m);
        large.any(|solid| solid.cut(ball, eye) == Cut::All)
    }

    /// Appends the list of a set.
    fn list(&self, set: &[u64], lists: &mut Vec<u32>) -> List {
        let lights = self.lights.len();
        let (shaded, mut others) = (lists.len() as u32, false);
        let casts_in = |light: usize| {
            let casts = self.of_light[light].clone();
            casts
                .filter(|k| has(set, lights + k))
                .map(|k| &self.casts[k])
        };
        let lit = || (0..lights).filter(|k| has(set, *k));
        let is_hidden = |light: &usize| !has(set, self.open(*light));
        let is_shaded = |light: &usize| !is_hidden(light) && casts_in(*light).next().is_some();
        // Where the hidden lights begin is known when the shaded ones are there.
        lists.push(0);
        for light in lit().filter(is_shaded) {
            let first = lists.len() + 3;
            let count = casts_in(light).count();
            let capsules = casts_in(light)
                .filter(|c| c.body < self.bodies.capsules)
                .count();
            others |= count > capsules;
            lists.extend([light, first + capsules, first + count].map(|k| k as u32));
            lists.extend(casts_in(light).map(|cast| cast.body as u32));
        }
        lists[shaded as usize] = lists.len() as u32;
        lists.extend(lit().filter(is_hidden).map(|light| light as u32));
        let border = lists.len() as u32;
        let is_plain = |light: &usize| !is_hidden(light) && !is_shaded(light);
        lists.extend(lit().filter(is_plain).map(|light| light as u32));
        List {
            shaded,
            plain: border,
            end: lists.len() as u32,
            others,
        }
    }
}

fn has(set: &[u64], number: usize) -> bool {
    set[number / 64] >> (number % 64) & 1 == 1
}

fn put(set: &mut [u64], number: usize) {
    set[number / 64] |= 1 << (number % 64);
}

fn take(set: &mut [u64], number: usize) {
    set[number / 64] &= !(1 << (number % 64));
}

/// A tile's place.
fn tile(framed: &Framed<'_>, job: &Job, column: u32, row: u32) -> Tile {
    let (view, reference) = (framed.view, framed.reference());
    let (lens, shutter) = (&view.camera.intrinsics, &view.camera.shutter);
    let side = |k: u32, size: u32| [k, k + 1].map(|k| f64::from((k * TILE_PX).min(size)) - 0.5);
    let (us, vs) = (side(column, lens.width_px), side(row, lens.height_px));
    let corner = |u: f64, v: f64| {
        let at = shutter.row_mid(view.start, v);
        let eye = view.motion.pose_at(at);
        Corner {
            origin_m: single(&(eye.translation.vector - reference.coords)),
            time_s: at.since(job.time) as f32,
            ray: single(&(eye.rotation * lens.ray(u, v))),
            unused: 0.0,
        }
    };
    Tile {
        low_px: [us[0], vs[0]].map(|x| x as f32),
        high_px: [us[1], vs[1]].map(|x| x as f32),
        corners: [
            corner(us[0], vs[0]),
            corner(us[1], vs[0]),
            corner(us[0], vs[1]),
            corner(us[1], vs[1]),
        ],
        ..Tile::default()
    }
}

fn source(light: &Light<'_>, reference: &Point3<f64>) -> Source {
    // The first place on the disc tells which way the others are counted from.
    let first = disc_places(&light.centre, &light.axis, light.radius_m)[0] - light.centre;
    let aside = first * 32f64.sqrt();
    Source {
        position_m: single(&(light.centre - reference)),
        intensity_cd: light.intensity_cd as f32,
        axis: single(&light.axis),
        exponent: light.exponent as f32,
        aside_m: single(&aside),
        reach_m: light.reach_m as f32,
        up_m: single(&aside.cross(&light.axis)),
        unused: 0.0,
    }
}

fn blocker(body: &Body, reference: &Point3<f64>, slabs: &mut Vec<Slab>) -> Blocker {
    let first_slab = slabs.len() as u32;
    let out = |v: Vector3<f64>| body.world_from_body.rotation * v;
    let mut slab = |normal: Vector3<f64>, low_m: f64, high_m: f64| {
        slabs.push(Slab {
            normal: single(&out(normal)),
            low_m: low_m as f32,
            high_m: high_m as f32,
            unused: [0.0; 3],
        });
    };
    let (radius_m, axis) = match &body.shape {
        Shape::Sphere(radius) => (*radius as f32, Vector3::zeros()),
        Shape::Capsule(radius, half) => (*radius as f32, Vector3::z() * *half),
        Shape::Cylinder(radius, half) => {
            slab(Vector3::z(), -half, *half);
            (*radius as f32, Vector3::z())
        }
        Shape::Box(half) => {
            for (axis, half) in [Vector3::x(), Vector3::y(), Vector3::z()]
                .into_iter()
                .zip(half.iter())
            {
                slab(axis, -half, *half);
            }
            (WIDE_M, Vector3::zeros())
        }
        Shape::Hull(hull) => {
            for face in hull.faces() {
                slab(face.normal, -f64::from(WIDE_M), face.offset_m);
            }
            (WIDE_M, Vector3::zeros())
        }
    };
    Blocker {
        centre_m: single(&(body.world_from_body.translation.vector - reference.coords)),
        radius_m,
        velocity_mps: single(&body.velocity_mps),
        first_slab,
        axis: single(&out(axis)),
        end_slab: slabs.len() as u32,
    }
}

/// The shadows of one view on the adapter.
pub struct ShadowBuffers {
    tiles: Upload,
    lists: Upload,
    sources: Upload,
    blockers: Upload,
    slabs: Upload,
    /// Tiles with capsules only, and all.
    counts: [u32; 2],
}

impl ShadowBuffers {
    /// Empty.
    pub fn new(gpu: &Gpu) -> Self {
        let uniform = |size| Upload::new(gpu, wgpu::BufferUsages::UNIFORM, size);
        Self {
            tiles: Upload::new(gpu, wgpu::BufferUsages::STORAGE, size_of::<Tile>()),
            lists: uniform(MAX_WORDS * size_of::<u32>()),
            sources: uniform(MAX_SOURCES * size_of::<Source>()),
            blockers: uniform(MAX_BLOCKERS * size_of::<Blocker>()),
            slabs: uniform(MAX_SLABS * size_of::<Slab>()),
            counts: [0; 2],
        }
    }

    /// Takes the next job's view.
    pub fn write(&mut self, gpu: &Gpu, shadows: &Shadows) {
        self.counts = [shadows.capsule_tiles, shadows.tiles.len()].map(|n| n as u32);
        if self.counts[1] == 0 {
            return;
        }
        self.tiles.write(gpu, &shadows.tiles);
        self.lists.write(gpu, &shadows.lists);
        self.sources.write(gpu, &shadows.sources);
        self.blockers.write(gpu, &shadows.blockers);
        self.slabs.write(gpu, &shadows.slabs);
    }
}

impl ViewBuffers {
    /// Fades the background where bodies hide its light.
    pub fn draw_shadows(
        &self,
        gpu: &Gpu,
        pipelines: &Pipelines,
        encoder: &mut wgpu::CommandEncoder,
        target: &Target,
    ) {
        let shadows = &self.shadows;
        let [capsules, all] = shadows.counts;
        if all == 0 {
            return;
        }
        let resources = [
            self.view.binding(),
            wgpu::BindingResource::TextureView(&target.layers.depth),
            shadows.tiles.binding(),
            shadows.lists.binding(),
            shadows.sources.binding(),
            shadows.blockers.binding(),
            shadows.slabs.binding(),
        ];
        let mut pass = begin(encoder, &target.layers.signal, wgpu::LoadOp::Load, None);
        for (pipeline, tiles) in pipelines.shadows.iter().zip([0..capsules, capsules..all]) {
            if !tiles.is_empty() {
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &bind(&gpu.device, pipeline, &resources), &[]);
                pass.draw(0..6, tiles);
            }
        }
    }
}
