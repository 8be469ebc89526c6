//! Whether the brake does what was demanded: after the time that it needs to build up, the
//! measured deceleration must be at least half of what is expected. While the wheelset slides its
//! deceleration says nothing of the train's.

use super::ProtectionSettings;
use super::adhesion::{Grip, STANDING_MPS};
use super::curve::Grades;
use crate::bus::{BrakeDemand, SimTime};

/// Over this time deceleration is measured.
const WINDOW_S: f64 = 1.0;
/// Below this speed the odometer says too little.
const SLOWEST_MPS: f64 = 1.5;

#[derive(Clone, Debug)]
pub(super) struct BrakeMonitor {
    /// From a demand to the full brake.
    answer_s: f64,
    demand: BrakeDemand,
    since: SimTime,
    /// Start of the running window: time and speed.
    window: Option<(SimTime, f64)>,
    failed: bool,
}

impl BrakeMonitor {
    pub fn new(s: &ProtectionSettings) -> Self {
        Self {
            answer_s: s.reaction_s + s.traction_cut_s + s.brake_buildup_s,
            demand: BrakeDemand::None,
            since: SimTime::default(),
            window: None,
            failed: false,
        }
    }

    /// Takes what was demanded in the last cycle and what speed there is now; true while the
    /// brake counts as failed, which it does until the train stands.
    pub fn update(
        &mut self,
        time: SimTime,
        demand: BrakeDemand,
        speed_mps: f64,
        at_m: Option<f64>,
        grades: &Grades,
        grip: Grip,
    ) -> bool {
        if demand != self.demand {
            self.demand = demand;
            self.since = time;
            self.window = None;
        }
        let rate = match demand {
            BrakeDemand::None => return self.failed,
            BrakeDemand::Service => grip.service_mps2,
            BrakeDemand::Emergency => grip.emergency_mps2,
        };
        if grip.slides || speed_mps < SLOWEST_MPS {
            self.window = None;
            self.failed &= grip.slides || speed_mps > STANDING_MPS;
            return self.failed;
        }
        if time.since(self.since) < self.answer_s {
            return self.failed;
        }
        match self.window {
            None => self.window = Some((time, speed_mps)),
            Some((start, before)) if time.since(start) >= WINDOW_S => {
                let measured = (before - speed_mps) / time.since(start);
                // Without a position the gradient is unknown, and taken as level.
                let expected = rate - at_m.map_or(0.0, |s| grades.pull_mps2(s));
                self.failed |= measured < 0.5 * expected;
                self.window = Some((time, speed_mps));
            }
            Some(_) => {}
        }
        self.failed
    }
}
