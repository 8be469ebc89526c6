//! Random deviation of the rails from their designed place: vertical, lateral and cross level,
//! independent of each other.
//!
//! The spectra are one-sided over the angular wave number, S(Omega) in m^2/(rad/m), so that the
//! variance in a band is the integral of S dOmega. German spectra (low and high disturbance) as
//! in Claus and Schiehlen, "Modeling and simulation of railway bogie structural vibrations",
//! Vehicle System Dynamics 29 (1998) S1; FRA classes as in Fries and Coffey, "A state-space
//! approach to the synthesis of random vertical and crosslevel rail irregularities", ASME J. Dyn.
//! Sys. 112 (1990).
//!
//! A realisation is a table on a fine grid: each harmonic of the table's length gets a complex
//! normal amplitude of variance S dOmega from the counter-based stream, and one inverse Fourier
//! transform sums them. So the process is Gaussian with exactly the wanted spectrum inside the
//! wavelength bounds and nothing outside. The table is periodic in its length, which is over
//! that of the line.

#[cfg(test)]
mod tests;

use super::deviation::Deviation;
use crate::settings::{Checker, settings};
use crate::track::CANT_BASE_M;
use crate::twin::random::Stream;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Which spectrum the irregularity follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum IrregularityClass {
    /// Perfect track.
    None,
    /// German spectra, low disturbance.
    #[default]
    GermanLow,
    /// German spectra, high disturbance.
    GermanHigh,
    /// FRA class 1, the worst.
    Fra1,
    /// FRA class 2.
    Fra2,
    /// FRA class 3.
    Fra3,
    /// FRA class 4.
    Fra4,
    /// FRA class 5.
    Fra5,
    /// FRA class 6, the best.
    Fra6,
}

settings! {
    /// How uneven the track is.
    #[derive(Copy)]
    pub struct IrregularitySettings {
        /// Which spectrum.
        class: IrregularityClass = IrregularityClass::GermanLow;
        /// Shortest wavelength, metres.
        shortest_m: f64 = 1.0, in 0.5..=100.0;
        /// Longest wavelength, metres.
        longest_m: f64 = 80.0, in 1.0..=300.0;
    }
    also check_order
}

impl IrregularitySettings {
    fn check_order(&self, check: &mut Checker<'_>) {
        check.within("longest_m", self.longest_m, 2.0 * self.shortest_m..=300.0);
    }
}

/// Which of the four signals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Signal {
    Vertical,
    Lateral,
    CrossLevel,
    Gauge,
}

/// Corner wave numbers of the German spectra, rad/m.
const GERMAN_CORNER: f64 = 0.8246;
const GERMAN_LONG: f64 = 0.0206;
const GERMAN_CROSS: f64 = 0.4380;
/// Half the distance of the contact points in the German cross level, metres.
const GERMAN_HALF_BASE_M: f64 = 0.75;
/// Corner wave number and scale of the FRA spectra.
const FRA_CORNER: f64 = 0.8245;
const FRA_SCALE: f64 = 0.25;

impl IrregularityClass {
    /// One-sided density at `omega` (rad/m): m^2/(rad/m), of the cross level rad^2/(rad/m).
    fn density(self, signal: Signal, omega: f64) -> f64 {
        let german = |scales| german(scales, signal, omega);
        let fra = |scales, cross_corner| fra(scales, cross_corner, signal, omega);
        match self {
            Self::None => 0.0,
            Self::GermanLow => german([4.032e-7, 2.119e-7, 5.32e-8]),
            Self::GermanHigh => german([1.08e-6, 6.125e-7, 1.032e-7]),
            Self::Fra1 => fra([1.2107, 3.3634], 0.6046),
            Self::Fra2 => fra([1.0181, 1.2107], 0.9308),
            Self::Fra3 => fra([0.6816, 0.4128], 0.8520),
            Self::Fra4 => fra([0.5376, 0.3027], 1.1312),
            Self::Fra5 => fra([0.2095, 0.0762], 0.8209),
            Self::Fra6 => fra([0.0339, 0.0339], 0.4380),
        }
    }
}

/// Of German track, by the scales of vertical, lateral and gauge.
fn german([vertical, lateral, gauge]: [f64; 3], signal: Signal, omega: f64) -> f64 {
    let o2 = omega * omega;
    let (c2, r2) = (GERMAN_CORNER.powi(2), GERMAN_LONG.powi(2));
    let shape = c2 / ((o2 + r2) * (o2 + c2));
    let short = shape * o2 / (o2 + GERMAN_CROSS.powi(2));
    match signal {
        Signal::Vertical => vertical * shape,
        Signal::Lateral => lateral * shape,
        Signal::CrossLevel => vertical / GERMAN_HALF_BASE_M.powi(2) * short,
        Signal::Gauge => gauge * short,
    }
}

/// Of track of an FRA class, by the scales of vertical and lateral in cm^2 rad/m, as its tables
/// have them.
fn fra(scales: [f64; 2], cross_corner: f64, signal: Signal, omega: f64) -> f64 {
    let [vertical, lateral] = scales.map(|scale| scale * 1e-4);
    let o2 = omega * omega;
    let c2 = FRA_CORNER.powi(2);
    let shape = FRA_SCALE * c2 / (o2 + c2);
    let short = 4.0 * vertical * shape / (o2 + cross_corner.powi(2));
    match signal {
        Signal::Vertical => vertical * shape / o2,
        Signal::Lateral => lateral * shape / o2,
        // Given as the height of one rail over the other.
        Signal::CrossLevel => short / CANT_BASE_M.powi(2),
        Signal::Gauge => short,
    }
}

/// Grid of the table: ten points in the shortest wavelength that the settings allow.
const GRID_M: f64 = 0.05;

/// One realisation.
#[derive(Clone, Default)]
pub(super) struct Irregularity {
    /// Up, left, roll, gauge; empty for perfect track, otherwise a power of two long.
    table: Vec<[f64; 4]>,
}

impl Irregularity {
    /// For a line of `length_m`.
    pub(super) fn new(
        settings: &IrregularitySettings,
        length_m: f64,
        seed: u64,
        index: u64,
    ) -> Self {
        if settings.class == IrregularityClass::None {
            return Self::default();
        }
        // At least ten of the longest waves.
        let span_m = length_m.max(10.0 * settings.longest_m);
        let n = ((span_m / GRID_M).ceil() as usize).next_power_of_two();
        let [up, left, roll, gauge] = [
            (Signal::Vertical, "track vertical"),
            (Signal::Lateral, "track lateral"),
            (Signal::CrossLevel, "track cross level"),
            (Signal::Gauge, "track gauge"),
        ]
        .map(|(signal, name)| synthesise(n, settings, signal, Stream::new(seed, index, name)));
        let rows = (0..n).map(|k| [up[k], left[k], roll[k], gauge[k]]);
        Self {
            table: rows.collect(),
        }
    }

    /// At any chainage, by cubic (Catmull-Rom) interpolation.
    pub(super) fn at(&self, s_m: f64) -> Deviation {
        if self.table.is_empty() {
            return Deviation::default();
        }
        let x = s_m / GRID_M;
        let mask = self.table.len() - 1;
        // Two's complement makes the table periodic for negative chainage, too.
        let k = (x.floor() as i64) as usize;
        let t = x - x.floor();
        let p: [&[f64; 4]; 4] =
            std::array::from_fn(|j| &self.table[k.wrapping_add(j).wrapping_sub(1) & mask]);
        let [
            (up_m, up),
            (left_m, left),
            (roll_rad, roll),
            (gauge_m, gauge),
        ] = std::array::from_fn(|j| catmull_rom([p[0][j], p[1][j], p[2][j], p[3][j]], t));
        Deviation {
            up_m,
            left_m,
            roll_rad,
            gauge_m,
            up_per_m: up / GRID_M,
            left_per_m: left / GRID_M,
            roll_rad_per_m: roll / GRID_M,
            gauge_per_m: gauge / GRID_M,
        }
    }
}

/// Value and derivative between the middle two of four points, a grid step being 1.
fn catmull_rom(p: [f64; 4], t: f64) -> (f64, f64) {
    let a = 0.5 * (3.0 * (p[1] - p[2]) + p[3] - p[0]);
    let b = p[0] - 2.5 * p[1] + 2.0 * p[2] - 0.5 * p[3];
    let c = 0.5 * (p[2] - p[0]);
    (
        ((a * t + b) * t + c) * t + p[1],
        (3.0 * a * t + 2.0 * b) * t + c,
    )
}

/// A real Gaussian signal of `n` (a power of two) grid points with the density of its class.
fn synthesise(
    n: usize,
    settings: &IrregularitySettings,
    signal: Signal,
    stream: Stream,
) -> Vec<f64> {
    let step = TAU / (n as f64 * GRID_M);
    let (low, high) = (TAU / settings.longest_m, TAU / settings.shortest_m);
    let mut wave = vec![[0.0, 0.0]; n];
    for (k, amplitude) in wave.iter_mut().enumerate().take(n / 2).skip(1) {
        let omega = k as f64 * step;
        if (low..=high).contains(&omega) {
            // a cos + b sin with a, b of variance S dOmega each has the variance S dOmega.
            let sigma = (settings.class.density(signal, omega) * step).sqrt();
            let k = 2 * k as u64;
            *amplitude = [sigma * stream.normal(k), sigma * stream.normal(k + 1)];
        }
    }
    fourier(&mut wave);
    wave.into_iter().map(|[re, _]| re).collect()
}

/// In-place radix-2 transform, sum of x_k exp(i TAU k j / n), n a power of two.
fn fourier(x: &mut [[f64; 2]]) {
    let n = x.len();
    if n < 2 {
        return;
    }
    let shift = usize::BITS - n.trailing_zeros();
    for k in 0..n {
        let j = k.reverse_bits() >> shift;
        if k < j {
            x.swap(k, j);
        }
    }
    let turns: Vec<[f64; 2]> = (0..n / 2)
        .map(|k| {
            let (sin, cos) = (TAU * k as f64 / n as f64).sin_cos();
            [cos, sin]
        })
        .collect();
    let mut half = 1;
    while half < n {
        for block in x.chunks_exact_mut(2 * half) {
            let (even, odd) = block.split_at_mut(half);
            for (k, (e, o)) in even.iter_mut().zip(odd).enumerate() {
                let w = turns[k * (n / (2 * half))];
                let turned = [w[0] * o[0] - w[1] * o[1], w[0] * o[1] + w[1] * o[0]];
                *o = [e[0] - turned[0], e[1] - turned[1]];
                *e = [e[0] + turned[0], e[1] + turned[1]];
            }
        }
        half *= 2;
    }
}
