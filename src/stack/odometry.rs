//! Distance and speed by the odometer, at any time of the last seconds.
//!
//! Everything on a train that carries a position on from one moment to another does so by this: lamp
//! positioning from fix to fix, the protection from fix or balise to now.

use super::history::History;
use crate::bus::{OdometerSample, SimTime};

/// So long after the last sample the last speed is believed. Samples come often; a longer silence is
/// a fault, which the protection acts on.
const RUN_ON_S: f64 = 1.0;
/// Distance over this time gives the mean speed.
const SPEED_WINDOW_S: f64 = 0.5;

/// The odometer's latest samples.
#[derive(Clone, Debug, Default)]
pub struct Odometry {
    samples: History<OdometerSample>,
    /// What the odometer had counted at the first sample.
    first_m: Option<f64>,
}

impl Odometry {
    /// Takes a sample. One that is not newer than the last, or no number, is dropped.
    pub fn on_sample(&mut self, sample: &OdometerSample) {
        if sample.distance_m.is_finite() && sample.speed_mps.is_finite() {
            self.first_m.get_or_insert(sample.distance_m);
            self.samples.push(sample.time, *sample);
        }
    }

    /// Distance run from the first sample to a time, metres; 0 before it.
    pub fn distance_m(&self, time: SimTime) -> f64 {
        let counted_m = match self.samples.latest() {
            Some((latest, sample)) if time >= latest => {
                sample.distance_m + sample.speed_mps * time.since(latest).min(RUN_ON_S)
            }
            _ => {
                let around = self.samples.around(time);
                around.map_or(0.0, |(a, b, share)| {
                    a.distance_m + share * (b.distance_m - a.distance_m)
                })
            }
        };
        counted_m - self.first_m.unwrap_or(0.0)
    }

    /// Speed at a time between samples, the first and the last one's outside; 0 without any.
    pub fn speed_mps(&self, time: SimTime) -> f64 {
        let around = self.samples.around(time);
        around.map_or(0.0, |(a, b, share)| {
            a.speed_mps + share * (b.speed_mps - a.speed_mps)
        })
    }

    /// Mean speed over the last half second, not below 0; `None` before the first sample. A wheel
    /// gives one pulse every 21 mm or so: over a single interval of 20 ms that would be steps of 1
    /// m/s, and no deceleration could be seen in them. The lag is on the safe side while braking.
    pub fn mean_speed_mps(&self) -> Option<f64> {
        let (latest, last) = self.samples.latest()?;
        let age_s = |s: &OdometerSample| latest.since(s.time);
        let samples = self.samples.newest_first().map(|(_, sample)| sample);
        let old = samples
            .take_while(|s| age_s(s) <= SPEED_WINDOW_S)
            .last()
            .filter(|s| age_s(s) > 0.0);
        let speed = old.map_or(last.speed_mps, |s| {
            (last.distance_m - s.distance_m) / age_s(&s)
        });
        Some(speed.max(0.0))
    }

    /// Time since the last sample, seconds.
    pub fn age_s(&self, time: SimTime) -> Option<f64> {
        self.samples.latest().map(|(latest, _)| time.since(latest))
    }

    /// The odometer has been silent for too long to know how far the train has run. A rig without an
    /// odometer stands.
    pub fn is_lost(&self, time: SimTime) -> bool {
        self.age_s(time).is_some_and(|age_s| age_s > RUN_ON_S)
    }

    /// Whether samples of a time have been dropped.
    pub fn has_forgotten(&self, time: SimTime) -> bool {
        self.samples.has_forgotten(time)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    fn after_20_s(counted_m: f64) -> Odometry {
        let mut odometry = Odometry::default();
        assert!(odometry.distance_m(SimTime::ZERO).abs() < 1e-12);
        assert_eq!(odometry.mean_speed_mps(), None);
        for k in 0..2000 {
            odometry.on_sample(&OdometerSample {
                time: SimTime::from_nanos(k * 10_000_000),
                distance_m: counted_m + 0.1 * k as f64,
                speed_mps: 10.0,
            });
        }
        odometry
    }

    /// Between samples, after the last one, and whatever was counted before the first.
    #[test]
    fn distance_is_interpolated_and_run_on() {
        for counted_m in [0.0, 1000.0] {
            let odometry = after_20_s(counted_m);
            for t in [19.5, 19.993, 20.1, 20.99] {
                let d = odometry.distance_m(SimTime::from_secs(t));
                assert!((d - 10.0 * t).abs() < 1e-9, "{d} at {t}");
            }
            assert!((odometry.mean_speed_mps().unwrap() - 10.0).abs() < 1e-9);
        }
    }

    /// The last speed is believed for a second, and what is no number or no news not at all.
    #[test]
    fn silence_and_bad_samples() {
        let mut odometry = after_20_s(0.0);
        let at = SimTime::from_secs;
        assert!((odometry.distance_m(at(30.0)) - 209.9).abs() < 1e-9);
        assert!(!odometry.is_lost(at(20.99)) && odometry.is_lost(at(21.0)));
        assert!(!Odometry::default().is_lost(at(21.0)));
        for (time, distance_m) in [(at(20.5), f64::NAN), (at(19.0), 0.0)] {
            odometry.on_sample(&OdometerSample {
                time,
                distance_m,
                speed_mps: 10.0,
            });
        }
        assert!((odometry.distance_m(at(20.0)) - 200.0).abs() < 1e-9);
    }
}
