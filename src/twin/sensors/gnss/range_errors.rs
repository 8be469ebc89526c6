//! By how much ranges to satellites are wrong.
//!
//! Each satellite's range has an error of its orbit, clock and ionosphere, one of multipath and white noise; all have
//! what is left of the troposphere over the receiver. The slow ones are first-order Gauss-Markov processes. All but the
//! first grow as 1/sin(elevation), the way through the air or near the ground. Now and then a satellite comes by a
//! reflection alone: its range is then too long by an excess with exponential distribution.

use super::GnssSettings;
use super::satellites::SATELLITES;
use crate::twin::random::Stream;

/// No satellite is taken for lower than this: 1/sin is bounded.
const LOWEST_SINE: f64 = 0.05;
/// Numbers of the stream that are kept for one satellite at one time.
const NUMBERS: u64 = 8;

/// The errors of all ranges at one time after another.
#[derive(Clone, Debug)]
pub struct RangeErrors {
    settings: GnssSettings,
    stream: Stream,
    /// Of all satellites, towards the zenith.
    troposphere_m: f64,
    ranges: [Range; SATELLITES],
    seconds: f64,
    drawn: u64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Range {
    signal_in_space_m: f64,
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
    pub fn new(settings: &GnssSettings, stream: Stream) -> Self {
        let mut errors = Self {
            settings: *settings,
            stream,
            troposphere_m: 0.0,
            ranges: [Range::default(); SATELLITES],
            seconds: 0.0,
            drawn: 0,
        };
        errors.change(None);
        errors
    }

    /// Carries them on to a time.
    pub fn advance(&mut self, seconds: f64) {
        let step_s = seconds - self.seconds;
        self.seconds = seconds;
        self.change(Some(step_s));
    }

    /// The errors change over a time; over none they are drawn anew.
    fn change(&mut self, step_s: Option<f64>) {
        self.drawn += 1;
        let (settings, stream) = (self.settings, self.stream);
        let first = self.drawn * NUMBERS * (SATELLITES as u64 + 1);
        let scale = settings.error_scale;
        let markov = |old: f64, sigma_m: f64, time_s: f64, number: u64| {
            let keep = step_s.map_or(0.0, |step_s| (-step_s / time_s).exp());
            keep * old + (1.0 - keep * keep).sqrt() * sigma_m * scale * stream.normal(number)
        };
        let air_m = settings.troposphere_m * settings.left_by_corrections();
        self.troposphere_m = markov(self.troposphere_m, air_m, settings.troposphere_s, first);
        let space_m = settings.signal_in_space_m * settings.left_by_corrections();
        for (range, number) in self.ranges.iter_mut().zip(1..) {
            let first = first + NUMBERS * number;
            range.signal_in_space_m = markov(
                range.signal_in_space_m,
                space_m,
                settings.signal_in_space_s,
                first,
            );
            range.multipath_m = markov(
                range.multipath_m,
                settings.multipath_m,
                settings.multipath_s,
                first + 1,
            );
        }
    }

    /// The error of a satellite's range, metres; none where its signal is not received.
    pub fn of(&mut self, satellite: usize, sine: f64, way: SignalWay, step_s: f64) -> Option<f64> {
        let first = (self.drawn * (SATELLITES as u64 + 1) + satellite as u64 + 1) * NUMBERS;
        self.reflect(satellite, sine, way, step_s, first + 2);
        let range = &self.ranges[satellite];
        if way == SignalWay::Blocked && range.excess_m.is_none() {
            return None;
        }
        let noise_m = self.settings.noise_m * self.settings.error_scale;
        let noise_m = noise_m * self.stream.normal(first + 6);
        let near_m = self.troposphere_m + range.multipath_m + noise_m;
        let sine = sine.max(LOWEST_SINE);
        Some(range.signal_in_space_m + near_m / sine + range.excess_m.unwrap_or(0.0))
    }

    /// A two-state chain: reflections come and go with their mean duration, so that over time their share is as set.
    fn reflect(&mut self, satellite: usize, sine: f64, way: SignalWay, step_s: f64, first: u64) {
        let settings = &self.settings;
        let share = match way {
            SignalWay::Free => settings.reflected_share * (1.0 - sine * sine).sqrt(),
            SignalWay::Blocked => settings.reflected_if_blocked,
        };
        let stay = (-step_s / (settings.reflected_s * (1.0 - share)).max(1e-9)).exp();
        let keeps = self.stream.uniform(first) < stay;
        let excess_m = &mut self.ranges[satellite].excess_m;
        if keeps {
            return;
        }
        // What has changed is anew in one of both states.
        *excess_m = (self.stream.uniform(first + 1) < share)
            .then(|| -settings.reflected_excess_m * self.stream.uniform(first + 2).ln());
    }
}
