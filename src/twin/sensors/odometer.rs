//! Wheel pulse counter of the leading wheelset.
//!
//! The wheel's true radius differs from the one that the box was told (wear, tolerance), so
//! distance has a scale error, and it comes in whole pulses. The wheelset is taken as unbraked:
//! no slip or slide.

use crate::bus::{OdometerSample, SimTime};
use crate::track::{Checker, Problem};
use crate::twin::physics::World;
use crate::twin::random::Stream;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// The odometer: pulses of one unbraked wheelset, turned into distance with the radius that the
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
        let mut check = Checker::new(at, problems);
        check.within("rate_hz", self.rate_hz, 1.0..=1000.0, "Hz");
        let pulses = f64::from(self.pulses_per_turn);
        check.within("pulses_per_turn", pulses, 1.0..=1e5, "pulses");
        check.within("wheel_radius_m", self.wheel_radius_m, 0.2..=0.7, "m");
        check.within(
            "radius_error_share",
            self.radius_error_share,
            0.0..=0.05,
            "",
        );
    }
}

/// An odometer at work.
#[derive(Clone, Debug)]
pub struct Odometer {
    settings: OdometerSettings,
    true_radius_m: f64,
    last: Option<(SimTime, f64)>,
}

impl Odometer {
    /// An odometer whose errors depend on seed and run index.
    pub fn new(settings: &OdometerSettings, seed: u64, index: u64) -> Self {
        // Three sigma at most: a worse wheel is taken out of service.
        let error = Stream::new(seed, index, "odometer radius").normal(0);
        let error = error.clamp(-3.0, 3.0) * settings.radius_error_share;
        Self {
            settings: *settings,
            true_radius_m: settings.wheel_radius_m * (1.0 + error),
            last: None,
        }
    }

    /// From sample to sample.
    pub fn period_s(&self) -> f64 {
        1.0 / self.settings.rate_hz
    }

    /// A sample now; `None` without a train.
    pub fn sample(&mut self, world: &World) -> Option<OdometerSample> {
        Some(self.read(world.time(), world.wheel_run_m(0)?))
    }

    /// What the box says after `run_m` of rail.
    fn read(&mut self, time: SimTime, run_m: f64) -> OdometerSample {
        let pulses_per_rad = f64::from(self.settings.pulses_per_turn) / TAU;
        let pulses = (run_m / self.true_radius_m * pulses_per_rad).floor();
        let distance_m = pulses / pulses_per_rad * self.settings.wheel_radius_m;
        let before = self.last.replace((time, distance_m));
        let speed_mps = before.map_or(0.0, |(then, from_m)| {
            let span_s = time.since(then);
            if span_s > 0.0 {
                (distance_m - from_m) / span_s
            } else {
                0.0
            }
        });
        OdometerSample {
            time,
            distance_m,
            speed_mps,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Radius and its error the wrong way round change the sign of the scale error; pulses that
    /// are rounded instead of counted would run ahead.
    #[test]
    fn scale_and_steps() {
        let settings = OdometerSettings::default();
        let mut odometer = Odometer::new(&settings, 7, 0);
        let scale = odometer.true_radius_m / settings.wheel_radius_m;
        assert!((scale - 1.0).abs() > 1e-6 && (scale - 1.0).abs() < 0.01);
        let pulse = TAU * 0.43 / 128.0;
        for k in 0..1000 {
            let run = 0.37 * f64::from(k);
            let said = odometer.read(SimTime::from_secs(0.02 * f64::from(k)), run);
            let behind = run / scale - said.distance_m;
            assert!((-1e-9..=pulse + 1e-9).contains(&behind), "{behind} m");
            let steps = said.distance_m / pulse;
            assert!((steps - steps.round()).abs() < 1e-6);
        }
        let said = odometer.read(SimTime::from_secs(20.0), 370.0);
        // One pulse in 20 ms is 1 m/s.
        assert!(
            (said.speed_mps - 0.37 / 0.02).abs() < 1.1,
            "{}",
            said.speed_mps
        );
    }
}
