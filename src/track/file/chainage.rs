//! Chainage as the line states it, as written.

use crate::settings::settings;
use crate::track::furniture::LONGEST_M;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

settings! {
    /// Chainage as plans, posts and people state it; elsewhere in this file a chainage is the length from where
    /// the track begins. In the terms of LandXML 1.2: `staStart`, `staIncrement`, and a `StaEquation` each.
    pub struct StatedChainageEntry {
        /// Letters before the kilometres, as in DK12+340.000. Default: none, and it is written km 12.340.
        #[serde(default)]
        prefix: String;
        /// Stated where the track begins, metres (`staStart`).
        start_m: f64, in -LONGEST_M..=LONGEST_M;
        /// Whether it grows or falls along the track (`staIncrement`). Default: increasing.
        #[serde(default)]
        increment: Increment;
        /// Chainage equations in order along the track: where what is stated jumps.
        #[serde(default)]
        equations: Vec<ChainageEquationEntry>, nested;
    }
}

settings! {
    /// A chainage equation (`StaEquation`). Where ahead comes after back in the direction of counting, chainages are
    /// left out (a short chain); where before, they are stated twice (a long chain).
    pub struct ChainageEquationEntry {
        /// Where it is: metres from where the track begins (`staInternal` less `staStart`).
        chainage_m: f64;
        /// Stated up to there, metres (`staBack`); must agree to 5 mm with what is before. Default:
        /// what follows from that.
        back_m: Option<f64>, in -LONGEST_M..=LONGEST_M;
        /// Stated from there on, metres (`staAhead`).
        ahead_m: f64, in -LONGEST_M..=LONGEST_M;
    }
}

/// How what is stated changes along a track (LandXML's `stationIncrementDirectionType`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Increment {
    /// It grows.
    #[default]
    Increasing,
    /// It falls.
    Decreasing,
}
