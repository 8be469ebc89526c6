//! The rays of one row through tunnel and bodies, and the light that they meet.

use super::blinking::Blinking;
use super::cast_scene::{CastScene, RayDifferential, TunnelPixel};
use super::dim::{CELL_PX, DimView};
use super::lamps::{self, Haze, RowExposure};
use super::shadow::{BodyShadows, RowShadows};
use super::spread::BlurSamples;
use crate::twin::geometry::{RayStart, Solid, SurfacePoint};
use crate::twin::lights::LampLight;
use crate::twin::render::constants::SIGHT_M;
use crate::twin::render::gloss::{Facing, Gloss, MIRROR_REACH_M, MirroredLight};
use crate::twin::render::image_bounds::ImageBounds;
use crate::twin::render::light_source::LightSource;
use crate::twin::render::lit_scene::BODIES_TRACK;
use crate::twin::render::photometry::{BlinkingLamp, headlights_lx};
use crate::twin::render::{Job, View};
use nalgebra::{Point3, Vector3};
use std::f64::consts::PI;

/// What a view adds to the tunnel.
pub(super) struct ViewContext<'a> {
    job: &'a Job,
    shadows: BodyShadows<'a>,
    airlight_cd_m2: f64,
    /// Segment of the first pose.
    ray_start: RayStart,
    /// Indices of the lamps whose blinking may show.
    lamps: Vec<usize>,
}

/// What is known of the tunnel in a view before its rows are drawn.
#[derive(Clone, Copy)]
pub(super) enum KnownTunnel<'a> {
    /// All of it.
    Kept(&'a [TunnelPixel]),
    /// Where it is dark, and how dark.
    Dim(&'a DimView),
    /// Nothing.
    Unknown,
}

/// A row while it is drawn.
#[derive(Default)]
pub(super) struct RowBuffers {
    /// Of the nearest surface; not a number where nobody has asked yet.
    depths: Vec<f64>,
    pub luminances: Vec<f64>,
}

/// The rays of a row through the tunnel.
pub(super) struct RowRays<'a> {
    scene: &'a CastScene,
    context: &'a ViewContext<'a>,
    view: &'a View,
    row: &'a RowExposure,
    known: KnownTunnel<'a>,
    eye: Point3<f64>,
    ray_start: RayStart,
    /// Of the job's bodies as they are by now.
    shadows: RowShadows<'a>,
    blinking: Blinking,
    /// Patterns are averaged over squares of so many pixels.
    side_px: f64,
}

impl<'a> ViewContext<'a> {
    /// Of a view whose rays begin there.
    pub fn new(scene: &'a CastScene, job: &'a Job, view: &View, ray_start: RayStart) -> Self {
        let lamps = scene.lamps_about(view);
        Self {
            job,
            shadows: BodyShadows::new(scene, job, &lamps),
            airlight_cd_m2: scene
                .lit
                .airlight_cd_m2(ray_start.track, scene.tunnel.chainage_m(ray_start)),
            ray_start,
            lamps,
        }
    }
}

impl<'a> RowRays<'a> {
    pub fn new(
        scene: &'a CastScene,
        context: &'a ViewContext<'a>,
        view: &'a View,
        row: &'a RowExposure,
        known: KnownTunnel<'a>,
    ) -> Self {
        let eye = Point3::from(row.mid.translation.vector);
        let mid = view.start.plus(row.mid_s);
        Self {
            scene,
            context,
            view,
            row,
            ray_start: scene.tunnel.ray_start(&eye, Some(context.ray_start)),
            shadows: context.shadows.at(mid.since(context.job.time)),
            blinking: Blinking::new(scene.lit.lamps.lamps(), &context.lamps, view, row),
            eye,
            known,
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
        let (tunnel, ray) = (&self.scene.tunnel, self.ray(u));
        let hit = tunnel.cast(self.ray_start, &self.eye, &ray, SIGHT_M / ray.norm());
        hit.is_some_and(|hit| tunnel.is_level(&hit))
    }

    /// Luminance and depth of the tunnel in pixel `u`.
    fn tunnel(&self, u: usize) -> (f64, f64) {
        let camera = &self.view.camera.intrinsics;
        let ground = match self.known {
            KnownTunnel::Kept(ground) => ground[self.row.v * camera.width_px as usize + u],
            _ => {
                let pixel = (u, self.row.v);
                let ray = RayDifferential::through(camera, &self.row.mid, pixel, self.side_px);
                (self.scene).pixel(self.ray_start, &self.eye, &ray)
            }
        };
        let Some(hit) = &ground.hit else {
            return (ground.luminance, f64::INFINITY);
        };
        let mut luminance = ground.luminance;
        let lit_by_job = !self.context.job.headlights.is_empty() || !self.shadows.is_empty();
        let level = self.scene.tunnel.is_level(hit);
        if lit_by_job || level || self.blinking.shows {
            let at = (self.scene.tunnel).surface_at(&self.eye, &self.ray(u), hit);
            let lux = self.by_job_lx(&at.position, &at.normal);
            luminance += ground.albedo * lux / PI + self.mirrored_cd_m2(&at);
        }
        (luminance, hit.t)
    }

    /// What a job's headlights and bodies change in the illuminance of a surface, and the blinking of
    /// lamps.
    fn by_job_lx(&self, p: &Point3<f64>, n: &Vector3<f64>) -> f64 {
        let lit = &self.scene.lit;
        let blinking_lx = if self.blinking.shows {
            (lit.lamps).flickering_lx(p, n, &self.blinking.flicker)
        } else {
            0.0
        };
        blinking_lx + headlights_lx(&self.context.job.headlights, &lit.air, p, n)
            - self.shadows.hidden_lx(p, n, &self.blinking)
    }

    /// Luminance of what the tunnel's surface mirrors.
    fn mirrored_cd_m2(&self, at: &SurfacePoint) -> f64 {
        let (scene, air) = (self.scene, &self.scene.lit.air);
        let wet = scene.lit.wet.at(at.track, at.s_m);
        let Some(gloss) = Gloss::of(at.material, wet, &at.normal) else {
            return 0.0;
        };
        let facing = Facing::new(at.normal, &at.along());
        let (place, to_eye) = (&at.position, self.eye - at.position);
        let lamps = self.context.lamps.iter().filter_map(|k| {
            let lamp = &scene.lit.lamps.lamps()[*k];
            let near = (lamp.centre - place).norm_squared() < MIRROR_REACH_M * MIRROR_REACH_M;
            let share = lamp.duty() * (1.0 + self.blinking.flicker[*k]);
            near.then(|| (LightSource::lamp(lamp), share * lamp.axial_intensity_cd()))
        });
        let headlights = self.context.job.headlights.iter();
        let headlights = headlights.map(|l| (LightSource::headlight(l), l.intensity_cd));
        lamps
            .chain(headlights)
            .map(|(source, axial_cd)| MirroredLight::of(&source, axial_cd, air, place))
            .map(|source| gloss.luminance_cd_m2(&facing, &to_eye, &source))
            .sum()
    }

    /// Depth of what is seen in pixel `u` so far; followed up now where the tunnel was too dark
    /// to care.
    fn depth(&self, u: usize, depths: &mut [f64]) -> f64 {
        if depths[u].is_nan() {
            let ray = self.ray(u);
            let hit =
                (self.scene.tunnel).cast(self.ray_start, &self.eye, &ray, SIGHT_M / ray.norm());
            depths[u] = hit.map_or(f64::INFINITY, |s| s.t);
        }
        depths[u]
    }

    /// Luminance of the tunnel at the corners of cells along the row, in the mean light of lamps: one
    /// that is off in this row may be on in the next. Endless where a lamp may be mirrored.
    pub fn corners(mut self, corners: &mut [f64]) {
        self.side_px = CELL_PX as f64;
        self.blinking = Blinking::steady(self.scene.lit.lamps.lamps());
        for (j, corner) in corners.iter_mut().enumerate() {
            *corner = if self.may_mirror(j * CELL_PX) {
                f64::INFINITY
            } else {
                self.tunnel(j * CELL_PX).0
            };
        }
    }

    /// Luminance of every pixel of the row, into the buffers.
    pub fn luminances(
        &self,
        lamps: &[&BlinkingLamp],
        spread: &BlurSamples,
        buffers: &mut RowBuffers,
    ) {
        self.draw_tunnel(buffers);
        let view = self.view;
        for body in &self.shadows.bodies {
            self.draw_solid(&body.solid, buffers);
        }
        self.veil(buffers);
        let RowBuffers { depths, luminances } = buffers;
        for lamp in lamps {
            let depth = |u| self.depth(u, depths);
            lamps::draw_disc(
                lamp,
                view,
                spread,
                self.row,
                (
                    (self.scene.lit.surroundings_on(BODIES_TRACK, &lamp.centre))
                        .on_surface_lx(&lamp.centre, &lamp.facing),
                    self.haze(lamp),
                ),
                depth,
                luminances,
            );
        }
        for lamp in lamps {
            lamps::add_glare(lamp, view, self.row, self.haze(lamp), luminances);
        }
    }

    fn draw_tunnel(&self, buffers: &mut RowBuffers) {
        let RowBuffers { depths, luminances } = buffers;
        depths.clear();
        luminances.clear();
        let width = self.view.camera.intrinsics.width_px as usize;
        for begin in (0..width).step_by(CELL_PX) {
            let sides = match self.known {
                KnownTunnel::Dim(dim) => dim.sides(begin / CELL_PX, self.row.v),
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
        let (scene, camera) = (self.scene, &self.view.camera.intrinsics);
        let bounds = ImageBounds::of(solid.corners(), camera, &self.row.mid);
        let surroundings = (scene.lit).surroundings_on(
            BODIES_TRACK,
            &solid.body().world_from_body.translation.vector.into(),
        );
        for u in bounds.columns(self.row.v, camera.width_px as usize) {
            let ray = self.ray(u);
            let Some((t, normal)) = solid.cast(&self.eye, &ray) else {
                continue;
            };
            if t < self.depth(u, &mut buffers.depths) && t * ray.norm() < SIGHT_M {
                let at = self.eye + ray * t;
                let lux = surroundings.on_surface_lx(&at, &normal)
                    + scene.lit.lamps.irradiance_lx(&at, &normal)
                    + self.by_job_lx(&at, &normal);
                let body = solid.body();
                buffers.depths[u] = t;
                buffers.luminances[u] = body.luminance_cd_m2 + body.albedo * lux / PI;
            }
        }
    }

    /// Draws the air before all surfaces.
    fn veil(&self, buffers: &mut RowBuffers) {
        let (air, airlight) = (&self.scene.lit.air, self.context.airlight_cd_m2);
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
        let clear = (self.scene.lit.air).transmission((lamp.centre - self.eye).norm());
        Haze {
            clear,
            light_cd_m2: self.context.airlight_cd_m2 * (1.0 - clear),
        }
    }
}
