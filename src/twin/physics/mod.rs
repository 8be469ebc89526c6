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
//!     world.step(&[go])?;
//! }
//! let train = world.train_ids().next().and_then(|id| world.train(id));
//! assert!(train.is_some_and(|t| t.speed_mps > 0.5));
//! # Ok(()) }
//! ```
//!
//! | | |
//! |---|---|
//! | track | `irregularity`, `defect` and `deviation` (where the rails lie), `adhesion` (how slippery they are), `route_track` (all of it, as a wheelset asks) |
//! | train | `vehicle_file` and `vehicle` (figures of a car), `placement`, `consist` (its bodies, a step of them), `suspension`, `wheelset` (rails, creep, brakes), `driver`, `energy`, `history`, `train`; `carrier` in place of one on a bench |
//! | obstacles | `obstacle`, `shape`, `material`, `obstacle_body`, `cable`, `cable_settings` and `catenary`, `worker` and `walker`, `ground`, `groups`, `impact` and `damage`, `entity`, `surroundings` |
//! | world | `settings`, `train_truth` and `truth` (what a session asks), `saved` (a copy goes on exactly), `validation` (against theory and published figures) |
//!
//! Vehicles are files; Manchester benchmark vehicle 1 (Iwnicki 1998) and a metro car of class B1
//! come with the program. All bodies and their integration are rapier's: forces are put on them by
//! hand, and the step moves positions with the new velocities (symplectic Euler, one solver
//! iteration), so that springs gain no energy. A train runs in for five seconds before its start,
//! so that it begins leaning in its curve and shaken by its track.
//!
//! Not modelled: real wheel profiles (treads are cones), the contact's own stiffness (the rail gives
//! more), the run of a derailed train (a run ends there), flexible car bodies, air springs, pressure
//! waves, ringing of the track. Motors turn with their wheelset, gear ratio and all. A train does not
//! turn back. A thing that slides fast may stumble at a seam of the ground, every 2 m.

mod adhesion;
mod cable;
mod cable_settings;
mod carrier;
mod catenary;
mod consist;
mod damage;
mod defect;
mod deviation;
mod driver;
mod energy;
mod entity;
mod error;
mod ground;
mod groups;
mod history;
mod impact;
mod incident;
mod interlocking;
mod irregularity;
mod material;
mod obstacle;
mod obstacle_body;
mod placement;
mod route_track;
mod saved;
mod settings;
mod shape;
mod slide_protection;
mod stability;
mod surroundings;
mod suspension;
mod switches;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
mod train;
mod train_route;
mod train_truth;
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
pub use damage::Damage;
pub use defect::{DefectSettings, DefectShape, RailSide};
pub use energy::EnergyBook;
pub use error::PhysicsError;
pub use history::VehicleMotion;
pub use impact::Impact;
pub use irregularity::{IrregularityClass, IrregularitySettings};
pub use material::ObstacleMaterial;
pub use obstacle::{HingeEdge, HingeSettings, ObstacleSettings};
pub use shape::ObstacleShape;

pub use incident::{Incident, IncidentKind};
pub use settings::{HISTORY_S, PhysicsSettings, STEP_S, TrackSettings, TrainSettings, train_key};
pub use switches::{InterlockingSettings, LegName, SwitchMove, SwitchPosition};
pub use train_route::NoRoute;
pub use train_truth::TrainState;
pub use truth::{BodyLabel, BodyOwner, ObstacleTruth, WorkerTruth};
pub use vehicle_file::{
    BodyFile, BogieFile, CouplerFile, PrimaryFile, SecondaryFile, VehicleFile, WheelsetFile,
};
pub use wheelset::{WheelExtremes, WheelForces};
pub use worker::{Waypoint, WorkerSettings};

use crate::bus::{SimTime, TrainCommand, TrainId};
use crate::settings::Settings;
use crate::track::Tunnel;
use crate::track::network::Network;
use crate::twin::blades::SwitchBlades;
use interlocking::{Interlocking, Verdict};
use rapier3d_f64::math::Vector;
use rapier3d_f64::prelude::PhysicsWorld;
use route_track::{Rails, RouteTrack};
use std::sync::Arc;
use surroundings::Surroundings;
use train::{RUN_IN_S, Train};

/// Everything that moves.
pub struct World {
    tunnel: Arc<Tunnel>,
    rapier: PhysicsWorld,
    /// By number.
    trains: Vec<Train>,
    /// What carries a rig at rest where there is no train.
    carrier: Option<carrier::Carrier>,
    surroundings: Surroundings,
    interlocking: Interlocking,
    /// Of each switch.
    blades: Vec<Option<SwitchBlades>>,
    rails: Arc<Rails>,
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
        let rails = Arc::new(Rails::new(&tunnel.network, &settings.track, [seed, index]));
        let mut world = Self {
            trains: trains(&mut rapier, &tunnel, &rails, settings, step_s)?,
            blades: (tunnel.network.switches.iter())
                .map(|switch| SwitchBlades::of(&tunnel.network, switch))
                .collect(),
            tunnel,
            rapier,
            carrier: None,
            surroundings: Surroundings::default(),
            interlocking: Interlocking::default(),
            rails: rails.clone(),
            time: SimTime::ZERO,
            step,
            step_s,
        };
        world.run_in()?;
        let (network, switches) = (&world.tunnel.network, &settings.interlocking);
        world.interlocking = Interlocking::new(network, switches, &world.trains);
        let (rapier, run) = (&mut world.rapier, [seed, index]);
        world.surroundings =
            Surroundings::new(rapier, &world.tunnel.network, settings, run, &world.trains);
        Ok(world)
    }

    /// Brings the trains to the state in which they run, or stand, at their start: leaning in a
    /// curve, shaken by the track.
    fn run_in(&mut self) -> Result<(), PhysicsError> {
        for _ in 0..(RUN_IN_S / self.step_s).round() as usize {
            for train in &mut self.trains {
                train.run_in(&mut self.rapier, self.step_s);
            }
            self.rapier.step();
            for train in &mut self.trains {
                train.consist.read(&self.rapier, self.time)?;
            }
        }
        for train in &mut self.trains {
            train.begin();
        }
        Ok(())
    }

    /// One step on. Every train has the command of its number; one without is
    /// [`TrainCommand::UNSUPERVISED`].
    pub fn step(&mut self, commands: &[TrainCommand]) -> Result<(), PhysicsError> {
        let commands = commands
            .iter()
            .chain(std::iter::repeat(&TrainCommand::UNSUPERVISED));
        let signals = &self.interlocking.signals_m;
        for ((train, command), signal) in self.trains.iter_mut().zip(commands).zip(signals) {
            train.drive(&mut self.rapier, command, *signal, (self.time, self.step_s));
        }
        self.go()
    }

    /// A step of everything under the forces that act, and what comes of it.
    fn go(&mut self) -> Result<(), PhysicsError> {
        self.surroundings.before_step(&self.rapier);
        self.time = SimTime::from_nanos(self.time.nanos() + self.step.nanos());
        // What lies or is not there needs no search for what it flies through.
        let substeps = usize::from(self.surroundings.moving());
        self.rapier.integration_parameters.max_ccd_substeps = substeps;
        self.rapier.step();
        for train in &mut self.trains {
            train.read(&self.rapier, self.time)?;
        }
        self.pass_switches()?;
        self.surroundings
            .after_step(&mut self.rapier, &self.tunnel.network, self.time)
    }

    /// Trains go where switches lead them.
    fn pass_switches(&mut self) -> Result<(), PhysicsError> {
        let network = &self.tunnel.network;
        let verdicts = (self.interlocking).after_step(network, &self.trains, self.time);
        for (k, verdict) in verdicts {
            let train = &mut self.trains[k];
            match verdict {
                Verdict::Derails => {
                    return Err(PhysicsError::Derailed {
                        train: train.consist.id,
                        body: "the train at a switch".to_owned(),
                        time: self.time,
                    });
                }
                Verdict::Diverted(passing) => {
                    let passing = network.passings(&train.track.route)[passing];
                    if let Some(route) = network.diverted(&train.track.route, &passing) {
                        let limits = network.speed_limits(&route);
                        let track = RouteTrack::new(network, route, self.rails.clone());
                        train.divert(track, limits, passing.toe_m);
                        self.interlocking.rerouted(network, train);
                    }
                }
            }
        }
        Ok(())
    }

    /// What has gone wrong with switches, ends and trains in each other's way, in order of time.
    pub fn incidents(&self) -> &[Incident] {
        &self.interlocking.incidents.list
    }

    /// Share of the way from the through to the diverging leg that the blades of a switch are at, 0 to 1.
    pub fn switch_share(&self, switch: usize) -> f64 {
        self.interlocking.switches.share(switch, self.time)
    }

    /// The tracks.
    pub fn network(&self) -> &Network {
        &self.tunnel.network
    }

    /// Now.
    pub fn time(&self) -> SimTime {
        self.time
    }

    /// All trains, by number.
    pub fn train_ids(&self) -> impl Iterator<Item = TrainId> + use<> {
        (0..self.trains.len()).map(TrainId::from_index)
    }

    fn get(&self, id: TrainId) -> Option<&Train> {
        self.trains.get(id.index())
    }
}

/// Puts the trains on the tracks, each on its route.
fn trains(
    rapier: &mut PhysicsWorld,
    tunnel: &Tunnel,
    rails: &Arc<Rails>,
    settings: &PhysicsSettings,
    step_s: f64,
) -> Result<Vec<Train>, PhysicsError> {
    let history = (settings.history_s / step_s).ceil() as usize + 1;
    let network = &tunnel.network;
    let make = |(k, train): (usize, &TrainSettings)| {
        let way = train.itinerary(network)?;
        let track = RouteTrack::new(network, way.route.clone(), rails.clone());
        let id = TrainId::from_index(k);
        let limits = network.speed_limits(&way.route);
        Ok(Train::new(
            rapier,
            track,
            train,
            (&way, limits),
            id,
            history,
        ))
    };
    settings.trains.iter().enumerate().map(make).collect()
}
