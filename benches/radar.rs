//! What the onboard radar costs a frame, on one thread: transforms, and detection of either kind.
//!
//! ```text
//! cargo bench --bench radar
//! ```

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::disallowed_methods,
    missing_docs,
    reason = "a benchmark measures time and prints its figures, and may fail by panicking"
)]

use metrotwin::bus::{RadarFrame, RadarSheet, RadarWaveform, SimTime, TrainEnd};
use metrotwin::stack::radar::{Cfar, CfarKind, RadarSettings, RangeDoppler};
use nalgebra::Isometry3;
use std::hint::black_box;
use std::time::Instant;

const RUNS: usize = 21;

/// Of so many samples a chirp, loops, and pairs of one of two transmitters and a receiver.
fn sheet(samples: u32, loops: u32, channels: u32) -> RadarSheet {
    let waveform = RadarWaveform {
        start_hz: 76.5e9,
        slope_hzps: 16.26e12,
        sample_rate_hz: 25e6,
        samples,
        loops,
        chirp_interval_s: 12.5e-6,
    };
    let half_m = 0.5 * waveform.wave_m();
    let receivers = channels / 2;
    RadarSheet {
        end: TrainEnd::Front,
        waveform,
        transmitters_m: vec![[0.0, 0.0], [half_m * f64::from(receivers), 0.0]],
        receivers_m: (0..receivers)
            .map(|k| [half_m * f64::from(k), 0.0])
            .collect(),
        power_dbm: 12.0,
        transmit_gain_dbi: 12.0,
        receive_gain_dbi: 12.0,
        noise_figure_db: 13.0,
        full_scale_dbm: -45.0,
        vehicle_from_radar: Isometry3::identity(),
    }
}

/// Counts without order.
fn frame(sheet: &RadarSheet) -> RadarFrame {
    let mut state = 1_u32;
    let mut count = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 16) as i16 / 64
    };
    let counts = (0..sheet.frame_samples()).map(|_| [count(), count()]);
    RadarFrame {
        end: sheet.end,
        number: 0,
        start: SimTime::ZERO,
        counts: counts.collect(),
    }
}

/// Median, milliseconds.
fn median_ms(mut run: impl FnMut()) -> f64 {
    let mut costs_ms: Vec<f64> = (0..RUNS)
        .map(|_| {
            let begin = Instant::now();
            run();
            1e3 * begin.elapsed().as_secs_f64()
        })
        .collect();
    costs_ms.sort_by(f64::total_cmp);
    costs_ms[RUNS / 2]
}

fn main() {
    println!("samples  loops  channels  ms: transforms  CA-CFAR  OS-CFAR");
    for (samples, loops, channels) in [(256, 128, 4), (256, 128, 8), (256, 256, 8), (512, 128, 8)] {
        let sheet = sheet(samples, loops, channels);
        let frame = frame(&sheet);
        let mut transform = RangeDoppler::new(&sheet, &RadarSettings::default());
        let transforms_ms = median_ms(|| {
            black_box(transform.transform(&frame).unwrap());
        });
        let cells = transform.transform(&frame).unwrap();
        let [ca_ms, os_ms] = [CfarKind::Ca, CfarKind::Os].map(|cfar| {
            let settings = RadarSettings {
                cfar,
                ..RadarSettings::default()
            };
            let mut cfar = Cfar::new(&settings, cells.layout.columns());
            median_ms(|| {
                cfar.detect(cells.powers, |range, column| {
                    black_box((range, column));
                })
            })
        });
        println!(
            "{samples:7}  {loops:5}  {channels:8}  {transforms_ms:14.1}  {ca_ms:7.1}  {os_ms:7.1}"
        );
    }
}
