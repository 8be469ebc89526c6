//! From photo-electrons to digital numbers, as [`sensor`](crate::twin::render::sensor) has it.

use crate::twin::random::{Stream, pcg4d};
use crate::twin::render::pixel_map::{Dark, PixelMap};
use crate::twin::render::sensor::BLOOMING_REACH;
use crate::twin::render::{RawImage, View};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// A picture's signal on its way to digital numbers.
pub(super) struct ExposedSensor<'a> {
    pub view: &'a View,
    pub map: &'a PixelMap,
    /// Photo-electrons, row by row.
    pub signals_e: &'a [f64],
}

impl ExposedSensor<'_> {
    /// All pixels, with the noise of the view's frame.
    pub fn develop(&self) -> RawImage {
        let camera = &self.view.camera.intrinsics;
        let mut image = RawImage::new(camera.width_px, camera.height_px);
        let rows = image.par_chunks_mut((camera.width_px as usize).max(1));
        rows.enumerate().for_each(|(v, row)| self.row(v, row));
        image
    }

    fn row(&self, v: usize, row: &mut [u16]) {
        let sensor = &self.view.sensor;
        let dark = Dark::new(self.view);
        let (black, white) = (sensor.black_dn(), f64::from(sensor.white_dn()));
        let cell = &sensor.cell_dn_per_e()[v % 2 * 2..][..2];
        let (read_e, full_e) = (sensor.read_noise_e, sensor.full_well_e);
        let texels = row.len().div_ceil(4);
        let mut noise = [0.0; 4];
        for (u, out) in row.iter_mut().enumerate() {
            if sensor.noise && u % 4 == 0 {
                noise = normals(self.view, (v * texels + u / 4) as u32);
            }
            let mut charge_e = self.charge_e(&dark, u, v);
            if sensor.blooming > 0.0 {
                charge_e += self.spilled_e(&dark, u, v, charge_e);
            }
            let n = noise[u % 4];
            let deviation_e = (charge_e + read_e * read_e).max(0.0).sqrt();
            let electrons = (charge_e + deviation_e * n).min(full_e + read_e * n);
            *out = (black + cell[u % 2] * electrons).round().clamp(0.0, white) as u16;
        }
    }

    /// Before anything spills.
    fn charge_e(&self, dark: &Dark, u: usize, v: usize) -> f64 {
        let at = v * self.view.camera.intrinsics.width_px as usize + u;
        let signal_e = self.signals_e[at].min(self.view.saturation_e());
        dark.charge_e(self.map.row(v)[u], signal_e)
    }

    /// What comes into a pixel with `charge_e` from above and below; see
    /// [`BLOOMING_REACH`].
    fn spilled_e(&self, dark: &Dark, u: usize, v: usize, charge_e: f64) -> f64 {
        let (full_e, share) = (self.view.sensor.full_well_e, self.view.sensor.blooming);
        let height = self.view.camera.intrinsics.height_px as usize;
        let flow = |rows: &mut dyn Iterator<Item = usize>| {
            rows.fold(0.0, |flow: f64, row| {
                let over_e = self.charge_e(dark, u, row) - full_e;
                let added = if over_e > 0.0 { share * over_e } else { over_e };
                (flow + 0.5 * added).max(0.0)
            })
        };
        let above = flow(&mut (v.saturating_sub(BLOOMING_REACH)..v));
        let below = flow(&mut (v + 1..height.min(v + 1 + BLOOMING_REACH)).rev());
        let room_e = 0.5 * (full_e - charge_e).max(0.0);
        above.min(room_e) + below.min(room_e)
    }
}

/// Four standard normal numbers, for pixels 4k to 4k + 3 of a row (Box and Muller): those of
/// `shaders/sensor.wgsl`.
fn normals(view: &View, counter: u32) -> [f64; 4] {
    let Stream { key: [low, high] } = view.noise.stream;
    let word = pcg4d([low, high, view.noise.frame, counter]);
    // The upper 24 bits, which f32 holds.
    let [a, b, c, d] = word.map(|w| (f64::from(w >> 8) + 0.5) / 16_777_216.0);
    let pair = |radius: f64, turn: f64| {
        let (sin, cos) = (TAU * turn).sin_cos();
        let radius = (-2.0 * radius.ln()).sqrt();
        [radius * cos, radius * sin]
    };
    let ([first, third], [second, fourth]) = (pair(a, b), pair(c, d));
    [first, second, third, fourth]
}
