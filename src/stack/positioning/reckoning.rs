//! Where the train takes itself to be between fixes: the last fix, carried on by the odometer, and
//! the leading car's attitude there.

use super::attitude::CarAttitude;
use crate::bus::{ImuSample, OdometerSample, SimTime};
use crate::stack::led::LedSettings;
use crate::stack::odometry::Odometry;
use crate::track::{Alignment, Track};
use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use std::sync::Arc;

/// Chainage of a fix, and the distance run by then.
#[derive(Clone, Copy, Debug)]
struct LastFix {
    chainage_m: f64,
    distance_m: f64,
}

/// Dead reckoning from fix to fix.
#[derive(Debug)]
pub struct DeadReckoning {
    map: Arc<Track>,
    odometry: Odometry,
    attitude: CarAttitude,
    last_fix: Option<LastFix>,
}

impl DeadReckoning {
    /// Nothing known yet.
    pub fn new(settings: &LedSettings, map: Arc<Track>) -> Self {
        Self {
            map,
            odometry: Odometry::default(),
            attitude: CarAttitude::new(settings),
            last_fix: None,
        }
    }

    fn line(&self) -> &Alignment {
        &self.map.alignment
    }

    /// Takes an odometer sample.
    pub fn on_odometer(&mut self, sample: &OdometerSample) {
        self.odometry.on_sample(sample);
    }

    /// Takes an inertial sample.
    pub fn on_imu(&mut self, sample: &ImuSample) {
        let chainage_m = self.chainage_m(sample.time);
        (self.attitude).on_imu(sample, &self.map.alignment, chainage_m);
    }

    /// The train was at a chainage.
    pub fn on_fix(&mut self, time: SimTime, chainage_m: f64) {
        let distance_m = self.odometry.distance_m(time);
        self.last_fix = Some(LastFix {
            chainage_m,
            distance_m,
        });
    }

    /// The train is not where it took itself to be.
    pub fn forget_fix(&mut self) {
        self.last_fix = None;
    }

    /// Chainage of the train head at a time; `None` without a fix, and where the odometer is lost.
    pub fn chainage_m(&self, time: SimTime) -> Option<f64> {
        let fix = self.last_fix.filter(|_| !self.odometry.is_lost(time))?;
        Some(fix.chainage_m + (self.distance_m(time) - fix.distance_m))
    }

    /// Distance run from the first odometer sample to a time.
    pub fn distance_m(&self, time: SimTime) -> f64 {
        self.odometry.distance_m(time)
    }

    /// Speed at a time.
    pub fn speed_mps(&self, time: SimTime) -> f64 {
        self.odometry.speed_mps(time)
    }

    /// Whether a time is longer ago than samples are kept.
    pub fn has_forgotten(&self, time: SimTime) -> bool {
        self.odometry.has_forgotten(time) || self.attitude.has_forgotten(time)
    }

    /// Attitude `world_from_vehicle` at a time with the train head at a chainage.
    pub fn attitude(&self, time: SimTime, chainage_m: f64) -> UnitQuaternion<f64> {
        self.attitude.at(time, self.line(), chainage_m)
    }

    /// Pose `world_from_vehicle` at a time with the train head at a chainage.
    pub fn vehicle(&self, time: SimTime, chainage_m: f64) -> Isometry3<f64> {
        let place = Translation3::from(self.line().at(chainage_m).origin);
        Isometry3::from_parts(place, self.attitude(time, chainage_m))
    }

    /// The vehicle at one time in the vehicle at another, shortly before or after.
    pub fn moved(&self, now: SimTime, then: SimTime) -> Isometry3<f64> {
        let run_m = self.speed_mps(now) * then.since(now);
        let Some(chainage_m) = self.chainage_m(now) else {
            return Isometry3::translation(run_m, 0.0, 0.0);
        };
        let vehicle = self.vehicle(now, chainage_m);
        vehicle.inv_mul(&self.vehicle(then, chainage_m + run_m))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::stack::led::testing::track;

    /// While the odometer is silent the train does not know where it is; when it counts again, it
    /// does.
    #[test]
    fn a_position_is_lost_with_the_odometer() {
        let map = Arc::new(track("manchester"));
        let mut reckoning = DeadReckoning::new(&LedSettings::default(), map);
        let counted = |reckoning: &mut DeadReckoning, time_s: f64| {
            reckoning.on_odometer(&OdometerSample {
                time: SimTime::from_secs(time_s),
                distance_m: 50.0 + 10.0 * time_s,
                speed_mps: 10.0,
                slides: false,
            });
        };
        let at_m = |reckoning: &DeadReckoning, time_s: f64| {
            reckoning.chainage_m(SimTime::from_secs(time_s))
        };
        counted(&mut reckoning, 0.0);
        assert_eq!(at_m(&reckoning, 0.5), None);
        reckoning.on_fix(SimTime::from_secs(0.5), 100.0);
        assert!((at_m(&reckoning, 0.9).unwrap() - 104.0).abs() < 1e-9);
        assert_eq!(at_m(&reckoning, 1.1), None);
        counted(&mut reckoning, 4.0);
        assert!((at_m(&reckoning, 4.1).unwrap() - 136.0).abs() < 1e-9);
        reckoning.forget_fix();
        assert_eq!(at_m(&reckoning, 4.1), None);
    }
}
