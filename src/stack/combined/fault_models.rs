//! Which source is wrong: how probable what all of them say is, if none is, or one.
//!
//! A filter takes in all healthy sources as they are believed. Three more each believe one of them to be wrong: fixes off by
//! an error of 20 m that changes within a minute, tags that may be of any place, an odometer that says nothing. The
//! likelihoods of fixes and tags, multiplied up, say which of the four is so (multiple-model adaptive estimation, Magill 1965). Those of
//! runs are left out: fifty a second, they would say how well white noise describes a train's acceleration. A fault may begin
//! at any time: none of the three is ever less probable than its fault is.

use super::filter::{AlongFilter, Measured};
use super::mode::{Source, Sources};
use super::settings::CombinedSettings;

/// A source is wrong if that is so probable.
const CERTAIN: f64 = 0.9999;

/// That a source is wrong, and a filter that believes it.
#[derive(Clone, Debug)]
struct FaultModel {
    source: Source,
    settings: CombinedSettings,
    filter: AlongFilter,
    /// Logarithm of its probability over that of no fault.
    log_odds: f64,
    least_log_odds: f64,
}

/// All of them.
#[derive(Clone, Debug)]
pub struct FaultModels {
    settings: CombinedSettings,
    faultless: AlongFilter,
    faulty: Vec<FaultModel>,
}

impl FaultModels {
    /// From a filter on.
    pub fn from(filter: &AlongFilter, settings: &CombinedSettings) -> Self {
        let faulty = Source::ALL.into_iter().map(|source| {
            let least_log_odds = settings.fault_probability(source).ln();
            FaultModel {
                source,
                settings: of_fault(settings, source),
                filter: filter.clone(),
                log_odds: least_log_odds,
                least_log_odds,
            }
        });
        Self {
            settings: *settings,
            faultless: filter.clone(),
            faulty: faulty.collect(),
        }
    }

    /// Carries all on.
    pub fn advance(&mut self, seconds: f64) {
        self.faultless.advance(seconds, true, &self.settings);
        for model in &mut self.faulty {
            let has_odometer = model.source != Source::Odometer;
            model.filter.advance(seconds, has_odometer, &model.settings);
        }
    }

    /// Takes in what a healthy source says.
    pub fn take(&mut self, measured: &Measured) {
        let is_run = measured.source() == Source::Odometer;
        let (_, faultless) = self.faultless.take(measured, &self.settings);
        for model in &mut self.faulty {
            let (_, faulty) = model.filter.take(measured, &model.settings);
            if !is_run {
                model.log_odds = (model.log_odds + faulty - faultless).max(model.least_log_odds);
            }
        }
        if is_run {
            self.mark();
        }
    }

    /// The odometer was read.
    pub fn mark(&mut self) {
        self.faultless.mark();
        self.faulty.iter_mut().for_each(|model| model.filter.mark());
    }

    /// The source that is wrong, of some, if one is for certain.
    pub fn certain(&self, among: Sources) -> Option<Source> {
        let models = self.faulty.iter().filter(|model| among.has(model.source));
        let most = models.max_by(|a, b| a.log_odds.total_cmp(&b.log_odds))?;
        let others = (self.faulty.iter()).filter(|model| model.source != most.source);
        let rest = 1.0 + others.map(|model| model.log_odds.exp()).sum::<f64>();
        let is_certain = most.log_odds - rest.ln() > (CERTAIN / (1.0 - CERTAIN)).ln();
        is_certain.then_some(most.source)
    }
}

/// What is believed if a source is wrong.
fn of_fault(settings: &CombinedSettings, source: Source) -> CombinedSettings {
    match source {
        Source::Satellites => CombinedSettings {
            map_m: 20.0,
            ..*settings
        },
        Source::Tags => CombinedSettings {
            tag_m: 200.0,
            ..*settings
        },
        Source::Odometer => CombinedSettings {
            odometer_mps: 100.0,
            ..*settings
        },
    }
}
