//! Where the values of a figure can lie, and which of them are worse.

use super::Measure;
use super::stats::{Bounds, IntervalEstimate, quantile, quantile_of_lists};
use crate::record::parquet::Kind;
use serde::Serialize;

/// Ends of names of figures that have a sign: positions, and differences of them.
const SIGNED: [&str; 4] = ["stop_margin_m", "stop_error_m", "run_m", "_fix_error_m"];
/// Ends of names of shares.
const SHARES: [&str; 3] = ["_availability", "_uid_decode_rate", "_share"];
/// Ends of names of figures of which less is worse.
const LESS_IS_WORSE: [&str; 6] = [
    "_confident_share",
    "_availability",
    "_uid_decode_rate",
    "_fixes",
    "stop_margin_m",
    "least_wheel_load",
];
/// Ends of names of figures of which neither less nor more is worse: they say what a run was like.
const NEUTRAL: [&str; 9] = [
    "occupancy_switches",
    "obstacles",
    "dark_lamps",
    "brake_commanded_s",
    "stopped_s",
    "run_m",
    "_fix_range_m",
    "simulated_s",
    "_frames",
];

/// Figures of something that may not come about in a run, and the count of how often it did not: so many of their values
/// are censored.
const CENSORED: [(&str, &str); 2] = [
    ("occupancy_identified_max_m", "occupancy_never_identified"),
    ("occupancy_leg_m", "occupancy_never_identified"),
];

/// The name of the count of values of a figure that are censored.
pub(super) fn count_censored(name: &str) -> Option<&'static str> {
    let of = CENSORED.iter().find(|(figure, _)| *figure == name);
    of.map(|(_, count)| *count)
}

/// Which values of a figure are worse than others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum WorseSide {
    /// The larger ones.
    More,
    /// The smaller ones.
    Less,
    /// Those farther from 0.
    Farther,
    /// None.
    Neither,
}

impl Measure {
    fn is_one_of(&self, ends: &[&str]) -> bool {
        ends.iter().any(|end| self.name.ends_with(end))
    }

    /// What its values lie between.
    pub fn range(&self) -> Bounds {
        if self.kind == Kind::Flag || self.is_one_of(&SHARES) {
            Bounds::SHARE
        } else if self.is_one_of(&SIGNED) {
            Bounds::NONE
        } else {
            Bounds::NOT_NEGATIVE
        }
    }

    /// Which of its values are worse.
    pub fn worse_side(&self) -> WorseSide {
        if self.is_one_of(&LESS_IS_WORSE) {
            WorseSide::Less
        } else if self.is_one_of(&NEUTRAL) {
            WorseSide::Neither
        } else if self.is_one_of(&SIGNED) {
            WorseSide::Farther
        } else {
            WorseSide::More
        }
    }

    /// The larger, the worse: of a value with a sign its size, of others it or its negative. `None` where no
    /// value is worse.
    pub fn badness(&self, value: f64) -> Option<f64> {
        match self.worse_side() {
            WorseSide::More => Some(value),
            WorseSide::Less => Some(-value),
            WorseSide::Farther => Some(value.abs()),
            WorseSide::Neither => None,
        }
    }

    /// The value that a share `p` of the values is no worse than, from those of each run; of a figure with a sign its
    /// size. Where no side is worse, the value that this share is not above. An end that there are too few runs for is
    /// that of the range, where the values keep it.
    pub fn quantile(&self, runs: &[Vec<f64>], p: f64) -> Option<IntervalEstimate> {
        let side = self.worse_side();
        let share = if side == WorseSide::Less { 1.0 - p } else { p };
        let is_size = side == WorseSide::Farther;
        let number = |x: &f64| if is_size { x.abs() } else { *x };
        let lists = runs.iter().map(|run| run.iter().map(number).collect());
        let lists: Vec<Vec<f64>> = lists.collect();
        let mut sorted: Vec<f64> = lists.iter().flatten().copied().collect();
        sorted.sort_by(f64::total_cmp);
        let e = match self.kind {
            Kind::Reals => quantile_of_lists(&lists, share)?,
            _ => quantile(&sorted, share)?,
        };
        let bounds = if is_size {
            Bounds::NOT_NEGATIVE
        } else {
            self.range().kept_by(sorted)
        };
        Some(IntervalEstimate {
            low: e.low.max(bounds.low),
            high: e.high.min(bounds.high),
            ..e
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::MEASURES;

    /// A figure that was renamed, and whose bounds or worse side are then those of another.
    #[test]
    fn every_name_is_that_of_a_figure() {
        let ends = SHARES.iter().chain(&LESS_IS_WORSE).chain(&NEUTRAL);
        for end in ends.chain(&SIGNED) {
            assert!(MEASURES.iter().any(|m| m.name.ends_with(end)), "{end}");
        }
        for name in CENSORED.iter().flat_map(|(figure, count)| [figure, count]) {
            assert!(MEASURES.iter().any(|m| m.name == *name), "{name}");
        }
    }
}
