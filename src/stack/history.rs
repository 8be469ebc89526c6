//! The latest samples of a quantity, each with its time.

use crate::bus::SimTime;
use std::collections::VecDeque;

/// Samples kept: at 1 kHz the last half second, longer than a frame's read-out.
pub const KEPT: usize = 512;

/// The latest samples, in order of time.
#[derive(Clone, Debug)]
pub struct History<T>(VecDeque<(SimTime, T)>);

impl<T: Copy> Default for History<T> {
    fn default() -> Self {
        Self(VecDeque::with_capacity(KEPT))
    }
}

impl<T: Copy> History<T> {
    /// The last sample.
    pub fn latest(&self) -> Option<(SimTime, T)> {
        self.0.back().copied()
    }

    /// Appends a sample; one that is not newer than the last is dropped.
    pub fn push(&mut self, time: SimTime, value: T) {
        if self.latest().is_some_and(|(last, _)| time <= last) {
            return;
        }
        if self.0.len() == KEPT {
            self.0.pop_front();
        }
        self.0.push_back((time, value));
    }

    /// All samples that are kept, newest first.
    pub fn newest_first(&self) -> impl Iterator<Item = (SimTime, T)> + '_ {
        self.0.iter().rev().copied()
    }

    /// Whether samples of a time have been dropped.
    pub fn has_forgotten(&self, time: SimTime) -> bool {
        self.0.len() == KEPT && self.0.front().is_some_and(|(oldest, _)| time < *oldest)
    }

    /// The samples before and after a time, and its share of the way between them; the ends are
    /// held.
    pub fn around(&self, time: SimTime) -> Option<(T, T, f64)> {
        let mut after = self.latest()?;
        for before in self.newest_first() {
            if before.0 <= time {
                let span = after.0.since(before.0);
                let share = if span > 0.0 {
                    time.since(before.0) / span
                } else {
                    0.0
                };
                return Some((before.1, after.1, share.clamp(0.0, 1.0)));
            }
            after = before;
        }
        Some((after.1, after.1, 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A time is forgotten when its samples have been dropped, not before.
    #[test]
    fn times_are_forgotten_with_their_samples() {
        let mut history = History::default();
        for k in 0..=1000 {
            let kept = k < KEPT as i64 + 1;
            assert_eq!(history.has_forgotten(SimTime::from_nanos(0)), !kept);
            history.push(SimTime::from_nanos(k), k);
        }
        let oldest = 1001 - KEPT as i64;
        assert!(!history.has_forgotten(SimTime::from_nanos(oldest)));
        assert!(history.has_forgotten(SimTime::from_nanos(oldest - 1)));
    }
}
