//! Fixes of a satellite receiver.

use super::SimTime;
use crate::track::geodesy::Geodetic;
use nalgebra::Matrix2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a fix rests on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GnssSolution {
    /// Code ranges alone.
    #[default]
    Single,
    /// Code ranges with corrections of a reference station.
    Differential,
}

/// Where a receiver says that its antenna is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GnssFix {
    /// When it was valid, by the satellites' time.
    pub time: SimTime,
    /// The antenna.
    pub place: Geodetic,
    /// As the receiver states it, of east and north, square metres.
    pub covariance_m2: Matrix2<f64>,
    /// What it rests on.
    pub solution: GnssSolution,
    /// Satellites used.
    pub satellites: u8,
}
