//! Means and quantiles.

use super::{IntervalEstimate, TAIL};
use crate::session::quantile as interpolated;
use statrs::distribution::{Binomial, ContinuousCDF, DiscreteCDF, StudentsT};

/// The mean; `None` of fewer than two numbers.
pub fn mean(sample: &[f64]) -> Option<IntervalEstimate> {
    let n = sample.len();
    if n < 2 {
        return None;
    }
    let value = sample.iter().sum::<f64>() / n as f64;
    let squares: f64 = sample.iter().map(|x| (x - value).powi(2)).sum();
    let sigma = (squares / (n - 1) as f64 / n as f64).sqrt();
    let t = StudentsT::new(0.0, 1.0, (n - 1) as f64)
        .ok()?
        .inverse_cdf(1.0 - TAIL);
    Some(IntervalEstimate {
        value,
        low: value - t * sigma,
        high: value + t * sigma,
        n,
    })
}

/// The quantile p of sorted numbers, interpolated between order statistics as numpy does by default,
/// between the order statistics that hold the true one with 95 % at least. An end that the sample is
/// too small for is infinite.
pub fn quantile(sorted: &[f64], p: f64) -> Option<IntervalEstimate> {
    let n = sorted.len();
    if n == 0 {
        return None;
    }
    let below = Binomial::new(p, n as u64).ok()?;
    // X_(i) <= q in all but P(fewer than i lie below q) = F(i - 1) of all samples (i from 1).
    let i = (1..=n)
        .take_while(|i| below.cdf(*i as u64 - 1) <= TAIL)
        .last();
    let j = (1..=n).find(|j| below.cdf(*j as u64 - 1) >= 1.0 - TAIL);
    Some(IntervalEstimate {
        value: interpolated(sorted, p),
        low: i.map_or(f64::NEG_INFINITY, |i| sorted[i - 1]),
        high: j.map_or(f64::INFINITY, |j| sorted[j - 1]),
        n,
    })
}
