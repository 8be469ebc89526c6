//! How the train fared: whether it ran, braked for an obstacle, stood, hit something.

use super::summary::Protection;
use crate::bus::{BrakeDemand, ProtectionReport, SimTime};
use crate::twin::physics::{TrainState, World};

/// What a run came to.
#[derive(Default)]
pub struct Outcome {
    /// An obstacle ahead permits less than the driver aims at.
    slowed_by_obstacle: bool,
    brake_commanded: Option<SimTime>,
    stopped: Option<SimTime>,
    has_run: bool,
    standing_since: Option<SimTime>,
}

impl Outcome {
    /// A cycle of the protection, for a driver who aims at `aim_mps`.
    pub fn on_cycle(&mut self, now: SimTime, report: &ProtectionReport, aim_mps: f64) {
        self.slowed_by_obstacle =
            report.authority_end_m.is_some() && report.permitted_mps < aim_mps;
        if report.command.brake != BrakeDemand::None {
            self.brake_commanded.get_or_insert(now);
        }
    }

    /// Follows whether the train has run, and since when it stands.
    pub fn on_motion(&mut self, train: &TrainState) {
        self.has_run |= !train.standing;
        // A driver who obeys brakes before the equipment has to.
        if self.slowed_by_obstacle && train.brake_mps2 > 0.0 {
            self.brake_commanded.get_or_insert(train.time);
        }
        if !train.standing {
            self.standing_since = None;
            return;
        }
        self.standing_since.get_or_insert(train.time);
        if self.brake_commanded.is_some() {
            self.stopped.get_or_insert(train.time);
        }
    }

    /// For how long the train has stood again after it ran.
    pub fn stood_s(&self, now: SimTime) -> Option<f64> {
        let since = self.standing_since.filter(|_| self.has_run)?;
        Some(now.since(since))
    }

    /// The figures; `None` without a train.
    pub fn protection(&self, world: &World) -> Option<Protection> {
        let head_m = world.head_m()?;
        let margins_m = world
            .obstacles()
            .map(|o| o.chainage_m - 0.5 * o.size_m.x - head_m)
            .filter(|margin_m| *margin_m > -1.0);
        Some(Protection {
            brake_commanded_s: self.brake_commanded.map(SimTime::secs),
            stopped_s: self.stopped.map(SimTime::secs),
            stop_margin_m: self.stopped.and(margins_m.min_by(f64::total_cmp)),
            collision: world.collision().is_some(),
        })
    }
}
