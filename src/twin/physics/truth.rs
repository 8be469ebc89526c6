//! What sessions ask of the world to score by.

use super::{WheelExtremes, World};
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

    /// Chainage of the head and length of every other train.
    pub fn other_trains_m(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.others.iter().filter_map(|train| {
            let pose = train.motion()?.world_from_vehicle;
            let head_m = train.chainage_m(&self.tunnel, &pose);
            Some((head_m, train.consist.length_m()))
        })
    }

    /// What the worst of the train's wheels has been through; `None` without a train.
    pub fn wheel_extremes(&self) -> Option<WheelExtremes> {
        let wheelsets = self.train.as_ref()?.consist.wheelsets.iter();
        wheelsets.map(|w| w.extremes).reduce(WheelExtremes::and)
    }

    /// Normal force of a wheel at rest; `None` without a train.
    pub fn wheel_load_n(&self) -> Option<f64> {
        Some(self.train.as_ref()?.consist.vehicle.wheel_load_n())
    }

    fn chainage_of(&self, world_from_vehicle: &Isometry3<f64>) -> Option<f64> {
        let train = self.train.as_ref()?;
        Some(train.chainage_m(&self.tunnel, world_from_vehicle))
    }
}
