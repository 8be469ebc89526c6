//! From the samples of a frame to power by range, radial speed and azimuth.
//!
//! Fourier transforms over the samples of a chirp give the range, over the loops of a frame the radial speed, and sums over
//! the pairs of transmitters and receivers the azimuth: a pair stands for an element at the sum of both places, and beams
//! are steered to evenly spaced sines of the azimuth, as many as there are elements. With elements half a wave apart in a
//! line these beams are orthogonal, so that cells of white noise have nothing to do with each other.
//!
//! Transmitters send one after the other: in the cell of a speed, what comes of the k-th is turned back by what the echo has
//! turned in k chirps. An echo faster than [`RadarWaveform::most_speed_mps`](crate::bus::RadarWaveform::most_speed_mps) is in
//! the cell of another speed, and is turned back by too little: its azimuth is wrong too.
//!
//! Windows and sums leave the power of noise as it is: a cell has the mean power of a sample of noise, counts^2, and an
//! exponential distribution.
//!
//! Source: M. A. Richards, Fundamentals of Radar Signal Processing, 2nd ed. 2014, chapters 4 and 9; Texas Instruments
//! SWRA554A, MIMO Radar, 2018, for the phase of transmitters that take turns.

use super::settings::RadarSettings;
use super::window::Weights;
use crate::bus::{RadarFrame, RadarSheet};
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::TAU;
use std::sync::Arc;

/// The transforms of a radar's frames, with all that they need: a frame allocates nothing.
pub struct RangeDoppler {
    layout: Layout,
    range_window: Vec<f32>,
    speed_window: Vec<f32>,
    range_fft: Arc<dyn Fft<f32>>,
    speed_fft: Arc<dyn Fft<f32>>,
    /// By transmitter and speed: what turns its echoes back.
    turned_back: Vec<Complex<f32>>,
    /// By beam and channel.
    steering: Vec<Complex<f32>>,
    chirp: Vec<Complex<f32>>,
    scratch: Vec<Complex<f32>>,
    /// By channel, range, speed.
    spectrum: Vec<Complex<f32>>,
    /// Of one range and beam, by speed.
    beam: Vec<Complex<f32>>,
    powers: Vec<f32>,
}

/// How many there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Samples of a chirp, which are cells of range.
    pub ranges: usize,
    /// Loops of a frame, which are cells of speed.
    pub speeds: usize,
    /// Pairs of transmitters and receivers, which are beams.
    pub beams: usize,
    transmitters: usize,
}

/// Powers of a frame, counts^2: by range, then beam, then speed.
#[derive(Clone, Copy, Debug)]
pub struct Cells<'a> {
    /// All of them.
    pub powers: &'a [f32],
    /// How they lie.
    pub layout: Layout,
}

impl Layout {
    fn of(sheet: &RadarSheet) -> Self {
        Self {
            ranges: sheet.waveform.samples as usize,
            speeds: sheet.waveform.loops as usize,
            beams: sheet.channels(),
            transmitters: sheet.transmitters_m.len(),
        }
    }

    /// Cells of one range.
    pub fn columns(&self) -> usize {
        self.beams * self.speeds
    }

    /// Number of a speed cell counted from standing: below 0 nearer.
    pub fn signed_speed(&self, speed: usize) -> f64 {
        match 2 * speed < self.speeds {
            true => speed as f64,
            false => speed as f64 - self.speeds as f64,
        }
    }

    /// Sine of the azimuth that a beam looks to.
    pub fn sine(&self, beam: usize) -> f64 {
        2.0 * (beam as f64 - (self.beams / 2) as f64) / self.beams as f64
    }
}

impl Cells<'_> {
    /// Power of one.
    pub fn power(&self, range: usize, beam: usize, speed: usize) -> f32 {
        self.powers[range * self.layout.columns() + beam * self.layout.speeds + speed]
    }

    /// Range, beam and speed of the strongest.
    pub fn strongest(&self) -> [usize; 3] {
        let numbered = self.powers.iter().enumerate();
        let most = numbered.max_by(|a, b| a.1.total_cmp(b.1));
        let (columns, speeds) = (self.layout.columns(), self.layout.speeds);
        most.map_or([0; 3], |(k, _)| {
            let column = k % columns;
            [k / columns, column / speeds, column % speeds]
        })
    }
}

impl RangeDoppler {
    /// For the frames of a radar.
    pub fn new(sheet: &RadarSheet, settings: &RadarSettings) -> Self {
        let layout = Layout::of(sheet);
        let window = |kind, count| {
            let weights = Weights::new(kind, count, settings.chebyshev_db);
            weights.values.iter().map(|w| *w as f32).collect()
        };
        let mut planner = FftPlanner::new();
        let range_fft = planner.plan_fft_forward(layout.ranges);
        let speed_fft = planner.plan_fft_forward(layout.speeds);
        let scratch = range_fft
            .get_inplace_scratch_len()
            .max(speed_fft.get_inplace_scratch_len());
        let zero = Complex::default();
        Self {
            range_window: window(settings.range_window, layout.ranges),
            speed_window: window(settings.speed_window, layout.speeds),
            turned_back: turned_back(&layout),
            steering: steering(sheet, &layout),
            range_fft,
            speed_fft,
            chirp: vec![zero; layout.ranges],
            scratch: vec![zero; scratch],
            spectrum: vec![zero; layout.beams * layout.ranges * layout.speeds],
            beam: vec![zero; layout.speeds],
            powers: vec![0.0; layout.ranges * layout.columns()],
            layout,
        }
    }

    /// Of a frame; none if it has not the samples that the sheet says.
    pub fn transform(&mut self, frame: &RadarFrame) -> Option<Cells<'_>> {
        let Layout {
            ranges,
            speeds,
            beams,
            ..
        } = self.layout;
        if ranges == 0 || frame.counts.len() != ranges * speeds * beams {
            return None;
        }
        self.transform_chirps(frame);
        self.transform_loops();
        self.form_beams();
        Some(Cells {
            powers: &self.powers,
            layout: self.layout,
        })
    }

    /// Chirps lie in the frame by loop, then channel.
    fn transform_chirps(&mut self, frame: &RadarFrame) {
        let Layout {
            ranges,
            speeds,
            beams,
            ..
        } = self.layout;
        for (k, counts) in frame.counts.chunks_exact(ranges).enumerate() {
            let (turn, channel) = (k / beams, k % beams);
            for ((cell, count), weight) in self.chirp.iter_mut().zip(counts).zip(&self.range_window)
            {
                *cell = Complex::new(f32::from(count[0]), f32::from(count[1])) * weight;
            }
            self.range_fft
                .process_with_scratch(&mut self.chirp, &mut self.scratch);
            let of_channel = &mut self.spectrum[channel * ranges * speeds..][..ranges * speeds];
            let weight = self.speed_window[turn];
            for (row, cell) in of_channel.chunks_exact_mut(speeds).zip(&self.chirp) {
                row[turn] = cell * weight;
            }
        }
    }

    fn transform_loops(&mut self) {
        let Layout { ranges, speeds, .. } = self.layout;
        self.speed_fft
            .process_with_scratch(&mut self.spectrum, &mut self.scratch);
        let receivers = self.layout.beams / self.layout.transmitters.max(1);
        let channels = self.spectrum.chunks_exact_mut(ranges * speeds).enumerate();
        for (channel, of_channel) in channels {
            let turned = &self.turned_back[channel / receivers * speeds..][..speeds];
            for row in of_channel.chunks_exact_mut(speeds) {
                row.iter_mut()
                    .zip(turned)
                    .for_each(|(cell, by)| *cell *= by);
            }
        }
    }

    fn form_beams(&mut self) {
        let Layout {
            ranges,
            speeds,
            beams,
            ..
        } = self.layout;
        let of_all = self.powers.chunks_exact_mut(speeds).enumerate();
        for (k, powers) in of_all {
            let (range, beam) = (k / beams, k % beams);
            self.beam.fill(Complex::default());
            for (channel, steer) in self.steering[beam * beams..][..beams].iter().enumerate() {
                let row = &self.spectrum[(channel * ranges + range) * speeds..][..speeds];
                self.beam
                    .iter_mut()
                    .zip(row)
                    .for_each(|(sum, cell)| *sum += cell * steer);
            }
            powers
                .iter_mut()
                .zip(&self.beam)
                .for_each(|(power, cell)| *power = cell.norm_sqr());
        }
    }
}

/// An echo in a speed cell turns by the cell's number over the number of loops from loop to loop, and by a share of that from
/// chirp to chirp.
fn turned_back(layout: &Layout) -> Vec<Complex<f32>> {
    let by = |transmitter: usize, speed: usize| {
        let a_loop = layout.signed_speed(speed) / layout.speeds as f64;
        let turns = a_loop * transmitter as f64 / layout.transmitters as f64;
        Complex::from_polar(1.0, (-TAU * turns) as f32)
    };
    let all = (0..layout.transmitters).flat_map(|t| (0..layout.speeds).map(move |s| by(t, s)));
    all.collect()
}

/// The way of an echo from the left is shorter to an element on the left. Beams leave the power of noise as it is.
fn steering(sheet: &RadarSheet, layout: &Layout) -> Vec<Complex<f32>> {
    let elements = sheet.transmitters_m.iter().flat_map(|transmitter| {
        let receivers = sheet.receivers_m.iter();
        receivers.map(move |receiver| transmitter[0] + receiver[0])
    });
    let elements: Vec<f64> = elements.collect();
    let share = 1.0 / (layout.beams as f64).sqrt();
    let steer = |beam: usize, left_m: f64| {
        let turns = left_m * layout.sine(beam) / sheet.waveform.wave_m();
        Complex::from_polar(share as f32, (TAU * turns) as f32)
    };
    let all = (0..layout.beams).flat_map(|b| elements.iter().map(move |m| steer(b, *m)));
    all.collect()
}

#[cfg(test)]
#[allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test may panic, and says what it measured"
)]
mod tests {
    use super::super::testing::{Draw, Scatterer, frame, noise_power, sheet, unweighted};
    use super::*;

    /// Of 10 m^2 at 50 m, and at other ranges so large that it echoes alike: some 32 dB over noise, which few frames tell.
    fn cross_section_m2(range_m: f64) -> f64 {
        10.0 * (range_m / 50.0).powi(4)
    }

    /// Signal over noise in the cell of a target, dB, mean over some frames.
    fn snr_db(range_m: f64, settings: &RadarSettings, draw: &mut Draw) -> f64 {
        let sheet = sheet();
        let mut transform = RangeDoppler::new(&sheet, settings);
        // In the middles of cells of range, speed and beam: the way is that at the middle of the frame.
        let bin_m = sheet.waveform.range_bin_m();
        let range_m = (range_m / bin_m).round() * bin_m;
        let speed_mps = 8.0 * sheet.waveform.speed_bin_mps(2);
        let target = Scatterer::polar(range_m, 0.0, speed_mps, cross_section_m2(range_m));
        let frames = 8;
        let powers = (0..frames).map(|_| {
            let frame = frame(&sheet, &[target], 1.0, draw);
            let cells = transform.transform(&frame).unwrap();
            let range = (range_m / bin_m).round() as usize;
            f64::from(cells.power(range, cells.layout.beams / 2, 8))
        });
        let mean = powers.sum::<f64>() / f64::from(frames);
        10.0 * (mean / noise_power(&sheet) - 1.0).log10()
    }

    /// Radar equation: 12 dBm sent, 9 dBi twice, wave of 3.9146 mm, spread of
    /// (4 pi)^3 r^4, against k T B F of 25 MHz and 13 dB, with 256 x 128 x 8 samples summed.
    fn by_equation_db(range_m: f64) -> f64 {
        let received_dbm =
            12.0 + 18.0 + 10.0 * (3.9146e-3f64.powi(2) * cross_section_m2(range_m)).log10()
                - 30.0 * (2.0 * TAU).log10()
                - 40.0 * range_m.log10();
        let noise_dbm = -173.975 + 10.0 * 25e6f64.log10() + 13.0;
        received_dbm - noise_dbm + 10.0 * (256.0f64 * 128.0 * 8.0).log10()
    }

    /// Within half a decibel from 10 to 200 m without windows; with them by their losses less.
    #[test]
    fn val_signal_over_noise_is_that_of_the_radar_equation() {
        let mut draw = Draw::new(4);
        let windows = RadarSettings::default();
        let loss_db: f64 = [(windows.range_window, 256), (windows.speed_window, 128)]
            .map(|(window, count)| Weights::new(window, count, windows.chebyshev_db).loss_db)
            .iter()
            .sum();
        for range_m in [10.0, 50.0, 100.0, 200.0] {
            let bin_m = sheet().waveform.range_bin_m();
            let expected_db = by_equation_db((range_m / bin_m).round() * bin_m);
            let bare_db = snr_db(range_m, &unweighted(), &mut draw);
            let weighted_db = snr_db(range_m, &windows, &mut draw);
            println!("{range_m} m: {expected_db:.2} dB, {bare_db:.2}; windows {weighted_db:.2}");
            assert!(
                (bare_db - expected_db).abs() < 0.5,
                "{range_m} m: {bare_db}"
            );
            assert!(
                (weighted_db + loss_db - expected_db).abs() < 0.5,
                "{range_m} m"
            );
        }
    }

    /// Range, radial speed and azimuth each in their cell, with the signs of the bus: away positive, left positive.
    #[test]
    fn an_echo_is_where_it_is() {
        let sheet = sheet();
        let mut transform = RangeDoppler::new(&sheet, &RadarSettings::default());
        let mut draw = Draw::new(5);
        let [range_bin_m, speed_bin_mps] = [
            sheet.waveform.range_bin_m(),
            sheet.waveform.speed_bin_mps(2),
        ];
        for (range, speed, beam) in [
            (40, -20.0, 4),
            (100, 33.0, 6),
            (12, 0.0, 2),
            (180, -50.0, 3),
        ] {
            let azimuth_rad = transform.layout.sine(beam).asin();
            let [range_m, speed_mps] = [f64::from(range) * range_bin_m, speed * speed_bin_mps];
            let target = Scatterer::polar(range_m, azimuth_rad, speed_mps, 100.0);
            let frame = frame(&sheet, &[target], 1.0, &mut draw);
            let cells = transform.transform(&frame).unwrap();
            let found = cells.strongest();
            let found_speed = cells.layout.signed_speed(found[2]);
            assert!(
                found[0].abs_diff(range as usize) <= 1 && found[1] == beam,
                "{found:?}"
            );
            assert!((found_speed - speed).abs() < 0.5, "{found:?}");
        }
    }

    /// Two like echoes side by side are two maxima 1.5 cells apart and one at half a cell, whatever their phases.
    #[test]
    fn val_echoes_a_cell_and_a_half_apart_are_two() {
        let sheet = sheet();
        let mut transform = RangeDoppler::new(&sheet, &unweighted());
        let mut draw = Draw::new(6);
        let bin_m = sheet.waveform.range_bin_m();
        for (apart, expected) in [(2.0, 2), (0.5, 1)] {
            for phase in 0..4 {
                let at = |m: f64, phase_rad: f64| Scatterer {
                    phase_rad,
                    ..Scatterer::polar(m, 0.0, 0.0, 100.0)
                };
                // Of both ways the phases are as asked for.
                let ways = TAU * 2.0 * apart * bin_m / sheet.waveform.wave_m();
                let first = at(60.0 * bin_m, 0.0);
                let second = at((60.0 + apart) * bin_m, f64::from(phase) * 1.5 - ways);
                let frame = frame(&sheet, &[first, second], 1.0, &mut draw);
                let cells = transform.transform(&frame).unwrap();
                let power = |range| cells.power(range, cells.layout.beams / 2, 0);
                let most = (50..75).map(power).fold(0.0, f32::max);
                let is_peak = |range: &usize| {
                    power(*range) > 0.2 * most
                        && power(*range) > power(range - 1)
                        && power(*range) >= power(range + 1)
                };
                let peaks = (50..75).filter(is_peak).count();
                assert!(peaks == expected, "{apart} cells, phase {phase}: {peaks}");
            }
        }
    }

    /// Provokes: a frame of another radar.
    #[test]
    fn a_frame_of_the_wrong_size_is_refused() {
        let sheet = sheet();
        let mut transform = RangeDoppler::new(&sheet, &RadarSettings::default());
        let mut whole = frame(&sheet, &[], 1.0, &mut Draw::new(7));
        let cells = transform.transform(&whole).unwrap();
        let mean = cells.powers.iter().sum::<f32>() / cells.powers.len() as f32;
        let noise = noise_power(&sheet) as f32;
        // A rounded count has a twelfth of a count's square more, each quadrature.
        assert!(
            (mean / (noise + 1.0 / 6.0) - 1.0).abs() < 0.01,
            "{mean} {noise}"
        );
        whole.counts.pop();
        assert!(transform.transform(&whole).is_none());
    }
}
