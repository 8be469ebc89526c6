//! The plain renderer: rays in double precision, each row from where the camera was in the middle
//! of that row's exposure. [`CpuRenderer::oracle`] follows one through every pixel, and is what the
//! GPU renderer is held against. [`CpuRenderer::quick`] draws on a machine without any graphics
//! driver: where the tunnel is too dark to tell one grey level from the next, as it is in most of
//! an exposure of 30 us, it follows one ray in 64 (see `dim.rs`).
//!
//! ```
//! use metrotwin::bus::{Intrinsics, SimTime};
//! use metrotwin::scenario::Scenario;
//! use metrotwin::session::scene;
//! use metrotwin::twin::random::Stream;
//! use metrotwin::twin::render::cpu::CpuRenderer;
//! use metrotwin::twin::render::{CameraMotion, Job, NoiseKey, Renderer, View};
//!
//! let scenario = Scenario::load("scenarios/forgotten_toolbox.toml".as_ref(), &[])?;
//! let post = &scenario.wayside[0];
//! let mut view = View {
//!     camera: post.actual.camera,
//!     start: SimTime::ZERO,
//!     motion: CameraMotion::still(post.actual.world_from_camera),
//!     pixel_m: 1e-6 * post.camera.pixel_um,
//!     lens: post.camera.lens,
//!     sensor: post.camera.sensor,
//!     noise: NoiseKey { stream: Stream::new(1, 0, "my camera"), frame: 0 },
//! };
//! view.camera.intrinsics = Intrinsics::centred(96, 54, 55.0);
//! let job = Job { views: vec![view], ..Job::default() };
//!
//! let mut renderer = CpuRenderer::oracle(scene(&scenario));
//! renderer.submit(&job)?;
//! let images = renderer.collect()?;
//! assert_eq!(images[0].dimensions(), (96, 54));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! What it computes for a pixel:
//! 1. the surface that the pixel's centre ray meets first: tunnel ([`TunnelCaster`](crate::twin::geometry::TunnelCaster)) or body
//!    ([`Solid`](crate::twin::geometry::Solid));
//! 2. its reflected luminance, albedo * E / pi, the albedo from its [painting](super::paint) over
//!    the pixel's footprint, E less what bodies shade ([`photometry`](super::photometry)), by lamps that blink,
//!    and what it mirrors ([`gloss`](super::gloss)), seen through the air;
//! 3. lamp discs, by rays spread over the pixel and the lens's point spread in many instants;
//! 4. the glare of each lamp;
//! 5. the sensor: fixed pattern, noise, bits ([`sensor`](super::sensor)).
//!
//! A lens with a distance in focus is looked through at many points of its pupil (`pupil.rs`).
//!
//! Where something moves in the picture by more than a pixel while a row is exposed, the exposure
//! is cut into slices in which nothing does, and all this is done in each of them;
//! [`CpuRenderer::sliced`] cuts it into as many as one likes.
//!
//! Rows are independent of each other, so any number of threads gives the same bytes. What a
//! camera that stands still sees of the tunnel is kept from frame to frame.
//!
//! Not here: the point spread in focus of anything but lamps. Beyond
//! [`SIGHT_M`](super::constants::SIGHT_M)
//! the tunnel is dark.

mod blinking;
mod cast_scene;
mod dim;
mod lamps;
mod pupil;
mod row;
mod sensor;
mod shadow;
mod smear;
mod spread;

use super::cache::Cache;
use super::pixel_map::{KEPT_MAPS, MapKey, PixelMap};
use super::upper_bits;
use super::{Backend, Job, RawImage, RenderError, Renderer, Scene, View};
use crate::bus::Intrinsics;
use cast_scene::{CastScene, TunnelPixel};
use dim::DimView;
use image::GrayImage;
use lamps::RowExposure;
use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;
use row::{KnownTunnel, RowBuffers, RowRays, ViewContext};
use sensor::ExposedSensor;
use spread::BlurSamples;
use std::collections::VecDeque;

/// Cameras that stand still and whose view of the tunnel is kept.
const KEPT_VIEWS: usize = 4;

/// Draws jobs as they are submitted.
pub struct CpuRenderer {
    scene: CastScene,
    every_ray: bool,
    /// Of a row's exposure, where they are given.
    slices: Option<usize>,
    /// The tunnel through all pixels of cameras that stand still.
    kept: Cache<(Intrinsics, Isometry3<f64>), Vec<TunnelPixel>>,
    maps: Cache<MapKey, PixelMap>,
    finished: VecDeque<FinishedJob>,
}

/// The images of a job that is done, with the bits that one of eight does not have.
type FinishedJob = Vec<(RawImage, u32)>;

impl CpuRenderer {
    /// Follows a ray through every pixel.
    pub fn oracle(scene: Scene) -> Self {
        Self::new(scene, true)
    }

    /// Follows few rays where it is dark; within one grey level of the oracle.
    pub fn quick(scene: Scene) -> Self {
        Self::new(scene, false)
    }

    /// Cuts every row's exposure into so many slices, whatever moves in it.
    pub fn sliced(mut self, slices: usize) -> Self {
        self.slices = Some(slices.max(1));
        self
    }

    fn new(scene: Scene, every_ray: bool) -> Self {
        Self {
            scene: CastScene::new(scene),
            every_ray,
            slices: None,
            kept: Cache::new(KEPT_VIEWS),
            maps: Cache::new(KEPT_MAPS),
            finished: VecDeque::new(),
        }
    }

    /// Draws one view of a job, in eight bits.
    pub fn draw(&mut self, job: &Job, view: &View) -> GrayImage {
        upper_bits(&self.draw_raw(job, view), view.sensor.spare_bits())
    }

    /// Draws one view of a job, in all bits.
    pub fn draw_raw(&mut self, job: &Job, view: &View) -> RawImage {
        let camera = &view.camera.intrinsics;
        let Some(&pose) = view.motion.poses.first() else {
            return RawImage::new(camera.width_px, camera.height_px);
        };
        // Through a wide pupil every point looks from a place of its own.
        let still = view.motion.poses.len() == 1 && pupil::is_small(view);
        let kept = still.then(|| {
            let all_pixels = |_: &_| self.scene.all_pixels(camera, &pose);
            self.kept.get((*camera, pose), all_pixels)
        });
        let lamps = self.scene.lamps_by_distance(&pose);
        let ray_start = (self.scene.tunnel).ray_start(&Point3::from(pose.translation.vector), None);
        let context = ViewContext::new(&self.scene, job, view, ray_start);
        let corners = |row: &RowExposure, corners: &mut [f64]| {
            RowRays::new(&self.scene, &context, view, row, KnownTunnel::Unknown).corners(corners);
        };
        let dim = (!still && !self.every_ray && pupil::is_small(view))
            .then(|| DimView::new(view, corners));
        let known = match (kept, &dim) {
            (Some(kept), _) => KnownTunnel::Kept(kept),
            (None, Some(dim)) => KnownTunnel::Dim(dim),
            (None, None) => KnownTunnel::Unknown,
        };
        let slices = self.slices.unwrap_or_else(|| smear::slices(job, view));
        let spread = BlurSamples::new(view.lens.blur_px);
        let pixels = camera.width_px as usize * camera.height_px as usize;
        let mut signals_e = vec![0.0; pixels];
        let pinholes = pupil::pinholes(view);
        let electrons = view.electrons_per_cd_m2() / (slices * pinholes.len()) as f64;
        // An image without pixels has no rows.
        signals_e
            .par_chunks_mut((camera.width_px as usize).max(1))
            .enumerate()
            .for_each_init(RowBuffers::default, |buffers, (v, signals_e)| {
                for (view, k) in pinholes
                    .iter()
                    .flat_map(|view| (0..slices).map(move |k| (view, k)))
                {
                    let row = RowExposure::slice(view, v, k, slices);
                    let rays = RowRays::new(&self.scene, &context, view, &row, known);
                    rays.luminances(&lamps, &spread, buffers);
                    for (signal_e, luminance) in signals_e.iter_mut().zip(&buffers.luminances) {
                        *signal_e += electrons * luminance;
                    }
                }
            });
        let map = (self.maps).get(MapKey::new(view), MapKey::make_map);
        let sensor = ExposedSensor {
            view,
            map,
            signals_e: &signals_e,
        };
        sensor.develop()
    }
}

impl Renderer for CpuRenderer {
    fn backend(&self) -> Backend {
        Backend {
            backend: "cpu".into(),
            adapter: format!("{} threads", rayon::current_num_threads()),
        }
    }

    fn set_scene(&mut self, scene: Scene) {
        self.scene.replace(scene);
        self.kept.clear();
        self.maps.clear();
        self.finished.clear();
    }

    fn submit(&mut self, job: &Job) -> Result<(), RenderError> {
        if self.scene.lit.follow_lamps(job.time) {
            self.kept.clear();
        }
        let images: Vec<_> = (job.views.iter())
            .map(|view| (self.draw_raw(job, view), view.sensor.spare_bits()))
            .collect();
        self.finished.push_back(images);
        Ok(())
    }

    fn collect(&mut self) -> Result<Vec<GrayImage>, RenderError> {
        let job = (self.finished.pop_front()).ok_or(RenderError::NothingSubmitted)?;
        let images = job.iter();
        Ok(images.map(|(raw, spare)| upper_bits(raw, *spare)).collect())
    }

    fn collect_raw(&mut self) -> Result<Vec<RawImage>, RenderError> {
        let job = (self.finished.pop_front()).ok_or(RenderError::NothingSubmitted)?;
        Ok(job.into_iter().map(|(raw, _)| raw).collect())
    }
}

#[cfg(test)]
mod tests;
