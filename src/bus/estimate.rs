//! Where a train takes itself to be.

use super::{Method, SimTime};
use crate::track::{Direction, TrackId};
use serde::{Deserialize, Serialize};

/// What a position rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PositionSource {
    /// The driver's setting before departure.
    Setting,
    /// A lamp, by a method.
    Lamp(Method),
    /// A balise.
    Balise,
    /// The odometer, since the last of the others.
    Odometer,
}

/// Position and speed of a train's head on its track, from all that its equipment knows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PositionEstimate {
    /// When it holds.
    pub time: SimTime,
    /// The track.
    pub track: TrackId,
    /// Which way the train runs along it.
    pub direction: Direction,
    /// Chainage of the head, metres.
    pub s_m: f64,
    /// Speed in the running direction, m/s.
    pub v_mps: f64,
    /// Covariance of (s, v): m^2, m^2/s, m^2/s^2.
    pub covariance: [[f64; 2]; 2],
    /// The head is within this of `s_m` but for the risk that the equipment takes; `None` where it
    /// does not work one out.
    pub protection_level_m: Option<f64>,
    /// What it rests on.
    pub sources: Vec<PositionSource>,
}
