//! What balises say of the hypotheses: the train is on their track, and where on it.
//!
//! A group of balises may be one of another track than the train's: by cross-talk, or because the map has the group on a
//! wrong track. Both are so of a whole group, not of each of its balises, and mostly of a track abreast. So for each
//! hypothesis the probability w that a group is foreign is carried from balise to balise: with L the likelihood of a
//! reading if the group is the train's own, and F if it is foreign, a reading has the likelihood (1 - w) L + w F, and
//! then w becomes w F over that. One group therefore says no more against a track than the probability of a foreign one,
//! however many balises it has.

use super::Occupancy;
use super::hypothesis::{Hypothesis, PLACE};
use super::matching::{Match, by_perpendicular};
use super::settings::OccupancySettings;
use crate::bus::SimTime;
use crate::track::Direction;
use crate::track::plan::{ElementEnd, PlanNetwork};
use nalgebra::{Matrix2, Point2};
use std::f64::consts::TAU;

/// Probability that a group of balises is not of the train's track: cross-talk (a balise 1.4 m beside the antenna must not
/// be read, SUBSET-036), or a map with the group on a wrong track.
const FOREIGN: f64 = 1e-6;
/// Half of the foreign balises lie abreast: so many metres away at most.
const ABREAST_M: f64 = 20.0;
/// The other half lies anywhere within so many metres before and behind the place of a hypothesis.
const FOREIGN_SPAN_M: f64 = 200.0;
/// Balises of a group are no farther from one to the next, metres: 12 m (SUBSET-040) and what a map may be off.
const GROUP_M: f64 = 15.0;

/// A group of balises that may be foreign.
#[derive(Clone, Copy, Debug)]
pub struct DoubtedGroup {
    /// Of its last balise that was read, on the map.
    place: Point2<f64>,
    /// Probability that it is foreign, if the hypothesis is right.
    foreign: f64,
}

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
                self.reckoning.known_to(self.settings.balise_sigma_m);
            } else {
                // The right one may have been dropped, with no more than that probability.
                let least_log = self.settings.least_probability.ln();
                self.add_at(time, place, least_log);
            }
            let (network, settings) = (&self.network, &self.settings);
            for hypothesis in &mut self.hypotheses {
                hypothesis.update_balise(network, place, settings);
            }
        }
        self.tidy();
    }

    /// On its track, or on one beside it if the balise is foreign, whichever way.
    fn start_at_balise(&mut self, time: SimTime, (element, along_m): (usize, f64)) {
        self.add_at(time, (element, along_m), 0.0);
        let (place, _) = self.network.elements[element].at(along_m);
        for other in self.network.near(&place, ABREAST_M) {
            let all = [0.0, self.network.elements[other].length_m()];
            let exact = Matrix2::identity();
            let found = by_perpendicular(&self.network.elements[other], all, &place, &exact);
            if let Some(found) = found.filter(|_| other != element) {
                self.add_at(time, (other, found.along_m), FOREIGN.ln());
            }
        }
        for hypothesis in &mut self.hypotheses {
            if hypothesis.towards().element != element {
                let foreign = 1.0;
                hypothesis
                    .doubted_groups
                    .push(DoubtedGroup { place, foreign });
            }
        }
    }

    /// Hypotheses with the head at a place, both ways.
    fn add_at(&mut self, time: SimTime, (element, along_m): (usize, f64), log_probability: f64) {
        let found = Match {
            along_m,
            away_m: 0.0,
            sigma_m: self.settings.balise_sigma_m,
        };
        for way in [Direction::Up, Direction::Down] {
            let mut hypothesis = self.new_hypothesis(ElementEnd { element, way }, &found, time);
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

    /// Whether its course leads over a place that is no farther from the head than a foreign balise may be.
    fn runs_over(&self, place: (usize, f64), settings: &OccupancySettings) -> bool {
        self.left_m(place, settings)
            .is_some_and(|left_m| left_m.abs() < FOREIGN_SPAN_M)
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

    fn update_balise(
        &mut self,
        network: &PlanNetwork,
        place: (usize, f64),
        settings: &OccupancySettings,
    ) {
        let (mapped, _) = network.elements[place.0].at(place.1);
        let off_m = self.left_m(place, settings);
        let variance_m2 = self.covariance[(PLACE, PLACE)] + settings.balise_sigma_m.powi(2);
        let density = |off_m: Option<f64>| {
            off_m.map_or(0.0, |off_m| {
                (-0.5 * off_m.powi(2) / variance_m2).exp() / (TAU * variance_m2).sqrt()
            })
        };
        let abreast = density(self.left_abreast_m(network, &mapped, settings));
        let if_foreign = 0.5 * abreast + 0.25 / FOREIGN_SPAN_M;
        let before = self.take_doubted(&mapped).map_or(FOREIGN, |of| of.foreign);
        let [own, other] = [(1.0 - before) * density(off_m), before * if_foreign];
        let foreign = other / (own + other);
        self.log_probability += (own + other).ln();
        // Others are as doubtful as any new one.
        if foreign > FOREIGN {
            let group = DoubtedGroup {
                place: mapped,
                foreign,
            };
            self.doubted_groups.push(group);
        }
        if let Some(off_m) = off_m.filter(|_| own > other) {
            let across = self.covariance.column(PLACE).into_owned();
            self.correct_by(&across, off_m, variance_m2);
        }
    }

    /// What is known of the group of a balise, which is then no longer kept.
    fn take_doubted(&mut self, mapped: &Point2<f64>) -> Option<DoubtedGroup> {
        let mut groups = self.doubted_groups.iter();
        let known = groups.position(|group| (group.place - mapped).norm() < GROUP_M)?;
        Some(self.doubted_groups.swap_remove(known))
    }
}
