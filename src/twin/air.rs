//! The tunnel's air as a user describes it: clear, or full of mist, dust or smoke.
//!
//! People tell air by how far they see. Meteorological visibility V is the distance at which the
//! contrast of a black body has fallen to 2 %, e^(-k V) = 0.02, so k = 3.912 / V (Koschmieder 1924). What the air then does to light is the renderers' business ([`Air`]).

use super::render::Air;
use crate::track::{Checker, Problem};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What one sees through.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AirSettings {
    /// Distance at which contrast has fallen to 2 %, m: under 1000 m is fog, 5000 m haze. Default:
    /// none, the air is clear.
    pub visibility_m: Option<f64>,
    /// Share of the light lost that is scattered and not absorbed, 0 to 1: mist 1, mineral dust some 0.6
    /// to 0.9, smoke some 0.3. Default 1.
    pub scattered_share: f64,
}

impl Default for AirSettings {
    fn default() -> Self {
        Self {
            visibility_m: None,
            scattered_share: 1.0,
        }
    }
}

impl AirSettings {
    /// Appends what is wrong.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        let mut check = Checker::new(at, problems);
        if let Some(visibility_m) = self.visibility_m {
            check.within("visibility_m", visibility_m, 1.0..=1e6, "m");
        }
        check.within("scattered_share", self.scattered_share, 0.0..=1.0, "");
    }

    /// As the renderers have it.
    pub fn air(&self) -> Air {
        let clear = Air::default();
        Air {
            scattered_share: self.scattered_share,
            ..self.visibility_m.map_or(clear, Air::of_visibility)
        }
    }
}
