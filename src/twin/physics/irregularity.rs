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

use super::defect::{DefectSettings, Defects};
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

/// Constants of one class, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Spectra {
    German {
        vertical: f64,
        lateral: f64,
        gauge: f64,
    },
    Fra {
        vertical: f64,
        lateral: f64,
        cross_corner: f64,
    },
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
    fn spectra(self) -> Option<Spectra> {
        let german = |vertical, lateral, gauge| {
            Some(Spectra::German {
                vertical,
                lateral,
                gauge,
            })
        };
        // FRA tables are in cm^2 rad/m.
        let fra = |vertical: f64, lateral: f64, cross_corner| {
            Some(Spectra::Fra {
                vertical: vertical * 1e-4,
                lateral: lateral * 1e-4,
                cross_corner,
            })
        };
        match self {
            Self::None => None,
            Self::GermanLow => german(4.032e-7, 2.119e-7, 5.32e-8),
            Self::GermanHigh => german(1.08e-6, 6.125e-7, 1.032e-7),
            Self::Fra1 => fra(1.2107, 3.3634, 0.6046),
            Self::Fra2 => fra(1.0181, 1.2107, 0.9308),
            Self::Fra3 => fra(0.6816, 0.4128, 0.8520),
            Self::Fra4 => fra(0.5376, 0.3027, 1.1312),
            Self::Fra5 => fra(0.2095, 0.0762, 0.8209),
            Self::Fra6 => fra(0.0339, 0.0339, 0.4380),
        }
    }
}

impl Spectra {
    /// One-sided density at `omega` (rad/m): m^2/(rad/m), of the cross level rad^2/(rad/m).
    fn density(self, signal: Signal, omega: f64) -> f64 {
        let o2 = omega * omega;
        match self {
            Self::German {
                vertical,
                lateral,
                gauge,
            } => {
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
            Self::Fra {
                vertical,
                lateral,
                cross_corner,
            } => {
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
        }
    }
}

/// Deviation of the track at one chainage, and its derivative along it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Deviation {
    /// Up.
    pub up_m: f64,
    /// To the left.
    pub left_m: f64,
    /// Left rail over right, as an angle.
    pub roll_rad: f64,
    /// Of the rails' distance.
    pub gauge_m: f64,
    /// Of `up_m`.
    pub up_per_m: f64,
    /// Of `left_m`.
    pub left_per_m: f64,
    /// Of `roll_rad`.
    pub roll_rad_per_m: f64,
    /// Of `gauge_m`.
    pub gauge_per_m: f64,
}

/// Grid of the table: ten points in the shortest wavelength that the settings allow.
const GRID_M: f64 = 0.05;

/// One realisation.
#[derive(Clone, Default)]
pub(super) struct Irregularity {
    /// Up, left, roll, gauge; empty for perfect track, otherwise a power of two long.
    table: Vec<[f64; 4]>,
    defects: Defects,
}

impl Irregularity {
    /// For a line of `length_m`.
    pub(super) fn new(
        settings: &IrregularitySettings,
        length_m: f64,
        seed: u64,
        index: u64,
    ) -> Self {
        let Some(spectra) = settings.class.spectra() else {
            return Self::default();
        };
        // At least ten of the longest waves.
        let span_m = length_m.max(10.0 * settings.longest_m);
        let n = ((span_m / GRID_M).ceil() as usize).next_power_of_two();
        let signal = |signal, name| {
            let stream = Stream::new(seed, index, name);
            synthesise(n, settings, |o| spectra.density(signal, o), stream)
        };
        let up = signal(Signal::Vertical, "track vertical");
        let left = signal(Signal::Lateral, "track lateral");
        let roll = signal(Signal::CrossLevel, "track cross level");
        let gauge = signal(Signal::Gauge, "track gauge");
        let rows = (0..n).map(|k| [up[k], left[k], roll[k], gauge[k]]);
        let table = rows.collect();
        Self {
            table,
            ..Self::default()
        }
    }

    /// The same with single defects on top.
    pub(super) fn with_defects(self, defects: &[DefectSettings]) -> Self {
        let defects = Defects::new(defects);
        Self { defects, ..self }
    }

    /// At any chainage.
    pub(super) fn at(&self, s_m: f64) -> Deviation {
        let mut deviation = self.random_at(s_m);
        self.defects.add(s_m, &mut deviation);
        deviation
    }

    /// By cubic (Catmull-Rom) interpolation.
    fn random_at(&self, s_m: f64) -> Deviation {
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

/// A real Gaussian signal of `n` (a power of two) grid points with the given density.
fn synthesise(
    n: usize,
    settings: &IrregularitySettings,
    density: impl Fn(f64) -> f64,
    stream: Stream,
) -> Vec<f64> {
    let step = TAU / (n as f64 * GRID_M);
    let (low, high) = (TAU / settings.longest_m, TAU / settings.shortest_m);
    let mut wave = vec![[0.0, 0.0]; n];
    for (k, amplitude) in wave.iter_mut().enumerate().take(n / 2).skip(1) {
        let omega = k as f64 * step;
        if (low..=high).contains(&omega) {
            // a cos + b sin with a, b of variance S dOmega each has the variance S dOmega.
            let sigma = (density(omega) * step).sqrt();
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

#[cfg(test)]
mod tests {
    use super::*;

    /// RMS of a signal of the table in a wavelength band, over `seeds` realisations: projects on
    /// the harmonics one by one, so it shares nothing with the generator's transform.
    fn band_rms(class: IrregularityClass, signal: usize, from_m: f64, to_m: f64) -> f64 {
        let settings = IrregularitySettings {
            class,
            // Keeps the samples below free of aliases.
            shortest_m: 2.0,
            ..IrregularitySettings::default()
        };
        let (n, dx, seeds) = (8192, 0.8, 20);
        let span = n as f64 * dx;
        let mut power = 0.0;
        for seed in 0..seeds {
            let track = Irregularity::new(&settings, span, seed, 0);
            assert!((track.table.len() as f64 * GRID_M - span).abs() < 1e-9);
            let x: Vec<f64> = (0..n)
                .map(|k| {
                    let d = track.at(k as f64 * dx);
                    [d.up_m, d.left_m, d.roll_rad][signal]
                })
                .collect();
            for k in (span / to_m).ceil() as usize..(span / from_m).ceil() as usize {
                let (mut a, mut b) = (0.0, 0.0);
                let (sin1, cos1) = (TAU * k as f64 / n as f64).sin_cos();
                let (mut sin, mut cos) = (0.0, 1.0);
                for v in &x {
                    a += v * cos;
                    b += v * sin;
                    (sin, cos) = (sin * cos1 + cos * sin1, cos * cos1 - sin * sin1);
                }
                power += 2.0 * (a * a + b * b) / (n as f64).powi(2);
            }
        }
        (power / seeds as f64).sqrt()
    }

    /// Swapped constants, cycles for radians, a two-sided density taken for one-sided or a wrong
    /// normalisation of the transform all miss these.
    #[test]
    fn val_german_band_rms() {
        use IrregularityClass::{GermanHigh, GermanLow};
        for (class, signal, from_m, to_m, want_mm) in [
            (GermanLow, 0, 3.0, 25.0, 0.98),
            (GermanLow, 0, 25.0, 70.0, 1.65),
            (GermanLow, 1, 3.0, 25.0, 0.71),
            (GermanLow, 1, 25.0, 70.0, 1.20),
            (GermanHigh, 0, 3.0, 25.0, 1.61),
            (GermanHigh, 0, 25.0, 70.0, 2.70),
        ] {
            let got = 1e3 * band_rms(class, signal, from_m, to_m);
            eprintln!("{class:?} signal {signal} {from_m}-{to_m} m: {got:.3} mm, {want_mm} mm");
            // 20 realisations of 6.5 km hold 20 x 168 harmonics in the long band: their RMS
            // scatters by 0.9 % (one sigma).
            assert!(
                (got / want_mm - 1.0).abs() < 0.05,
                "{got} against {want_mm} mm"
            );
        }
    }

    /// The formulas as published, apart from the code above: vertical, lateral, cross level (rad),
    /// gauge, of German low and high disturbance and of FRA class 4.
    fn published(class: IrregularityClass, o: f64) -> [f64; 4] {
        let (c2, r2, s2) = (0.8246 * 0.8246, 0.0206 * 0.0206, 0.4380 * 0.4380);
        let long = c2 / ((o * o + r2) * (o * o + c2));
        let short = long * o * o / (o * o + s2);
        let german = |v: f64, a: f64, g: f64| [v * long, a * long, v / 0.5625 * short, g * short];
        match class {
            IrregularityClass::GermanLow => german(4.032e-7, 2.119e-7, 5.32e-8),
            IrregularityClass::GermanHigh => german(1.08e-6, 6.125e-7, 1.032e-7),
            _ => {
                let c2 = 0.8245 * 0.8245;
                let long = 0.25e-4 * c2 / (o * o * (o * o + c2));
                let short =
                    4.0 * 0.25e-4 * 0.5376 * c2 / ((o * o + c2) * (o * o + 1.1312 * 1.1312));
                [0.5376 * long, 0.3027 * long, short / 2.25, short]
            }
        }
    }

    /// A wrong constant, corner, unit or exponent of any signal puts a third-octave band off: mean
    /// of 20 realisations against the formulas, 2 to 80 m. The longest band has 20 x 20 harmonics,
    /// so its power scatters by 0.2 dB (one sigma).
    #[test]
    fn val_spectra_in_third_octaves() {
        use IrregularityClass::{Fra4, GermanHigh, GermanLow};
        let (n, dx, seeds) = (8192, 0.8, 20);
        let span = n as f64 * dx;
        for class in [GermanLow, GermanHigh, Fra4] {
            let settings = IrregularitySettings {
                class,
                // Keeps the samples free of aliases.
                shortest_m: 2.0,
                longest_m: 80.0,
            };
            let mut power = vec![[0.0; 4]; n];
            for seed in 0..seeds {
                let track = Irregularity::new(&settings, span, seed, 0);
                for signal in 0..4 {
                    let at = |k: usize| {
                        let d = track.at(k as f64 * dx);
                        [[d.up_m, d.left_m, d.roll_rad, d.gauge_m][signal], 0.0]
                    };
                    let mut x: Vec<[f64; 2]> = (0..n).map(at).collect();
                    fourier(&mut x);
                    for (power, [re, im]) in power.iter_mut().zip(&x) {
                        power[signal] += 2.0 * (re * re + im * im) / (n as f64).powi(2);
                    }
                }
            }
            let mut worst = [0.0f64; 4];
            let mut from_m = 2.0;
            while from_m < 79.0 {
                let to_m = from_m * 2f64.cbrt();
                let band = (span / to_m).ceil() as usize..(span / from_m).ceil() as usize;
                for signal in 0..4 {
                    let got: f64 = band.clone().map(|k| power[k][signal] / seeds as f64).sum();
                    let density = |k: usize| published(class, TAU * k as f64 / span)[signal];
                    let want: f64 = band.clone().map(|k| density(k) * TAU / span).sum();
                    let off_db = 10.0 * (got / want).log10();
                    worst[signal] = worst[signal].max(off_db.abs());
                }
                from_m = to_m;
            }
            eprintln!("{class:?}: up, left, roll, gauge off by at most {worst:.2?} dB");
            assert!(worst.iter().all(|off| *off < 1.0));
        }
    }

    /// Another seed or signal must not give the same track; the same seed must.
    #[test]
    fn seeds_and_signals_are_independent() {
        let settings = IrregularitySettings::default();
        let make = |seed, index| Irregularity::new(&settings, 3000.0, seed, index);
        let (a, b, c, d) = (make(1, 0), make(1, 0), make(2, 0), make(1, 1));
        assert_eq!(a.table, b.table);
        for other in [&c, &d] {
            let r = correlation(a.table.iter().zip(&other.table).map(|(x, y)| (x[0], y[0])));
            assert!(r.abs() < 0.3, "{r}");
        }
        for (i, j) in [(0, 1), (0, 2), (1, 2), (0, 3), (1, 3), (2, 3)] {
            let r = correlation(a.table.iter().map(|x| (x[i], x[j])));
            assert!(r.abs() < 0.3, "{i} {j}: {r}");
        }
    }

    fn correlation(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
        let (xy, xx, yy) = pairs.fold((0.0, 0.0, 0.0), |(xy, xx, yy), (x, y)| {
            (xy + x * y, xx + x * x, yy + y * y)
        });
        xy / f64::sqrt(xx * yy)
    }

    /// A transform of one harmonic is that harmonic.
    #[test]
    fn transform_of_one_harmonic() {
        let n = 64;
        let mut x = vec![[0.0; 2]; n];
        x[5] = [0.3, -0.4];
        fourier(&mut x);
        for (j, v) in x.iter().enumerate() {
            let (sin, cos) = (TAU * 5.0 * j as f64 / n as f64).sin_cos();
            assert!((v[0] - (0.3 * cos + 0.4 * sin)).abs() < 1e-13);
            assert!((v[1] - (0.3 * sin - 0.4 * cos)).abs() < 1e-13);
        }
    }

    /// The derivative belongs to the value, and both are continuous where cells meet.
    #[test]
    fn derivative_and_continuity() {
        let track = Irregularity::new(&IrregularitySettings::default(), 1000.0, 3, 0);
        for k in -200..200 {
            let s = 0.0173 * f64::from(k);
            let h = 1e-5;
            let slope = (track.at(s + h).up_m - track.at(s - h).up_m) / (2.0 * h);
            assert!((slope - track.at(s).up_per_m).abs() < 1e-7);
            let at = GRID_M * f64::from(k);
            let (a, b) = (track.at(at - 1e-9), track.at(at + 1e-9));
            assert!((a.up_m - b.up_m).abs() < 1e-10);
            assert!((a.up_per_m - b.up_per_m).abs() < 1e-7);
        }
    }
}
