//! Trains by number.

use crate::track::Direction;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Number of a train in a scenario, from 0. Train 0 is the one of the scenario's `[train]` table,
/// train `k` the `k`-th of `[[other_trains]]`.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    JsonSchema,
)]
pub struct TrainId(pub u8);

impl TrainId {
    /// Most trains that a scenario may have.
    pub const MOST: usize = 8;

    /// From a position in a list of trains.
    pub fn from_index(index: usize) -> Self {
        Self(u8::try_from(index).unwrap_or(u8::MAX))
    }

    /// Position in a list of all trains.
    pub fn index(self) -> usize {
        usize::from(self.0)
    }
}

/// The end of a train at which something is mounted. Either has a cab with a vehicle frame of its
/// own: its origin at the end of the train on top of rail, its x axis out of the train. So what is in
/// the rear cab looks back along the line, and runs backwards.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TrainEnd {
    /// The end that leads.
    #[default]
    Front,
    /// The end that follows.
    Rear,
}

impl TrainEnd {
    /// Which way along the track the cab of this end looks, on a train that runs in a direction.
    pub fn looks(self, running: Direction) -> Direction {
        match self {
            Self::Front => running,
            Self::Rear => running.reversed(),
        }
    }

    /// 1 where x points in the running direction, -1 where it points back.
    pub fn sign(self) -> f64 {
        match self {
            Self::Front => 1.0,
            Self::Rear => -1.0,
        }
    }
}

impl fmt::Display for TrainId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "train {}", self.0)
    }
}
