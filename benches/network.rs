//! What a network of tracks costs to load and to draw, by its size.
//!
//! ```text
//! cargo bench --bench network
//! ```
//!
//! A unit is a track of 300 m, a loop beside it by two switches, and 300 m behind it: four tracks, in closed tunnels.
//! Units lie beside each other, some so near that a camera may see several, or far apart.

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

use metrotwin::track::Tunnel;
use metrotwin::twin::blades::{SwitchBlades, tracks_without_blades};
use metrotwin::twin::lamps;
use metrotwin::twin::render::constants::SIGHT_M;
use metrotwin::twin::render::gpu::GpuRenderer;
use metrotwin::twin::render::{Job, Renderer, Scene};
use nalgebra::Point3;
use std::fmt::Write;
use std::time::Instant;

const PAIRS: u32 = 100;

/// A tunnel file of so many units, so far apart.
fn network(units: u32, apart_m: u32) -> String {
    let mut text = "name = \"units\"\n".to_owned();
    for k in 0..units {
        let north_m = k * apart_m;
        write!(
            text,
            r#"
            [[switches]]
            name = "A{k}"
            [[switches]]
            name = "B{k}"
            [[track]]
            name = "begin {k}"
            start = {{ north_m = {north_m}.0 }}
            to = "A{k}.toe"
            plan = [{{ kind = "straight", length_m = 300.0 }}]
            sections = [{{ kind = "rectangular", from_m = 0.0, left_m = 7.4 }}]
            lamps = {{ from_m = 10.0, to_m = 190.0, spacing_m = 20.0, first_number = {lamp} }}
            [[track]]
            name = "through {k}"
            from = "A{k}.through"
            to = "B{k}.through"
            plan = [{{ kind = "straight", length_m = 200.0, closes = true }}]
            sections = [{{ kind = "rectangular", from_m = 0.0, left_m = 7.9 }}]
            [[track]]
            name = "loop {k}"
            from = "A{k}.diverging"
            to = "B{k}.diverging"
            plan = [
                {{ kind = "arc", length_m = 22.13, radius_m = 200.0, turn = "left" }},
                {{ kind = "straight", length_m = 23.1 }},
                {{ kind = "arc", length_m = 22.13, radius_m = 200.0, turn = "right" }},
                {{ kind = "straight", length_m = 150.0 }},
                {{ kind = "arc", length_m = 22.13, radius_m = 200.0, turn = "right" }},
                {{ kind = "straight", length_m = 23.1 }},
                {{ kind = "arc", length_m = 22.13, radius_m = 200.0, turn = "left" }},
            ]
            sections = [{{ kind = "shared", from_m = 0.0 }}]
            [[track]]
            name = "end {k}"
            from = "B{k}.toe"
            plan = [{{ kind = "straight", length_m = 300.0 }}]
            sections = [{{ kind = "rectangular", from_m = 0.0, left_m = 7.4 }}]
            "#,
            lamp = 10 * k,
        )
        .unwrap();
    }
    text
}

fn ms(begin: Instant) -> f64 {
    1e3 * begin.elapsed().as_secs_f64()
}

/// Loads and draws a network; prints a line.
fn report(units: u32, apart_m: u32) {
    let text = network(units, apart_m);
    let begin = Instant::now();
    let tunnel = Tunnel::from_toml(&text).unwrap();
    let load_ms = ms(begin);
    let scene = Scene {
        tracks: tracks_without_blades(&tunnel.network),
        lamps: lamps::shining(&tunnel, &[], 1),
        ..sample::scene()
    };
    let begin = Instant::now();
    let mut renderer = GpuRenderer::new(scene).unwrap();
    let scene_ms = ms(begin);
    let track = tunnel.first_track();
    let switches = tunnel.network.switches.iter();
    let blades = switches.filter_map(|switch| SwitchBlades::of(&tunnel.network, switch));
    let blades: Vec<_> = blades.collect();
    let job = |k: u32| {
        let s_m = 150.0 + f64::from(k % 40);
        let mut job = sample::stereo_job(track, s_m, 60.0 / 3.6);
        let eye = Point3::from(job.views[0].motion.poses[0].translation.vector);
        let near = |blades: &&SwitchBlades| (blades.tip - eye).norm() < SIGHT_M;
        let blades = blades.iter().filter(near);
        job.bodies = blades.flat_map(|blades| blades.bodies(0.0)).collect();
        job
    };
    let mut pair_ms = |job: Job| {
        let begin = Instant::now();
        renderer.submit(&job).unwrap();
        renderer.collect().unwrap();
        ms(begin)
    };
    // Meshes are made at first sight.
    for k in 0..PAIRS {
        pair_ms(job(k));
    }
    let mut times: Vec<f64> = (0..PAIRS).map(|k| pair_ms(job(k))).collect();
    times.sort_by(f64::total_cmp);
    let (tracks, median_ms) = (tunnel.network.tracks.len(), times[times.len() / 2]);
    println!("{tracks:6}  {apart_m:7}  {load_ms:7.1}  {scene_ms:8.1}  {median_ms:7.2}");
}

fn main() {
    println!("tracks  apart m  load ms  scene ms  ms a pair");
    for (units, apart_m) in [(1, 60), (3, 60), (50, 60), (3, 2000), (50, 2000)] {
        report(units, apart_m);
    }
}
