//! How often something happens.

use super::{IntervalEstimate, TAIL, z};
use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF};

/// A rate with both intervals.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rate {
    /// Times that it happened.
    pub events: u64,
    /// Runs of which it is not known whether it did.
    pub unknown: u64,
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
    let estimate = |low: f64, high: f64| IntervalEstimate {
        value: k / m,
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
    let (low, high) = wilson(k / m, m);
    // Rounding would miss the ends.
    let wilson = estimate(
        if events == 0 { 0.0 } else { low },
        if events == n { 1.0 } else { high },
    );
    Some(Rate {
        events,
        unknown: 0,
        wilson,
        exact,
    })
}

/// Wilson's interval of a rate `p` that is as well known as by `n` independent runs.
pub(super) fn wilson(p: f64, n: f64) -> (f64, f64) {
    let z = z();
    let middle = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
    ((middle - half).max(0.0), (middle + half).min(1.0))
}

/// How often something happened, did not, and is not known to have.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    happened: u64,
    known: u64,
    runs: u64,
}

impl Tally {
    /// Of outcomes; `None` is one that is not known.
    pub fn of(outcomes: impl IntoIterator<Item = Option<bool>>) -> Self {
        let mut tally = Self::default();
        outcomes.into_iter().for_each(|outcome| tally.add(outcome));
        tally
    }

    /// Takes the outcome of a run.
    pub fn add(&mut self, outcome: Option<bool>) {
        self.happened += u64::from(outcome == Some(true));
        self.known += u64::from(outcome.is_some());
        self.runs += 1;
    }

    /// The rate in all runs. Those that are not known count as if it had not happened in them; the
    /// intervals reach from there to as if it had in all of them. `None` where nothing is known.
    pub fn rate(&self) -> Option<Rate> {
        let unknown = self.runs - self.known;
        let least = rate(self.happened, self.runs).filter(|_| self.known > 0)?;
        let most = rate(self.happened + unknown, self.runs)?;
        let to = |low: IntervalEstimate, high: IntervalEstimate| IntervalEstimate {
            high: high.high,
            ..low
        };
        Some(Rate {
            unknown,
            wilson: to(least.wilson, most.wilson),
            exact: to(least.exact, most.exact),
            ..least
        })
    }
}
