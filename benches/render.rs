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

use metrotwin::twin::render::gpu::GpuRenderer;
use metrotwin::twin::render::{Job, Renderer, sample};
use std::time::Instant;

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

fn main() {
    let scene = sample::scene();
    let tunnel = scene.tunnel.clone();
    let mut renderer = GpuRenderer::new(scene).unwrap();
    let stereo: Vec<_> = (0..20)
        .map(|k| sample::stereo_job(&tunnel, 100.0 + f64::from(k), 60.0 / 3.6))
        .collect();
    println!("stereo {:.2} ms", cost_ms(&mut renderer, &stereo));
    let wayside: Vec<_> = (0..20)
        .map(|_| sample::wayside_job(&tunnel, 100.0))
        .collect();
    println!("wayside {:.2} ms", cost_ms(&mut renderer, &wayside));
}
