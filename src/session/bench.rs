//! A static test: the rig stands at one point after the other, as on the paper's bench.
//!
//! At every point the equipment starts anew, without odometer or prediction: the lamp's name must
//! be read from its stripes before there is a fix. The rig goes on to the next point when it has
//! its fixes, or after [`LIMIT_S`] without.

use crate::bus::SimTime;
use crate::scenario::BenchSettings;

/// How long a point is given to yield its fixes.
const LIMIT_S: f64 = 5.0;

/// The points of a bench.
pub struct Bench {
    fixes_per_point: usize,
    /// Chainages of the head at the points to come, the next one last.
    to_come_m: Vec<f64>,
    /// Where the rig stands now, and since when.
    at: Option<(f64, SimTime)>,
    /// Fixes that it goes on with.
    wanted: usize,
}

/// What the rig does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Move {
    /// It stays where it is.
    Stay,
    /// It goes to its next point.
    To {
        /// Chainage of the head there.
        head_m: f64,
        /// Chainage of the point that it leaves without all of its fixes.
        given_up_m: Option<f64>,
    },
    /// It was at its last point.
    Over,
}

impl Bench {
    /// Before the first point.
    pub fn new(settings: &BenchSettings) -> Self {
        let mut to_come_m: Vec<f64> = settings.heads_m().collect();
        to_come_m.reverse();
        Self {
            fixes_per_point: settings.fixes_per_point as usize,
            to_come_m,
            at: None,
            wanted: 0,
        }
    }

    /// What to do with so many fixes since the first point.
    pub fn next(&mut self, now: SimTime, fixes: usize) -> Move {
        let missing = fixes < self.wanted;
        let stays = |(_, since): &(f64, SimTime)| missing && now.since(*since) <= LIMIT_S;
        if self.at.as_ref().is_some_and(stays) {
            return Move::Stay;
        }
        let Some(head_m) = self.to_come_m.pop() else {
            return Move::Over;
        };
        let left = self.at.replace((head_m, now)).filter(|_| missing);
        self.wanted = fixes + self.fixes_per_point;
        Move::To {
            head_m,
            given_up_m: left.map(|(left_m, _)| left_m),
        }
    }
}

#[cfg(test)]
mod tests;
