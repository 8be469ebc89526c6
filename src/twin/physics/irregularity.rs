//! Random deviation of the rails from their designed place.

use super::settings::within;
use crate::track::Problem;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which spectrum the irregularity follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum IrregularityClass {
    /// Perfect track.
    None,
    /// German spectra, low disturbance.
    #[default]
    GermanLow,
    /// German spectra, high disturbance.
    GermanHigh,
    /// FRA class 1, the worst.
    Fra1,
    /// FRA class 2.
    Fra2,
    /// FRA class 3.
    Fra3,
    /// FRA class 4.
    Fra4,
    /// FRA class 5.
    Fra5,
    /// FRA class 6, the best.
    Fra6,
}

/// How uneven the track is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct IrregularitySettings {
    /// Which spectrum.
    pub class: IrregularityClass,
    /// Shortest wavelength, metres.
    pub shortest_m: f64,
    /// Longest wavelength, metres.
    pub longest_m: f64,
}

impl Default for IrregularitySettings {
    fn default() -> Self {
        Self {
            class: IrregularityClass::GermanLow,
            shortest_m: 1.0,
            longest_m: 80.0,
        }
    }
}

impl IrregularitySettings {
    /// Appends what is wrong with these settings; `at` is the dotted key that leads here.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        within(problems, at, "shortest_m", self.shortest_m, 0.5, 100.0, "m");
        let longest = self.longest_m;
        within(
            problems,
            at,
            "longest_m",
            longest,
            2.0 * self.shortest_m,
            300.0,
            "m",
        );
    }
}
