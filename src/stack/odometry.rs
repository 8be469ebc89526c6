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
    samples: History<Reading>,
    /// What the odometer had counted at the first sample.
    first_m: Option<f64>,
}

/// A sample, and what had been counted until then while the wheelset slid.
#[derive(Clone, Copy, Debug)]
struct Reading {
    sample: OdometerSample,
    slid_m: f64,
}

/// What was run since the first sample, metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DistanceRun {
    /// As the odometer counted it.
    pub distance_m: f64,
    /// Distance counted while the wheelset slid or slipped, forward and backward added, metres.
    pub slid_m: f64,
}

impl Odometry {
    /// Takes a sample. One that is not newer than the last, or no number, is dropped.
    pub fn on_sample(&mut self, sample: &OdometerSample) {
        if sample.distance_m.is_finite() && sample.speed_mps.is_finite() {
            self.first_m.get_or_insert(sample.distance_m);
            let slid_m = self.samples.latest().map_or(0.0, |(_, last)| {
                let counted_m = (sample.distance_m - last.sample.distance_m).abs();
                last.slid_m + if sample.slides { counted_m } else { 0.0 }
            });
            let reading = Reading {
                sample: *sample,
                slid_m,
            };
            self.samples.push(sample.time, reading);
        }
    }

    /// Distance run from the first sample to a time, metres; 0 before it.
    pub fn distance_m(&self, time: SimTime) -> f64 {
        self.run(time).distance_m
    }

    /// The same, with what of it was counted on a sliding wheel.
    pub fn run(&self, time: SimTime) -> DistanceRun {
        let Some((latest, last)) = self.samples.latest() else {
            return DistanceRun::default();
        };
        let first_m = self.first_m.unwrap_or(0.0);
        if time >= latest {
            let on_m = last.sample.speed_mps * time.since(latest).min(RUN_ON_S);
            let slid_m = if last.sample.slides { on_m.abs() } else { 0.0 };
            return DistanceRun {
                distance_m: last.sample.distance_m + on_m - first_m,
                slid_m: last.slid_m + slid_m,
            };
        }
        let around = self.samples.around(time);
        around.map_or(DistanceRun::default(), |(a, b, share)| {
            let between = |a: f64, b: f64| a + share * (b - a);
            DistanceRun {
                distance_m: between(a.sample.distance_m, b.sample.distance_m) - first_m,
                slid_m: between(a.slid_m, b.slid_m),
            }
        })
    }

    /// Whether the wheelset slid or slipped in a sample that [`Self::mean_speed_mps`] is taken from.
    pub fn slides(&self) -> bool {
        self.of_mean_speed().any(|(_, sample)| sample.slides)
    }

    /// Speed at a time between samples, the first and the last one's outside; 0 without any.
    pub fn speed_mps(&self, time: SimTime) -> f64 {
        let around = self.samples.around(time);
        around.map_or(0.0, |(a, b, share)| {
            let (a, b) = (a.sample.speed_mps, b.sample.speed_mps);
            a + share * (b - a)
        })
    }

    /// Mean speed over the last half second, not below 0; `None` before the first sample. A wheel
    /// gives one pulse every 21 mm or so: over a single interval of 20 ms that would be steps of 1
    /// m/s, and no deceleration could be seen in them. The lag is on the safe side while braking.
    pub fn mean_speed_mps(&self) -> Option<f64> {
        let (_, last) = self.of_mean_speed().next()?;
        let first = self
            .of_mean_speed()
            .last()
            .filter(|(age_s, _)| *age_s > 0.0);
        let speed = first.map_or(last.speed_mps, |(age_s, first)| {
            (last.distance_m - first.distance_m) / age_s
        });
        Some(speed.max(0.0))
    }

    /// The samples that the mean speed is taken from, newest first, with how much older than the newest
    /// they are, seconds.
    fn of_mean_speed(&self) -> impl Iterator<Item = (f64, OdometerSample)> + '_ {
        let newest = self
            .samples
            .latest()
            .map_or(SimTime::ZERO, |(time, _)| time);
        let samples = self.samples.newest_first();
        samples
            .map(move |(time, reading)| (newest.since(time), reading.sample))
            .take_while(|(age_s, _)| *age_s <= SPEED_WINDOW_S)
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
                slides: false,
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

    /// What is counted on a sliding wheel must not be lost, nor what is counted on a rolling one added to
    /// it: 2 s at 10 m/s from the second second on.
    #[test]
    fn what_was_counted_on_a_sliding_wheel_is_known() {
        let mut odometry = Odometry::default();
        for k in 0..=40 {
            odometry.on_sample(&OdometerSample {
                time: SimTime::from_secs(0.1 * f64::from(k)),
                distance_m: f64::from(k),
                speed_mps: 10.0,
                slides: (11..=30).contains(&k),
            });
        }
        for (time_s, slid_m) in [(1.0, 0.0), (2.05, 10.5), (3.0, 20.0), (5.0, 20.0)] {
            let run = odometry.run(SimTime::from_secs(time_s));
            assert!((run.slid_m - slid_m).abs() < 1e-9, "{run:?} at {time_s} s");
        }
        assert!(!odometry.slides());
    }

    /// The speed is a mean: as long as a sample of its time was taken on a sliding wheel, it is wrong.
    #[test]
    fn a_slide_lasts_as_long_as_its_samples_count() {
        let mut odometry = Odometry::default();
        for k in 0..=150u32 {
            let time_s = 0.02 * f64::from(k);
            odometry.on_sample(&OdometerSample {
                time: SimTime::from_secs(time_s),
                distance_m: 10.0 * time_s,
                speed_mps: 10.0,
                slides: (51..=100).contains(&k),
            });
            assert_eq!(odometry.slides(), (51..=125).contains(&k), "{time_s} s");
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
                slides: false,
            });
        }
        assert!((odometry.distance_m(at(20.0)) - 200.0).abs() < 1e-9);
    }
}
