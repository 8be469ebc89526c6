//! From luminance to 8-bit grey.

use crate::twin::random::pcg4d;
use crate::twin::render::View;
use std::f64::consts::TAU;

/// Turns the luminances of row `v` into grey levels, with the noise of their pixels.
pub(super) fn expose(view: &View, v: usize, luminances: &[f64], row: &mut [u8]) {
    let sensor = &view.sensor;
    let electrons_per_luminance = view.electrons_per_cd_m2();
    let grey_per_e = sensor.grey_per_e();
    let [low, high] = view.noise.stream.key;
    for (u, (out, luminance)) in row.iter_mut().zip(luminances).enumerate() {
        let mut electrons = (electrons_per_luminance * luminance).min(view.saturation_e());
        if sensor.noise {
            let variance = electrons.max(0.0) + sensor.read_noise_e.powi(2);
            let pixel = (v * luminances.len() + u) as u32;
            let words = pcg4d([low, high, view.noise.frame, pixel]);
            electrons += variance.sqrt() * normal(words[0], words[1]);
        }
        let grey = sensor.black_level_grey + grey_per_e * electrons;
        *out = grey.round().clamp(0.0, 255.0) as u8;
    }
}

/// Standard normal from two words (Box and Muller).
fn normal(a: u32, b: u32) -> f64 {
    let unit = |w: u32| (f64::from(w) + 0.5) / 4_294_967_296.0;
    (-2.0 * unit(a).ln()).sqrt() * (TAU * unit(b)).cos()
}
