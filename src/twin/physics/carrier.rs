//! What carries a rig on a bench: it stands where it is put, as a train's vehicle frame would on rails
//! without irregularity.

use super::{TrainState, World};
use crate::bus::TrainId;
use crate::track::network::Route;
use crate::track::{Direction, Place, Track};
use std::sync::Arc;

/// A carrier at its place.
#[derive(Clone)]
pub(super) struct Carrier {
    pub state: TrainState,
    /// The whole of the tunnel's first track.
    pub route: Route,
    pub track: Arc<Track>,
}

impl World {
    /// Puts the carrier of a rig at a chainage of the first track, in a world without trains. It has the number
    /// of the first train.
    pub fn place_carrier(&mut self, head_m: f64) {
        let network = &self.tunnel.network;
        let first = Place::on_first_track(0.0);
        let Some(way) = network.itinerary((first, Direction::Up), &[], None, 0.0) else {
            return;
        };
        let track = network.along(&way.route);
        let state = TrainState {
            chainage_m: head_m,
            run_m: head_m,
            world_from_vehicle: track.alignment.at(head_m).world_from_rails(),
            standing: true,
            ..TrainState::default()
        };
        self.carrier = Some(Carrier {
            state,
            route: way.route,
            track,
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
        let state = self.carrier(id)?.state.clone();
        Some(TrainState {
            time: self.time,
            ..state
        })
    }
}
