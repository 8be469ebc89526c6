//! Where the track of a hypothesis is taken to lie.

use nalgebra::Vector2;

/// Against the map.
#[derive(Clone, Copy, Debug, Default)]
pub enum TrackPlacing {
    #[default]
    AsMapped,
    /// As mapped: distances count from it.
    Reference,
    Beside(BesideReference),
}

/// At the mean distance from the reference.
#[derive(Clone, Copy, Debug)]
pub struct BesideReference {
    /// To the left of the reference, the mean over the last run, metres.
    pub mean_m: f64,
    /// From the mapped place to there.
    pub shift_m: Vector2<f64>,
}

impl TrackPlacing {
    /// From the mapped place to where the track is taken to be.
    pub fn shift_m(&self) -> Vector2<f64> {
        match self {
            Self::Beside(beside) => beside.shift_m,
            Self::AsMapped | Self::Reference => Vector2::zeros(),
        }
    }
}
