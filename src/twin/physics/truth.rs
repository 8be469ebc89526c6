//! What sessions ask of the world to score by.

use super::World;
use crate::bus::SimTime;
use nalgebra::Isometry3;

/// One worker as he really is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkerTruth<'a> {
    /// Name.
    pub name: &'a str,
    /// Height of the body.
    pub stature_m: f64,
    /// Where he is along the line.
    pub chainage_m: f64,
    /// Left of the centreline.
    pub lateral_m: f64,
}

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

    /// Workers who are on the line now.
    pub fn workers(&self) -> impl Iterator<Item = WorkerTruth<'_>> {
        let now_s = self.time.secs();
        self.settings.workers.iter().filter_map(move |worker| {
            let (chainage_m, lateral_m) = worker.place_m(now_s)?;
            Some(WorkerTruth {
                name: &worker.name,
                stature_m: worker.stature_m,
                chainage_m,
                lateral_m,
            })
        })
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
