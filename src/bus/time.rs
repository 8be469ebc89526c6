//! Time since the scenario's start.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Integer nanoseconds since the scenario's start: adding steps never drifts, and equal times
/// compare equal. Sums saturate at 292 years from the start.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct SimTime(i64);

impl SimTime {
    /// The scenario's start.
    pub const ZERO: Self = Self(0);

    /// From integer nanoseconds.
    pub const fn from_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    /// From seconds, rounded to the nearest nanosecond.
    pub fn from_secs(seconds: f64) -> Self {
        Self((seconds * 1e9).round() as i64)
    }

    /// Integer nanoseconds since the start.
    pub const fn nanos(self) -> i64 {
        self.0
    }

    /// Seconds since the start.
    pub fn secs(self) -> f64 {
        self.0 as f64 * 1e-9
    }

    /// This time plus `seconds` (which may be negative).
    #[must_use]
    pub fn plus(self, seconds: f64) -> Self {
        Self(self.0.saturating_add(Self::from_secs(seconds).0))
    }

    /// Seconds from `earlier` to this time.
    pub fn since(self, earlier: Self) -> f64 {
        self.0.saturating_sub(earlier.0) as f64 * 1e-9
    }
}

/// What happens at a fixed rate: number k at k / rate.
#[derive(Clone, Copy, Debug)]
pub struct Ticker {
    rate_hz: f64,
    next: u32,
}

impl Ticker {
    /// Number 0 is due at time zero.
    pub fn new(rate_hz: f64) -> Self {
        Self { rate_hz, next: 0 }
    }

    /// Number and time of the next.
    pub fn next(&self) -> (u32, SimTime) {
        let seconds = f64::from(self.next) / self.rate_hz;
        (self.next, SimTime::from_secs(seconds))
    }

    /// The next one, if it is due, `delay_s` after its time; moves on if so.
    pub fn due(&mut self, now: SimTime, delay_s: f64) -> Option<(u32, SimTime)> {
        self.next_if(|time| now >= time.plus(delay_s))
    }

    /// The next one, if it is due by its time; moves on if so.
    pub fn next_if(&mut self, due: impl FnOnce(SimTime) -> bool) -> Option<(u32, SimTime)> {
        let (number, time) = self.next();
        due(time).then(|| {
            self.next = self.next.saturating_add(1);
            (number, time)
        })
    }
}

impl fmt::Display for SimTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3} s", self.secs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Provokes: a sum beyond the longest time that comes out early, and a slow clock that is due at
    /// every step.
    #[test]
    fn what_is_too_late_never_comes() {
        let late = SimTime::from_secs(5.0).plus(1e10);
        assert!(late > SimTime::from_secs(1e9));
        assert!(late.since(SimTime::from_secs(-1e10)) > 9e9);
        let mut ticker = Ticker::new(1e-10);
        let due = (0..3).filter_map(|_| ticker.due(SimTime::from_secs(5.0), 0.05));
        assert_eq!(due.count(), 1);
    }
}
