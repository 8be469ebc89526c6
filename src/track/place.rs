//! The tracks of a railway, and which way something runs.
//!
//! ```
//! use metrotwin::track::Direction;
//! let (head_m, obstacle_m) = (1200.0, 1150.0);
//! // A train that runs down the line has it 50 m ahead.
//! assert!((Direction::Down.ahead_m(head_m, obstacle_m) - 50.0).abs() < 1e-9);
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Number of a track. A tunnel file has one track, number 0.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct TrackId(pub u16);

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
