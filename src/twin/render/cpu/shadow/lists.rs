//! Which shadows may fall where, found before a picture is drawn: where the ball around a segment of
//! the tunnel meets the shadow of the ball around a body.

use super::{Blocker, ShadowLight};
use crate::twin::geometry::Body;
use crate::twin::render::constants::SIGHT_M;
use crate::twin::render::cpu::cast_scene::CastScene;
use crate::twin::render::{Job, View};
use nalgebra::Vector3;
use std::f64::consts::PI;

/// The shadows that may fall on the segments in sight.
pub(super) struct ShadowLists {
    first_segment: usize,
    /// Of each segment in sight, by light.
    falling: Vec<Vec<Falling>>,
}

/// The shadows of one light that may fall on a segment.
pub(super) struct Falling {
    /// Its number.
    pub light: usize,
    /// Numbers of the bodies that throw them.
    pub bodies: Vec<usize>,
    /// A cone from the light that holds them all: its unit axis and the cosine of half its angle.
    axis: Vector3<f64>,
    cos_half: f64,
}

/// A ball of a body as a light sees it.
pub(super) struct BallShadow {
    light: usize,
    body: usize,
    towards: Vector3<f64>,
    /// Half the angle that it takes up.
    half_rad: f64,
    nearest_m: f64,
}

impl ShadowLists {
    /// Of a view from somewhere in a segment.
    pub fn new(
        scene: &CastScene,
        (lights, bodies): (&[ShadowLight<'_>], &[(&Body, f64)]),
        job: &Job,
        view: &View,
        segment: usize,
    ) -> Self {
        let shadows = shadows(lights, bodies, job, view);
        let in_sight = scene.tunnel.segments_about(segment, SIGHT_M);
        let falling_on = |segment: usize| {
            let (centre, radius_m) = scene.tunnel.segment_ball(segment);
            let of_lights = shadows.chunk_by(|a, b| a.light == b.light);
            let falling = of_lights.filter_map(|of_light| {
                let light = &lights[of_light[0].light];
                let to = centre - light.centre;
                let here = of_light.iter();
                Falling::of(here.filter(|s| s.may_fall_on(&to, radius_m, light)))
            });
            falling.collect()
        };
        Self {
            first_segment: in_sight.start,
            falling: in_sight.map(falling_on).collect(),
        }
    }

    /// What may fall on a segment.
    pub fn falling_on(&self, segment: usize) -> impl Iterator<Item = &Falling> {
        let here = segment.checked_sub(self.first_segment);
        here.and_then(|k| self.falling.get(k)).into_iter().flatten()
    }
}

impl Falling {
    /// The shadows of one light, if there are any.
    fn of<'s>(shadows: impl Iterator<Item = &'s BallShadow> + Clone) -> Option<Self> {
        let light = shadows.clone().next()?.light;
        // Bodies around the light itself have no direction, and all of space for their shadow.
        let directions = shadows
            .clone()
            .filter_map(|s| s.towards.try_normalize(1e-9));
        let sum: Vector3<f64> = directions.sum();
        let axis = sum.try_normalize(1e-9).unwrap_or_else(Vector3::x);
        let widest = |s: &BallShadow| axis.angle(&s.towards) + s.half_rad;
        let half_rad = shadows.clone().map(widest).fold(0.0, f64::max);
        Some(Self {
            light,
            bodies: shadows.map(|s| s.body).collect(),
            axis,
            cos_half: half_rad.min(PI).cos(),
        })
    }

    /// Whether any may fall on a point that is so far from the light.
    pub fn may_reach(&self, from_light: &Vector3<f64>) -> bool {
        self.axis.dot(from_light) >= self.cos_half * from_light.norm()
    }
}

impl BallShadow {
    /// Of a ball `away` from a light, if it is within reach and not behind.
    fn of(
        (light, number): (&ShadowLight<'_>, usize),
        body: usize,
        away: Vector3<f64>,
        radius_m: f64,
    ) -> Option<Self> {
        let (distance_m, wide_m) = (away.norm(), radius_m + light.radius_m);
        let reached = distance_m - wide_m < light.reach_m && light.axis.dot(&away) + wide_m > 0.0;
        reached.then(|| Self {
            light: number,
            body,
            towards: away,
            half_rad: half_angle(wide_m, distance_m),
            nearest_m: distance_m - wide_m,
        })
    }

    /// Whether it may meet another ball, whose centre is `to` away from the light.
    fn may_fall_on(&self, to: &Vector3<f64>, radius_m: f64, light: &ShadowLight<'_>) -> bool {
        let distance = to.norm();
        distance - radius_m < light.reach_m
            && distance + radius_m > self.nearest_m
            && light.axis.dot(to) + radius_m > 0.0
            && to.angle(&self.towards) < self.half_rad + half_angle(radius_m, distance)
    }
}

/// All bodies that are in the light of something, wherever they go while a view is exposed.
pub(super) fn shadows(
    lights: &[ShadowLight<'_>],
    bodies: &[(&Body, f64)],
    job: &Job,
    view: &View,
) -> Vec<BallShadow> {
    let shutter = &view.camera.shutter;
    let last_row = f64::from(view.camera.intrinsics.height_px.saturating_sub(1));
    let ends = [0.0, last_row].map(|row| shutter.row_mid(view.start, row).since(job.time));
    let (mid_s, half_s) = (
        0.5 * (ends[0] + ends[1]),
        0.5 * ((ends[1] - ends[0]).abs() + shutter.exposure_s),
    );
    let mut all = Vec::new();
    for (number, light) in lights.iter().enumerate() {
        for (k, (body, radius_m)) in bodies.iter().enumerate() {
            if light.is_carried_by(body) {
                continue;
            }
            let away = Blocker::at(body, *radius_m, mid_s).centre - light.centre;
            let wide_m = radius_m + body.velocity_mps.norm() * half_s;
            all.extend(BallShadow::of((light, number), k, away, wide_m));
        }
    }
    all
}

fn half_angle(radius_m: f64, distance_m: f64) -> f64 {
    if radius_m < distance_m {
        (radius_m / distance_m).asin()
    } else {
        PI
    }
}
