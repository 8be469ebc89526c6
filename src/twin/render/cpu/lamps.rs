//! Lamp discs and their glare in one row of an image.
//!
//! A row is exposed for a while in which the lamp blinks and the camera moves, so the disc is
//! sampled at several instants of that while, each with the camera's pose of that instant.

use crate::twin::render::surface::{DARK_DISC_ALBEDO, HALO_REACH, LAMP_SIGHT_M};
use crate::twin::render::{LampLight, View};
use nalgebra::{Isometry3, Point3, Vector3};
use std::f64::consts::PI;

/// Time slots of a row's exposure.
const SLOTS: usize = 4;
/// Sub-pixel positions, each way.
const SUB_PIXELS: usize = 4;
/// Surfaces nearer than a disc by less than this do not hide it: it may be flush with its wall.
const FLUSH_M: f64 = 0.01;
/// Lamps nearer to the camera's plane than this are not drawn.
const NEAREST_M: f64 = 0.1;

/// The air between the camera and a lamp: the share of light that comes through, and its own.
#[derive(Clone, Copy)]
pub(super) struct Haze {
    pub clear: f64,
    pub light_cd_m2: f64,
}

/// When a row of a view is exposed, and from where.
pub(super) struct RowExposure {
    pub v: usize,
    /// `world_from_camera` in the middle of the exposure.
    pub mid: Isometry3<f64>,
    open_s: f64,
    slot_s: f64,
    slots: [Isometry3<f64>; SLOTS],
}

impl RowExposure {
    pub fn new(view: &View, v: usize) -> Self {
        let shutter = &view.camera.shutter;
        let open = shutter.row_open(view.start, v as f64);
        let slot_s = shutter.exposure_s / SLOTS as f64;
        Self {
            v,
            mid: view.motion.pose_at(shutter.row_mid(view.start, v as f64)),
            open_s: open.secs(),
            slot_s,
            slots: std::array::from_fn(|k| {
                view.motion.pose_at(open.plus((k as f64 + 0.5) * slot_s))
            }),
        }
    }

    fn on_share(&self, lamp: &LampLight, first: usize, count: usize) -> f64 {
        let open = self.open_s + first as f64 * self.slot_s;
        lamp.waveform
            .on_share(open, open + count as f64 * self.slot_s)
    }
}

/// Whether a lamp shows in a row at all, and where its centre is in the camera's frame.
fn seen_from(lamp: &LampLight, pose: &Isometry3<f64>) -> Option<(Point3<f64>, f64)> {
    let centre = pose.inverse_transform_point(&lamp.centre);
    let distance = centre.coords.norm();
    let cos = -pose
        .inverse_transform_vector(&lamp.facing)
        .dot(&centre.coords)
        / distance;
    (centre.z > NEAREST_M && distance < LAMP_SIGHT_M && cos > 0.0).then_some((centre, cos))
}

/// Puts the disc of a lamp over the row's luminances, where nothing is nearer than it at
/// `depth_of(u)`.
pub(super) fn draw_disc(
    lamp: &LampLight,
    view: &View,
    row: &RowExposure,
    (ambient_lx, haze): (f64, Haze),
    mut depth_of: impl FnMut(usize) -> f64,
    luminances: &mut [f64],
) {
    let Some((centre, _)) = seen_from(lamp, &row.mid) else {
        return;
    };
    let camera = &view.camera.intrinsics;
    let discs: [Disc; SLOTS] = std::array::from_fn(|k| Disc {
        centre: row.slots[k].inverse_transform_point(&lamp.centre).coords,
        normal: row.slots[k].inverse_transform_vector(&lamp.facing),
        on_share: row.on_share(lamp, k, 1),
    });
    // A ball around all instants of the disc, and a pixel for the sub-pixels.
    let moved = discs.iter().map(|d| (d.centre - centre.coords).norm());
    let radius = lamp.radius_m + moved.fold(0.0, f64::max);
    let (Some(columns), Some(rows)) = (
        ball_extent(centre.x, centre.z, radius),
        ball_extent(centre.y, centre.z, radius),
    ) else {
        return;
    };
    let y = (row.v as f64 - camera.cy_px) / camera.fy_px;
    let margin = 1.0 / camera.fy_px;
    if y < rows.0 - margin || y > rows.1 + margin {
        return;
    }
    let dark = haze.clear * DARK_DISC_ALBEDO * ambient_lx / PI + haze.light_cd_m2;
    let luminance = haze.clear * lamp.luminance_cd_m2;
    let begin = (columns.0 * camera.fx_px + camera.cx_px - 1.0).max(0.0) as usize;
    let end = (columns.1 * camera.fx_px + camera.cx_px + 2.0).max(0.0) as usize;
    let samples = (SLOTS * SUB_PIXELS * SUB_PIXELS) as f64;
    for u in begin..end.min(luminances.len()) {
        let (mut covered, mut light, mut behind) = (0u32, 0.0, None);
        for sub in 0..SUB_PIXELS * SUB_PIXELS {
            let shift = |k: usize| (k as f64 + 0.5) / SUB_PIXELS as f64 - 0.5;
            let ray = camera.ray(
                u as f64 + shift(sub % SUB_PIXELS),
                row.v as f64 + shift(sub / SUB_PIXELS),
            );
            for disc in &discs {
                let Some(depth) = disc.hit(&ray, lamp.radius_m) else {
                    continue;
                };
                if depth > *behind.get_or_insert_with(|| depth_of(u)) + FLUSH_M {
                    continue;
                }
                covered += 1;
                if disc.on_share > 0.0 {
                    let cos = -disc.normal.dot(&ray) / ray.norm();
                    light += disc.on_share * luminance * cos.powf(lamp.exponent - 1.0);
                }
            }
        }
        let coverage = f64::from(covered) / samples;
        luminances[u] = luminances[u] * (1.0 - coverage) + dark * coverage + light / samples;
    }
}

/// Adds the glare of a lamp to the row's luminances.
pub(super) fn add_halo(
    lamp: &LampLight,
    view: &View,
    row: &RowExposure,
    haze: Haze,
    luminances: &mut [f64],
) {
    let Some((centre, cos)) = seen_from(lamp, &row.mid) else {
        return;
    };
    let camera = &view.camera.intrinsics;
    let Some(c) = camera.project(&centre) else {
        return;
    };
    let fall = view.lens.halo_px;
    let apparent = camera.fx_px * lamp.radius_m * cos.sqrt() / centre.z;
    let strength = haze.clear
        * view.lens.halo_share
        * lamp.luminance_cd_m2
        * cos.powf(lamp.exponent - 1.0)
        * row.on_share(lamp, 0, SLOTS)
        * apparent.powi(2)
        / (apparent.powi(2) + fall * fall);
    let reach = apparent + HALO_REACH * fall;
    let dv = row.v as f64 - c.y;
    if strength <= 0.0 || dv.abs() > reach {
        return;
    }
    let half = (reach * reach - dv * dv).sqrt();
    let begin = (c.x - half).max(0.0).ceil() as usize;
    let end = ((c.x + half).max(-1.0).floor() + 1.0) as usize;
    for (u, luminance) in luminances.iter_mut().enumerate().take(end).skip(begin) {
        let outside = (u as f64 - c.x).hypot(dv) - apparent;
        *luminance += strength
            * if outside <= 0.0 {
                1.0
            } else {
                (-outside / fall).exp()
            };
    }
}

/// A lamp in the camera's frame at one instant.
struct Disc {
    centre: Vector3<f64>,
    normal: Vector3<f64>,
    on_share: f64,
}

impl Disc {
    /// Depth at which a ray (scaled to z = 1) meets the luminous side.
    fn hit(&self, ray: &Vector3<f64>, radius_m: f64) -> Option<f64> {
        let towards = self.normal.dot(ray);
        if towards >= 0.0 {
            return None;
        }
        let depth = self.normal.dot(&self.centre) / towards;
        let off = ray * depth - self.centre;
        (depth > 0.0 && off.norm_squared() <= radius_m * radius_m).then_some(depth)
    }
}

/// Range of x/z over a ball; everything where the camera's plane cuts it, nothing behind.
pub(super) fn ball_extent(x: f64, z: f64, radius: f64) -> Option<(f64, f64)> {
    if z <= -radius {
        return None;
    }
    if z <= radius {
        return Some((f64::NEG_INFINITY, f64::INFINITY));
    }
    let (r2, across) = (radius * radius, x * z);
    let spread = radius * (x * x + z * z - r2).sqrt();
    Some((
        (across - spread) / (z * z - r2),
        (across + spread) / (z * z - r2),
    ))
}
