//! Wheel pulse counter of one wheelset.
//!
//! It counts whole pulses of the wheelset's turn. Distance is their number times what one pulse
//! is worth on the radius set in the box; the true radius differs by a tolerance and by the
//! wear since, and that is a scale error. Whatever the wheelset does it takes for travel: slip and
//! slide of the axle that it sits on are errors of its distance and speed. While the slide and slip
//! protection of the train holds effort back from that axle, its samples say so: the protection knows the
//! axles' speeds only, sees a slide late, and a slow one of all axles never.
//!
//! Speed comes from the pulses' edges: so many pulses from the last edge of one interval to the
//! last edge of the next, over the time between these (the M/T method: Ohmae et al., IEEE Trans.
//! Ind. Electron. IE-29(3), 1982), so it does not step by one pulse an interval as a mere count
//! would (1 m/s at the reference settings). Without an edge it can be no more than one pulse since
//! the last. Within an interval the wheelset is taken to turn evenly; the timer has no steps.
//!
//! Not modelled: missing or double pulses, conicity (the radius where the rail touches), an
//! eccentric wheel.

use super::ClockSettings;
use crate::bus::{OdometerSample, SimTime, TrainId};
use crate::settings::settings;
use crate::twin::physics::World;
use crate::twin::random::Stream;
use std::f64::consts::TAU;

/// Without an edge for this long, the wheelset stands.
const STANDSTILL_S: f64 = 0.5;

settings! {
    /// The odometer: pulses of one wheelset, turned into distance with the radius set in the box.
    #[derive(Copy)]
    pub struct OdometerSettings {
        /// Samples a second.
        rate_hz: f64 = 50.0, in 1.0..=1000.0;
        /// The wheelset that it counts, from the head; 1 is the leading one.
        axle: u32 = 1, in 1.0..=64.0;
        /// Pulses a turn of the wheel.
        pulses_per_turn: u32 = 128, in 1.0..=1e5;
        /// Two channels, a quarter pulse apart, tell which way the wheel turns; with one channel
        /// every pulse counts as forward.
        two_channels: bool = true;
        /// Radius set in the box, metres.
        wheel_radius_m: f64 = 0.43, in 0.2..=0.7;
        // A metro wheel has about 35 mm to lose.
        /// What the radius has lost since by wear, metres. The box then says too much.
        worn_m: f64 = 0.0, in 0.0..=0.05;
        /// One sigma of how well it was measured, as a share; the wear comes on top.
        radius_error_share: f64 = 0.003, in 0.0..=0.05;
        /// Its samples say where slide and slip protection of its wheelset acts.
        reports_slides: bool = true;
        /// Its clock.
        clock: ClockSettings = ClockSettings::default(), nested;
    }
}

/// An odometer at work.
#[derive(Clone, Debug)]
pub struct Odometer {
    settings: OdometerSettings,
    true_radius_m: f64,
    /// Where between two pulses the wheel stood at power-on, share of a pulse.
    phase: f64,
    last: Option<Reading>,
}

/// What is kept from sample to sample; the wheel's turn in pulses, signed.
#[derive(Clone, Copy, Debug)]
struct Reading {
    time: SimTime,
    turned: f64,
    /// The latest edge, and when it passed.
    edge: f64,
    edge_s: f64,
    /// What the counter shows.
    count: f64,
    speed_mps: f64,
}

impl Odometer {
    /// An odometer whose errors depend on seed and run index.
    pub fn new(settings: &OdometerSettings, seed: u64, index: u64) -> Self {
        // Three sigma at most: a worse wheel is taken out of service.
        let error = Stream::new(seed, index, "odometer radius").normal(0);
        let error = error.clamp(-3.0, 3.0) * settings.radius_error_share;
        Self {
            settings: *settings,
            true_radius_m: settings.wheel_radius_m * (1.0 + error) - settings.worn_m,
            phase: Stream::new(seed, index, "odometer phase").uniform(0),
            last: None,
        }
    }

    /// A sample now; `None` without the train that carries it, or without that wheelset.
    pub fn sample(&mut self, world: &World, train: TrainId) -> Option<OdometerSample> {
        let axle = (self.settings.axle as usize).saturating_sub(1);
        let run_m = world.wheel_run_m(train, axle)?;
        let acts = world.wheel_protection_acts(train, axle)?;
        let slides = acts && self.settings.reports_slides;
        Some(self.read(world.time(), run_m, slides))
    }

    /// What the box says when its wheelset's tread has rolled `run_m` since the start, and `slides` or
    /// not.
    fn read(&mut self, time: SimTime, run_m: f64, slides: bool) -> OdometerSample {
        let per_turn = f64::from(self.settings.pulses_per_turn);
        let pulse_m = TAU * self.settings.wheel_radius_m / per_turn;
        let turned = run_m / (TAU * self.true_radius_m) * per_turn + self.phase;
        let reading = match &self.last {
            Some(last) => self.next(last, time, turned, pulse_m),
            None => Reading {
                time,
                turned,
                edge: turned.floor(),
                edge_s: time.secs(),
                count: 0.0,
                speed_mps: 0.0,
            },
        };
        self.last = Some(reading);
        OdometerSample {
            time,
            distance_m: reading.count * pulse_m,
            speed_mps: reading.speed_mps,
            slides,
        }
    }

    fn next(&self, last: &Reading, time: SimTime, turned: f64, pulse_m: f64) -> Reading {
        let span_s = time.since(last.time);
        let passed = turned.floor() - last.turned.floor();
        let mut reading = Reading {
            time,
            turned,
            ..*last
        };
        if passed == 0.0 || span_s <= 0.0 {
            let silent_s = time.secs() - last.edge_s;
            let most = if silent_s < STANDSTILL_S {
                pulse_m / silent_s
            } else {
                0.0
            };
            reading.speed_mps = last.speed_mps.clamp(-most, most);
            return reading;
        }
        // Of the pulses' borders the one that passed last: below the wheel's place when it turns
        // forward, above it when it turns back.
        reading.edge = turned.floor() + if passed > 0.0 { 0.0 } else { 1.0 };
        let since_share = (turned - reading.edge) / (turned - last.turned);
        reading.edge_s = time.secs() - since_share * span_s;
        let between_s = reading.edge_s - last.edge_s;
        if between_s > 0.0 {
            reading.speed_mps = self.way(reading.edge - last.edge) * pulse_m / between_s;
        }
        reading.count += self.way(passed);
        reading
    }

    /// Pulses as they are counted.
    fn way(&self, pulses: f64) -> f64 {
        if self.settings.two_channels {
            pulses
        } else {
            pulses.abs()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PULSE_M: f64 = TAU * 0.43 / 128.0;

    /// A box that knows its wheel.
    fn exact() -> OdometerSettings {
        OdometerSettings {
            radius_error_share: 0.0,
            ..OdometerSettings::default()
        }
    }

    fn at(k: i32) -> SimTime {
        SimTime::from_secs(0.02 * f64::from(k))
    }

    /// Radius and its error the wrong way round change the sign of the scale error; pulses that
    /// are rounded instead of counted leave the steps.
    #[test]
    fn scale_and_steps() {
        let settings = OdometerSettings::default();
        let mut odometer = Odometer::new(&settings, 7, 0);
        let scale = odometer.true_radius_m / settings.wheel_radius_m;
        assert!((scale - 1.0).abs() > 1e-6 && (scale - 1.0).abs() < 0.01);
        for k in 0..1000 {
            let run = 0.37 * f64::from(k);
            let said = odometer.read(at(k), run, false);
            let behind = run / scale - said.distance_m;
            assert!(behind.abs() <= PULSE_M + 1e-9, "{behind} m");
            let steps = said.distance_m / PULSE_M;
            assert!((steps - steps.round()).abs() < 1e-6);
        }
    }

    /// At an even speed the edges give it exactly, whether many pulses pass between samples or one
    /// in several: a mere count would step by 1.05 m/s.
    #[test]
    fn even_speed_is_exact() {
        for speed in [22.0, 1.0, 0.3, -0.3, -8.0] {
            let mut odometer = Odometer::new(&exact(), 7, 0);
            for k in 0..200 {
                let said = odometer.read(at(k), speed * 0.02 * f64::from(k), false);
                // The first intervals have no edge before them.
                if k > 20 {
                    let wrong = said.speed_mps - speed;
                    assert!(wrong.abs() < 1e-9, "{} at {speed} m/s", said.speed_mps);
                }
            }
        }
    }

    /// A wheel that stops is said to stand after half a second, and to be slowing down until then;
    /// the last speed held for ever would send the train on.
    #[test]
    fn a_stop_is_seen() {
        let mut odometer = Odometer::new(&exact(), 7, 0);
        let mut before = f64::INFINITY;
        for k in 0..100 {
            let said = odometer.read(at(k), 0.1 * f64::from(k.min(50)), false);
            if k > 50 {
                assert!(said.speed_mps >= 0.0 && said.speed_mps <= before);
                before = said.speed_mps;
            }
            assert!(
                k < 76 || said.speed_mps.abs() < 1e-12,
                "{k}: {}",
                said.speed_mps
            );
        }
    }

    /// Rolling back counts down with two channels, and up with one.
    #[test]
    fn rolling_back() {
        for (two_channels, end_m, speed) in [(true, 5.0, -5.0), (false, 15.0, 5.0)] {
            let settings = OdometerSettings {
                two_channels,
                ..exact()
            };
            let mut odometer = Odometer::new(&settings, 7, 0);
            let mut said = odometer.read(at(0), 0.0, false);
            for k in 1..=150 {
                let run = 0.1 * f64::from(if k <= 100 { k } else { 200 - k });
                said = odometer.read(at(k), run, false);
            }
            assert!((said.distance_m - end_m).abs() <= 3.0 * PULSE_M);
            assert!((said.speed_mps - speed).abs() < 1e-9, "{}", said.speed_mps);
        }
    }

    /// A wheel that shakes over a border between two pulses makes no way; a one-channel counter
    /// counts it.
    #[test]
    fn shaking_over_an_edge() {
        for (two_channels, most, least) in [(true, 1.0, -1.0), (false, 1000.0, 50.0)] {
            let settings = OdometerSettings {
                two_channels,
                ..exact()
            };
            let mut odometer = Odometer::new(&settings, 7, 0);
            let border = (1.0 - odometer.phase) * PULSE_M;
            let mut said = odometer.read(at(0), 0.0, false);
            for k in 1..=100 {
                let run = border + if k % 2 == 0 { 1e-3 } else { -1e-3 };
                said = odometer.read(at(k), run, false);
                // The first edge of all has none before it to count from.
                assert!(!two_channels || k < 3 || said.speed_mps.abs() < 1e-9);
            }
            let counted = said.distance_m / PULSE_M;
            assert!((least..=most).contains(&counted), "{counted}");
        }
    }

    /// A worn wheel turns more often, so the box says more than was run: 5 mm of 430 make 1.18 %.
    #[test]
    fn a_worn_wheel_says_too_much() {
        let settings = OdometerSettings {
            worn_m: 0.005,
            ..exact()
        };
        let mut odometer = Odometer::new(&settings, 7, 0);
        odometer.read(at(0), 0.0, false);
        let said = odometer.read(at(1000), 400.0, false);
        let share = said.distance_m / 400.0;
        assert!((share - 0.43 / 0.425).abs() < 1e-4, "{share}");
    }
}
