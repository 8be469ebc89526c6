//! Where a train is, from satellites, tags and an odometer together, whichever of them are in order.
//!
//! A filter for each set of the three sources runs all the time ([`FilterBank`]). Health is found by silence and by
//! disagreement of these filters ([`Monitor`]); health and the kind of line say which sources count ([`mode`]); the estimate
//! is that of the filter of these. Where that changes the estimate does not jump: what it would jump by fades, and is added
//! to its uncertainty and to its protection level until then. The protection level bounds the error whichever one of the
//! counting sources is wrong unnoticed ([`protection_level`](super::protection_level)).
//!
//! What it cannot do: it takes the route for known; two sources that are wrong the same way at once are believed; a single
//! source is checked by nothing, so that the level grows from when it was left alone.
//!
//! ```
//! use metrotwin::bus::SimTime;
//! use metrotwin::stack::combined::{CombinedPositioning, CombinedSettings, Measured, Zones};
//!
//! let settings = CombinedSettings::default();
//! let mut positioning = CombinedPositioning::new(SimTime::ZERO, [100.0, 2.0], Zones::default(), &settings);
//! for k in 1..=100 {
//!     let time = SimTime::from_secs(0.1 * f64::from(k));
//!     positioning.on_reader(time);
//!     positioning.on(time, &Measured::Run { length_m: 1.0, seconds: 0.1 });
//!     if k % 10 == 0 {
//!         let place_m = 100.0 + f64::from(k);
//!         positioning.on(time, &Measured::Fix { place_m, variance_m2: 1.0 });
//!     }
//!     positioning.carry_on(time);
//! }
//! let estimate = positioning.estimate();
//! assert!((estimate.place_m - 200.0).abs() < 1.0 && positioning.take_alarms().is_empty());
//! ```

mod fault_models;
mod filter;
mod mode;
mod monitor;
mod settings;
mod zones;

pub use fault_models::FaultModels;
pub use filter::{AlongFilter, FilterBank, Measured};
pub use mode::{Grade, Mode, Source, Sources, Zone, mode};
pub use monitor::{Alarm, Failure, Monitor};
pub use settings::CombinedSettings;
pub use zones::{ZoneStretch, Zones};

use super::protection_level::{EstimateBound, FaultMode, protection_level_m};
use crate::bus::SimTime;

/// Of the speed at the start, which is at rest or nearly so, m/s.
const START_SPEED_MPS: f64 = 30.0;

/// Within so many standard deviations a place is known for certain.
const SURE_SIGMAS: f64 = 3.0;

/// The positioning of a train.
#[derive(Clone, Debug)]
pub struct CombinedPositioning {
    settings: CombinedSettings,
    bank: FilterBank,
    models: FaultModels,
    monitor: Monitor,
    time: SimTime,
    zones: Zones,
    mode: Mode,
    /// What the last changes of mode would have made the place jump by, as far as it has not faded, metres.
    fading_m: f64,
}

/// What it comes to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CombinedEstimate {
    /// When it holds.
    pub time: SimTime,
    /// Of the head along the route, metres.
    pub place_m: f64,
    /// In the running direction, m/s.
    pub speed_mps: f64,
    /// Of place and speed.
    pub covariance: [[f64; 2]; 2],
    /// The place is off by more than this with no more than the risk of the settings, metres. Infinite where nothing bounds
    /// it.
    pub protection_level_m: f64,
    /// The sources that are in order.
    pub healthy: Sources,
    /// The kind of line.
    pub zone: Zone,
    /// Which sources count, and how good that is.
    pub mode: Mode,
}

impl CombinedPositioning {
    /// Of a train whose head is at a place, with a standard deviation, metres along its route.
    pub fn new(
        time: SimTime,
        place_m: [f64; 2],
        zones: Zones,
        settings: &CombinedSettings,
    ) -> Self {
        let filter = AlongFilter::at(place_m, [0.0, START_SPEED_MPS], settings);
        Self {
            settings: *settings,
            bank: FilterBank::of(&filter),
            models: FaultModels::from(&filter, settings),
            monitor: Monitor::new(settings),
            time,
            mode: mode(Sources::ALL, zones.at(place_m[0])),
            zones,
            fading_m: 0.0,
        }
    }

    /// Takes in what a source says. Satellites do not count where the line is covered; what is older than the last input is
    /// dropped.
    pub fn on(&mut self, time: SimTime, measured: &Measured) {
        let source = measured.source();
        if !self.advance(time) || !self.counts_here().has(source) {
            return;
        }
        self.monitor.heard(source, time);
        if !self.monitor.healthy().has(source) && !self.is_back(measured) {
            if source == Source::Odometer {
                self.mark();
            }
            return;
        }
        self.bank.take(measured, &self.settings);
        self.models.take(measured);
        let before = self.monitor.healthy();
        let among = self.monitor.healthy().and(self.counts_here());
        self.monitor
            .check_agreement(&self.bank, &self.models, among, time);
        self.begin_anew(before);
        self.choose_mode();
        let counts = self.mode.counts;
        if Source::ALL.iter().filter(|s| counts.has(**s)).count() > 1 {
            self.bank.confirm(counts);
        }
    }

    /// The tag reader is alive.
    pub fn on_reader(&mut self, time: SimTime) {
        self.monitor.heard(Source::Tags, time);
    }

    /// The odometer says that it cannot be believed now: a wheel slides or slips.
    pub fn on_slide(&mut self, time: SimTime) {
        self.monitor.heard(Source::Odometer, time);
        self.mark();
    }

    /// The next run counts from here.
    fn mark(&mut self) {
        self.bank.mark();
        self.models.mark();
    }

    /// A tag was read, or passed and not read.
    pub fn on_tag_passed(&mut self, time: SimTime, is_read: bool) {
        match is_read {
            true => self.monitor.read_a_tag(),
            false => self.monitor.missed_a_tag(time, &self.settings),
        }
        self.choose_mode();
    }

    /// Goes on to a time, and looks who is silent. Fixes are awaited where the train is in the open for certain.
    pub fn carry_on(&mut self, time: SimTime) {
        if !self.advance(time) {
            return;
        }
        let filter = self.bank.of_set(self.mode.counts);
        let reach_m =
            SURE_SIGMAS * filter.place_m2().sqrt() + self.settings.antenna_behind_head_m.abs();
        let place_m = filter.place_m();
        let is_open = self.zones.is_open([place_m - reach_m, place_m + reach_m]);
        let awaited = Sources::ALL.with(Source::Satellites, is_open);
        let before = self.monitor.healthy();
        self.monitor.check_silence(time, awaited, &self.settings);
        self.begin_anew(before);
        self.choose_mode();
    }

    /// Where the train is.
    pub fn estimate(&self) -> CombinedEstimate {
        let filter = self.bank.of_set(self.mode.counts);
        let mut covariance = filter.covariance();
        covariance[0][0] += self.fading_m.powi(2);
        CombinedEstimate {
            time: self.time,
            place_m: filter.place_m() + self.fading_m,
            speed_mps: filter.speed_mps(),
            covariance,
            protection_level_m: self.protection_level_m(),
            healthy: self.monitor.healthy(),
            zone: self.zone(),
            mode: self.mode,
        }
    }

    /// Failures found since this was last called.
    pub fn take_alarms(&mut self) -> Vec<Alarm> {
        self.monitor.take_alarms()
    }

    fn protection_level_m(&self) -> f64 {
        if self.mode.grade == Grade::Lost {
            return f64::INFINITY;
        }
        let counts = self.mode.counts;
        // Those in order check one that counts, whether or not they count themselves.
        let healthy = self.monitor.healthy().and(self.counts_here());
        let bound = |sources| EstimateBound {
            sigma_m: self.bank.of_set(sources).place_m2().sqrt(),
            bias_m: 0.0,
        };
        let counting = Source::ALL.into_iter().filter(|source| counts.has(*source));
        let faults = counting.map(|source| FaultMode {
            probability: self.settings.fault_probability(source),
            threshold_m: (self.monitor).threshold_m(
                &self.bank,
                counts,
                healthy.with(source, false),
            ),
            without: bound(healthy.with(source, false)),
        });
        let faults: Vec<FaultMode> = faults.collect();
        protection_level_m(&bound(counts), &faults, self.settings.risk) + self.fading_m.abs()
    }

    /// Sources that may count on this kind of line.
    fn counts_here(&self) -> Sources {
        Sources::ALL.with(Source::Satellites, self.zone() != Zone::Covered)
    }

    fn zone(&self) -> Zone {
        let filter = self.bank.of_set(self.mode.counts);
        self.zones.at(filter.place_m() + self.fading_m)
    }

    /// Whether a source that had failed is in order again with this.
    fn is_back(&mut self, measured: &Measured) -> bool {
        let counts = self.mode.counts;
        let deviations = self
            .bank
            .of_set(counts)
            .deviations(measured, &self.settings);
        let is_back = (self.monitor).on_failed(measured, deviations, self.time, &self.settings);
        if is_back {
            self.bank.renew(measured.source());
            self.models = FaultModels::from(self.bank.of_set(counts), &self.settings);
        }
        is_back
    }

    /// After sources have failed, what is believed of faults rests on the others.
    fn begin_anew(&mut self, healthy_before: Sources) {
        let healthy = self.monitor.healthy();
        if healthy != healthy_before {
            let here = healthy.and(self.counts_here());
            self.models = FaultModels::from(self.bank.of_set(here), &self.settings);
        }
    }

    /// Carries all filters on; not back.
    fn advance(&mut self, time: SimTime) -> bool {
        let seconds = time.since(self.time);
        if seconds < 0.0 {
            return false;
        }
        self.bank.advance(seconds, &self.settings);
        self.models.advance(seconds);
        self.fading_m *= (-seconds / self.settings.fade_s).exp();
        self.time = time;
        true
    }

    fn choose_mode(&mut self) {
        let before = self.mode.counts;
        self.mode = mode(self.monitor.healthy(), self.zone());
        let places = [before, self.mode.counts].map(|set| self.bank.of_set(set).place_m());
        self.fading_m += places[0] - places[1];
    }
}
