//! The train against theory that shares no code with it, and against published figures.
//!
//! `model` builds a linear car from the numbers of a vehicle file, by energy and geometry; `modes`,
//! `ride` and `curve` hold the simulated car against it. `running` integrates the train's equation
//! of motion, and `numerics` asks what the step does.

#![allow(
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "tests may panic, and say what they measured"
)]

mod curve;
mod model;
mod modes;
mod numerics;
mod ride;
mod running;

use super::consist::Consist;
use super::driver::Effort;
use super::testing::{TRAIN, line};
use super::*;
use crate::bus::BrakeDemand;
use crate::track::{Alignment, Grade, PlanElement};
use nalgebra::Point3;

/// A train that nothing resists, of one car.
fn free_car(file: VehicleFile, speed_kmh: f64) -> TrainSettings {
    TrainSettings {
        vehicle: file.name.clone(),
        vehicle_file: Some(file),
        cars: 1,
        start_chainage_m: 200.0,
        start_speed_kmh: speed_kmh,
        cruise_speed_kmh: speed_kmh,
        davis_a_mps2: 0.0,
        davis_c_per_m: 0.0,
        ..TrainSettings::default()
    }
}

fn shipped(name: &str) -> VehicleFile {
    VehicleFile::shipped(name).unwrap().clone()
}

fn straight(length_m: f64) -> Arc<Tunnel> {
    line(&[PlanElement::straight(length_m)], 0.0)
}

/// A train on track of one class.
fn on_track(train: TrainSettings, class: IrregularityClass) -> PhysicsSettings {
    PhysicsSettings {
        track: TrackSettings {
            irregularity: IrregularitySettings {
                class,
                ..IrregularitySettings::default()
            },
            ..TrackSettings::default()
        },
        trains: vec![train],
        ..PhysicsSettings::default()
    }
}

fn command(brake: BrakeDemand, kmh: f64) -> TrainCommand {
    TrainCommand {
        brake,
        permitted_speed_mps: kmh / 3.6,
    }
}

/// Nothing limits the driver.
fn go() -> TrainCommand {
    command(BrakeDemand::None, 200.0)
}

fn run(world: &mut World, seconds: f64, command: &TrainCommand) {
    for _ in 0..(seconds / world.step_s).round() as usize {
        world.step(&[*command]).unwrap();
    }
}

/// A step with an effort of ours in place of the driver's, held at a speed or free.
fn step_with(world: &mut World, effort: Effort, held_mps: Option<f64>) {
    let (train, dt_s) = (&mut world.trains[0], world.step_s);
    let consist = &mut train.consist;
    consist.apply_forces(&mut world.rapier, &train.track, effort, dt_s);
    if let Some(speed_mps) = held_mps {
        consist.hold_speed(&mut world.rapier, speed_mps, dt_s);
    }
    world.go().unwrap();
}

/// A step without traction and brake.
fn coast(world: &mut World) {
    step_with(world, Effort::default(), None);
}

fn consist(world: &World) -> &Consist {
    &world.trains[0].consist
}

fn rms(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt()
}
