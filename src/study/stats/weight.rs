//! Importance sampling: runs drawn from elsewhere, weighed by the ratio of densities.

use super::{Estimate, TAIL};
use statrs::distribution::{ContinuousCDF, Normal};

/// A rate from weighed runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weighted {
    /// The rate.
    pub rate: Estimate,
    /// So many runs drawn as nature draws would know it as well, among those in which it happened. Few
    /// mean that a handful of runs decide, and the interval is not to be trusted.
    pub effective_events: f64,
    /// Runs in which it happened.
    pub events: usize,
}

/// The mean over the distributions that were asked for, of the natural logarithm of each run's weight
/// and a number; `None` of fewer than two runs. The weights have mean 1 by themselves, so the estimate is
/// without bias; where runs are missing or conditions cut draws off (`normalise`), they are brought to
/// mean 1 over what is left.
pub fn weighted_mean(runs: &[(f64, f64)], normalise: bool) -> Option<Estimate> {
    let n = runs.len();
    if n < 2 {
        return None;
    }
    let weights: Vec<f64> = runs.iter().map(|(ln, _)| ln.exp()).collect();
    let sum: f64 = weights.iter().sum();
    let scale = if normalise { n as f64 / sum } else { 1.0 };
    let share = |k: usize| scale * weights[k] * runs[k].1;
    let value = (0..n).map(share).sum::<f64>() / n as f64;
    // Of a ratio, by its linearisation.
    let centre = |k: usize| {
        if normalise {
            scale * weights[k] * value
        } else {
            value
        }
    };
    let squares: f64 = (0..n).map(|k| (share(k) - centre(k)).powi(2)).sum();
    let sigma = (squares / (n - 1) as f64 / n as f64).sqrt();
    let z = Normal::standard().inverse_cdf(1.0 - TAIL);
    Some(Estimate {
        value,
        low: value - z * sigma,
        high: value + z * sigma,
        n,
    })
}

/// How often something happens: [`weighted_mean`] of whether it did.
pub fn weighted_rate(runs: &[(f64, bool)], normalise: bool) -> Option<Weighted> {
    let numbers = runs.iter().map(|(ln, h)| (*ln, f64::from(u8::from(*h))));
    let mean = weighted_mean(&numbers.collect::<Vec<_>>(), normalise)?;
    let happened: Vec<f64> = runs.iter().filter(|r| r.1).map(|r| r.0).collect();
    Some(Weighted {
        rate: Estimate {
            low: mean.low.max(0.0),
            // Where it was never seen, nothing bounds it.
            high: if happened.is_empty() { 1.0 } else { mean.high },
            ..mean
        },
        effective_events: effective_runs(&happened),
        events: happened.len(),
    })
}

/// Kish's effective number of runs of logarithms of weights: (sum w)^2 / sum w^2.
pub fn effective_runs(ln_weights: &[f64]) -> f64 {
    let top = ln_weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if !top.is_finite() {
        return 0.0;
    }
    let weights = || ln_weights.iter().map(|ln| (ln - top).exp());
    weights().sum::<f64>().powi(2) / weights().map(|w| w * w).sum::<f64>()
}
