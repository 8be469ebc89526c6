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
//! Not here: the point spread in focus of anything but lamps. Beyond [`SIGHT_M`]
//! the tunnel is dark.

mod blinking;
mod dim;
mod extent;
pub mod labels;
mod lamps;
mod look;
mod pupil;
mod sensor;
mod shadow;
mod sight;
mod smear;
mod spread;

pub use extent::{Whole, whole};
pub use labels::{Labeller, Labels, Surface};
pub use sight::{Seen, Sight};

use super::gloss::{Facing, Gloss, MIRROR_REACH_M, Source};
use super::lamp_field::{LampField, LampsInTime};
use super::paint::Paintings;
use super::photometry::{Shining, headlights_lx};
use super::pixel_map::{MapCache, MapKey, PixelMap};
use super::upper_bits;
use super::{Backend, Job, RawImage, RenderError, Renderer, Scene, View};
use crate::bus::{CameraModel, Intrinsics};
use crate::track::Tunnel;
use crate::twin::air::Air;
use crate::twin::geometry::{Solid, SurfacePoint, TunnelCaster, TunnelHit};
use crate::twin::lights::LampLight;
use crate::twin::reflectance::Wet;
use blinking::Blinking;
use dim::{CELL_PX, DimView};
use extent::Outline;
use image::GrayImage;
use lamps::{Haze, RowExposure};
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;
use sensor::Sensor;
use shadow::{Blocker, Shades};
use spread::Spread;
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
    lamps: LampsInTime,
    every_ray: bool,
    /// Of a row's exposure, where they are given.
    slices: Option<usize>,
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
    paintings: Paintings,
    line: Arc<Tunnel>,
    lamps: LampField,
    air: Air,
    wet: Wet,
}

/// The tunnel through one pixel.
#[derive(Clone, Copy)]
struct Ground {
    /// Depth along the camera's axis and facet, or nothing within sight.
    hit: Option<TunnelHit>,
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

/// What a view adds to the tunnel.
struct Scenery<'a> {
    job: &'a Job,
    shades: Shades<'a>,
    airlight_cd_m2: f64,
    /// Segment of the first pose.
    segment: usize,
    /// Indices of the lamps whose blinking may show.
    lamps: Vec<usize>,
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
    scenery: &'a Scenery<'a>,
    view: &'a View,
    row: &'a RowExposure,
    behind: Behind<'a>,
    eye: Point3<f64>,
    segment: usize,
    /// The job's bodies as they are by now.
    blockers: Vec<Blocker<'a>>,
    blinking: Blinking,
    /// Patterns are averaged over squares of so many pixels.
    side_px: f64,
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

    /// Cuts every row's exposure into so many slices, whatever moves in it.
    pub fn sliced(mut self, slices: usize) -> Self {
        self.slices = Some(slices.max(1));
        self
    }

    fn new(scene: Scene, every_ray: bool) -> Self {
        let paintings = Paintings::of(&scene.tunnel);
        Self::painted(scene, paintings, every_ray)
    }

    fn painted(scene: Scene, paintings: Paintings, every_ray: bool) -> Self {
        Self {
            slices: None,
            world: World {
                tunnel: TunnelCaster::new(&scene.tunnel),
                paintings,
                lamps: LampField::new(&scene.lamps).in_air(scene.air),
                line: scene.tunnel,
                air: scene.air,
                wet: scene.wet,
            },
            lamps: LampsInTime::new(&scene.lamps),
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
        // Through a wide pupil every point looks from a place of its own.
        let still = view.motion.poses.len() == 1 && pupil::is_small(view);
        let kept = still.then(|| self.keep(&view.camera, pose));
        let lamps = self.world.lamps_by_distance(&pose);
        let segment = (self.world.tunnel).segment_of(&Point3::from(pose.translation.vector), None);
        let scenery = Scenery::new(&self.world, job, view, segment);
        let dim = (!still && !self.every_ray && pupil::is_small(view))
            .then(|| DimView::new(&self.world, &scenery, view));
        let behind = match (kept.and_then(|k| self.kept.get(k)), &dim) {
            (Some(kept), _) => Behind::Kept(&kept.ground),
            (None, Some(dim)) => Behind::Dim(dim),
            (None, None) => Behind::Unknown,
        };
        let slices = self.slices.unwrap_or_else(|| smear::slices(job, view));
        let spread = Spread::new(view.lens.blur_px);
        let pixels = camera.width_px as usize * camera.height_px as usize;
        let mut signals_e = vec![0.0; pixels];
        let looks = pupil::looks(view);
        let electrons = view.electrons_per_cd_m2() / (slices * looks.len()) as f64;
        // An image without pixels has no rows.
        signals_e
            .par_chunks_mut((camera.width_px as usize).max(1))
            .enumerate()
            .for_each_init(RowBuffers::default, |buffers, (v, signals_e)| {
                for (view, k) in looks
                    .iter()
                    .flat_map(|look| (0..slices).map(move |k| (look, k)))
                {
                    let row = RowExposure::slice(view, v, k, slices);
                    let rays = RowRays::new(&self.world, &scenery, view, &row, behind);
                    rays.draw(&lamps, &spread, buffers);
                    for (signal_e, luminance) in signals_e.iter_mut().zip(&buffers.luminances) {
                        *signal_e += electrons * luminance;
                    }
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

    fn set_scene(&mut self, scene: Scene) {
        let paintings = if self.world.line.sections == scene.tunnel.sections {
            self.world.paintings.clone()
        } else {
            Paintings::of(&scene.tunnel)
        };
        *self = Self {
            slices: self.slices,
            maps: std::mem::take(&mut self.maps),
            ..Self::painted(scene, paintings, self.every_ray)
        };
    }

    fn submit(&mut self, job: &Job) -> Result<(), RenderError> {
        if let Some(lamps) = self.lamps.changed(job.time) {
            self.world.lamps = LampField::new(&lamps).in_air(self.world.air);
            self.kept.clear();
        }
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
    /// Indices of the lamps whose light a view shows on surfaces.
    fn lamps_about(&self, view: &View) -> Vec<usize> {
        let Some(pose) = view.motion.poses.first() else {
            return Vec::new();
        };
        let reach_m = SIGHT_M + MIRROR_REACH_M;
        let away_m = |lamp: &Shining| (lamp.centre.coords - pose.translation.vector).norm();
        let lamps = self.lamps.lamps().iter().enumerate();
        lamps
            .filter(|(_, lamp)| away_m(lamp) < reach_m)
            .map(|(k, _)| k)
            .collect()
    }

    /// Lamps that may be seen, the farthest first so that nearer ones are drawn over them.
    fn lamps_by_distance(&self, pose: &Isometry3<f64>) -> Vec<&Shining> {
        let eye = Point3::from(pose.translation.vector);
        let away = |lamp: &Shining| (lamp.centre - eye).norm();
        // Through a frame a train moves by a few metres.
        let reach = super::constants::LAMP_SIGHT_M + 20.0;
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
        let segment = self.tunnel.segment_of(&eye, None);
        let width = camera.width_px as usize;
        (0..width * camera.height_px as usize)
            .into_par_iter()
            .with_min_len(width.max(1))
            .map(|k| {
                let pencil = Pencil::through(camera, pose, (k % width, k / width), 1.0);
                self.ground(segment, &eye, &pencil)
            })
            .collect()
    }

    /// The tunnel along one ray.
    fn ground(&self, segment: usize, eye: &Point3<f64>, pencil: &Pencil) -> Ground {
        let ray = &pencil.ray;
        let Some(hit) = self.tunnel.cast(segment, eye, ray, SIGHT_M / ray.norm()) else {
            return Ground {
                hit: None,
                albedo: 0.0,
                luminance: 0.0,
            };
        };
        let at = self.tunnel.surface_at(eye, ray, &hit);
        let albedo = look::albedo(&self.paintings, &at, ray, hit.t, pencil.aside)
            * self.wet.albedo_factor(at.material, at.s_m);
        let lux = self.line.ambient_lx + self.lamps.irradiance_lx(&at.position, &at.normal);
        Ground {
            hit: Some(hit),
            albedo,
            luminance: albedo * lux / PI,
        }
    }
}

/// What a pixel sees: the ray through its centre, scaled to z = 1 in the camera's frame, and by
/// how much it changes over the pixel's width and height.
struct Pencil {
    ray: Vector3<f64>,
    aside: [Vector3<f64>; 2],
}

impl Pencil {
    /// Of a square of `side_px` pixels around a pixel.
    fn through(
        camera: &Intrinsics,
        pose: &Isometry3<f64>,
        (u, v): (usize, usize),
        side_px: f64,
    ) -> Self {
        let (u, v, half) = (u as f64, v as f64, 0.5 * side_px);
        let ray = |du: f64, dv: f64| pose * camera.ray(u + du, v + dv);
        Self {
            ray: ray(0.0, 0.0),
            aside: [
                ray(half, 0.0) - ray(-half, 0.0),
                ray(0.0, half) - ray(0.0, -half),
            ],
        }
    }
}

impl<'a> Scenery<'a> {
    fn new(world: &'a World, job: &'a Job, view: &View, segment: usize) -> Self {
        let s_m = world.tunnel.chainage_m(segment);
        Self {
            job,
            shades: Shades::new(world, job, view, segment),
            airlight_cd_m2: world.lamps.airlight_cd_m2(&world.line, s_m),
            segment,
            lamps: world.lamps_about(view),
        }
    }
}

impl<'a> RowRays<'a> {
    fn new(
        world: &'a World,
        scenery: &'a Scenery<'a>,
        view: &'a View,
        row: &'a RowExposure,
        behind: Behind<'a>,
    ) -> Self {
        let eye = Point3::from(row.mid.translation.vector);
        let mid = view.start.plus(row.mid_s);
        Self {
            world,
            scenery,
            view,
            row,
            segment: world.tunnel.segment_of(&eye, Some(scenery.segment)),
            blockers: scenery.shades.blockers(mid.since(scenery.job.time)),
            blinking: Blinking::new(world.lamps.lamps(), &scenery.lamps, view, row),
            eye,
            behind,
            side_px: 1.0,
        }
    }

    /// Along the axis of pixel `u`, scaled to z = 1 in the camera's frame.
    fn ray(&self, u: usize) -> Vector3<f64> {
        let camera = &self.view.camera.intrinsics;
        self.row.mid * camera.ray(u as f64, self.row.v as f64)
    }

    /// Whether pixel `u` sees a surface that may mirror a lamp.
    fn may_mirror(&self, u: usize) -> bool {
        let (tunnel, ray) = (&self.world.tunnel, self.ray(u));
        let hit = tunnel.cast(self.segment, &self.eye, &ray, SIGHT_M / ray.norm());
        hit.is_some_and(|hit| tunnel.is_level(&hit))
    }

    /// Luminance and depth of the tunnel in pixel `u`.
    fn tunnel(&self, u: usize) -> (f64, f64) {
        let camera = &self.view.camera.intrinsics;
        let ground = match self.behind {
            Behind::Kept(ground) => ground[self.row.v * camera.width_px as usize + u],
            _ => {
                let pixel = (u, self.row.v);
                let pencil = Pencil::through(camera, &self.row.mid, pixel, self.side_px);
                (self.world).ground(self.segment, &self.eye, &pencil)
            }
        };
        let Some(hit) = &ground.hit else {
            return (ground.luminance, f64::INFINITY);
        };
        let Scenery { job, shades, .. } = self.scenery;
        let (mut luminance, segment) = (ground.luminance, hit.segment as usize);
        let lit_by_job = !job.headlights.is_empty() || !shades.leave_alone(segment);
        let level = self.world.tunnel.is_level(hit);
        if lit_by_job || level || self.blinking.shows {
            let at = (self.world.tunnel).surface_at(&self.eye, &self.ray(u), hit);
            let lux = self.by_job_lx(segment, &at.position, &at.normal);
            luminance += ground.albedo * lux / PI + self.mirrored_cd_m2(&at);
        }
        (luminance, hit.t)
    }

    /// What a job's headlights and bodies change in the illuminance of a surface, and the blinking of
    /// lamps.
    fn by_job_lx(&self, segment: usize, p: &Point3<f64>, n: &Vector3<f64>) -> f64 {
        let (world, Scenery { job, shades, .. }) = (self.world, self.scenery);
        let blinking_lx = if self.blinking.shows {
            (world.lamps).flickering_lx(p, n, &self.blinking.flicker)
        } else {
            0.0
        };
        blinking_lx + headlights_lx(&job.headlights, &world.air, p, n)
            - shades.hidden_lx(segment, (p, n), (&self.blockers, &self.blinking), world)
    }

    /// Luminance of what the tunnel's surface mirrors.
    fn mirrored_cd_m2(&self, at: &SurfacePoint) -> f64 {
        let (world, air) = (self.world, &self.world.air);
        let wet = world.wet.at(at.s_m);
        let Some(gloss) = Gloss::of(at.material, wet, &at.normal) else {
            return 0.0;
        };
        let facing = Facing::new(at.normal, &at.along());
        let (place, to_eye) = (&at.position, self.eye - at.position);
        let lamps = self.scenery.lamps.iter().filter_map(|k| {
            let lamp = &world.lamps.lamps()[*k];
            let near = (lamp.centre - place).norm_squared() < MIRROR_REACH_M * MIRROR_REACH_M;
            let share = lamp.duty() * (1.0 + self.blinking.flicker[*k]);
            near.then(|| Source::lamp(lamp, share, air, place))
        });
        let headlights = self.scenery.job.headlights.iter();
        let headlights = headlights.map(|light| Source::headlight(light, air, place));
        lamps
            .chain(headlights)
            .map(|source| gloss.luminance_cd_m2(&facing, &to_eye, &source))
            .sum()
    }

    /// Depth of what is seen in pixel `u` so far; followed up now where the tunnel was too dark
    /// to care.
    fn depth(&self, u: usize, depths: &mut [f64]) -> f64 {
        if depths[u].is_nan() {
            let ray = self.ray(u);
            let hit = (self.world.tunnel).cast(self.segment, &self.eye, &ray, SIGHT_M / ray.norm());
            depths[u] = hit.map_or(f64::INFINITY, |s| s.t);
        }
        depths[u]
    }

    /// Luminance of every pixel of the row, into the buffers.
    fn draw(&self, lamps: &[&Shining], spread: &Spread, buffers: &mut RowBuffers) {
        self.draw_tunnel(buffers);
        let view = self.view;
        for blocker in &self.blockers {
            self.draw_solid(&blocker.solid, buffers);
        }
        self.veil(buffers);
        let RowBuffers {
            depths, luminances, ..
        } = buffers;
        for lamp in lamps {
            let depth = |u| self.depth(u, depths);
            lamps::draw_disc(
                lamp,
                view,
                spread,
                self.row,
                (self.world.line.ambient_lx, self.haze(lamp)),
                depth,
                luminances,
            );
        }
        for lamp in lamps {
            lamps::add_glare(lamp, view, self.row, self.haze(lamp), luminances);
        }
    }

    fn draw_tunnel(&self, buffers: &mut RowBuffers) {
        let RowBuffers {
            depths, luminances, ..
        } = buffers;
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
                    None => self.tunnel(u),
                };
                luminances.push(luminance);
                depths.push(depth);
            }
        }
    }

    fn draw_solid(&self, solid: &Solid<'_>, buffers: &mut RowBuffers) {
        let (world, camera) = (self.world, &self.view.camera.intrinsics);
        let outline = Outline::of(solid.corners(), camera, &self.row.mid);
        for u in outline.columns(self.row.v, camera.width_px as usize) {
            let ray = self.ray(u);
            let Some((t, normal)) = solid.cast(&self.eye, &ray) else {
                continue;
            };
            if t < self.depth(u, &mut buffers.depths) && t * ray.norm() < SIGHT_M {
                let at = self.eye + ray * t;
                let segment = world.tunnel.segment_of(&at, Some(self.segment));
                let lux = world.line.ambient_lx
                    + world.lamps.irradiance_lx(&at, &normal)
                    + self.by_job_lx(segment, &at, &normal);
                let body = solid.body();
                buffers.depths[u] = t;
                buffers.luminances[u] = body.luminance_cd_m2 + body.albedo * lux / PI;
            }
        }
    }

    /// Draws the air before all surfaces.
    fn veil(&self, buffers: &mut RowBuffers) {
        let (air, airlight) = (&self.world.air, self.scenery.airlight_cd_m2);
        if air.is_clear() {
            return;
        }
        for u in 0..buffers.luminances.len() {
            let depth = self.depth(u, &mut buffers.depths);
            let clear = air.transmission(depth * self.ray(u).norm());
            let luminance = &mut buffers.luminances[u];
            *luminance = *luminance * clear + airlight * (1.0 - clear);
        }
    }

    /// What is before a lamp's disc.
    fn haze(&self, lamp: &LampLight) -> Haze {
        let clear = (self.world.air).transmission((lamp.centre - self.eye).norm());
        Haze {
            clear,
            light_cd_m2: self.scenery.airlight_cd_m2 * (1.0 - clear),
        }
    }
}

#[cfg(test)]
mod tests;
