//! A copy of a world goes on exactly as the world itself: to save it is to clone it, and to go back
//! is to take the clone.
//!
//! ```
//! # use metrotwin::bus::{TrainCommand, TrainId};
//! # use metrotwin::track::Tunnel;
//! # use metrotwin::twin::physics::{PhysicsSettings, World};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let tunnel = std::sync::Arc::new(Tunnel::from_toml(include_str!("../../../tunnels/test_bench.toml"))?);
//! let mut world = World::new(tunnel, &PhysicsSettings::default(), 1, 0)?;
//! let saved = world.clone();
//! world.step(&[TrainCommand::default()])?;
//! let mut again = saved.clone();
//! again.step(&[TrainCommand::default()])?;
//! assert_eq!(again.train(TrainId(0)), world.train(TrainId(0)));
//! # Ok(()) }
//! ```

use super::World;
use rapier3d_f64::prelude::PhysicsWorld;

impl Clone for World {
    fn clone(&self) -> Self {
        Self {
            tunnel: self.tunnel.clone(),
            rapier: copy(&self.rapier),
            trains: self.trains.clone(),
            carrier: self.carrier.clone(),
            surroundings: self.surroundings.clone(),
            interlocking: self.interlocking.clone(),
            blades: self.blades.clone(),
            rails: self.rails.clone(),
            time: self.time,
            step: self.step,
            step_s: self.step_s,
        }
    }
}

/// All of rapier's state; its pipelines and the solver for fast bodies are workspace.
fn copy(world: &PhysicsWorld) -> PhysicsWorld {
    PhysicsWorld {
        gravity: world.gravity,
        integration_parameters: world.integration_parameters,
        islands: world.islands.clone(),
        broad_phase: world.broad_phase.clone(),
        narrow_phase: world.narrow_phase.clone(),
        bodies: world.bodies.clone(),
        colliders: world.colliders.clone(),
        impulse_joints: world.impulse_joints.clone(),
        multibody_joints: world.multibody_joints.clone(),
        soft_bodies: world.soft_bodies.clone(),
        ..PhysicsWorld::default()
    }
}
