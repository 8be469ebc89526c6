//! What an obstacle is made of, for sensors that care.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What an obstacle is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ObstacleMaterial {
    /// Sheet metal, tools, rails.
    #[default]
    Metal,
    /// Concrete, brick, stone.
    Masonry,
    /// Wood.
    Wood,
    /// Plastic.
    Plastic,
    /// A box of cardboard.
    Cardboard,
    /// A car or a van: sheet metal with the corners that make it echo from all sides.
    Vehicle,
}
