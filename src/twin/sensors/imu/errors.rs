//! Errors of three like inertial sensors: what they do to the truth.
//!
//! A triad puts out `clip(G x + b + n)`, rounded to its steps: G = 1 + scale errors on the
//! diagonal and small angles off it (each sensor leans towards the two others), b the turn-on bias
//! and the drift, n white noise of density N (angle or velocity random walk).
//!
//! **Drift.** The data sheet's in-run bias stability is the floor of the Allan deviation, which is
//! what flicker noise makes. IEEE Std 952, annex C, writes its two-sided spectrum as (B²/2π)/f and
//! its Allan deviation as B √(2 ln 2/π) = 0.664 B, at every averaging time. One first-order
//! Gauss-Markov process has no such floor, only a hump. But of processes with one variance v and
//! time constants T that grow by the ratio r, each of two-sided spectrum 2vT/(1 + (2πfT)²), the sum
//! is, as an integral over ln T, (v/ln r) ∫ 2/(1 + (2πfT)²) dT = (v/ln r)/(2f), flicker with
//!
//! > v = B² ln r / π.
//!
//! With r = √10 the spectrum ripples by 2 sech(π²/ln r) = 0.08 %. The processes reach from 30 ms to
//! 30,000 s, so the floor is flat from a second to an hour and more. All start in their
//! stationary state.

use crate::twin::random::Stream;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::{LN_2, PI};

/// The shortest time constant, seconds; white noise hides what is faster.
const SHORTEST_S: f64 = 0.03;
/// From one time constant to the next, √10.
const RATIO: f64 = 3.162_277_660_168_379_5;
const PROCESSES: i32 = 13;
/// A process is held for this share of its time constant: the steps are far below the noise of the
/// faster ones, and the slow ones cost nothing.
const HOLD: f64 = 1.0 / 16.0;

/// Flicker noise of three axes.
#[derive(Clone, Debug)]
pub(super) struct Flicker {
    stream: Stream,
    /// Of each process.
    sigma: f64,
    processes: Vec<Process>,
}

/// First-order Gauss-Markov.
#[derive(Clone, Debug)]
struct Process {
    time_s: f64,
    value: Vector3<f64>,
    /// Since the value was drawn.
    age_s: f64,
}

impl Flicker {
    /// With the Allan deviation `floor`, for samples every `period_s`: what is faster would
    /// average out within a sample, and is left out.
    fn new(stream: Stream, floor: f64, period_s: f64) -> Self {
        let coefficient = floor / (2.0 * LN_2 / PI).sqrt();
        let sigma = coefficient * (RATIO.ln() / PI).sqrt();
        let times = (0..PROCESSES).map(|k| SHORTEST_S * RATIO.powi(k));
        let processes = times.filter(|&time_s| time_s >= period_s).enumerate();
        Self {
            stream,
            sigma,
            processes: processes
                .map(|(k, time_s)| Process {
                    time_s,
                    value: normals(stream, k as u64) * sigma,
                    age_s: 0.0,
                })
                .collect(),
        }
    }

    /// The drift at sample `number` (from 1), `span_s` after the last one.
    fn drift(&mut self, number: u64, span_s: f64) -> Vector3<f64> {
        let first = number * PROCESSES as u64;
        let mut sum = Vector3::zeros();
        for (p, block) in self.processes.iter_mut().zip(first..) {
            p.age_s += span_s;
            if p.age_s >= HOLD * p.time_s {
                let keep = (-p.age_s / p.time_s).exp();
                let fresh = self.sigma * (1.0 - keep * keep).sqrt();
                p.value = p.value * keep + normals(self.stream, block) * fresh;
                p.age_s = 0.0;
            }
            sum += p.value;
        }
        sum
    }
}

/// How large the errors of a triad are, SI; sigmas.
#[derive(Clone, Copy, Debug)]
pub(super) struct Errors {
    /// Bias at turn-on.
    pub(super) turn_on: f64,
    /// Floor of the Allan deviation.
    pub(super) floor: f64,
    /// White noise, unit a square root of a hertz.
    pub(super) density: f64,
    /// Scale error, share.
    pub(super) scale: f64,
    /// Lean of an axis towards another.
    pub(super) skew_rad: f64,
    /// Largest output.
    pub(super) range: f64,
    /// Step of the output; 0 for none.
    pub(super) step: f64,
}

/// Three sensors of one kind, nominally at right angles.
#[derive(Clone, Debug)]
pub(super) struct Triad {
    noise: Stream,
    pub(super) gain: Matrix3<f64>,
    pub(super) bias: Vector3<f64>,
    flicker: Flicker,
    errors: Errors,
}

impl Triad {
    /// The triad `name` of a run.
    pub(super) fn new(
        (seed, index, name): (u64, u64, &str),
        errors: Errors,
        period_s: f64,
    ) -> Self {
        let unit = Stream::new(seed, index, &format!("{name} unit"));
        let flicker = Stream::new(seed, index, &format!("{name} drift"));
        let leans = Matrix3::from_fn(|row, column| {
            let sigma = if row == column {
                errors.scale
            } else {
                errors.skew_rad
            };
            sigma * unit.normal((3 + 3 * row + column) as u64)
        });
        Self {
            noise: Stream::new(seed, index, name),
            gain: Matrix3::identity() + leans,
            bias: normals(unit, 0) * errors.turn_on,
            flicker: Flicker::new(flicker, errors.floor, period_s),
            errors,
        }
    }

    /// Sample `number` (from 1) of a `truth` averaged over `span_s`.
    pub(super) fn measure(
        &mut self,
        truth: &Vector3<f64>,
        number: u64,
        span_s: f64,
    ) -> Vector3<f64> {
        let Errors {
            density,
            range,
            step,
            ..
        } = self.errors;
        let noise = normals(self.noise, number) * (density / span_s.sqrt());
        let drift = self.flicker.drift(number, span_s);
        (self.gain * truth + self.bias + drift + noise).map(|x| {
            let x = x.clamp(-range, range);
            if step > 0.0 {
                (x / step).round() * step
            } else {
                x
            }
        })
    }
}

/// Three numbers of a stream.
pub(super) fn normals(stream: Stream, block: u64) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| stream.normal(3 * block + axis as u64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::sensors::imu::allan::gauss_markov_variance;

    fn without_errors() -> Errors {
        Errors {
            turn_on: 0.0,
            floor: 0.0,
            density: 0.0,
            scale: 0.0,
            skew_rad: 0.0,
            range: 10.0,
            step: 0.0,
        }
    }

    /// Wrong weights, a wrong ratio or too short a row of processes tilt, ripple or shift the
    /// floor. Exact: the Allan variances of independent processes add.
    #[test]
    fn the_processes_add_up_to_a_flat_floor() {
        let flicker = Flicker::new(Stream::new(1, 0, "test"), 1.0, 0.005);
        for k in 0..=40 {
            let tau_s = 10f64.powf(0.1 * f64::from(k));
            let each = flicker.processes.iter();
            let sum: f64 = each
                .map(|p| gauss_markov_variance(flicker.sigma.powi(2), p.time_s, tau_s))
                .sum();
            // At 1 s and at 10,000 s what is beyond the ends is missing.
            let tolerance = if (1.5..3000.0).contains(&tau_s) {
                0.02
            } else {
                0.06
            };
            assert!(
                (sum.sqrt() - 1.0).abs() < tolerance,
                "{} at {tau_s} s",
                sum.sqrt()
            );
        }
    }

    /// Over many units the drift has the processes' variance, at power-on and after a while alike:
    /// a start at zero, or a held value aged wrongly, would show.
    #[test]
    fn the_drift_is_stationary() {
        let units = 3000;
        let (mut first, mut later) = (0.0, 0.0);
        let mut wanted = 0.0;
        for index in 0..units {
            let mut flicker = Flicker::new(Stream::new(5, index, "test"), 0.1, 0.005);
            wanted = flicker.processes.len() as f64 * flicker.sigma.powi(2);
            first += flicker.drift(1, 1e-9).norm_squared() / 3.0;
            // Spans as uneven as a clock makes them that does not divide the steps.
            for k in 2..40 {
                flicker.drift(k, 0.003 * (1.0 + (k % 7) as f64).powi(3));
            }
            later += flicker.drift(40, 0.005).norm_squared() / 3.0;
        }
        for sum in [first, later] {
            let share = sum / units as f64 / wanted;
            assert!((share - 1.0).abs() < 0.05, "{share}");
        }
    }

    /// The output is the gain matrix times the truth: rows are the sensors, columns what they
    /// feel. Transposed, or with the identity missing, it is not.
    #[test]
    fn scale_and_misalignment_are_the_matrix() {
        let errors = Errors {
            scale: 0.01,
            skew_rad: 0.002,
            turn_on: 0.3,
            ..without_errors()
        };
        let mut triad = Triad::new((9, 0, "t"), errors, 0.005);
        let zero = triad.measure(&Vector3::zeros(), 1, 0.005);
        assert!((zero - triad.bias).norm() < 1e-12 && zero.norm() > 0.05);
        for axis in 0..3 {
            let truth = Vector3::ith(axis, 2.0);
            let out = triad.measure(&truth, 2, 0.005) - zero;
            for row in 0..3 {
                assert!((out[row] - 2.0 * triad.gain[(row, axis)]).abs() < 1e-12);
                let wrong = out[row] / 2.0 - f64::from(u8::from(row == axis));
                let most = if row == axis { 0.04 } else { 0.008 };
                assert!(wrong.abs() > 1e-7 && wrong.abs() < most, "{wrong}");
            }
        }
    }

    /// Sigmas per unit, over many of them: share for percent, or one draw for all axes, miss.
    #[test]
    fn the_spread_of_units_is_as_told() {
        let errors = Errors {
            scale: 0.01,
            skew_rad: 0.002,
            turn_on: 0.3,
            ..without_errors()
        };
        let units = 2000;
        let (mut scale, mut skew, mut turn_on, mut common) = (0.0, 0.0, 0.0, 0.0);
        for index in 0..units {
            let triad = Triad::new((9, index, "t"), errors, 0.005);
            let wrong = triad.gain - Matrix3::identity();
            let diagonal = wrong.diagonal();
            scale += diagonal.norm_squared() / 3.0;
            skew += (wrong.norm_squared() - diagonal.norm_squared()) / 6.0;
            turn_on += triad.bias.norm_squared() / 3.0;
            common += diagonal.x * diagonal.y;
        }
        for (sum, sigma) in [(scale, 0.01), (skew, 0.002), (turn_on, 0.3)] {
            let found = (sum / units as f64).sqrt();
            assert!((found / sigma - 1.0).abs() < 0.03, "{found} for {sigma}");
        }
        assert!((common / units as f64).abs() < 0.1 * 0.01 * 0.01);
    }

    /// A value beyond the range saturates, on both sides; one within it is off by half a step at
    /// most and lies on a step.
    #[test]
    fn range_and_steps_hold() {
        let errors = Errors {
            step: 0.25,
            ..without_errors()
        };
        let mut triad = Triad::new((1, 0, "t"), errors, 0.005);
        let out = triad.measure(&Vector3::new(99.0, -99.0, 3.3), 1, 0.005);
        assert!((out - Vector3::new(10.0, -10.0, 3.25)).norm() < 1e-12);
    }
}
