//! Cables as a scenario writes them.

use super::vehicle::GRAVITY_MPS2;
use crate::track::{Alignment, Checker, Problem, TrackPoint, key_below};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A cable that hangs between two points of the lining.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CableSettings {
    /// Name, for the summary.
    pub name: String,
    /// Its first end.
    pub from: CableEnd,
    /// Its other end.
    pub to: CableEnd,
    /// Its length, metres: at least what the ends are apart.
    pub length_m: f64,
    /// Diameter, metres.
    pub diameter_m: f64,
    /// Mass of a metre, kilograms.
    pub mass_kg_per_m: f64,
    /// It tears where it is pulled harder than this, newtons. Default: a copper cable of 120 mm^2
    /// (200 N/mm^2).
    pub breaking_n: f64,
    /// Coulomb friction.
    pub friction: f64,
    /// Share of light reflected, 0 to 1.
    pub albedo: f64,
    /// Temperature of its surface, degrees Celsius.
    pub temperature_c: f64,
}

/// Where a cable is fixed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CableEnd {
    /// Chainage, metres.
    pub chainage_m: f64,
    /// Left of the centreline, metres.
    pub lateral_m: f64,
    /// Above top of rail, metres.
    pub height_m: f64,
    /// When this end lets go, seconds. Default: never.
    pub lets_go_s: Option<f64>,
}

impl Default for CableSettings {
    fn default() -> Self {
        let end = |chainage_m| CableEnd {
            chainage_m,
            lateral_m: 2.0,
            height_m: 3.0,
            lets_go_s: None,
        };
        Self {
            name: "cable".to_owned(),
            from: end(0.0),
            to: end(6.0),
            length_m: 6.3,
            diameter_m: 0.025,
            mass_kg_per_m: 1.2,
            breaking_n: 24_000.0,
            friction: 0.5,
            albedo: 0.1,
            temperature_c: 25.0,
        }
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
    /// Appends what is wrong with these settings; `at` is the dotted key that leads here.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        let mut check = Checker::new(at, problems);
        check.within("length_m", self.length_m, 0.5..=50.0, "m");
        check.within("diameter_m", self.diameter_m, 0.005..=0.2, "m");
        check.within("mass_kg_per_m", self.mass_kg_per_m, 0.05..=100.0, "kg/m");
        check.within("breaking_n", self.breaking_n, 10.0..=1e7, "N");
        check.within("friction", self.friction, 0.0..=2.0, "");
        check.within("albedo", self.albedo, 0.0..=1.0, "");
        check.within("temperature_c", self.temperature_c, -50.0..=1500.0, "deg C");
        for (key, end) in [("from", &self.from), ("to", &self.to)] {
            let at = key_below(at, key);
            let mut check = Checker::new(&at, problems);
            check.within("chainage_m", end.chainage_m, -1e6..=1e6, "m");
            check.within("lateral_m", end.lateral_m, -10.0..=10.0, "m");
            check.within("height_m", end.height_m, -1.0..=10.0, "m");
            if let Some(at_s) = end.lets_go_s {
                check.within("lets_go_s", at_s, 0.0..=1e6, "s");
            }
        }
    }

    /// Appends what is wrong with it on a line: it must reach from end to end.
    pub fn check_reach(&self, at: &str, alignment: &Alignment, problems: &mut Vec<Problem>) {
        let [a, b] = [&self.from, &self.to].map(|end| alignment.world_from_track(end.place()));
        let apart_m = (b - a).norm();
        if self.length_m < apart_m {
            problems.push(Problem::new(
                key_below(at, "length_m"),
                format!(
                    "{} m do not reach: its ends are {apart_m:.2} m apart",
                    self.length_m
                ),
                format!("give more than {apart_m:.2} m: it sags by what it is longer"),
            ));
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
