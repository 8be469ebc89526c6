//! Where the values of a figure can lie, and which of them are worse.

use super::Measure;
use super::stats::Bounds;
use crate::record::parquet::Kind;

/// Figures that have a sign: positions, and differences of them.
const SIGNED: [&str; 3] = ["stop_margin_m", "stop_error_m", "run_m"];
/// Ends of names of shares.
const SHARES: [&str; 2] = ["_availability", "_uid_decode_rate"];
/// Ends of names of figures of which less is worse.
const LESS_IS_WORSE: [&str; 8] = [
    "_availability",
    "_uid_decode_rate",
    "_fixes",
    "_frames",
    "stop_margin_m",
    "least_wheel_load",
    "run_m",
    "simulated_s",
];

impl Measure {
    /// What its values lie between.
    pub fn range(&self) -> Bounds {
        let is_share = SHARES.iter().any(|end| self.name.ends_with(end));
        if self.kind == Kind::Flag || is_share {
            Bounds::SHARE
        } else if SIGNED.contains(&self.name) {
            Bounds::NONE
        } else {
            Bounds::NOT_NEGATIVE
        }
    }

    /// The larger, the worse: of a value with a sign its size, of others it or its negative.
    pub fn badness(&self, value: f64) -> f64 {
        if LESS_IS_WORSE.iter().any(|end| self.name.ends_with(end)) {
            -value
        } else if SIGNED.contains(&self.name) {
            value.abs()
        } else {
            value
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::MEASURES;

    /// A figure that was renamed, and whose bounds or worse side are then those of another.
    #[test]
    fn every_name_is_that_of_a_figure() {
        let ends = SHARES.iter().chain(&LESS_IS_WORSE).chain(&SIGNED);
        for end in ends {
            assert!(MEASURES.iter().any(|m| m.name.ends_with(end)), "{end}");
        }
    }
}
