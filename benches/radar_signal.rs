//! What a frame of a radar costs, by the number of its echoes.
//!
//! ```text
//! cargo bench --bench radar_signal
//! ```
//!
//! A frame of the default waveform: 256 samples, 128 loops, 2 transmitters, 4 receivers. Echoes lie up to 200 m away and move
//! at up to 39 m/s. Signal and converter are measured apart, on one thread.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::disallowed_methods,
    missing_docs,
    reason = "a benchmark measures time and prints its figures, and may fail by panicking"
)]

use metrotwin::bus::TrainEnd;
use metrotwin::twin::random::Stream;
use metrotwin::twin::sensors::RadarSettings;
use metrotwin::twin::sensors::radar::Converter;
use metrotwin::twin::sensors::radar::signal::{BeatModel, Moving, RadarEcho};
use nalgebra::{Point3, Vector3};
use std::hint::black_box;
use std::time::Instant;

/// Of so many frames the least cost counts, because the machine does other things too.
const RUNS: u32 = 7;

fn echoes(count: u64) -> Vec<RadarEcho> {
    let stream = Stream::new(1, 0, "bench");
    let echo = |k: u64| {
        let draw = |n: u64| 2.0 * stream.uniform(8 * k + n) - 1.0;
        let (sin, cos) = draw(0).sin_cos();
        let away = Vector3::new(cos, sin, 0.1 * draw(1));
        let way = Moving {
            place_m: Point3::from(away * (101.0 + 100.0 * draw(2))),
            velocity_mps: away * (39.0 * draw(3)),
        };
        RadarEcho {
            out: way,
            back: way,
            amplitude: 100.0,
            phase_rad: draw(4),
        }
    };
    (0..count).map(echo).collect()
}

fn least_ms<T>(mut work: impl FnMut() -> T) -> f64 {
    let run = |_| {
        let begin = Instant::now();
        black_box(work());
        1e3 * begin.elapsed().as_secs_f64()
    };
    (0..RUNS).map(run).fold(f64::INFINITY, f64::min)
}

fn report() {
    println!("echoes   signal ms   converter ms");
    let radar = RadarSettings::default().built(TrainEnd::Front, 1);
    let model = BeatModel {
        figures: &radar.figures,
        channels: &radar.channels,
    };
    let converter = Converter::new(&radar.figures, radar.bits, Stream::new(1, 0, "noise"));
    for count in [0, 10, 50, 100, 200, 500, 1000] {
        let echoes = echoes(count);
        let signal_ms = least_ms(|| model.samples(&echoes));
        let samples = model.samples(&echoes);
        let converter_ms = least_ms(|| converter.counts(0, &samples));
        println!("{count:6}  {signal_ms:10.1}  {converter_ms:13.1}");
    }
}

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    pool.unwrap().install(report);
}
