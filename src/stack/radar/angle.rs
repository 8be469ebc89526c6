//! Azimuth of an echo from the values of all virtual elements in its cell, between beams.
//!
//! The azimuth is where a beam has most power, which for one echo is the most likely one. A radial speed beyond those
//! that alias turns the echo between transmitters by another f / K of a circle than its bin says (K transmitters, f the
//! times that it aliased). Two echoes beside each other may look like that too: so only such f are tried as give a speed
//! over ground that something may have, and among several the one whose beam has most power is taken.
//!
//! Source: C. M. Schmid, R. Feger, C. Pfeffer and A. Stelzer, Motion Compensation and Efficient Array Design for TDMA FMCW
//! MIMO Radar Systems, EuCAP (2012).

use super::array::{FINE, VirtualArray};
use super::interpolation::vertex;
use super::range_doppler::Shape;
use crate::numerics::wrapped;
use rustfft::num_complex::Complex32;
use std::f64::consts::TAU;

/// Where an echo comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    /// Sine of the azimuth.
    pub u: f64,
    /// How often its speed aliased, but for multiples of the number of transmitters.
    pub fold: usize,
}

/// What speeds over ground there are.
#[derive(Clone, Copy, Debug)]
pub struct Speeds {
    /// The radar's own, along and across its boresight, m/s.
    pub own_mps: [f64; 2],
    /// Of a bin, m/s.
    pub bin_mps: f64,
    /// Nothing is faster, m/s.
    pub most_mps: f64,
}

impl Speeds {
    /// How often the speed of an echo may have aliased, but for multiples of the number of transmitters: all, where
    /// nothing is slow enough.
    pub fn folds(&self, shape: &Shape, speed_bins: f64, u: f64) -> impl Iterator<Item = usize> {
        let [along, across] = self.own_mps;
        let own_mps = along * (1.0 - u * u).max(0.0).sqrt() + across * u;
        let first_mps = speed_bins * self.bin_mps + own_mps;
        let span_mps = self.bin_mps * shape.loops as f64;
        let (most_mps, count) = (self.most_mps, shape.transmitters);
        let is_slow = move |fold: &usize| {
            let speed = first_mps + *fold as f64 * span_mps;
            wrapped(speed, count as f64 * span_mps).abs() <= most_mps
        };
        let any = (0..count).any(|fold| is_slow(&fold));
        (0..count).filter(move |fold| !any || is_slow(fold))
    }
}

/// Turns by which the echoes of later transmitters are put beside those of the first, at a speed in signed bins.
pub fn turn(shape: &Shape, channel: usize, speed_bins: f64, fold: usize) -> Complex32 {
    let transmitter = channel / shape.receivers.max(1);
    let loops = speed_bins / shape.loops as f64 + fold as f64;
    let (sin, cos) = (-TAU * loops * transmitter as f64 / shape.transmitters as f64).sin_cos();
    Complex32::new(cos as f32, sin as f32)
}

/// Finds directions; its buffers are made once.
#[derive(Clone, Debug)]
pub struct DirectionFinder {
    turned: Vec<Complex32>,
    powers: Vec<f32>,
}

impl DirectionFinder {
    /// For an array.
    pub fn new(array: &VirtualArray) -> Self {
        Self {
            turned: vec![Complex32::default(); array.elements()],
            powers: vec![0.0; FINE * array.beams],
        }
    }

    /// The direction with most power, of the channels' values at a speed in signed bins, of some folds; with `about`, of
    /// those within a fifth of a beam.
    pub fn find(
        &mut self,
        (shape, array): (&Shape, &VirtualArray),
        values: &[Complex32],
        speed_bins: f64,
        folds: impl Iterator<Item = usize>,
        about: Option<f64>,
    ) -> Direction {
        let mut best = (f32::MIN, Direction { u: 0.0, fold: 0 });
        for fold in folds {
            self.look((shape, array), values, speed_bins, fold);
            for (k, power) in self.powers.iter().enumerate() {
                let u = array.fine_u(k);
                let is_near = about.is_none_or(|about| (u - about).abs() <= 0.2 * array.step);
                if is_near && *power > best.0 {
                    best = (*power, Direction { u, fold });
                }
            }
        }
        let Direction { u, fold } = best.1;
        self.turn(shape, values, speed_bins, fold);
        let power = |u: f64| f64::from(self.sum(array, u).norm_sqr());
        let near = vertex(power, u, 0.5 * array.step / FINE as f64);
        let u = vertex(power, near, 0.1 * array.step / FINE as f64);
        Direction { u, fold }
    }

    /// The direction with most power of others of the same fold, within two beams, that have more power than those on
    /// either side.
    pub fn other(
        &mut self,
        (shape, array): (&Shape, &VirtualArray),
        values: &[Complex32],
        speed_bins: f64,
        found: Direction,
    ) -> Option<Direction> {
        self.look((shape, array), values, speed_bins, found.fold);
        let powers = &self.powers;
        let is_top = |k: &usize| powers[k - 1] < powers[*k] && powers[*k] >= powers[k + 1];
        let beams = |k: &usize| (array.fine_u(*k) - found.u).abs() / array.step;
        let is_other = |k: &usize| (2.0 / FINE as f64..=2.0).contains(&beams(k));
        let inner = 1..powers.len().saturating_sub(1);
        let tops = inner.filter(|k| is_other(k) && is_top(k));
        let highest = tops.max_by(|a, b| powers[*a].total_cmp(&powers[*b]))?;
        let u = array.fine_u(highest);
        Some(Direction { u, ..found })
    }

    /// What an array weighted towards u gives of values that were turned.
    fn sum(&self, array: &VirtualArray, u: f64) -> Complex32 {
        let values = self.turned.iter().enumerate();
        values.map(|(k, value)| value * array.weight(k, u)).sum()
    }

    fn turn(&mut self, shape: &Shape, values: &[Complex32], speed_bins: f64, fold: usize) {
        for (channel, (out, value)) in self.turned.iter_mut().zip(values).enumerate() {
            *out = value * turn(shape, channel, speed_bins, fold);
        }
    }

    /// Powers of all fine beams.
    fn look(
        &mut self,
        (shape, array): (&Shape, &VirtualArray),
        values: &[Complex32],
        speed_bins: f64,
        fold: usize,
    ) {
        self.turn(shape, values, speed_bins, fold);
        for (k, power) in self.powers.iter_mut().enumerate() {
            let pairs = array.fine_weights(k).iter().zip(&self.turned);
            *power = pairs.map(|(a, b)| a * b).sum::<Complex32>().norm_sqr();
        }
    }
}
