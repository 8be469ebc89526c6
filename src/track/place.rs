//! Where something is on the railway, and which way it runs.
//!
//! ```
//! use metrotwin::track::{Direction, Place, TrackId};
//! let head = Place { track: TrackId::default(), s_m: 1200.0 };
//! let obstacle = Place { s_m: 1150.0, ..head };
//! // A train that runs down the line has it 50 m ahead.
//! assert!((Direction::Down.ahead_m(head.s_m, obstacle.s_m) - 50.0).abs() < 1e-9);
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Number of a track. A tunnel file has one track, number 0.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct TrackId(pub u16);

/// A chainage of a track.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Which track.
    pub track: TrackId,
    /// Chainage along its centreline.
    pub s_m: f64,
}

impl Place {
    /// Of a line that has one track, or is taken as one.
    pub fn on_first_track(s_m: f64) -> Self {
        Self {
            track: TrackId::default(),
            s_m,
        }
    }
}

/// A stretch of one track.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stretch {
    /// Which track.
    pub track: TrackId,
    /// Lower chainage.
    pub from_m: f64,
    /// Higher chainage.
    pub to_m: f64,
}

impl Stretch {
    /// Longer by so much at both ends.
    #[must_use]
    pub fn widened(&self, by_m: f64) -> Self {
        Self {
            from_m: self.from_m - by_m,
            to_m: self.to_m + by_m,
            ..*self
        }
    }
}

/// Which way along a track.
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
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// Towards growing chainage.
    #[default]
    Up,
    /// Towards falling chainage.
    Down,
}

/// `up` or `down`.
impl fmt::Display for Direction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Up => "up",
            Self::Down => "down",
        })
    }
}

impl Direction {
    /// 1 up, -1 down.
    pub fn sign(self) -> f64 {
        match self {
            Self::Up => 1.0,
            Self::Down => -1.0,
        }
    }

    /// The other one.
    #[must_use]
    pub fn reversed(self) -> Self {
        match self {
            Self::Up => Self::Down,
            Self::Down => Self::Up,
        }
    }

    /// How far `to_m` lies ahead of `from_m`, both chainages; negative where it lies behind.
    pub fn ahead_m(self, from_m: f64, to_m: f64) -> f64 {
        self.sign() * (to_m - from_m)
    }
}
