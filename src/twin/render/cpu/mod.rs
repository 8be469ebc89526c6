//! The plain renderer: rays in double precision, each row from where the camera was in the middle
//! of that row's exposure. [`CpuRenderer::oracle`] follows one through every pixel, and is what the
//! GPU renderer is held against. [`CpuRenderer::quick`] draws on a machine without any graphics
//! driver: where the tunnel is too dark to tell one grey level from the next, as it is in most of
//! an exposure of 30 us, it follows one ray in 64 (see `dim.rs`).
//!
//! ```
//! use metrotwin::bus::Intrinsics;
//! use metrotwin::twin::render::{Renderer, cpu::CpuRenderer, sample};
//!
//! let mut renderer = CpuRenderer::oracle(sample::scene());
//! let mut job = sample::wayside_job(&sample::tunnel(), 100.0);
//! job.views[0].camera.intrinsics = Intrinsics::centred(96, 54, 55.0);
//! renderer.submit(&job)?;
//! let images = renderer.collect()?;
//! assert_eq!(images[0].dimensions(), (96, 54));
//! # Ok::<(), metrotwin::twin::render::RenderError>(())
//! ```
//!
//! What it computes for a pixel:
//! 1. the surface that the pixel's centre ray meets first: tunnel ([`TunnelCaster`]) or body
//!    ([`Solid`]);
//! 2. its reflected luminance, albedo * E / pi ([`light`](super::light));
//! 3. lamp discs, from 4 x 4 sub-pixels at 4 instants of the row's exposure;
//! 4. the glare of each lamp;
//! 5. the sensor: fixed pattern, noise, bits ([`sensor`](super::sensor)).
//!
//! Rows are independent of each other, so any number of threads gives the same bytes. What a
//! camera that stands still sees of the tunnel is kept from frame to frame.
//!
//! Not here: shadows, reflections, motion blur of anything but lamps, lens distortion. Beyond
//! [`SIGHT_M`] the tunnel is dark.

mod dim;
mod lamps;
mod look;
mod outline;
mod sensor;
mod solid;
mod tunnel;

pub use solid::Solid;
pub use tunnel::{Strike, SurfacePoint, TunnelCaster};

use super::light::{LampField, headlights_lx};
use super::pixel_map::{MapCache, MapKey, PixelMap};
use super::upper_bits;
use super::{Backend, Headlight, Job, LampLight, RawImage, RenderError, Renderer, Scene, View};
use crate::bus::{CameraModel, Intrinsics};
use dim::{CELL_PX, DimView};
use image::GrayImage;
use lamps::RowExposure;
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;
use sensor::Sensor;
use std::collections::VecDeque;
use std::f64::consts::PI;
use std::sync::Arc;

/// Surfaces farther away than this are not seen.
pub const SIGHT_M: f64 = 160.0;

/// Cameras that stand still and whose view of the tunnel is kept.
const KEPT_VIEWS: usize = 4;

/// Draws jobs as they are submitted.
pub struct CpuRenderer {
    world: World,
    every_ray: bool,
    kept: VecDeque<KeptView>,
    maps: MapCache<Arc<PixelMap>>,
    drawn: VecDeque<Drawn>,
}

/// A job that is done.
struct Drawn {
    raw: bool,
    /// With the bits that an image of eight does not have.
    images: Vec<(RawImage, u32)>,
}

/// What stands still.
struct World {
    tunnel: TunnelCaster,
    lamps: LampField,
    ambient_lx: f64,
}

/// The tunnel through one pixel.
#[derive(Clone, Copy)]
struct Ground {
    /// Depth along the camera's axis and facet, or nothing within sight.
    strike: Option<Strike>,
    albedo: f64,
    /// By ambient light and lamps.
    luminance: f64,
}

/// The tunnel through all pixels of a camera that stands still.
struct KeptView {
    camera: CameraModel,
    pose: Isometry3<f64>,
    ground: Vec<Ground>,
}

/// What is known about the tunnel behind a view before its rows are drawn.
#[derive(Clone, Copy)]
enum Behind<'a> {
    /// All of it.
    Kept(&'a [Ground]),
    /// Where it is dark, and how dark.
    Dim(&'a DimView),
    /// Nothing.
    Unknown,
}

/// A row while it is drawn.
#[derive(Default)]
struct RowBuffers {
    /// Of the nearest surface; not a number where nobody has asked yet.
    depths: Vec<f64>,
    luminances: Vec<f64>,
}

/// The rays of a row through the tunnel.
struct RowRays<'a> {
    world: &'a World,
    view: &'a View,
    row: &'a RowExposure,
    behind: Behind<'a>,
    eye: Point3<f64>,
    slab: usize,
}

impl CpuRenderer {
    /// Follows a ray through every pixel.
    pub fn oracle(scene: Scene) -> Self {
        Self::new(scene, true)
    }

    /// Follows few rays where it is dark; within one grey level of the oracle.
    pub fn quick(scene: Scene) -> Self {
        Self::new(scene, false)
    }

    fn new(scene: Scene, every_ray: bool) -> Self {
        Self {
            world: World {
                tunnel: TunnelCaster::new(&scene.tunnel),
                lamps: LampField::new(&scene.lamps),
                ambient_lx: scene.tunnel.ambient_lx,
            },
            every_ray,
            kept: VecDeque::new(),
            maps: MapCache::default(),
            drawn: VecDeque::new(),
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
        let still = view.motion.poses.len() == 1;
        let kept = still.then(|| self.keep(&view.camera, pose));
        let lamps = self.world.lamps_by_distance(&pose);
        let slab = (self.world.tunnel).slab_of(&Point3::from(pose.translation.vector), None);
        let dim = (!still && !self.every_ray).then(|| DimView::new(&self.world, job, view, slab));
        let behind = match (kept.and_then(|k| self.kept.get(k)), &dim) {
            (Some(kept), _) => Behind::Kept(&kept.ground),
            (None, Some(dim)) => Behind::Dim(dim),
            (None, None) => Behind::Unknown,
        };
        let pixels = camera.width_px as usize * camera.height_px as usize;
        let mut signals_e = vec![0.0; pixels];
        let electrons = view.electrons_per_cd_m2();
        // An image without pixels has no rows.
        signals_e
            .par_chunks_mut((camera.width_px as usize).max(1))
            .enumerate()
            .for_each_init(RowBuffers::default, |buffers, (v, signals_e)| {
                let row = RowExposure::new(view, v);
                let rays = RowRays::new(&self.world, view, &row, slab, behind);
                rays.draw(job, &lamps, buffers);
                for (signal_e, luminance) in signals_e.iter_mut().zip(&buffers.luminances) {
                    *signal_e = electrons * luminance;
                }
            });
        let map = (self.maps).get(MapKey::new(view), Arc::new);
        let sensor = Sensor {
            view,
            map: &map,
            signals_e: &signals_e,
        };
        sensor.develop()
    }

    /// Index of the kept view of a still camera, drawn now if it is new.
    fn keep(&mut self, camera: &CameraModel, pose: Isometry3<f64>) -> usize {
        let same = |k: &KeptView| k.camera.intrinsics == camera.intrinsics && k.pose == pose;
        if let Some(k) = self.kept.iter().position(same) {
            return k;
        }
        if self.kept.len() >= KEPT_VIEWS {
            self.kept.pop_front();
        }
        self.kept.push_back(KeptView {
            camera: *camera,
            pose,
            ground: self.world.all_ground(&camera.intrinsics, &pose),
        });
        self.kept.len() - 1
    }
}

impl Renderer for CpuRenderer {
    fn backend(&self) -> Backend {
        Backend {
            backend: "cpu".into(),
            adapter: format!("{} threads", rayon::current_num_threads()),
        }
    }

    fn submit(&mut self, job: &Job) -> Result<(), RenderError> {
        let views = job.views.iter();
        let images = views.map(|view| (self.draw_raw(job, view), view.sensor.spare_bits()));
        let images = images.collect();
        self.drawn.push_back(Drawn {
            raw: job.raw,
            images,
        });
        Ok(())
    }

    fn collect(&mut self) -> Result<Vec<GrayImage>, RenderError> {
        let job = (self.drawn.pop_front()).ok_or(RenderError::NothingSubmitted)?;
        let images = job.images.iter();
        Ok(images.map(|(raw, spare)| upper_bits(raw, *spare)).collect())
    }

    fn collect_raw(&mut self) -> Result<Vec<RawImage>, RenderError> {
        if self.drawn.front().is_some_and(|job| !job.raw) {
            return Err(RenderError::NotRaw);
        }
        let job = (self.drawn.pop_front()).ok_or(RenderError::NothingSubmitted)?;
        Ok(job.images.into_iter().map(|(raw, _)| raw).collect())
    }
}

impl World {
    /// Lamps that may be seen, the farthest first so that nearer ones are drawn over them.
    fn lamps_by_distance(&self, pose: &Isometry3<f64>) -> Vec<&LampLight> {
        let eye = Point3::from(pose.translation.vector);
        let away = |lamp: &LampLight| (lamp.centre - eye).norm();
        // Through a frame a train moves by a few metres.
        let reach = super::surface::LAMP_SIGHT_M + 20.0;
        let mut lamps: Vec<_> = self
            .lamps
            .lamps()
            .iter()
            .filter(|l| away(l) < reach)
            .collect();
        lamps.sort_by(|a, b| away(b).total_cmp(&away(a)));
        lamps
    }

    fn all_ground(&self, camera: &Intrinsics, pose: &Isometry3<f64>) -> Vec<Ground> {
        let eye = Point3::from(pose.translation.vector);
        let slab = self.tunnel.slab_of(&eye, None);
        let width = camera.width_px as usize;
        (0..width * camera.height_px as usize)
            .into_par_iter()
            .with_min_len(width.max(1))
            .map(|k| {
                let ray = pose * camera.ray((k % width) as f64, (k / width) as f64);
                self.ground(slab, &eye, &ray, camera.fx_px)
            })
            .collect()
    }

    /// The tunnel along one ray (scaled to z = 1 in the camera's frame).
    fn ground(&self, slab: usize, eye: &Point3<f64>, ray: &Vector3<f64>, f_px: f64) -> Ground {
        let stretch = ray.norm();
        let Some(strike) = self.tunnel.cast(slab, eye, ray, SIGHT_M / stretch) else {
            return Ground {
                strike: None,
                albedo: 0.0,
                luminance: 0.0,
            };
        };
        let at = self.tunnel.surface_at(eye, ray, &strike);
        let sine = (at.normal.dot(ray) / stretch)
            .abs()
            .max(super::surface::MIN_SINE);
        let albedo = at.albedo(strike.t * stretch / f_px / sine);
        let lux = self.ambient_lx + self.lamps.irradiance_lx(&at.position, &at.normal);
        Ground {
            strike: Some(strike),
            albedo,
            luminance: albedo * lux / PI,
        }
    }
}

impl<'a> RowRays<'a> {
    fn new(
        world: &'a World,
        view: &'a View,
        row: &'a RowExposure,
        near: usize,
        behind: Behind<'a>,
    ) -> Self {
        let eye = Point3::from(row.mid.translation.vector);
        Self {
            world,
            view,
            row,
            slab: world.tunnel.slab_of(&eye, Some(near)),
            eye,
            behind,
        }
    }

    /// Along the axis of pixel `u`, scaled to z = 1 in the camera's frame.
    fn ray(&self, u: usize) -> Vector3<f64> {
        let camera = &self.view.camera.intrinsics;
        self.row.mid * camera.ray(u as f64, self.row.v as f64)
    }

    /// Luminance and depth of the tunnel in pixel `u`.
    fn tunnel(&self, u: usize, headlights: &[Headlight]) -> (f64, f64) {
        let ray = self.ray(u);
        let camera = &self.view.camera.intrinsics;
        let ground = match self.behind {
            Behind::Kept(ground) => ground[self.row.v * camera.width_px as usize + u],
            _ => (self.world).ground(self.slab, &self.eye, &ray, camera.fx_px),
        };
        let Some(strike) = &ground.strike else {
            return (ground.luminance, f64::INFINITY);
        };
        let mut luminance = ground.luminance;
        if !headlights.is_empty() {
            let at = self.world.tunnel.surface_at(&self.eye, &ray, strike);
            let lux = headlights_lx(headlights, &at.position, &at.normal);
            luminance += ground.albedo * lux / PI;
        }
        (luminance, strike.t)
    }

    /// Depth of what is seen in pixel `u` so far; followed up now where the tunnel was too dark
    /// to care.
    fn depth(&self, u: usize, depths: &mut [f64]) -> f64 {
        if depths[u].is_nan() {
            let ray = self.ray(u);
            let strike = (self.world.tunnel).cast(self.slab, &self.eye, &ray, SIGHT_M / ray.norm());
            depths[u] = strike.map_or(f64::INFINITY, |s| s.t);
        }
        depths[u]
    }

    /// Luminance of every pixel of the row, into the buffers.
    fn draw(&self, job: &Job, lamps: &[&LampLight], buffers: &mut RowBuffers) {
        self.draw_tunnel(&job.headlights, buffers);
        let view = self.view;
        let mid = (view.camera.shutter).row_mid(view.start, self.row.v as f64);
        for body in &job.bodies {
            let solid = Solid::at(body, mid.since(job.time));
            self.draw_solid(&solid, &job.headlights, buffers);
        }
        let RowBuffers { depths, luminances } = buffers;
        for lamp in lamps {
            let depth = |u| self.depth(u, depths);
            lamps::draw_disc(
                lamp,
                view,
                self.row,
                self.world.ambient_lx,
                depth,
                luminances,
            );
        }
        for lamp in lamps {
            lamps::add_halo(lamp, view, self.row, luminances);
        }
    }

    fn draw_tunnel(&self, headlights: &[Headlight], buffers: &mut RowBuffers) {
        let RowBuffers { depths, luminances } = buffers;
        depths.clear();
        luminances.clear();
        let width = self.view.camera.intrinsics.width_px as usize;
        for begin in (0..width).step_by(CELL_PX) {
            let sides = match self.behind {
                Behind::Dim(dim) => dim.sides(begin / CELL_PX, self.row.v),
                _ => None,
            };
            for u in begin..(begin + CELL_PX).min(width) {
                let (luminance, depth) = match sides {
                    Some([left, right]) => {
                        let share = (u - begin) as f64 / CELL_PX as f64;
                        (left + (right - left) * share, f64::NAN)
                    }
                    None => self.tunnel(u, headlights),
                };
                luminances.push(luminance);
                depths.push(depth);
            }
        }
    }

    fn draw_solid(&self, solid: &Solid<'_>, headlights: &[Headlight], buffers: &mut RowBuffers) {
        let World {
            lamps, ambient_lx, ..
        } = self.world;
        for u in columns_of(solid, &self.view.camera.intrinsics, self.row) {
            let ray = self.ray(u);
            let Some((t, normal)) = solid.cast(&self.eye, &ray) else {
                continue;
            };
            if t < self.depth(u, &mut buffers.depths) && t * ray.norm() < SIGHT_M {
                let at = self.eye + ray * t;
                let lux = ambient_lx
                    + lamps.irradiance_lx(&at, &normal)
                    + headlights_lx(headlights, &at, &normal);
                let body = solid.body();
                buffers.depths[u] = t;
                buffers.luminances[u] = body.luminance_cd_m2 + body.albedo * lux / PI;
            }
        }
    }
}

/// Pixels of a row that a body may cover: none where the rectangle around its corners misses the
/// row, all where some corner is not in front of the camera.
fn columns_of(solid: &Solid<'_>, camera: &Intrinsics, row: &RowExposure) -> std::ops::Range<usize> {
    let width = camera.width_px as usize;
    let corners = solid.corners().map(|c| row.mid.inverse_transform_point(&c));
    if corners.iter().all(|c| c.z <= 0.0) {
        return 0..0;
    }
    let (mut low, mut high) = (
        Vector3::repeat(f64::INFINITY),
        Vector3::repeat(f64::NEG_INFINITY),
    );
    for corner in &corners {
        let Some(p) = camera.project(corner).filter(|_| corner.z > 0.01) else {
            return 0..width;
        };
        let p = Vector3::new(p.x, p.y, 0.0);
        (low, high) = (low.inf(&p), high.sup(&p));
    }
    let v = row.v as f64;
    if v < low.y - 1.0 || v > high.y + 1.0 {
        return 0..0;
    }
    let begin = (low.x.max(0.0) as usize).min(width);
    begin..((high.x + 2.0).max(0.0) as usize).clamp(begin, width)
}

#[cfg(test)]
mod tests;
