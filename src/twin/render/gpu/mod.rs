//! The renderer on a graphics adapter, off screen.
//!
//! ```no_run
//! use metrotwin::twin::render::{Renderer, gpu::GpuRenderer, sample};
//! let scene = sample::scene();
//! let job = sample::stereo_job(&scene.tunnel, 40.0, 60.0 / 3.6);
//! let mut renderer = GpuRenderer::new(scene)?;
//! renderer.submit(&job)?;
//! // ... other work ...
//! let images = renderer.collect()?;
//! images[0].save("left.png").unwrap();
//! # Ok::<(), metrotwin::twin::render::RenderError>(())
//! ```
//!
//! # How a picture is made
//!
//! 1. *Background.* Tunnel, rails and bodies are rasterised with a depth buffer. A rolling shutter
//!    exposes every row at a time of its own, so a vertex lands on the row v for which
//!    v = row(project(vertex, pose(time(v)))). The vertex shader solves this with a table of poses
//!    (Aitken's acceleration, three projections). Light of the lamps is stored at the vertices,
//!    that of headlights is added there. Where all is too dark for paint and blinking to show, a
//!    cheaper pipeline draws. What moves by pixels within the exposure is drawn at several instants.
//! 2. *Shadows.* Where bodies may hide a light, what they hide of its disc fades the picture. Then rail
//!    heads and a wet bed are drawn once more, for what they mirror ([`gloss`](super::gloss)).
//! 3. *Lamps.* The share of a pixel that a disc covers, through the lens's point spread, has a
//!    closed form along the row and is summed over a few lines across it, at each of the instants
//!    of the row's exposure; where the disc is and how bright in each comes from double precision.
//!    The glare is summed up in a texture of its own, a texel for every fourth pixel.
//! 4. *Sensor.* Glare, fixed pattern, shot and read noise, bits ([`sensor`](super::sensor)).
//!
//! World coordinates never reach the adapter: all is relative to where the camera is in mid-frame.
//!
//! # What it does not do
//!
//! The end walls where two cross-sections meet (dark). Between vertices positions run straight, so edges
//! close to a fast camera are bent by the shutter only facet by facet (0.5 m), and by the lens cell by
//! cell (0.25 px, `bend.rs`); lamps are exact. Of every 5 m of tunnel one lamp blinks, the others give
//! their mean, and on bodies all do. The tunnel ends 160 m ahead of the camera, in the air's own light; glare of a lamp under a
//! quarter of the usual read noise is not drawn. Out of focus, light of what the middle of the pupil does
//! not see is missing.

mod adapter;
mod backdrop;
mod bend;
mod chunks;
mod detail;
mod facets;
mod lamps;
pub mod layout;
mod mesh;
mod passes;
mod pipeline;
mod shadows;
mod sight;
mod smear;
mod spread;
mod target;
mod textures;
mod tunnel;
mod upload;
mod view;

pub use adapter::adapters;
pub use pipeline::shader_source;

use super::paint::Paintings;
use super::pixel_map::{MapCache, MapKey};
use super::scene::{Job, Scene};
use super::{Backend, RawImage, RenderError, Renderer};
use crate::bus::{Intrinsics, SimTime};
use crate::twin::render::lamp_field::{LampField, LampsInTime};
use adapter::Gpu;
use backdrop::{Backdrops, Key};
use chunks::{Chunks, Line};
use image::GrayImage;
use lamps::{Around, LampTable};
use layout::Pose;
use mesh::{Fineness, Mesh};
use passes::{BodyBuffers, Stock, ViewBuffers, ViewData};
use pipeline::{Develop, Pipelines};
use shadows::Shadows;
use sight::{Sight, World};
use std::collections::VecDeque;
use target::{ReadBack, Target};
use textures::Textures;
use view::Framed;

/// Draws on the preferred graphics adapter. Any number of jobs may be in flight.
pub struct GpuRenderer {
    gpu: Gpu,
    pipelines: Pipelines,
    scene: Scene,
    field: LampField,
    lamps: LampsInTime,
    chunks: Chunks,
    paintings: Paintings,
    textures: Textures,
    bodies: BodyBuffers,
    maps: MapCache<wgpu::TextureView>,
    views: Vec<Prepared>,
    targets: Vec<Target>,
    backdrops: Backdrops,
    spare: Vec<ReadBack>,
    in_flight: VecDeque<InFlight>,
    /// Of the bodies, used again for every job.
    mesh: Mesh,
}

struct InFlight {
    raw: bool,
    images: Vec<ReadBack>,
    /// Of each view's sensor.
    spare_bits: Vec<u32>,
    submission: wgpu::SubmissionIndex,
}

/// What is found out about a view before it is drawn, and its buffers, used again in every job.
struct Prepared {
    buffers: ViewBuffers,
    poses: Vec<Pose>,
    sight: Sight,
    lamps: LampTable,
    shadows: Shadows,
}

impl GpuRenderer {
    /// Opens the preferred adapter and compiles the shaders.
    pub fn new(scene: Scene) -> Result<Self, RenderError> {
        let gpu = Gpu::open()?;
        let pipelines = Pipelines::new(&gpu.device);
        gpu.check()?;
        let paintings = Paintings::of(&scene.tunnel);
        Ok(Self {
            pipelines,
            field: LampField::new(&scene.lamps).in_air(scene.air),
            lamps: LampsInTime::new(&scene.lamps),
            chunks: Chunks::default(),
            textures: Textures::new(&gpu, &paintings),
            paintings,
            scene,
            bodies: BodyBuffers::new(&gpu),
            maps: MapCache::default(),
            views: Vec::new(),
            targets: Vec::new(),
            backdrops: Backdrops::default(),
            spare: Vec::new(),
            in_flight: VecDeque::new(),
            mesh: Mesh::default(),
            gpu,
        })
    }

    /// Where a lamp has failed since the last job, what the lamps light is made anew.
    fn follow_lamps(&mut self, time: SimTime) {
        if let Some(lamps) = self.lamps.changed(time) {
            self.field = LampField::new(&lamps).in_air(self.scene.air);
            self.chunks = Chunks::default();
            self.backdrops.clear();
        }
    }

    fn upload_bodies(&mut self, job: &Job) {
        let mesh = &mut self.mesh;
        mesh.vertices.clear();
        mesh.indices.clear();
        self.bodies.ranges.clear();
        for body in &job.bodies {
            let first = mesh.indices.len() as u32;
            let fineness = Fineness::of(body, &job.views);
            mesh.add_body(body, &self.field, self.scene.tunnel.ambient_lx, fineness);
            self.bodies.ranges.push(first..mesh.indices.len() as u32);
        }
        self.bodies.write(&self.gpu, mesh);
    }

    /// Records all passes of view `k` and the way back of its image.
    fn record(&mut self, encoder: &mut wgpu::CommandEncoder, job: &Job, k: usize) -> ReadBack {
        let framed = Framed::new(&job.views[k]);
        self.upload_view(&framed, job, k);
        let target = self.target_for(&framed.view.camera.intrinsics);
        let (gpu, target) = (&self.gpu, &self.targets[target]);
        let Prepared { buffers, sight, .. } = &self.views[k];
        let stock = Stock {
            chunks: &self.chunks,
            bodies: &self.bodies,
            textures: &self.textures,
        };
        let backgrounds = [0, job.headlights.len()]
            .map(|headlights| self.pipelines.background(&gpu.device, headlights).clone());
        let pipelines = &mut self.pipelines;
        let key = Key::of(&framed, sight);
        let background = (&*pipelines, &backgrounds);
        let onto = (target, &mut self.backdrops);
        buffers.draw_background(gpu, background, encoder, onto, (sight, key), &stock);
        buffers.draw_shadows(gpu, pipelines, encoder, target);
        let gloss = &backgrounds[1].gloss;
        buffers.draw_gloss(gpu, gloss, encoder, target, (sight, &stock));
        if framed.defocus_reach_px() > 0 {
            buffers.blur(gpu, pipelines, encoder, target);
        }
        buffers.draw_lamps(gpu, pipelines, encoder, target);
        buffers.draw_glare(gpu, pipelines, encoder, target);
        let map = (self.maps).get(MapKey::new(framed.view), |map| {
            target::map_texture(gpu, &map, target.size_px)
        });
        let develop = Develop {
            raw: job.raw,
            blooming: framed.view.sensor.blooming > 0.0,
        };
        let sensor = pipelines.sensor(&gpu.device, develop);
        target.copy_signal(encoder);
        buffers.draw_sensor(gpu, sensor, encoder, (target, &map), job.raw);
        let spare = (self.spare.iter()).position(|b| b.fits(target.size_px, job.raw));
        let back = spare.map_or_else(
            || ReadBack::new(&gpu.device, target.size_px, job.raw),
            |at| self.spare.swap_remove(at),
        );
        target.copy_to(encoder, &back);
        back
    }

    /// Number of the target for pictures of a lens.
    fn target_for(&mut self, lens: &Intrinsics) -> usize {
        let size_px = (lens.width_px, lens.height_px);
        let fits = self.targets.iter().position(|t| t.size_px == size_px);
        fits.unwrap_or_else(|| {
            (self.targets).push(Target::new(&self.gpu.device, size_px));
            self.targets.len() - 1
        })
    }

    fn upload_view(&mut self, framed: &Framed<'_>, job: &Job, k: usize) {
        let (gpu, tunnel) = (&self.gpu, &self.scene.tunnel);
        while self.views.len() <= k {
            self.views.push(Prepared::new(gpu));
        }
        let view = &mut self.views[k];
        let line = Line {
            tunnel,
            wet: &self.scene.wet,
            lamps: &self.field,
            paintings: &self.paintings,
        };
        let s_m = (self.chunks).in_sight(gpu, &line, framed, view.sight.keys());
        let world = World {
            lamps: self.field.lamps(),
            air: &self.scene.air,
            paintings: &self.paintings,
        };
        let meshes = (&self.chunks, &self.bodies);
        view.sight.fill(framed, job, &world, meshes);
        let in_sight = view.sight.keys().iter();
        let in_sight = in_sight.filter_map(|key| Some((*key, self.chunks.get(*key)?)));
        (view.shadows).fill(framed, job, (tunnel, &self.field), in_sight);
        let airlight_cd_m2 = self.field.airlight_cd_m2(tunnel, s_m);
        let around = Around {
            ambient_lx: tunnel.ambient_lx,
            air: &self.scene.air,
            airlight_cd_m2,
        };
        view.lamps.fill(framed, self.field.lamps(), &around);
        let air = (self.scene.air.extinction_per_m, airlight_cd_m2);
        let mut constants = framed.constants(job, air, &mut view.poses);
        constants.mirrored = view.sight.mirrored.len() as u32;
        /// Largest number in half precision.
        const BRIGHTEST_E: f64 = 65_504.0;
        // Half of what lies beyond the end of what is drawn, as it is seen, is nearer than this.
        let beyond_m = std::f64::consts::SQRT_2 * chunks::AHEAD_M;
        let air_e = airlight_cd_m2 * framed.view.electrons_per_cd_m2();
        let data = ViewData {
            beyond_e: ((1.0 - self.scene.air.transmission(beyond_m)) * air_e).min(BRIGHTEST_E),
            constants,
            poses: &view.poses,
            sight: &view.sight,
            lamps: &view.lamps,
            shadows: &view.shadows,
        };
        view.buffers.write(gpu, &data);
    }

    fn finish_oldest(&mut self) -> Result<InFlight, RenderError> {
        let job = self
            .in_flight
            .pop_front()
            .ok_or(RenderError::NothingSubmitted)?;
        self.gpu
            .device
            .poll(wgpu::PollType::Wait {
                submission_index: Some(job.submission.clone()),
                timeout: None,
            })
            .map_err(|e| RenderError::Device(e.to_string()))?;
        self.gpu.check()?;
        Ok(job)
    }
}

impl Prepared {
    fn new(gpu: &Gpu) -> Self {
        Self {
            buffers: ViewBuffers::new(gpu),
            poses: Vec::new(),
            sight: Sight::default(),
            lamps: LampTable::default(),
            shadows: Shadows::default(),
        }
    }
}

impl Renderer for GpuRenderer {
    fn backend(&self) -> Backend {
        self.gpu.backend.clone()
    }

    fn set_scene(&mut self, scene: Scene) {
        if self.scene.tunnel.sections != scene.tunnel.sections {
            self.paintings = Paintings::of(&scene.tunnel);
            self.textures = Textures::new(&self.gpu, &self.paintings);
        }
        self.field = LampField::new(&scene.lamps).in_air(scene.air);
        self.lamps = LampsInTime::new(&scene.lamps);
        self.chunks = Chunks::default();
        self.backdrops.clear();
        self.views.clear();
        self.in_flight.clear();
        self.scene = scene;
    }

    fn submit(&mut self, job: &Job) -> Result<(), RenderError> {
        self.follow_lamps(job.time);
        self.chunks.next_job();
        self.upload_bodies(job);
        let mut encoder = self
            .gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let images: Vec<_> = (0..job.views.len())
            .map(|k| self.record(&mut encoder, job, k))
            .collect();
        let submission = self.gpu.queue.submit([encoder.finish()]);
        for image in &images {
            image.request();
        }
        let spare_bits = job.views.iter().map(|v| v.sensor.spare_bits());
        self.in_flight.push_back(InFlight {
            raw: job.raw,
            images,
            spare_bits: spare_bits.collect(),
            submission,
        });
        self.gpu.check()
    }

    fn collect(&mut self) -> Result<Vec<GrayImage>, RenderError> {
        let job = self.finish_oldest()?;
        let images = job.images.iter().zip(&job.spare_bits);
        let images = images.map(|(back, spare)| back.image(*spare)).collect();
        self.spare.extend(job.images);
        images
    }

    fn collect_raw(&mut self) -> Result<Vec<RawImage>, RenderError> {
        if self.in_flight.front().is_some_and(|job| !job.raw) {
            return Err(RenderError::NotRaw);
        }
        let job = self.finish_oldest()?;
        let images = job.images.iter().map(ReadBack::raw_image).collect();
        self.spare.extend(job.images);
        images
    }
}
