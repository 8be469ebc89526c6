//! Where a track runs, as written: its begin, plan and profile.

use crate::settings::{Checker, Problem, Settings, put_range, settings};
use crate::track::furniture::LONGEST_M;
use crate::track::section::Side;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

settings! {
    /// Where a track begins.
    pub struct StartEntry {
        /// World x of chainage 0, metres.
        east_m: f64 = 0.0, in -1e7..=1e7;
        /// World y of chainage 0, metres.
        north_m: f64 = 0.0, in -1e7..=1e7;
        /// Height of top of rail at chainage 0, metres.
        up_m: f64 = 0.0, in -1e7..=1e7;
        /// Direction up the line, degrees from east towards north.
        heading_deg: f64 = 0.0, in -360.0..=360.0;
    }
}

/// A plan element.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(extend("unevaluatedProperties" = false))]
pub struct PlanEntry {
    /// Length in plan, metres.
    #[schemars(transform = put_range(LENGTH_M))]
    pub length_m: f64,
    /// Its length is solved for, so that the track meets what it is joined to; `length_m` is about what it will
    /// be.
    #[serde(default)]
    pub closes: bool,
    /// Its kind.
    #[serde(flatten)]
    pub shape: PlanShape,
}

/// Lengths that a plan element may have.
const LENGTH_M: RangeInclusive<f64> = 0.001..=LONGEST_M;

impl Settings for PlanEntry {
    fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        Checker::new(at, problems).within("length_m", self.length_m, LENGTH_M);
        self.shape.check(at, problems);
    }
}

settings! {
    /// Shape of a plan element, by its kind.
    #[serde(tag = "kind", rename_all = "snake_case")]
    pub enum PlanShape {
        /// No curvature.
        Straight {},
        /// Curvature and cant run linearly from those of the element before to those of the next.
        Clothoid {},
        /// Constant curvature.
        Arc {
            /// Radius, metres, positive.
            radius_m: f64, in 20.0..=1e8;
            /// To which side it turns, looking up the line.
            turn: Side;
            /// Height of the outer rail over the inner one, millimetres. Default 0.
            #[serde(default)]
            // The most on metro lines (GB 50157).
            cant_mm: f64, in 0.0..=120.0;
        },
    }
}

settings! {
    /// A grade.
    pub struct GradeEntry {
        /// Where it begins: where its tangent meets that of the grade before, metres.
        from_m: f64;
        /// Rise up the line, permille.
        grade_permille: f64, in -60.0..=60.0;
        /// Radius of the vertical curve that leads into it, metres (0 for none).
        #[serde(default = "vertical_radius")]
        vertical_radius_m: f64, in 0.0..=1e6;
    }
}

fn vertical_radius() -> f64 {
    3000.0
}
