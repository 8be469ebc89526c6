//! Place and probability of a hypothesis by matches and speed (Guo et al. 2020, sections 2.2 and 2.3).
//!
//! The place by the last one and the speed, l + v T, and that of the match are weighted by their inverse variances.
//! A hypothesis is as probable as it was times the normal density of the distance r to its match, with the standard
//! deviation of the fix in that direction. The variance of a match along the track is that of the pedal curve there.

use super::Fix;
use super::dead_reckoning::TrainRun;
use super::hypothesis::{Hypothesis, PLACE, StateCovariance};
use super::matching::{Match, Matching};
use crate::bus::SimTime;
use crate::track::plan::PlanNetwork;

/// A match is looked for so many standard deviations from the place, and so far.
const AROUND_SIGMAS: f64 = 6.0;
const AROUND_M: f64 = 30.0;
/// By how much a train's speed changes in a second, m/s: the acceleration of metros.
const SPEED_CHANGE_MPS2: f64 = 1.0;

/// Variance of a Kalman filter of the speed, and of what was run by it since the last fix. Its mean is not needed, as the
/// place is carried on by the measured speed.
#[derive(Clone, Copy, Debug, Default)]
pub struct SpeedFilter {
    last: Option<SpeedVariance>,
    since_fix_s: f64,
}

/// As it was at the last speed.
#[derive(Clone, Copy, Debug)]
struct SpeedVariance {
    time: SimTime,
    m2ps2: f64,
}

impl SpeedFilter {
    /// Takes in that the speed was measured.
    pub fn update(&mut self, time: SimTime, sigma_mps: f64) {
        let measured_m2ps2 = sigma_mps.powi(2);
        let m2ps2 = self.last.map_or(measured_m2ps2, |last| {
            let change_mps = SPEED_CHANGE_MPS2 * time.since(last.time);
            let prior_m2ps2 = last.m2ps2 + change_mps.powi(2);
            let gain = prior_m2ps2 / (prior_m2ps2 + measured_m2ps2);
            (1.0 - gain) * prior_m2ps2
        });
        self.last = Some(SpeedVariance { time, m2ps2 });
    }

    /// A fix was taken in.
    pub fn on_fix(&mut self) {
        self.since_fix_s = 0.0;
    }

    /// What a run adds to the variance of what was run since the last fix. From fix to fix the speed is wrong by the same,
    /// so that the variance grows with the square of the time.
    pub fn variance_m2(&mut self, run: &TrainRun) -> f64 {
        let [before_s, now_s] = [self.since_fix_s, self.since_fix_s + run.seconds];
        self.since_fix_s = now_s;
        let speed_m2ps2 = self.last.map_or(0.0, |last| last.m2ps2);
        speed_m2ps2 * (now_s.powi(2) - before_s.powi(2)) + run.unknown_m2
    }
}

impl Hypothesis {
    /// At its match.
    pub fn start_matched(&mut self, found: &Match) {
        *self.covariance = StateCovariance::zeros();
        self.covariance[(PLACE, PLACE)] = found.sigma_m.powi(2);
    }

    /// Carries it on by what was run; the variance is that of the run.
    pub fn advance_by_speed(&mut self, run_m: f64, variance_m2: f64) {
        self.mean[PLACE] += run_m;
        self.covariance[(PLACE, PLACE)] += variance_m2;
    }

    /// Takes a fix in by its match.
    pub fn update_matched(&mut self, network: &PlanNetwork, fix: &Fix, matched: Matching) {
        let reach_m = AROUND_M + AROUND_SIGMAS * self.sigma_m();
        let [from_m, to_m] = [self.place_m() - reach_m, self.place_m() + reach_m];
        let matches = self.course.legs().iter().filter_map(|leg| {
            let ends = [from_m, to_m].map(|m| leg.along_m(m).clamp(0.0, leg.length_m));
            let stretch_m = [ends[0].min(ends[1]), ends[0].max(ends[1])];
            let element = &network.elements[leg.towards.element];
            let found = matched(element, stretch_m, &fix.place, &fix.covariance_m2)?;
            Some((leg.course_m(found.along_m), found))
        });
        let nearest = matches.min_by(|a, b| a.1.deviations().total_cmp(&b.1.deviations()));
        let Some((match_m, found)) = nearest else {
            return;
        };
        self.log_probability -= 0.5 * found.deviations().powi(2) + found.sigma_m.ln();
        let (_, forward) = self.course.at(network, match_m);
        let along_m2 = forward.dot(&(fix.covariance_m2 * forward));
        let own_m2 = self.covariance[(PLACE, PLACE)];
        let weight = own_m2 / (own_m2 + along_m2).max(f64::MIN_POSITIVE);
        self.mean[PLACE] += weight * (match_m - self.place_m());
        self.covariance[(PLACE, PLACE)] = (1.0 - weight) * own_m2;
    }
}
