//! Shadows that bodies throw, laid over the finished background.
//!
//! What is hidden of a light is defined in [`light`](crate::twin::render::light) and counted by the
//! shader, pixel by pixel. Here is found where it has to look: the tunnel's surface is taken in
//! cells, and where the ball around a cell meets the cone behind a body that a light shines on, the
//! tiles of the picture that show the cell get the number of that light and body. All other tiles
//! are left alone; a view without bodies in the light of a lamp costs nothing.
//!
//! Walls that show the blinking of a lamp are shaded as in its mean light, and what moves in the
//! exposure throws its shadow from where it is in the middle.

mod falling;
mod tiles;

use super::adapter::Gpu;
use super::chunks::Chunk;
use super::layout::{Blocker, Corner, Lit, Slab, Source, Tile};
use super::passes::{Upload, ViewBuffers, begin};
use super::pipeline::{Pipelines, bind};
use super::target::Target;
use super::tunnel::{CHUNK_M, ChunkKey};
use super::view::{Framed, single};
use crate::track::Tunnel;
use crate::twin::render::light::{LampField, disc_places};
use crate::twin::render::scene::{Body, Job, Shape};
use falling::{Ball, Cast, Light};
use nalgebra::{Point3, Vector3};
use std::mem::size_of;
use std::ops::Range;
use tiles::{Cell, Eyes, Marks, TILE_PX};

/// Wider than any scene: a tube that holds everything.
const WIDE_M: f32 = 1e6;

/// The shadows in a view, and the buffers to find them in.
#[derive(Default)]
pub struct Shadows {
    tiles: Vec<Tile>,
    lights: Vec<Lit>,
    sources: Vec<Source>,
    listed: Vec<u32>,
    blockers: Vec<Blocker>,
    slabs: Vec<Slab>,
    marks: Marks,
    cells: Vec<Cell>,
}

/// Who may shade what.
struct Falling<'j> {
    lights: Vec<Light>,
    bodies: Vec<&'j Body>,
    /// The first so many of them are capsules.
    capsules: usize,
    balls: Vec<Ball>,
    casts: Vec<Cast>,
    of_light: Vec<Range<usize>>,
    eyes: Eyes,
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
        let (bodies, capsules, balls) = falling::balls(framed, job);
        let lights = falling::lights(framed, job, field);
        let (casts, of_light) = falling::casts(&lights, &balls);
        if casts.is_empty() {
            return;
        }
        let falling = Falling {
            lights,
            bodies,
            capsules,
            balls,
            casts,
            of_light,
            eyes: Eyes::of(framed, job.time),
        };
        let lens = &framed.view.camera.intrinsics;
        let numbers = falling.lights.len() + falling.casts.len();
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
        let mut set = vec![0; self.marks.words()];
        for (key, chunk) in in_sight {
            let here = falling.may_fall_on(&chunk.origin, chunk.radius_m);
            if here.is_empty() {
                continue;
            }
            Cell::of(tunnel, key.start_m(), CHUNK_M, &mut self.cells);
            for cell in &self.cells {
                let radius_m = cell.radius_m();
                let ball = (&cell.centre, radius_m, cell.normal.as_ref());
                if framed.may_see(&cell.centre, radius_m, framed.slack_m())
                    && falling.collect(&here, ball, None, &mut set)
                {
                    self.marks.add_cell(framed, &falling.eyes, cell, &set);
                }
            }
        }
    }

    fn mark_bodies(&mut self, framed: &Framed<'_>, falling: &Falling<'_>) {
        let all: Vec<usize> = (0..falling.casts.len()).collect();
        let mut set = vec![0; self.marks.words()];
        for ball in &falling.balls {
            let around = (&ball.centre, ball.radius_m, None);
            if falling.collect(&all, around, Some(ball.body), &mut set) {
                let body = falling.bodies[ball.body];
                self.marks.add_body(framed, &falling.eyes, body, &set);
            }
        }
    }

    /// Makes the tiles and their lists.
    fn list(&mut self, framed: &Framed<'_>, job: &Job, falling: &Falling<'_>, ambient_lx: f64) {
        (self.lights.clear(), self.listed.clear());
        let first_cast = falling.lights.len();
        for (column, row, set) in self.marks.tiles() {
            if !(first_cast..first_cast + falling.casts.len()).any(|k| has(set, k)) {
                continue;
            }
            let first = self.lights.len() as u32;
            for (k, casts) in falling.of_light.iter().enumerate() {
                if !has(set, k) {
                    continue;
                }
                let capsules = self.listed.len() as u32;
                let cast = |k: &usize| has(set, first_cast + k);
                let bodies = casts.clone().filter(cast).map(|k| falling.casts[k].body);
                self.listed.extend(bodies.map(|body| body as u32));
                let end = self.listed.len() as u32;
                let border = (self.listed[capsules as usize..])
                    .partition_point(|body| (*body as usize) < falling.capsules);
                self.lights.push(Lit {
                    source: k as u32,
                    capsules,
                    others: capsules + border as u32,
                    end,
                });
            }
            self.tiles.push(Tile {
                first,
                end: self.lights.len() as u32,
                ambient_lx: ambient_lx as f32,
                ..tile(framed, job, column, row)
            });
        }
    }

    /// Lights and bodies for the shader.
    fn place(&mut self, framed: &Framed<'_>, falling: &Falling<'_>) {
        let reference = framed.reference();
        (
            self.sources.clear(),
            self.blockers.clear(),
            self.slabs.clear(),
        );
        self.sources
            .extend(falling.lights.iter().map(|light| source(light, &reference)));
        for body in &falling.bodies {
            let blocker = blocker(body, &reference, &mut self.slabs);
            self.blockers.push(blocker);
        }
    }
}

impl Falling<'_> {
    /// Which shadows may fall on anything in a ball.
    fn may_fall_on(&self, centre: &Point3<f64>, radius_m: f64) -> Vec<usize> {
        let casts = self.casts.iter().enumerate();
        casts
            .filter(|(_, cast)| {
                let light = &self.lights[cast.light];
                light.may_light(centre, radius_m, None) && cast.may_fall_on(light, centre, radius_m)
            })
            .map(|(k, _)| k)
            .collect()
    }

    /// Makes the set of lights, and of some casts not by body `but`, that matter on a surface in a
    /// ball; `false` where no cast does.
    fn collect(
        &self,
        casts: &[usize],
        (centre, radius_m, normal): (&Point3<f64>, f64, Option<&Vector3<f64>>),
        but: Option<usize>,
        set: &mut [u64],
    ) -> bool {
        set.fill(0);
        let mut any = false;
        for k in casts {
            let cast = &self.casts[*k];
            let light = &self.lights[cast.light];
            if Some(cast.body) != but
                && light.may_light(centre, radius_m, normal)
                && cast.may_fall_on(light, centre, radius_m)
            {
                put(set, self.lights.len() + k);
                any = true;
            }
        }
        if any {
            for (k, light) in self.lights.iter().enumerate() {
                if light.may_light(centre, radius_m, normal) {
                    put(set, k);
                }
            }
        }
        any
    }
}

fn has(set: &[u64], number: usize) -> bool {
    set[number / 64] >> (number % 64) & 1 == 1
}

fn put(set: &mut [u64], number: usize) {
    set[number / 64] |= 1 << (number % 64);
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

fn source(light: &Light, reference: &Point3<f64>) -> Source {
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
        mount_m: light.mount_m as f32,
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
    lights: Upload,
    sources: Upload,
    listed: Upload,
    blockers: Upload,
    slabs: Upload,
    count: u32,
}

impl ShadowBuffers {
    /// Empty.
    pub fn new(gpu: &Gpu) -> Self {
        let storage = |size| Upload::new(gpu, wgpu::BufferUsages::STORAGE, size);
        Self {
            tiles: storage(size_of::<Tile>()),
            lights: storage(size_of::<Lit>()),
            sources: storage(size_of::<Source>()),
            listed: storage(size_of::<u32>()),
            blockers: storage(size_of::<Blocker>()),
            slabs: storage(size_of::<Slab>()),
            count: 0,
        }
    }

    /// Takes the next job's view.
    pub fn write(&mut self, gpu: &Gpu, shadows: &Shadows) {
        self.count = shadows.tiles.len() as u32;
        if self.count == 0 {
            return;
        }
        self.tiles.write(gpu, &shadows.tiles);
        self.lights.write(gpu, &shadows.lights);
        self.sources.write(gpu, &shadows.sources);
        self.listed.write(gpu, &shadows.listed);
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
        if shadows.count == 0 {
            return;
        }
        let resources = [
            self.view.binding(),
            wgpu::BindingResource::TextureView(&target.depth),
            shadows.tiles.binding(),
            shadows.lights.binding(),
            shadows.sources.binding(),
            shadows.listed.binding(),
            shadows.blockers.binding(),
            shadows.slabs.binding(),
        ];
        let group = bind(&gpu.device, &pipelines.shadows, &resources);
        let mut pass = begin(encoder, &target.signal, wgpu::LoadOp::Load, None);
        pass.set_pipeline(&pipelines.shadows);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..6, 0..shadows.count);
    }
}
