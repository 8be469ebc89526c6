//! What a step of the world costs, by trains, their cars, and things that lie about.
//!
//! ```text
//! cargo bench --bench physics
//! ```
//!
//! Best of five stretches of 2000 steps of 1 ms, one thread, at 60 km/h on uneven track.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::disallowed_methods,
    missing_docs,
    reason = "a benchmark measures time and prints its figures, and may fail by panicking"
)]

use metrotwin::track::Tunnel;
use metrotwin::twin::physics::{ObstacleSettings, PhysicsSettings, TrainSettings, World};
use std::sync::Arc;
use std::time::Instant;

const STEPS: u32 = 2000;

/// Microseconds a step.
fn cost_us(tunnel: &Arc<Tunnel>, trains: u32, cars: u32, obstacles: u32) -> f64 {
    let train = |k: u32| TrainSettings {
        cars,
        start_chainage_m: 700.0 - 200.0 * f64::from(k),
        start_speed_kmh: 60.0,
        ..TrainSettings::default()
    };
    // Out of the train's way, each to itself.
    let lying = (0..obstacles).map(|k| ObstacleSettings {
        name: format!("box {k}"),
        chainage_m: 1500.0 + f64::from(k),
        height_m: 0.0,
        ..ObstacleSettings::default()
    });
    let settings = PhysicsSettings {
        trains: (0..trains).map(train).collect(),
        obstacles: lying.collect(),
        ..PhysicsSettings::default()
    };
    let mut world = World::new(tunnel.clone(), &settings, 1, 0).unwrap();
    let mut stretch = |steps: u32| {
        let begin = Instant::now();
        for _ in 0..steps {
            world.step(&[]).unwrap();
        }
        1e6 * begin.elapsed().as_secs_f64() / f64::from(steps)
    };
    // They fall, and come to rest.
    stretch(4000);
    (0..5).map(|_| stretch(STEPS)).fold(f64::INFINITY, f64::min)
}

fn main() {
    let text = include_str!("../tunnels/chengdu_line1.toml");
    let tunnel = Arc::new(Tunnel::from_toml(text).unwrap());
    let report = |trains, cars, obstacles| {
        let us = cost_us(&tunnel, trains, cars, obstacles);
        let faster = 1000.0 / us;
        println!("{trains:6}  {cars:4}  {obstacles:9}  {us:7.1}  {faster:15.0}");
        us
    };
    println!("trains  cars  obstacles  us/step  times real time");
    report(0, 0, 0);
    for cars in [1, 2, 4, 6, 8] {
        report(1, cars, 0);
    }
    for obstacles in [1, 10, 100, 500] {
        report(0, 0, obstacles);
        report(1, 6, obstacles);
    }
    let ratio = report(2, 6, 0) / report(1, 6, 0);
    println!("two trains of six cars cost {ratio:.2} times as much as one");
}
