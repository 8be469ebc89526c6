//! The tunnel's air: clear, or full of mist, dust or smoke.
//!
//! People tell air by how far they see. Meteorological visibility V is the distance at which the
//! contrast of a black body has fallen to 2 %, e^(-k V) = 0.02, so k = 3.912 / V
//! (Koschmieder 1924).

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
    /// What they describe.
    pub fn air(&self) -> Air {
        let clear = Air::default();
        Air {
            scattered_share: self.scattered_share,
            ..self.visibility_m.map_or(clear, Air::of_visibility)
        }
    }
}

/// The tunnel's air: clear, or full of mist or dust. What it does to light is said in
/// [`photometry`](super::render::photometry).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// Share of light that is lost on a metre (k in e^(-k d)); 0 is clear.
    pub extinction_per_m: f64,
    /// Share of the lost light that goes on in another direction: near 1 for the drops of mist,
    /// 0.6 to 0.9 for mineral dust; the rest is absorbed.
    pub scattered_share: f64,
}

/// Contrast that an eye just sees, as usual with Koschmieder's law (WMO-No. 8 takes 0.05 for its
/// meteorological optical range, which is 0.77 of the visibility here).
const JUST_SEEN: f64 = 0.02;

impl Default for Air {
    fn default() -> Self {
        Self {
            extinction_per_m: 0.0,
            scattered_share: 1.0,
        }
    }
}

impl Air {
    /// Mist in which a black body before lit air is just seen at a distance: k = 3.912 / V.
    ///
    /// ```
    /// use metrotwin::twin::air::Air;
    /// let air = Air::of_visibility(100.0);
    /// assert!((air.extinction_per_m - 0.039_12).abs() < 1e-5);
    /// ```
    pub fn of_visibility(visibility_m: f64) -> Self {
        Self {
            extinction_per_m: -JUST_SEEN.ln() / visibility_m,
            ..Self::default()
        }
    }

    /// Whether nothing is lost.
    pub fn is_clear(&self) -> bool {
        self.extinction_per_m <= 0.0
    }

    /// Share of light that is left after a distance.
    pub fn transmission(&self, distance_m: f64) -> f64 {
        if self.is_clear() {
            1.0
        } else {
            (-self.extinction_per_m * distance_m).exp()
        }
    }
}
