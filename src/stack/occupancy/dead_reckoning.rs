//! What the train has run and turned by its own speed and yaw rate.
//!
//! From one reading to the next both change evenly. A speed that is missing, or of a wheel that slides or slips, makes
//! what was run less known: the standard deviation of that adds up until a fix or a balise. A yaw rate that is missing
//! makes what was turned less known.

use crate::bus::SimTime;
use std::f64::consts::PI;

/// Inputs beyond these are no measurements of a train.
const MOST_MPS: f64 = 200.0;
const MOST_RADPS: f64 = 10.0;
/// A speed is not known any more after a longer silence, seconds.
const SPEED_SILENCE_S: f64 = 2.0;
/// Nor is a yaw rate: within half a second no train begins to turn by more than a map's headings are off.
const YAW_SILENCE_S: f64 = 0.5;
/// A train turns no faster, radians a second (20 m/s on a radius of 200 m).
const TURN_RADPS: f64 = 0.1;
/// A wheel that is off the train's speed by less than this share of it is not yet said to slide or slip. Each maker of
/// slide protection has its own rule.
const UNSEEN_SLIDE_SHARE: f64 = 0.1;
/// Nor is one that is off by less than this.
const UNSEEN_SLIDE_MPS: f64 = 0.3;
/// While a wheel slides or slips the train's speed changes no faster: more, reduced adhesion does not allow (SUBSET-026-3,
/// A.3.2, the greatest default of A_NVMAXREDADH).
const SLIDE_MPS2: f64 = 1.0;

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

/// Sums of speed and yaw rate.
#[derive(Clone, Debug, Default)]
pub struct DeadReckoning {
    /// Of the last input.
    time: Option<SimTime>,
    speed: Option<(SimTime, f64)>,
    yaw_rate: Option<(SimTime, f64)>,
    /// Since when the wheel slides or slips.
    sliding_since: Option<SimTime>,
    /// Standard deviation, for want of a speed, of what was run since the last fix or balise: a train that brakes slides
    /// the same way again and again, so that errors add up.
    unknown_m: f64,
    /// Standard deviation of what was turned since the last yaw rate.
    unknown_rad: f64,
    /// Since it was last taken.
    pending: TrainRun,
    /// Run since the start, less what was run backwards.
    pub run_m: f64,
    /// Sum of the yaw rates since the start.
    pub turned_rad: f64,
    /// Run since headings were compared, either way.
    pub since_heading_m: f64,
}

impl DeadReckoning {
    /// Sums up to a time; whether it is no older than the last input.
    pub fn run_to(&mut self, time: SimTime) -> bool {
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
        self.turned_rad += held(self.yaw_rate, time, YAW_SILENCE_S) * seconds;
        if !self.has_yaw_rate() {
            let before_rad2 = self.unknown_rad.powi(2);
            self.unknown_rad = (self.unknown_rad + TURN_RADPS * seconds).min(PI);
            self.pending.unknown_rad2 += self.unknown_rad.powi(2) - before_rad2;
        }
        self.pending.length_m += run_m;
        self.pending.seconds += seconds;
        self.run_m += run_m;
        self.since_heading_m += run_m.abs();
        true
    }

    /// Takes the speed, forwards positive; whether it is one that a train can have, and no older than the last input.
    pub fn on_speed(&mut self, time: SimTime, speed_mps: f64) -> bool {
        let is_taken = speed_mps.abs() <= MOST_MPS && self.run_to(time);
        if is_taken {
            self.set_speed(time, speed_mps);
            self.sliding_since = None;
        }
        is_taken
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
            let reading = (time, yaw_rate_radps);
            self.turned_rad += change_since(self.yaw_rate, reading, YAW_SILENCE_S);
            self.unknown_rad = 0.0;
            self.yaw_rate = Some(reading);
        }
    }

    /// A fix or balise says where the train is, with this standard deviation: after it the run is known no worse.
    pub fn known_to(&mut self, sigma_m: f64) {
        self.unknown_m = self.unknown_m.min(sigma_m);
    }

    /// What was run since this was last called.
    pub fn take_run(&mut self) -> TrainRun {
        std::mem::take(&mut self.pending)
    }

    /// Whether the yaw rate is known now.
    pub fn has_yaw_rate(&self) -> bool {
        let last = self.yaw_rate.zip(self.time);
        last.is_some_and(|((at, _), now)| now.since(at) <= YAW_SILENCE_S)
    }

    fn set_speed(&mut self, time: SimTime, speed_mps: f64) {
        let more_m = change_since(self.speed, (time, speed_mps), SPEED_SILENCE_S);
        self.pending.length_m += more_m;
        self.run_m += more_m;
        self.speed = Some((time, speed_mps));
    }

    fn held_speed(&self, time: SimTime) -> HeldSpeed {
        let (speed_mps, unknown_mps) = match (self.speed, self.sliding_since) {
            (Some((_, speed_mps)), Some(since)) => {
                let unseen_mps = UNSEEN_SLIDE_MPS.max(UNSEEN_SLIDE_SHARE * speed_mps.abs());
                (speed_mps, unseen_mps + SLIDE_MPS2 * time.since(since))
            }
            // It may have stopped at once, or gone on.
            (Some((at, speed_mps)), None) if time.since(at) > SPEED_SILENCE_S => {
                (0.5 * speed_mps, 0.5 * speed_mps.abs())
            }
            (speed, _) => (held(speed, time, SPEED_SILENCE_S), 0.0),
        };
        HeldSpeed {
            speed_mps,
            unknown_mps,
        }
    }
}

/// The last reading of a quantity, as long as it is one of now; else 0.
fn held(reading: Option<(SimTime, f64)>, time: SimTime, silence_s: f64) -> f64 {
    reading
        .filter(|(at, _)| time.since(*at) <= silence_s)
        .map_or(0.0, |(_, value)| value)
}

/// By how much more a quantity has summed up since its last reading than if it had stayed as it was then: it changes
/// evenly from one reading to the next.
fn change_since(
    last: Option<(SimTime, f64)>,
    (time, value): (SimTime, f64),
    silence_s: f64,
) -> f64 {
    last.map_or(0.0, |(before, old)| {
        let seconds = time.since(before);
        if seconds <= silence_s {
            0.5 * (value - old) * seconds
        } else {
            0.0
        }
    })
}
