//! What a step of the world costs, by cars of the train and by things that lie about.
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
    reason = "a benchmark measures how long the machine takes, prints it, and may fail by panicking"
)]

use metrotwin::bus::TrainCommand;
use metrotwin::track::Tunnel;
use metrotwin::twin::physics::{ObstacleSettings, PhysicsSettings, TrainSettings, World};
use std::sync::Arc;
use std::time::Instant;

const STEPS: u32 = 2000;

/// Microseconds a step.
fn cost_us(tunnel: &Arc<Tunnel>, cars: u32, obstacles: u32) -> f64 {
    let train = TrainSettings {
        cars,
        start_chainage_m: 700.0,
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
        train: (cars > 0).then_some(train),
        obstacles: lying.collect(),
        ..PhysicsSettings::default()
    };
    let mut world = World::new(tunnel.clone(), &settings, 1, 0).unwrap();
    let command = TrainCommand {
        permitted_speed_mps: 60.0,
        ..TrainCommand::default()
    };
    let mut stretch = |steps: u32| {
        let begin = Instant::now();
        for _ in 0..steps {
            world.step(&command).unwrap();
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
    let report = |cars, obstacles| {
        let us = cost_us(&tunnel, cars, obstacles);
        println!("{cars:4}  {obstacles:9}  {us:7.1}  {:15.0}", 1000.0 / us);
    };
    if std::env::args().any(|a| a == "--six") {
        report(6, 0);
        return;
    }
    println!("cars  obstacles  us/step  times real time");
    for cars in [0, 1, 2, 4, 6, 8] {
        report(cars, 0);
    }
    for obstacles in [1, 10, 100, 500] {
        report(0, obstacles);
        report(6, obstacles);
    }
}
