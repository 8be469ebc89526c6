//! What sessions ask of the world to score by.

use super::World;
use crate::bus::SimTime;
use nalgebra::Isometry3;

impl World {
    /// Chainage of the train head now; `None` without a train.
    pub fn head_m(&self) -> Option<f64> {
        self.chainage_of(&self.vehicle_motion()?.world_from_vehicle)
    }

    /// Chainage of the train head at a time of the recent past.
    pub fn chainage_at(&self, time: SimTime) -> Option<f64> {
        self.chainage_of(&self.vehicle_at(time)?)
    }

    /// Length of the train over couplers; `None` without a train.
    pub fn train_length_m(&self) -> Option<f64> {
        Some(self.train.as_ref()?.consist.length_m())
    }

    /// Normal force of a wheel at rest; `None` without a train.
    pub fn wheel_load_n(&self) -> Option<f64> {
        Some(self.train.as_ref()?.consist.vehicle.wheel_load_n())
    }

    fn chainage_of(&self, world_from_vehicle: &Isometry3<f64>) -> Option<f64> {
        let near = self
            .train
            .as_ref()?
            .consist
            .instruments(self.time, &self.tunnel);
        let origin = world_from_vehicle.translation.vector.into();
        let head = self
            .tunnel
            .alignment
            .track_from_world(&origin, near.chainage_m);
        Some(head.s_m)
    }
}
