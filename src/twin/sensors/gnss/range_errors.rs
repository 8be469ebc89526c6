//! By how much ranges to satellites are wrong.
//!
//! Each satellite's range has an error of its orbit, clock and ionosphere, one of multipath and white noise; all have
//! what models leave of the troposphere over the receiver. The slow ones are first-order Gauss-Markov processes. All but the
//! first grow as 1/sin(elevation), the way through the air or near the ground. Now and then a satellite comes by a
//! reflection alone: its range is then too long by an excess with exponential distribution.
//!
//! Orbits, clocks, ionosphere and troposphere are the same for all receivers of a world (`common_errors`): over the
//! length of a line they hardly change. The rest is each receiver's own.

use super::common_errors::CommonErrors;
use super::satellites::SATELLITES;
use super::{GnssSeeds, GnssSettings};
use crate::twin::random::Stream;

/// No satellite is taken for lower than this: 1/sin is bounded.
const LOWEST_SINE: f64 = 0.05;
/// Numbers of the receiver's stream that are kept for one satellite at one time.
const NUMBERS: u64 = 8;
/// Which of them are for what.
const MULTIPATH: u64 = 0;
const REFLECTION: [u64; 3] = [1, 2, 3];
const NOISE: u64 = 4;

/// The errors of all ranges at one time after another.
#[derive(Clone, Debug)]
pub struct RangeErrors {
    settings: GnssSettings,
    /// Of each satellite's orbit, clock and ionosphere.
    signal_in_space: CommonErrors,
    /// Towards the zenith.
    troposphere: CommonErrors,
    /// What is the receiver's own.
    own: Stream,
    ranges: [Range; SATELLITES],
    seconds: f64,
    drawn: u64,
}

/// The receiver's own errors of a range.
#[derive(Clone, Copy, Debug, Default)]
struct Range {
    /// Towards the zenith.
    multipath_m: f64,
    /// Of the reflection, while only that is received.
    excess_m: Option<f64>,
}

/// How a satellite's signal may reach the antenna.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SignalWay {
    /// Nothing is between them.
    Free,
    /// Something is.
    Blocked,
}

impl RangeErrors {
    /// As they are at time 0.
    pub fn new(settings: &GnssSettings, seeds: GnssSeeds) -> Self {
        let common = |name: &str, count: usize, correlation_s: f64| {
            CommonErrors::new(Stream::new(seeds.common, 0, name), count, correlation_s)
        };
        let (space_s, air_s) = (settings.signal_in_space_s, settings.troposphere_s);
        let mut errors = Self {
            settings: *settings,
            signal_in_space: common("gnss signal in space", SATELLITES, space_s),
            troposphere: common("gnss troposphere", 1, air_s),
            own: Stream::new(seeds.own, 0, "gnss ranges"),
            ranges: [Range::default(); SATELLITES],
            seconds: 0.0,
            drawn: 0,
        };
        errors.change_multipath(0.0);
        errors
    }

    /// Carries them on to a time.
    pub fn advance(&mut self, seconds: f64) {
        let step_s = seconds - self.seconds;
        self.seconds = seconds;
        self.signal_in_space.advance(seconds);
        self.troposphere.advance(seconds);
        self.change_multipath((-step_s / self.settings.multipath_s).exp());
    }

    /// So much of each is kept, the rest is drawn.
    fn change_multipath(&mut self, keep: f64) {
        self.drawn += 1;
        let more_m = (1.0 - keep * keep).sqrt() * self.settings.multipath_m;
        for satellite in 0..SATELLITES {
            let drawn_m = more_m * self.own.normal(self.first_number(satellite) + MULTIPATH);
            let multipath_m = &mut self.ranges[satellite].multipath_m;
            *multipath_m = keep * *multipath_m + drawn_m;
        }
    }

    /// Of those that the receiver's stream has for a satellite now.
    fn first_number(&self, satellite: usize) -> u64 {
        (self.drawn * SATELLITES as u64 + satellite as u64) * NUMBERS
    }

    /// The error of a satellite's range, metres; none where its signal is not received.
    pub fn of(&mut self, satellite: usize, sine: f64, way: SignalWay, step_s: f64) -> Option<f64> {
        self.reflect(satellite, sine, way, step_s);
        let (settings, range) = (&self.settings, &self.ranges[satellite]);
        if way == SignalWay::Blocked && range.excess_m.is_none() {
            return None;
        }
        let left = settings.left_by_corrections();
        let space_m = left * settings.signal_in_space_m * self.signal_in_space.of(satellite);
        let air_m = left * settings.troposphere_m * self.troposphere.of(0);
        let noise_m = settings.noise_m * self.own.normal(self.first_number(satellite) + NOISE);
        let near_m = air_m + range.multipath_m + noise_m;
        let all_m = space_m + near_m / sine.max(LOWEST_SINE);
        Some(settings.error_scale * all_m + range.excess_m.unwrap_or(0.0))
    }

    /// A two-state chain: reflections come and go with their mean duration, so that over time their share is as set.
    fn reflect(&mut self, satellite: usize, sine: f64, way: SignalWay, step_s: f64) {
        let settings = &self.settings;
        let share = match way {
            SignalWay::Free => settings.reflected_share * (1.0 - sine * sine).sqrt(),
            SignalWay::Blocked => settings.reflected_if_blocked,
        };
        let stay = (-step_s / (settings.reflected_s * (1.0 - share)).max(1e-9)).exp();
        let first = self.first_number(satellite);
        let drawn = |number: usize| self.own.uniform(first + REFLECTION[number]);
        if drawn(0) < stay {
            return;
        }
        // What has changed is anew in one of both states.
        self.ranges[satellite].excess_m =
            (drawn(1) < share).then(|| -settings.reflected_excess_m * drawn(2).ln());
    }
}
