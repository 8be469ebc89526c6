//! Which track the train is on, where on it, and how probable that is.
//!
//! Fixes of a satellite receiver, balises, speed and, if there is one, a yaw rate are held against a network in plan.
//! What is believed is a set of hypotheses: a course over the network, the place on it, a probability. Where a course
//! comes to a switch it becomes two; where two courses meet for good they become one; a hypothesis under
//! [`OccupancySettings::least_probability`] is dropped. When all that are left are on one track, that is identified.
//! Nothing is decided before a fix lies on the map or a balise of the map is read.
//!
//! What it cannot do: where tracks lie side by side, a receiver whose fixes drift by about half a metre a second for
//! half a minute, while it states that they are good, makes it certain of a wrong track until the drift has ended. The
//! same do errors of fixes that last for much longer than [`OccupancySettings::correlation_s`] while a train stands or
//! creeps, and a map whose errors change over less than [`OccupancySettings::map_correlation_m`], where a yaw rate is
//! held against it.
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
mod pedal;
mod settings;
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
use dead_reckoning::TrainRun;
use fix_trust::{Circumstances, FixTrust};
use hypothesis::Hypothesis;
use nalgebra::{Matrix2, Point2};
use std::sync::Arc;

/// Fixes beyond these are no measurements of a train: distance from the world's origin, and standard deviation.
const FARTHEST_M: f64 = 1e7;
const LEAST_SIGMA_M: f64 = 1e-3;
/// No track is looked for farther away, metres.
const OFF_TRACK_M: f64 = 2000.0;

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
    time: Option<SimTime>,
    speed: Option<(SimTime, f64)>,
    /// Since when the wheel slides or slips.
    sliding_since: Option<SimTime>,
    /// Standard deviation, for want of a speed, of what was run since the last fix or balise: a train that brakes slides
    /// the same way again and again, so that errors add up.
    unknown_m: f64,
    /// Standard deviation of what was turned since the last yaw rate.
    unknown_rad: f64,
    yaw_rate: Option<(SimTime, f64)>,
    speed_filter: pedal::SpeedFilter,
    /// What the hypotheses have not been carried on by yet.
    pending: TrainRun,
    /// Since the last fix, seconds.
    since_fix_s: f64,
    /// Run since the start.
    run_m: f64,
    /// Run since headings were compared.
    since_heading_m: f64,
    /// Sum of the yaw rates since the start.
    turned_rad: f64,
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
            time: None,
            speed: None,
            sliding_since: None,
            unknown_m: 0.0,
            unknown_rad: 0.0,
            yaw_rate: None,
            speed_filter: pedal::SpeedFilter::default(),
            pending: TrainRun::default(),
            since_fix_s: 0.0,
            run_m: 0.0,
            since_heading_m: 0.0,
            turned_rad: 0.0,
            lost_fixes: 0,
            doubted_since: None,
            trust: FixTrust::default(),
        }
    }

    /// How many hypotheses are alive.
    pub fn alive(&self) -> usize {
        self.hypotheses.len()
    }

    /// Takes a fix.
    pub fn on_fix(&mut self, fix: &Fix) {
        if !fix.is_possible() || !self.run_to(fix.time) {
            return;
        }
        self.advance();
        let at = Circumstances {
            away_m: self.network.distance_m(&fix.place, OFF_TRACK_M),
            run_m: self.run_m,
        };
        let Some(judged) = self.trust.judge(fix, at, &self.settings) else {
            return;
        };
        // After a fix the run is known no better than by it.
        self.unknown_m = self.unknown_m.min(judged.fix.covariance_m2.trace().sqrt());
        let fix = &judged.fix;
        self.start(&judged);
        let (network, settings) = (&self.network, &self.settings);
        for hypothesis in &mut self.hypotheses {
            match settings.method {
                Method::Fused => {
                    hypothesis.update_fused(network, &judged, settings);
                }
                Method::Pedal => hypothesis.update_matched(network, fix, by_pedal_curve),
                Method::Perpendicular => hypothesis.update_matched(network, fix, by_perpendicular),
            }
        }
        self.since_fix_s = 0.0;
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

    fn grow(&mut self) {
        let (network, settings) = (&self.network, &self.settings);
        let grown = self
            .hypotheses
            .drain(..)
            .flat_map(|h| h.grown(network, settings));
        self.hypotheses = grown.collect();
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
                let merges = other.merge(&hypothesis, &self.settings);
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
