//! All that stands still, as rays see it.

use crate::bus::Intrinsics;
use crate::track::Material;
use crate::twin::geometry::{RayStart, Sight, SurfacePoint, TunnelCaster, TunnelHit};
use crate::twin::render::constants::{LAMP_SIGHT_M, MIN_SINE, SIGHT_M};
use crate::twin::render::daylight::Daylight;
use crate::twin::render::gloss::MIRROR_REACH_M;
use crate::twin::render::lit_scene::LitScene;
use crate::twin::render::photometry::BlinkingLamp;
use crate::twin::render::{Scene, View};
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// A scene that rays are cast into.
pub(super) struct CastScene {
    /// Its light and paint.
    pub lit: LitScene,
    /// Its surface.
    pub tunnel: TunnelCaster,
}

/// The tunnel through one pixel.
#[derive(Clone, Copy, Default)]
pub(super) struct TunnelPixel {
    /// Depth along the camera's axis and facet, or nothing within sight.
    pub hit: Option<TunnelHit>,
    pub albedo: f64,
    /// By ambient light and lamps.
    pub luminance: f64,
}

impl TunnelPixel {
    /// Of sky, or of ground far away.
    fn beyond(daylight: Option<&Daylight>, ray: &Vector3<f64>) -> Self {
        Self {
            luminance: daylight.map_or(0.0, |daylight| daylight.beyond_cd_m2(ray)),
            ..Self::default()
        }
    }
}

/// The ray through the centre of a pixel, scaled to z = 1 in the camera's frame, and by how much it
/// changes over the pixel's width and height (Igehy, "Tracing ray differentials", SIGGRAPH 1999).
pub(super) struct RayDifferential {
    ray: Vector3<f64>,
    aside: [Vector3<f64>; 2],
}

impl RayDifferential {
    /// Of a square of `side_px` pixels around a pixel.
    pub fn through(
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

impl CastScene {
    /// Of a scene.
    pub fn new(scene: Scene) -> Self {
        let lit = LitScene::new(scene);
        Self {
            tunnel: TunnelCaster::new(&lit.tracks),
            lit,
        }
    }

    /// Takes another scene.
    pub fn replace(&mut self, scene: Scene) {
        self.lit.replace(scene);
        self.tunnel = TunnelCaster::new(&self.lit.tracks);
    }

    /// Indices of the lamps whose light a view shows on surfaces.
    pub fn lamps_about(&self, view: &View) -> Vec<usize> {
        let Some(pose) = view.motion.poses.first() else {
            return Vec::new();
        };
        let reach_m = SIGHT_M + MIRROR_REACH_M;
        let away_m = |lamp: &BlinkingLamp| (lamp.centre.coords - pose.translation.vector).norm();
        let lamps = self.lit.lamps.lamps().iter().enumerate();
        lamps
            .filter(|(_, lamp)| away_m(lamp) < reach_m)
            .map(|(k, _)| k)
            .collect()
    }

    /// Lamps that may be seen, the farthest first so that nearer ones are drawn over them.
    pub fn lamps_by_distance(&self, pose: &Isometry3<f64>) -> Vec<&BlinkingLamp> {
        let eye = Point3::from(pose.translation.vector);
        let away = |lamp: &BlinkingLamp| (lamp.centre - eye).norm();
        // Through a frame a train moves by a few metres.
        let reach = LAMP_SIGHT_M + 20.0;
        let mut lamps: Vec<_> = self
            .lit
            .lamps
            .lamps()
            .iter()
            .filter(|l| away(l) < reach)
            .collect();
        lamps.sort_by(|a, b| away(b).total_cmp(&away(a)));
        lamps
    }

    pub fn all_pixels(&self, camera: &Intrinsics, pose: &Isometry3<f64>) -> Vec<TunnelPixel> {
        let eye = Point3::from(pose.translation.vector);
        let ray_start = self.tunnel.ray_start(&eye, None);
        let width = camera.width_px as usize;
        (0..width * camera.height_px as usize)
            .into_par_iter()
            .with_min_len(width.max(1))
            .map(|k| {
                let ray = RayDifferential::through(camera, pose, (k % width, k / width), 1.0);
                self.pixel(ray_start, &eye, &ray)
            })
            .collect()
    }

    /// The tunnel along one ray.
    pub fn pixel(
        &self,
        ray_start: RayStart,
        eye: &Point3<f64>,
        pixel: &RayDifferential,
    ) -> TunnelPixel {
        let ray = &pixel.ray;
        let hit = match self.tunnel.look(ray_start, eye, ray, SIGHT_M / ray.norm()) {
            Sight::Surface(hit) => hit,
            Sight::Open => return TunnelPixel::beyond(self.lit.daylight.as_ref(), ray),
            Sight::Dark => return TunnelPixel::default(),
        };
        let at = self.tunnel.surface_at(eye, ray, &hit);
        let albedo = self.albedo(&at, ray, hit.t, pixel.aside)
            * self.lit.wet.albedo_factor(at.material, at.track, at.s_m);
        let section = &self.lit.tracks[at.track].sections[at.range].section;
        let surroundings = self.lit.surroundings_in((at.track, section), &at.position);
        let lux = surroundings.on_surface_lx(&at.position, &at.normal)
            + self.lit.lamps.irradiance_lx(&at.position, &at.normal);
        TunnelPixel {
            hit: Some(hit),
            albedo,
            luminance: albedo * lux / PI,
        }
    }

    /// Mean albedo in a pixel whose ray struck at `at` with `t` of its length, and changes by `aside`
    /// over the pixel's width and over its height.
    fn albedo(
        &self,
        at: &SurfacePoint,
        ray: &Vector3<f64>,
        t: f64,
        aside: [Vector3<f64>; 2],
    ) -> f64 {
        let paintings = &self.lit.paintings;
        let painting = &paintings.all[paintings.of_range[at.track][at.painted_range]];
        let begin_m = match at.material {
            Material::Rail => painting.rail_q_m(),
            _ => 0.0,
        };
        let across = aside.map(|step| footprint(at, ray, t, &step));
        let [s_m, q_m] = at.painted_m;
        painting.mean_over([s_m, begin_m + q_m], across)
    }
}

/// By how much (s, q) changes where the ray turns by `step`: the point runs along the facet's
/// plane, which a pixel sees at [`MIN_SINE`] or steeper.
fn footprint(at: &SurfacePoint, ray: &Vector3<f64>, t: f64, step: &Vector3<f64>) -> [f64; 2] {
    let towards = at.normal.dot(ray);
    let least = MIN_SINE * ray.norm();
    let slope = at.normal.dot(step) / towards.abs().max(least).copysign(towards);
    let moved = (step - ray * slope) * t;
    at.gradients.map(|g| g.dot(&moved))
}
