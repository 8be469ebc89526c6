//! Importance sampling: runs drawn from elsewhere, weighted by the ratio of densities.

use super::rate::wilson;
use super::{Bounds, IntervalEstimate, z};
use serde::Serialize;

/// A rate from weighted runs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Weighted {
    /// The rate; `None` where too few runs decide it.
    pub rate: Option<IntervalEstimate>,
    /// Kish's effective number of the runs in which it happened: so many unweighted ones would be as
    /// precise.
    pub effective_events: f64,
    /// Runs in which it happened.
    pub events: usize,
    /// Runs of which it is not known whether it did.
    pub unknown: usize,
}

/// Weighted runs that are worth fewer than this give no figure: a few of them decide it, and intervals
/// hold the truth far less often than they say.
pub const LEAST_WORTH: f64 = 100.0;
/// Rates below this are known better with the weights as they are.
const RARE: f64 = 0.1;

/// The mean over the distributions that were asked for, of the natural logarithm of each run's weight
/// and a number. Weights are brought to mean 1, so that it does not depend on where the numbers' zero is;
/// the interval is that of a ratio (delta method), within the bounds that the numbers keep. `None` of
/// runs worth fewer than [`LEAST_WORTH`].
pub fn weighted_mean(runs: &[(f64, f64)], bounds: Bounds) -> Option<IntervalEstimate> {
    let ln_weights: Vec<f64> = runs.iter().map(|r| r.0).collect();
    if effective_runs(&ln_weights) < LEAST_WORTH {
        return None;
    }
    let (value, sigma) = estimate(runs, true)?;
    let bounds = bounds.kept_by(runs.iter().map(|r| r.1));
    let (low, high) = bounds.interval(value, z() * sigma);
    Some(IntervalEstimate {
        value,
        low,
        high,
        n: runs.len(),
    })
}

/// How often something happens over the distributions that were asked for, of the natural logarithm of
/// each run's weight and whether it happened there, `None` where that is not known: the interval reaches
/// from as if it had not to as if it had.
///
/// The weights have mean 1 by themselves, so that the estimate is without bias; where conditions cut draws
/// off (`normalise`), and of what is no rare event, they are brought to mean 1. The rate is given only
/// where the runs in which it happened are worth [`LEAST_WORTH`], and with weights that were brought to
/// mean 1 all runs.
pub fn weighted_rate(runs: &[(f64, Option<bool>)], normalise: bool) -> Weighted {
    let happened: Vec<f64> = (runs.iter())
        .filter(|(ln, h)| *h == Some(true) && ln.exp() > 0.0)
        .map(|r| r.0)
        .collect();
    let effective_events = effective_runs(&happened);
    let as_if = |unknown: bool| {
        let runs = runs
            .iter()
            .map(|(ln, h)| (*ln, f64::from(h.unwrap_or(unknown))));
        runs.collect::<Vec<_>>()
    };
    let (least, most) = (as_if(false), as_if(true));
    // One choice for both: each has an interval of its own.
    let normalise = normalise || estimate(&least, false).is_none_or(|(value, _)| value >= RARE);
    let all: Vec<f64> = runs.iter().map(|r| r.0).collect();
    let is_worth =
        effective_events >= LEAST_WORTH && (!normalise || effective_runs(&all) >= LEAST_WORTH);
    let rate = interval_of_rate(&least, normalise).filter(|_| is_worth);
    let rate = rate.map(|(value, low, _)| IntervalEstimate {
        value,
        low,
        high: interval_of_rate(&most, normalise).map_or(1.0, |(_, _, high)| high),
        n: runs.len(),
    });
    Weighted {
        rate,
        effective_events,
        events: happened.len(),
        unknown: runs.iter().filter(|r| r.1.is_none()).count(),
    }
}

/// Value and ends of a rate: Wilson's interval of as many runs as would know it as well without weights,
/// n = p (1 - p) / sigma^2 (Korn and Graubard, Survey Methodology 24 (1998)).
fn interval_of_rate(runs: &[(f64, f64)], normalise: bool) -> Option<(f64, f64, f64)> {
    let (value, sigma) = estimate(runs, normalise)?;
    let n = value * (1.0 - value) / (sigma * sigma);
    if !n.is_finite() || n <= 0.0 {
        return None;
    }
    let (low, high) = wilson(value, n);
    Some((value, low, high))
}

/// Value and standard deviation of a mean.
fn estimate(runs: &[(f64, f64)], normalise: bool) -> Option<(f64, f64)> {
    let n = runs.len();
    let weights: Vec<f64> = runs.iter().map(|(ln, _)| ln.exp()).collect();
    let sum: f64 = weights.iter().sum();
    if n < 2 || sum <= 0.0 || !sum.is_finite() {
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
    Some((value, (squares / (n - 1) as f64 / n as f64).sqrt()))
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
