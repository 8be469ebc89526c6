//! Which track the train is on, where on it, and how probable that is.
//!
//! Fixes of a satellite receiver, speed and, if there is one, a yaw rate are held against a network in plan. What is
//! believed is a set of hypotheses: a course over the network, the place on it, a probability. Where a course comes
//! to a switch it becomes two; where two courses meet for good they become one; a hypothesis under
//! [`OccupancySettings::least_probability`] is dropped. When all that are left are on one track, that is identified.
//! Nothing is decided before a fix lies on the map.
//!
//! What it cannot do: a receiver that calls a drift of about half a metre a second for half a minute a good fix, where
//! tracks lie side by side, makes it certain of a wrong one, until the receiver has found itself again.
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
mod decision;
mod equipment;
mod fix_error;
mod fix_trust;
mod fused;
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
use fix_trust::{Circumstances, FixTrust};
use hypothesis::Hypothesis;
use nalgebra::{Matrix2, Point2};
use std::sync::Arc;

/// Inputs beyond these are no measurements of a train: speed, yaw rate, distance from the world's origin, and the
/// standard deviation of a fix.
const MOST_MPS: f64 = 200.0;
const MOST_RADPS: f64 = 10.0;
const FARTHEST_M: f64 = 1e7;
const LEAST_SIGMA_M: f64 = 1e-3;
/// No track is looked for farther away, metres.
const OFF_TRACK_M: f64 = 2000.0;
/// Headings are compared each time that so much was run: what the map has wrong is wrong over a stretch.
const HEADING_EVERY_M: f64 = 2.0;
/// A speed or a yaw rate is not known any more after a longer silence, seconds.
const SILENCE_S: f64 = 2.0;
/// So far a wheel may be off the train's speed before it is said to slide or slip: a share of that, and no less than
/// this. Each maker of slide protection has its own rule.
const SLIDE_SHARE: f64 = 0.1;
const SLIDE_MPS: f64 = 0.3;
/// And so fast a train's speed changes meanwhile.
const SLIDE_MPS2: f64 = 1.0;

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

/// What the train has run in a time, by the measured speed.
#[derive(Clone, Copy, Debug, Default)]
struct TrainRun {
    length_m: f64,
    seconds: f64,
    /// Variance of the length for want of a speed.
    unknown_m2: f64,
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
    slides: Option<SimTime>,
    /// Standard deviation of what was run since the last fix or balise, for want of a speed: a train that brakes slides
    /// the same way again and again, so that errors add up.
    unknown_m: f64,
    yaw_rate: Option<(SimTime, f64)>,
    speed_filter: pedal::SpeedFilter,
    /// Since the hypotheses were carried on.
    since: TrainRun,
    /// Since the last fix, seconds.
    since_fix_s: f64,
    /// Run since the start.
    run_m: f64,
    /// Run since headings were compared.
    since_heading_m: f64,
    turned_rad: f64,
    lost: u32,
    /// Since when fixes lie on a track that no hypothesis is on.
    doubted: Option<SimTime>,
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
            slides: None,
            unknown_m: 0.0,
            yaw_rate: None,
            speed_filter: pedal::SpeedFilter::default(),
            since: TrainRun::default(),
            since_fix_s: 0.0,
            run_m: 0.0,
            since_heading_m: 0.0,
            turned_rad: 0.0,
            lost: 0,
            doubted: None,
            trust: FixTrust::default(),
        }
    }

    /// How many hypotheses are alive.
    pub fn alive(&self) -> usize {
        self.hypotheses.len()
    }

    /// Takes the speed, forwards positive. What no train can have, or is older than the last input, is dropped.
    pub fn on_speed(&mut self, time: SimTime, speed_mps: f64) {
        if speed_mps.abs() <= MOST_MPS && self.run_to(time) {
            let more_m = change_since(self.speed, (time, speed_mps));
            self.since.length_m += more_m;
            self.run_m += more_m;
            self.speed = Some((time, speed_mps));
            self.slides = None;
            self.speed_filter
                .update(time, speed_mps, self.settings.speed_sigma_mps);
        }
    }

    /// Takes the speed of a wheel that slides or slips. The train's goes after it no faster than adhesion allows, and is
    /// more and more doubtful.
    pub fn on_slide(&mut self, time: SimTime, speed_mps: f64) {
        if !(speed_mps.abs() <= MOST_MPS && self.run_to(time)) {
            return;
        }
        if let Some((before, held_mps)) = self.speed {
            let most_mps = SLIDE_MPS2 * time.since(before);
            let now_mps = held_mps + (speed_mps - held_mps).clamp(-most_mps, most_mps);
            let more_m = change_since(self.speed, (time, now_mps));
            self.since.length_m += more_m;
            self.run_m += more_m;
            self.speed = Some((time, now_mps));
            self.slides.get_or_insert(before);
        }
    }

    /// Takes the yaw rate, to the left positive.
    pub fn on_yaw_rate(&mut self, time: SimTime, yaw_rate_radps: f64) {
        if yaw_rate_radps.abs() <= MOST_RADPS && self.run_to(time) {
            self.turned_rad += change_since(self.yaw_rate, (time, yaw_rate_radps));
            self.yaw_rate = Some((time, yaw_rate_radps));
        }
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
        self.unknown_m = 0.0;
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

    /// Sums speed and yaw rate up to a time; whether it is no older than the last input.
    fn run_to(&mut self, time: SimTime) -> bool {
        let seconds = self.time.map_or(0.0, |last| time.since(last));
        if seconds < 0.0 {
            return false;
        }
        self.time = Some(time);
        let held = |reading: Option<(SimTime, f64)>| {
            reading
                .filter(|(at, _)| time.since(*at) <= SILENCE_S)
                .map_or(0.0, |(_, value)| value)
        };
        let (speed_mps, doubt_mps) = match (self.speed, self.slides) {
            (Some((_, speed_mps)), Some(since)) => {
                let off_mps = SLIDE_MPS.max(SLIDE_SHARE * speed_mps.abs());
                (speed_mps, off_mps + SLIDE_MPS2 * time.since(since))
            }
            // It may have stopped at once, or gone on.
            (Some((at, speed_mps)), None) if time.since(at) > SILENCE_S => {
                (0.5 * speed_mps, 0.5 * speed_mps.abs())
            }
            (speed, _) => (held(speed), 0.0),
        };
        let run_m = speed_mps * seconds;
        let before_m2 = self.unknown_m.powi(2);
        self.unknown_m += doubt_mps * seconds;
        self.since.unknown_m2 += self.unknown_m.powi(2) - before_m2;
        self.turned_rad += held(self.yaw_rate) * seconds;
        self.since.length_m += run_m;
        self.since.seconds += seconds;
        self.run_m += run_m;
        self.since_heading_m += run_m.abs();
        if self.since_heading_m >= HEADING_EVERY_M {
            self.compare_headings();
        }
        true
    }

    fn compare_headings(&mut self) {
        self.since_heading_m = 0.0;
        self.advance();
        if self.yaw_rate.is_some() && self.settings.method == Method::Fused {
            let (network, settings) = (&self.network, &self.settings);
            for hypothesis in &mut self.hypotheses {
                hypothesis.update_heading(network, self.turned_rad, settings);
            }
            self.tidy();
            return;
        }
        let before = self.hypotheses.len();
        self.grow();
        if self.hypotheses.len() != before {
            self.tidy();
        }
    }

    fn advance(&mut self) {
        let run = std::mem::take(&mut self.since);
        // From fix to fix the error of the speed is one.
        let [before_s, now_s] = [self.since_fix_s, self.since_fix_s + run.seconds];
        self.since_fix_s = now_s;
        let speed_m2 = self.speed_filter.sigma_mps().powi(2) * (now_s.powi(2) - before_s.powi(2));
        for hypothesis in &mut self.hypotheses {
            match self.settings.method {
                Method::Fused => hypothesis.advance_fused(&run, &self.settings),
                _ => hypothesis.advance_by_speed(run.length_m, speed_m2),
            }
        }
    }

    fn grow(&mut self) {
        let (network, settings) = (&self.network, &self.settings);
        let grown = self
            .hypotheses
            .drain(..)
            .flat_map(|h| h.grown(network, settings));
        self.hypotheses = grown.collect();
    }

    /// Normalises, drops, merges and branches.
    fn tidy(&mut self) {
        let Some(most) = self
            .hypotheses
            .iter()
            .map(|h| h.log_probability)
            .reduce(f64::max)
        else {
            return;
        };
        let sum: f64 = self
            .hypotheses
            .iter()
            .map(|h| (h.log_probability - most).exp())
            .sum();
        let log_sum = most + sum.ln();
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
