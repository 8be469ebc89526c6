//! What a hit does to a train. Classes go by the energy that the hit used up, all of it taken to have
//! gone into the train. Their bounds are energies that trains are designed for:
//!
//! - superficial: EN 15152 has the front glazing withstand a projectile of
//!   1 kg at the train's top speed plus 160 km/h;
//! - the others: a train that runs into a standing one of the same kind. Both go on with
//!   half the speed, so m v^2 / 4 is used up and each takes m v^2 / 8. EN 15227 wants a metro
//!   (category C-II) to keep its survival space at 25 km/h. Below that metros are commonly bought
//!   with couplers whose buffers take 5 km/h without any harm, and whose collapse tubes, to be
//!   replaced afterwards, take 15 km/h.
//!
//! The bounds hold for hits where these parts are. A thing that hits equipment below the floor does
//! harm at less.

use schemars::JsonSchema;
use serde::Serialize;
use std::fmt;

/// What a hit does to the train, by the energy that it uses up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Damage {
    /// Scratches: no more than the front glazing must withstand.
    #[default]
    Superficial,
    /// Dents; what the couplers' buffers take without harm.
    Light,
    /// Parts that are made to collapse must be replaced.
    Repairable,
    /// The crash zone at the train's end is used up in part; passengers' rooms are whole.
    Structural,
    /// More than the train was designed to take.
    BeyondDesign,
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Superficial => "superficial",
            Self::Light => "light",
            Self::Repairable => "repairable",
            Self::Structural => "structural",
            Self::BeyondDesign => "beyond design",
        })
    }
}

/// Top speed that metros of this kind are built for.
const TOP_SPEED_KMH: f64 = 80.0;

impl Damage {
    /// The class of a hit that used up an energy, on a train of a mass.
    pub(super) fn of_hit(energy_lost_j: f64, train_kg: f64) -> Self {
        let classes = Self::bounds_j(train_kg);
        let class = classes
            .iter()
            .find(|(bound_j, _)| energy_lost_j <= *bound_j);
        class.map_or(Self::BeyondDesign, |(_, class)| *class)
    }

    /// The most energy of each class.
    fn bounds_j(train_kg: f64) -> [(f64, Self); 4] {
        let into_like = |kmh: f64| train_kg * (kmh / 3.6).powi(2) / 8.0;
        let glazing_j = 0.5 * ((TOP_SPEED_KMH + 160.0) / 3.6).powi(2);
        [
            (glazing_j, Self::Superficial),
            (into_like(5.0), Self::Light),
            (into_like(15.0), Self::Repairable),
            (into_like(25.0), Self::Structural),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fails where the bounds are not those of two like trains, or classes are out of order.
    #[test]
    fn damage_classes_are_those_of_like_trains() {
        let mass_kg = 302_000.0;
        let bounds_j = Damage::bounds_j(mass_kg).map(|(bound_j, _)| bound_j);
        let v = 25.0 / 3.6;
        let before = 0.5 * mass_kg * v * v;
        let after = 0.5 * (2.0 * mass_kg) * (v / 2.0) * (v / 2.0);
        assert!((bounds_j[3] - (before - after) / 2.0).abs() < 1.0);
        assert!((bounds_j[0] - 2222.0).abs() < 1.0);
        let classes = [1e3, 1e4, 3e5, 1e6, 1e7].map(|e| Damage::of_hit(e, mass_kg));
        assert!(
            classes.windows(2).all(|pair| pair[0] < pair[1]),
            "{classes:?}"
        );
        assert_eq!(classes[4], Damage::BeyondDesign);
    }
}
