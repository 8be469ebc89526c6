//! Chainage as the line states it: with a prefix and an offset, growing or falling, and with jumps.
//!
//! Inside, a place on a track is its length from where the track begins. Plans, kilometre posts and people state
//! another number: it begins somewhere else, may fall along the track, and jumps where the line was realigned and
//! nobody wanted to number the rest of it anew. Such a chainage equation, `DK14+200 = DK14+185.3`, says what is
//! stated up to a place (back) and from there on (ahead). It makes a long chain where chainages are stated twice,
//! and a short chain where some are left out.
//!
//! ```
//! use metrotwin::track::Tunnel;
//!
//! let tunnel = Tunnel::from_toml(
//!     r#"
//!     name = "realigned"
//!
//!     [stated_chainage]
//!     prefix = "DK"
//!     start_m = 13700.0
//!     equations = [{ chainage_m = 500.0, back_m = 14200.0, ahead_m = 14185.3 }]
//!
//!     [[plan]]
//!     kind = "straight"
//!     length_m = 1000.0
//!     "#,
//! )?;
//! let stated = tunnel.first_track().stated_chainage.as_ref().unwrap();
//! assert_eq!(stated.text(40.0, 3), "DK13+740.000");
//! assert_eq!(stated.text(490.0, 3), "DK14+190.000 R1");
//! assert!((stated.place("DK14+190 R2").unwrap() - 504.7).abs() < 1e-9);
//! let error = stated.place("DK14+190").unwrap_err();
//! assert_eq!(
//!     error.to_string(),
//!     "`DK14+190` is stated at several places; write one of `DK14+190.000 R1`, `DK14+190.000 R2`"
//! );
//! # Ok::<(), metrotwin::settings::FileError>(())
//! ```
//!
//! Equations part a track into regions, R1, R2 and so on from its begin. A text names its region where its chainage is
//! stated in another one too, as is done in road and rail design (GEOPAK and OpenRail write it so).
//!
//! Terms after LandXML 1.2 (`Alignment/@staStart`, `StaEquation` with `@staInternal`, `@staBack`, `@staAhead`,
//! `@staIncrement`); railML 3 has the same as `anchor`s of a `linearPositioningSystem`, and as `mileageChange`.
//!
//! Not here: counting that turns round at an equation, which LandXML knows and railML does not; a track that does so
//! is written as two.

mod text;

pub use text::ChainageError;

use super::file::{Increment, StatedChainageEntry};
use std::ops::RangeInclusive;

/// Texts are written to the millimetre, and so lie so far off at most.
const ROUNDING_M: f64 = 0.5e-3 + 1e-9;

/// What a track states, and where: chainages with a prefix and an offset that grow or fall along the track and jump
/// at chainage equations, in the terms of LandXML 1.2 (`staStart`, `staIncrement`, `StaEquation`). Regions between
/// equations are counted R1, R2 and so on, and tell the places apart that a long chain states alike.
#[derive(Clone, Debug, PartialEq)]
pub struct StatedChainage {
    prefix: String,
    /// 1 where it grows along the track, -1 where it falls.
    sign: f64,
    /// In order along the track; at least one.
    regions: Vec<ChainageRegion>,
}

/// A stretch of a track without a jump.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ChainageRegion {
    /// Where it begins and ends, from the begin of the track.
    from_m: f64,
    to_m: f64,
    /// Stated where it begins.
    start_m: f64,
    sign: f64,
}

impl ChainageRegion {
    fn stated_m(&self, s_m: f64) -> f64 {
        self.start_m + self.sign * (s_m - self.from_m)
    }

    /// All that it states.
    fn range_m(&self) -> RangeInclusive<f64> {
        let end_m = self.stated_m(self.to_m);
        self.start_m.min(end_m)..=self.start_m.max(end_m)
    }

    /// Whether it states a chainage, as near as texts are.
    fn states(&self, stated_m: f64) -> bool {
        let range_m = self.range_m();
        (range_m.start() - ROUNDING_M..=range_m.end() + ROUNDING_M).contains(&stated_m)
    }

    /// Where it states a chainage, if it does.
    fn place_m(&self, stated_m: f64) -> Option<f64> {
        let s_m = self.from_m + self.sign * (stated_m - self.start_m);
        self.states(stated_m)
            .then(|| s_m.max(self.from_m).min(self.to_m))
    }
}

/// A jump of what is stated, as surveyors call it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChainageEquation {
    /// Where, metres from the begin of the track.
    pub at_m: f64,
    /// Stated up to there, metres.
    pub back_m: f64,
    /// Stated from there on, metres.
    pub ahead_m: f64,
    /// By how much the track is longer than stated, metres: positive at a long chain, negative at a short one.
    pub longer_m: f64,
}

impl StatedChainage {
    /// Of a track of a length, as written.
    pub(super) fn of(entry: &StatedChainageEntry, length_m: f64) -> Self {
        let sign = match entry.increment {
            Increment::Increasing => 1.0,
            Increment::Decreasing => -1.0,
        };
        let equations = entry.equations.iter();
        let ends = equations.clone().map(|e| e.chainage_m).chain([length_m]);
        let begins = equations.map(|e| (e.chainage_m, e.ahead_m));
        let begins = [(0.0, entry.start_m)].into_iter().chain(begins);
        let regions = begins
            .zip(ends)
            .map(|((from_m, start_m), to_m)| ChainageRegion {
                from_m,
                to_m,
                start_m,
                sign,
            });
        Self {
            prefix: entry.prefix.clone(),
            sign,
            regions: regions.collect(),
        }
    }

    /// What is stated at a place, metres; at a jump what is stated from there on. The first and the last region go
    /// on beyond the ends of the track.
    pub fn stated_m(&self, s_m: f64) -> f64 {
        self.regions[self.region_at(s_m)].stated_m(s_m)
    }

    /// All places where a chainage is stated, in order along the track; none in the gap of a short chain.
    pub fn places_m(&self, stated_m: f64) -> Vec<f64> {
        let places = self.regions.iter().filter_map(|r| r.place_m(stated_m));
        let mut places: Vec<f64> = places.collect();
        // Both sides of a jump, where that is no more than texts are rounded.
        places.dedup_by(|a, b| (*a - *b).abs() <= 2.0 * ROUNDING_M);
        places
    }

    /// Its jumps, in order along the track.
    pub fn equations(&self) -> impl Iterator<Item = ChainageEquation> + '_ {
        self.regions.windows(2).map(|pair| {
            let (at_m, ahead_m) = (pair[1].from_m, pair[1].start_m);
            let back_m = pair[0].stated_m(at_m);
            ChainageEquation {
                at_m,
                back_m,
                ahead_m,
                longer_m: self.sign * (back_m - ahead_m),
            }
        })
    }

    /// As met by who runs down the track, of that length: what a place states stays.
    pub(super) fn reversed(&self, length_m: f64) -> Self {
        let regions = self.regions.iter().rev().map(|region| ChainageRegion {
            from_m: length_m - region.to_m,
            to_m: length_m - region.from_m,
            start_m: region.stated_m(region.to_m),
            sign: -region.sign,
        });
        Self {
            prefix: self.prefix.clone(),
            sign: -self.sign,
            regions: regions.collect(),
        }
    }

    fn region_at(&self, s_m: f64) -> usize {
        self.regions[1..].partition_point(|r| r.from_m <= s_m)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests;
