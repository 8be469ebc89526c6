//! Windows that samples are weighted with before a Fourier transform: they lower the side lobes of a strong echo, widen
//! its main lobe and cost signal over noise.
//!
//! Of weights w_n over N samples, with n counted from their middle, and of frequencies in bins (of 1 / N):
//! processing loss: N sum w^2 / (sum w)^2, which is the equivalent noise bandwidth in bins;
//! width: where the power of the main lobe has fallen by 3 dB;
//! error: a frequency that is estimated where the spectrum of the weighted samples is highest has the variance
//! sum w^2 n^2 (sum w)^2 / (2 s sum w^2 (sum w n^2)^2), radians^2, with s the ratio of signal to noise in the spectrum
//! at its highest. Without a window this is the Cramer-Rao bound 6 / (s N^2).
//!
//! Source: F. J. Harris, On the Use of Windows for Harmonic Analysis with the Discrete Fourier Transform, Proc. IEEE 66
//! (1978), table 1; P. Lynch, The Dolph-Chebyshev Window, Mon. Wea. Rev. 125 (1997), for the weights; D. C. Rife and
//! R. R. Boorstyn, IEEE Trans. Inf. Theory 20 (1974), for the bound.

use crate::numerics::bisected;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// Which weights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "RadarWindow")]
pub enum Window {
    /// All alike: the best resolution, no loss, side lobes 13 dB below the main lobe.
    Rectangular,
    /// Raised cosine: side lobes of 31 dB that fall by 18 dB an octave; 1.8 dB loss.
    Hann,
    /// All side lobes equally high, and the main lobe as narrow as that allows; 1.8 dB loss at 60 dB.
    #[default]
    Chebyshev,
}

/// Weights, and what they do to an echo.
#[derive(Clone, Debug)]
pub struct Weights {
    /// Scaled so that the sum of their squares is one: noise keeps its power.
    pub values: Vec<f64>,
    /// Signal over noise that they cost, dB.
    pub loss_db: f64,
    /// Width of the main lobe where its power is halved, bins.
    pub width_bins: f64,
    /// From the middle of the main lobe to its first null, bins.
    pub null_bins: f64,
    /// Highest side lobe below the main lobe, dB.
    pub side_lobe_db: f64,
    /// Standard deviation of a frequency with a ratio of signal to noise of one in the spectrum, bins.
    pub error_bins: f64,
}

impl Weights {
    /// For so many samples; a Chebyshev window with side lobes so far down, dB.
    pub fn new(window: Window, count: usize, chebyshev_db: f64) -> Self {
        let raw: Vec<f64> = match window {
            Window::Rectangular => vec![1.0; count],
            Window::Hann => hann(count),
            Window::Chebyshev if count < 3 => vec![1.0; count],
            Window::Chebyshev => chebyshev(count, chebyshev_db),
        };
        let norm = raw.iter().map(|w| w * w).sum::<f64>().sqrt();
        let values: Vec<f64> = raw.iter().map(|w| w / norm).collect();
        let gain = values.iter().sum::<f64>();
        let null_bins = first_null(&values);
        Self {
            loss_db: 10.0 * (count as f64 / (gain * gain)).log10(),
            width_bins: 2.0 * half_width(&values, null_bins),
            side_lobe_db: highest_side_lobe(&values, null_bins),
            error_bins: error_bins(&values),
            null_bins,
            values,
        }
    }

    /// Amplitude of a tone of amplitude one in the middle of its main lobe.
    pub fn gain(&self) -> f64 {
        self.values.iter().sum()
    }

    /// Amplitude so many bins from the middle, of one there.
    pub fn response(&self, bins: f64) -> f64 {
        amplitude(&self.values, bins) / self.gain()
    }
}

/// The periodic one, as for spectra.
fn hann(count: usize) -> Vec<f64> {
    let phase = |n: usize| TAU * (n as f64 + 0.5) / count as f64;
    (0..count).map(|n| 0.5 - 0.5 * phase(n).cos()).collect()
}

fn chebyshev(count: usize, side_lobes_db: f64) -> Vec<f64> {
    let order = (count - 1) as f64;
    let ratio = 10f64.powf(side_lobes_db / 20.0);
    let widest = (ratio.acosh() / order).cosh();
    let term =
        |k: usize| chebyshev_polynomial(order, widest * (PI * k as f64 / count as f64).cos());
    let terms: Vec<f64> = (1..=order as usize / 2).map(term).collect();
    let weight = |n: usize| {
        let from_middle = TAU * (n as f64 - 0.5 * order) / count as f64;
        let waves = terms.iter().zip(1..);
        ratio
            + 2.0
                * waves
                    .map(|(t, k)| t * (f64::from(k) * from_middle).cos())
                    .sum::<f64>()
    };
    (0..count).map(weight).collect()
}

/// Of the first kind.
fn chebyshev_polynomial(order: f64, x: f64) -> f64 {
    if x.abs() <= 1.0 {
        (order * x.acos()).cos()
    } else {
        // Only the middle one is beyond 1, and none is below -1: the cosine is that of angles up to 90 degrees.
        (order * x.abs().acosh()).cosh()
    }
}

/// Amplitude so far from a tone's frequency. Weights are even about their middle.
fn amplitude(values: &[f64], bins: f64) -> f64 {
    let middle = 0.5 * (values.len() as f64 - 1.0);
    let step = TAU * bins / values.len() as f64;
    let wave = |(n, w): (usize, &f64)| w * (step * (n as f64 - middle)).cos();
    values.iter().enumerate().map(wave).sum()
}

/// The amplitude first changes its sign, or where it does not, first is lowest.
fn first_null(values: &[f64]) -> f64 {
    let steps = 8 * values.len();
    let at = |k: usize| k as f64 / 16.0;
    let crossing = (1..steps).find(|k| amplitude(values, at(*k)) <= 0.0);
    let Some(k) = crossing else {
        return 0.5 * values.len() as f64;
    };
    bisected((at(k - 1), at(k)), 40, |bins| amplitude(values, bins) > 0.0).0
}

fn half_width(values: &[f64], null_bins: f64) -> f64 {
    let half = amplitude(values, 0.0) * 0.5f64.sqrt();
    bisected((0.0, null_bins), 40, |bins| amplitude(values, bins) > half).0
}

fn highest_side_lobe(values: &[f64], null_bins: f64) -> f64 {
    let last = 0.5 * values.len() as f64;
    let steps = (32.0 * (last - null_bins)).max(0.0) as usize;
    let lobes = (0..steps).map(|k| amplitude(values, null_bins + k as f64 / 32.0).abs());
    let highest = lobes.fold(f64::MIN_POSITIVE, f64::max);
    20.0 * (amplitude(values, 0.0) / highest).log10()
}

fn error_bins(values: &[f64]) -> f64 {
    let middle = 0.5 * (values.len() as f64 - 1.0);
    let sum = |term: &dyn Fn(f64, f64) -> f64| -> f64 {
        let terms = values.iter().enumerate();
        terms.map(|(n, w)| term(*w, n as f64 - middle)).sum()
    };
    let spread = sum(&|w, n| w * n * n);
    let power = sum(&|w, _| w * w);
    let variance = sum(&|w, n| (w * n).powi(2)) * sum(&|w, _| w).powi(2);
    let radians = (variance / (2.0 * power)).sqrt() / spread;
    radians * values.len() as f64 / TAU
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Harris 1978, table 1: equivalent noise bandwidth and 3 dB width in bins, highest side lobe in dB.
    #[test]
    fn val_losses_and_widths_are_those_of_harris() {
        let table = [
            (Window::Rectangular, 0.0, 1.00, 0.89, 13.0),
            (Window::Hann, 0.0, 1.50, 1.44, 32.0),
            (Window::Chebyshev, 50.0, 1.39, 1.33, 50.0),
            (Window::Chebyshev, 60.0, 1.51, 1.44, 60.0),
            (Window::Chebyshev, 70.0, 1.62, 1.55, 70.0),
            (Window::Chebyshev, 80.0, 1.73, 1.65, 80.0),
        ];
        for (window, db, bandwidth, width, side_lobe_db) in table {
            for count in [255, 256] {
                let weights = Weights::new(window, count, db);
                let noise_bins = 10f64.powf(0.1 * weights.loss_db);
                assert!(
                    (noise_bins - bandwidth).abs() < 0.02,
                    "{window:?} {noise_bins}"
                );
                assert!(
                    (weights.width_bins - width).abs() < 0.015,
                    "{window:?} {weights:?}"
                );
                let side = weights.side_lobe_db;
                assert!((side - side_lobe_db).abs() < 0.6, "{window:?} {side}");
                let power: f64 = weights.values.iter().map(|w| w * w).sum();
                assert!((power - 1.0).abs() < 1e-12);
            }
        }
    }

    /// Without a window a frequency is as good as the Cramer-Rao bound: sqrt(6) / 2 pi bins at one.
    #[test]
    fn the_error_without_a_window_is_the_bound() {
        let weights = Weights::new(Window::Rectangular, 256, 0.0);
        assert!((weights.error_bins / (6f64.sqrt() / TAU) - 1.0).abs() < 1e-4);
        assert!((weights.null_bins - 1.0).abs() < 1e-9);
        assert!(Weights::new(Window::Hann, 256, 0.0).error_bins > weights.error_bins);
    }

    /// Provokes: windows of no, one and two samples.
    #[test]
    fn short_windows_do_not_panic() {
        for window in [Window::Rectangular, Window::Hann, Window::Chebyshev] {
            for count in 0..5 {
                assert_eq!(Weights::new(window, count, 60.0).values.len(), count);
            }
        }
    }
}
