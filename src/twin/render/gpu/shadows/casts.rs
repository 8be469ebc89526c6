//! Which lights may throw the shadow of which body where: by balls and cones, generously.

use super::occluder::Occluder;
use crate::twin::geometry::{Body, Shape};
use crate::twin::render::gpu::layout::{MAX_BLOCKERS, MAX_HEADLIGHTS, MAX_SOURCES};
use crate::twin::render::gpu::region::Region;
use crate::twin::render::gpu::view::Framed;
use crate::twin::render::lamp_field::LampField;
use crate::twin::render::light_source::LightSource;
use crate::twin::render::photometry::BlinkingLamp;
use crate::twin::render::scene::Job;
use nalgebra::{Point3, Vector3};

/// Bodies and lamps farther than this from the camera throw no shadow that it sees.
const FAR_M: f64 = 200.0;

/// The shadow of a ball.
struct Cone {
    /// From the light to the ball, length 1.
    axis: Vector3<f64>,
    /// Of half its angle.
    sin: f64,
    cos: f64,
    nearest_m: f64,
}

/// All shadows of one body under one light.
pub struct Cast {
    pub light: usize,
    pub body: usize,
    cones: Vec<Cone>,
}

/// The shadow of a ball under a light, if that shines on it.
fn cone(light: &LightSource<'_>, ball: &Region) -> Option<Cone> {
    let wide_m = ball.radius_m + light.radius_m;
    light.may_light(&ball.centre, wide_m, None).then(|| {
        let to = ball.centre - light.centre;
        let distance = to.norm();
        let nearest_m = distance - wide_m;
        if nearest_m <= 0.0 {
            // The shadow of a ball around the light is everywhere.
            return Cone {
                axis: Vector3::zeros(),
                sin: 0.0,
                cos: -1.0,
                nearest_m,
            };
        }
        let sin = wide_m / distance;
        Cone {
            axis: to / distance,
            sin,
            cos: (1.0 - sin * sin).sqrt(),
            nearest_m,
        }
    })
}

impl Cast {
    /// Whether it may fall on anything in a region that the light lights.
    pub fn may_fall_on(&self, light: &LightSource<'_>, region: &Region) -> bool {
        let (to, radius_m) = (region.centre - light.centre, region.radius_m);
        let square = to.norm_squared();
        self.cones.iter().any(|cone| {
            let along = to.dot(&cone.axis);
            let aside = (square - along * along).max(0.0).sqrt();
            along + radius_m > cone.nearest_m && aside * cone.cos - along * cone.sin < radius_m
        })
    }
}

/// The lights about a camera.
pub fn lights<'j>(framed: &Framed<'_>, job: &'j Job, field: &'j LampField) -> Vec<LightSource<'j>> {
    let eye = framed.reference();
    let away_m = |lamp: &BlinkingLamp| (lamp.centre - eye).norm();
    let lamps = field.lamps().iter();
    let mut lamps: Vec<&BlinkingLamp> = lamps.filter(|lamp| away_m(lamp) < FAR_M).collect();
    lamps.sort_by(|a, b| f64::total_cmp(&away_m(a), &away_m(b)));
    lamps.truncate(MAX_SOURCES - MAX_HEADLIGHTS);
    let headlights = framed.nearest(&job.headlights);
    (lamps.into_iter().map(LightSource::lamp))
        .chain(headlights.into_iter().map(LightSource::headlight))
        .collect()
}

/// The bodies about a camera, capsules first.
pub struct Bodies<'j> {
    pub all: Vec<&'j Body>,
    /// The first so many of them are capsules.
    pub capsules: usize,
    /// Balls around the pieces of each, wherever they go while the view is exposed.
    pub balls: Vec<Vec<Region>>,
    /// What each of them hides.
    pub solids: Vec<Occluder>,
    /// The middle of the exposure after the job's time, and half of how long it lasts.
    pub exposed_s: [f64; 2],
}

/// Finds them.
pub fn bodies<'j>(framed: &Framed<'_>, job: &'j Job) -> Bodies<'j> {
    let eye = framed.reference();
    let away_m = |body: &Body| {
        let to = body.world_from_body.translation.vector - eye.coords;
        to.norm() - body.shape.half_extents_m().norm()
    };
    let bodies = job.bodies.iter();
    let mut bodies: Vec<&Body> = bodies.filter(|body| away_m(body) < FAR_M).collect();
    bodies.sort_by(|a, b| f64::total_cmp(&away_m(a), &away_m(b)));
    bodies.truncate(MAX_BLOCKERS);
    let (mut bodies, others): (Vec<&Body>, Vec<&Body>) =
        bodies.into_iter().partition(|body| is_capsule(body));
    let capsules = bodies.len();
    bodies.extend(others);
    let shutter = &framed.view.camera.shutter;
    let last_row = f64::from(framed.view.camera.intrinsics.height_px.saturating_sub(1));
    let ends = [0.0, last_row].map(|v| shutter.row_mid(framed.view.start, v).since(job.time));
    let mid_s = 0.5 * (ends[0] + ends[1]);
    let half_s = 0.5 * ((ends[1] - ends[0]).abs() + shutter.exposure_s);
    let balls = |body: &&Body| {
        let ball = |(place, radius_m)| {
            let centre = body.world_from_body * place + body.velocity_mps * mid_s;
            Region::around(centre, radius_m + body.velocity_mps.norm() * half_s)
        };
        pieces(&body.shape).map(ball).collect()
    };
    Bodies {
        balls: bodies.iter().map(balls).collect(),
        solids: bodies
            .iter()
            .map(|b| Occluder::of(b, mid_s, half_s))
            .collect(),
        all: bodies,
        capsules,
        exposed_s: [mid_s, half_s],
    }
}

/// Whether the shader takes it for a capsule.
pub fn is_capsule(body: &Body) -> bool {
    matches!(body.shape, Shape::Sphere(_) | Shape::Capsule(..))
}

/// Balls that cover a shape: a long one in pieces about as long as it is wide.
fn pieces(shape: &Shape) -> impl Iterator<Item = (Point3<f64>, f64)> {
    let half = shape.half_extents_m();
    let long = half.imax();
    let mut piece = half;
    piece[long] = 0.0;
    let count = (half[long] / piece.max().max(1e-3)).ceil().clamp(1.0, 32.0);
    piece[long] = half[long] / count;
    (0..count as u32).map(move |k| {
        let mut place = Point3::origin();
        place[long] = half[long] * ((2.0 * f64::from(k) + 1.0) / count - 1.0);
        (place, piece.norm())
    })
}

/// All shadows, by light and within one light by body.
pub fn casts(lights: &[LightSource<'_>], bodies: &Bodies<'_>) -> Vec<Cast> {
    let mut casts = Vec::new();
    for (k, light) in lights.iter().enumerate() {
        for (body, balls) in bodies.balls.iter().enumerate() {
            if light.is_carried_by(bodies.all[body]) {
                continue;
            }
            let cones: Vec<Cone> = balls.iter().filter_map(|b| cone(light, b)).collect();
            if !cones.is_empty() {
                casts.push(Cast {
                    light: k,
                    body,
                    cones,
                });
            }
        }
    }
    casts
}
