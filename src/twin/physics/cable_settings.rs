//! Cables as a scenario writes them.

use super::vehicle::GRAVITY_MPS2;
use crate::settings::{Checker, settings};
use crate::track::{Alignment, TrackPoint};

settings! {
    /// A cable that hangs between two points of the lining.
    pub struct CableSettings {
        /// Name, for the summary.
        name: String = "cable".to_owned();
        /// Name of the track. Default: the tunnel's first.
        track: Option<String> = None;
        /// Its first end.
        from: CableEnd = CableEnd { lateral_m: 2.0, height_m: 3.0, ..CableEnd::default() },
            nested;
        /// Its other end.
        to: CableEnd = CableEnd { chainage_m: 6.0, lateral_m: 2.0, height_m: 3.0, lets_go_s: None },
            nested;
        /// Its length, metres: at least what the ends are apart.
        length_m: f64 = 6.3, in 0.5..=50.0;
        /// Diameter, metres.
        diameter_m: f64 = 0.025, in 0.005..=0.2;
        /// Mass of a metre, kilograms.
        mass_kg_per_m: f64 = 1.2, in 0.05..=100.0;
        /// It tears where it is pulled harder than this, newtons. Default: a copper cable of 120
        /// mm^2 (200 N/mm^2).
        breaking_n: f64 = 24_000.0, in 10.0..=1e7;
        /// Coulomb friction.
        friction: f64 = 0.5, in 0.0..=2.0;
        /// Share of light reflected, 0 to 1.
        albedo: f64 = 0.1, in 0.0..=1.0;
        /// Temperature of its surface, degrees Celsius.
        temperature_c: f64 = 25.0, in -50.0..=1500.0;
    }
}

settings! {
    /// Where a cable is fixed.
    #[derive(Copy)]
    pub struct CableEnd {
        /// Chainage, metres.
        chainage_m: f64 = 0.0, in -1e6..=1e6;
        /// Left of the centreline, metres.
        lateral_m: f64 = 0.0, in -10.0..=10.0;
        /// Above top of rail, metres.
        height_m: f64 = 0.0, in -1.0..=10.0;
        /// When this end lets go, seconds. Default: never.
        lets_go_s: Option<f64> = None, in 0.0..=1e6;
    }
}

impl CableEnd {
    /// On the line.
    pub(super) fn place(&self) -> TrackPoint {
        TrackPoint {
            s_m: self.chainage_m,
            l_m: self.lateral_m,
            h_m: self.height_m,
        }
    }
}

impl CableSettings {
    /// Adds what is wrong with it on a line: it must reach from end to end.
    pub fn check_reach(&self, alignment: &Alignment, check: &mut Checker<'_>) {
        let [a, b] = [&self.from, &self.to].map(|end| alignment.world_from_track(end.place()));
        let apart_m = (b - a).norm();
        if self.length_m < apart_m {
            check.problem(
                "length_m",
                format!(
                    "{} m do not reach: its ends are {apart_m:.2} m apart",
                    self.length_m
                ),
                format!("give more than {apart_m:.2} m: it sags by what it is longer"),
            );
        }
    }
}

/// Damping ratio of the swing of a cable that hangs from one end.
const SWING_DAMPING: f64 = 0.05;

impl CableSettings {
    /// Drag over momentum: 2 zeta w of the rod that the cable hangs as, w^2 = 3 g / 2 L.
    pub(super) fn drag_per_s(&self) -> f64 {
        2.0 * SWING_DAMPING * (1.5 * GRAVITY_MPS2 / self.length_m).sqrt()
    }
}
