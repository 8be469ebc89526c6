//! How the vehicle that carries the radar moves: by odometer and gyroscope.
//!
//! Without an odometer, or where it has been silent for long, the vehicle is taken to stand; without a gyroscope, to run
//! straight on.

use crate::bus::{ImuSample, OdometerSample, RadarSheet, SimTime, TrainEnd};
use crate::stack::history::History;
use crate::stack::odometry::Odometry;
use nalgebra::Vector2;

/// From one time to another, in the vehicle frame of the radar's end.
#[derive(Clone, Copy, Debug, Default)]
pub struct OwnMotion {
    /// How long, seconds.
    pub time_s: f64,
    /// Forward along the frame, metres.
    pub run_m: f64,
    /// To the left, radians.
    pub turned_rad: f64,
    /// Forward along the frame at the end, m/s.
    pub speed_mps: f64,
    /// To the left at the end, radians a second.
    pub yaw_rate_radps: f64,
}

/// Where the radar is in the vehicle frame, seen from above.
#[derive(Clone, Copy, Debug)]
pub struct Mount {
    /// Forward and left, metres.
    pub place_m: Vector2<f64>,
    /// Of its boresight to the left, radians.
    pub yaw_rad: f64,
}

impl Mount {
    /// Of a sheet.
    pub fn new(sheet: &RadarSheet) -> Self {
        let boresight = sheet.vehicle_from_radar.rotation * nalgebra::Vector3::x();
        Self {
            place_m: sheet.vehicle_from_radar.translation.vector.xy(),
            yaw_rad: boresight.y.atan2(boresight.x),
        }
    }

    /// How the radar moves over ground, m/s.
    pub fn velocity(&self, own: &OwnMotion) -> Vector2<f64> {
        let around = Vector2::new(-self.place_m.y, self.place_m.x);
        Vector2::new(own.speed_mps, 0.0) + own.yaw_rate_radps * around
    }
}

/// Samples of the last half second or so.
#[derive(Clone, Debug)]
pub struct OwnMotions {
    end: TrainEnd,
    odometry: Odometry,
    yaw_rates: History<f64>,
}

impl OwnMotions {
    /// Of an end of the train: that at the rear runs backwards.
    pub fn new(end: TrainEnd) -> Self {
        Self {
            end,
            odometry: Odometry::default(),
            yaw_rates: History::default(),
        }
    }

    /// Takes a sample of the odometer.
    pub fn on_odometer(&mut self, sample: &OdometerSample) {
        self.odometry.on_sample(sample);
    }

    /// Takes a sample of the inertial unit; that of the other end is left out.
    pub fn on_imu(&mut self, sample: &ImuSample) {
        if sample.end == self.end && sample.gyro_rad_s.z.is_finite() {
            self.yaw_rates.push(sample.time, sample.gyro_rad_s.z);
        }
    }

    /// Between two times.
    pub fn between(&self, from: SimTime, to: SimTime) -> OwnMotion {
        let time_s = to.since(from);
        let forward = match self.end {
            TrainEnd::Front => 1.0,
            TrainEnd::Rear => -1.0,
        };
        let run_m = self.odometry.distance_m(to) - self.odometry.distance_m(from);
        let is_lost = self.odometry.is_lost(to);
        let speed_mps = if is_lost {
            0.0
        } else {
            self.odometry.speed_mps(to)
        };
        OwnMotion {
            time_s,
            run_m: forward * run_m,
            turned_rad: self.yaw_rate(from.plus(0.5 * time_s)) * time_s,
            speed_mps: forward * speed_mps,
            yaw_rate_radps: self.yaw_rate(to),
        }
    }

    fn yaw_rate(&self, time: SimTime) -> f64 {
        let around = self.yaw_rates.around(time);
        around.map_or(0.0, |(a, b, share)| a + share * (b - a))
    }
}
