//! What a wayside device says of the stretch that it watches.

use super::{DangerLevel, SimTime};
use crate::track::{Stretch, TrackId};
use serde::{Deserialize, Serialize};

/// "There is, or is no longer, an obstacle here", or "I cannot see whether there is one".
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObstacleWarning {
    /// Name of the device.
    pub device: String,
    /// Counts up with every message of the device.
    pub number: u32,
    /// When the device issued it.
    pub issued: SimTime,
    /// `None` clears the device's earlier warnings.
    pub danger: DangerLevel,
    /// The track that it is on.
    pub track: TrackId,
    /// Lower chainage of the obstacle.
    pub from_chainage_m: f64,
    /// Higher chainage of the obstacle.
    pub to_chainage_m: f64,
    /// Nothing was found: the device is blind, and this is the stretch that it cannot vouch for.
    pub blind: bool,
}

impl ObstacleWarning {
    /// Where the obstacle is.
    pub fn stretch(&self) -> Stretch {
        Stretch {
            track: self.track,
            from_m: self.from_chainage_m,
            to_m: self.to_chainage_m,
        }
    }
}
