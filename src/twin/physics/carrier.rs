//! What carries a rig on a bench: it stands where it is put, as a train's vehicle frame would on rails
//! without irregularity.

use super::{TrainState, World};
use crate::bus::TrainId;
use nalgebra::Isometry3;

/// A carrier at rest. It has the number of the first train.
#[derive(Clone, Copy, Debug)]
pub(super) struct Carrier {
    pub head_m: f64,
    pub world_from_vehicle: Isometry3<f64>,
}

impl World {
    /// Puts the carrier of a rig at a chainage, in a world without trains.
    pub fn place_carrier(&mut self, head_m: f64) {
        self.carrier = Some(Carrier {
            head_m,
            world_from_vehicle: self.tunnel.alignment.at(head_m).world_from_rails(),
        });
    }

    /// The carrier, asked for as a train.
    pub(super) fn carrier(&self, id: TrainId) -> Option<&Carrier> {
        let first = id == TrainId::default();
        self.carrier
            .as_ref()
            .filter(|_| first && self.trains.is_empty())
    }

    /// The carrier as a train that stands.
    pub(super) fn carrier_state(&self, id: TrainId) -> Option<TrainState> {
        let carrier = self.carrier(id)?;
        Some(TrainState {
            time: self.time,
            chainage_m: carrier.head_m,
            world_from_vehicle: carrier.world_from_vehicle,
            standing: true,
            ..TrainState::default()
        })
    }
}
