//! How much force a wheel passes to its rail, by the creep that it takes.
//!
//! The law is Polach's: with the lateral and longitudinal creepages weighted by Kalker's
//! coefficients as a linear force f, the load Q and the friction mu,
//!
//! ```text
//! e = pi f / (4 mu Q)
//! F = (2 mu Q / pi) (kA e / (1 + (kA e)^2) + atan(kS e))
//! mu = mu0 ((1 - A) exp(-B w) + A)        w = speed of slip, m/s
//! ```
//!
//! It rises with the creep to its largest value and falls again where the wheel slips or slides:
//! Polach, "Creep forces in simulations of traction vehicles running on adhesion limit", Wear 258
//! (2005) 992-1000, whose table has `dry` and `wet`. A film of crushed leaves leaves 0.02 to 0.06
//! (RSSB, "Low adhesion" research reports); its other parameters are those of `wet`.

use crate::settings::{Checker, settings};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_2_PI, FRAC_PI_4};

/// Kalker's longitudinal and lateral creep coefficients of a wheel of radius 0.43 m under 60 kN on
/// a 60 kg rail: G a b C with a = b = 5 mm and C11 = 4.12, C22 = 3.67 (Kalker's table, Poisson's
/// ratio 0.25, G = 80 GPa).
pub(super) const KALKER_ALONG_N: f64 = 8.24e6;
pub(super) const KALKER_ACROSS_N: f64 = 7.34e6;

/// State of the rail heads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RailState {
    /// Friction up to 0.55.
    #[default]
    Dry,
    /// Friction up to 0.30. In images the bed about them is wet too, and mirrors lamps.
    Wet,
    /// A film of crushed leaves: friction up to 0.05.
    LeafFilm,
}

settings! {
    /// A stretch of track with rail heads of its own.
    pub struct RailZone {
        /// Name of the track. Default: the tunnel's first.
        track: Option<String>;
        /// Chainage where it begins, m.
        from_m: f64, in -1e6..=1e6;
        /// Chainage where it ends, m.
        to_m: f64, in -1e6..=1e6;
        /// State of the rail heads.
        rail: RailState;
    }
    also check_order
}

impl RailZone {
    fn check_order(&self, check: &mut Checker<'_>) {
        check.within("to_m", self.to_m, self.from_m..=1e6);
    }
}

/// Polach's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Adhesion {
    friction: f64,
    /// Share of the friction that is left at high speed of slip.
    left: f64,
    /// How fast it falls, s/m.
    fall_s_m: f64,
    in_adhesion: f64,
    in_slip: f64,
}

impl RailState {
    pub(super) fn adhesion(self) -> Adhesion {
        let (friction, left, fall_s_m, in_adhesion, in_slip) = match self {
            Self::Dry => (0.55, 0.40, 0.60, 1.00, 0.40),
            Self::Wet => (0.30, 0.40, 0.20, 0.30, 0.10),
            Self::LeafFilm => (0.05, 0.40, 0.20, 0.30, 0.10),
        };
        Adhesion {
            friction,
            left,
            fall_s_m,
            in_adhesion,
            in_slip,
        }
    }
}

impl Adhesion {
    /// Largest force under a load, for a slip of `slip_mps`.
    fn most_n(&self, load_n: f64, slip_mps: f64) -> f64 {
        let share = (1.0 - self.left) * (-self.fall_s_m * slip_mps.abs()).exp() + self.left;
        self.friction * share * load_n
    }

    /// Force for a creepage under a load, as a share of the linear force `coefficient * creepage`.
    /// Both are positive.
    pub(super) fn share(&self, linear_n: f64, load_n: f64, slip_mps: f64) -> f64 {
        let most_n = self.most_n(load_n, slip_mps);
        if linear_n < 1e-9 {
            return 0.5 * (self.in_adhesion + self.in_slip) * f64::from(u8::from(load_n > 0.0));
        }
        if most_n < 1e-9 {
            return 0.0;
        }
        let e = FRAC_PI_4 * linear_n / most_n;
        let adhering = self.in_adhesion * e;
        let force_n = FRAC_2_PI
            * most_n
            * (adhering / (1.0 + adhering * adhering) + (self.in_slip * e).atan());
        force_n / linear_n
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Settings;

    /// Fails where the slope at the origin is not Kalker's times (kA + kS)/2, or a force exceeds
    /// the friction, or does not fall behind its largest value.
    #[test]
    fn val_polach_limits() {
        for rail in [RailState::Dry, RailState::Wet, RailState::LeafFilm] {
            let law = rail.adhesion();
            let load_n = 70e3;
            let slope = 0.5 * (law.in_adhesion + law.in_slip);
            assert!((law.share(1e-3, load_n, 0.0) / slope - 1.0).abs() < 1e-6);
            assert!((law.share(0.0, load_n, 0.0) - slope).abs() < 1e-12);
            assert!(law.share(1e3, 0.0, 0.0).abs() < 1e-300);
            let speed_mps = 10.0;
            let force = |creepage: f64| {
                let linear_n = KALKER_ALONG_N * creepage;
                linear_n * law.share(linear_n, load_n, creepage * speed_mps)
            };
            let creepages = (1..2000).map(|k| 1e-3 * f64::from(k));
            let (at, most) = creepages.fold((0.0, 0.0), |(at, most), c| match force(c) {
                f if f > most => (c, f),
                _ => (at, most),
            });
            assert!(most < law.friction * load_n && most > 0.6 * law.friction * load_n);
            assert!((0.005..0.3).contains(&at), "{rail:?}: largest at {at}");
            assert!(force(1.0) < 0.8 * most);
        }
    }

    /// Fails where a zone that is the wrong way round passes.
    #[test]
    fn a_zone_must_not_end_before_it_begins() {
        let zone = RailZone {
            track: None,
            from_m: 100.0,
            to_m: 50.0,
            rail: RailState::Wet,
        };
        let mut problems = Vec::new();
        zone.check("track.rails[0]", &mut problems);
        assert_eq!(problems.len(), 1);
        assert_eq!(problems[0].key, "track.rails[0].to_m");
    }
}
