//! Rigid bodies: the train on its springs and the uneven track, obstacles, workers. The only place
//! that knows rapier.
//!
//! Car bodies, bogies and wheelsets are rigid bodies with six degrees of freedom each. Primary and
//! secondary suspension, couplers, traction, brakes, resistance and the forces of the rails are put
//! on them in every step; the rails lie as designed, with cant, and with a random irregularity of
//! one of the published spectra, and they give. Obstacles fall, bounce, roll and rest by rapier's
//! contacts, panels come off the wall, cables sag, workers walk; a train that hits one of them
//! exchanges momentum with it, and [`Impact`] says what that costs.
//!
//! ```
//! use metrotwin::bus::TrainCommand;
//! use metrotwin::track::TunnelFile;
//! use metrotwin::twin::physics::{PhysicsSettings, World};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let tunnel = std::sync::Arc::new(metrotwin::track::Tunnel::from_toml(include_str!("../../../tunnels/test_bench.toml"))?);
//! let mut world = World::new(tunnel, &PhysicsSettings::default(), 1, 0)?;
//! let go = TrainCommand { permitted_speed_mps: 20.0, ..TrainCommand::default() };
//! for _ in 0..5000 {
//!     world.step(&go)?;
//! }
//! assert!(world.train().is_some_and(|t| t.speed_mps > 0.5));
//! # Ok(()) }
//! ```
//!
//! | | |
//! |---|---|
//! | track | `irregularity` and `defect` (where the rails lie), `adhesion` (how slippery they are), `line` (all of it, as a wheelset asks) |
//! | train | `vehicle_file` and `vehicle` (figures of a car), `placement`, `consist` (its bodies, a step of them), `suspension`, `wheelset` (rails, creep, brakes), `driver`, `energy`, `history`, `train` |
//! | things | `obstacle`, `shape`, `thing`, `cable`, `cable_settings` and `catenary`, `worker` and `walker`, `ground`, `groups`, `impact`, `owner`, `things` |
//! | world | `settings`, `truth` (what a session asks), `saved` (a copy goes on exactly), `validation` (against theory and published figures) |
//!
//! Vehicles are files; Manchester benchmark vehicle 1 (Iwnicki 1998) and a metro car of class B1
//! come with the program. All bodies and their integration are rapier's: forces are put on them by
//! hand, and the step moves positions with the new velocities (symplectic Euler, one solver
//! iteration), so that springs gain no energy. A train runs in for five seconds before its start,
//! so that it begins leaning in its curve and shaken by its track.
//!
//! Not modelled: real wheel profiles (treads are cones), the contact's own stiffness (the rail gives
//! more), the run of a derailed train (a run ends there), flexible car bodies, air springs, pressure
//! waves, ringing of the track. Motors turn with their wheelset, gear ratio and all. Trains run up the
//! line only. A thing that slides fast may stumble at a seam of the ground, every 2 m.

mod adhesion;
mod cable;
mod cable_settings;
mod catenary;
mod consist;
mod convert;
mod defect;
mod driver;
mod energy;
mod ground;
mod groups;
mod history;
mod impact;
mod irregularity;
mod line;
mod obstacle;
mod owner;
mod placement;
mod saved;
mod settings;
mod shape;
mod stability;
mod suspension;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
mod thing;
mod things;
#[cfg(test)]
mod things_tests;
mod train;
mod truth;
#[cfg(test)]
mod validation;
mod vehicle;
mod vehicle_file;
mod walker;
mod wheelset;
mod worker;

pub use adhesion::{RailState, RailZone};
pub use cable_settings::{CableEnd, CableSettings};
pub use defect::{DefectSettings, DefectShape, Side};
pub use energy::EnergyBook;
pub use history::VehicleMotion;
pub use impact::{Damage, DamageBounds, Impact};
pub use irregularity::{IrregularityClass, IrregularitySettings};
pub use obstacle::{HingeEdge, HingeSettings, ObstacleSettings};
pub use shape::ObstacleShape;

pub use settings::{PhysicsSettings, STEP_S, TrackSettings, TrainSettings};
pub use truth::{Belonging, BodyOwner, ObstacleTruth, WorkerTruth};
pub use vehicle_file::{
    BodyFile, BogieFile, CouplerFile, PrimaryFile, SecondaryFile, VehicleFile, WheelsetFile,
};
pub use wheelset::{WheelExtremes, WheelForces};
pub use worker::{Waypoint, WorkerSettings};

use crate::bus::{BrakeDemand, SimTime, TrainCommand};
use crate::settings::{Problem, Settings};
use crate::track::Tunnel;
use crate::twin::render::{Body, Headlight};
use irregularity::Irregularity;
use line::Line;
use nalgebra::{Isometry3, Vector3};
use owner::Owner;
use rapier3d_f64::math::Vector;
use rapier3d_f64::prelude::PhysicsWorld;
use std::sync::Arc;
use things::Things;
use train::{RUN_IN_S, Train};

/// Why the world could not be made, or could not go on.
#[derive(Debug, thiserror::Error)]
pub enum PhysicsError {
    /// Settings that no world can be made from.
    #[error("the physics settings are wrong: {}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    Settings(Vec<Problem>),
    /// A wheelset has left the rails.
    #[error("{body} left the rails at {time}")]
    Derailed {
        /// Which wheelset.
        body: String,
        /// When.
        time: SimTime,
    },
    /// A body's state is no longer a number.
    #[error("the state of {body} became non-finite at {time}")]
    NonFinite {
        /// Which body.
        body: String,
        /// When.
        time: SimTime,
    },
}

/// The train as it really is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrainState {
    /// When.
    pub time: SimTime,
    /// Chainage of the train head.
    pub chainage_m: f64,
    /// Speed along the line, positive up the line.
    pub speed_mps: f64,
    /// Acceleration along the line.
    pub accel_mps2: f64,
    /// Pose of the vehicle frame, fixed to the leading car's body.
    pub world_from_vehicle: Isometry3<f64>,
    /// Poses of the centres of all car bodies' boxes, leading car first.
    pub world_from_cars: Vec<Isometry3<f64>>,
    /// Acceleration of the leading car's floor over its first bogie, vehicle axes, without gravity.
    pub floor_accel_mps2: Vector3<f64>,
    /// Vertical travel of the primary suspension of the leading axle from its place at rest,
    /// positive where it is compressed.
    pub primary_travel_m: f64,
    /// And of the secondary suspension over it.
    pub secondary_travel_m: f64,
    /// The train stands.
    pub standing: bool,
    /// Traction in effect, as acceleration.
    pub traction_mps2: f64,
    /// Brake in effect, as deceleration.
    pub brake_mps2: f64,
    /// Every wheelset and its rails, from the front.
    pub wheels: Vec<WheelForces>,
    /// Pull of every coupler, from the front.
    pub couplers_n: Vec<f64>,
}

/// What other trains are told: nothing.
const UNSUPERVISED: TrainCommand = TrainCommand {
    brake: BrakeDemand::None,
    permitted_speed_mps: f64::INFINITY,
};

/// Everything that moves.
pub struct World {
    tunnel: Arc<Tunnel>,
    settings: PhysicsSettings,
    rapier: PhysicsWorld,
    irregularity: Irregularity,
    train: Option<Train>,
    /// Trains that nobody but their drivers drives.
    others: Vec<Train>,
    things: Things,
    time: SimTime,
    step: SimTime,
    step_s: f64,
}

impl World {
    /// A world at time zero. Everything random in it depends on `seed` and run `index` only.
    pub fn new(
        tunnel: Arc<Tunnel>,
        settings: &PhysicsSettings,
        seed: u64,
        index: u64,
    ) -> Result<Self, PhysicsError> {
        let mut problems = Vec::new();
        settings.check("", &mut problems);
        if !problems.is_empty() {
            return Err(PhysicsError::Settings(problems));
        }
        let step = SimTime::from_secs(settings.step_s);
        let step_s = step.secs();
        let mut rapier = PhysicsWorld::new();
        rapier.gravity = Vector::new(0.0, 0.0, -vehicle::GRAVITY_MPS2);
        rapier.integration_parameters.dt = step_s;
        // Substeps would move bodies with forces that belong to the step's start.
        rapier.integration_parameters.num_solver_iterations = 1;
        let irregularity = Irregularity::new(
            &settings.track.irregularity,
            tunnel.alignment.length_m(),
            seed,
            index,
        )
        .with_defects(&settings.track.defects);
        let line = Line::new(&tunnel, &irregularity, &settings.track);
        let history = (settings.history_s / step_s).ceil() as usize + 1;
        let mut train = |train, owner, steps| Train::new(&mut rapier, &line, train, owner, steps);
        let own = settings.train.as_ref();
        let own = own.map(|own| train(own, None, history));
        let others = settings.other_trains.iter().enumerate();
        let others = others.map(|(k, other)| train(other, Some(Owner::Train(k)), 2));
        let others = others.collect();
        let train_mass_kg = own.as_ref().map(|train| train.consist.mass_kg());
        let mut world = Self {
            settings: settings.clone(),
            tunnel,
            rapier,
            irregularity,
            train: own,
            others,
            things: Things::default(),
            time: SimTime::ZERO,
            step,
            step_s,
        };
        world.run_in()?;
        let run = [seed, index];
        world.things = Things::new(
            &mut world.rapier,
            &world.tunnel,
            settings,
            run,
            train_mass_kg,
        );
        Ok(world)
    }

    /// Brings the trains to the state in which they run, or stand, at their start: leaning in a
    /// curve, shaken by the track.
    fn run_in(&mut self) -> Result<(), PhysicsError> {
        for _ in 0..(RUN_IN_S / self.step_s).round() as usize {
            let line = Line::new(&self.tunnel, &self.irregularity, &self.settings.track);
            for train in self.train.iter_mut().chain(&mut self.others) {
                train.run_in(&mut self.rapier, &self.tunnel, &line, self.step_s);
            }
            self.rapier.step();
            for train in self.train.iter_mut().chain(&mut self.others) {
                train.consist.read(&self.rapier, self.time)?;
            }
        }
        for train in self.train.iter_mut().chain(&mut self.others) {
            train.begin();
        }
        Ok(())
    }

    /// One step on.
    pub fn step(&mut self, command: &TrainCommand) -> Result<(), PhysicsError> {
        let (rapier, tunnel) = (&mut self.rapier, &self.tunnel);
        let line = Line::new(tunnel, &self.irregularity, &self.settings.track);
        let now = (self.time, self.step_s);
        if let Some(train) = &mut self.train {
            train.drive(rapier, tunnel, &line, command, now);
        }
        for other in &mut self.others {
            other.drive(rapier, tunnel, &line, &UNSUPERVISED, now);
        }
        self.go()
    }

    /// A step of everything under the forces that act, and what comes of it.
    fn go(&mut self) -> Result<(), PhysicsError> {
        self.things.before_step(&self.rapier);
        self.time = SimTime::from_nanos(self.time.nanos() + self.step.nanos());
        // What lies or is not there needs no search for what it flies through.
        let substeps = usize::from(self.things.moving());
        self.rapier.integration_parameters.max_ccd_substeps = substeps;
        self.rapier.step();
        for train in self.train.iter_mut().chain(&mut self.others) {
            train.read(&self.rapier, self.time)?;
        }
        self.things
            .after_step(&mut self.rapier, &self.tunnel, self.time)
    }

    /// Now.
    pub fn time(&self) -> SimTime {
        self.time
    }

    /// The train now; `None` where there is none.
    pub fn train(&self) -> Option<TrainState> {
        self.train.as_ref()?.state(&self.tunnel, self.step_s)
    }

    /// Pose of the vehicle frame at a time of the recent past; `None` without a train, after now,
    /// or before what is kept.
    pub fn vehicle_at(&self, time: SimTime) -> Option<Isometry3<f64>> {
        self.train.as_ref()?.history.at(time)
    }

    /// Motion of the vehicle frame now; `None` without a train.
    pub fn vehicle_motion(&self) -> Option<&VehicleMotion> {
        self.train.as_ref()?.motion()
    }

    /// Distance that the treads of an axle, counted from 0 at the head, have rolled off since the
    /// start, slip and slide included; `None` without a train or such an axle.
    pub fn wheel_run_m(&self, axle: usize) -> Option<f64> {
        Some(self.train.as_ref()?.consist.wheelsets.get(axle)?.rolled_m)
    }

    /// The train's energy since the start; `None` without a train.
    pub fn energy(&self) -> Option<EnergyBook> {
        Some(self.train.as_ref()?.consist.book())
    }

    /// Half extents of a car body's box; `None` without a train.
    pub fn car_half_extents_m(&self) -> Option<Vector3<f64>> {
        Some(self.train.as_ref()?.consist.half_extents_m())
    }

    /// Obstacles, cables, workers and other trains that are there now, to draw.
    pub fn bodies(&self) -> Vec<Body> {
        self.owned_bodies(false).0
    }

    /// The train as boxes with the lenses of its headlights, for cameras that stand outside.
    pub fn train_bodies(&self) -> Vec<Body> {
        self.train.as_ref().map_or_else(Vec::new, Train::bodies)
    }

    /// The headlights of all trains.
    pub fn headlights(&self) -> Vec<Headlight> {
        let trains = self.train.iter().chain(&self.others);
        trains.filter_map(Train::headlights).flatten().collect()
    }

    /// Obstacles that are there now: what lies, falls or swings. What is still fixed to the lining
    /// is none.
    pub fn obstacles(&self) -> impl Iterator<Item = ObstacleTruth<'_>> {
        let line = &self.tunnel.alignment;
        self.things.obstacles(&self.rapier, line, self.time)
    }

    /// Workers who are on the line now.
    pub fn workers(&self) -> impl Iterator<Item = WorkerTruth<'_>> {
        let line = &self.tunnel.alignment;
        self.things.workers(&self.rapier, line, self.time.secs())
    }

    /// Hits of the train on obstacles, cables, workers and other trains, in order of time; the first
    /// thousand.
    pub fn impacts(&self) -> &[Impact] {
        self.things.impacts()
    }
}
