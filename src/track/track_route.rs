//! The way of a train over a line of one track; over several it is a [`network::Route`](super::network::Route).
//!
//! A train counts distance in its own running direction, from the end of the track behind it; so do
//! its driver, its equipment and the physics under it. [`TrackRoute`] goes between that and the chainage
//! of the track, which is what trains, posts and people tell each other.

use super::{Direction, Place, Track, TrackId};

/// The whole of one track, run in one direction.
///
/// ```
/// use metrotwin::track::{Direction, TrackRoute, TrackId};
/// let down = TrackRoute { track: TrackId::default(), direction: Direction::Down, length_m: 3000.0 };
/// assert!((down.run_m(2900.0) - 100.0).abs() < 1e-9);
/// assert!((down.place(100.0).s_m - 2900.0).abs() < 1e-9);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackRoute {
    /// The track.
    pub track: TrackId,
    /// Which way along it.
    pub direction: Direction,
    /// Its length.
    pub length_m: f64,
}

impl TrackRoute {
    /// Over a track.
    pub fn new(track: &Track, direction: Direction) -> Self {
        Self {
            track: TrackId::default(),
            direction,
            length_m: track.alignment.length_m(),
        }
    }

    /// Distance along the route of a chainage of the track.
    pub fn run_m(&self, chainage_m: f64) -> f64 {
        match self.direction {
            Direction::Up => chainage_m,
            Direction::Down => self.length_m - chainage_m,
        }
    }

    /// Chainage at a distance along the route.
    pub fn chainage_m(&self, run_m: f64) -> f64 {
        // Both ways round the same: a mirror.
        self.run_m(run_m)
    }

    /// A stretch by its ends in the order in which they are met, as a stretch of the track by its lower
    /// and higher chainage; and the other way round.
    pub fn stretch_m(&self, from_m: f64, to_m: f64) -> (f64, f64) {
        match self.direction {
            Direction::Up => (from_m, to_m),
            Direction::Down => (self.run_m(to_m), self.run_m(from_m)),
        }
    }

    /// Place at a distance along the route.
    pub fn place(&self, run_m: f64) -> Place {
        Place {
            track: self.track,
            s_m: self.chainage_m(run_m),
        }
    }
}
