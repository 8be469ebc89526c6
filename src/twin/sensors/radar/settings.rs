//! Settings of a radar, what its sheet says of it, and how it really is.
//!
//! **Waveform.** Defaults are a long-range sweep of the 76 to 77 GHz band: 166.5 MHz over 256 samples at 25 MHz of both
//! quadratures (slope 16.26 MHz/us, range bin 0.90 m, 230 m without aliases); two transmitters in turn, a chirp every
//! 12.5 us, so 25 us from loop to loop (39 m/s either way without aliases, bin 0.61 m/s); 128 loops, a frame of 3.2 ms.
//!
//! **Array.** Receivers lie half a wave apart, transmitters as many half waves apart as there are receivers: in sum a line
//! without gaps, of 8 elements by default.
//!
//! **Loss.** The sheet has no line for losses behind the antennas: the power that it states is what is left of them.
//!
//! **What the sheet does not know.** [`RadarError`]: mount, gain, amplitude and phase from channel to channel, quartz.

use super::interference::RoadRadarSettings;
use super::link::Antenna;
use super::scatterers::{BodyEchoSettings, ClutterSettings};
use crate::bus::{RadarSheet, RadarWaveform, TrainEnd};
use crate::settings::{Checker, settings};
use crate::twin::random::Stream;
use crate::twin::sensors::ClockSettings;
use nalgebra::{Complex, Isometry3, Translation3, UnitQuaternion};

settings! {
    /// A 77 GHz radar that looks along the track, at one end of a train or at both. Each has errors of its own.
    pub struct RadarSettings {
        /// The ends of the train that have one.
        ends: Vec<TrainEnd> = vec![TrainEnd::Front];
        /// Frames a second.
        frames_per_s: f64 = 10.0, in 0.1..=50.0;
        /// Frequency at which a sweep begins, GHz.
        start_ghz: f64 = 76.5, in 76.0..=81.0;
        /// What the samples of a chirp sweep over, MHz.
        sweep_mhz: f64 = 166.5, in 10.0..=4000.0;
        /// Samples a second, of both quadratures, MHz.
        sample_rate_mhz: f64 = 25.0, in 1.0..=100.0;
        /// Samples of a chirp.
        samples: u32 = 256, in 16.0..=1024.0;
        /// How often each transmitter sends in a frame.
        loops: u32 = 128, in 1.0..=512.0;
        /// From the begin of a chirp to the next, us.
        chirp_interval_us: f64 = 12.5, in 1.0..=1000.0;
        /// Transmitters, which send in turn.
        transmitters: u32 = 2, in 1.0..=3.0;
        /// Receivers.
        receivers: u32 = 4, in 1.0..=8.0;
        /// Power sent, dBm.
        power_dbm: f64 = 12.0, in -20.0..=30.0;
        /// Gain of a transmitter's antenna on boresight, dBi.
        transmit_gain_dbi: f64 = 12.0, in 0.0..=40.0;
        /// Gain of a receiver's antenna, dBi.
        receive_gain_dbi: f64 = 12.0, in 0.0..=40.0;
        /// Half-power width of either antenna in azimuth, deg.
        azimuth_width_deg: f64 = 80.0, in 1.0..=180.0;
        /// In elevation, deg.
        elevation_width_deg: f64 = 20.0, in 1.0..=180.0;
        /// Gain of either antenna beside and behind its beam, against boresight, dB.
        side_lobe_db: f64 = -20.0, in -60.0..=0.0;
        /// Noise figure of a receiver, dB.
        noise_figure_db: f64 = 13.0, in 0.0..=30.0;
        /// Losses of radome, lines and mismatch, out and back together, dB.
        loss_db: f64 = 2.0, in 0.0..=30.0;
        /// Power at a receiver's antenna that drives the converter to full scale, dBm.
        full_scale_dbm: f64 = -45.0, in -100.0..=20.0;
        /// Bits of the converter.
        bits: u32 = 12, in 4.0..=16.0;
        /// Place ahead of the end of the train, m.
        forward_m: f64 = 0.0, in -2.0..=2.0;
        /// Left of the centreline, m.
        lateral_m: f64 = 0.0, in -2.0..=2.0;
        /// Above top of rail, m.
        height_m: f64 = 1.0, in 0.1..=5.0;
        /// Turn of boresight from straight ahead, deg, left positive.
        yaw_deg: f64 = 0.0, in -180.0..=180.0;
        /// Tilt of boresight, deg, up positive.
        pitch_deg: f64 = 0.0, in -45.0..=45.0;
        /// What its sheet does not know. Default: a usual mount and calibration.
        error: RadarError = RadarError::default(), nested;
        /// How bodies echo.
        bodies: BodyEchoSettings = BodyEchoSettings::default(), nested;
        /// How the surroundings echo.
        clutter: ClutterSettings = ClutterSettings::default(), nested;
        /// What a wall takes of the power that it mirrors, dB; 200 for no mirror images.
        wall_loss_db: f64 = 6.0, in 0.0..=200.0;
        /// A radar of somebody else that shines along the line. Default: none.
        road: Option<RoadRadarSettings> = None, nested;
        /// Its clock.
        clock: ClockSettings = ClockSettings::default(), nested;
    }
    also check_together
}

settings! {
    /// By how much a radar differs from its sheet: standard deviations, drawn once for each.
    #[derive(Copy)]
    pub struct RadarError {
        /// Turn of the mount, about each axis, deg.
        mount_deg: f64 = 0.3, in 0.0..=10.0;
        /// Gain of all channels, dB.
        gain_db: f64 = 1.0, in 0.0..=10.0;
        /// Of each channel beside that, dB.
        channel_gain_db: f64 = 0.3, in 0.0..=10.0;
        /// Phase of each channel, deg.
        channel_phase_deg: f64 = 3.0, in 0.0..=180.0;
        /// Frequency of the quartz that sweep and samples follow from, millionths.
        quartz_ppm: f64 = 20.0, in 0.0..=1000.0;
    }
}

/// A radar as it really is.
#[derive(Clone, Debug)]
pub struct TrueRadar {
    /// Its true figures, where the sheet has what is believed.
    pub figures: RadarSheet,
    /// Of its transmitters.
    pub transmit: Antenna,
    /// Of its receivers.
    pub receive: Antenna,
    /// What each pair of a transmitter and a receiver makes of an echo's amplitude and phase.
    pub channels: Vec<Complex<f64>>,
    /// Bits of its converter.
    pub bits: u32,
}

impl RadarSettings {
    fn check_together(&self, check: &mut Checker<'_>) {
        if self.ends.is_empty()
            || (1..self.ends.len()).any(|k| self.ends[..k].contains(&self.ends[k]))
        {
            let what = "names no end, or one twice";
            check.problem("ends", what, "give [\"front\"], [\"rear\"] or both");
        }
        let sampled_us = f64::from(self.samples) / self.sample_rate_mhz;
        if self.chirp_interval_us < sampled_us {
            check.problem(
                "chirp_interval_us",
                format!(
                    "{} us are over before {} samples are taken",
                    self.chirp_interval_us, self.samples
                ),
                format!("give {sampled_us:.3} or more, or take fewer samples"),
            );
        }
        let frame_s = self.frame_s();
        if frame_s * self.frames_per_s > 1.0 {
            let what = format!("a frame lasts {:.1} ms", 1e3 * frame_s);
            let remedy = format!("give {:.1} at most, or fewer loops", 1.0 / frame_s);
            check.problem("frames_per_s", what, remedy);
        }
    }

    /// From the first chirp of a frame to the end of the last one, seconds.
    pub fn frame_s(&self) -> f64 {
        1e-6 * self.chirp_interval_us * f64::from(self.loops * self.transmitters)
    }

    fn waveform(&self) -> RadarWaveform {
        let sample_rate_hz = 1e6 * self.sample_rate_mhz;
        RadarWaveform {
            start_hz: 1e9 * self.start_ghz,
            slope_hzps: 1e6 * self.sweep_mhz * sample_rate_hz / f64::from(self.samples),
            sample_rate_hz,
            samples: self.samples,
            loops: self.loops,
            chirp_interval_s: 1e-6 * self.chirp_interval_us,
        }
    }

    /// What the equipment is told of the radar at an end.
    pub fn sheet(&self, end: TrainEnd) -> RadarSheet {
        let waveform = self.waveform();
        let half_wave_m = 0.5 * waveform.wave_m();
        RadarSheet {
            end,
            waveform,
            transmitters_m: line(self.transmitters, half_wave_m * f64::from(self.receivers)),
            receivers_m: line(self.receivers, half_wave_m),
            power_dbm: self.power_dbm - self.loss_db,
            transmit_gain_dbi: self.transmit_gain_dbi,
            receive_gain_dbi: self.receive_gain_dbi,
            noise_figure_db: self.noise_figure_db,
            full_scale_dbm: self.full_scale_dbm,
            vehicle_from_radar: self.mount(),
        }
    }

    fn mount(&self) -> Isometry3<f64> {
        let (yaw, pitch) = (self.yaw_deg.to_radians(), self.pitch_deg.to_radians());
        let place = Translation3::new(self.forward_m, self.lateral_m, self.height_m);
        Isometry3::from_parts(place, UnitQuaternion::from_euler_angles(0.0, -pitch, yaw))
    }

    fn antenna(&self, gain_dbi: f64) -> Antenna {
        Antenna {
            gain_dbi,
            azimuth_rad: self.azimuth_width_deg.to_radians(),
            elevation_rad: self.elevation_width_deg.to_radians(),
            side_lobe_db: self.side_lobe_db,
        }
    }

    /// As it is built, with errors that a seed gives.
    pub fn built(&self, end: TrainEnd, seed: u64) -> TrueRadar {
        let error = Stream::new(seed, end as u64, "radar error");
        let mut figures = self.sheet(end);
        let turned = nalgebra::Vector3::from_fn(|axis, _| {
            self.error.mount_deg.to_radians() * error.normal(axis as u64)
        });
        figures.vehicle_from_radar.rotation *= UnitQuaternion::from_scaled_axis(turned);
        figures.waveform = drifted(
            &figures.waveform,
            1e-6 * self.error.quartz_ppm * error.normal(3),
        );
        let all_db = self.error.gain_db * error.normal(4);
        let channel = |k: usize| {
            let [gain, phase] = [0, 1].map(|n| error.normal(5 + 2 * k as u64 + n));
            let gain_db = all_db + self.error.channel_gain_db * gain;
            let phase_rad = self.error.channel_phase_deg.to_radians() * phase;
            Complex::from_polar(10f64.powf(0.05 * gain_db), phase_rad)
        };
        TrueRadar {
            transmit: self.antenna(self.transmit_gain_dbi),
            receive: self.antenna(self.receive_gain_dbi),
            channels: (0..figures.channels()).map(channel).collect(),
            bits: self.bits,
            figures,
        }
    }
}

/// The same waveform from a quartz that is fast by a share.
fn drifted(waveform: &RadarWaveform, share: f64) -> RadarWaveform {
    let fast = 1.0 + share;
    RadarWaveform {
        start_hz: waveform.start_hz * fast,
        slope_hzps: waveform.slope_hzps * fast * fast,
        sample_rate_hz: waveform.sample_rate_hz * fast,
        chirp_interval_s: waveform.chirp_interval_s / fast,
        ..*waveform
    }
}

/// Places about the middle, so far apart to the left.
fn line(count: u32, apart_m: f64) -> Vec<[f64; 2]> {
    let middle = 0.5 * (f64::from(count) - 1.0);
    (0..count)
        .map(|k| [(f64::from(k) - middle) * apart_m, 0.0])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Settings;

    /// Fails where the sums of both places leave gaps, or double one: 8 elements half a wave apart.
    #[test]
    fn the_virtual_line_has_no_gaps() {
        let sheet = RadarSettings::default().sheet(TrainEnd::Front);
        let mut sums: Vec<f64> = (sheet.transmitters_m.iter())
            .flat_map(|t| sheet.receivers_m.iter().map(move |r| t[0] + r[0]))
            .collect();
        sums.sort_by(f64::total_cmp);
        let half_wave_m = 0.5 * sheet.waveform.wave_m();
        assert_eq!(sums.len(), 8);
        assert!(
            sums.windows(2)
                .all(|pair| (pair[1] - pair[0] - half_wave_m).abs() < 1e-9)
        );
        assert!(sums.iter().sum::<f64>().abs() < 1e-12);
        assert!((sheet.waveform.slope_hzps / 16.26e12 - 1.0).abs() < 1e-3);
        assert!((sheet.waveform.most_speed_mps(2) - 39.15).abs() < 0.05);
    }

    /// Fails where a radar that cannot work passes, or a good one does not.
    #[test]
    fn settings_are_checked() {
        let mut problems = Vec::new();
        RadarSettings::default().check("radar", &mut problems);
        assert!(problems.is_empty(), "{problems:?}");
        let bad = RadarSettings {
            ends: Vec::new(),
            chirp_interval_us: 10.0,
            loops: 512,
            frames_per_s: 50.0,
            transmitters: 3,
            ..RadarSettings::default()
        };
        bad.check("radar", &mut problems);
        let keys: Vec<_> = problems.iter().map(|p| p.key.as_str()).collect();
        assert_eq!(keys, ["radar.ends", "radar.chirp_interval_us"]);
        let long = RadarSettings {
            chirp_interval_us: 100.0,
            frames_per_s: 50.0,
            ..RadarSettings::default()
        };
        problems.clear();
        long.check("radar", &mut problems);
        assert_eq!(problems[0].key, "radar.frames_per_s");
    }

    /// Fails where a built radar is as its sheet says, or two of one seed differ.
    #[test]
    fn errors_follow_from_the_seed() {
        let settings = RadarSettings::default();
        let (sheet, built) = (
            settings.sheet(TrainEnd::Front),
            settings.built(TrainEnd::Front, 1),
        );
        assert_ne!(sheet, built.figures);
        assert_eq!(built.figures, settings.built(TrainEnd::Front, 1).figures);
        assert_ne!(built.channels, settings.built(TrainEnd::Rear, 1).channels);
        let apart = sheet
            .vehicle_from_radar
            .rotation
            .angle_to(&built.figures.vehicle_from_radar.rotation);
        assert!((1e-4..0.05).contains(&apart), "{apart}");
    }
}
