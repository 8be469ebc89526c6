//! Lamp discs and their glare in one slice of a row's exposure, by brute force.
//!
//! While a row is exposed the lamp blinks and the camera moves, so the disc is looked at in many
//! instants, each with the camera's pose of that instant and the exact light of its share of the
//! exposure. In each instant rays go out from places spread over the pixel and the lens's point
//! spread: a lattice of equal weights, mapped through the quantiles of both together.

use super::spread::BlurSamples;
use crate::twin::lights::LampLight;
use crate::twin::render::View;
use crate::twin::render::constants::{DARK_DISC_ALBEDO, FAINT_E, FLUSH_M, LAMP_SIGHT_M};
use crate::twin::render::photometry::BlinkingLamp;
use nalgebra::{Isometry3, Point2, Point3, Vector3};
use std::f64::consts::PI;

/// A lamp is looked at each time that its image has moved by this.
const STEP_PX: f64 = 0.1;
/// Most instants of a slice.
const MOST_INSTANTS: f64 = 256.0;
/// Lamps that come nearer to the camera's plane than this are not drawn.
const NEAREST_M: f64 = 0.1;
/// A lens's distortion changes the size of a disc by no more than this factor.
const BENT: f64 = 2.0;

/// The air between the camera and a lamp: the share of light that comes through, and its own.
#[derive(Clone, Copy)]
pub(super) struct Haze {
    pub clear: f64,
    pub light_cd_m2: f64,
}

/// A part of the time in which a row of a view is exposed, and from where.
pub(super) struct RowExposure {
    pub v: usize,
    /// `world_from_camera` in its middle.
    pub mid: Isometry3<f64>,
    /// From the view's start to its middle.
    pub mid_s: f64,
    /// From the view's start to its begin.
    open_s: f64,
    span_s: f64,
}

impl RowExposure {
    /// The whole exposure of a row.
    pub fn new(view: &View, v: usize) -> Self {
        Self::slice(view, v, 0, 1)
    }

    /// Slice `k` of `n` equal ones.
    pub fn slice(view: &View, v: usize, k: usize, n: usize) -> Self {
        let shutter = &view.camera.shutter;
        let span_s = shutter.exposure_s / n as f64;
        let open_s = shutter.delay_s(v as f64) + k as f64 * span_s;
        let mid_s = open_s + 0.5 * span_s;
        Self {
            v,
            mid: view.motion.pose_at(view.start.plus(mid_s)),
            mid_s,
            open_s,
            span_s,
        }
    }

    /// Mean light of a lamp in a part of the slice.
    pub fn light(&self, view: &View, lamp: &BlinkingLamp, from: f64, to: f64) -> f64 {
        let at = |share: f64| view.start.plus(self.open_s + share * self.span_s).secs();
        lamp.share(at(from), at(to))
    }
}

/// A lamp in the camera's frame at one instant.
struct Disc {
    centre: Point3<f64>,
    normal: Vector3<f64>,
    radius_m: f64,
}

impl Disc {
    /// Nothing where it is out of sight, shows its back, or reaches the camera's plane.
    fn seen(lamp: &LampLight, world_from_camera: &Isometry3<f64>) -> Option<Self> {
        let centre = world_from_camera.inverse_transform_point(&lamp.centre);
        let normal = world_from_camera.inverse_transform_vector(&lamp.facing);
        let reach_m = lamp.radius_m * (1.0 - normal.z * normal.z).max(0.0).sqrt();
        let visible = centre.z - reach_m > NEAREST_M
            && centre.coords.norm() < LAMP_SIGHT_M
            && normal.dot(&centre.coords) < 0.0;
        visible.then_some(Self {
            centre,
            normal,
            radius_m: lamp.radius_m,
        })
    }

    /// Cosine of the angle at which it is seen.
    fn cosine(&self) -> f64 {
        -self.normal.dot(&self.centre.coords) / self.centre.coords.norm()
    }

    /// Depth at which a ray (scaled to z = 1) meets its plane.
    fn depth(&self, ray: &Vector3<f64>) -> f64 {
        self.normal.dot(&self.centre.coords) / self.normal.dot(ray)
    }

    fn is_hit(&self, ray: &Vector3<f64>) -> bool {
        let depth = self.depth(ray);
        let off = ray * depth - self.centre.coords;
        depth > 0.0 && off.norm_squared() <= self.radius_m * self.radius_m
    }
}

/// Light and coverage of a disc in a pixel.
#[derive(Clone, Copy, Default)]
struct Share {
    covered: f64,
    light: f64,
}

/// A disc through a slice of a row's exposure.
struct DiscSweep<'a> {
    view: &'a View,
    spread: &'a BlurSamples,
    /// Each with its share of the slice's light.
    instants: Vec<(Disc, f64)>,
}

impl DiscSweep<'_> {
    fn in_pixel(&self, u: f64, v: f64) -> Share {
        let camera = &self.view.camera.intrinsics;
        let reach_px = self.spread.reach_px;
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| camera.ray(u + reach_px * x, v + reach_px * y));
        let mut rays = Vec::new();
        let mut sum = Share::default();
        for (disc, light) in &self.instants {
            // A disc that has all corners of the spread has all that is between them.
            let covered = if corners.iter().all(|ray| disc.is_hit(ray)) {
                1.0
            } else {
                if rays.is_empty() {
                    let places = self.spread.places.iter();
                    rays.extend(places.map(|(x, y)| camera.ray(u + x, v + y)));
                }
                let hits = rays.iter().filter(|ray| disc.is_hit(ray)).count();
                hits as f64 / rays.len() as f64
            };
            sum.covered += covered / self.instants.len() as f64;
            sum.light += covered * light;
        }
        sum
    }
}

/// Puts the disc of a lamp over the row's luminances, where nothing is nearer than it at
/// `depth_of(u)`.
pub(super) fn draw_disc(
    lamp: &BlinkingLamp,
    view: &View,
    spread: &BlurSamples,
    row: &RowExposure,
    (ambient_lx, haze): (f64, Haze),
    mut depth_of: impl FnMut(usize) -> f64,
    luminances: &mut [f64],
) {
    let light: &LampLight = lamp;
    let camera = &view.camera.intrinsics;
    let at = |share: f64| {
        let t = view.start.plus(row.open_s + share * row.span_s);
        Disc::seen(light, &view.motion.pose_at(t))
    };
    let place = |disc: &Disc| camera.project(&disc.centre);
    let (Some(first), Some(middle), Some(last)) = (at(0.0), at(0.5), at(1.0)) else {
        return;
    };
    let (Some(a), Some(c), Some(b)) = (place(&first), place(&middle), place(&last)) else {
        return;
    };
    let v = row.v as f64;
    let reach_px = disc_reach_px(view, &middle) + spread.reach_px + (b - a).norm();
    if (v - c.y).abs() > reach_px {
        return;
    }
    let count = ((b - a).norm() / STEP_PX).ceil().clamp(1.0, MOST_INSTANTS);
    let instants = (0..count as u32).filter_map(|k| {
        let from = f64::from(k) / count;
        let to = f64::from(k + 1) / count;
        let shine = row.light(view, lamp, from, to) / count;
        Some((at(0.5 * (from + to))?, shine))
    });
    let sweep = DiscSweep {
        view,
        spread,
        instants: instants.collect(),
    };
    let dark = haze.clear * DARK_DISC_ALBEDO * ambient_lx / PI + haze.light_cd_m2;
    let begin = (c.x - reach_px).max(0.0) as usize;
    let end = ((c.x + reach_px).max(-1.0) + 1.0) as usize;
    for u in begin..end.min(luminances.len()) {
        let share = sweep.in_pixel(u as f64, v);
        if share.covered <= 0.0 {
            continue;
        }
        let ray = camera.ray(u as f64, v);
        if middle.depth(&ray) > depth_of(u) + FLUSH_M {
            continue;
        }
        let cosine = (-middle.normal.dot(&ray) / ray.norm()).max(0.0);
        let direct = haze.clear * view.lens.direct_share();
        let lit = direct * light.luminance_cd_m2 * cosine.powf(light.exponent - 1.0);
        luminances[u] =
            luminances[u] * (1.0 - share.covered) + dark * share.covered + lit * share.light;
    }
}

/// How far from its centre a disc may reach: a point within R of the centre c moves by at most
/// f R (1 + |x|/z) / (z - R) in the image of a lens without distortion.
fn disc_reach_px(view: &View, disc: &Disc) -> f64 {
    let (camera, c) = (&view.camera.intrinsics, &disc.centre);
    let clear_m = c.z - disc.radius_m;
    if clear_m <= 0.0 {
        return f64::INFINITY;
    }
    let steep = 1.0 + c.x.abs().max(c.y.abs()) / c.z;
    BENT * camera.fx_px.max(camera.fy_px) * disc.radius_m * steep / clear_m
}

/// Adds the glare of a lamp to the row's luminances.
pub(super) fn add_glare(
    lamp: &BlinkingLamp,
    view: &View,
    row: &RowExposure,
    haze: Haze,
    luminances: &mut [f64],
) {
    let light: &LampLight = lamp;
    let camera = &view.camera.intrinsics;
    let Some(disc) = Disc::seen(light, &row.mid) else {
        return;
    };
    let Some(c) = camera.project(&disc.centre) else {
        return;
    };
    let cosine = disc.cosine();
    let apparent_px = camera.fx_px * light.radius_m * cosine.sqrt() / disc.centre.z;
    let luminance = haze.clear * light.luminance_cd_m2 * cosine.powf(light.exponent - 1.0);
    let lit = luminance * row.light(view, lamp, 0.0, 1.0);
    let faint = FAINT_E / view.electrons_per_cd_m2();
    // Its reach is that of the lamp while it is on, so that it does not blink.
    let reach_px = view.lens.glare(apparent_px, luminance).reach_px(faint);
    let glare = view.lens.glare(apparent_px, lit);
    let v = row.v as f64 - c.y;
    if lit <= 0.0 || v.abs() > reach_px {
        return;
    }
    let half = (reach_px * reach_px - v * v).sqrt();
    let begin = (c.x - half).max(0.0).ceil() as usize;
    let end = ((c.x + half).max(-1.0).floor() + 1.0) as usize;
    for (u, luminance) in luminances.iter_mut().enumerate().take(end).skip(begin) {
        let off = Point2::new(u as f64 - c.x, v);
        *luminance += glare.at(off.coords.norm());
    }
}
