//! Rigid bodies: the train on its springs, obstacles, workers.

mod irregularity;
mod obstacle;
mod settings;
mod worker;

pub use irregularity::{IrregularityClass, IrregularitySettings};
pub use obstacle::{ObstacleSettings, ObstacleShape};
pub(crate) use settings::within;
pub use settings::{PhysicsSettings, TrackSettings, TrainSettings, VehicleSet};
pub use worker::{Waypoint, WorkerSettings};

use crate::bus::{SimTime, TrainCommand};
use crate::track::{Problem, Tunnel};
use crate::twin::render::{Body, Headlight};
use nalgebra::{Isometry3, Vector3};
use std::sync::Arc;

/// Why the world could not be made, or could not go on.
#[derive(Debug, thiserror::Error)]
pub enum PhysicsError {
    /// Settings that no world can be made from.
    #[error("the physics settings are wrong: {}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    Settings(Vec<Problem>),
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
#[derive(Clone, Debug, PartialEq)]
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
    /// Vertical travel of the leading car's front secondary suspension from its place at rest,
    /// positive where it is compressed.
    pub secondary_travel_m: f64,
    /// The train stands.
    pub standing: bool,
    /// Traction in effect, as acceleration.
    pub traction_mps2: f64,
    /// Brake in effect, as deceleration.
    pub brake_mps2: f64,
}

/// The first hit of the train on an obstacle.
#[derive(Clone, Debug, PartialEq)]
pub struct Collision {
    /// When.
    pub time: SimTime,
    /// Name of the obstacle.
    pub obstacle: String,
    /// Speed of the train relative to the obstacle just before.
    pub speed_mps: f64,
    /// Momentum that the obstacle took.
    pub momentum_n_s: f64,
    /// Kinetic energy of the obstacle relative to the train just before.
    pub energy_j: f64,
}

/// One obstacle as it really is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObstacleTruth<'a> {
    /// Name.
    pub name: &'a str,
    /// Length, width and height of its own box.
    pub size_m: Vector3<f64>,
    /// Chainage of its centre.
    pub chainage_m: f64,
    /// Pose of its centre.
    pub world_from_body: Isometry3<f64>,
    /// It lies still.
    pub resting: bool,
}

/// Everything that moves.
pub struct World {
    tunnel: Arc<Tunnel>,
    time: SimTime,
}

impl World {
    /// A world at time zero. Everything random in it depends on `seed` and run `index` only.
    pub fn new(
        tunnel: Arc<Tunnel>,
        settings: &PhysicsSettings,
        seed: u64,
        index: u64,
    ) -> Result<Self, PhysicsError> {
        let _ = (seed, index);
        let mut problems = Vec::new();
        settings.check("physics", &mut problems);
        if !problems.is_empty() {
            return Err(PhysicsError::Settings(problems));
        }
        Ok(Self {
            tunnel,
            time: SimTime::ZERO,
        })
    }

    /// One step on.
    pub fn step(&mut self, _command: &TrainCommand) -> Result<(), PhysicsError> {
        Ok(())
    }

    /// Now.
    pub fn time(&self) -> SimTime {
        self.time
    }

    /// The line it stands on.
    pub fn tunnel(&self) -> &Tunnel {
        &self.tunnel
    }

    /// Length of a step.
    pub fn step_s(&self) -> f64 {
        0.001
    }

    /// The train now; `None` where there is none.
    pub fn train(&self) -> Option<TrainState> {
        None
    }

    /// Pose of the vehicle frame at a time of the recent past; `None` without a train, after now,
    /// or before what is kept.
    pub fn vehicle_at(&self, _time: SimTime) -> Option<Isometry3<f64>> {
        None
    }

    /// Half extents of a car body's box; `None` without a train.
    pub fn car_half_extents_m(&self) -> Option<Vector3<f64>> {
        None
    }

    /// Obstacles and workers that are there now, to draw.
    pub fn bodies(&self) -> Vec<Body> {
        Vec::new()
    }

    /// The train as boxes with the lenses of its headlights, for cameras that stand outside.
    pub fn train_bodies(&self) -> Vec<Body> {
        Vec::new()
    }

    /// The train's headlights.
    pub fn headlights(&self) -> Vec<Headlight> {
        Vec::new()
    }

    /// Obstacles that are there now.
    pub fn obstacles(&self) -> impl Iterator<Item = ObstacleTruth<'_>> {
        std::iter::empty()
    }

    /// The first hit of the train on an obstacle.
    pub fn collision(&self) -> Option<&Collision> {
        None
    }
}
