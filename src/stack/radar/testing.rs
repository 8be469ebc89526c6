//! The signal of scatterers for the tests of this room, from the model of the bus: exact two-way delays by
//! transmitter, receiver and chirp, and thermal noise.

use super::settings::RadarTrackingSettings;
use super::window::Window;
use crate::bus::{RadarFrame, RadarSheet, RadarWaveform, SimTime, TrainEnd};
use crate::stack::led::testing::SplitMix64;
use nalgebra::{Isometry3, Point3, Vector3};
use std::f64::consts::{PI, TAU};

pub const LIGHT_MPS: f64 = 299_792_458.0;
const BOLTZMANN_JPK: f64 = 1.380_649e-23;

/// Random numbers.
pub struct Draw(SplitMix64);

impl Draw {
    pub fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    pub fn uniform(&mut self) -> f64 {
        self.0.uniform()
    }

    /// With a mean of one.
    pub fn exponential(&mut self) -> f64 {
        -(1.0 - self.uniform()).ln()
    }

    /// Complex and normal, with a mean power.
    pub fn noise(&mut self, power: f64) -> [f64; 2] {
        let amplitude = (power * self.exponential()).sqrt();
        let (sin, cos) = (TAU * self.uniform()).sin_cos();
        [amplitude * cos, amplitude * sin]
    }
}

/// 166.5 MHz over 256 samples, two transmitters, four receivers, as of a unit for cars.
pub fn sheet() -> RadarSheet {
    let waveform = RadarWaveform {
        start_hz: 76.5e9,
        slope_hzps: 16.26e12,
        sample_rate_hz: 25e6,
        samples: 256,
        loops: 128,
        chirp_interval_s: 12.5e-6,
    };
    let half_m = 0.5 * waveform.wave_m();
    RadarSheet {
        end: TrainEnd::Front,
        waveform,
        transmitters_m: vec![[0.0, 0.0], [4.0 * half_m, 0.0]],
        receivers_m: (0..4).map(|k| [f64::from(k) * half_m, 0.0]).collect(),
        power_dbm: 12.0,
        transmit_gain_dbi: 9.0,
        receive_gain_dbi: 9.0,
        noise_figure_db: 13.0,
        full_scale_dbm: -20.0,
        vehicle_from_radar: Isometry3::identity(),
    }
}

/// A point in the radar frame that moves evenly.
#[derive(Clone, Copy, Debug)]
pub struct Scatterer {
    /// At the middle of the frame.
    pub place_m: Point3<f64>,
    pub velocity_mps: Vector3<f64>,
    pub cross_section_m2: f64,
    /// Of its reflection.
    pub phase_rad: f64,
}

impl Scatterer {
    /// By range, azimuth and radial speed.
    pub fn polar(range_m: f64, azimuth_rad: f64, speed_mps: f64, cross_section_m2: f64) -> Self {
        let along = Vector3::new(azimuth_rad.cos(), azimuth_rad.sin(), 0.0);
        Self {
            place_m: Point3::from(range_m * along),
            velocity_mps: speed_mps * along,
            cross_section_m2,
            phase_rad: 0.0,
        }
    }

    /// Amplitude in counts, by the radar equation.
    fn amplitude(&self, sheet: &RadarSheet) -> f64 {
        let range_m = self.place_m.coords.norm();
        let gains_dbi = sheet.transmit_gain_dbi + sheet.receive_gain_dbi;
        let area = sheet.waveform.wave_m().powi(2) * self.cross_section_m2;
        let spread = area / ((4.0 * PI).powi(3) * range_m.powi(4));
        let power_dbm = sheet.power_dbm + gains_dbi + 10.0 * spread.log10();
        RadarSheet::FULL_SCALE * 10f64.powf(0.05 * (power_dbm - sheet.full_scale_dbm))
    }
}

/// Power of a sample of thermal noise, counts^2.
pub fn noise_power(sheet: &RadarSheet) -> f64 {
    let watt = BOLTZMANN_JPK * 290.0 * sheet.waveform.sample_rate_hz;
    let dbm = 10.0 * (1e3 * watt).log10() + sheet.noise_figure_db;
    RadarSheet::FULL_SCALE.powi(2) * 10f64.powf(0.1 * (dbm - sheet.full_scale_dbm))
}

/// From the start of a frame to its middle, seconds.
pub fn half_frame_s(sheet: &RadarSheet) -> f64 {
    let loop_s = sheet.waveform.loop_s(sheet.transmitters_m.len());
    0.5 * f64::from(sheet.waveform.loops) * loop_s
}

/// The samples of a frame without noise, by loop, transmitter, receiver, sample.
fn signal(sheet: &RadarSheet, scatterers: &[Scatterer], samples: &mut [[f64; 2]]) {
    let waveform = &sheet.waveform;
    let transmitters = sheet.transmitters_m.len();
    let mut chirps = samples.chunks_exact_mut(waveform.samples as usize);
    for chirp in 0..waveform.loops as usize * transmitters {
        let time_s = waveform.chirp_interval_s * chirp as f64 - half_frame_s(sheet);
        for receiver in &sheet.receivers_m {
            let Some(out) = chirps.next() else { return };
            for scatterer in scatterers {
                let place = scatterer.place_m + scatterer.velocity_mps * time_s;
                let way = |e: &[f64; 2]| (place - Point3::new(0.0, e[0], e[1])).norm();
                let way_m = way(&sheet.transmitters_m[chirp % transmitters]) + way(receiver);
                add_beat(waveform, scatterer, scatterer.amplitude(sheet), way_m, out);
            }
        }
    }
}

/// A tone has an even phase: turned on from sample to sample.
fn add_beat(
    waveform: &RadarWaveform,
    scatterer: &Scatterer,
    amplitude: f64,
    way_m: f64,
    out: &mut [[f64; 2]],
) {
    let delay_s = way_m / LIGHT_MPS;
    let slope = waveform.slope_hzps;
    let cycles = waveform.start_hz * delay_s - 0.5 * slope * delay_s * delay_s;
    let step = TAU * slope * delay_s / waveform.sample_rate_hz;
    let (mut im, mut re) = (scatterer.phase_rad + TAU * cycles.fract()).sin_cos();
    let (sin, cos) = step.sin_cos();
    for sample in out {
        sample[0] += amplitude * re;
        sample[1] += amplitude * im;
        (re, im) = (re * cos - im * sin, re * sin + im * cos);
    }
}

/// A frame of scatterers in noise so many times that of the sheet.
pub fn frame(
    sheet: &RadarSheet,
    scatterers: &[Scatterer],
    rise: f64,
    draw: &mut Draw,
) -> RadarFrame {
    let mut samples = vec![[0.0; 2]; sheet.frame_samples()];
    signal(sheet, scatterers, &mut samples);
    let power = rise * noise_power(sheet);
    let counts = samples.iter().map(|[re, im]| {
        let noise = draw.noise(power);
        // Rounds, and saturates as a converter does.
        [
            (re + noise[0]).round() as i16,
            (im + noise[1]).round() as i16,
        ]
    });
    RadarFrame {
        end: sheet.end,
        number: 0,
        start: SimTime::ZERO,
        counts: counts.collect(),
    }
}

/// Without windows, for theory that has none.
pub fn unweighted() -> RadarTrackingSettings {
    RadarTrackingSettings {
        range_window: Window::Rectangular,
        speed_window: Window::Rectangular,
        ..RadarTrackingSettings::default()
    }
}
