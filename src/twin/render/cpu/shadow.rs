//! Shadows: which share of a light's disc bodies hide from a point.
//!
//! What is hidden is defined in [`photometry`](crate::twin::render::photometry): lines from the point
//! to places on the disc.

use super::blinking::Blinking;
use super::cast_scene::CastScene;
use crate::twin::air::Air;
use crate::twin::geometry::{Body, Solid};
use crate::twin::render::Job;
use crate::twin::render::disc::{DISC_PLACES, disc_points};
use crate::twin::render::light_source::LightSource;
use crate::twin::render::photometry::OFFSET_M;
use nalgebra::{Point3, Vector3};

/// A light with the places on its disc.
pub(super) struct ShadowLight<'a> {
    source: LightSource<'a>,
    places: Vec<Point3<f64>>,
    /// Number of the lamp, where it is one.
    lamp: Option<usize>,
}

/// The lights of a view that has bodies in it, and a body at one instant with a ball around it.
pub(super) struct BodyShadows<'a> {
    lights: Vec<ShadowLight<'a>>,
    bodies: &'a [Body],
    air: Air,
}

/// A body at one instant, in a ball.
pub(super) struct BodyBall<'a> {
    pub solid: Solid<'a>,
    centre: Point3<f64>,
    radius_m: f64,
}

/// The shadows while one row is exposed.
pub(super) struct RowShadows<'a> {
    /// All bodies.
    pub bodies: Vec<BodyBall<'a>>,
    /// The lights that shine on bodies, and the numbers of these.
    falling: Vec<(&'a ShadowLight<'a>, Vec<usize>)>,
    air: Air,
}

impl<'a> ShadowLight<'a> {
    fn new(source: LightSource<'a>, lamp: Option<usize>) -> Self {
        let places = disc_points(&source.centre, &source.axis, source.radius_m, DISC_PLACES);
        Self {
            places: places.collect(),
            source,
            lamp,
        }
    }

    /// Share of the disc that bodies hide from a point of a surface with unit normal `n`.
    fn hidden_share<'b>(
        &self,
        p: &Point3<f64>,
        n: &Vector3<f64>,
        bodies: impl Iterator<Item = &'b BodyBall<'b>> + Clone,
    ) -> f64 {
        let from = p + n * OFFSET_M;
        let between = bodies.filter(|b| b.may_hide(&from, &self.source));
        if between.clone().next().is_none() {
            return 0.0;
        }
        let hidden = self.places.iter().filter(|place| {
            let to = *place - from;
            let hides = |b: &BodyBall<'_>| (b.solid.cast(&from, &to)).is_some_and(|(t, _)| t < 1.0);
            between.clone().any(hides)
        });
        hidden.count() as f64 / self.places.len() as f64
    }
}

impl<'a> BodyBall<'a> {
    /// So long after the body's pose was true.
    fn at(body: &'a Body, after_s: f64) -> Self {
        Self {
            solid: Solid::at(body, after_s),
            centre: Point3::from(body.world_from_body.translation.vector)
                + body.velocity_mps * after_s,
            radius_m: body.shape.half_extents_m().norm(),
        }
    }

    /// Whether the ball reaches into the cone from a point to a light's disc.
    fn may_hide(&self, from: &Point3<f64>, source: &LightSource<'_>) -> bool {
        let (to, off) = (source.centre - from, self.centre - from);
        let share = (off.dot(&to) / to.norm_squared()).clamp(0.0, 1.0);
        let reach = self.radius_m + source.radius_m * share;
        (off - to * share).norm_squared() < reach * reach
    }
}

impl<'a> BodyShadows<'a> {
    /// Of a job, with the lamps of these numbers.
    pub fn new(scene: &'a CastScene, job: &'a Job, lamps: &[usize]) -> Self {
        let mut lights = Vec::new();
        if !job.bodies.is_empty() {
            let all = scene.lit.lamps.lamps();
            let lamp = |k: &usize| ShadowLight::new(LightSource::lamp(&all[*k]), Some(*k));
            let headlight = |light| ShadowLight::new(LightSource::headlight(light), None);
            lights.extend(lamps.iter().map(lamp));
            lights.extend(job.headlights.iter().map(headlight));
        }
        Self {
            lights,
            bodies: &job.bodies,
            air: scene.lit.air,
        }
    }

    /// So long after the job's time.
    pub fn at(&'a self, after_s: f64) -> RowShadows<'a> {
        let bodies: Vec<_> = (self.bodies.iter())
            .map(|body| BodyBall::at(body, after_s))
            .collect();
        let falling = self.lights.iter().filter_map(|light| {
            let shaded = |k: &usize| {
                let (body, source) = (&bodies[*k], &light.source);
                let wide_m = body.radius_m + source.radius_m;
                !source.is_carried_by(body.solid.body())
                    && source.may_light(&body.centre, wide_m, None)
            };
            let shaded: Vec<_> = (0..bodies.len()).filter(shaded).collect();
            (!shaded.is_empty()).then_some((light, shaded))
        });
        RowShadows {
            falling: falling.collect(),
            bodies,
            air: self.air,
        }
    }
}

impl RowShadows<'_> {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.falling.is_empty()
    }

    /// Illuminance that bodies take from a point of a surface.
    pub fn hidden_lx(&self, p: &Point3<f64>, n: &Vector3<f64>, blinking: &Blinking) -> f64 {
        (self.falling.iter())
            .filter(|(light, _)| light.source.may_light(p, 0.0, Some(n)))
            .map(|(light, bodies)| {
                let bodies = bodies.iter().map(|k| &self.bodies[*k]);
                let share = light.hidden_share(p, n, bodies);
                if share <= 0.0 {
                    return 0.0;
                }
                // Headlights do not blink.
                let flicker = (light.lamp).map_or(0.0, |k| blinking.flicker[k]);
                let lux = light.source.irradiance_lx(p, n) * (1.0 + flicker);
                share * lux * self.air.transmission((p - light.source.centre).norm())
            })
            .sum()
    }
}

#[cfg(test)]
mod tests;
