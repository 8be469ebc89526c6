//! From samples to the power by range, radial speed and beam.
//!
//! The samples of a chirp are a tone whose frequency is the range: a Fourier transform over them, and one over the loops
//! for the radial speed, by transmitter and receiver. Transmitter k of K sends k / K of a loop later than the first; at
//! the speed of bin d of M an echo turns by 2 pi d k / (M K) in that time, which is taken back before beams are formed.
//! Weights of samples, loops and elements have the sum of squares one, so that a cell of noise keeps the power of a
//! sample of noise, and is exponentially distributed. Without windows cells are independent.
//!
//! Source: S. Rao, Introduction to mmWave Sensing: FMCW Radars (2017), for the order of transforms; J. Bechter, F. Roos
//! and C. Waldschmidt, IEEE Microw. Wireless Compon. Lett. 27 (2017), for the turn between transmitters.

use super::array::VirtualArray;
use super::settings::RadarTrackingSettings;
use super::window::Weights;
use crate::bus::RadarSheet;
use rustfft::num_complex::Complex32;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::{LN_2, TAU};
use std::sync::Arc;

/// So many cells tell the noise to half a percent.
const NOISE_CELLS: usize = 32_768;

/// Samples of a chirp, loops, transmitters and receivers.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// Samples of a chirp, which are bins of range.
    pub samples: usize,
    /// Loops, which are bins of speed.
    pub loops: usize,
    /// Transmitters.
    pub transmitters: usize,
    /// Receivers.
    pub receivers: usize,
}

impl Shape {
    /// Of a sheet.
    pub fn new(sheet: &RadarSheet) -> Self {
        Self {
            samples: sheet.waveform.samples as usize,
            loops: sheet.waveform.loops as usize,
            transmitters: sheet.transmitters_m.len(),
            receivers: sheet.receivers_m.len(),
        }
    }

    /// Pairs of transmitter and receiver.
    pub fn channels(&self) -> usize {
        self.transmitters * self.receivers
    }

    /// Cells of one channel or beam.
    pub fn cells(&self) -> usize {
        self.samples * self.loops
    }

    /// Bin of a speed as a number below 0 for what comes nearer.
    pub fn signed(&self, speed_bin: usize) -> f64 {
        let bin = speed_bin as f64;
        if 2 * speed_bin < self.loops {
            bin
        } else {
            bin - self.loops as f64
        }
    }
}

/// Transforms, planned once, and their buffers.
pub struct RangeDoppler {
    /// What it was planned for.
    pub shape: Shape,
    /// Elements and beams.
    pub array: VirtualArray,
    range_weights: Vec<f32>,
    speed_weights: Vec<f32>,
    range_fft: Arc<dyn Fft<f32>>,
    speed_fft: Arc<dyn Fft<f32>>,
    scratch: Vec<Complex32>,
    /// Of one channel, by loop, then range; then by range, then loop.
    chirps: Vec<Complex32>,
    lines: Vec<Complex32>,
    /// By channel, range, speed.
    spectrum: Vec<Complex32>,
    /// By transmitter, then speed: what it turned later.
    turns: Vec<Complex32>,
    /// A line of range of all channels, turned back; and of a beam.
    turned: Planes,
    beam: Planes,
    /// By beam, range, speed.
    powers: Vec<f32>,
    noise_cells: Vec<f32>,
}

/// Real and imaginary parts apart, which processors add faster.
#[derive(Clone, Debug)]
struct Planes {
    re: Vec<f32>,
    im: Vec<f32>,
}

impl Planes {
    fn new(count: usize) -> Self {
        Self {
            re: vec![0.0; count],
            im: vec![0.0; count],
        }
    }
}

impl RangeDoppler {
    /// For the frames of a sheet.
    pub fn new(sheet: &RadarSheet, range: &Weights, speed: &Weights) -> Self {
        let shape = Shape::new(sheet);
        let array = VirtualArray::new(sheet);
        let mut planner = FftPlanner::new();
        let range_fft = planner.plan_fft_forward(shape.samples);
        let speed_fft = planner.plan_fft_forward(shape.loops);
        let scratch =
            (range_fft.get_inplace_scratch_len()).max(speed_fft.get_inplace_scratch_len());
        let zeros = |count| vec![Complex32::default(); count];
        let narrow = |weights: &Weights| weights.values.iter().map(|w| *w as f32).collect();
        Self {
            range_weights: narrow(range),
            speed_weights: narrow(speed),
            range_fft,
            speed_fft,
            scratch: zeros(scratch),
            chirps: zeros(shape.cells()),
            lines: zeros(shape.cells()),
            spectrum: zeros(shape.channels() * shape.cells()),
            turns: turns(&shape),
            turned: Planes::new(shape.channels() * shape.loops),
            beam: Planes::new(shape.loops),
            powers: vec![0.0; array.beams * shape.cells()],
            noise_cells: Vec::with_capacity(2 * NOISE_CELLS),
            shape,
            array,
        }
    }

    /// Works a frame's counts up; they must be as many as the sheet says.
    pub fn process(&mut self, counts: &[[i16; 2]]) {
        if self.shape.cells() == 0 {
            return;
        }
        for channel in 0..self.shape.channels() {
            self.transform_ranges(counts, channel);
            self.transform_speeds(channel);
        }
        for range in 0..self.shape.samples {
            self.turn_back(range);
            for beam in 0..self.array.beams {
                self.form(beam, range);
            }
        }
    }

    /// Over the samples of each chirp of a channel.
    fn transform_ranges(&mut self, counts: &[[i16; 2]], channel: usize) {
        let samples = self.shape.samples;
        let chirps = counts.chunks_exact(samples).skip(channel);
        let chirps = chirps.step_by(self.shape.channels());
        for (out, chirp) in self.chirps.chunks_exact_mut(samples).zip(chirps) {
            for ((out, count), weight) in out.iter_mut().zip(chirp).zip(&self.range_weights) {
                let [re, im] = count.map(f32::from);
                *out = Complex32::new(weight * re, weight * im);
            }
        }
        self.range_fft
            .process_with_scratch(&mut self.chirps, &mut self.scratch);
    }

    /// Over the loops of each range of a channel.
    fn transform_speeds(&mut self, channel: usize) {
        let Shape { samples, loops, .. } = self.shape;
        const TILE: usize = 16;
        for first in (0..samples).step_by(TILE) {
            let last = (first + TILE).min(samples);
            for (chirp, weight) in self.speed_weights.iter().enumerate() {
                let row = &self.chirps[chirp * samples + first..chirp * samples + last];
                for (range, value) in row.iter().enumerate() {
                    self.lines[(first + range) * loops + chirp] = value * weight;
                }
            }
        }
        self.speed_fft
            .process_with_scratch(&mut self.lines, &mut self.scratch);
        let from = channel * samples * loops;
        self.spectrum[from..from + samples * loops].copy_from_slice(&self.lines);
    }

    /// Takes back by what later transmitters' echoes turned.
    fn turn_back(&mut self, range: usize) {
        let loops = self.shape.loops;
        for channel in 0..self.shape.channels() {
            let from = channel * self.shape.cells() + range * loops;
            let values = &self.spectrum[from..from + loops];
            let transmitter = channel / self.shape.receivers;
            let turns = &self.turns[transmitter * loops..(transmitter + 1) * loops];
            let to = channel * loops..(channel + 1) * loops;
            let out = self.turned.re[to.clone()].iter_mut();
            let out = out.zip(&mut self.turned.im[to]);
            for ((value, turn), (re, im)) in values.iter().zip(turns).zip(out) {
                *re = value.re * turn.re - value.im * turn.im;
                *im = value.re * turn.im + value.im * turn.re;
            }
        }
    }

    fn form(&mut self, beam: usize, range: usize) {
        let loops = self.shape.loops;
        self.beam.re.fill(0.0);
        self.beam.im.fill(0.0);
        for (channel, weight) in self.array.weights(beam).iter().enumerate() {
            let from = channel * loops..(channel + 1) * loops;
            let values = self.turned.re[from.clone()]
                .iter()
                .zip(&self.turned.im[from]);
            let sums = self.beam.re.iter_mut().zip(&mut self.beam.im);
            for ((re, im), (sum_re, sum_im)) in values.zip(sums) {
                *sum_re += re * weight.re - im * weight.im;
                *sum_im += re * weight.im + im * weight.re;
            }
        }
        let from = (beam * self.shape.samples + range) * loops;
        let values = self.beam.re.iter().zip(&self.beam.im);
        for (power, (re, im)) in self.powers[from..from + loops].iter_mut().zip(values) {
            *power = re * re + im * im;
        }
    }

    /// Powers of a beam, by range, then speed, counts^2.
    pub fn beam_powers(&self, beam: usize) -> &[f32] {
        let cells = self.shape.cells();
        &self.powers[beam * cells..(beam + 1) * cells]
    }

    /// A channel's value in a cell, not turned back.
    pub fn value(&self, channel: usize, range: usize, speed: usize) -> Complex32 {
        self.spectrum[channel * self.shape.cells() + range * self.shape.loops + speed]
    }

    /// Power of a cell of noise, counts^2: half of exponentially distributed cells are above ln 2 of their mean, and
    /// echoes in a small part of them change that little.
    pub fn noise(&mut self) -> f64 {
        // Odd, so that all speeds come in.
        let every = (self.powers.len() / NOISE_CELLS) | 1;
        self.noise_cells.clear();
        let some = self.powers.iter().step_by(every).copied();
        self.noise_cells.extend(some.take(2 * NOISE_CELLS));
        let middle = self.noise_cells.len() / 2;
        if self.noise_cells.is_empty() {
            return 0.0;
        }
        let (_, median, _) = (self.noise_cells).select_nth_unstable_by(middle, f32::total_cmp);
        f64::from(*median) / LN_2
    }
}

fn turns(shape: &Shape) -> Vec<Complex32> {
    let mut turns = Vec::with_capacity(shape.transmitters * shape.loops);
    for transmitter in 0..shape.transmitters {
        let share = transmitter as f64 / (shape.transmitters * shape.loops) as f64;
        turns.extend((0..shape.loops).map(|bin| {
            let (sin, cos) = (-TAU * share * shape.signed(bin)).sin_cos();
            Complex32::new(cos as f32, sin as f32)
        }));
    }
    turns
}

/// Weights over samples and over loops.
pub fn weights(sheet: &RadarSheet, settings: &RadarTrackingSettings) -> [Weights; 2] {
    let shape = Shape::new(sheet);
    let weights = |window, count| Weights::new(window, count, settings.chebyshev_db);
    [
        weights(settings.range_window, shape.samples),
        weights(settings.speed_window, shape.loops),
    ]
}
