//! Shadows: which share of a light's disc bodies hide from a point.
//!
//! What is hidden is defined in [`photometry`](crate::twin::render::photometry): lines from the point
//! to places on the disc. The oracle asks so about every light and every body. The quick renderer asks
//! about those alone that [`ShadowLists`] has for a segment of the tunnel.

mod lists;

use super::blinking::Blinking;
use super::cast_scene::CastScene;
use crate::twin::geometry::{Body, Solid};
use crate::twin::lights::{HEADLIGHT_RADIUS_M, Headlight};
use crate::twin::render::disc::{DISC_PLACES, disc_places};
use crate::twin::render::photometry::{BlinkingLamp, LAMP_REACH_M, OFFSET_M};
use crate::twin::render::{Job, View};
use lists::ShadowLists;
use nalgebra::{Point3, Vector3};

/// A light with the places on its disc.
pub(super) struct ShadowLight<'a> {
    kind: Kind<'a>,
    centre: Point3<f64>,
    axis: Vector3<f64>,
    radius_m: f64,
    reach_m: f64,
    places: [Point3<f64>; DISC_PLACES],
}

enum Kind<'a> {
    Lamp(&'a BlinkingLamp),
    Headlight(&'a Headlight),
}

/// The lights and bodies of a job that may make shadows in a view.
pub(super) struct BodyShadows<'a> {
    scene: &'a CastScene,
    /// Lamps in the order of the scene, then headlights.
    lights: Vec<ShadowLight<'a>>,
    /// Each with the radius of a ball around it.
    bodies: Vec<(&'a Body, f64)>,
    /// None for the oracle.
    lists: Option<ShadowLists>,
}

/// A body at one instant, in a ball.
pub(super) struct Blocker<'a> {
    pub solid: Solid<'a>,
    centre: Point3<f64>,
    radius_m: f64,
}

impl<'a> ShadowLight<'a> {
    pub fn lamp(lamp: &'a BlinkingLamp) -> Self {
        let (axis, radius_m) = (lamp.facing.into_inner(), lamp.radius_m);
        let kind = Kind::Lamp(lamp);
        Self::new(kind, lamp.centre, axis, radius_m, LAMP_REACH_M)
    }

    pub fn headlight(light: &'a Headlight) -> Self {
        let (centre, axis) = (light.place(), light.axis());
        let kind = Kind::Headlight(light);
        Self::new(kind, centre, axis, HEADLIGHT_RADIUS_M, f64::INFINITY)
    }

    fn new(
        kind: Kind<'a>,
        centre: Point3<f64>,
        axis: Vector3<f64>,
        radius_m: f64,
        reach_m: f64,
    ) -> Self {
        Self {
            kind,
            centre,
            axis,
            radius_m,
            reach_m,
            places: disc_places(&centre, &axis, radius_m),
        }
    }

    fn irradiance_lx(&self, p: &Point3<f64>, n: &Vector3<f64>) -> f64 {
        match self.kind {
            Kind::Lamp(lamp) => lamp.irradiance_lx(p, n),
            Kind::Headlight(light) => light.irradiance_lx(p, n),
        }
    }

    fn is_carried_by(&self, body: &Body) -> bool {
        matches!(self.kind, Kind::Headlight(light) if light.is_carried_by(body))
    }

    /// Share of the disc that bodies hide from a point of a surface with unit normal `n`.
    pub fn hidden_share<'b>(
        &self,
        p: &Point3<f64>,
        n: &Vector3<f64>,
        blockers: impl Iterator<Item = &'b Blocker<'b>> + Clone,
    ) -> f64 {
        let from = p + n * OFFSET_M;
        let between = blockers.filter(|b| b.may_hide(&from, self));
        if between.clone().next().is_none() {
            return 0.0;
        }
        let hidden = self.places.iter().filter(|place| {
            let to = *place - from;
            let hides = |b: &Blocker<'_>| (b.solid.cast(&from, &to)).is_some_and(|(t, _)| t < 1.0);
            between.clone().any(hides)
        });
        hidden.count() as f64 / self.places.len() as f64
    }

    /// Whether it may light a point of a surface.
    fn may_light(&self, p: &Point3<f64>, n: &Vector3<f64>) -> bool {
        let from = p - self.centre;
        n.dot(&from) < 0.0
            && self.axis.dot(&from) > 0.0
            && from.norm_squared() <= self.reach_m * self.reach_m
    }
}

impl<'a> Blocker<'a> {
    pub fn at(body: &'a Body, radius_m: f64, after_s: f64) -> Self {
        Self {
            solid: Solid::at(body, after_s),
            centre: Point3::from(body.world_from_body.translation.vector)
                + body.velocity_mps * after_s,
            radius_m,
        }
    }

    /// Whether the ball around it reaches into the cone from a point to a light's disc.
    fn may_hide(&self, from: &Point3<f64>, source: &ShadowLight<'_>) -> bool {
        let (to, off) = (source.centre - from, self.centre - from);
        let share = (off.dot(&to) / to.norm_squared()).clamp(0.0, 1.0);
        let reach = self.radius_m + source.radius_m * share;
        (off - to * share).norm_squared() < reach * reach
    }
}

impl<'a> BodyShadows<'a> {
    /// Of a view from somewhere in a segment; with lists for a quick picture.
    pub fn new(
        scene: &'a CastScene,
        job: &'a Job,
        view: &View,
        segment: usize,
        quick: bool,
    ) -> Self {
        let lamps = scene.lit.lamps.lamps().iter().map(ShadowLight::lamp);
        let headlights = job.headlights.iter().map(ShadowLight::headlight);
        let (lights, bodies) = if job.bodies.is_empty() {
            (Vec::new(), Vec::new())
        } else {
            let bodies = job.bodies.iter().map(|b| (b, ball_m(b)));
            (lamps.chain(headlights).collect(), bodies.collect())
        };
        let lists = quick.then(|| ShadowLists::new(scene, (&lights, &bodies), job, view, segment));
        Self {
            scene,
            lights,
            bodies,
            lists,
        }
    }

    /// The bodies so long after the job's time.
    pub fn blockers(&self, after_s: f64) -> Vec<Blocker<'a>> {
        let bodies = self.bodies.iter();
        bodies
            .map(|(body, radius)| Blocker::at(body, *radius, after_s))
            .collect()
    }

    /// Whether nothing shades a segment.
    pub fn leave_alone(&self, segment: usize) -> bool {
        match &self.lists {
            Some(lists) => lists.falling_on(segment).next().is_none(),
            None => self.bodies.is_empty(),
        }
    }

    /// Illuminance that bodies take from a point of a surface in a segment.
    pub fn hidden_lx(
        &self,
        segment: usize,
        (p, n): (&Point3<f64>, &Vector3<f64>),
        blockers: &[Blocker<'_>],
        blinking: &Blinking,
    ) -> f64 {
        let hidden_lx = |light: usize, share: f64| {
            if share <= 0.0 {
                return 0.0;
            }
            // Headlights do not blink.
            let flicker = blinking.flicker.get(light).unwrap_or(&0.0);
            let light = &self.lights[light];
            let lux = light.irradiance_lx(p, n) * (1.0 + flicker);
            share * lux * (self.scene.lit.air).transmission((p - light.centre).norm())
        };
        let lights = self.lights.iter().enumerate();
        match &self.lists {
            None => lights
                .filter(|(_, light)| light.may_light(p, n))
                .map(|(k, light)| {
                    let others = |b: &&Blocker<'_>| !light.is_carried_by(b.solid.body());
                    hidden_lx(k, light.hidden_share(p, n, blockers.iter().filter(others)))
                })
                .sum(),
            Some(lists) => (lists.falling_on(segment))
                .map(|falling| (falling.light, &self.lights[falling.light], falling))
                .filter(|(_, light, falling)| {
                    falling.may_reach(&(p - light.centre)) && light.may_light(p, n)
                })
                .map(|(k, light, falling)| {
                    let bodies = falling.bodies.iter().map(|body| &blockers[*body]);
                    hidden_lx(k, light.hidden_share(p, n, bodies))
                })
                .sum(),
        }
    }
}

/// Radius of a ball around a body's origin that holds it.
fn ball_m(body: &Body) -> f64 {
    body.shape.half_extents_m().norm()
}

#[cfg(test)]
mod tests;
