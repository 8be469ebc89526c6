//! The renderer on a graphics adapter, off screen.
//!
//! ```no_run
//! use metrotwin::scenario::Scenario;
//! use metrotwin::session::scene;
//! use metrotwin::twin::render::{Job, Renderer, gpu::GpuRenderer};
//!
//! let scenario = Scenario::load("scenarios/line_run.toml".as_ref(), &[])?;
//! let mut renderer = GpuRenderer::new(scene(&scenario))?;
//! // A view for each image; the plain renderer's page shows how one is made.
//! let job = Job::default();
//! renderer.submit(&job)?;
//! // ... other work ...
//! let images = renderer.collect()?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # How a picture is made
//!
//! 1. *Background.* Tunnel, rails and bodies are rasterised with a depth buffer. A rolling shutter
//!    exposes every row at a time of its own, so a vertex lands on the row v for which
//!    v = row(project(vertex, pose(time(v)))). The vertex shader solves this with a table of poses
//!    (Aitken's acceleration, three projections). Light of the lamps is stored at the vertices,
//!    that of headlights is added there. What is painted on the walls is smeared along the line as far as the
//!    camera goes in the exposure; any other motion is drawn at several instants (`smear.rs`).
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
//! # What is left out on a software adapter
//!
//! The processor is the adapter there, and draws pixels slowly. So (`areas.rs`)
//!
//! - of what a camera at rest sees of the tunnel, steady and blinking light are kept in memory, apart; a
//!   frame is steady + share * blinking, and only what differs is drawn over it: bodies, shadows, headlights'
//!   light, lamps, mirrored light;
//! - what a moving camera sees is drawn with one pixel for 4 x 4, and in full where it is brighter than 1.5 grey
//!   levels;
//! - the signal comes back in these layers and is put together and developed in vector code
//!   ([`develop`](super::develop)).
//!
//! `tests/pictures/parts.rs` holds this against [`GpuRenderer::draw_whole`], which draws all, as on hardware, and
//! keeps nothing: it fails where the mean of a block of 32 x 32 is off by more than 0.02 grey levels beyond the
//! rounding of half precision, or one pixel of 10,000 by more than a grey level.
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
mod areas;
mod back;
mod background;
mod bend;
mod bodies;
mod chunks;
mod detail;
mod draw_list;
mod facets;
mod kept;
mod lamps;
pub mod layout;
mod mesh;
mod pass_clock;
mod passes;
mod patch;
mod pieces;
mod pipeline;
mod prepared;
mod recorder;
mod rectangle;
mod region;
mod shaders;
mod shadows;
mod signal_back;
mod smear;
mod spread;
mod target;
mod texture;
mod textures;
mod tiles;
mod tunnel;
mod upload;
mod view;

pub use adapter::adapters;
pub use pass_clock::PassTime;
pub use shaders::shader_source;

use super::cache::Cache;
use super::develop::Developer;
use super::lit_scene::LitScene;
use super::pixel_map::{KEPT_MAPS, MapKey, PixelMap};
use super::scene::{Job, Scene, View};
use super::{Backend, Image, RawImage, RenderError, Renderer};
use adapter::Gpu;
use back::Back;
use background::Surfaces;
use bodies::BodyMeshes;
use chunks::Chunks;
use image::{GrayImage, Primitive};
use kept::{KeptKey, KeptTunnels, MOST_KEPT};
use pass_clock::PassClock;
use pipeline::Pipelines;
use prepared::{Extent, PreparedView};
use recorder::{Passes, Recorder};
use signal_back::SignalBack;
use std::collections::VecDeque;
use std::sync::Arc;
use target::{ReadBack, ViewTarget};
use texture::Texture;
use textures::Textures;
use view::Framed;

/// Image sizes whose targets are kept.
const KEPT_TARGETS: usize = 8;

/// Draws on the preferred graphics adapter. Any number of jobs may be in flight.
pub struct GpuRenderer {
    gpu: Gpu,
    pipelines: Pipelines,
    scene: LitScene,
    chunks: Chunks,
    textures: Textures,
    maps: Cache<MapKey, Texture>,
    maps_in_memory: Cache<MapKey, Arc<PixelMap>>,
    targets: Cache<(u32, u32), ViewTarget>,
    kept: KeptTunnels,
    spare: Vec<ReadBack>,
    /// Buffers that signals came back in.
    free: Vec<wgpu::Buffer>,
    in_flight: VecDeque<InFlight>,
    clock: Option<PassClock>,
    /// See [`GpuRenderer::draw_whole`].
    whole: bool,
}

struct InFlight {
    views: Vec<Back>,
    /// Of each view's sensor.
    spare_bits: Vec<u32>,
    submission: wgpu::SubmissionIndex,
}

impl GpuRenderer {
    /// Opens the preferred adapter.
    pub fn new(scene: Scene) -> Result<Self, RenderError> {
        let gpu = Gpu::open()?;
        let mut scene = LitScene::new(scene);
        let textures = Textures::new(&gpu, &scene.paintings);
        scene.paintings.forget_texels();
        Ok(Self {
            pipelines: Pipelines::default(),
            chunks: Chunks::default(),
            textures,
            scene,
            maps: Cache::new(KEPT_MAPS),
            maps_in_memory: Cache::new(KEPT_MAPS),
            targets: Cache::new(KEPT_TARGETS),
            kept: Cache::new(MOST_KEPT),
            spare: Vec::new(),
            free: Vec::new(),
            in_flight: VecDeque::new(),
            clock: None,
            whole: !gpu.is_software(),
            gpu,
        })
    }

    /// From now on one job at a time is drawn, and its passes are timed; false where the adapter has no clock.
    pub fn time_passes(&mut self) -> bool {
        self.clock = self.gpu.has_clock().then(|| PassClock::new(&self.gpu));
        self.clock.is_some()
    }

    /// The times of the passes of the job that was collected last.
    pub fn pass_times(&mut self) -> Vec<PassTime> {
        self.clock.as_mut().map_or(Vec::new(), PassClock::take)
    }

    /// Waits until the oldest job is drawn. Its images are then on the way back, a number of bytes.
    pub fn wait_until_drawn(&mut self) -> Result<u64, RenderError> {
        let job = (self.in_flight.front()).ok_or(RenderError::NothingSubmitted)?;
        self.gpu.wait_for(job.submission.clone())?;
        Ok(job.views.iter().map(Back::bytes).sum())
    }

    /// From now on every pixel of every frame is drawn in full and developed on the adapter, as on hardware.
    pub fn draw_whole(&mut self) {
        self.whole = true;
    }

    /// Records all passes of a view and the way back of its image.
    fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        (job, view): (&Job, &View),
        bodies: &BodyMeshes,
    ) -> Result<Back, RenderError> {
        let (gpu, size_px) = (&self.gpu, size_px(view));
        let headlights = job.headlights.len().min(layout::MAX_HEADLIGHTS);
        let framed = Framed::new(view);
        let developer = Developer::of(view).filter(|_| !self.whole);
        let blurred = framed.defocus_reach_px() > 0;
        // To blur a picture or to develop it, the adapter needs all of it.
        let needs_all = blurred || developer.is_none();
        let kept_key = KeptKey::of(&framed).filter(|_| !needs_all);
        let extent = match &kept_key {
            _ if needs_all => Extent::Whole,
            Some(_) => Extent::Changed,
            None => Extent::Lit,
        };
        let meshes = (&mut self.chunks, bodies);
        let prepared = PreparedView::new(gpu, &framed, job, &self.scene, meshes, extent);
        let target = (self.targets).get(size_px, |size_px| ViewTarget::new(&gpu.device, *size_px));
        let surfaces = Surfaces {
            bodies,
            textures: &self.textures,
        };
        let mut recorder = Recorder {
            gpu,
            pipelines: &self.pipelines,
            passes: Passes {
                encoder,
                clock: self.clock.as_mut(),
            },
            view: &prepared,
            target,
            kept: None,
        };
        if let Some(key) = &kept_key {
            self.kept.forget(|other| other.is_outdated_by(key));
        }
        let draw_kept = |_: &KeptKey| recorder.draw_kept(size_px, &surfaces);
        let kept = kept_key.map(|key| self.kept.try_get(key, draw_kept));
        let kept = kept.transpose()?;
        recorder.kept = kept;
        recorder.draw_background(headlights, &surfaces);
        recorder.draw_shadows();
        recorder.draw_gloss(headlights, &surfaces);
        if blurred {
            recorder.blur();
        }
        recorder.draw_lamps();
        recorder.draw_glare();
        Ok(match developer {
            Some(developer) => {
                let map = self.maps_in_memory.get(MapKey::new(view), make_map);
                let to = (&mut *encoder, &mut self.free);
                let signal = SignalBack::of(gpu, to, target, prepared, kept, (map, developer));
                Back::Signal(Box::new(signal))
            }
            None => {
                let map = (self.maps).get(MapKey::new(view), |key| {
                    target::map_texture(gpu, &key.make_map(), size_px)
                });
                recorder.draw_sensor(map, view.sensor.blooming > 0.0);
                let spare = self.spare.iter().position(|back| back.size_px == size_px);
                let back = spare.map_or_else(
                    || ReadBack::new(&gpu.device, size_px),
                    |at| self.spare.swap_remove(at),
                );
                target.copy_back(target.finishing(&gpu.device), &back, encoder);
                Back::Image(back)
            }
        })
    }
}

fn make_map(key: &MapKey) -> Arc<PixelMap> {
    Arc::new(key.make_map())
}

fn size_px(view: &View) -> (u32, u32) {
    let lens = &view.camera.intrinsics;
    (lens.width_px, lens.height_px)
}

impl Renderer for GpuRenderer {
    fn backend(&self) -> Backend {
        self.gpu.backend.clone()
    }

    fn set_scene(&mut self, scene: Scene) {
        if self.scene.replace(scene) {
            self.textures = Textures::new(&self.gpu, &self.scene.paintings);
            self.scene.paintings.forget_texels();
        }
        self.chunks = Chunks::default();
        self.kept.clear();
        self.maps.clear();
        self.maps_in_memory.clear();
        self.targets.clear();
        self.spare.clear();
        self.in_flight.clear();
    }

    fn submit(&mut self, job: &Job) -> Result<(), RenderError> {
        if self.scene.follow_lamps(job.time) {
            self.chunks = Chunks::default();
            self.kept.clear();
        }
        self.chunks.next_job();
        let bodies = BodyMeshes::new(&self.gpu, job, &self.scene);
        let mut encoder = (self.gpu.device).create_command_encoder(&Default::default());
        let views: Vec<_> = (job.views.iter())
            .map(|view| self.record(&mut encoder, (job, view), &bodies))
            .collect::<Result<_, _>>()?;
        if let Some(clock) = &self.clock {
            clock.send_back(&mut encoder);
        }
        let submission = self.gpu.queue.submit([encoder.finish()]);
        views.iter().for_each(Back::request);
        if let Some(clock) = &self.clock {
            clock.request();
        }
        let spare_bits = job.views.iter().map(|v| v.sensor.spare_bits());
        self.in_flight.push_back(InFlight {
            views,
            spare_bits: spare_bits.collect(),
            submission,
        });
        self.gpu.check()
    }

    fn collect(&mut self) -> Result<Vec<GrayImage>, RenderError> {
        self.collected(|dn, spare_bits| (dn >> spare_bits).min(255) as u8)
    }

    fn collect_raw(&mut self) -> Result<Vec<RawImage>, RenderError> {
        self.collected(|dn, _| dn as u16)
    }
}

impl GpuRenderer {
    /// The images of the oldest job; `keep` makes of a digital number and the bits that eight leave over
    /// what is kept.
    fn collected<T: Primitive + Send>(
        &mut self,
        keep: impl Fn(u32, u32) -> T + Copy + Sync,
    ) -> Result<Vec<Image<T>>, RenderError> {
        let job = (self.in_flight.pop_front()).ok_or(RenderError::NothingSubmitted)?;
        self.gpu.wait_for(job.submission)?;
        let mut images = Vec::with_capacity(job.views.len());
        for (view, spare_bits) in job.views.into_iter().zip(job.spare_bits) {
            let keep = move |dn: u32| keep(dn, spare_bits);
            images.push(view.image(keep));
            match view {
                Back::Image(back) => self.spare.push(back),
                Back::Signal(back) => self.free.push(back.buffer),
            }
        }
        images.into_iter().collect()
    }
}
