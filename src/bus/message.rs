//! Messages from a wayside device to a train.

use super::{DangerLevel, SimTime};
use serde::{Deserialize, Serialize};

/// The way a message came.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Via {
    /// Stored in a balise, read as the train passes over it.
    Balise,
    /// From a base station by radio.
    Radio,
}

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
    /// Chainage of the obstacle's near and far end as a train running up the line meets them.
    pub from_chainage_m: f64,
    /// The far end.
    pub to_chainage_m: f64,
    /// Nothing was found: the device is blind, and this is the stretch that it cannot vouch for.
    pub blind: bool,
}

/// A message as a train gets it.
#[derive(Clone, Debug, PartialEq)]
pub struct Delivery {
    /// When it was received.
    pub received: SimTime,
    /// By which way.
    pub via: Via,
    /// What was said.
    pub warning: ObstacleWarning,
}
