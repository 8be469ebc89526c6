//! What a map may have wrong of the distance of tracks that it has side by side.
//!
//! Under each hypothesis the fixes show how its own track is off the map. Two tracks that really lie side by side are each
//! off by an error of its own, so that over kilometres the fixes follow one mapped track better than the other one by
//! chance, and which of them says nothing: whatever that chance is, either track may be the train's. So where the map has
//! the track of a hypothesis beside that of the most probable one, to within what headings may be off, changes of their
//! distance that a map may have wrong are left out: the track is taken to lie at its mean distance from the other one, with
//! that one's heading. What is left is that distance itself, which is what tells the tracks. Where the map has them part, or
//! nearer to each other than tracks can be, as legs behind a switch are, they are as mapped.

use super::fused::MappedHeading;
use super::headings;
use super::hypothesis::{ASIDE, Hypothesis, left_of, most_probable};
use super::placing::{BesideReference, TrackPlacing};
use super::settings::OccupancySettings;
use crate::track::plan::PlanNetwork;
use nalgebra::{Point2, Vector2};
use std::f64::consts::SQRT_2;

/// The mean distance is that over so long a run, metres: many correlation lengths of the map's errors.
const MEAN_M: f64 = 400.0;
/// Headings of tracks that lie side by side differ by no more than this share of what makes two headings: a map of straight
/// lines between points turns less than is believed of it.
const SAME_HEADING: f64 = 0.5;
/// Distances that differ from the mean by more standard deviations of their difference have really changed; tracks that
/// are nearer to each other are legs of a switch.
const CHANGED_SIGMAS: f64 = 3.0;

/// The mapped place of the reference.
struct MappedReference {
    place: Point2<f64>,
    forward: Vector2<f64>,
}

/// Puts the tracks of hypotheses at their mean distances from that of the most probable one, after a run since the last
/// time.
pub fn compare_distances(
    hypotheses: &mut [Hypothesis],
    network: &PlanNetwork,
    run_m: f64,
    settings: &OccupancySettings,
) {
    let Some(most) = most_probable(hypotheses) else {
        return;
    };
    refer_to(hypotheses, most, network);
    let (place, forward) = hypotheses[most]
        .course
        .at(network, hypotheses[most].place_m());
    let mapped = MappedReference { place, forward };
    for (_, hypothesis) in (hypotheses.iter_mut().enumerate()).filter(|(k, _)| *k != most) {
        hypothesis.keep_distance(&mapped, network, run_m, settings);
    }
}

/// Lets distances count from the hypothesis that is now the most probable one. No track moves in the world by that.
fn refer_to(hypotheses: &mut [Hypothesis], most: usize, network: &PlanNetwork) {
    let of_most = match hypotheses[most].placing {
        TrackPlacing::Reference => return,
        TrackPlacing::Beside(beside) => Some(beside),
        TrackPlacing::AsMapped => None,
    };
    for (k, hypothesis) in hypotheses.iter_mut().enumerate() {
        let after = match (hypothesis.placing, of_most) {
            _ if k == most => TrackPlacing::Reference,
            (TrackPlacing::Reference, Some(most)) => TrackPlacing::Beside(BesideReference {
                mean_m: -most.mean_m,
                shift_m: -most.shift_m,
            }),
            (TrackPlacing::Beside(beside), Some(most)) => TrackPlacing::Beside(BesideReference {
                mean_m: beside.mean_m - most.mean_m,
                shift_m: beside.shift_m - most.shift_m,
            }),
            _ => TrackPlacing::AsMapped,
        };
        let (_, forward) = hypothesis.course.at(network, hypothesis.place_m());
        hypothesis.set_placing(after, &forward);
    }
}

impl Hypothesis {
    fn keep_distance(
        &mut self,
        reference: &MappedReference,
        network: &PlanNetwork,
        run_m: f64,
        settings: &OccupancySettings,
    ) {
        let (place, forward) = self.course.at(network, self.place_m());
        let left = left_of(&reference.forward);
        let distance_m = left.dot(&(place - reference.place));
        let turned_rad = left.dot(&forward).atan2(reference.forward.dot(&forward));
        let change_m = CHANGED_SIGMAS * SQRT_2 * settings.map_sigma_m;
        let most_turned_rad = SAME_HEADING * headings::parted_rad(settings);
        if distance_m.abs() < change_m || turned_rad.abs() > most_turned_rad {
            self.set_placing(TrackPlacing::AsMapped, &forward);
            return;
        }
        let before_m = match self.placing {
            TrackPlacing::Beside(beside) => beside.mean_m,
            TrackPlacing::AsMapped | TrackPlacing::Reference => distance_m,
        };
        let keep = (-run_m / MEAN_M).exp();
        let mean_m = (keep * before_m + (1.0 - keep) * distance_m)
            .clamp(distance_m - change_m, distance_m + change_m);
        self.placing = TrackPlacing::Beside(BesideReference {
            mean_m,
            shift_m: left * (mean_m - distance_m),
        });
    }

    /// The car's heading on its track, which is that of the reference abreast of its place if it is taken to lie beside it.
    pub fn heading_beside(
        &self,
        reference: &Self,
        network: &PlanNetwork,
        settings: &OccupancySettings,
    ) -> MappedHeading {
        if !matches!(self.placing, TrackPlacing::Beside(_)) {
            return self.mapped_heading(network, self.place_m(), settings);
        }
        let (place, _) = self.course.at(network, self.place_m());
        let (of_reference, forward) = reference.course.at(network, reference.place_m());
        let abreast_m = reference.place_m() + forward.dot(&(place - of_reference));
        reference.mapped_heading(network, abreast_m, settings)
    }

    /// Without moving its track in the world.
    fn set_placing(&mut self, placing: TrackPlacing, forward: &Vector2<f64>) {
        let before_m = self.placing.shift_m();
        self.placing = placing;
        self.mean[ASIDE] -= left_of(forward).dot(&(self.placing.shift_m() - before_m));
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests;
