//! How often something happens.

use super::{IntervalEstimate, TAIL, z};
use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF};

/// A rate with both intervals.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rate {
    /// Times that it happened.
    pub events: u64,
    /// Wilson's score interval: right on average, short.
    pub wilson: IntervalEstimate,
    /// Clopper and Pearson's: right at least, for proofs.
    pub exact: IntervalEstimate,
}

/// Of `events` in `n` runs; `None` of no runs.
pub fn rate(events: u64, n: u64) -> Option<Rate> {
    if n == 0 || events > n {
        return None;
    }
    let (k, m) = (events as f64, n as f64);
    let p = k / m;
    let z = z();
    let middle = (p + z * z / (2.0 * m)) / (1.0 + z * z / m);
    let half = z / (1.0 + z * z / m) * (p * (1.0 - p) / m + z * z / (4.0 * m * m)).sqrt();
    let estimate = |low: f64, high: f64| IntervalEstimate {
        value: p,
        low,
        high,
        n: n as usize,
    };
    let beta = |a, b, u| Beta::new(a, b).map(|beta| beta.inverse_cdf(u)).ok();
    // Of no events, and of nothing else, there is no such distribution: the interval ends there.
    let exact = estimate(
        beta(k, m - k + 1.0, TAIL).unwrap_or(0.0),
        beta(k + 1.0, m - k, 1.0 - TAIL).unwrap_or(1.0),
    );
    // Rounding would miss the ends.
    let wilson = estimate(
        if events == 0 { 0.0 } else { middle - half },
        if events == n { 1.0 } else { middle + half },
    );
    Some(Rate {
        events,
        wilson,
        exact,
    })
}
