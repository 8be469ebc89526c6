//! Shadows: which share of a lamp's disc bodies hide from a point.
//!
//! What is hidden is defined in [`photometry`](crate::twin::render::photometry): rays from the point to 16
//! places on the disc. To look at every light and body for every pixel would take minutes, so it
//! is known beforehand which bodies may throw a shadow of which light into which segment of the
//! tunnel: where the ball around the segment meets the shadow of the ball around the body.

use super::blinking::Blinking;
use super::cast_scene::CastScene;
use crate::twin::geometry::{Body, Solid};
use crate::twin::lights::{HEADLIGHT_RADIUS_M, Headlight};
use crate::twin::render::constants::SIGHT_M;
use crate::twin::render::disc::{DISC_PLACES, disc_places};
use crate::twin::render::photometry::{BlinkingLamp, LAMP_REACH_M, OFFSET_M};
use crate::twin::render::{Job, View};
use nalgebra::{Point3, Vector3};
use std::f64::consts::PI;
use std::ops::Range;

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

/// A body at one instant, in a ball.
pub(super) struct Blocker<'a> {
    pub solid: Solid<'a>,
    centre: Point3<f64>,
    radius_m: f64,
}

/// The lights and bodies of a job that may make shadows in a view.
#[derive(Default)]
pub(super) struct Shades<'a> {
    sources: Vec<ShadowLight<'a>>,
    bodies: Vec<(&'a Body, f64)>,
    first_segment: usize,
    /// What falls on segment k of those in sight: `falling[begins[k]..begins[k + 1]]`.
    begins: Vec<usize>,
    falling: Vec<Falling>,
    /// Bodies, listed by what falls on segments.
    listed: Vec<usize>,
}

/// The shadows of one light that may fall on a segment.
struct Falling {
    source: usize,
    /// Of the list of bodies.
    listed: Range<usize>,
    /// A cone from the light that holds them all: its unit axis and the cosine of half its angle.
    axis: Vector3<f64>,
    cos_half: f64,
}

/// A ball of a body as a light sees it.
struct Shadow {
    source: usize,
    body: usize,
    towards: Vector3<f64>,
    /// Half the angle that it takes up.
    half_rad: f64,
    nearest_m: f64,
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

    /// A body between it and something, if its ball is within reach and not behind.
    fn shadow(&self, centre: &Point3<f64>, radius_m: f64) -> Option<(Vector3<f64>, f64, f64)> {
        let (away, radius) = (centre - self.centre, radius_m + self.radius_m);
        let distance = away.norm();
        let reached = distance - radius < self.reach_m && self.axis.dot(&away) + radius > 0.0;
        reached.then(|| (away, half_angle(radius, distance), distance - radius))
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

impl<'a> Shades<'a> {
    /// Of a view from somewhere in a segment.
    pub fn new(scene: &'a CastScene, job: &'a Job, view: &View, segment: usize) -> Self {
        if job.bodies.is_empty() {
            return Self::default();
        }
        let in_sight = scene.tunnel.segments_about(segment, SIGHT_M);
        let bodies: Vec<_> = job.bodies.iter().map(|b| (b, ball_m(b))).collect();
        let lamps = scene.lit.lamps.lamps().iter().map(ShadowLight::lamp);
        let headlights = job.headlights.iter().map(ShadowLight::headlight);
        let sources: Vec<_> = lamps.chain(headlights).collect();
        let shadows = shadows(&sources, &bodies, job, view);
        let mut shades = Self {
            bodies,
            first_segment: in_sight.start,
            begins: vec![0],
            ..Self::default()
        };
        for segment in in_sight {
            let (centre, radius) = scene.tunnel.segment_ball(segment);
            for of_light in shadows.chunk_by(|a, b| a.source == b.source) {
                let source = &sources[of_light[0].source];
                let to = centre - source.centre;
                shades.list(
                    of_light
                        .iter()
                        .filter(|s| s.may_fall_on(&to, radius, source)),
                );
            }
            shades.begins.push(shades.falling.len());
        }
        shades.sources = sources;
        shades
    }

    /// Lists the shadows of one light, if there are any.
    fn list<'s>(&mut self, shadows: impl Iterator<Item = &'s Shadow> + Clone) {
        let begin = self.listed.len();
        // Bodies around the light itself have no direction, and all of space for their shadow.
        let directions = shadows
            .clone()
            .filter_map(|s| s.towards.try_normalize(1e-9));
        let sum: Vector3<f64> = directions.sum();
        let axis = sum.try_normalize(1e-9).unwrap_or_else(Vector3::x);
        let (mut half_rad, mut source) = (0.0f64, None);
        for shadow in shadows {
            half_rad = half_rad.max(axis.angle(&shadow.towards) + shadow.half_rad);
            source = Some(shadow.source);
            self.listed.push(shadow.body);
        }
        self.falling.extend(source.map(|source| Falling {
            source,
            listed: begin..self.listed.len(),
            axis,
            cos_half: half_rad.min(PI).cos(),
        }));
    }

    /// The bodies so long after the job's time.
    pub fn blockers(&self, after_s: f64) -> Vec<Blocker<'a>> {
        let bodies = self.bodies.iter();
        bodies
            .map(|(body, radius)| Blocker::at(body, *radius, after_s))
            .collect()
    }

    /// Illuminance that bodies take from a point of a surface in a segment.
    pub fn hidden_lx(
        &self,
        segment: usize,
        (p, n): (&Point3<f64>, &Vector3<f64>),
        (blockers, blinking): (&[Blocker<'_>], &Blinking),
        scene: &CastScene,
    ) -> f64 {
        let lights = self.falling_on(segment).iter();
        lights
            .map(|falling| {
                let source = &self.sources[falling.source];
                let from = p - source.centre;
                let distance = from.norm();
                if falling.axis.dot(&from) < falling.cos_half * distance
                    || n.dot(&from) >= 0.0
                    || source.axis.dot(&from) <= 0.0
                {
                    return 0.0;
                }
                let bodies = self.listed[falling.listed.clone()].iter();
                let share = source.hidden_share(p, n, bodies.map(|k| &blockers[*k]));
                if share <= 0.0 {
                    return 0.0;
                }
                // Lamps come first, and headlights do not blink.
                let flicker = blinking.flicker.get(falling.source).unwrap_or(&0.0);
                let lux = source.irradiance_lx(p, n) * (1.0 + flicker);
                share * lux * scene.lit.air.transmission(distance)
            })
            .sum()
    }

    /// Whether nothing shades a segment.
    pub fn leave_alone(&self, segment: usize) -> bool {
        self.falling_on(segment).is_empty()
    }

    fn falling_on(&self, segment: usize) -> &[Falling] {
        let here = segment.wrapping_sub(self.first_segment);
        match (self.begins.get(here), self.begins.get(here.wrapping_add(1))) {
            (Some(begin), Some(end)) => &self.falling[*begin..*end],
            _ => &[],
        }
    }
}

impl Shadow {
    /// Whether the shadow of its ball may meet another, whose centre is `to` away from the light.
    fn may_fall_on(&self, to: &Vector3<f64>, radius_m: f64, source: &ShadowLight<'_>) -> bool {
        let distance = to.norm();
        distance - radius_m < source.reach_m
            && distance + radius_m > self.nearest_m
            && source.axis.dot(to) + radius_m > 0.0
            && to.angle(&self.towards) < self.half_rad + half_angle(radius_m, distance)
    }
}

/// All bodies that are in the light of something, wherever they go while a view is exposed.
fn shadows(
    sources: &[ShadowLight<'_>],
    bodies: &[(&Body, f64)],
    job: &Job,
    view: &View,
) -> Vec<Shadow> {
    let shutter = &view.camera.shutter;
    let last_row = f64::from(view.camera.intrinsics.height_px.saturating_sub(1));
    let ends = [0.0, last_row].map(|row| shutter.row_mid(view.start, row).since(job.time));
    let (mid_s, half_s) = (
        0.5 * (ends[0] + ends[1]),
        0.5 * ((ends[1] - ends[0]).abs() + shutter.exposure_s),
    );
    let mut all = Vec::new();
    for (source, light) in sources.iter().enumerate() {
        for (body, (solid, radius_m)) in bodies.iter().enumerate() {
            if light.is_carried_by(solid) {
                continue;
            }
            let ball = Blocker::at(solid, *radius_m, mid_s);
            let wide_m = radius_m + solid.velocity_mps.norm() * half_s;
            if let Some((towards, half_rad, nearest_m)) = light.shadow(&ball.centre, wide_m) {
                all.push(Shadow {
                    source,
                    body,
                    towards,
                    half_rad,
                    nearest_m,
                });
            }
        }
    }
    all
}

/// Radius of a ball around a body's origin that holds it.
fn ball_m(body: &Body) -> f64 {
    body.shape.half_extents_m().norm()
}

fn half_angle(radius_m: f64, distance_m: f64) -> f64 {
    if radius_m < distance_m {
        (radius_m / distance_m).asin()
    } else {
        PI
    }
}

#[cfg(test)]
mod tests;
