//! The tunnel's air as a user describes it: clear, or full of mist, dust or smoke.
//!
//! People tell air by how far they see. Meteorological visibility V is the distance at which the
//! contrast of a black body has fallen to 2 %, e^(-k V) = 0.02, so k = 3.912 / V (Koschmieder 1924). What the air then does to light is the renderers' business ([`Air`]).

use super::render::Air;
use crate::settings::settings;

settings! {
    /// What one sees through.
    #[derive(Copy)]
    pub struct AirSettings {
        /// Distance at which contrast has fallen to 2 %, m: under 1000 m is fog, 5000 m haze.
        /// Default: none, the air is clear.
        visibility_m: Option<f64> = None, in 1.0..=1e6;
        /// Share of the light lost that is scattered and not absorbed, 0 to 1: mist 1, mineral dust
        /// some 0.6 to 0.9, smoke some 0.3.
        scattered_share: f64 = 1.0, in 0.0..=1.0;
    }
}

impl AirSettings {
    /// As the renderers have it.
    pub fn air(&self) -> Air {
        let clear = Air::default();
        Air {
            scattered_share: self.scattered_share,
            ..self.visibility_m.map_or(clear, Air::of_visibility)
        }
    }
}
