//! The decision of one cycle: limits at this place, and what the speed means against them.

use super::ProtectionSettings;
use super::adhesion::{Grip, STANDING_MPS};
use super::curve::{BrakeModel, Grades, overlap_m};
use super::position::HeadPosition;
use crate::bus::{BrakeDemand, SimTime, Supervision};

/// Where the permitted speed is under this, the end of the authority is reached: the brake
/// stops the train and holds it.
const HOLD_UNDER_MPS: f64 = 1.0;

/// Speed limits at the train's place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Limits {
    pub permitted_mps: f64,
    pub service_mps: f64,
    pub emergency_mps: f64,
    /// An obstacle, not the line, sets them.
    pub by_obstacle: bool,
}

#[derive(Clone, Debug)]
pub(super) struct Supervisor {
    service: BrakeModel,
    emergency: BrakeModel,
    overlap_m: f64,
    settings: ProtectionSettings,
    state: Supervision,
    /// Since when the emergency brake is demanded.
    emergency_since: Option<SimTime>,
}

impl Supervisor {
    pub fn new(settings: &ProtectionSettings) -> Self {
        Self {
            service: BrakeModel::service(settings),
            emergency: BrakeModel::emergency(settings),
            overlap_m: overlap_m(settings, settings.speed_error_kmh / 3.6),
            settings: settings.clone(),
            state: Supervision::Permitted,
            emergency_since: None,
        }
    }

    /// Limits under a ceiling speed, with an obstacle from `obstacle_m` on, if any.
    pub fn limits(
        &self,
        grades: &Grades,
        ceiling_mps: f64,
        train: Option<HeadPosition>,
        obstacle_m: Option<f64>,
        grip: Grip,
    ) -> Limits {
        let s = &self.settings;
        let line = Limits {
            permitted_mps: ceiling_mps,
            service_mps: ceiling_mps + s.service_margin_kmh / 3.6,
            emergency_mps: ceiling_mps + s.emergency_margin_kmh / 3.6,
            by_obstacle: false,
        };
        let (Some(train), Some(obstacle_m)) = (train, obstacle_m) else {
            return line;
        };
        // The emergency brake answers for the train's foremost possible head, the service brake
        // for its likely one, far enough before.
        let ahead_m = s.position_sigmas * train.sigma_m;
        let danger_m = obstacle_m - s.danger_distance_m;
        let stop_m = (obstacle_m - s.safety_distance_m).min(danger_m - ahead_m - self.overlap_m);
        let emergency = self.emergency_now(grip);
        let fastest = emergency.speed_mps(grades, train.chainage_m + ahead_m, danger_m, 0.0);
        let error_mps = s.speed_error_kmh / 3.6 + grip.slide_error_mps;
        let emergency_mps = (fastest - error_mps).max(0.0);
        let service_mps = self
            .service
            .speed_mps(grades, train.chainage_m, stop_m, 0.0)
            .min(emergency_mps);
        let permitted_mps = self
            .service
            .speed_mps(grades, train.chainage_m, stop_m, s.driver_time_s)
            .min(service_mps);
        Limits {
            permitted_mps: line.permitted_mps.min(permitted_mps),
            service_mps: line.service_mps.min(service_mps),
            emergency_mps: line.emergency_mps.min(emergency_mps),
            by_obstacle: permitted_mps < line.permitted_mps,
        }
    }

    /// The emergency brake on the rails as they are, were it demanded now: an intervention has cut
    /// traction already.
    fn emergency_now(&self, grip: Grip) -> BrakeModel {
        let emergency = BrakeModel {
            rate_mps2: grip.emergency_mps2,
            ..self.emergency
        };
        match self.state {
            Supervision::Permitted | Supervision::Warning => emergency,
            Supervision::Service | Supervision::Emergency => emergency.traction_is_cut(),
        }
    }

    /// The same, demanded when it was, or now.
    pub fn emergency_at(&self, time: SimTime, grip: Grip) -> BrakeModel {
        let emergency = self.emergency_now(grip);
        match self.emergency_since {
            Some(since) => emergency.demanded_for(time.since(since)),
            None => emergency,
        }
    }

    /// The state after this cycle. `must_stop` brakes whatever the speed, up to the emergency
    /// brake when `at_once`. A train of unknown speed, or whose wheels slide, is taken to move.
    pub fn step(
        &mut self,
        time: SimTime,
        limits: Limits,
        speed_mps: Option<f64>,
        slides: bool,
        must_stop: bool,
        at_once: bool,
    ) -> Supervision {
        let hold = must_stop || (limits.by_obstacle && limits.permitted_mps < HOLD_UNDER_MPS);
        let moving = slides || speed_mps.is_none_or(|v| v > STANDING_MPS);
        let speed_mps = speed_mps.unwrap_or(0.0);
        let wanted = if moving && (at_once || speed_mps > limits.emergency_mps) {
            Supervision::Emergency
        } else if hold || at_once || speed_mps > limits.service_mps {
            Supervision::Service
        } else if speed_mps > limits.permitted_mps {
            Supervision::Warning
        } else {
            Supervision::Permitted
        };
        self.state = match self.state {
            // The emergency brake is released at a standstill only, the service brake when the
            // speed is permitted again.
            Supervision::Emergency if moving => Supervision::Emergency,
            Supervision::Service if wanted == Supervision::Warning => Supervision::Service,
            _ => wanted,
        };
        let emergency = self.state == Supervision::Emergency;
        self.emergency_since = emergency.then(|| self.emergency_since.unwrap_or(time));
        self.state
    }
}

/// The brake that belongs to a state.
pub(super) fn demand(state: Supervision) -> BrakeDemand {
    match state {
        Supervision::Permitted | Supervision::Warning => BrakeDemand::None,
        Supervision::Service => BrakeDemand::Service,
        Supervision::Emergency => BrakeDemand::Emergency,
    }
}
