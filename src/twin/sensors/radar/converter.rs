//! Receivers' noise, and the converter behind them.
//!
//! Noise is thermal, Gaussian and white in both quadratures of every sample, from a counter-based stream by frame and
//! sample. The converter rounds to its own steps, of which 2^bits span the 16 bits of a count, and holds what is beyond its
//! ends: a strong echo near the train drives it there, and its edges spread over all ranges and speeds.
//!
//! Not modelled: leakage from transmitter to receiver, noise of the sweep's phase, offset and mismatch of the quadratures.

use super::link::{noise_w, watts};
use crate::bus::RadarSheet;
use crate::twin::random::Stream;
use nalgebra::Complex;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Samples that are made into counts at a time.
const TOGETHER: usize = 4096;

/// Noise and steps of a radar's receivers.
#[derive(Clone, Copy, Debug)]
pub struct Converter {
    noise: Stream,
    /// Of one quadrature, counts.
    sigma: f64,
    /// Counts.
    step: f32,
}

/// Counts of a tone of a power at a receiver's antenna.
pub fn counts_of(figures: &RadarSheet, power_w: f64) -> f64 {
    RadarSheet::FULL_SCALE * (power_w / watts(figures.full_scale_dbm)).sqrt()
}

impl Converter {
    /// Of a radar's true figures, with noise of a stream.
    pub fn new(figures: &RadarSheet, bits: u32, noise: Stream) -> Self {
        let power_w = noise_w(figures.waveform.sample_rate_hz, figures.noise_figure_db);
        Self {
            noise,
            sigma: counts_of(figures, power_w) * 0.5f64.sqrt(),
            step: 2f32.powi(16 - bits.clamp(1, 16) as i32),
        }
    }

    /// The counts of a frame.
    pub fn counts(&self, frame: u32, signal: &[Complex<f32>]) -> Vec<[i16; 2]> {
        let mut counts = vec![[0; 2]; signal.len()];
        let blocks = (counts.par_chunks_mut(TOGETHER)).zip(signal.par_chunks(TOGETHER));
        blocks.enumerate().for_each(|(block, (counts, signal))| {
            let numbers = (block * TOGETHER) as u32..;
            for ((count, sample), number) in counts.iter_mut().zip(signal).zip(numbers) {
                let [re, im] = self.normals(number, frame);
                *count = [self.held(sample.re + re), self.held(sample.im + im)];
            }
        });
        counts
    }

    /// Both quadratures of the noise of a sample (Box and Muller).
    fn normals(&self, sample: u32, frame: u32) -> [f32; 2] {
        let [a, b, ..] = self.noise.words(sample, frame);
        let unit = |word: u32| (f64::from(word) + 0.5) / 4_294_967_296.0;
        let radius = self.sigma * (-2.0 * unit(a).ln()).sqrt();
        let (sin, cos) = (TAU * unit(b)).sin_cos();
        [(radius * cos) as f32, (radius * sin) as f32]
    }

    /// Rounded to a step, and held within the converter's ends.
    fn held(&self, value: f32) -> i16 {
        let most = 32768.0 - self.step;
        ((value / self.step).round() * self.step).clamp(-32768.0, most) as i16
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::TrainEnd;
    use crate::twin::sensors::radar::RadarSettings;

    fn converter(bits: u32) -> (Converter, RadarSheet) {
        let figures = RadarSettings::default().sheet(TrainEnd::Front);
        let stream = Stream::new(1, 0, "converter test");
        (Converter::new(&figures, bits, stream), figures)
    }

    /// Power k T B F, both quadratures alike, without a mean, without correlation, another in the next frame.
    #[test]
    fn noise_is_thermal_and_white() {
        let (converter, figures) = converter(16);
        let n = 200_000;
        let frame = |number| -> Vec<Complex<f64>> {
            let counts = converter.counts(number, &vec![Complex::default(); n]);
            let complex = |[re, im]: [i16; 2]| Complex::new(f64::from(re), f64::from(im));
            counts.into_iter().map(complex).collect()
        };
        let (first, second) = (frame(0), frame(1));
        let power = |a: &[Complex<f64>], b: &[Complex<f64>]| {
            (a.iter()
                .zip(b)
                .map(|(a, b)| a * b.conj())
                .sum::<Complex<f64>>()
                / n as f64)
                .norm()
        };
        let expected = counts_of(&figures, 1.380_649e-23 * 290.0 * 25e6 * 10f64.powf(1.3)).powi(2);
        // A mean of n exponentials scatters by 1 / sqrt(n), and so do products of two.
        let slack = 5.0 / (n as f64).sqrt();
        assert!((power(&first, &first) / expected - 1.0).abs() < slack);
        assert!(power(&first, &second) / expected < slack);
        assert!(power(&first[1..], &first) / expected < slack);
        let mean = first.iter().sum::<Complex<f64>>() / n as f64;
        assert!(mean.norm() / expected.sqrt() < slack);
        let real = first.iter().map(|z| z.re * z.re).sum::<f64>() / n as f64;
        assert!((real / expected - 0.5).abs() < slack);
        let fourth = first.iter().map(|z| z.re.powi(4)).sum::<f64>() / n as f64;
        assert!((fourth / (real * real) - 3.0).abs() < 5.0 * (96.0 / n as f64).sqrt());
    }

    /// Steps of 2^(16 - bits), ends that hold.
    #[test]
    fn the_converter_rounds_and_holds() {
        let (converter, _) = converter(12);
        let step = converter.step;
        assert!((step - 16.0).abs() < f32::EPSILON);
        assert_eq!([converter.held(23.0), converter.held(25.0)], [16, 32]);
        assert_eq!([converter.held(1e6), converter.held(-1e6)], [32752, -32768]);
        let loud = vec![Complex::new(4e4, -4e4); 1000];
        assert!(
            converter
                .counts(0, &loud)
                .iter()
                .all(|c| *c == [32752, -32768])
        );
    }

    /// The same seed gives the same counts on one thread and on three.
    #[test]
    fn threads_do_not_count() {
        let (converter, _) = converter(12);
        let signal = vec![Complex::new(100.0, -50.0); 50_000];
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.map(|pool| pool.install(|| converter.counts(3, &signal)))
                .ok()
        };
        assert!(on(1).is_some() && on(1) == on(3));
    }
}
