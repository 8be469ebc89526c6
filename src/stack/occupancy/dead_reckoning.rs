//! What the train has run and turned by its own speed and yaw rate, and hypotheses carried on by that.
//!
//! From one reading to the next both change evenly. A speed that is missing, or of a wheel that slides or slips, makes
//! what was run less known: the standard deviation of that adds up until a fix or a balise. A yaw rate that is missing
//! makes what was turned less known.

use super::{Method, Occupancy, headings};
use crate::bus::SimTime;
use std::f64::consts::PI;

/// Inputs beyond these are no measurements of a train.
const MOST_MPS: f64 = 200.0;
const MOST_RADPS: f64 = 10.0;
/// A speed is not known any more after a longer silence, seconds.
const SILENCE_S: f64 = 2.0;
/// Nor is a yaw rate: within half a second no train begins to turn by more than a map's headings are off.
const YAW_SILENCE_S: f64 = 0.5;
/// A train turns no faster, radians a second (20 m/s on a radius of 200 m).
const TURN_RADPS: f64 = 0.1;
/// A wheel that is off the train's speed by less than this share of it is not yet said to slide or slip. Each maker of
/// slide protection has its own rule.
const UNSEEN_SLIDE_SHARE: f64 = 0.1;
/// Nor is one that is off by less than this.
const UNSEEN_SLIDE_MPS: f64 = 0.3;
/// While a wheel slides or slips the train's speed changes no faster: more, adhesion does not allow.
const SLIDE_MPS2: f64 = 1.0;
/// Headings are compared each time that so much was run: what the map has wrong is wrong over a stretch.
const HEADING_EVERY_M: f64 = 2.0;

/// What the train has run in a time, by the measured speed.
#[derive(Clone, Copy, Debug, Default)]
pub struct TrainRun {
    pub length_m: f64,
    pub seconds: f64,
    /// Variance of the length for want of a speed.
    pub unknown_m2: f64,
    /// Variance of what was turned for want of a yaw rate.
    pub unknown_rad2: f64,
}

/// The speed since the last input.
struct HeldSpeed {
    speed_mps: f64,
    /// Standard deviation for want of a good reading.
    unknown_mps: f64,
}

impl Occupancy {
    /// Takes the speed, forwards positive. What no train can have, or is older than the last input, is dropped.
    pub fn on_speed(&mut self, time: SimTime, speed_mps: f64) {
        if speed_mps.abs() <= MOST_MPS && self.run_to(time) {
            self.set_speed(time, speed_mps);
            self.sliding_since = None;
            self.speed_filter
                .update(time, self.settings.speed_sigma_mps);
        }
    }

    /// Takes the speed of a wheel that slides or slips. The train's speed is taken to follow it no faster than adhesion
    /// allows, and is less and less known.
    pub fn on_slide(&mut self, time: SimTime, speed_mps: f64) {
        if !(speed_mps.abs() <= MOST_MPS && self.run_to(time)) {
            return;
        }
        let Some((before, held_mps)) = self.speed else {
            // It may as well stand: the doubt is as large as the speed.
            self.speed = Some((time, speed_mps));
            self.sliding_since = Some(time.plus(-speed_mps.abs() / SLIDE_MPS2));
            return;
        };
        let most_mps = SLIDE_MPS2 * time.since(before);
        let change_mps = (speed_mps - held_mps).clamp(-most_mps, most_mps);
        self.set_speed(time, held_mps + change_mps);
        self.sliding_since.get_or_insert(before);
    }

    /// Takes the yaw rate, to the left positive.
    pub fn on_yaw_rate(&mut self, time: SimTime, yaw_rate_radps: f64) {
        if yaw_rate_radps.abs() <= MOST_RADPS && self.run_to(time) {
            self.turned_rad += change_since(self.yaw_rate, (time, yaw_rate_radps));
            self.unknown_rad = 0.0;
            self.yaw_rate = Some((time, yaw_rate_radps));
        }
    }

    /// The train's speed now.
    fn set_speed(&mut self, time: SimTime, speed_mps: f64) {
        let more_m = change_since(self.speed, (time, speed_mps));
        self.pending.length_m += more_m;
        self.run_m += more_m;
        self.speed = Some((time, speed_mps));
    }

    /// Sums speed and yaw rate up to a time; whether it is no older than the last input.
    pub(super) fn run_to(&mut self, time: SimTime) -> bool {
        let seconds = self.time.map_or(0.0, |last| time.since(last));
        if seconds < 0.0 {
            return false;
        }
        self.time = Some(time);
        let speed = self.held_speed(time);
        let run_m = speed.speed_mps * seconds;
        let before_m2 = self.unknown_m.powi(2);
        self.unknown_m += speed.unknown_mps * seconds;
        self.pending.unknown_m2 += self.unknown_m.powi(2) - before_m2;
        self.turned_rad += held(self.yaw_rate, time) * seconds;
        if !self.has_yaw_rate(time) {
            let before_rad2 = self.unknown_rad.powi(2);
            self.unknown_rad = (self.unknown_rad + TURN_RADPS * seconds).min(PI);
            self.pending.unknown_rad2 += self.unknown_rad.powi(2) - before_rad2;
        }
        self.pending.length_m += run_m;
        self.pending.seconds += seconds;
        self.run_m += run_m;
        self.since_heading_m += run_m.abs();
        if self.since_heading_m >= HEADING_EVERY_M {
            self.compare_headings(time);
        }
        true
    }

    fn held_speed(&self, time: SimTime) -> HeldSpeed {
        let (speed_mps, unknown_mps) = match (self.speed, self.sliding_since) {
            (Some((_, speed_mps)), Some(since)) => {
                let unseen_mps = UNSEEN_SLIDE_MPS.max(UNSEEN_SLIDE_SHARE * speed_mps.abs());
                (speed_mps, unseen_mps + SLIDE_MPS2 * time.since(since))
            }
            // It may have stopped at once, or gone on.
            (Some((at, speed_mps)), None) if time.since(at) > SILENCE_S => {
                (0.5 * speed_mps, 0.5 * speed_mps.abs())
            }
            (speed, _) => (held(speed, time), 0.0),
        };
        HeldSpeed {
            speed_mps,
            unknown_mps,
        }
    }

    /// Whether the yaw rate is known.
    fn has_yaw_rate(&self, time: SimTime) -> bool {
        (self.yaw_rate).is_some_and(|(at, _)| time.since(at) <= YAW_SILENCE_S)
    }

    fn compare_headings(&mut self, time: SimTime) {
        let run_m = std::mem::take(&mut self.since_heading_m);
        self.advance();
        if self.has_yaw_rate(time) && self.settings.method == Method::Fused {
            let (network, settings) = (&self.network, &self.settings);
            let turned = (self.turned_rad, run_m);
            headings::compare_headings(&mut self.hypotheses, network, turned, settings);
            self.tidy();
            return;
        }
        let before = self.hypotheses.len();
        self.grow();
        if self.hypotheses.len() != before {
            self.tidy();
        }
    }

    /// Carries the hypotheses on by what was run since this was last done.
    pub(super) fn advance(&mut self) {
        let run = std::mem::take(&mut self.pending);
        let speed_m2 = self.speed_variance_m2(run.seconds);
        for hypothesis in &mut self.hypotheses {
            match self.settings.method {
                Method::Fused => hypothesis.advance_fused(&run, &self.settings),
                _ => hypothesis.advance_by_speed(run.length_m, speed_m2),
            }
        }
    }

    /// What so many seconds more add to the variance of what was run since the last fix. From fix to fix the speed is
    /// wrong by the same, so that the variance grows with the square of the time.
    fn speed_variance_m2(&mut self, seconds: f64) -> f64 {
        let [before_s, now_s] = [self.since_fix_s, self.since_fix_s + seconds];
        self.since_fix_s = now_s;
        self.speed_filter.sigma_mps().powi(2) * (now_s.powi(2) - before_s.powi(2))
    }
}

/// The last reading of a quantity, as long as it is one of now; else 0.
fn held(reading: Option<(SimTime, f64)>, time: SimTime) -> f64 {
    reading
        .filter(|(at, _)| time.since(*at) <= SILENCE_S)
        .map_or(0.0, |(_, value)| value)
}

/// By how much more a quantity has summed up since its last reading than if it had stayed as it was then: it changes
/// evenly from one reading to the next.
fn change_since(last: Option<(SimTime, f64)>, (time, value): (SimTime, f64)) -> f64 {
    last.map_or(0.0, |(before, old)| {
        let seconds = time.since(before);
        if seconds <= SILENCE_S {
            0.5 * (value - old) * seconds
        } else {
            0.0
        }
    })
}
