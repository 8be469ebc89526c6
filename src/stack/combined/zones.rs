//! What kind of line a route runs over, by place.

use super::mode::Zone;

/// A stretch of a route that is no plain line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZoneStretch {
    /// From here, metres along the route.
    pub from_m: f64,
    /// To here.
    pub to_m: f64,
    /// What it is.
    pub zone: Zone,
}

/// The kinds of line along a route.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Zones(Vec<ZoneStretch>);

impl Zones {
    /// Of stretches that may lie over each other: a covered junction is covered. All else is plain line.
    pub fn new(stretches: Vec<ZoneStretch>) -> Self {
        Self(stretches)
    }

    /// At a place.
    pub fn at(&self, place_m: f64) -> Zone {
        let here = || self.touching([place_m, place_m]);
        match here().any(|stretch| stretch.zone == Zone::Covered) {
            true => Zone::Covered,
            false => here().next().map_or(Zone::Plain, |stretch| stretch.zone),
        }
    }

    /// Whether all of a stretch lies under the open sky.
    pub fn is_open(&self, stretch_m: [f64; 2]) -> bool {
        self.touching(stretch_m)
            .all(|stretch| stretch.zone != Zone::Covered)
    }

    fn touching(&self, [from_m, to_m]: [f64; 2]) -> impl Iterator<Item = &ZoneStretch> {
        self.0
            .iter()
            .filter(move |stretch| stretch.from_m <= to_m && from_m <= stretch.to_m)
    }
}
