//! What a balise says of the hypotheses: the train is on its track, and where on it.

use super::Occupancy;
use super::hypothesis::{Hypothesis, PLACE};
use super::matching::{Match, by_perpendicular};
use super::settings::OccupancySettings;
use crate::bus::SimTime;
use crate::track::Direction;
use crate::track::plan::ElementEnd;
use nalgebra::Matrix2;
use std::f64::consts::TAU;

/// Of the place where a balise is read, metres: the antenna's lobe and the delay of the report (SUBSET-036, which
/// asks for 1 m with all that adds to it).
const SIGMA_M: f64 = 0.3;
/// Probability that a balise is read which is not on the train's track: cross-talk (a balise 1.4 m beside the antenna
/// must not be read), or a map with the balise on the wrong track.
const FOREIGN: f64 = 1e-6;
/// Within so many metres before and behind the place of a hypothesis a foreign balise is as probable anywhere.
const FOREIGN_SPAN_M: f64 = 200.0;
/// Within so many metres of a balise a track may be the train's that is read by cross-talk.
const FOREIGN_REACH_M: f64 = 20.0;

impl Occupancy {
    /// Takes in that the head passed over a balise at this place of an element.
    pub fn on_balise(&mut self, time: SimTime, (element, along_m): (usize, f64)) {
        if element >= self.network.elements.len() || !self.run_to(time) {
            return;
        }
        self.advance();
        let place = (element, along_m);
        if self.hypotheses.is_empty() {
            self.start_at_balise(time, place);
        } else {
            let is_expected = (self.hypotheses.iter()).any(|h| h.runs_over(place, &self.settings));
            if is_expected {
                self.unknown_m = self.unknown_m.min(SIGMA_M);
            } else {
                // The right one may have been dropped, with no more than that probability.
                let least_log = self.settings.least_probability.ln();
                self.add_at(time, place, least_log);
            }
            for hypothesis in &mut self.hypotheses {
                hypothesis.update_balise(place, &self.settings);
            }
        }
        self.tidy();
    }

    /// On its track, or by cross-talk on one beside it, whichever way.
    fn start_at_balise(&mut self, time: SimTime, (element, along_m): (usize, f64)) {
        self.add_at(time, (element, along_m), 0.0);
        let (place, _) = self.network.elements[element].at(along_m);
        for other in self.network.near(&place, FOREIGN_REACH_M) {
            let all = [0.0, self.network.elements[other].length_m()];
            let exact = Matrix2::identity();
            let found = by_perpendicular(&self.network.elements[other], all, &place, &exact);
            if let Some(found) = found.filter(|_| other != element) {
                self.add_at(time, (other, found.along_m), FOREIGN.ln());
            }
        }
    }

    /// Hypotheses with the head at a place, both ways.
    fn add_at(&mut self, time: SimTime, (element, along_m): (usize, f64), log_probability: f64) {
        let found = Match {
            along_m,
            away_m: 0.0,
            sigma_m: SIGMA_M,
        };
        for way in [Direction::Up, Direction::Down] {
            let mut hypothesis = self.new_hypothesis(ElementEnd { element, way }, &found, time);
            hypothesis.mean[PLACE] -= self.settings.antenna_behind_head_m;
            hypothesis.covariance[(PLACE, PLACE)] = SIGMA_M.powi(2);
            hypothesis.log_probability = log_probability;
            self.hypotheses.push(hypothesis);
        }
    }
}

impl Hypothesis {
    /// How far the train has to run until its head is at a place, below 0 if it is beyond; none where its course does
    /// not lead there.
    fn left_m(
        &self,
        (element, along_m): (usize, f64),
        settings: &OccupancySettings,
    ) -> Option<f64> {
        let legs = self.course.legs().iter();
        legs.filter(|leg| leg.towards.element == element)
            .map(|leg| leg.course_m(along_m) - settings.antenna_behind_head_m - self.place_m())
            .min_by(|a, b| a.abs().total_cmp(&b.abs()))
    }

    /// Whether the head may be at a place.
    fn runs_over(&self, place: (usize, f64), settings: &OccupancySettings) -> bool {
        self.left_m(place, settings)
            .is_some_and(|left_m| left_m.abs() < FOREIGN_SPAN_M)
    }

    fn update_balise(&mut self, place: (usize, f64), settings: &OccupancySettings) {
        let foreign_log = (FOREIGN / FOREIGN_SPAN_M).ln();
        let off_m = self.left_m(place, settings);
        let variance_m2 = self.covariance[(PLACE, PLACE)] + SIGMA_M.powi(2);
        let fits_log = off_m.map_or(f64::NEG_INFINITY, |off_m| {
            -0.5 * (off_m.powi(2) / variance_m2 + (TAU * variance_m2).ln())
        });
        self.log_probability += fits_log.max(foreign_log);
        let Some(off_m) = off_m.filter(|_| fits_log > foreign_log) else {
            return;
        };
        let across = self.covariance.column(PLACE).into_owned();
        self.correct_by(&across, off_m, variance_m2);
    }
}
