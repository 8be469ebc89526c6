//! Place and speed along a route by some of the sources: a Kalman filter.
//!
//! The state is the place s of the head, the speed v, the error k of the odometer's scale, the slow error g of fixes along
//! the route, and the place s' at the odometer's last sample; k and g are Gauss-Markov processes. The acceleration is white
//! noise: a train without an odometer may do as it likes, one with an odometer is held to it. An odometer says
//! (s - s') (1 + k), a fix s + g, a tag s. That the run and not the speed is measured keeps the place free of the lag with
//! which the speed follows.

use super::mode::{Source, Sources};
use super::settings::CombinedSettings;
use nalgebra::{RowSVector, SMatrix, SVector};
use std::f64::consts::TAU;

/// Of the head along the route, metres.
const PLACE: usize = 0;
/// Metres a second.
const SPEED: usize = 1;
/// Error of the odometer's scale.
const SCALE: usize = 2;
/// Slow error of fixes, metres.
const FIX_ERROR: usize = 3;
/// Place at the odometer's last sample, metres.
const BEFORE: usize = 4;
const STATES: usize = 5;

type State = SVector<f64, STATES>;
type Row = RowSVector<f64, STATES>;
type StateCovariance = SMatrix<f64, STATES, STATES>;

/// What a measurement is off by more standard deviations than this is not taken in: once in two million.
const GATE_SIGMAS: f64 = 5.0;
/// Change of acceleration, m/s2 in the root of a second, that leaves a run as it is measured.
const FREE_MPS2: f64 = 20.0;
/// Share of measurements that are outliers: reflected fixes, exchanged tags, lost pulses.
const OUTLIER: f64 = 1e-3;

/// What a source says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measured {
    /// Place of the head by a fix, metres along the route, and its variance.
    Fix {
        /// Along the route.
        place_m: f64,
        /// As the receiver states it, along the route.
        variance_m2: f64,
    },
    /// Place that the head had when the reader was over a tag.
    Tag {
        /// Along the route.
        place_m: f64,
        /// Since then.
        age_s: f64,
    },
    /// What the odometer says was run since its last sample.
    Run {
        /// Forwards positive.
        length_m: f64,
        /// Since then.
        seconds: f64,
    },
}

impl Measured {
    /// Who says it.
    pub fn source(&self) -> Source {
        match self {
            Self::Fix { .. } => Source::Satellites,
            Self::Tag { .. } => Source::Tags,
            Self::Run { .. } => Source::Odometer,
        }
    }
}

impl Measured {
    /// An outlier is as likely anywhere within this: of places metres, of a run what no train runs in the time.
    fn outlier_spread(&self) -> f64 {
        match self {
            Self::Fix { .. } | Self::Tag { .. } => 200.0,
            Self::Run { seconds, .. } => 50.0 * seconds,
        }
    }
}

/// A filter over some sources.
#[derive(Clone, Debug)]
pub struct AlongFilter {
    mean: State,
    covariance: StateCovariance,
    /// Of the last fix, the part that changes slowly.
    slow_m2: f64,
    /// Measurements in a row that were not taken in, by source.
    rejected: [u32; 3],
}

/// How a measurement compares with a filter.
struct Innovation {
    row: Row,
    off: f64,
    noise: f64,
    variance: f64,
}

impl AlongFilter {
    /// At a place and speed, each with a standard deviation.
    pub fn at(place_m: [f64; 2], speed_mps: [f64; 2], settings: &CombinedSettings) -> Self {
        let sigmas = [place_m[1], speed_mps[1], settings.odometer_scale, 0.0, 0.0];
        let mut filter = Self {
            mean: State::from([place_m[0], speed_mps[0], 0.0, 0.0, 0.0]),
            covariance: StateCovariance::from_diagonal(&State::from(
                sigmas.map(|sigma| sigma * sigma),
            )),
            slow_m2: 0.0,
            rejected: [0; 3],
        };
        filter.mark();
        filter
    }

    /// Where the head is, metres along the route.
    pub fn place_m(&self) -> f64 {
        self.mean[PLACE]
    }

    /// Variance of that.
    pub fn place_m2(&self) -> f64 {
        self.covariance[(PLACE, PLACE)].max(0.0)
    }

    /// Speed, m/s.
    pub fn speed_mps(&self) -> f64 {
        self.mean[SPEED]
    }

    /// Covariance of place and speed.
    pub fn covariance(&self) -> [[f64; 2]; 2] {
        [PLACE, SPEED].map(|i| [PLACE, SPEED].map(|j| self.covariance[(i, j)]))
    }

    /// Measurements of a source in a row that were not taken in.
    pub fn rejected(&self, source: Source) -> u32 {
        self.rejected[source as usize]
    }

    /// The same, as if nothing had ever been rejected.
    #[must_use]
    pub fn acquitted(&self) -> Self {
        Self {
            rejected: [0; 3],
            ..self.clone()
        }
    }

    /// The odometer was read: its next sample counts from here.
    pub fn mark(&mut self) {
        self.mean[BEFORE] = self.mean[PLACE];
        let row = self.covariance.row(PLACE).into_owned();
        self.covariance.set_row(BEFORE, &row);
        let column = self.covariance.column(PLACE).into_owned();
        self.covariance.set_column(BEFORE, &column);
    }

    /// Carries it on. Where an odometer measures the run no model of the motion is wanted beside it: a train brakes for half
    /// a minute alike, which white noise does not, and the place would lag.
    pub fn advance(&mut self, seconds: f64, has_odometer: bool, settings: &CombinedSettings) {
        let keep = [settings.odometer_scale_s, settings.fix_correlation_s]
            .map(|time_s| (-seconds / time_s).exp());
        let mut transition =
            StateCovariance::from_diagonal(&State::from([1.0, 1.0, keep[0], keep[1], 1.0]));
        transition[(PLACE, SPEED)] = seconds;
        self.mean = transition * self.mean;
        self.covariance = transition * self.covariance * transition.transpose();
        let change_mps2 = match has_odometer {
            true => FREE_MPS2,
            false => settings.acceleration_mps2,
        };
        let change = change_mps2.powi(2);
        self.covariance[(PLACE, PLACE)] += change * seconds.powi(3) / 3.0;
        self.covariance[(SPEED, SPEED)] += change * seconds;
        for (at, other) in [(PLACE, SPEED), (SPEED, PLACE)] {
            self.covariance[(at, other)] += change * seconds.powi(2) / 2.0;
        }
        self.covariance[(SCALE, SCALE)] +=
            (1.0 - keep[0] * keep[0]) * settings.odometer_scale.powi(2);
        self.covariance[(FIX_ERROR, FIX_ERROR)] += (1.0 - keep[1] * keep[1]) * self.slow_m2;
    }

    /// By how many standard deviations a measurement is off.
    pub fn deviations(&self, measured: &Measured, settings: &CombinedSettings) -> f64 {
        let mut tried = self.clone();
        let innovation = tried.innovation(measured, settings);
        innovation.off.abs() / innovation.variance.sqrt()
    }

    /// Takes a measurement in, unless it is too far off; whether it did, and the logarithm of its likelihood against that of
    /// an outlier.
    pub fn take(&mut self, measured: &Measured, settings: &CombinedSettings) -> (bool, f64) {
        let innovation = self.innovation(measured, settings);
        let deviations2 = innovation.off.powi(2) / innovation.variance;
        let count = &mut self.rejected[measured.source() as usize];
        // Nor is what is no number.
        let is_near = deviations2 < GATE_SIGMAS.powi(2);
        if !is_near {
            *count = count.saturating_add(1);
            return (false, OUTLIER.ln());
        }
        let density = (-0.5 * deviations2).exp() / (TAU * innovation.variance).sqrt();
        let log = (density * measured.outlier_spread() + OUTLIER).ln();
        *count = 0;
        let Innovation {
            row,
            off,
            noise,
            variance,
        } = innovation;
        let gain = self.covariance * row.transpose() / variance;
        self.mean += gain * off;
        // Joseph's form: symmetric and positive whatever rounding does.
        let left = StateCovariance::identity() - gain * row;
        self.covariance =
            left * self.covariance * left.transpose() + gain * gain.transpose() * noise;
        (true, log)
    }

    /// The slow error of fixes becomes as large as this fix states it.
    fn innovation(&mut self, measured: &Measured, settings: &CombinedSettings) -> Innovation {
        let (row, expected, value, noise) = match *measured {
            Measured::Fix {
                place_m,
                variance_m2,
            } => {
                let slow_m2 = settings.fix_correlated_share * variance_m2 + settings.map_m.powi(2);
                self.covariance[(FIX_ERROR, FIX_ERROR)] += (slow_m2 - self.slow_m2).max(0.0);
                self.slow_m2 = slow_m2;
                let row = Row::from([1.0, 0.0, 0.0, 1.0, 0.0]);
                let noise = (1.0 - settings.fix_correlated_share) * variance_m2;
                (row, self.mean[PLACE] + self.mean[FIX_ERROR], place_m, noise)
            }
            Measured::Tag { place_m, age_s } => {
                let row = Row::from([1.0, -age_s, 0.0, 0.0, 0.0]);
                let expected = self.mean[PLACE] - age_s * self.mean[SPEED];
                (row, expected, place_m, settings.tag_m.powi(2))
            }
            Measured::Run { length_m, seconds } => {
                let run_m = self.mean[PLACE] - self.mean[BEFORE];
                let times = 1.0 + self.mean[SCALE];
                let row = Row::from([times, 0.0, run_m, 0.0, -times]);
                let noise_m = settings.odometer_mps * seconds;
                (row, run_m * times, length_m, noise_m.powi(2))
            }
        };
        let variance = (row * self.covariance * row.transpose())[0] + noise;
        Innovation {
            row,
            off: value - expected,
            noise,
            variance,
        }
    }
}

/// A filter for each set of sources. That of a set takes in what its sources say.
#[derive(Clone, Debug)]
pub struct FilterBank(Vec<AlongFilter>);

impl FilterBank {
    /// All the same.
    pub fn of(filter: &AlongFilter) -> Self {
        Self(vec![filter.clone(); 8])
    }

    /// That of a set.
    pub fn of_set(&self, sources: Sources) -> &AlongFilter {
        &self.0[sources.number()]
    }

    /// Carries all on.
    pub fn advance(&mut self, seconds: f64, settings: &CombinedSettings) {
        for (number, filter) in self.0.iter_mut().enumerate() {
            filter.advance(seconds, Sources::numbered(number).odometer, settings);
        }
    }

    /// Gives all filters that have its source a measurement. Of tags only the last one may be wrong, as two in a row never
    /// are: so filters without tags go on from those with the earlier ones.
    pub fn take(&mut self, measured: &Measured, settings: &CombinedSettings) {
        let source = measured.source();
        for number in 0..self.0.len() {
            let sources = Sources::numbered(number);
            if !sources.has(source) {
                continue;
            }
            let before = (source == Source::Tags).then(|| self.0[number].clone());
            let (is_taken, _) = self.0[number].take(measured, settings);
            if let Some(before) = before.filter(|_| is_taken) {
                self.0[sources.with(source, false).number()] = before;
            }
        }
        if source == Source::Odometer {
            self.mark();
        }
    }

    /// The odometer was read.
    pub fn mark(&mut self) {
        self.0.iter_mut().for_each(AlongFilter::mark);
    }

    /// Begins the filters with a source anew, each from that without it.
    pub fn renew(&mut self, source: Source) {
        for number in 0..self.0.len() {
            let sources = Sources::numbered(number);
            if sources.has(source) {
                let without = sources.with(source, false).number();
                self.0[number] = self.0[without].acquitted();
            }
        }
    }

    /// Lets the filter without any source go on from that of a set, which other sources have confirmed.
    pub fn confirm(&mut self, sources: Sources) {
        self.0[Sources::NONE.number()] = self.0[sources.number()].clone();
    }
}
