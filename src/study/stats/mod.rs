//! What rows come to, and how sure that is. Intervals are of 95 %.
//!
//! | figure | interval | source |
//! |---|---|---|
//! | [`mean`] | Student's t | needs some 30 runs where errors are skew |
//! | [`quantile`] | two order statistics, by the binomial distribution | exact for any distribution: David and Nagaraja, Order Statistics, 7.1 |
//! | [`rate`] | Wilson's score, and Clopper and Pearson's exact one | Brown, Cai, DasGupta, Stat. Sci. 16 (2001) |
//! | [`paired_difference`] | Student's t of the differences | runs of the same index meet the same chances |
//! | [`weighted_rate`] | normal | importance sampling; with the effective number of runs (Kish) |
//! | [`rank_correlation`] | Fisher's z (Bonett and Wright 2000) | Spearman |
//! | [`first_order`] | none | share of the variance that an input alone explains: Gamboa et al., Stat. Probab. Lett. 2022, from ranks, with any plan of independent inputs |

mod rank;
mod rate;
mod sample;
mod weight;

pub use rank::{first_order, rank_correlation};
pub use rate::{Rate, rate};
pub use sample::{mean, paired_difference, quantile};
pub use weight::{Weighted, effective_runs, weighted_rate};

/// A figure with its interval of 95 %.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The figure.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Of how many runs.
    pub n: usize,
}

/// What lies outside of an interval, on either side.
const TAIL: f64 = 0.025;

#[cfg(test)]
mod tests;
