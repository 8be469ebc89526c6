//! Why the world could not be made, or could not go on.

use super::NoRoute;
use crate::bus::{SimTime, TrainId};
use crate::settings::Problem;

/// Why the world could not be made, or could not go on.
#[derive(Debug, thiserror::Error)]
pub enum PhysicsError {
    /// Settings that no world can be made from.
    #[error("the physics settings are wrong: {}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    Settings(Vec<Problem>),
    /// A train has no way.
    #[error(transparent)]
    NoRoute(#[from] NoRoute),
    /// A wheelset has left the rails.
    #[error("{body} left the rails at {time}")]
    Derailed {
        /// Of which train.
        train: TrainId,
        /// Which wheelset.
        body: String,
        /// When.
        time: SimTime,
    },
    /// A body's state is no longer a number.
    #[error("the state of {body} became non-finite at {time}")]
    NonFinite {
        /// Which body.
        body: String,
        /// When.
        time: SimTime,
    },
}
