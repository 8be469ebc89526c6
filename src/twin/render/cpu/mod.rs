//! The plain renderer: one ray a pixel in double precision, each row from where the camera was in
//! the middle of that row's exposure. It is the oracle of the GPU renderer, and draws alone on a
//! machine without any graphics driver.
//!
//! ```
//! use metrotwin::bus::Intrinsics;
//! use metrotwin::twin::render::{Renderer, cpu::CpuRenderer, sample};
//!
//! let mut renderer = CpuRenderer::new(sample::scene());
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
//! 5. grey level, noise, rounding.
//!
//! Rows are independent of each other, so any number of threads gives the same bytes. What a
//! camera that stands still sees of the tunnel is kept from frame to frame.
//!
//! Not here: shadows, reflections, motion blur of anything but lamps, lens distortion. Beyond
//! [`SIGHT_M`] the tunnel is dark.

mod lamps;
mod look;
mod outline;
mod sensor;
mod solid;
mod tunnel;

pub use solid::Solid;
pub use tunnel::{Strike, SurfacePoint, TunnelCaster};

use super::light::{LampField, headlights_lx};
use super::{Backend, Body, Headlight, Job, LampLight, RenderError, Renderer, Scene, View};
use crate::bus::{CameraModel, Intrinsics};
use image::GrayImage;
use lamps::RowExposure;
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;
use std::collections::VecDeque;
use std::f64::consts::PI;

/// Surfaces farther away than this are not seen.
pub const SIGHT_M: f64 = 160.0;

/// Cameras that stand still and whose view of the tunnel is kept.
const KEPT_VIEWS: usize = 4;

/// Draws jobs as they are submitted.
pub struct CpuRenderer {
    world: World,
    kept: VecDeque<KeptView>,
    drawn: VecDeque<Vec<GrayImage>>,
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

/// What is known about the tunnel behind a row before it is drawn.
#[derive(Clone, Copy)]
enum Behind<'a> {
    /// All of it.
    Kept(&'a [Ground]),
    /// A slab close to the camera's.
    Near(usize),
}

/// A row while it is drawn.
#[derive(Default)]
struct RowBuffers {
    depths: Vec<f64>,
    luminances: Vec<f64>,
}

impl CpuRenderer {
    /// Makes the scene ready for rays.
    pub fn new(scene: Scene) -> Self {
        Self {
            world: World {
                tunnel: TunnelCaster::new(&scene.tunnel),
                lamps: LampField::new(&scene.lamps),
                ambient_lx: scene.tunnel.ambient_lx,
            },
            kept: VecDeque::new(),
            drawn: VecDeque::new(),
        }
    }

    /// Draws one view of a job.
    pub fn draw(&mut self, job: &Job, view: &View) -> GrayImage {
        let camera = &view.camera.intrinsics;
        let mut image = GrayImage::new(camera.width_px, camera.height_px);
        let Some(&pose) = view.motion.poses.first() else {
            return image;
        };
        let kept = (view.motion.poses.len() == 1).then(|| self.keep(&view.camera, pose));
        let kept = kept.and_then(|k| self.kept.get(k));
        let lamps = self.world.lamps_by_distance(&pose);
        let eye = Point3::from(pose.translation.vector);
        let slab = self.world.tunnel.slab_of(&eye, None);
        let width = camera.width_px as usize;
        // An image without pixels has no rows.
        image
            .par_chunks_mut(width.max(1))
            .enumerate()
            .for_each_init(RowBuffers::default, |buffers, (v, pixels)| {
                let tunnel = match kept {
                    Some(kept) => Behind::Kept(&kept.ground[v * width..(v + 1) * width]),
                    None => Behind::Near(slab),
                };
                self.world.draw_row(job, view, v, tunnel, &lamps, buffers);
                sensor::expose(view, v, &buffers.luminances, pixels);
            });
        image
    }

    /// Index of the kept view of a still camera, drawn now if it is new.
    fn keep(&mut self, camera: &CameraModel, pose: Isometry3<f64>) -> usize {
        let same = |k: &KeptView| k.camera == *camera && k.pose == pose;
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
        let images = job.views.iter().map(|view| self.draw(job, view)).collect();
        self.drawn.push_back(images);
        Ok(())
    }

    fn collect(&mut self) -> Result<Vec<GrayImage>, RenderError> {
        self.drawn.pop_front().ok_or(RenderError::NothingSubmitted)
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

    /// Luminance of every pixel of row `v`, into the buffers.
    fn draw_row(
        &self,
        job: &Job,
        view: &View,
        v: usize,
        behind: Behind<'_>,
        lamps: &[&LampLight],
        buffers: &mut RowBuffers,
    ) {
        let row = RowExposure::new(view, v);
        self.draw_tunnel(job, view, &row, behind, buffers);
        let mid = view.camera.shutter.row_mid(view.start, v as f64);
        for body in &job.bodies {
            let solid = Solid::at(body, mid.since(job.time));
            self.draw_solid(&solid, &job.headlights, view, &row, buffers);
        }
        let RowBuffers { depths, luminances } = buffers;
        for lamp in lamps {
            lamps::draw_disc(lamp, view, &row, self.ambient_lx, depths, luminances);
        }
        for lamp in lamps {
            lamps::add_halo(lamp, view, &row, luminances);
        }
    }

    fn draw_tunnel(
        &self,
        job: &Job,
        view: &View,
        row: &RowExposure,
        behind: Behind<'_>,
        buffers: &mut RowBuffers,
    ) {
        let camera = &view.camera.intrinsics;
        let eye = Point3::from(row.mid.translation.vector);
        let slab = match behind {
            Behind::Near(slab) => self.tunnel.slab_of(&eye, Some(slab)),
            Behind::Kept(_) => 0,
        };
        buffers.depths.clear();
        buffers.luminances.clear();
        for u in 0..camera.width_px as usize {
            let ray = row.mid * camera.ray(u as f64, row.v as f64);
            let ground = match behind {
                Behind::Kept(ground) => ground[u],
                Behind::Near(_) => self.ground(slab, &eye, &ray, camera.fx_px),
            };
            let mut luminance = ground.luminance;
            if let Some(strike) = &ground.strike
                && !job.headlights.is_empty()
            {
                let at = self.tunnel.surface_at(&eye, &ray, strike);
                let lux = headlights_lx(&job.headlights, &at.position, &at.normal);
                luminance += ground.albedo * lux / PI;
            }
            buffers
                .depths
                .push(ground.strike.map_or(f64::INFINITY, |s| s.t));
            buffers.luminances.push(luminance);
        }
    }

    fn draw_solid(
        &self,
        solid: &Solid<'_>,
        headlights: &[Headlight],
        view: &View,
        row: &RowExposure,
        buffers: &mut RowBuffers,
    ) {
        let camera = &view.camera.intrinsics;
        let eye = Point3::from(row.mid.translation.vector);
        for u in columns_of(solid, camera, row) {
            let ray = row.mid * camera.ray(u as f64, row.v as f64);
            let Some((t, normal)) = solid.cast(&eye, &ray) else {
                continue;
            };
            if t < buffers.depths[u] && t * ray.norm() < SIGHT_M {
                let at = eye + ray * t;
                let lux = self.ambient_lx
                    + self.lamps.irradiance_lx(&at, &normal)
                    + headlights_lx(headlights, &at, &normal);
                let Body {
                    albedo,
                    luminance_cd_m2,
                    ..
                } = solid.body();
                buffers.depths[u] = t;
                buffers.luminances[u] = luminance_cd_m2 + albedo * lux / PI;
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
