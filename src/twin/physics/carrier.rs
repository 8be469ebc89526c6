//! What carries a rig on a bench: it stands where it is put, as a train's vehicle frame would on rails
//! without irregularity.

use super::{TrainState, World};
use crate::bus::TrainId;

impl World {
    /// Puts the carrier of a rig at a chainage, in a world without trains. It has the number of the
    /// first train.
    pub fn place_carrier(&mut self, head_m: f64) {
        self.carrier = Some(TrainState {
            chainage_m: head_m,
            world_from_vehicle: self.tunnel.alignment.at(head_m).world_from_rails(),
            standing: true,
            ..TrainState::default()
        });
    }

    /// The carrier, asked for as a train.
    pub(super) fn carrier(&self, id: TrainId) -> Option<&TrainState> {
        let first = id == TrainId::default();
        self.carrier
            .as_ref()
            .filter(|_| first && self.trains.is_empty())
    }

    /// The carrier as a train that stands.
    pub(super) fn carrier_state(&self, id: TrainId) -> Option<TrainState> {
        let carrier = self.carrier(id)?.clone();
        Some(TrainState {
            time: self.time,
            ..carrier
        })
    }
}
