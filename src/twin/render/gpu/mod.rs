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
mod background;
mod bend;
mod bodies;
mod chunks;
mod detail;
mod draw_list;
mod facets;
mod lamps;
pub mod layout;
mod mesh;
mod passes;
mod pipeline;
mod render_pass;
mod shaders;
mod shadows;
mod smear;
mod spread;
mod target;
mod textures;
mod tunnel;
mod upload;
mod view;
mod view_buffers;

pub use adapter::adapters;
pub use shaders::shader_source;

use super::cache::Cache;
use super::lit_scene::LitScene;
use super::pixel_map::{KEPT_MAPS, MapKey};
use super::scene::{Job, Scene};
use super::{Backend, RawImage, RenderError, Renderer};
use crate::bus::Intrinsics;
use adapter::Gpu;
use backdrop::{BackdropKey, Backdrops};
use background::Surfaces;
use bodies::BodyBuffers;
use chunks::Chunks;
use draw_list::DrawList;
use image::GrayImage;
use lamps::LampTable;
use layout::Pose;
use pipeline::{Develop, Pipelines};
use shadows::Shadows;
use std::collections::VecDeque;
use target::{ReadBack, Target};
use textures::Textures;
use view::Framed;
use view_buffers::{ViewBuffers, ViewData};

/// Draws on the preferred graphics adapter. Any number of jobs may be in flight.
pub struct GpuRenderer {
    gpu: Gpu,
    pipelines: Pipelines,
    scene: LitScene,
    chunks: Chunks,
    textures: Textures,
    bodies: BodyBuffers,
    maps: Cache<MapKey, wgpu::TextureView>,
    views: Vec<Prepared>,
    targets: Vec<Target>,
    backdrops: Backdrops,
    spare: Vec<ReadBack>,
    in_flight: VecDeque<InFlight>,
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
    list: DrawList,
    lamps: LampTable,
    shadows: Shadows,
}

impl GpuRenderer {
    /// Opens the preferred adapter and compiles the shaders.
    pub fn new(scene: Scene) -> Result<Self, RenderError> {
        let gpu = Gpu::open()?;
        let pipelines = Pipelines::new(&gpu.device);
        gpu.check()?;
        let scene = LitScene::new(scene);
        Ok(Self {
            pipelines,
            chunks: Chunks::default(),
            textures: Textures::new(&gpu, &scene.paintings),
            scene,
            bodies: BodyBuffers::new(&gpu),
            maps: Cache::new(KEPT_MAPS),
            views: Vec::new(),
            targets: Vec::new(),
            backdrops: Backdrops::default(),
            spare: Vec::new(),
            in_flight: VecDeque::new(),
            gpu,
        })
    }

    /// Records all passes of view `k` and the way back of its image.
    fn record(&mut self, encoder: &mut wgpu::CommandEncoder, job: &Job, k: usize) -> ReadBack {
        let framed = Framed::new(&job.views[k]);
        self.upload_view(&framed, job, k);
        let target = self.target_for(&framed.view.camera.intrinsics);
        let (gpu, target) = (&self.gpu, &self.targets[target]);
        let Prepared { buffers, list, .. } = &self.views[k];
        let surfaces = Surfaces {
            chunks: &self.chunks,
            bodies: &self.bodies,
            textures: &self.textures,
        };
        let backgrounds = [0, job.headlights.len()]
            .map(|headlights| self.pipelines.background(&gpu.device, headlights).clone());
        let pipelines = &mut self.pipelines;
        let key = BackdropKey::of(&framed, list);
        let background = (&*pipelines, &backgrounds);
        let onto = (target, &mut self.backdrops);
        buffers.draw_background(gpu, background, encoder, onto, (list, key), &surfaces);
        (buffers.shadows).draw(gpu, pipelines, encoder, target, &buffers.view);
        let gloss = &backgrounds[1].gloss;
        buffers.draw_gloss(gpu, gloss, encoder, target, (list, &surfaces));
        if framed.defocus_reach_px() > 0 {
            buffers.blur(gpu, pipelines, encoder, target);
        }
        buffers.draw_lamps(gpu, pipelines, encoder, target);
        buffers.draw_glare(gpu, pipelines, encoder, target);
        let map = (self.maps).get(MapKey::new(framed.view), |key| {
            target::map_texture(gpu, &key.make_map(), target.size_px)
        });
        let develop = Develop {
            raw: job.raw,
            blooming: framed.view.sensor.blooming > 0.0,
        };
        let sensor = pipelines.sensor(&gpu.device, develop);
        target.copy_signal(encoder);
        buffers.draw_sensor(gpu, sensor, encoder, (target, map), job.raw);
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
        let (gpu, scene) = (&self.gpu, &self.scene);
        while self.views.len() <= k {
            self.views.push(Prepared::new(gpu));
        }
        let view = &mut self.views[k];
        let s_m = (self.chunks).in_sight(gpu, scene, framed, view.list.keys());
        let meshes = (&self.chunks, &self.bodies);
        view.list.fill(framed, job, scene, meshes);
        let in_sight = view.list.keys().iter();
        let in_sight = in_sight.filter_map(|key| Some((*key, self.chunks.get(*key)?)));
        view.shadows.fill(framed, job, scene, in_sight);
        let airlight_cd_m2 = scene.airlight_cd_m2(s_m);
        view.lamps.fill(framed, scene, airlight_cd_m2);
        let air = (scene.air.extinction_per_m, airlight_cd_m2);
        let mut constants = framed.constants(job, air, &mut view.poses);
        constants.mirrored = view.list.mirrored.len() as u32;
        // Half of what lies beyond the end of what is drawn, as it is seen, is nearer than this.
        let beyond_m = std::f64::consts::SQRT_2 * chunks::AHEAD_M;
        let air_e = airlight_cd_m2 * framed.view.electrons_per_cd_m2();
        let data = ViewData {
            beyond_e: ((1.0 - scene.air.transmission(beyond_m)) * air_e).min(layout::BRIGHTEST_E),
            constants,
            poses: &view.poses,
            list: &view.list,
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
            list: DrawList::default(),
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
        if self.scene.replace(scene) {
            self.textures = Textures::new(&self.gpu, &self.scene.paintings);
        }
        self.chunks = Chunks::default();
        self.backdrops.clear();
        self.views.clear();
        self.targets.clear();
        self.spare.clear();
        self.in_flight.clear();
    }

    fn submit(&mut self, job: &Job) -> Result<(), RenderError> {
        if self.scene.follow_lamps(job.time) {
            self.chunks = Chunks::default();
            self.backdrops.clear();
        }
        self.chunks.next_job();
        let scene = &self.scene;
        (self.bodies).write(&self.gpu, job, &scene.lamps, scene.tunnel.ambient_lx);
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
