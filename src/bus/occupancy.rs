//! On which track a train takes itself to be.

use super::SimTime;
use crate::track::{Direction, TrackId};
use serde::{Deserialize, Serialize};

/// One track that a train may be on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OccupiedTrack {
    /// The track.
    pub track: TrackId,
    /// How probable that is.
    pub probability: f64,
    /// Which way the train's front looks along it.
    pub facing: Direction,
    /// How probable that is, if it is on this track.
    pub facing_probability: f64,
    /// Chainage of the antenna, metres.
    pub s_m: f64,
    /// Its standard deviation.
    pub sigma_m: f64,
}

/// What track occupancy says at a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OccupancyReport {
    /// When it held.
    pub time: SimTime,
    /// Every track that the train may be on, the most probable first; none while nothing is known.
    pub tracks: Vec<OccupiedTrack>,
    /// Only one track is left.
    pub identified: bool,
    /// How many hypotheses are alive.
    pub hypotheses: u32,
    /// It comes of a fix, and not of what was run since.
    pub of_fix: bool,
}
