//! Cross-sections, as written.

use crate::settings::{Problem, Settings, settings};
use crate::track::section::Side;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A cross-section over a stretch of the line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(extend("unevaluatedProperties" = false))]
pub struct SectionEntry {
    /// From this chainage, metres.
    pub from_m: f64,
    /// To this chainage, metres. Default: where the next begins, or the end of the line.
    pub to_m: Option<f64>,
    /// Its kind and dimensions.
    #[serde(flatten)]
    pub shape: SectionShape,
}

impl Settings for SectionEntry {
    fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        self.shape.check(at, problems);
    }
}

settings! {
    /// Outline of a cross-section, by its kind.
    #[serde(tag = "kind", rename_all = "snake_case")]
    pub enum SectionShape {
        /// Shield-driven.
        Circular {
            /// Inner radius, metres. Default 3.0.
            radius_m: Option<f64>, in 2.2..=20.0;
            /// Its centre over top of rail, metres. Default: 0.74 m of track structure under top of
            /// rail (2.26 for a radius of 3.0).
            centre_m: Option<f64>, in 0.5..=20.0;
            /// Side of an evacuation walkway. Default: none.
            walkway: Option<Side>;
        },
        /// Mined.
        Horseshoe {
            /// Width, metres. Default 5.2.
            width_m: Option<f64>, in 3.4..=20.0;
            /// Height over top of rail where the arch springs, metres. Default 2.4.
            springing_m: Option<f64>, in 0.5..=20.0;
            /// Crown over top of rail, metres. Default 4.8.
            ceiling_m: Option<f64>, in 4.0..=30.0;
            /// Side of an evacuation walkway. Default: none.
            walkway: Option<Side>;
        },
        /// Cut and cover, or station.
        Rectangular {
            /// Left wall from the centreline, metres. Default 2.9.
            left_m: Option<f64>, in 1.7..=60.0;
            /// Right wall from the centreline, metres. Default 2.9.
            right_m: Option<f64>, in 1.7..=60.0;
            /// Ceiling over top of rail, metres. Default 4.6.
            ceiling_m: Option<f64>, in 4.0..=30.0;
            /// Side of an evacuation walkway. Default: none.
            walkway: Option<Side>;
            /// Side of a platform. Default: none.
            platform: Option<Side>;
            /// Edge of the platform from the centreline, metres. Default 1.5 (GB 50157, B cars).
            platform_edge_m: Option<f64>, in 1.45..=3.0;
            /// Platform over top of rail, metres. Default 1.05 (50 mm under the floor of a B car).
            platform_height_m: Option<f64>, in 0.2..=1.2;
        },
        /// In the section of the track beside it, which is wide enough for both.
        Shared {},
        /// Between walls without a roof, as where a line comes up into the open.
        Trough {
            /// Left wall from the centreline, metres. Default 2.9.
            left_m: Option<f64>, in 1.7..=60.0;
            /// Right wall from the centreline, metres. Default 2.9.
            right_m: Option<f64>, in 1.7..=60.0;
            /// Top of the walls over top of rail, metres. Default 4.0.
            wall_m: Option<f64>, in 0.2..=20.0;
        },
        /// Track in the open.
        Open {
            /// Width of the bed, metres. Default 6.0.
            width_m: Option<f64>, in 3.4..=60.0;
        },
    }
}
