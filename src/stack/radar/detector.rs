//! From the counts of a frame to its detections.
//!
//! Radar equation: the power at a receiver's antenna from a target of cross-section s at range R is
//! P G_t G_r wave^2 s / ((4 pi)^3 R^4). Gains are those on boresight: off it a cross-section comes out too small by what
//! the antennas lose there. Noise is k T0 times the sample rate (both quadratures) times the noise figure, and what
//! rounding to counts adds, 1/12 count^2 a quadrature.
//!
//! Errors of range, speed and azimuth are the Cramer-Rao bounds of a lone echo, times what windows cost
//! ([`super::window`]).
//!
//! Source: M. I. Skolnik, Introduction to Radar Systems (2001), chapters 1 and 2.

use super::angle::Speeds;
use super::cfar::Cfar;
use super::peak::{Cell, EchoPeak, PeakFinder};
use super::range_doppler::{RangeDoppler, weights};
use super::settings::RadarTrackingSettings;
use super::window::Weights;
use crate::bus::{RadarDetection, RadarSheet};
use crate::numerics::{BOLTZMANN_JPK, LIGHT_MPS};
use std::f64::consts::PI;

/// Temperature that noise figures are stated for, K.
const REFERENCE_K: f64 = 290.0;

/// A detection, and what a tracker wants to know of it besides.
#[derive(Clone, Copy, Debug)]
pub struct Sighting {
    /// As reported.
    pub detection: RadarDetection,
    /// How often its radial speed aliased, but for multiples of the number of transmitters.
    pub fold: usize,
    /// One sigma of range (m), azimuth (radians) and radial speed (m/s).
    pub sigmas: [f64; 3],
}

/// What a frame says besides its detections.
#[derive(Clone, Copy, Debug)]
pub struct FrameState {
    /// A count is at an end of the converter's range.
    pub is_saturated: bool,
    /// Of the noise over the sheet's, dB.
    pub noise_rise_db: f64,
}

/// Two targets are told apart when they differ by one of these.
#[derive(Clone, Copy, Debug)]
pub struct Resolution {
    /// Metres.
    pub range_m: f64,
    /// m/s.
    pub speed_mps: f64,
    /// In the sine of the azimuth.
    pub u: f64,
}

/// Works up frames of one radar.
pub struct Detector {
    sheet: RadarSheet,
    radar: RangeDoppler,
    cfar: Cfar,
    peaks: PeakFinder,
    weights: [Weights; 2],
    /// On the mean of noise, of a cell of noise that is taken for a detection.
    noise_factor: f64,
    /// Nothing is faster over ground, m/s.
    most_mps: f64,
    cells: Vec<Cell>,
    sightings: Vec<Sighting>,
}

impl Detector {
    /// For a sheet.
    pub fn new(sheet: &RadarSheet, settings: &RadarTrackingSettings) -> Self {
        let weights = weights(sheet, settings);
        let radar = RangeDoppler::new(sheet, &weights[0], &weights[1]);
        Self {
            sheet: sheet.clone(),
            cfar: Cfar::new(settings, radar.shape.loops),
            peaks: PeakFinder::new(&radar, &weights, settings),
            noise_factor: -settings.false_alarm_probability.ln(),
            most_mps: settings.most_speed_mps,
            radar,
            weights,
            cells: Vec::new(),
            sightings: Vec::new(),
        }
    }

    /// What two targets must differ by.
    pub fn resolution(&self) -> Resolution {
        let waveform = &self.sheet.waveform;
        let transmitters = self.sheet.transmitters_m.len();
        Resolution {
            range_m: self.weights[0].width_bins * waveform.range_bin_m(),
            speed_mps: self.weights[1].width_bins * waveform.speed_bin_mps(transmitters),
            u: self.radar.array.u_width(),
        }
    }

    /// Detections of a frame, the strongest first; none of a frame that has not the sheet's size. The radar moves along
    /// and across its boresight.
    pub fn detect(
        &mut self,
        counts: &[[i16; 2]],
        own_mps: [f64; 2],
    ) -> Option<(&[Sighting], FrameState)> {
        if counts.is_empty() || counts.len() != self.sheet.frame_samples() {
            return None;
        }
        self.radar.process(counts);
        let noise = self.radar.noise();
        self.cells.clear();
        for beam in 0..self.radar.array.beams {
            let powers = self.radar.beam_powers(beam);
            let (loops, cells) = (self.radar.shape.loops, &mut self.cells);
            self.cfar.detect(powers, |range, speed| {
                let power = powers[range * loops + speed];
                cells.push(Cell {
                    beam,
                    range,
                    speed,
                    power,
                });
            });
        }
        let least = self.noise_factor * noise;
        let transmitters = self.sheet.transmitters_m.len();
        let speeds = Speeds {
            own_mps,
            bin_mps: self.sheet.waveform.speed_bin_mps(transmitters),
            most_mps: self.most_mps,
        };
        let echoes = self.peaks.find(&self.radar, &mut self.cells, least, speeds);
        self.sightings.clear();
        for echo in echoes {
            let sighting = sighting(&self.sheet, &self.weights, &self.radar, echo, noise);
            self.sightings.extend(sighting);
        }
        let state = FrameState {
            is_saturated: counts.iter().flatten().any(|c| c.unsigned_abs() >= 32767),
            noise_rise_db: 10.0 * (noise / expected_noise(&self.sheet)).log10(),
        };
        Some((&self.sightings, state))
    }
}

/// None of what is behind the radar or at no range.
fn sighting(
    sheet: &RadarSheet,
    [range, speed]: &[Weights; 2],
    radar: &RangeDoppler,
    echo: &EchoPeak,
    noise: f64,
) -> Option<Sighting> {
    let waveform = &sheet.waveform;
    let range_m = echo.range_bins * waveform.range_bin_m();
    let u = echo.direction.u;
    if range_m <= 0.0 || u.abs() >= 1.0 || noise <= 0.0 {
        return None;
    }
    let transmitters = sheet.transmitters_m.len();
    // The phase of an echo turns with the frequency sent in the middle of the chirp less what it rose on the way.
    let middle_hz = LIGHT_MPS / waveform.wave_m();
    let rose_hz = waveform.slope_hzps * 2.0 * range_m / LIGHT_MPS;
    let speed_bin_mps = waveform.speed_bin_mps(transmitters) * middle_hz / (middle_hz - rose_hz);
    let snr = (echo.power / noise - 1.0).max(0.1);
    let gain = range.gain().powi(2) * speed.gain().powi(2) * radar.array.elements() as f64;
    let cos = (1.0 - u * u).sqrt();
    let per_root = 1.0 / snr.sqrt();
    Some(Sighting {
        detection: RadarDetection {
            range_m,
            radial_speed_mps: echo.speed_bins * speed_bin_mps,
            azimuth_rad: u.asin(),
            snr_db: 10.0 * snr.log10(),
            cross_section_m2: cross_section_m2(sheet, echo.power / gain, range_m),
        },
        fold: echo.direction.fold,
        sigmas: [
            per_root * range.error_bins * waveform.range_bin_m(),
            per_root * radar.array.u_error() / cos,
            per_root * speed.error_bins * speed_bin_mps,
        ],
    })
}

/// Of a target at a range whose echo has a power, counts^2.
fn cross_section_m2(sheet: &RadarSheet, power: f64, range_m: f64) -> f64 {
    let received_dbm =
        sheet.full_scale_dbm + 10.0 * (power / RadarSheet::FULL_SCALE.powi(2)).log10();
    let gains_dbi = sheet.transmit_gain_dbi + sheet.receive_gain_dbi;
    let lost = 10f64.powf(0.1 * (received_dbm - sheet.power_dbm - gains_dbi));
    lost * (4.0 * PI).powi(3) * range_m.powi(4) / sheet.waveform.wave_m().powi(2)
}

/// Power of a sample of noise by the sheet, counts^2.
fn expected_noise(sheet: &RadarSheet) -> f64 {
    let thermal_mw = 1e3 * BOLTZMANN_JPK * REFERENCE_K * sheet.waveform.sample_rate_hz;
    let dbm = 10.0 * thermal_mw.log10() + sheet.noise_figure_db - sheet.full_scale_dbm;
    RadarSheet::FULL_SCALE.powi(2) * 10f64.powf(0.1 * dbm) + 1.0 / 6.0
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
#[path = "detector_tests.rs"]
mod tests;
