//! A static test: the rig stands at one point after the other, as on the paper's bench.
//!
//! At every point the equipment starts anew, without odometer or prediction: the lamp's name must
//! be read from its stripes before there is a fix. The rig goes on to the next point when it has
//! its fixes, or after [`LIMIT_S`] without.

use super::costs::Observers;
use super::scheduler::Session;
use super::{Event, SessionError};
use crate::bus::SimTime;
use crate::scenario::BenchSettings;

/// How long a point is given to yield its fixes.
const LIMIT_S: f64 = 5.0;

/// The points of a bench.
pub struct Bench {
    settings: BenchSettings,
    /// Chainages of the head at the points to come, the next one last.
    to_come_m: Vec<f64>,
    /// Where the rig stands now, and since when.
    at: Option<(f64, SimTime)>,
    /// Fixes that it goes on with.
    wanted: usize,
}

impl Bench {
    /// Before the first point.
    pub fn new(settings: &BenchSettings) -> Self {
        let mut to_come_m: Vec<f64> = settings.heads_m().collect();
        to_come_m.reverse();
        Self {
            settings: *settings,
            to_come_m,
            at: None,
            wanted: 0,
        }
    }

    /// Moves the rig to its next point where it has its fixes, or waits no longer; whether it was at
    /// the last one.
    pub fn go_on(
        &mut self,
        session: &mut Session<'_>,
        observers: &mut Observers<'_, '_>,
    ) -> Result<bool, SessionError> {
        let now = session.world.time();
        let fixes = session.fixes();
        if let Some((head_m, since)) = self.at {
            if fixes < self.wanted && now.since(since) <= LIMIT_S {
                return Ok(false);
            }
            if fixes < self.wanted {
                let text = format!("no more fixes with the head at {head_m} m: gone on");
                observers.show(&Event::Note(now, &text))?;
            }
        }
        let Some(head_m) = self.to_come_m.pop() else {
            return Ok(true);
        };
        session.place_rig(head_m);
        self.wanted = fixes + self.settings.fixes_per_point as usize;
        self.at = Some((head_m, now));
        Ok(false)
    }
}

#[cfg(test)]
mod tests;
