//! Track occupancy of a run: of all its trains that report it, from their counts together.

use crate::session::{LegDistances, OccupancyClass, OccupancyFigures, TrainSummary};

/// The figures of those trains, at least one.
pub struct OccupancyOfTrains<'a>(Vec<&'a OccupancyFigures>);

impl<'a> OccupancyOfTrains<'a> {
    /// Of a run, by what its summary has of the first train and, where there are several, of all; `None` where no
    /// train reports it.
    pub fn of(first: Option<&'a OccupancyFigures>, all: &'a [TrainSummary]) -> Option<Self> {
        let only = first.filter(|_| all.is_empty());
        let listed = all.iter().filter_map(|train| train.occupancy.as_ref());
        let trains: Vec<_> = only.into_iter().chain(listed).collect();
        (!trains.is_empty()).then_some(Self(trains))
    }

    /// A count, over all of them.
    pub fn sum(&self, count: impl Fn(&OccupancyFigures) -> u32) -> u32 {
        self.0.iter().map(|figures| count(figures)).sum()
    }

    /// Fixes of some classes.
    pub fn fixes_of(&self, counts: impl Fn(OccupancyClass) -> bool) -> u32 {
        self.sum(|figures| fixes_of(figures, &counts))
    }

    /// Share of fixes of some classes, of all fixes, those included after which nothing was said; `None` of no fixes.
    pub fn share(&self, counts: impl Fn(OccupancyClass) -> bool) -> Option<f64> {
        let fixes = self.sum(|figures| figures.fixes_in_all);
        (fixes > 0).then(|| f64::from(self.fixes_of(counts)) / f64::from(fixes))
    }

    /// From the toe to the head when the leg was identified for good, metres, of every leg; `None` of one that never
    /// was.
    pub fn legs_m(&self) -> Vec<Option<f64>> {
        let legs = self
            .0
            .iter()
            .flat_map(|figures| &figures.legs_identified_after_m);
        legs.copied().collect()
    }

    /// Mean of the legs that were identified.
    pub fn identified_mean_m(&self) -> Option<f64> {
        LegDistances::of(&self.legs_m())?.mean
    }

    /// The longest of all legs; `None` where one was never identified, or there is none.
    pub fn identified_max_m(&self) -> Option<f64> {
        LegDistances::of(&self.legs_m())?.max
    }

    /// Largest error along the track, of fixes whose track is right, metres.
    pub fn error_max_m(&self) -> Option<f64> {
        let most = self
            .0
            .iter()
            .filter_map(|figures| Some(figures.error_m?.max));
        most.reduce(f64::max)
    }

    /// Mean of (error / sigma)^2 of fixes whose track is right.
    pub fn nees_mean(&self) -> Option<f64> {
        let right = |figures: &OccupancyFigures| fixes_of(figures, OccupancyClass::is_right);
        let sums = self
            .0
            .iter()
            .filter_map(|figures| Some(figures.nees_mean? * f64::from(right(figures))));
        let fixes = self.sum(right);
        (fixes > 0).then(|| sums.sum::<f64>() / f64::from(fixes))
    }
}

fn fixes_of(figures: &OccupancyFigures, counts: impl Fn(OccupancyClass) -> bool) -> u32 {
    let of = figures.classes.iter().filter(|(class, _)| counts(**class));
    of.map(|(_, count)| count).sum()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::session::{ErrorStatistics, FacingFigures};
    use OccupancyClass::{CorrectConfident, NothingSaid, WrongConfident};

    /// Of two wrong fixes there is one after which nothing is said.
    fn figures(wrong: u32, right: u32, legs: &[Option<f64>], nees: f64) -> OccupancyFigures {
        OccupancyFigures {
            fixes: wrong + right,
            fixes_in_all: wrong + right + wrong / 2,
            switches: legs.len() as u32,
            never_identified: legs.iter().filter(|leg| leg.is_none()).count() as u32,
            identified_after_m: None,
            legs_identified_after_m: legs.to_vec(),
            classes: [
                (WrongConfident, wrong),
                (NothingSaid, wrong / 2),
                (CorrectConfident, right),
            ]
            .into(),
            error_m: ErrorStatistics::of(&mut [0.1 * nees]),
            nees_mean: Some(nees),
            facing: FacingFigures::default(),
        }
    }

    /// Fails where only the first train counts, or a short run as much as a long one, or fixes after which nothing is said
    /// are in no denominator.
    #[test]
    fn trains_count_by_their_fixes() {
        let first = figures(10, 90, &[Some(40.0), None], 4.0);
        let other = figures(0, 300, &[Some(20.0)], 1.0);
        let trains = [Some(first.clone()), None, Some(other)].map(|occupancy| TrainSummary {
            occupancy,
            ..TrainSummary::default()
        });
        let all = OccupancyOfTrains::of(Some(&first), &trains).unwrap();
        let is_wrong = |class| class == WrongConfident;
        assert_eq!(
            (all.fixes_of(is_wrong), all.share(is_wrong)),
            (10, Some(10.0 / 405.0))
        );
        let undecided = all.sum(|figures| figures.never_identified);
        assert_eq!(
            (undecided, all.legs_m()),
            (1, vec![Some(40.0), None, Some(20.0)])
        );
        assert_eq!(
            (all.identified_mean_m(), all.identified_max_m()),
            (Some(30.0), None)
        );
        let others = OccupancyOfTrains::of(None, &trains[2..]).unwrap();
        assert_eq!(others.identified_max_m(), Some(20.0));
        let nees = (90.0 * 4.0 + 300.0) / 390.0;
        assert!((all.nees_mean().unwrap() - nees).abs() < 1e-12);
        assert_eq!(all.error_max_m(), Some(0.4));
        let alone = OccupancyOfTrains::of(Some(&first), &[]).unwrap();
        assert_eq!(alone.share(is_wrong), Some(10.0 / 105.0));
        assert!(OccupancyOfTrains::of(None, &trains[1..2]).is_none());
    }
}
