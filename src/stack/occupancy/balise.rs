//! What balises say of the hypotheses: the train is on their track, and where on it.
//!
//! A group of balises may be one of another track than the train's: by cross-talk, or because the map has the group on a
//! wrong track. Both are so of a whole group, not of each of its balises, and as a rule of a track abreast. So for each
//! hypothesis the probabilities are carried from balise to balise that a group is the train's own, of a track abreast, or
//! from anywhere: each times the likelihood that it gives a reading, over their sum, which is the likelihood of the reading.
//! One group therefore says no more against a track than the probability of a foreign one, however many balises it has.

use super::Occupancy;
use super::balise_group::{BaliseGroup, FOREIGN, GroupOf};
use super::hypothesis::{Hypothesis, PLACE};
use super::matching::{Match, by_perpendicular};
use super::settings::OccupancySettings;
use crate::bus::SimTime;
use crate::track::Direction;
use crate::track::plan::{ElementEnd, ElementPlace, PlanNetwork};
use nalgebra::{Matrix2, Point2};
use std::f64::consts::TAU;

/// A track abreast is no farther away, metres.
const ABREAST_M: f64 = 20.0;
/// A balise from anywhere lies within so many metres before and behind the place of a hypothesis.
const ANYWHERE_M: f64 = 200.0;
/// A group that is farther away than this is behind the train: the next time it counts as any other, metres.
const BEHIND_M: f64 = 100.0;

impl Occupancy {
    /// Takes in that the head passed over a balise at this place.
    pub fn on_balise(&mut self, time: SimTime, place: ElementPlace) {
        if place.element >= self.network.elements.len() || !self.run_to(time) {
            return;
        }
        self.advance();
        if self.hypotheses.is_empty() {
            self.start_at_balise(place);
        } else {
            let is_expected = (self.hypotheses.iter()).any(|h| h.runs_over(place, &self.settings));
            if !is_expected {
                // The right one may have been dropped, with no more than that probability.
                let least_log = self.settings.least_probability.ln();
                self.add_at(place, least_log);
            }
            self.update_by_balise(place);
        }
        self.tidy();
    }

    /// On its track, or on one beside it if the balise is foreign, whichever way.
    fn start_at_balise(&mut self, balise: ElementPlace) {
        self.add_at(balise, 0.0);
        let (place, _) = self.network.elements[balise.element].at(balise.along_m);
        for element in self.network.near(&place, ABREAST_M) {
            let all = [0.0, self.network.elements[element].length_m()];
            let exact = Matrix2::identity();
            let found = by_perpendicular(&self.network.elements[element], all, &place, &exact);
            if let Some(Match { along_m, .. }) = found.filter(|_| element != balise.element) {
                self.add_at(ElementPlace { element, along_m }, FOREIGN.ln());
            }
        }
        let foreign = GroupOf {
            own: FOREIGN,
            abreast: 1.0,
            anywhere: 0.0,
        };
        for hypothesis in &mut self.hypotheses {
            if hypothesis.towards().element != balise.element {
                hypothesis.balise_groups.push(BaliseGroup {
                    element: balise.element,
                    place,
                    of: foreign,
                });
            }
        }
    }

    fn update_by_balise(&mut self, place: ElementPlace) {
        let (network, settings) = (&self.network, &self.settings);
        let mut of_most = (f64::NEG_INFINITY, false);
        for hypothesis in &mut self.hypotheses {
            let is_placed = hypothesis.update_balise(network, place, settings);
            if hypothesis.log_probability > of_most.0 {
                of_most = (hypothesis.log_probability, is_placed);
            }
        }
        if of_most.1 {
            self.reckoning.known_to(settings.balise_sigma_m);
        }
    }

    /// Hypotheses with the head at a place, both ways.
    fn add_at(&mut self, place: ElementPlace, log_probability: f64) {
        let ElementPlace { element, along_m } = place;
        let found = Match {
            along_m,
            away_m: 0.0,
            sigma_m: self.settings.balise_sigma_m,
        };
        for way in [Direction::Up, Direction::Down] {
            let mut hypothesis = self.new_hypothesis(ElementEnd { element, way }, &found);
            hypothesis.mean[PLACE] -= self.settings.antenna_behind_head_m;
            hypothesis.covariance[(PLACE, PLACE)] = self.settings.balise_sigma_m.powi(2);
            hypothesis.log_probability = log_probability;
            self.hypotheses.push(hypothesis);
        }
    }
}

impl Hypothesis {
    /// How far the train has to run until its head is at a place, below 0 if it is beyond; none where its course does
    /// not lead there.
    fn left_m(&self, to: ElementPlace, settings: &OccupancySettings) -> Option<f64> {
        let legs = self.course.legs().iter();
        legs.filter(|leg| leg.towards.element == to.element)
            .map(|leg| leg.course_m(to.along_m) - settings.antenna_behind_head_m - self.place_m())
            .min_by(|a, b| a.abs().total_cmp(&b.abs()))
    }

    /// Whether its course leads over a place that is no farther from the head than a foreign balise may be.
    fn runs_over(&self, place: ElementPlace, settings: &OccupancySettings) -> bool {
        self.left_m(place, settings)
            .is_some_and(|left_m| left_m.abs() < ANYWHERE_M)
    }

    /// How far the train has to run until its head is abreast of a place; none where that is too far aside.
    fn left_abreast_m(
        &self,
        network: &PlanNetwork,
        mapped: &Point2<f64>,
        settings: &OccupancySettings,
    ) -> Option<f64> {
        let head_m = self.place_m() + settings.antenna_behind_head_m;
        let (head, forward) = self.course.at(network, head_m);
        let away = mapped - head;
        (forward.perp(&away).abs() < ABREAST_M).then(|| forward.dot(&away))
    }

    /// Takes a balise in; whether that tells the place.
    fn update_balise(
        &mut self,
        network: &PlanNetwork,
        balise: ElementPlace,
        settings: &OccupancySettings,
    ) -> bool {
        let element = balise.element;
        let (mapped, _) = network.elements[element].at(balise.along_m);
        let own_m = self.left_m(balise, settings);
        let abreast_m = self.left_abreast_m(network, &mapped, settings);
        let variance_m2 = self.covariance[(PLACE, PLACE)] + settings.balise_sigma_m.powi(2);
        let density = |left_m: Option<f64>| {
            left_m.map_or(0.0, |left_m| {
                (-0.5 * left_m.powi(2) / variance_m2).exp() / (TAU * variance_m2).sqrt()
            })
        };
        let density = GroupOf {
            own: density(own_m),
            abreast: density(abreast_m),
            anywhere: 0.5 / ANYWHERE_M,
        };
        let (of, sum) = self.take_group(element, &mapped).after(&density);
        self.log_probability += sum.ln();
        self.balise_groups.push(BaliseGroup {
            element,
            place: mapped,
            of,
        });
        let left_m = if of.own > of.abreast {
            own_m
        } else {
            abreast_m
        };
        let left_m = left_m.filter(|_| of.own.max(of.abreast) > of.anywhere);
        if let Some(left_m) = left_m {
            let across = self.covariance.column(PLACE).into_owned();
            self.correct_by(&across, left_m, variance_m2);
        }
        left_m.is_some()
    }

    /// What is known of the group of a balise, which is then no longer kept; nor are those that are behind.
    fn take_group(&mut self, element: usize, mapped: &Point2<f64>) -> GroupOf {
        self.balise_groups
            .retain(|group| (group.place - mapped).norm() < BEHIND_M);
        let mut groups = self.balise_groups.iter();
        let known = groups.position(|group| group.has(element, mapped));
        known.map_or(GroupOf::UNREAD, |k| self.balise_groups.swap_remove(k).of)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests;
