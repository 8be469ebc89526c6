//! What rows come to, and how sure that is. Intervals are of 95 %.
//!
//! | figure | interval | source |
//! |---|---|---|
//! | [`mean`] | Student's t | needs some 30 runs where errors are skew; two studies are held against each other by the mean of the differences between runs of the same index, which met the same chances |
//! | [`bounded_mean`] | the same in a scale that has no end at the bounds (logarithm, logit) | delta method: it never leaves the bounds; of two to four numbers that differ much it has no upper end |
//! | [`quantile`] | two order statistics, by the binomial distribution | exact for any distribution: David and Nagaraja, Order Statistics, 7.1 |
//! | [`mean_of_lists`] | Student's t of as many runs, of a ratio of sums over runs | Cochran, Sampling Techniques: the numbers of one run are not independent |
//! | [`quantile_of_lists`] | order statistics, as of so many independent numbers as know the share below as well | Woodruff, J. Am. Stat. Assoc. 47 (1952); Korn and Graubard 1998 |
//! | [`rate`] | Wilson's score, and Clopper and Pearson's exact one | Brown, Cai, DasGupta, Stat. Sci. 16 (2001) |
//! | [`weighted_mean`] | normal, within the bounds of the figure | importance sampling; none of runs worth fewer than 100 (Kish) |
//! | [`weighted_rate`] | Wilson's, of as many runs as would know it as well | the same; Korn and Graubard, Survey Methodology 24 (1998) |
//! | [`rank_correlation`] | Fisher's z (Bonett and Wright 2000) | Spearman |
//! | [`first_order`] | none | share of the variance that an input alone explains: Gamboa et al., Stat. Probab. Lett. 2022, from ranks, with any plan of independent inputs |
//! | [`first_order_of_groups`] | none | the same of an input that has names: Kelley's epsilon squared |
//!
//! A run of which it is not known whether an event happened stays in the denominator: the intervals of
//! [`Tally`] and [`weighted_rate`] reach from as if it had not to as if it had.
//!
//! The intervals take runs for independent. Those of a Latin hypercube lie more evenly, and its means
//! scatter by at most n / (n - 1) of that (Owen, SIAM J. Numer. Anal. 34 (1997)), mostly by less: its
//! intervals are wider than they need be, and Sobol's too wherever few variables act at a time.

mod bounds;
mod lists;
mod rate;
mod sample;
mod sensitivity;
mod weight;

pub use bounds::Bounds;
pub use lists::{mean_of_lists, quantile_of_lists};
pub use rate::{Rate, Tally, rate};
pub use sample::{Moments, bounded_mean, mean, quantile};
pub use sensitivity::{first_order, first_order_of_groups, rank_correlation};
pub use weight::{LEAST_WORTH, Weighted, effective_runs, weighted_mean, weighted_rate};

use serde::{Serialize, Serializer};
use statrs::distribution::{ContinuousCDF, Normal};
use std::fmt;

/// A figure with its interval of 95 %.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntervalEstimate {
    /// The figure.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Of how many runs.
    pub n: usize,
}

/// With as many digits as the shorter side of the interval allows; very small ones in powers of ten.
impl fmt::Display for IntervalEstimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // One side may be far the longer, or none at all.
        let sides = [self.value - self.low, self.high - self.value];
        let sides = sides.into_iter().filter(|s| s.is_finite() && *s > 0.0);
        let scale = sides.reduce(f64::min).unwrap_or(self.value.abs());
        let Self {
            value, low, high, ..
        } = self;
        if scale > 0.0 && scale < 1e-4 {
            return write!(f, "{value:.2e} ({low:.2e} to {high:.2e})");
        }
        let digits = if scale > 0.0 {
            (1.0 - scale.log10().floor()).max(0.0) as usize
        } else {
            0
        };
        write!(f, "{value:.digits$} ({low:.digits$} to {high:.digits$})")
    }
}

/// As it is shown.
impl Serialize for IntervalEstimate {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// What lies outside of an interval, on either side.
const TAIL: f64 = 0.025;

/// Half the width of a normal interval, in standard deviations: 1.96.
fn z() -> f64 {
    Normal::standard().inverse_cdf(1.0 - TAIL)
}

#[cfg(test)]
mod tests;
