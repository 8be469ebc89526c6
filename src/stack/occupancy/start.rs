//! Where hypotheses come from: at the start, when all are lost, and when fixes say that the right one may have been
//! dropped.

use super::course::Course;
use super::fix_trust::Judged;
use super::hypothesis::{Hypothesis, State, StateCovariance};
use super::matching::{Match, by_pedal_curve};
use super::placing::TrackPlacing;
use super::{Fix, Method, Occupancy};
use crate::track::Direction;
use crate::track::plan::ElementEnd;

/// A new start looks for tracks within so many standard deviations of a fix, and within so many metres.
const START_SIGMAS: f64 = 6.0;
const START_M: f64 = 20.0;
/// Hypotheses from which a fix is farther away are lost.
const LOST_SIGMAS: f64 = 6.0;
const LOST_M: f64 = 100.0;
/// So many fixes in a row, and it starts anew.
const LOST_FIXES: u32 = 5;
/// Fixes that lie on a track, but are so many standard deviations off all hypotheses for so many seconds, put these
/// into doubt.
const DOUBTED_SIGMAS: f64 = 3.0;
const DOUBTED_S: f64 = 5.0;

impl Occupancy {
    /// New hypotheses where there are none, where they are lost or in doubt.
    pub(super) fn start(&mut self, judged: &Judged) {
        let fix = &judged.fix;
        self.lost_fixes = if self.is_lost(fix) {
            self.lost_fixes + 1
        } else {
            0
        };
        let is_doubted = self.is_doubted(judged);
        // Where map and fixes do not agree there is nothing to begin with.
        if !judged.is_near {
            return;
        }
        if self.hypotheses.is_empty() || self.lost_fixes >= LOST_FIXES {
            self.hypotheses = self.all_near(fix);
            self.lost_fixes = 0;
        } else if is_doubted {
            self.doubt(fix);
        } else {
            return;
        }
        self.grow();
    }

    /// Whether a fix is far from all hypotheses.
    fn is_lost(&self, fix: &Fix) -> bool {
        let sigma_m = fix.covariance_m2.trace().sqrt();
        self.hypotheses.iter().all(|hypothesis| {
            let (place, _) = hypothesis.course.at(&self.network, hypothesis.place_m());
            let spread_m = sigma_m.hypot(hypothesis.sigma_m());
            (fix.place - place).norm() > LOST_SIGMAS * spread_m + LOST_M
        })
    }

    /// Whether fixes have jumped, and for some time now lie on a track, but all hypotheses need an error of them that
    /// their covariance refutes. If they have only drifted there, it is they that are wrong.
    fn is_doubted(&mut self, judged: &Judged) -> bool {
        let covariance_m2 = &judged.fix.covariance_m2;
        let sigma_m = (0.5 * covariance_m2.trace())
            .sqrt()
            .hypot(self.settings.map_sigma_m);
        let needed_m = self.hypotheses.iter().map(|h| h.error_m().norm());
        let least_m = needed_m.fold(f64::INFINITY, f64::min);
        if !judged.is_near || least_m < DOUBTED_SIGMAS * sigma_m {
            self.doubted_since = None;
        } else if self.hypotheses.first().is_some_and(|most| most.has_jumped) {
            self.doubted_since.get_or_insert(judged.fix.time);
        }
        let since = self.doubted_since;
        let is_doubted = since.is_some_and(|since| judged.fix.time.since(since) > DOUBTED_S);
        if is_doubted {
            self.doubted_since = None;
        }
        is_doubted
    }

    /// The train may be somewhere else than all hypotheses say: the right one may have been dropped.
    fn doubt(&mut self, fix: &Fix) {
        let mut more = self.all_near(fix);
        let is_new = |h: &Hypothesis| {
            self.hypotheses
                .iter()
                .all(|old| old.towards() != h.towards())
        };
        more.retain(is_new);
        let share = self.settings.jump_probability / more.len().max(1) as f64;
        for hypothesis in &mut more {
            hypothesis.log_probability = share.ln();
        }
        self.hypotheses.append(&mut more);
    }

    /// Every track near a fix, both ways.
    fn all_near(&self, fix: &Fix) -> Vec<Hypothesis> {
        let within_m = START_M + START_SIGMAS * fix.covariance_m2.trace().sqrt();
        let near = self.network.near(&fix.place, within_m);
        let mut hypotheses = Vec::new();
        for element in near {
            let all = [0.0, self.network.elements[element].length_m()];
            let covariance = &fix.covariance_m2;
            let Some(found) =
                by_pedal_curve(&self.network.elements[element], all, &fix.place, covariance)
            else {
                continue;
            };
            for way in [Direction::Up, Direction::Down] {
                let hypothesis = self.new_hypothesis(ElementEnd { element, way }, &found);
                hypotheses.push(hypothesis);
            }
        }
        hypotheses
    }

    /// At a place of an element, with nothing known but that and the settings.
    pub(super) fn new_hypothesis(&self, towards: ElementEnd, found: &Match) -> Hypothesis {
        let mut hypothesis = Hypothesis {
            course: Course::at_place(&self.network, towards, found.along_m),
            log_probability: 0.0,
            heading_log: 0.0,
            placing: TrackPlacing::default(),
            mean: State::zeros(),
            covariance: Box::new(StateCovariance::zeros()),
            fix_variances_m2: [0.0; 2],
            kind: None,
            has_jumped: false,
            kinds: Vec::new(),
            balise_groups: Vec::new(),
        };
        match self.settings.method {
            Method::Fused => {
                let mapped_rad = hypothesis.car_heading_rad(&self.network, 0.0, &self.settings);
                let offset_rad = self.reckoning.turned_rad - mapped_rad;
                hypothesis.start_fused(&self.settings, offset_rad);
            }
            _ => hypothesis.start_matched(found),
        }
        hypothesis
    }
}
