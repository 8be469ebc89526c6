//! The automatic driver and the brake.
//!
//! The driver aims at the lowest of cruise speed, permitted speed (less a margin) and the way to
//! the stop mark, with limited acceleration and jerk. The protection's demands go past him:
//! traction is cut at once and the brake builds up in its time; an emergency brake stays until
//! the train stands, even where the demand is gone earlier. After it the driver waits: he may start
//! again when he has asked.

use super::settings::TrainSettings;
use crate::bus::{BrakeDemand, TrainCommand};
use crate::track::network::SpeedLimit;

/// How far the driver stays under the permitted speed.
const MARGIN_MPS: f64 = 0.5;
/// Below this the train stands.
pub(super) const STANDING_MPS: f64 = 0.01;
/// Speed error that the driver answers with 1 m/s^2, before the jerk limit.
const GAIN_PER_S: f64 = 1.5;
/// Share of the service brake that the driver plans with to stop at the mark.
const PLANNED_SHARE: f64 = 0.7;
/// A train that stands this near to a station's mark has stopped at it.
const AT_STATION_M: f64 = 5.0;
/// A limit is kept from so far before it.
const LIMIT_EARLY_M: f64 = 5.0;
/// Closer than this to the mark he just holds the brake.
const AT_MARK_M: f64 = 0.02;

/// What the train does, as the driver's instruments show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Instruments {
    pub time_s: f64,
    pub chainage_m: f64,
    pub speed_mps: f64,
    /// Deceleration by gradient and running resistance.
    pub resistance_mps2: f64,
}

/// Accelerations asked of the traction and of the brake, both positive.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Effort {
    pub traction_mps2: f64,
    pub brake_mps2: f64,
}

/// Where the driver is to stop and to run slowly, along the route.
#[derive(Clone, Debug, Default)]
pub(super) struct Timetable {
    /// Stations, in order.
    pub calls_m: Vec<f64>,
    /// The end of the run.
    pub stop_m: Option<f64>,
    /// The whole train keeps to these.
    pub limits: Vec<SpeedLimit>,
}

/// Driver and brake control.
#[derive(Clone, Debug)]
pub(super) struct AutomaticDriver {
    settings: TrainSettings,
    timetable: Timetable,
    /// Length of the train.
    length_m: f64,
    /// So many stations are behind it.
    called: usize,
    /// When it may leave the one at which it stands, seconds.
    leaves_s: Option<f64>,
    /// Driver's lever: traction over zero, brake below.
    lever_mps2: f64,
    /// Deceleration that the protection's demand has built up.
    demanded_mps2: f64,
    emergency: bool,
    /// After an emergency stop: when the driver may start again, seconds.
    may_start_s: f64,
}

impl AutomaticDriver {
    pub(super) fn new(settings: &TrainSettings, timetable: Timetable) -> Self {
        let standing = settings.start_speed_kmh < 3.6 * STANDING_MPS;
        Self {
            settings: settings.clone(),
            timetable,
            length_m: settings.length_m(),
            called: 0,
            leaves_s: None,
            // A standing train starts with its brake on.
            lever_mps2: if standing {
                -settings.service_brake_mps2
            } else {
                0.0
            },
            demanded_mps2: 0.0,
            emergency: false,
            may_start_s: f64::NEG_INFINITY,
        }
    }

    /// One step of `dt_s`.
    pub(super) fn step(
        &mut self,
        now: &Instruments,
        command: &TrainCommand,
        signal_m: Option<f64>,
        dt_s: f64,
    ) -> Effort {
        let standing = now.speed_mps.abs() < STANDING_MPS;
        self.emergency = command.brake == BrakeDemand::Emergency || self.emergency && !standing;
        let demand = if self.emergency {
            self.may_start_s = now.time_s + self.settings.restart_after_s;
            BrakeDemand::Emergency
        } else {
            command.brake
        };
        self.build_up(demand, dt_s);
        self.call(now, standing);
        let mut wanted = self.wanted(now, command.permitted_speed_mps, signal_m);
        if demand != BrakeDemand::None {
            // Traction is cut at once, and the lever stays out of power.
            self.lever_mps2 = self.lever_mps2.min(0.0);
            wanted = wanted.min(0.0);
        }
        let most = self.settings.jerk_mps3 * dt_s;
        self.lever_mps2 += (wanted - self.lever_mps2).clamp(-most, most);
        Effort {
            traction_mps2: self.lever_mps2.max(0.0),
            brake_mps2: self.demanded_mps2.max(-self.lever_mps2),
        }
    }

    /// Another way than his own, from a distance on: he stops, and does not go on.
    pub(super) fn diverted(&mut self, limits: Vec<SpeedLimit>, from_m: f64) {
        self.timetable = Timetable {
            calls_m: Vec::new(),
            stop_m: Some(from_m),
            limits,
        };
        self.leaves_s = None;
    }

    /// It stands at a station, on its way.
    pub(super) fn dwells(&self) -> bool {
        self.leaves_s.is_some()
    }

    /// Where it is to stop next.
    fn next_stop_m(&self) -> Option<f64> {
        let call_m = self.timetable.calls_m.get(self.called).copied();
        call_m.or(self.timetable.stop_m)
    }

    /// Stands at a station for its time.
    fn call(&mut self, now: &Instruments, standing: bool) {
        let Some(call_m) = self.timetable.calls_m.get(self.called) else {
            return;
        };
        let at_station = standing && (call_m - now.chainage_m).abs() < AT_STATION_M;
        if at_station && self.leaves_s.is_none() {
            self.leaves_s = Some(now.time_s + self.settings.dwell_s);
        }
        if self.leaves_s.is_some_and(|leaves_s| now.time_s >= leaves_s) {
            self.leaves_s = None;
            self.called += 1;
        }
    }

    /// The most that the limits here and ahead permit.
    fn limited_mps(&self, chainage_m: f64) -> f64 {
        let planned_mps2 = PLANNED_SHARE * self.settings.service_brake_mps2;
        let limits = self.timetable.limits.iter();
        // Until the tail has left it.
        let to_come = limits.filter(|limit| chainage_m < limit.to_m + self.length_m);
        let permitted = to_come.map(|limit| {
            let away_m = (limit.from_m - LIMIT_EARLY_M - chainage_m).max(0.0);
            (limit.mps.powi(2) + 2.0 * planned_mps2 * away_m).sqrt()
        });
        permitted.fold(f64::INFINITY, f64::min)
    }

    fn build_up(&mut self, demand: BrakeDemand, dt_s: f64) {
        let s = &self.settings;
        let (full, time) = match demand {
            BrakeDemand::Emergency => (s.emergency_brake_mps2, s.emergency_build_up_s),
            BrakeDemand::Service => (s.service_brake_mps2, s.service_build_up_s),
            BrakeDemand::None => (0.0, s.service_build_up_s),
        };
        let rate = full.max(s.service_brake_mps2) / time.max(dt_s) * dt_s;
        self.demanded_mps2 += (full - self.demanded_mps2).clamp(-rate, rate);
    }

    /// Lever position that the driver would like now.
    fn wanted(&self, now: &Instruments, permitted_mps: f64, signal_m: Option<f64>) -> f64 {
        let s = &self.settings;
        let mut target = (permitted_mps - MARGIN_MPS).max(0.0);
        target = target.min(s.cruise_speed_kmh / 3.6);
        target = target.min(self.limited_mps(now.chainage_m));
        if now.time_s < s.start_s {
            target = target.min(s.start_speed_kmh / 3.6);
        }
        if now.time_s < self.may_start_s {
            target = 0.0;
        }
        let error = target - now.speed_mps;
        // The root keeps the approach within the jerk limit, so that the speed does not overshoot.
        let answer = (GAIN_PER_S * error.abs()).min((1.5 * s.jerk_mps3 * error.abs()).sqrt());
        let mut wanted = answer.copysign(error) + now.resistance_mps2;
        let stops = [self.next_stop_m(), signal_m].into_iter().flatten();
        if let Some(stop_m) = stops.reduce(f64::min) {
            let left_m = stop_m - now.chainage_m;
            let planned = PLANNED_SHARE * s.service_brake_mps2;
            let needed = now.speed_mps.powi(2) / (2.0 * left_m.max(AT_MARK_M));
            if left_m < AT_MARK_M {
                // At the mark, or past it on slippery rails.
                return -s.service_brake_mps2;
            }
            if needed > 0.9 * planned {
                wanted = wanted.min(now.resistance_mps2 - needed);
            }
        }
        if target < STANDING_MPS && now.speed_mps < 0.1 {
            return -s.service_brake_mps2;
        }
        wanted.clamp(-s.service_brake_mps2, s.accel_mps2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fails where a train that an emergency brake has stopped starts again by itself as soon as the
    /// demand is gone.
    #[test]
    fn after_an_emergency_stop_the_driver_waits() {
        let settings = TrainSettings {
            restart_after_s: 20.0,
            ..TrainSettings::default()
        };
        let mut driver = AutomaticDriver::new(&settings, Timetable::default());
        let (mut speed_mps, mut started_s) = (10.0, None);
        for k in 0..60_000u32 {
            let now = Instruments {
                time_s: 1e-3 * f64::from(k),
                chainage_m: 0.0,
                speed_mps,
                resistance_mps2: 0.0,
            };
            let mut command = TrainCommand::UNSUPERVISED;
            // One cycle of the demand is enough.
            if (1000..1100).contains(&k) {
                command.brake = BrakeDemand::Emergency;
            }
            let effort = driver.step(&now, &command, None, 1e-3);
            let net_mps2 = effort.traction_mps2 - effort.brake_mps2;
            speed_mps = f64::max(0.0, speed_mps + 1e-3 * net_mps2);
            if k > 1100 && effort.traction_mps2 > 0.0 {
                started_s.get_or_insert(now.time_s);
            }
            if started_s.is_none() {
                assert!(k < 12_000 || speed_mps < STANDING_MPS, "{k} {speed_mps}");
            }
        }
        // It stands after some 9 s, and starts 20 s later.
        assert!(
            started_s.is_some_and(|s| (28.0..32.0).contains(&s)),
            "{started_s:?}"
        );
    }

    /// A train that is pushed while its driver waits must not be given power.
    #[test]
    fn a_driver_who_waits_takes_no_power_when_the_train_moves() {
        let mut driver = AutomaticDriver::new(&TrainSettings::default(), Timetable::default());
        for k in 0..5000u32 {
            let now = Instruments {
                time_s: 1e-3 * f64::from(k),
                chainage_m: 0.0,
                speed_mps: if k == 1 { 0.0 } else { 1.0 },
                resistance_mps2: 0.0,
            };
            let mut command = TrainCommand::UNSUPERVISED;
            if k == 0 {
                command.brake = BrakeDemand::Emergency;
            }
            let effort = driver.step(&now, &command, None, 1e-3);
            assert!(effort.traction_mps2 <= 0.0, "{} s", now.time_s);
        }
    }
}
