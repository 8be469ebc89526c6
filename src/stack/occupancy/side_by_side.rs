//! What a map may have wrong of the distance of tracks that it has side by side.
//!
//! Under each hypothesis the fixes show how its own track is off the map. Two tracks that really lie side by side are each
//! off by an error of its own, so that over kilometres the fixes follow one mapped track better than the other one by
//! chance, and which of them says nothing: whatever that chance is, either track may be the train's. So where the map has
//! the track of a hypothesis beside that of the most probable one, to within what headings may be off, changes of their
//! distance that a map may have wrong are left out: the track is taken to lie at its mean distance from the other one, with
//! that one's heading. What is left is that distance itself, which is what tells the tracks. Where the map has them part, or
//! nearer to each other than tracks can be, as legs behind a switch are, they are as mapped.

use super::headings;
use super::hypothesis::{ASIDE, Hypothesis, left_of, most_probable};
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

/// Where the track of a hypothesis is taken to lie.
#[derive(Clone, Copy, Debug, Default)]
pub enum TrackPlacing {
    #[default]
    AsMapped,
    /// As mapped: distances count from it.
    Reference,
    Beside(BesideReference),
}

/// At the mean distance from the reference.
#[derive(Clone, Copy, Debug)]
pub struct BesideReference {
    /// To the left of the reference, the mean over the last run, metres.
    mean_m: f64,
    /// From the mapped place to there.
    shift_m: Vector2<f64>,
}

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

    /// Without moving its track in the world.
    fn set_placing(&mut self, placing: TrackPlacing, forward: &Vector2<f64>) {
        let before_m = self.shift_m();
        self.placing = placing;
        self.mean[ASIDE] -= left_of(forward).dot(&(self.shift_m() - before_m));
    }

    /// From its mapped place to where its track is taken to be.
    pub fn shift_m(&self) -> Vector2<f64> {
        match self.placing {
            TrackPlacing::Beside(beside) => beside.shift_m,
            TrackPlacing::AsMapped | TrackPlacing::Reference => Vector2::zeros(),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use crate::bus::SimTime;
    use crate::stack::occupancy::{Decision, Fix, Occupancy, OccupancySettings};
    use crate::track::plan::{PlanNetwork, TrackElement};
    use nalgebra::{Matrix2, Point2};

    /// A run of 3 km at 20 m/s, with fixes so far to the left of x, on a map of two tracks with these places.
    fn run(tracks_m: [fn(f64) -> f64; 2], beside_m: impl Fn(f64) -> f64) -> Decision {
        let tracks = tracks_m.map(|y| {
            let points =
                (0..=150).map(|k| Point2::new(20.0 * f64::from(k), y(20.0 * f64::from(k))));
            TrackElement::new("track", points.collect())
        });
        let network = PlanNetwork::new(None, tracks.into_iter().flatten().collect(), &[]);
        let mut occupancy = Occupancy::new(network.into(), OccupancySettings::default());
        for k in 1..740 {
            let (time, x_m) = (SimTime::from_secs(0.2 * f64::from(k)), 4.0 * f64::from(k));
            occupancy.on_speed(time, 20.0);
            occupancy.on_fix(&Fix {
                time,
                place: Point2::new(x_m, beside_m(x_m)),
                covariance_m2: Matrix2::identity(),
            });
        }
        occupancy.decision()
    }

    /// By 0.4 m to both sides, once in 240 m.
    fn wavy_m(x_m: f64) -> f64 {
        0.4 * (x_m * std::f64::consts::TAU / 240.0).sin()
    }

    /// Fails where of two tracks, with fixes in the middle between them, the one that is mapped straight is taken for the
    /// train's, or the one that is mapped with the waves that the fixes happen to have.
    #[test]
    fn what_a_map_has_wrong_of_a_distance_tells_no_track() {
        for fixes in [
            |_| 2.0,
            |x_m| 2.0 + 0.5 * wavy_m(x_m),
            |x_m| 2.0 + wavy_m(x_m),
        ] {
            let decision = run([|_| 0.0, |x_m| 4.0 + wavy_m(x_m)], fixes);
            let least = decision
                .tracks
                .iter()
                .map(|t| t.probability)
                .fold(1.0, f64::min);
            assert!(decision.tracks.len() == 2 && least > 0.1, "{decision:?}");
        }
    }

    /// Fails where tracks that part slowly are held for parallel ones: from 4 to 16 m over 3 km, less than a map may have
    /// wrong of headings.
    #[test]
    fn tracks_that_part_slowly_are_told() {
        for (track, share) in [(0, 0.0), (1, 1.0)] {
            let decision = run([|_| 0.0, |x_m| 4.0 + 0.004 * x_m], |x_m| {
                share * (4.0 + 0.004 * x_m)
            });
            assert!(
                decision.is_identified() && decision.tracks[0].element == track,
                "{decision:?}"
            );
        }
    }
}
