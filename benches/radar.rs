//! What a frame costs the onboard radar, from its counts to tracks.
//!
//! ```text
//! cargo bench --bench radar
//! ```
//!
//! A frame of noise and of so many echoes at drawn ranges, speeds and azimuths, one thread. The first line is that of
//! the usual radar: 256 samples, 128 loops, 2 transmitters and 4 receivers. Others have more of one.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::disallowed_methods,
    missing_docs,
    reason = "a benchmark measures time and prints its figures, and may fail by panicking"
)]

use metrotwin::bus::{
    Content, Message, Node, RadarFrame, RadarSheet, RadarWaveform, SimTime, TrainEnd, TrainId,
};
use metrotwin::stack::Equipment;
use metrotwin::stack::radar::{CfarKind, RadarTracking, RadarTrackingSettings};
use nalgebra::Isometry3;
use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;

/// Of so many frames the least cost counts, because the machine does other things too.
const FRAMES: u32 = 30;

fn sheet(samples: u32, loops: u32, receivers: u32) -> RadarSheet {
    let waveform = RadarWaveform {
        start_hz: 76.5e9,
        slope_hzps: 16.26e12,
        sample_rate_hz: 25e6,
        samples,
        loops,
        chirp_interval_s: 12.5e-6,
    };
    let half_m = 0.5 * waveform.wave_m();
    let place = |k: u32| [f64::from(k) * half_m, 0.0];
    RadarSheet {
        end: TrainEnd::Front,
        waveform,
        transmitters_m: vec![place(0), place(receivers)],
        receivers_m: (0..receivers).map(place).collect(),
        power_dbm: 12.0,
        transmit_gain_dbi: 9.0,
        receive_gain_dbi: 9.0,
        noise_figure_db: 13.0,
        full_scale_dbm: -20.0,
        vehicle_from_radar: Isometry3::identity(),
    }
}

/// Fractions that look drawn: multiples of the golden ratio.
fn drawn(k: u32) -> f64 {
    (f64::from(k) * 0.618_033_988_749_895).fract()
}

/// Tones over samples, loops and elements, 40 dB over noise after integration, and noise of about 12 counts.
fn counts(sheet: &RadarSheet, echoes: u32) -> Vec<[i16; 2]> {
    let waveform = &sheet.waveform;
    let amplitude = 12.0 * (1e4 / sheet.frame_samples() as f64).sqrt();
    let receivers = sheet.receivers_m.len();
    let mut counts = Vec::with_capacity(sheet.frame_samples());
    let mut state = 1u64;
    let mut noise = || {
        let sum: f64 = (0..6)
            .map(|_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                (state >> 11) as f64 / (1u64 << 53) as f64
            })
            .sum();
        12.0 * (sum - 3.0)
    };
    for m in 0..waveform.loops {
        for element in 0..2 * receivers as u32 {
            for n in 0..waveform.samples {
                let (mut re, mut im) = (noise(), noise());
                for k in 0..echoes {
                    let [range, speed, beam] = [3 * k + 1, 3 * k + 2, 3 * k + 3].map(drawn);
                    // The second transmitter sends half a loop later.
                    let m = f64::from(m) + 0.5 * f64::from(element / receivers as u32);
                    let [n, element] = [n, element].map(f64::from);
                    let phase = TAU * (range * n + speed * m + beam * element).fract();
                    re += amplitude * phase.cos();
                    im += amplitude * phase.sin();
                }
                counts.push([re.round() as i16, im.round() as i16]);
            }
        }
    }
    counts
}

/// Prints the line of a size of frames, with so many echoes.
fn report((samples, loops, receivers): (u32, u32, u32), cfar: CfarKind, echoes: u32) {
    let sheet = sheet(samples, loops, receivers);
    let node = Node::Train(TrainId(0));
    let settings = RadarTrackingSettings {
        cfar,
        ..RadarTrackingSettings::default()
    };
    let mut tracking = RadarTracking::new(node.clone(), settings, &sheet);
    let counts = counts(&sheet, echoes);
    let (mut least_ms, mut detections) = (f64::INFINITY, 0);
    for number in 0..FRAMES {
        let time = SimTime::from_secs(0.05 * f64::from(number));
        let frame = RadarFrame {
            end: sheet.end,
            number,
            start: time,
            counts: counts.clone(),
        };
        let message = Message::own(node.clone(), time, Content::RadarFrame(frame));
        let begin = Instant::now();
        tracking.on(&message);
        let reports = black_box(tracking.cycle(time.plus(0.04)));
        least_ms = least_ms.min(1e3 * begin.elapsed().as_secs_f64());
        if let Some(Content::Radar(report)) = reports.first().map(|message| &message.content) {
            detections = report.detections.len();
        }
    }
    let channels = 2 * receivers;
    println!(
        "{samples:7}  {loops:5}  {channels:8}  {cfar:?}  {echoes:6}  {detections:10}  {least_ms:6.2}"
    );
}

fn main() {
    println!("samples  loops  channels  CFAR  echoes  detections  ms a frame");
    let usual = (256, 128, 4);
    report(usual, CfarKind::Os, 10);
    report(usual, CfarKind::Ca, 10);
    for echoes in [0, 40, 160] {
        report(usual, CfarKind::Os, echoes);
    }
    for size in [(512, 128, 4), (256, 256, 4), (256, 128, 8)] {
        report(size, CfarKind::Os, 10);
    }
}
