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
//! 3. *Focus.* What is out of focus is blurred along rows, then along columns.
//! 4. *Lamps.* The share of a pixel that a disc covers, through the lens's point spread, has a
//!    closed form along the row and is summed over a few lines across it, at each of the instants
//!    of the row's exposure; where the disc is and how bright in each comes from double precision.
//!    The glare is summed up in a texture of its own, a texel for every fourth pixel.
//! 5. *Sensor.* Glare, fixed pattern, shot and read noise, bits ([`sensor`](super::sensor)).
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
//! A view that is out of focus, or whose charge spills, is drawn whole and developed on the adapter.
//!
//! `tests/pictures/parts.rs` holds this against pictures drawn whole
//! ([`GpuRenderer::draw_parts`]): no pixel may be off by more than a grey level, no block of 32 x 32 by more than
//! 0.02 in the mean beyond the rounding of half precision.
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
mod end_walls;
mod facets;
mod kept;
mod lamps;
pub mod layout;
mod mesh;
mod pass_clock;
mod passes;
mod pieces;
mod pipeline;
mod prepared;
mod recorder;
mod rectangle;
mod region;
mod shaders;
mod shadows;
mod signal_back;
mod sky;
mod smear;
mod spread;
mod surface;
mod target;
mod texture;
mod textures;
mod tiles;
mod track_search;
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
use pipeline::{Kind, Pipelines};
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
    map_textures: Cache<MapKey, Texture>,
    maps: Cache<MapKey, Arc<PixelMap>>,
    targets: Cache<(u32, u32), ViewTarget>,
    kept: KeptTunnels,
    free_images: Vec<ReadBack>,
    /// Buffers that signals came back in.
    free_signals: Vec<wgpu::Buffer>,
    in_flight: VecDeque<InFlight>,
    clock: Option<PassClock>,
    /// See [`GpuRenderer::draw_parts`].
    draws_parts: bool,
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
        let pipelines = Pipelines::default();
        // A driver that cannot draw says so here.
        let lit = Kind::Lit {
            headlights: 0,
            banded: true,
            smeared: false,
        };
        pipelines.get(&gpu.device, lit);
        gpu.check()?;
        let mut scene = LitScene::new(scene);
        let textures = Textures::new(&gpu, &scene.paintings);
        scene.paintings.forget_texels();
        Ok(Self {
            pipelines,
            chunks: Chunks::default(),
            textures,
            scene,
            map_textures: Cache::new(KEPT_MAPS),
            maps: Cache::new(KEPT_MAPS),
            targets: Cache::new(KEPT_TARGETS),
            kept: Cache::new(MOST_KEPT),
            free_images: Vec::new(),
            free_signals: Vec::new(),
            in_flight: VecDeque::new(),
            clock: None,
            draws_parts: gpu.is_software(),
            gpu,
        })
    }

    /// Times the passes from now on; jobs must then be drawn one at a time. False where the adapter has no
    /// clock.
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

    /// Whether, from now on, only parts of pictures are drawn in full, tunnels are kept and the processor
    /// develops; or else every pixel of every frame is drawn and developed on the adapter. The first is the
    /// default on software adapters, the second on hardware.
    pub fn draw_parts(&mut self, parts: bool) {
        self.draws_parts = parts;
    }

    /// Whether what a camera sees of the tunnel may be kept: each as last exposed, for as many as there is room.
    fn may_keep(&self, key: &KeptKey) -> bool {
        !self.kept.is_full() || self.kept.any(|other| other.is_of_same_camera(key))
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
        let developer = Developer::of(view).filter(|_| self.draws_parts);
        let blurred = framed.defocus_reach_px() > 0;
        // To blur a picture or to develop it, the adapter needs all of it.
        let needs_all = blurred || developer.is_none();
        let kept_key = KeptKey::of(&framed).filter(|key| !needs_all && self.may_keep(key));
        let extent = match &kept_key {
            _ if needs_all => Extent::Whole,
            Some(_) => Extent::Changed,
            None => Extent::Lit,
        };
        let known = kept_key.as_ref().and_then(|key| self.kept.known(key));
        let in_sight = match known {
            Some(kept) => kept.in_sight.clone(),
            None => self.chunks.in_sight(gpu, &self.scene, &framed),
        };
        let meshes = (&in_sight, bodies);
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
        if let Some(key) = kept_key.as_ref().filter(|_| known.is_none()) {
            self.kept.forget(|other| other.is_of_same_camera(key));
        }
        let draw_kept = |_: &KeptKey| recorder.draw_kept(size_px, &in_sight, &surfaces);
        let kept = kept_key.map(|key| self.kept.try_get(key, draw_kept));
        let kept = kept.transpose()?;
        recorder.kept = kept;
        recorder.draw_signal(headlights, &surfaces, blurred);
        Ok(match developer {
            Some(developer) => {
                let map = self.maps.get(MapKey::new(view), make_map);
                let to = (&mut *encoder, &mut self.free_signals);
                let signal = SignalBack::of(gpu, to, target, prepared, kept, (map, developer));
                Back::Signal(Box::new(signal))
            }
            None => {
                let map = (self.map_textures).get(MapKey::new(view), |key| {
                    target::map_texture(gpu, &key.make_map(), size_px)
                });
                recorder.draw_sensor(map, view.sensor.blooming > 0.0);
                let free = &mut self.free_images;
                let known = free.iter().position(|back| back.size_px == size_px);
                let back = known.map(|at| free.swap_remove(at));
                let back = back.unwrap_or_else(|| ReadBack::new(&gpu.device, size_px));
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
        self.map_textures.clear();
        self.maps.clear();
        self.targets.clear();
        self.free_images.clear();
        self.free_signals.clear();
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
    /// The images of the oldest job; `convert` makes a pixel of a digital number and the number of its bits
    /// beyond eight.
    fn collected<T: Primitive + Send>(
        &mut self,
        convert: impl Fn(u32, u32) -> T + Copy + Sync,
    ) -> Result<Vec<Image<T>>, RenderError> {
        let job = (self.in_flight.pop_front()).ok_or(RenderError::NothingSubmitted)?;
        self.gpu.wait_for(job.submission)?;
        let mut images = Vec::with_capacity(job.views.len());
        for (view, spare_bits) in job.views.into_iter().zip(job.spare_bits) {
            let convert = move |dn: u32| convert(dn, spare_bits);
            images.push(view.image(convert));
            match view {
                Back::Image(back) => self.free_images.push(back),
                Back::Signal(back) => self.free_signals.push(back.buffer),
            }
        }
        images.into_iter().collect()
    }
}
