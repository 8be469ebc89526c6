//! Importance sampling: runs drawn from elsewhere, weighted by the ratio of densities.

use super::{IntervalEstimate, z};
use serde::Serialize;

/// A rate from weighted runs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Weighted {
    /// The rate.
    pub rate: IntervalEstimate,
    /// Kish's effective number of the runs in which it happened: so many unweighted ones would be as
    /// precise. If few, do not trust the interval.
    pub effective_events: f64,
    /// Runs in which it happened.
    pub events: usize,
}

/// Weighted runs that are worth fewer than this give no mean: a few of them decide it, and intervals hold
/// the truth far less often than they say.
const LEAST_WORTH: f64 = 100.0;

/// The mean over the distributions that were asked for, of the natural logarithm of each run's weight
/// and a number. Weights are brought to mean 1, so that it does not depend on where the numbers' zero is;
/// the interval is that of a ratio (delta method). `None` of runs worth fewer than 100.
pub fn weighted_mean(runs: &[(f64, f64)]) -> Option<IntervalEstimate> {
    let ln_weights: Vec<f64> = runs.iter().map(|r| r.0).collect();
    if effective_runs(&ln_weights) < LEAST_WORTH {
        return None;
    }
    estimate(runs, true)
}

/// How often something happens over the distributions that were asked for. The weights have mean 1 by
/// themselves, so that the estimate is without bias; where runs are missing or conditions cut draws off
/// (`normalise`), they are brought to mean 1 over what is left. `None` of fewer than two runs.
pub fn weighted_rate(runs: &[(f64, bool)], normalise: bool) -> Option<Weighted> {
    let numbers = runs.iter().map(|(ln, h)| (*ln, f64::from(*h)));
    let mean = estimate(&numbers.collect::<Vec<_>>(), normalise)?;
    let happened: Vec<f64> = (runs.iter())
        .filter(|(ln, h)| *h && ln.exp() > 0.0)
        .map(|r| r.0)
        .collect();
    Some(Weighted {
        rate: IntervalEstimate {
            value: mean.value.min(1.0),
            low: mean.low.max(0.0),
            // Where it was never seen, nothing bounds it.
            high: if happened.is_empty() {
                1.0
            } else {
                mean.high.min(1.0)
            },
            ..mean
        },
        effective_events: effective_runs(&happened),
        events: happened.len(),
    })
}

fn estimate(runs: &[(f64, f64)], normalise: bool) -> Option<IntervalEstimate> {
    let n = runs.len();
    let weights: Vec<f64> = runs.iter().map(|(ln, _)| ln.exp()).collect();
    let sum: f64 = weights.iter().sum();
    if n < 2 || sum <= 0.0 {
        return None;
    }
    let scale = if normalise { n as f64 / sum } else { 1.0 };
    let share = |k: usize| scale * weights[k] * runs[k].1;
    let value = (0..n).map(share).sum::<f64>() / n as f64;
    let centre = |k: usize| {
        if normalise {
            scale * weights[k] * value
        } else {
            value
        }
    };
    let squares: f64 = (0..n).map(|k| (share(k) - centre(k)).powi(2)).sum();
    let sigma = (squares / (n - 1) as f64 / n as f64).sqrt();
    let z = z();
    Some(IntervalEstimate {
        value,
        low: value - z * sigma,
        high: value + z * sigma,
        n,
    })
}

/// Kish's effective number of runs of logarithms of weights: (sum w)^2 / sum w^2.
pub fn effective_runs(ln_weights: &[f64]) -> f64 {
    let top = ln_weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    // Of weight 0 all of them, or none at all.
    if top.exp() <= 0.0 {
        return 0.0;
    }
    let weights = || ln_weights.iter().map(|ln| (ln - top).exp());
    weights().sum::<f64>().powi(2) / weights().map(|w| w * w).sum::<f64>()
}
