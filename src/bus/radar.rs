//! What an FMCW radar gives: the sampled beat signal of a frame, and the sheet that says how to read it.
//!
//! **Frames of reference.** The radar frame has x along boresight, y left, z up. Azimuth counts from x towards y.
//!
//! **Signal.** Transmitters send one after the other: chirp k of a loop is that of transmitter k, so that chirp m K + k
//! (loop m, of K transmitters) begins (m K + k) [`RadarWaveform::chirp_interval_s`] after the frame's start. The echo of a
//! scatterer comes after tau = (|p - transmitter| + |p - receiver|) / c, and the mixer gives
//! A exp(i 2 pi (f0 tau + S tau t - S tau^2 / 2)) at the time t within the chirp, with the frequency f0 at the chirp's begin
//! and its slope S. So the beat's frequency is positive, and the phase falls from loop to loop where the scatterer comes
//! nearer. The samples of both quadratures are counts of the converter; a tone of amplitude [`RadarSheet::FULL_SCALE`]
//! has the power [`RadarSheet::full_scale_dbm`] at a receiver's antenna.

use super::{SimTime, TrainEnd};
use crate::numerics::LIGHT_MPS;
use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

/// How a radar sweeps its frequency, and samples what comes back.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RadarWaveform {
    /// Frequency at the first sample of a chirp, Hz.
    pub start_hz: f64,
    /// By how much it rises, Hz a second.
    pub slope_hzps: f64,
    /// Samples a second, of both quadratures.
    pub sample_rate_hz: f64,
    /// Samples of a chirp.
    pub samples: u32,
    /// How often each transmitter sends in a frame.
    pub loops: u32,
    /// From the begin of a chirp to that of the next one, seconds.
    pub chirp_interval_s: f64,
}

impl RadarWaveform {
    /// Wave length in the middle of the sweep, metres.
    pub fn wave_m(&self) -> f64 {
        LIGHT_MPS / (self.start_hz + 0.5 * self.band_hz())
    }

    /// Frequencies that the samples of a chirp sweep over, Hz.
    pub fn band_hz(&self) -> f64 {
        self.slope_hzps * f64::from(self.samples) / self.sample_rate_hz
    }

    /// Range of one bin of the spectrum of a chirp, which is the resolution without a window, metres.
    pub fn range_bin_m(&self) -> f64 {
        0.5 * LIGHT_MPS / self.band_hz()
    }

    /// Range beyond which echoes alias, metres.
    pub fn most_range_m(&self) -> f64 {
        self.range_bin_m() * f64::from(self.samples)
    }

    /// From a transmitter's chirp to its next one, with so many transmitters, seconds.
    pub fn loop_s(&self, transmitters: usize) -> f64 {
        self.chirp_interval_s * transmitters as f64
    }

    /// Radial speed of one bin of the spectrum over loops, which is the resolution without a window, m/s.
    pub fn speed_bin_mps(&self, transmitters: usize) -> f64 {
        0.5 * self.wave_m() / (self.loop_s(transmitters) * f64::from(self.loops))
    }

    /// Radial speeds beyond this, either way, alias, m/s.
    pub fn most_speed_mps(&self, transmitters: usize) -> f64 {
        0.5 * self.speed_bin_mps(transmitters) * f64::from(self.loops)
    }
}

/// What a maker's sheet and the fitter say of a radar. The real one differs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RadarSheet {
    /// The end of the train that it looks away from.
    pub end: TrainEnd,
    /// Its sweep.
    pub waveform: RadarWaveform,
    /// Places of the transmitters, left and up in the radar frame, metres.
    pub transmitters_m: Vec<[f64; 2]>,
    /// Of the receivers.
    pub receivers_m: Vec<[f64; 2]>,
    /// Power sent by one transmitter at a time, dBm.
    pub power_dbm: f64,
    /// Of a transmitter's antenna on boresight, dBi.
    pub transmit_gain_dbi: f64,
    /// Of a receiver's.
    pub receive_gain_dbi: f64,
    /// Of a receiver, dB.
    pub noise_figure_db: f64,
    /// Power at a receiver's antenna that drives its converter to full scale, dBm.
    pub full_scale_dbm: f64,
    /// The radar in the vehicle frame of its end of the train.
    pub vehicle_from_radar: Isometry3<f64>,
}

impl RadarSheet {
    /// Counts of a converter at full scale.
    pub const FULL_SCALE: f64 = 32767.0;

    /// How many pairs of a transmitter and a receiver there are.
    pub fn channels(&self) -> usize {
        self.transmitters_m.len() * self.receivers_m.len()
    }

    /// Samples of a frame.
    pub fn frame_samples(&self) -> usize {
        self.channels() * self.waveform.loops as usize * self.waveform.samples as usize
    }
}

/// The sampled signal of a frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RadarFrame {
    /// The radar.
    pub end: TrainEnd,
    /// Counts up from 0, gaps are lost frames.
    pub number: u32,
    /// When its first chirp began, by the radar's clock.
    pub start: SimTime,
    /// Both quadratures of all samples: by loop, transmitter, receiver, sample.
    pub counts: Vec<[i16; 2]>,
}

/// An echo that stands out of the noise in one frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RadarDetection {
    /// From the radar, metres.
    pub range_m: f64,
    /// Away positive, between the speeds that alias, m/s.
    pub radial_speed_mps: f64,
    /// From boresight to the left, radians.
    pub azimuth_rad: f64,
    /// Over the noise, after all integration, dB.
    pub snr_db: f64,
    /// Radar cross-section by the radar equation, square metres.
    pub cross_section_m2: f64,
}

/// A target that was followed over frames, in the vehicle frame of the radar's end of the train.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RadarTrack {
    /// The same from frame to frame.
    pub id: u32,
    /// Forward and left, metres.
    pub place_m: [f64; 2],
    /// Over ground, along the vehicle frame's axes, m/s.
    pub velocity_mps: [f64; 2],
    /// Covariance of place and velocity, by rows.
    pub covariance: [[f64; 4]; 4],
    /// Radar cross-section, mean over the frames, square metres.
    pub cross_section_m2: f64,
    /// Frames since it was first seen.
    pub frames: u32,
    /// It is taken for the mirror image of another one in a wall.
    pub is_ghost: bool,
}

/// What was found in a frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RadarReport {
    /// The radar.
    pub end: TrainEnd,
    /// Number of the frame.
    pub number: u32,
    /// The middle of the frame, by the radar's clock.
    pub time: SimTime,
    /// Echoes of this frame.
    pub detections: Vec<RadarDetection>,
    /// Targets that are confirmed.
    pub tracks: Vec<RadarTrack>,
    /// The converter was driven to full scale.
    pub is_saturated: bool,
    /// The noise is higher than the sheet says by so much, dB: a second radar, or a fault.
    pub noise_rise_db: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against hand-worked numbers of a long-range waveform: 166.5 MHz over 256 samples at 25 MHz.
    #[test]
    fn bins_follow_from_the_sweep() {
        let waveform = RadarWaveform {
            start_hz: 76.5e9,
            slope_hzps: 16.26e12,
            sample_rate_hz: 25e6,
            samples: 256,
            loops: 128,
            chirp_interval_s: 12.5e-6,
        };
        let is = |value: f64, expected: f64| (value / expected - 1.0).abs() < 1e-3;
        assert!(is(waveform.band_hz(), 166.5e6));
        assert!(is(waveform.wave_m(), 3.9146e-3));
        assert!(is(waveform.range_bin_m(), 0.9003));
        assert!(is(waveform.most_range_m(), 230.5));
        assert!(is(waveform.speed_bin_mps(2), 0.6117));
        assert!(is(waveform.most_speed_mps(2), 39.15));
    }
}
