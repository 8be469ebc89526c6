//! Which track the train is on, where on it, and how probable that is.
//!
//! Fixes of a satellite receiver, balises, speed and, if there is one, a yaw rate are held against a network in plan.
//! What is believed is a set of hypotheses: a course over the network, the place on it, a probability. Where a course
//! comes to a switch it becomes two; where two courses meet for good they become one; a hypothesis under
//! [`OccupancySettings::least_probability`] is dropped. When all that are left are on one track, that is identified.
//! Nothing is decided before a fix lies on the map or a balise of the map is read.
//!
//! What it cannot do: where tracks lie side by side, a receiver whose fixes drift by about half a metre a second for
//! half a minute, while it states that they are good, makes it certain of a wrong track until the drift has ended. Errors of
//! fixes that last longer than [`OccupancySettings::lasting_s`], or have a larger share of the variance than
//! [`OccupancySettings::lasting_share`], do the same to a train that stands or creeps; so does a map that is worse than
//! [`OccupancySettings::map_sigma_m`] or whose errors change over less than [`OccupancySettings::map_correlation_m`], to a
//! train that begins beside a parallel track from nothing.
//!
//! Theory: Guo et al. 2020 (see [`Method::Pedal`]) for hypotheses, pedal curve, pruning and the six classes of a
//! decision; Gerlach and Hoppe 2009 for the baseline; [`Method::Fused`] is a bank of extended Kalman filters with
//! correlated errors.
//!
//! ```
//! use metrotwin::bus::SimTime;
//! use metrotwin::stack::occupancy::{Fix, Occupancy, OccupancySettings};
//! use metrotwin::track::plan::{PlanNetwork, TrackElement};
//! use nalgebra::{Matrix2, Point2};
//!
//! let track = |id: &str, y| TrackElement::new(id, vec![Point2::new(0.0, y), Point2::new(500.0, y)]);
//! let elements = [track("one", 0.0), track("other", 12.0)].into_iter().flatten().collect();
//! let network = PlanNetwork::new(None, elements, &[]);
//! let mut occupancy = Occupancy::new(network.into(), OccupancySettings::default());
//! for k in 0..20 {
//!     let time = SimTime::from_secs(f64::from(k));
//!     occupancy.on_speed(time, 10.0);
//!     let place = Point2::new(50.0 + 10.0 * f64::from(k), 0.3);
//!     occupancy.on_fix(&Fix { time, place, covariance_m2: Matrix2::identity() });
//! }
//! let decision = occupancy.decision();
//! assert_eq!(decision.tracks[0].element, 0);
//! assert!((decision.tracks[0].along_m - 240.0).abs() < 2.0);
//! ```

mod balise;
mod balise_group;
mod course;
mod dead_reckoning;
mod decision;
mod equipment;
mod fix_error;
mod fix_trust;
mod fused;
mod headings;
mod hypothesis;
mod map_error;
mod matching;
mod merging;
mod pedal;
mod placing;
mod settings;
mod side_by_side;
mod start;
#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests;

pub use decision::{Decision, TrackDecision};
pub use equipment::TrackOccupancy;
pub use matching::{Match, Matching, by_pedal_curve, by_perpendicular};
pub use settings::{Method, OccupancySettings};

use crate::bus::SimTime;
use crate::track::plan::{ElementEnd, PlanNetwork};
use dead_reckoning::DeadReckoning;
use fix_trust::{Circumstances, FixTrust};
use fused::Advance;
use hypothesis::Hypothesis;
use nalgebra::{Matrix2, Point2};
use std::sync::Arc;

/// Fixes beyond these are no measurements of a train: distance from the world's origin, and standard deviation.
const FARTHEST_M: f64 = 1e7;
const LEAST_SIGMA_M: f64 = 1e-3;
/// No track is looked for farther away, metres.
const OFF_TRACK_M: f64 = 2000.0;

/// Headings are compared each time that so much was run: what the map has wrong is wrong over a stretch.
const HEADING_EVERY_M: f64 = 2.0;

/// A fix in the plane of the network.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// When it was valid.
    pub time: SimTime,
    /// World x and y.
    pub place: Point2<f64>,
    /// Of x and y.
    pub covariance_m2: Matrix2<f64>,
}

impl Fix {
    /// Whether it can be one of a receiver on a railway.
    fn is_possible(&self) -> bool {
        let variances = [(0, 0), (1, 1)].map(|at| self.covariance_m2[at]);
        self.place.iter().all(|m| m.abs() <= FARTHEST_M)
            && variances
                .iter()
                .all(|m2| LEAST_SIGMA_M.powi(2) <= *m2 && *m2 <= FARTHEST_M)
            && is_symmetric(&self.covariance_m2)
            && self.covariance_m2.cholesky().is_some()
    }
}

/// The filter.
#[derive(Clone, Debug)]
pub struct Occupancy {
    network: Arc<PlanNetwork>,
    settings: OccupancySettings,
    hypotheses: Vec<Hypothesis>,
    reckoning: DeadReckoning,
    speed_filter: pedal::SpeedFilter,
    /// Fixes in a row that were far from all hypotheses.
    lost_fixes: u32,
    /// Since when fixes lie on a track that no hypothesis is on.
    doubted_since: Option<SimTime>,
    trust: FixTrust,
}

impl Occupancy {
    /// That knows nothing yet.
    pub fn new(network: Arc<PlanNetwork>, settings: OccupancySettings) -> Self {
        Self {
            network,
            settings,
            hypotheses: Vec::new(),
            reckoning: DeadReckoning::default(),
            speed_filter: pedal::SpeedFilter::default(),
            lost_fixes: 0,
            doubted_since: None,
            trust: FixTrust::default(),
        }
    }

    /// How many hypotheses are alive.
    pub fn alive(&self) -> usize {
        self.hypotheses.len()
    }

    /// Takes the speed, forwards positive. What no train can have, or is older than the last input, is dropped.
    pub fn on_speed(&mut self, time: SimTime, speed_mps: f64) {
        if self.reckoning.on_speed(time, speed_mps) {
            self.speed_filter
                .update(time, self.settings.speed_sigma_mps);
            self.after_run();
        }
    }

    /// Takes the speed of a wheel that slides or slips.
    pub fn on_slide(&mut self, time: SimTime, speed_mps: f64) {
        self.reckoning.on_slide(time, speed_mps);
        self.after_run();
    }

    /// Takes the yaw rate, to the left positive.
    pub fn on_yaw_rate(&mut self, time: SimTime, yaw_rate_radps: f64) {
        self.reckoning.on_yaw_rate(time, yaw_rate_radps);
        self.after_run();
    }

    /// Takes a fix.
    pub fn on_fix(&mut self, fix: &Fix) {
        if !fix.is_possible() || !self.run_to(fix.time) {
            return;
        }
        self.advance();
        let at = Circumstances {
            away_m: self.network.distance_m(&fix.place, OFF_TRACK_M),
            run_m: self.reckoning.run_m,
        };
        let Some(judged) = self.trust.judge(fix, at, &self.settings) else {
            return;
        };
        let fix_sigma_m = judged.fix.covariance_m2.trace().sqrt();
        self.reckoning.known_to(fix_sigma_m);
        let fix = &judged.fix;
        self.start(&judged);
        let (network, settings) = (&self.network, &self.settings);
        if settings.method == Method::Fused {
            side_by_side::compare_distances(&mut self.hypotheses, network, 0.0, settings);
        }
        for hypothesis in &mut self.hypotheses {
            match settings.method {
                Method::Fused => {
                    hypothesis.update_fused(network, &judged, settings);
                }
                Method::Pedal => hypothesis.update_matched(network, fix, by_pedal_curve),
                Method::Perpendicular => hypothesis.update_matched(network, fix, by_perpendicular),
            }
        }
        self.speed_filter.on_fix();
        self.tidy();
    }

    /// Carries what is believed on to a time, by speed and yaw rate; not back.
    pub fn carry_on(&mut self, time: SimTime) {
        if self.run_to(time) {
            self.advance();
            self.tidy();
        }
    }

    /// What is believed at the last fix, or since then at the time that it was carried on to.
    pub fn decision(&self) -> Decision {
        Decision::of(&self.hypotheses, self.settings.least_probability)
    }

    /// Sums speed and yaw rate up to a time; whether it is no older than the last input.
    fn run_to(&mut self, time: SimTime) -> bool {
        let is_later = self.reckoning.run_to(time);
        if is_later {
            self.after_run();
        }
        is_later
    }

    /// Compares distances and headings where enough was run since this was last done.
    fn after_run(&mut self) {
        if self.reckoning.since_heading_m < HEADING_EVERY_M {
            return;
        }
        let run_m = std::mem::take(&mut self.reckoning.since_heading_m);
        self.advance();
        let (network, settings) = (&self.network, &self.settings);
        if settings.method == Method::Fused {
            side_by_side::compare_distances(&mut self.hypotheses, network, run_m, settings);
        }
        if self.reckoning.has_yaw_rate() && settings.method == Method::Fused {
            let turned = (self.reckoning.turned_rad, run_m);
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
    fn advance(&mut self) {
        let run = self.reckoning.take_run();
        let speed_m2 = self.speed_filter.variance_m2(&run);
        if self.settings.method == Method::Fused {
            let advance = Advance::over(&run, &self.settings);
            for hypothesis in &mut self.hypotheses {
                hypothesis.advance_fused(&advance);
            }
        } else {
            for hypothesis in &mut self.hypotheses {
                hypothesis.advance_by_speed(run.length_m, speed_m2);
            }
        }
    }

    fn grow(&mut self) {
        let mut grown = Vec::with_capacity(self.hypotheses.len());
        for hypothesis in self.hypotheses.drain(..) {
            hypothesis.grow_into(&mut grown, &self.network, &self.settings);
        }
        self.hypotheses = grown;
    }

    /// Normalises, drops, branches and merges.
    fn tidy(&mut self) {
        let logs = || self.hypotheses.iter().map(|h| h.log_probability);
        let Some(most) = logs().reduce(f64::max) else {
            return;
        };
        let log_sum = most + logs().map(|log| (log - most).exp()).sum::<f64>().ln();
        let least = self.settings.least_probability.ln();
        for hypothesis in &mut self.hypotheses {
            hypothesis.log_probability -= log_sum;
        }
        self.hypotheses
            .retain(|h| h.log_probability >= least && h.is_finite());
        (self.hypotheses).sort_by(|a, b| b.log_probability.total_cmp(&a.log_probability));
        self.hypotheses
            .truncate(self.settings.most_hypotheses as usize);
        self.grow();
        self.merge();
    }

    /// Makes one of those that say the same of all that is to come.
    fn merge(&mut self) {
        let mut kept: Vec<Hypothesis> = Vec::with_capacity(self.hypotheses.len());
        // Only what is on the same element, the same way, can be one.
        let mut on: Vec<ElementEnd> = Vec::with_capacity(self.hypotheses.len());
        for hypothesis in self.hypotheses.drain(..) {
            let towards = hypothesis.towards();
            let mut same = kept
                .iter_mut()
                .zip(&mut on)
                .filter(|(_, on)| **on == towards);
            let merged = same.find_map(|(other, on)| {
                let merges = other.merge(&hypothesis, &self.network, &self.settings);
                merges.then(|| *on = other.towards())
            });
            if merged.is_none() {
                kept.push(hypothesis);
                on.push(towards);
            }
        }
        self.hypotheses = kept;
    }
}

/// But for rounding, as of a covariance that was turned.
fn is_symmetric(covariance: &Matrix2<f64>) -> bool {
    (covariance[(0, 1)] - covariance[(1, 0)]).abs() <= 1e-9 * covariance.trace()
}
