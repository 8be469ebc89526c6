//! What every pixel of a view shows, as truth for those who train and test with the pictures.
//!
//! One ray a pixel, through its centre, from where the camera is in the middle of the exposure of
//! the pixel's own row: the surface that it meets first, and how far away. Bodies are where they
//! are at that time. A camera that stands still keeps what it sees of the tunnel.
//!
//! ```
//! use metrotwin::twin::render::labels::{Labeller, Projection};
//! use metrotwin::twin::render::{Job, Scene};
//!
//! /// How far away the nearest surface is that the first camera of a job sees, metres.
//! fn nearest_m(scene: &Scene, job: &Job) -> f64 {
//!     let projection = Projection::new(&job.views[0], job.time);
//!     let labels = Labeller::new(scene).look(job, &projection);
//!     labels.depth_m.into_iter().fold(f64::INFINITY, f64::min)
//! }
//! ```
//!
//! Not here: what is between surface and camera (mist, dirt on the glass), and mixed pixels: a
//! pixel belongs to what its centre sees.

mod projection;
mod whole;

pub use projection::{Projection, Seen};
pub use whole::{Whole, whole};

use super::cache::Cache;
use super::constants::{FLUSH_M, LAMP_SIGHT_M, SIGHT_M};
use super::image_bounds::ImageBounds;
use crate::bus::{CameraModel, Intrinsics};
use crate::twin::geometry::{Body, Solid, TunnelCaster};
use crate::twin::lights::LampLight;
use crate::twin::render::{Job, Scene};
use nalgebra::{Isometry3, Point2, Point3, Vector3};
use rayon::prelude::*;

/// Views of cameras that stand still, and rays of lenses, that are kept.
const KEPT: usize = 8;

/// What a pixel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surface {
    /// Nothing within sight.
    Nothing,
    /// The tunnel, with its rails.
    Tunnel,
    /// The body of that index in the job.
    Body(u16),
    /// The luminous side of the lamp of that index in the scene.
    Lamp(u16),
}

/// What every pixel of a view shows, row by row.
pub struct Labels {
    /// Along the optical axis; infinite where nothing is within [`SIGHT_M`].
    pub depth_m: Vec<f64>,
    /// What it is.
    pub surface: Vec<Surface>,
}

/// Looks through views at the scene that it knows.
pub struct Labeller {
    tunnel: TunnelCaster,
    lamps: Vec<LampLight>,
    /// Depth of the tunnel through every pixel of cameras that stand still.
    still: Cache<(CameraModel, Isometry3<f64>), Vec<f64>>,
    /// Directions of all pixels, at depth 1: a lens with distortion is costly to invert.
    lenses: Cache<Intrinsics, Vec<[f64; 2]>>,
}

/// One row's rays.
struct LabelRow<'a> {
    v: usize,
    pose: Isometry3<f64>,
    rays: &'a [[f64; 2]],
}

/// What the pixels of a row show.
struct RowLabels<'a> {
    depth_m: &'a mut [f64],
    surface: &'a mut [Surface],
}

impl LabelRow<'_> {
    fn eye(&self) -> Point3<f64> {
        self.pose.translation.vector.into()
    }

    /// Scaled to z = 1 in the camera's frame, so that depths are multiples of it.
    fn ray(&self, u: usize) -> Vector3<f64> {
        let [x, y] = self.rays[u];
        self.pose * Vector3::new(x, y, 1.0)
    }
}

impl Labeller {
    /// Of a scene.
    pub fn new(scene: &Scene) -> Self {
        Self {
            tunnel: TunnelCaster::new(&scene.tracks),
            lamps: scene.lamps.clone(),
            still: Cache::new(KEPT),
            lenses: Cache::new(KEPT),
        }
    }

    /// What every pixel shows.
    pub fn look(&mut self, job: &Job, projection: &Projection<'_>) -> Labels {
        let camera = projection.view.camera.intrinsics;
        let rays = self.lenses.get(camera, all_rays);
        let width = camera.width_px as usize;
        let (tunnel, lamps) = (&self.tunnel, &self.lamps);
        let still = projection.view.motion.poses.len() == 1;
        let kept = still.then(|| {
            let key = (projection.view.camera, projection.pose(0.0));
            (self.still).get(key, |(_, pose)| all_depths(tunnel, *pose, rays, width))
        });
        let size = width * camera.height_px as usize;
        let mut labels = Labels {
            depth_m: vec![f64::INFINITY; size],
            surface: vec![Surface::Nothing; size],
        };
        let rows = (labels.depth_m.par_chunks_mut(width.max(1)))
            .zip(labels.surface.par_chunks_mut(width.max(1)))
            .enumerate();
        rows.for_each(|(v, (depth_m, surface))| {
            let row = LabelRow {
                v,
                pose: projection.pose(v as f64),
                rays: &rays[v * width..(v + 1) * width],
            };
            match kept {
                Some(kept) => depth_m.copy_from_slice(&kept[v * width..(v + 1) * width]),
                None => cast_tunnel(tunnel, &row, depth_m),
            }
            for (depth, surface) in depth_m.iter().zip(surface.iter_mut()) {
                if depth.is_finite() {
                    *surface = Surface::Tunnel;
                }
            }
            let mut labels = RowLabels { depth_m, surface };
            labels.put_bodies(&row, job, projection);
            labels.put_lamps(&row, lamps, projection);
        });
        labels
    }

    /// Whether nothing stands between the camera and a place that it sees in row `v`.
    pub fn sees(
        &self,
        job: &Job,
        projection: &Projection<'_>,
        v: f64,
        place: &Point3<f64>,
    ) -> bool {
        let eye = Point3::from(projection.pose(v).translation.vector);
        let way = place - eye;
        let reach = 1.0 - FLUSH_M / way.norm();
        let ray_start = self.tunnel.ray_start(&eye, None);
        let after_s = projection.after_s(v);
        let hides = |body: &Body| {
            let hit = Solid::at(body, after_s).cast(&eye, &way);
            hit.is_some_and(|(t, _)| t < reach)
        };
        self.tunnel.cast(ray_start, &eye, &way, reach).is_none() && !job.bodies.iter().any(hides)
    }

    /// The lamps, in the order of the scene.
    pub fn lamps(&self) -> &[LampLight] {
        &self.lamps
    }

    /// Where everything that a view shows is seen in another view, less where it is seen in this
    /// one, in pixels. Bodies go along with those that `same` names in the other view's job. Not a
    /// number where nothing is within sight, or the place is outside of the other image.
    pub fn flow(
        &mut self,
        (job, projection, labels): (&Job, &Projection<'_>, &Labels),
        (next_job, next): (&Job, &Projection<'_>),
        same: impl Fn(u16) -> Option<usize> + Sync,
    ) -> Vec<[f32; 2]> {
        let camera = projection.view.camera.intrinsics;
        let rays = self.lenses.get(camera, all_rays);
        let width = camera.width_px as usize;
        let (a, b) = (projection.view, next.view);
        let still = a.motion.poses.len() == 1 && (a.camera, &a.motion) == (b.camera, &b.motion);
        let goes_to = |k: usize, pose: &Isometry3<f64>| {
            let [x, y] = rays[k];
            let v = (k / width) as f64;
            let from = Point2::new((k % width) as f64, v);
            let point = pose * Point3::from(Vector3::new(x, y, 1.0) * labels.depth_m[k]);
            let seen = match labels.surface[k] {
                Surface::Nothing => None,
                Surface::Body(body) => {
                    let then = next_job.bodies.get(same(body)?)?;
                    let now = Solid::at(&job.bodies[usize::from(body)], projection.after_s(v));
                    let point = then.world_from_body * now.in_body(&point);
                    next.within_image(&point, &then.velocity_mps)
                }
                _ if still => return Some([0.0; 2]),
                _ => next.within_image(&point, &Vector3::zeros()),
            }?;
            let to = seen.pixel - from;
            Some([to.x as f32, to.y as f32])
        };
        let mut flow = vec![[f32::NAN; 2]; labels.depth_m.len()];
        let rows = flow.par_chunks_mut(width.max(1)).enumerate();
        rows.for_each(|(v, flow)| {
            let pose = projection.pose(v as f64);
            for (u, flow) in flow.iter_mut().enumerate() {
                if let Some(to) = goes_to(v * width + u, &pose) {
                    *flow = to;
                }
            }
        });
        flow
    }
}

fn all_rays(camera: &Intrinsics) -> Vec<[f64; 2]> {
    let width = camera.width_px as usize;
    let rays = (0..width * camera.height_px as usize)
        .into_par_iter()
        .with_min_len(width.max(1))
        .map(|k| {
            let ray = camera.ray((k % width) as f64, (k / width) as f64);
            [ray.x, ray.y]
        });
    rays.collect()
}

fn all_depths(
    tunnel: &TunnelCaster,
    pose: Isometry3<f64>,
    rays: &[[f64; 2]],
    width: usize,
) -> Vec<f64> {
    let mut depth_m = vec![f64::INFINITY; rays.len()];
    let rows = depth_m.par_chunks_mut(width.max(1)).enumerate();
    rows.for_each(|(v, depth_m)| {
        let rays = &rays[v * width..(v + 1) * width];
        cast_tunnel(tunnel, &LabelRow { v, pose, rays }, depth_m);
    });
    depth_m
}

fn cast_tunnel(tunnel: &TunnelCaster, row: &LabelRow<'_>, depth_m: &mut [f64]) {
    let eye = row.eye();
    let ray_start = tunnel.ray_start(&eye, None);
    for (u, depth_m) in depth_m.iter_mut().enumerate() {
        let ray = row.ray(u);
        if let Some(hit) = tunnel.cast(ray_start, &eye, &ray, SIGHT_M / ray.norm()) {
            *depth_m = hit.t;
        }
    }
}

impl RowLabels<'_> {
    /// Puts a thing over the pixels within bounds where `meets` has a depth for it, by the ray and the
    /// depth so far.
    fn put(
        &mut self,
        row: &LabelRow<'_>,
        bounds: ImageBounds,
        thing: Surface,
        meets: impl Fn(&Vector3<f64>, f64) -> Option<f64>,
    ) {
        for u in bounds.columns(row.v, row.rays.len()) {
            if let Some(depth_m) = meets(&row.ray(u), self.depth_m[u]) {
                self.depth_m[u] = depth_m;
                self.surface[u] = thing;
            }
        }
    }

    fn put_bodies(&mut self, row: &LabelRow<'_>, job: &Job, projection: &Projection<'_>) {
        let (eye, after_s) = (row.eye(), projection.after_s(row.v as f64));
        for (k, body) in job.bodies.iter().enumerate() {
            let solid = Solid::at(body, after_s);
            let camera = &projection.view.camera.intrinsics;
            let bounds = ImageBounds::of(solid.corners(), camera, &row.pose);
            self.put(row, bounds, Surface::Body(k as u16), |ray, depth_m| {
                let (t, _) = solid.cast(&eye, ray)?;
                (t < depth_m && t * ray.norm() < SIGHT_M).then_some(t)
            });
        }
    }

    fn put_lamps(&mut self, row: &LabelRow<'_>, lamps: &[LampLight], projection: &Projection<'_>) {
        for (k, lamp) in lamps.iter().enumerate() {
            let way = lamp.centre - row.eye();
            if way.norm_squared() > LAMP_SIGHT_M * LAMP_SIGHT_M || way.dot(&lamp.facing) >= 0.0 {
                continue;
            }
            let camera = &projection.view.camera.intrinsics;
            let corners = ImageBounds::cube(&lamp.centre, lamp.radius_m);
            let bounds = ImageBounds::of(corners, camera, &row.pose);
            self.put(row, bounds, Surface::Lamp(k as u16), |ray, depth_m| {
                let t = lamp.facing.dot(&way) / lamp.facing.dot(ray);
                let on_disc = (ray * t - way).norm_squared() <= lamp.radius_m * lamp.radius_m;
                (t > 0.0 && on_disc && t - FLUSH_M <= depth_m).then_some(t)
            });
        }
    }
}

#[cfg(test)]
mod tests;
