//! What scatters a radar's wave: bodies, and the tunnel around.
//!
//! | | |
//! |---|---|
//! | `facet`, `shapes` | cross-section of a piece of surface; shapes as pieces |
//! | `bodies` | centres of trains, obstacles, people |
//! | `clutter` | centres of lining and track |
//! | `sight` | which places a radar sees |

mod bodies;
mod clutter;
mod facet;
mod shapes;
mod sight;

pub use bodies::{BodyEchoSettings, BodyEchoes, SeenBody};
pub use clutter::{ClutterSettings, clutter};
pub use sight::{OwnedBody, RadarSight};

use crate::twin::physics::BodyOwner;
use nalgebra::{Point3, Vector3};

/// A place that scatters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Centre {
    /// In the world, metres.
    pub place: Point3<f64>,
    /// In the world's axes, m/s.
    pub velocity_mps: Vector3<f64>,
    /// Cross-section towards the radar, square metres.
    pub section_m2: f64,
    /// Turn of the wave on scattering, radians.
    pub phase_rad: f64,
    /// What it belongs to; none of the surroundings.
    pub owner: Option<BodyOwner>,
}
