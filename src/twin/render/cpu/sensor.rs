//! From luminance to 8-bit grey.

use crate::twin::random::pcg4d;
use crate::twin::render::View;
use crate::twin::render::surface::SATURATION_GREY;
use std::f64::consts::TAU;

/// Turns the luminances of row `v` into grey levels, with the noise of their pixels.
pub(super) fn expose(view: &View, v: usize, luminances: &[f64], row: &mut [u8]) {
    let sensor = &view.sensor;
    let grey_per_luminance = sensor.grey_per_cd_s * view.camera.shutter.exposure_s;
    let read_variance = (sensor.read_noise_e / sensor.electrons_per_grey).powi(2);
    let [low, high] = view.noise.stream.key;
    for (u, (out, luminance)) in row.iter_mut().zip(luminances).enumerate() {
        let clean = sensor.black_level_grey + grey_per_luminance * luminance;
        let mut grey = clean.min(SATURATION_GREY);
        if sensor.noise {
            let shot = (grey - sensor.black_level_grey).max(0.0) / sensor.electrons_per_grey;
            let pixel = (v * luminances.len() + u) as u32;
            let words = pcg4d([low, high, view.noise.frame, pixel]);
            grey += (shot + read_variance).sqrt() * normal(words[0], words[1]);
        }
        *out = grey.round().clamp(0.0, 255.0) as u8;
    }
}

/// Standard normal from two words (Box and Muller).
fn normal(a: u32, b: u32) -> f64 {
    let unit = |w: u32| (f64::from(w) + 0.5) / 4_294_967_296.0;
    (-2.0 * unit(a).ln()).sqrt() * (TAU * unit(b)).cos()
}
