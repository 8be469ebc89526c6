//! What the glass takes away from the light, the same in every frame: natural vignetting, dirt, and
//! what covers it.
//!
//! # Theory
//!
//! Light that comes at an angle a to the axis falls on the sensor with cos^4 a of what it has on
//! the axis (natural vignetting). Dirt lies on the front glass, metres out of focus: a speck casts
//! a soft shadow as wide as the pupil, and takes some of the light there. Something that covers the
//! glass (a leaf, tape, spray) casts the same soft edge.
//!
//! All of it is smooth, so it is worked out on a lattice of [`CELL_PX`] and runs straight between.

use super::LensSettings;
use crate::bus::Intrinsics;
use crate::twin::random::Stream;
use std::f64::consts::TAU;

/// Distance of the lattice's points.
pub const CELL_PX: u32 = 8;
/// Radii of the blotches that specks of dirt cast, over the width of the picture.
const BLOTCH: [f64; 2] = [0.01, 0.04];
/// Share of the light that a blotch takes in its middle.
const BLOTCH_DEPTH: [f64; 2] = [0.3, 0.8];
/// Width of the edge of what covers the glass, over the width of the picture.
const COVER_EDGE: f64 = 0.03;
/// How far that edge waves to either side, over the width of the picture.
const COVER_WAVE: f64 = 0.03;
/// Numbers of the stream that a blotch uses.
const DRAWS: u64 = 4;

/// Share of the light that passes, over the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Shade {
    columns: usize,
    passed: Vec<f64>,
}

/// A speck's shadow.
struct Blotch {
    u_px: f64,
    v_px: f64,
    radius_px: f64,
    depth: f64,
}

impl Shade {
    /// Of a lens whose dirt is drawn from `stream`.
    pub fn new(lens: &LensSettings, camera: &Intrinsics, stream: Stream) -> Self {
        let columns = (camera.width_px.div_ceil(CELL_PX) + 1) as usize;
        let rows = (camera.height_px.div_ceil(CELL_PX) + 1) as usize;
        let at = |k: usize| f64::from(CELL_PX) * k as f64;
        let points = (0..rows).flat_map(|j| (0..columns).map(move |i| (at(i), at(j))));
        let mut passed: Vec<f64> = points
            .clone()
            .map(|(u, v)| 1.0 - lens.vignetting * (1.0 - cos4(camera, u, v)))
            .collect();
        let blotches = blotches(lens.dirt_share, camera, stream);
        for (passed, (u, v)) in passed.iter_mut().zip(points.clone()) {
            *passed *= blotches.iter().map(|b| b.passed(u, v)).product::<f64>();
        }
        if lens.occluded_share > 0.0 {
            let heights: Vec<f64> = {
                let height = cover(camera, stream);
                points.map(|(u, v)| height(u, v)).collect()
            };
            let edge = threshold(&heights, lens.occluded_share);
            for (passed, height) in passed.iter_mut().zip(heights) {
                *passed *= smooth(0.5 + (height - edge) / COVER_EDGE);
            }
        }
        Self { columns, passed }
    }

    /// In the pixels of row `v` of the picture.
    pub fn row(&self, v: u32, out: &mut [f32]) {
        let mix = |a: f64, b: f64, share: f64| a + (b - a) * share;
        let first = (v / CELL_PX) as usize * self.columns;
        let down = f64::from(v % CELL_PX) / f64::from(CELL_PX);
        let at = |column: usize| {
            let [above, below] = [0, self.columns].map(|k| self.passed[first + k + column]);
            mix(above, below, down)
        };
        for (column, cell) in out.chunks_mut(CELL_PX as usize).enumerate() {
            let (left, right) = (at(column), at(column + 1));
            for (k, to) in (0..).zip(cell) {
                *to = mix(left, right, f64::from(k) / f64::from(CELL_PX)) as f32;
            }
        }
    }
}

/// The fourth power of the cosine between a pixel's ray and the axis.
fn cos4(camera: &Intrinsics, u: f64, v: f64) -> f64 {
    camera.ray(u, v).norm_squared().powi(-2)
}

fn blotches(share: f64, camera: &Intrinsics, stream: Stream) -> Vec<Blotch> {
    let (width, height) = (f64::from(camera.width_px), f64::from(camera.height_px));
    let [low, high] = BLOTCH;
    let mean_area = 0.5 * TAU * width * width * (low * low + low * high + high * high) / 3.0;
    let count = (share * width * height / mean_area).round() as u64;
    let between = |[low, high]: [f64; 2], k: u64| low + (high - low) * stream.uniform(k);
    (0..count)
        .map(|k| Blotch {
            u_px: width * stream.uniform(DRAWS * k),
            v_px: height * stream.uniform(DRAWS * k + 1),
            radius_px: width * between(BLOTCH, DRAWS * k + 2),
            depth: between(BLOTCH_DEPTH, DRAWS * k + 3),
        })
        .collect()
}

impl Blotch {
    fn passed(&self, u: f64, v: f64) -> f64 {
        let away = (u - self.u_px).hypot(v - self.v_px) / self.radius_px;
        1.0 - self.depth * smooth(1.0 - away)
    }
}

/// Height over a waving line across the picture, over its width: what is low is covered first.
fn cover(camera: &Intrinsics, stream: Stream) -> impl Fn(f64, f64) -> f64 {
    let width = f64::from(camera.width_px);
    let draw = |k: u64| TAU * stream.uniform(u64::MAX - k);
    let (turn, phases) = (draw(0), [draw(1), draw(2)]);
    move |u, v| {
        let (x, y) = (u / width, v / width);
        let (along, across) = (
            x * turn.cos() + y * turn.sin(),
            y * turn.cos() - x * turn.sin(),
        );
        let wave = (2.0 * TAU * across + phases[0]).sin() + (5.0 * TAU * across + phases[1]).sin();
        along + 0.5 * COVER_WAVE * wave
    }
}

/// The height under which that share of the points lies.
fn threshold(heights: &[f64], share: f64) -> f64 {
    let mut sorted = heights.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = (share * sorted.len() as f64) as usize;
    sorted
        .get(at.min(sorted.len().saturating_sub(1)))
        .copied()
        .unwrap_or(0.0)
}

/// From 0 to 1 without corners.
fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Intrinsics {
        Intrinsics::centred(640, 360, 500.0)
    }

    fn clean() -> LensSettings {
        LensSettings {
            vignetting: 0.0,
            dirt_share: 0.0,
            occluded_share: 0.0,
            ..LensSettings::default()
        }
    }

    fn shade(lens: &LensSettings) -> Vec<f64> {
        let camera = camera();
        let shade = Shade::new(lens, &camera, Stream::new(4, 0, "glass"));
        let width = camera.width_px as usize;
        let mut passed = vec![0.0; width * camera.height_px as usize];
        for (v, row) in (0..).zip(passed.chunks_mut(width)) {
            shade.row(v, row);
        }
        passed.into_iter().map(f64::from).collect()
    }

    /// Fails where clean glass takes light, or a lattice too coarse bends the cosine's curve: a
    /// chord of it is off by h^2 / 8 of the second derivative, which is under 4 / f^2.
    #[test]
    fn vignetting_is_the_fourth_power_of_the_cosine() {
        assert!(shade(&clean()).iter().all(|p| (p - 1.0).abs() < 1e-12));
        let mut lens = clean();
        lens.vignetting = 1.0;
        let (camera, bound) = (camera(), 2.0 * 64.0 / 8.0 * 4.0 / 500f64.powi(2));
        for (k, passed) in (0u32..).zip(shade(&lens)) {
            let (x, y) = (
                f64::from(k % 640) - camera.cx_px,
                f64::from(k / 640) - camera.cy_px,
            );
            let right = (1.0 + (x * x + y * y) / 500f64.powi(2)).powi(-2);
            assert!((passed - right).abs() < bound, "{k}: {passed} {right}");
        }
    }

    /// Fails where dirt takes nothing or all, or lies in the same place in every lens.
    #[test]
    fn dirt_takes_light_where_it_lies() {
        let mut lens = clean();
        lens.dirt_share = 0.2;
        let passed = shade(&lens);
        let touched = passed.iter().filter(|p| **p < 0.999).count() as f64 / passed.len() as f64;
        // Some fifty blotches, which overlap, reach over the border and differ in size.
        assert!((0.12..0.27).contains(&touched), "{touched}");
        assert!(passed.iter().all(|p| *p > 0.0 && *p <= 1.0));
        let other = Shade::new(&lens, &camera(), Stream::new(5, 0, "glass"));
        assert_ne!(
            other,
            Shade::new(&lens, &camera(), Stream::new(4, 0, "glass"))
        );
    }

    /// Fails where the covered part is not the share that was asked for.
    #[test]
    fn a_cover_covers_its_share() {
        for share in [0.1, 0.5, 1.0] {
            let mut lens = clean();
            lens.occluded_share = share;
            let passed = shade(&lens);
            let lost = 1.0 - passed.iter().sum::<f64>() / passed.len() as f64;
            assert!((lost - share).abs() < 0.02, "{share}: {lost}");
        }
    }
}
