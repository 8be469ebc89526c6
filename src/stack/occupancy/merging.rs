//! Two hypotheses that say the same of all that is to come are one.

use super::balise_group::BaliseGroup;
use super::hypothesis::{
    ASIDE, HEADING, Hypothesis, KindError, NEAR_M, PLACE, State, left_of, log_sum,
};
use super::settings::OccupancySettings;
use crate::track::plan::PlanNetwork;

/// Hypotheses whose places are farther apart stay two.
const MERGED_SIGMAS: f64 = 3.0;
/// Headings that are farther apart are not those of one run, radians.
const MERGED_RAD: f64 = 0.5;

impl Hypothesis {
    /// Takes in another one that says the same of all that is to come; whether it does.
    pub fn merge(
        &mut self,
        other: &Self,
        network: &PlanNetwork,
        settings: &OccupancySettings,
    ) -> bool {
        let [leg, of_other] = [&*self, other].map(|h| *h.course.leg_at(h.place_m()));
        if leg.towards != of_other.towards {
            return false;
        }
        let by_m = of_other.begin_m - leg.begin_m;
        let apart = self.apart(other, by_m, network);
        let spread_m = self.sigma_m().hypot(other.sigma_m()).max(NEAR_M);
        let is_near =
            apart[PLACE].abs() < MERGED_SIGMAS * spread_m && apart[HEADING].abs() < MERGED_RAD;
        if !is_near {
            return false;
        }
        let is_same_course = self.course.is_shifted(&other.course, by_m);
        if !is_same_course && !self.goes_on_as(other, by_m, settings) {
            return false;
        }
        self.mix(other, &apart);
        if !is_same_course {
            // They came by different ways: where it would go back to is open.
            self.course.trim([leg.begin_m + NEAR_M, f64::INFINITY]);
        }
        true
    }

    /// What the state of another one, whose course counts so much farther, has more than its own. How far the track lies
    /// aside counts from where its own track is taken to lie.
    fn apart(&self, other: &Self, by_m: f64, network: &PlanNetwork) -> State {
        let mut apart = other.mean - self.mean;
        apart[PLACE] -= by_m;
        let (_, forward) = self.course.at(network, self.place_m());
        let shift_m = other.placing.shift_m() - self.placing.shift_m();
        apart[ASIDE] += left_of(&forward).dot(&shift_m);
        apart
    }

    /// Whether both have left all that their courses have not in common.
    fn goes_on_as(&self, other: &Self, by_m: f64, settings: &OccupancySettings) -> bool {
        let have_left = [self, other]
            .iter()
            .all(|h| h.needed_m(settings)[0] > h.course.leg_at(h.place_m()).begin_m);
        let [own, others] = [self, other].map(|h| h.course.from(h.place_m()));
        have_left && own.is_shifted(&others, by_m)
    }

    /// Mean and covariance of the mixture. What only one of them knows of kinds of fixes and groups of balises, both know;
    /// of what both know it is that of the first, the more probable one.
    fn mix(&mut self, other: &Self, apart: &State) {
        let [own, others] = [self.log_probability, other.log_probability];
        let sum = log_sum(own, others);
        let (own, others) = ((own - sum).exp(), (others - sum).exp());
        self.log_probability = sum;
        self.mean += apart * others;
        *self.covariance = *self.covariance * own
            + *other.covariance * others
            + apart * apart.transpose() * (own * others);
        let is_known = |new: &&KindError| self.kinds.iter().any(|known| known.kind == new.kind);
        let new: Vec<_> = (other.kinds.iter().filter(|of| !is_known(of)).cloned()).collect();
        self.kinds.extend(new);
        let is_known = |new: &&BaliseGroup| {
            (self.balise_groups.iter()).any(|known| known.has(new.element, &new.place))
        };
        let new: Vec<_> = (other
            .balise_groups
            .iter()
            .filter(|of| !is_known(of))
            .copied())
        .collect();
        self.balise_groups.extend(new);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::bus::SimTime;
    use crate::stack::occupancy::balise_group::GroupOf;
    use crate::stack::occupancy::placing::{BesideReference, TrackPlacing};
    use crate::stack::occupancy::{Fix, Occupancy, OccupancySettings};
    use crate::track::plan::TrackElement;
    use nalgebra::{Matrix2, Matrix4, Point2, Vector2, Vector4};

    /// Fails where merging moves a track in the world because one hypothesis has it as mapped and the other one at a mean
    /// distance from another track, or forgets what only one of both knows of a kind of fixes or a group of balises.
    #[test]
    fn both_know_what_one_knew() {
        let points = [0.0, 1000.0].map(|x| Point2::new(x, 0.0));
        let track = TrackElement::new("track", points.into()).unwrap();
        let network = PlanNetwork::new(None, vec![track], &[]);
        let settings = OccupancySettings::default();
        let mut occupancy = Occupancy::new(network.clone().into(), settings);
        occupancy.on_speed(SimTime::ZERO, 10.0);
        occupancy.on_fix(&Fix {
            time: SimTime::ZERO,
            place: Point2::new(500.0, 0.0),
            covariance_m2: Matrix2::identity(),
        });
        let mut mapped = occupancy.hypotheses[0].clone();
        let mut beside = mapped.clone();
        beside.placing = TrackPlacing::Beside(BesideReference {
            mean_m: 4.2,
            shift_m: Vector2::new(0.0, 0.3),
        });
        beside.mean[ASIDE] = mapped.mean[ASIDE] - left_of(&Vector2::x()).y * 0.3;
        beside.kinds = vec![KindError {
            kind: 7,
            time: SimTime::ZERO,
            error_m: Vector4::zeros(),
            covariance_m2: Matrix4::identity(),
        }];
        beside.balise_groups = vec![BaliseGroup {
            element: 0,
            place: Point2::new(490.0, 0.0),
            of: GroupOf::UNREAD,
        }];
        let before = mapped.clone();
        assert!(mapped.merge(&beside, &network, &settings));
        assert!((mapped.mean - before.mean).norm() < 1e-12);
        assert!((*mapped.covariance - *before.covariance).norm() < 1e-9 * before.covariance.norm());
        let same_log = before.log_probability + 2f64.ln();
        assert!((mapped.log_probability - same_log).abs() < 1e-12);
        assert_eq!(mapped.kinds.len(), before.kinds.len() + 1);
        assert_eq!(mapped.balise_groups.len(), 1);
        assert!(mapped.merge(&beside, &network, &settings));
        assert_eq!(mapped.balise_groups.len(), 1);
        assert_eq!(mapped.kinds.len(), before.kinds.len() + 1);
    }
}
