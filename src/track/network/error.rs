//! What keeps tracks from being a network.

use super::TrackEnd;
use crate::track::{Direction, TrackId};
use std::fmt;

/// Why tracks and joints are not a network.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NetworkError {
    /// A joint names a track that is not there.
    #[error("there is no track {}", .0.0)]
    NoTrack(TrackId),
    /// Two joints have the same end.
    #[error("the {0} is joined twice")]
    NamedTwice(TrackEnd),
    /// No joint has an end.
    #[error("the {0} is loose: join it, or make it a buffer or an open end")]
    Loose(TrackEnd),
    /// Ends that meet are not in one place.
    #[error("the {from} and the {to} are {gap_m:.4} m apart")]
    Gap {
        /// One end.
        from: TrackEnd,
        /// The other.
        to: TrackEnd,
        /// Their distance.
        gap_m: f64,
    },
    /// They are, but the line has a kink there.
    #[error("the line from the {from} to the {to} has a kink of {kink_rad:.5} rad")]
    Kink {
        /// One end.
        from: TrackEnd,
        /// The other.
        to: TrackEnd,
        /// In plan or in the profile, whichever is more.
        kink_rad: f64,
    },
    /// Tracks of a route do not follow each other.
    #[error("track {} does not follow the {from}", .to.0)]
    NotNext {
        /// The end that the route comes to.
        from: TrackEnd,
        /// The track that is to be next.
        to: TrackId,
    },
    /// A route begins or ends beside its track.
    #[error("chainage {s_m} m is not on track {}", .track.0)]
    NotOnTrack {
        /// The track.
        track: TrackId,
        /// The chainage.
        s_m: f64,
    },
}

impl fmt::Display for TrackEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let end = match self.way {
            Direction::Up => "upper",
            Direction::Down => "lower",
        };
        write!(f, "{end} end of track {}", self.track.0)
    }
}
