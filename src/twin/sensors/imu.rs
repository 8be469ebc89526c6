//! Inertial unit of the ADIS16488's class, fixed to the leading car's body.

use crate::bus::ImuSample;
use crate::track::Problem;
use crate::twin::physics::{World, within};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The inertial unit. Defaults are typical values of the ADIS16488's data sheet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ImuSettings {
    /// Samples a second.
    pub rate_hz: f64,
    /// In-run bias of the gyroscopes, one sigma, degrees an hour.
    pub gyro_bias_deg_h: f64,
    /// Angle random walk, degrees a square root of an hour.
    pub angle_random_walk_deg_sqrt_h: f64,
    /// Range of the gyroscopes, degrees a second.
    pub gyro_range_deg_s: f64,
    /// In-run bias of the accelerometers, one sigma, thousandths of g.
    pub accel_bias_mg: f64,
    /// Velocity random walk, m/s a square root of an hour.
    pub velocity_random_walk_mps_sqrt_h: f64,
    /// Range of the accelerometers, g.
    pub accel_range_g: f64,
    /// Time in which a bias forgets its value, seconds.
    pub bias_time_s: f64,
    /// Round to the sensor's 32-bit output steps.
    pub quantise: bool,
}

impl Default for ImuSettings {
    fn default() -> Self {
        Self {
            rate_hz: 200.0,
            gyro_bias_deg_h: 6.25,
            angle_random_walk_deg_sqrt_h: 0.3,
            gyro_range_deg_s: 450.0,
            accel_bias_mg: 0.1,
            velocity_random_walk_mps_sqrt_h: 0.029,
            accel_range_g: 18.0,
            bias_time_s: 300.0,
            quantise: true,
        }
    }
}

impl ImuSettings {
    /// Appends what is wrong with these settings; `at` is the dotted key that leads here.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        within(problems, at, "rate_hz", self.rate_hz, 1.0, 1000.0, "Hz");
    }
}

/// An inertial unit at work.
#[derive(Clone, Debug)]
pub struct Imu {
    settings: ImuSettings,
}

impl Imu {
    /// A unit whose errors depend on seed and run index.
    pub fn new(settings: &ImuSettings, _seed: u64, _index: u64) -> Self {
        Self {
            settings: *settings,
        }
    }

    /// From sample to sample.
    pub fn period_s(&self) -> f64 {
        1.0 / self.settings.rate_hz
    }

    /// A sample now; `None` without a train.
    pub fn sample(&mut self, _world: &World) -> Option<ImuSample> {
        None
    }
}
