//! Glare: light of a lamp that the lens spreads over the picture.
//!
//! Two parts, each a fixed share of the lamp's light however far the lamp is:
//!
//! - *near*, from reflections between glass and sensor: level over the disc, then an exponential of
//!   the distance from its rim;
//! - *wide*, the veil that scattering on glass, dust and rims makes. Point spreads measured for the
//!   veiling glare of cameras fall with some power of the distance (Bitlis, Jansson, Allebach, SPIE
//!   6498, 2007; for the eye with the third within some 2 degrees and the second beyond: CIE
//!   146:2002). The third power is our choice: w / (2 pi) (w^2 + r^2)^(-3/2), which is 1 in the
//!   integral. A disc of radius a widens w to (w^2 + a^2)^(1/2).
//!
//! Nothing that stands before the lamp hides its glare's neighbourhood: it arises in the lens. It
//! blinks with the row that it falls on, so it carries the lamp's stripes far beyond the disc.

use super::sensor::LensSettings;

/// Glare of one lamp in one row, in the unit of the luminance or signal it was made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glare {
    /// Radius of a circle as large as the lamp's image.
    pub apparent_px: f64,
    /// The near part on the disc.
    pub near: f64,
    /// Decay length of the near part.
    pub near_px: f64,
    /// The wide part times the third power of its width.
    pub wide: f64,
    /// Square of the width of the wide part.
    pub wide_px2: f64,
}

impl LensSettings {
    /// The glare of a lamp of that size and luminance.
    pub fn glare(&self, apparent_px: f64, luminance: f64) -> Glare {
        let (a, h) = (apparent_px, self.halo_px);
        let lamp = luminance * a * a;
        let wide_px2 = self.veil_px.powi(2) + a * a;
        Glare {
            apparent_px,
            near: self.halo_share * lamp / (a * a + 2.0 * a * h + 2.0 * h * h),
            near_px: h,
            wide: 0.5 * self.veil_share * lamp * wide_px2.sqrt(),
            wide_px2,
        }
    }
}

impl Glare {
    /// At a distance from the lamp's centre in the image.
    pub fn at(&self, r_px: f64) -> f64 {
        let outside = (r_px - self.apparent_px).max(0.0) / self.near_px;
        self.near * (-outside).exp() + self.wide * (self.wide_px2 + r_px * r_px).powf(-1.5)
    }

    /// Distance beyond which both parts are fainter than `faint`; 0 where they are everywhere.
    pub fn reach_px(&self, faint: f64) -> f64 {
        let near = if self.near > faint {
            self.apparent_px + self.near_px * (self.near / faint).ln()
        } else {
            0.0
        };
        let wide = (self.wide / faint).powf(2.0 / 3.0) - self.wide_px2;
        near.max(wide.max(0.0).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    /// Provokes: glare that is no fixed share of the lamp's light.
    #[test]
    fn glare_is_the_stated_share_of_the_light() {
        for (halo_share, veil_share) in [(0.02, 0.0), (0.0, 0.03)] {
            let lens = LensSettings {
                halo_share,
                veil_share,
                ..LensSettings::default()
            };
            for a in [0.5, 7.0, 65.0] {
                let glare = lens.glare(a, 1000.0);
                // Substituted r = x / (1 - x), so that the long tail is in it.
                let n = 200_000;
                let sum: f64 = (0..n)
                    .map(|k| {
                        let x = (f64::from(k) + 0.5) / f64::from(n);
                        let r = x / (1.0 - x);
                        TAU * r * glare.at(r) / (1.0 - x).powi(2) / f64::from(n)
                    })
                    .sum();
                let share = sum / (1000.0 * PI * a * a);
                let right = halo_share + veil_share;
                assert!((share / right - 1.0).abs() < 1e-3, "{a}: {share}");
            }
        }
    }

    /// Provokes: glare cut off where it still shows, or followed for ever.
    #[test]
    fn glare_is_faint_beyond_its_reach() {
        let lens = LensSettings::default();
        for a in [1.0, 20.0, 60.0] {
            let glare = lens.glare(a, 30_000.0);
            let reach = glare.reach_px(0.3);
            assert!(glare.at(reach) <= 0.6 && glare.at(0.9 * reach) > 0.3);
        }
        assert!(lens.glare(1.0, 1e-6).reach_px(0.3) <= 0.0);
    }
}
