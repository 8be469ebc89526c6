//! Which sources are in order, as the equipment finds out by itself: by silence, and by disagreement.
//!
//! **Disagreement.** Which source is wrong, if one is for certain, say the probabilities of what all of them say
//! ([`FaultModels`]). Until that is known nothing is taken away, and the protection level includes by how much the estimates
//! with and without each source are apart. Two sources alone that disagree show that one is wrong, and hardly which.

use super::fault_models::FaultModels;
use super::filter::{FilterBank, Measured};
use super::mode::{Source, Sources};
use super::settings::CombinedSettings;
use crate::bus::SimTime;
use crate::stack::protection_level::normal_quantile;

/// Runs in a row that no train can have run after those before them: the odometer has failed.
const MOST_REJECTED_RUNS: u32 = 20;
/// A measurement that is nearer agrees, standard deviations.
const AGREES_SIGMAS: f64 = 3.0;
/// Tags must agree so often before their reader is in order again.
const AGREEING_TAGS: u32 = 2;

/// Why a source has failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// Nothing came of it.
    Silent,
    /// It disagrees with the others.
    Disagrees,
    /// Tags were passed and not read.
    Misses,
}

/// A failure that asks for maintenance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Alarm {
    /// When it was found.
    pub time: SimTime,
    /// What has failed.
    pub source: Source,
    /// Why.
    pub failure: Failure,
}

/// What is known of one source.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    /// When anything last came of it.
    heard: Option<SimTime>,
    failed: Option<Failed>,
}

#[derive(Clone, Copy, Debug)]
struct Failed {
    /// Since when it has agreed again.
    agrees_since: Option<SimTime>,
    agreed: u32,
}

/// Watches over the sources.
#[derive(Clone, Debug)]
pub struct Monitor {
    /// Estimates that are apart by more standard deviations of their difference disagree.
    alert_sigmas: f64,
    states: [State; 3],
    /// Tags in a row that were passed and not read.
    missed_tags: u32,
    /// Found and not yet taken.
    alarms: Vec<Alarm>,
}

impl Monitor {
    /// Of sources that are all in order.
    pub fn new(settings: &CombinedSettings) -> Self {
        Self {
            alert_sigmas: normal_quantile(0.5 * settings.false_alarm),
            states: [State::default(); 3],
            missed_tags: 0,
            alarms: Vec::new(),
        }
    }

    /// Those in order.
    pub fn healthy(&self) -> Sources {
        Source::ALL.into_iter().fold(Sources::ALL, |all, source| {
            all.with(source, self.state(source).failed.is_none())
        })
    }

    /// Alarms since this was last called.
    pub fn take_alarms(&mut self) -> Vec<Alarm> {
        std::mem::take(&mut self.alarms)
    }

    /// Something came of a source.
    pub fn heard(&mut self, source: Source, time: SimTime) {
        self.states[source as usize].heard = Some(time);
    }

    /// A tag was read.
    pub fn read_a_tag(&mut self) {
        self.missed_tags = 0;
    }

    /// A tag was passed and not read.
    pub fn missed_a_tag(&mut self, time: SimTime, settings: &CombinedSettings) {
        self.missed_tags = self.missed_tags.saturating_add(1);
        if self.missed_tags >= settings.missed_tags {
            self.fail(Source::Tags, Failure::Misses, time);
        }
    }

    /// Sources that should have been heard and were not.
    pub fn check_silence(&mut self, time: SimTime, awaited: Sources, settings: &CombinedSettings) {
        let limits_s = [
            settings.fix_silence_s,
            settings.tag_silence_s,
            settings.odometer_silence_s,
        ];
        for (source, limit_s) in Source::ALL.into_iter().zip(limits_s) {
            let state = &mut self.states[source as usize];
            if !awaited.has(source) {
                // From when it is awaited again.
                state.heard = Some(time);
                continue;
            }
            let heard = *state.heard.get_or_insert(time);
            if time.since(heard) > limit_s {
                self.fail(source, Failure::Silent, time);
            }
        }
    }

    /// Whether sources disagree, and which of them has failed.
    pub fn check_agreement(
        &mut self,
        bank: &FilterBank,
        models: &FaultModels,
        among: Sources,
        time: SimTime,
    ) {
        let has_left = |source| bank.of_set(among).rejected(source) >= MOST_REJECTED_RUNS;
        let odometer = Some(Source::Odometer).filter(|odometer| has_left(*odometer));
        let culprit = odometer.or_else(|| models.certain(among));
        if let Some(source) = culprit {
            self.fail(source, Failure::Disagrees, time);
        }
    }

    /// What a failed source says, held against what the others come to; whether it is in order again.
    pub fn on_failed(
        &mut self,
        measured: &Measured,
        deviations: f64,
        time: SimTime,
        settings: &CombinedSettings,
    ) -> bool {
        let source = measured.source();
        let state = &mut self.states[source as usize];
        let Some(failed) = &mut state.failed else {
            return false;
        };
        let agrees = deviations < AGREES_SIGMAS;
        if !agrees {
            *failed = Failed {
                agrees_since: None,
                agreed: 0,
            };
            return false;
        }
        let since = *failed.agrees_since.get_or_insert(time);
        failed.agreed = failed.agreed.saturating_add(1);
        let is_in_order = match source {
            Source::Tags => failed.agreed >= AGREEING_TAGS,
            _ => time.since(since) >= settings.recovery_s,
        };
        if is_in_order {
            state.failed = None;
        }
        is_in_order
    }

    fn state(&self, source: Source) -> &State {
        &self.states[source as usize]
    }

    fn fail(&mut self, source: Source, failure: Failure, time: SimTime) {
        let state = &mut self.states[source as usize];
        if state.failed.is_none() {
            self.alarms.push(Alarm {
                time,
                source,
                failure,
            });
            self.missed_tags = 0;
        }
        // One that is silent does not agree.
        state.failed = Some(Failed {
            agrees_since: None,
            agreed: 0,
        });
    }

    /// By how much the estimate of a set of sources and that of another one, without some that are wrong, may be apart before
    /// that is noticed; by how much they are, if that is more and it is not yet known who is wrong, metres.
    pub fn threshold_m(&self, bank: &FilterBank, sources: Sources, others: Sources) -> f64 {
        let [a, b] = [sources, others].map(|set| bank.of_set(set));
        let apart_sigma_m = match others.and(sources) == others {
            // The second one has nothing that the first one has not.
            true => (b.place_m2() - a.place_m2()).max(0.0).sqrt(),
            false => a.place_m2().sqrt() + b.place_m2().sqrt(),
        };
        let apart_m = (a.place_m() - b.place_m()).abs();
        apart_m.max(self.alert_sigmas * apart_sigma_m)
    }
}
