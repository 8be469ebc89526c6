//! What a picture costs.
//!
//! ```text
//! cargo bench --bench render
//! ```

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::disallowed_methods,
    missing_docs,
    reason = "a benchmark measures time and prints its figures, and may fail by panicking"
)]

#[allow(dead_code, reason = "tests use the rest of it")]
#[path = "../tests/common/sample.rs"]
mod sample;

use metrotwin::bus::Intrinsics;
use metrotwin::track::Track;
use metrotwin::twin::lights::{Headlight, LampLight};
use metrotwin::twin::render::gpu::GpuRenderer;
use metrotwin::twin::render::{Job, Renderer};
use nalgebra::Vector3;
use std::time::Instant;

/// Processor time that all threads of this process have used, milliseconds (Linux; 0 elsewhere).
fn processor_ms() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit(')').next().unwrap_or_default();
    let ticks = fields.split_whitespace().skip(11).take(2);
    10.0 * ticks.map(|t| t.parse::<f64>().unwrap()).sum::<f64>()
}

fn cost_ms(renderer: &mut dyn Renderer, jobs: &[Job]) -> f64 {
    let mut times = Vec::new();
    for job in jobs.iter().chain(jobs) {
        let begin = Instant::now();
        renderer.submit(job).unwrap();
        renderer.collect().unwrap();
        times.push(begin.elapsed().as_secs_f64() * 1e3);
    }
    let mut late = times.split_off(jobs.len());
    late.sort_by(f64::total_cmp);
    late[late.len() / 2]
}

/// Wall time and processor time a job.
fn report(name: &str, renderer: &mut dyn Renderer, jobs: &[Job]) {
    cost_ms(renderer, jobs);
    let before = processor_ms();
    let wall_ms = cost_ms(renderer, jobs);
    let used_ms = (processor_ms() - before) / (2 * jobs.len()) as f64;
    println!("{name:30} {wall_ms:8.2} ms, {used_ms:8.2} ms of processors");
}

/// A train's, with its head at `s_m`.
fn headlights(track: &Track, s_m: f64) -> Vec<Headlight> {
    let light = |l_m: f64| Headlight {
        world_from_light: sample::on_bed(track, s_m, l_m, 1.5),
        intensity_cd: 40_000.0,
        exponent: 56.0,
    };
    vec![light(0.9), light(-0.9)]
}

/// Pairs a second by size of the images, lamps in view and exposure.
fn table() {
    println!("\npairs a second       lamps in view   30 us   500 us   2000 us");
    for (lamps, what) in [(0, "none"), (1, "as shipped"), (3, "three times")] {
        let mut scene = sample::scene();
        let track = scene.tracks[0].clone();
        let shipped = std::mem::take(&mut scene.lamps);
        for k in 0..lamps {
            let aside_m = 3.0 * f64::from(k);
            scene.lamps.extend(shipped.iter().map(|lamp| LampLight {
                centre: lamp.centre
                    + Vector3::new(aside_m * 0.3f64.cos(), aside_m * 0.3f64.sin(), 0.0),
                ..lamp.clone()
            }));
        }
        let mut renderer = GpuRenderer::new(scene).unwrap();
        for (width_px, height_px) in [(640, 360), (1280, 720), (1920, 1080)] {
            print!("{width_px:5} x {height_px:4}   {what:>18}");
            for exposure_s in [30e-6, 500e-6, 2e-3] {
                let jobs: Vec<_> = (0..10)
                    .map(|k| {
                        sized(
                            &track,
                            100.0 + f64::from(k),
                            (width_px, height_px),
                            exposure_s,
                        )
                    })
                    .collect();
                cost_ms(&mut renderer, &jobs[..1]);
                print!("{:9.1}", 1e3 / cost_ms(&mut renderer, &jobs));
            }
            println!();
        }
    }
}

/// A pair of the sample rig at 60 km/h with images of another size and exposure; the same field of
/// view and time from first row to last.
fn sized(track: &Track, s_m: f64, (width_px, height_px): (u32, u32), exposure_s: f64) -> Job {
    let mut job = sample::stereo_job(track, s_m, 60.0 / 3.6);
    for view in &mut job.views {
        let (lens, shutter) = (&mut view.camera.intrinsics, &mut view.camera.shutter);
        let scale = f64::from(width_px) / f64::from(lens.width_px);
        *lens = Intrinsics::centred(width_px, height_px, scale * lens.fx_px);
        shutter.line_time_s /= scale;
        shutter.exposure_s = exposure_s;
    }
    job
}

fn main() {
    let scene = sample::scene();
    let track = scene.tracks[0].clone();
    let mut renderer = GpuRenderer::new(scene).unwrap();
    let stereo: Vec<_> = (0..20)
        .map(|k| sample::stereo_job(&track, 100.0 + f64::from(k), 60.0 / 3.6))
        .collect();
    println!("{:?}", renderer.backend());
    report("stereo", &mut renderer, &stereo);
    let lit: Vec<_> = (stereo.iter().zip(0..))
        .map(|(job, k)| Job {
            headlights: headlights(&track, 100.5 + f64::from(k)),
            ..job.clone()
        })
        .collect();
    report("stereo, by headlights", &mut renderer, &lit);
    let wayside: Vec<_> = (0..20)
        .map(|_| sample::wayside_job(&track, 100.0))
        .collect();
    report("wayside", &mut renderer, &wayside);
    table();
}
