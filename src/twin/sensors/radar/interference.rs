//! Other radars in the band.
//!
//! **Model.** A second radar sweeps by a plan of its own: its chirps are long, steep and far apart as it likes. What it sends
//! comes straight (Friis, R^-2), and our mixer turns it into exp(i (phi_ours - phi_theirs)), which is heard while the two
//! frequencies differ by what our filter lets through, 0 to the sample rate. Where the slopes differ, our samples meet a
//! short sweep through all beats: it raises the noise of some chirps, as is seen of cars that meet (Brooker, "Mutual
//! interference of millimeter-wave radar systems", IEEE Trans. EMC 49(1), 2007). Where slope, start and clock are the same,
//! it is a tone in every chirp, at half the distance: a ghost over all speeds, since each of their chirps begins with a phase of
//! its own.
//!
//! Not modelled: their echoes from walls, and what drives our receiver
//! beyond its straight range.

use super::converter::counts_of;
use super::link::{Antenna, Link, watts};
use super::signal::{Moving, elements};
use crate::bus::{RadarSheet, RadarWaveform};
use crate::numerics::LIGHT_MPS;
use crate::settings::{Checker, settings};
use crate::twin::random::Stream;
use nalgebra::{Complex, Point3};
use std::f64::consts::TAU;

settings! {
    /// A radar of somebody else, as of a car on a road over the line: it stands, and sends without a pause.
    pub struct RoadRadarSettings {
        /// Where it is: world east, north, up, m.
        place_m: [f64; 3] = [0.0; 3];
        /// Power that it sends towards the track, with its antenna's gain, dBm.
        power_dbm: f64 = 30.0, in -50.0..=60.0;
        /// Frequency at which its sweeps begin, GHz.
        start_ghz: f64 = 76.4, in 70.0..=90.0;
        /// What a sweep sweeps over, MHz.
        sweep_mhz: f64 = 400.0, in 0.0..=5000.0;
        /// How long a sweep takes, us.
        sweep_us: f64 = 21.0, in 0.1..=10_000.0;
        /// From the begin of a sweep to the next, us.
        chirp_interval_us: f64 = 27.0, in 0.1..=10_000.0;
    }
    also check_pause
}

impl RoadRadarSettings {
    fn check_pause(&self, check: &mut Checker<'_>) {
        check.within(
            "chirp_interval_us",
            self.chirp_interval_us,
            self.sweep_us..=10_000.0,
        );
    }

    /// Its sweeps, since some moment before a run.
    pub fn sweeps(&self) -> Sweeps {
        Sweeps {
            start_hz: 1e9 * self.start_ghz,
            slope_hzps: 1e12 * self.sweep_mhz / self.sweep_us,
            sweep_s: 1e-6 * self.sweep_us,
            interval_s: 1e-6 * self.chirp_interval_us,
            first_s: 0.0,
            count: None,
        }
    }
}

/// Sweeps of a radar, one after the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweeps {
    /// Frequency at which each begins, Hz.
    pub start_hz: f64,
    /// Hz a second.
    pub slope_hzps: f64,
    /// How long each takes.
    pub sweep_s: f64,
    /// From the begin of one to the next.
    pub interval_s: f64,
    /// When the first one begins, from the begin of our frame.
    pub first_s: f64,
    /// How many; none where they never end.
    pub count: Option<u32>,
}

impl Sweeps {
    /// Those of a frame of a radar which begins so long after ours.
    pub fn of_frame(waveform: &RadarWaveform, transmitters: usize, first_s: f64) -> Self {
        Self {
            start_hz: waveform.start_hz,
            slope_hzps: waveform.slope_hzps,
            sweep_s: f64::from(waveform.samples) / waveform.sample_rate_hz,
            interval_s: waveform.chirp_interval_s,
            first_s,
            count: Some(waveform.loops * transmitters as u32),
        }
    }

    /// The sweep that is sent at a time, and how far it has come; none in a pause.
    fn at(&self, seconds: f64) -> Option<(i64, f64)> {
        let since_s = seconds - self.first_s;
        let number = (since_s / self.interval_s).floor();
        let within_s = since_s - number * self.interval_s;
        let is_sent = match self.count {
            Some(count) => (0.0..f64::from(count)).contains(&number),
            None => true,
        };
        (is_sent && within_s <= self.sweep_s).then_some((number as i64, within_s))
    }
}

/// A radar whose signal reaches ours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interferer {
    /// Where it is.
    pub place: Moving,
    /// Its sweeps.
    pub sweeps: Sweeps,
    /// Amplitude at our receivers, counts.
    pub amplitude: f64,
    /// Of the phases with which its sweeps begin.
    pub phases: Stream,
}

impl Interferer {
    /// A radar of a sending power with its gain, in line of sight; loss of air in dB/m.
    pub fn straight(
        figures: &RadarSheet,
        receive: &Antenna,
        (place, sent_dbm): (Moving, f64),
        sweeps: Sweeps,
        (loss_db_m, phases): (f64, Stream),
    ) -> Self {
        let link = Link {
            sent_w: watts(sent_dbm),
            wave_m: figures.waveform.wave_m(),
            loss_db_m,
        };
        let away = place.place_m.coords;
        let power_w = link.straight_w([1.0, receive.gain(&away)], away.norm());
        Self {
            place,
            sweeps,
            amplitude: counts_of(figures, power_w),
            phases,
        }
    }

    /// Adds its signal to the samples of a frame.
    pub fn add(
        &self,
        figures: &RadarSheet,
        channels: &[Complex<f64>],
        samples: &mut [Complex<f32>],
    ) {
        let waveform = &figures.waveform;
        let receivers = elements(&figures.receivers_m);
        if receivers.is_empty() || waveform.samples == 0 {
            return;
        }
        let rows = samples.chunks_mut(waveform.samples as usize).enumerate();
        for (row, row_samples) in rows {
            let (chirp, receiver) = (row / receivers.len(), row % receivers.len());
            let begin_s = chirp as f64 * waveform.chirp_interval_s;
            let channel = channels[row % channels.len()] * self.amplitude;
            self.add_row(
                waveform,
                &receivers[receiver],
                (begin_s, channel),
                row_samples,
            );
        }
    }

    fn add_row(
        &self,
        waveform: &RadarWaveform,
        receiver: &Point3<f64>,
        (begin_s, channel): (f64, Complex<f64>),
        samples: &mut [Complex<f32>],
    ) {
        let way_m = (self.place.after(begin_s) - receiver).norm();
        let speed_mps = self
            .place
            .velocity_mps
            .dot(&(self.place.after(begin_s).coords.normalize()));
        for (k, sample) in samples.iter_mut().enumerate() {
            let t_s = k as f64 / waveform.sample_rate_hz;
            let delay_s = (way_m + speed_mps * t_s) / LIGHT_MPS;
            let Some((number, u_s)) = self.sweeps.at(begin_s + t_s - delay_s) else {
                continue;
            };
            let (ours, theirs) = (waveform.slope_hzps, self.sweeps.slope_hzps);
            let beat_hz = waveform.start_hz - self.sweeps.start_hz + ours * t_s - theirs * u_s;
            if !(0.0..waveform.sample_rate_hz).contains(&beat_hz) {
                continue;
            }
            let turns = waveform.start_hz * t_s + 0.5 * ours * t_s * t_s
                - self.sweeps.start_hz * u_s
                - 0.5 * theirs * u_s * u_s;
            let begun = self.phases.uniform(number as u64);
            let signal = channel * Complex::from_polar(1.0, TAU * (turns - begun).fract());
            *sample += Complex::new(signal.re as f32, signal.im as f32);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::TrainEnd;
    use crate::twin::sensors::radar::RadarSettings;
    use nalgebra::Vector3;

    fn interferer(sweeps: Sweeps) -> Interferer {
        Interferer {
            place: Moving {
                place_m: Point3::new(60.0, 0.0, 0.0),
                velocity_mps: Vector3::zeros(),
            },
            sweeps,
            amplitude: 100.0,
            phases: Stream::new(1, 0, "interferer"),
        }
    }

    fn heard(one: &Interferer, figures: &RadarSheet) -> Vec<Complex<f32>> {
        let channels = vec![Complex::new(1.0, 0.0); figures.channels()];
        let mut samples = vec![Complex::default(); figures.frame_samples()];
        one.add(figures, &channels, &mut samples);
        samples
    }

    /// Two sweeps cross where their frequencies differ by 0 to the sample rate: so many samples of a chirp, of full
    /// amplitude, and none where the other one pauses.
    #[test]
    fn crossing_sweeps_are_heard_while_they_are_near() {
        let figures = RadarSettings::default().sheet(TrainEnd::Front);
        let w = figures.waveform;
        // It falls by nothing: a tone in the middle of the sweep, heard for 25 MHz / slope.
        let tone = Sweeps {
            start_hz: w.start_hz + 80e6,
            slope_hzps: 0.0,
            sweep_s: 1.0,
            interval_s: 2.0,
            first_s: -0.5,
            count: None,
        };
        let samples = heard(&interferer(tone), &figures);
        let loud = |chirp: &[Complex<f32>]| chirp.iter().filter(|z| z.norm() > 99.0).count();
        let expected = w.sample_rate_hz / w.slope_hzps * w.sample_rate_hz;
        for chirp in samples.chunks(256) {
            assert!(
                (loud(chirp) as f64 - expected).abs() <= 1.0,
                "{}",
                loud(chirp)
            );
        }
        let paused = Sweeps {
            first_s: 0.5,
            ..tone
        };
        assert!(
            heard(&interferer(paused), &figures)
                .iter()
                .all(|z| z.norm() < 1e-9)
        );
        // A steeper one crosses sooner, and not in every chirp.
        let steep = RoadRadarSettings::default().sweeps();
        let samples = heard(&interferer(steep), &figures);
        let hit = samples.chunks(256).filter(|chirp| loud(chirp) > 0).count();
        let all = samples.len() / 256;
        assert!(hit > all / 20 && hit < all, "{hit} of {all}");
    }

    /// The same sweep at the same time is a tone of the one-way delay in every chirp.
    #[test]
    fn an_equal_sweep_is_a_tone() {
        let figures = RadarSettings::default().sheet(TrainEnd::Front);
        let w = figures.waveform;
        let samples = heard(&interferer(Sweeps::of_frame(&w, 2, 0.0)), &figures);
        let chirp = &samples[..256];
        let beat_hz = w.slope_hzps * 60.0 / LIGHT_MPS;
        let tone = |hz: f64| {
            let sum: Complex<f64> = (chirp.iter().enumerate())
                .map(|(k, z)| {
                    let turns = hz * k as f64 / w.sample_rate_hz;
                    Complex::new(f64::from(z.re), f64::from(z.im))
                        * Complex::from_polar(1.0, -TAU * turns)
                })
                .sum();
            sum.norm() / 256.0
        };
        // The first samples of a chirp come before its arrival.
        assert!(tone(beat_hz) > 95.0, "{}", tone(beat_hz));
        assert!(tone(beat_hz + 4.5 * w.sample_rate_hz / 256.0) < 10.0);
    }
}
