//! How far a train's head runs beyond the toe of a switch until it is known which leg the train is on.

use crate::track::network::{Network, Route};

/// So near before the end of a leg the next track may be probable too.
const BEFORE_END_M: f64 = 10.0;

/// A leg of a switch that a route runs facing. Distances are along the route, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FacingLeg {
    /// Where it begins.
    pub toe_m: f64,
    /// Where it ends.
    pub end_m: f64,
}

impl FacingLeg {
    /// Those of a route, in order.
    pub fn all(network: &Network, route: &Route) -> Vec<Self> {
        let facing = network.passings(route).into_iter().filter(|p| p.facing);
        let toes_m: Vec<f64> = facing.map(|passing| passing.toe_m).collect();
        let legs = route.legs().iter().enumerate();
        let legs = legs.map(|(k, leg)| Self {
            toe_m: route.begin_m(k),
            end_m: route.begin_m(k) + leg.length_m(),
        });
        legs.filter(|leg| toes_m.iter().any(|toe_m| leg.begins_at(*toe_m)))
            .collect()
    }

    fn begins_at(&self, toe_m: f64) -> bool {
        (self.toe_m - toe_m).abs() < 1e-6
    }
}

/// Where a train is at a report, along its route, metres.
#[derive(Clone, Copy, Debug)]
pub struct ReportedAt {
    /// Its head, when the report was sent.
    pub head_m: f64,
    /// Its antenna, at the time that the report speaks of.
    pub antenna_m: f64,
}

/// A leg that the head has come to and the antenna has not left.
#[derive(Clone, Copy, Debug)]
struct EnteredLeg {
    leg: FacingLeg,
    /// Of the head beyond the toe, from where on the leg has been identified.
    identified_m: Option<f64>,
}

/// Follows one train over the toes of switches, from report to report.
#[derive(Debug, Default)]
pub struct LegScore {
    entered: Vec<EnteredLeg>,
    left: Vec<Option<f64>>,
    /// Of the head at the last report.
    head_m: Option<f64>,
}

impl LegScore {
    /// Takes a report in, with the legs of the train's route and whether the report names the track that the antenna is
    /// on, with no other left. A leg is entered when the head passes its toe, and left with the antenna, or where the
    /// head goes back.
    pub fn report(&mut self, legs: &[FacingLeg], at: ReportedAt, is_identified: bool) {
        let before_m = self.head_m.replace(at.head_m).unwrap_or(at.head_m);
        // A report may come after several toes.
        let passed = legs
            .iter()
            .filter(|leg| before_m < leg.toe_m && leg.toe_m <= at.head_m);
        self.entered.extend(passed.map(|leg| EnteredLeg {
            leg: *leg,
            identified_m: None,
        }));
        for entered in &mut self.entered {
            // A switch may lead the train onto the other leg than that of its route.
            let mut legs = legs.iter();
            if let Some(now) = legs.find(|leg| leg.begins_at(entered.leg.toe_m)) {
                entered.leg = *now;
            }
            entered.report(at, is_identified);
        }
        let left = self.entered.extract_if(.., |entered| entered.is_left(at));
        self.left.extend(left.map(|entered| entered.identified_m));
    }

    /// Of each leg in order, how far beyond the toe the head was when it was identified for good; `None` where it never
    /// was. A leg that the run ended on counts as one that was left.
    pub fn finish(self) -> Vec<Option<f64>> {
        let entered = self.entered.into_iter().map(|leg| leg.identified_m);
        self.left.into_iter().chain(entered).collect()
    }
}

impl EnteredLeg {
    /// Only what is said while the antenna is on the leg is said of it.
    fn report(&mut self, at: ReportedAt, is_identified: bool) {
        let FacingLeg { toe_m, end_m } = self.leg;
        if !(toe_m..end_m).contains(&at.antenna_m) {
            return;
        }
        let near_end = at.antenna_m > end_m - BEFORE_END_M;
        self.identified_m = match self.identified_m {
            Some(m) if is_identified || near_end => Some(m),
            _ => is_identified.then_some(at.head_m - toe_m),
        };
    }

    fn is_left(&self, at: ReportedAt) -> bool {
        at.antenna_m >= self.leg.end_m || at.head_m < self.leg.toe_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEGS: [FacingLeg; 2] = [
        FacingLeg {
            toe_m: 100.0,
            end_m: 200.0,
        },
        FacingLeg {
            toe_m: 200.0,
            end_m: 300.0,
        },
    ];

    /// A run of a train whose antenna is 10 m behind the head: places of the head, and whether the track is told there.
    fn distances(run: &[(f64, bool)]) -> Vec<Option<f64>> {
        let mut score = LegScore::default();
        for (head_m, is_identified) in run {
            let antenna_m = head_m - 10.0;
            let at = ReportedAt {
                head_m: *head_m,
                antenna_m,
            };
            score.report(&LEGS, at, *is_identified);
        }
        score.finish()
    }

    /// Fails where the distance is the antenna's, what is said of the track before the toe counts for the leg, a leg that
    /// was doubted again stays identified, or doubt near its end counts.
    #[test]
    fn the_distance_is_that_of_the_head() {
        let stem = [(50.0, true), (95.0, true), (105.0, true), (109.0, true)];
        let of = |rest: &[(f64, bool)]| distances(&[&stem, rest].concat());
        assert_eq!(of(&[]), [None], "the head is over the toe");
        assert_eq!(
            of(&[(115.0, false), (130.0, true), (140.0, true)]),
            [Some(30.0)]
        );
        let doubted = [(130.0, true), (140.0, false), (150.0, true)];
        assert_eq!(of(&doubted), [Some(50.0)]);
        assert_eq!(of(&[(130.0, true), (140.0, false)]), [None]);
        let near_end = [(130.0, true), (195.0, true), (199.9, false)];
        assert_eq!(of(&near_end), [None]);
        // The antenna at 191 m; the head is on the next leg.
        let near_end = [(130.0, true), (195.0, true), (201.0, false)];
        assert_eq!(of(&near_end), [Some(30.0), None]);
        let both = [(130.0, true), (195.0, true), (205.0, true), (240.0, true)];
        assert_eq!(of(&both), [Some(30.0), Some(40.0)]);
        assert_eq!(of(&[(130.0, true), (95.0, true)]), [Some(30.0)], "back");
        assert_eq!(
            distances(&[(150.0, true), (180.0, true)]),
            [],
            "it began there"
        );
    }

    /// Fails where only one of the toes between two reports counts, or a leg that was run over wholly does not.
    #[test]
    fn every_toe_between_two_reports_counts() {
        for (then_m, expected) in [
            (205.0, [Some(105.0), None]),
            (215.0, [None, Some(15.0)]),
            (315.0, [None, None]),
        ] {
            let found = distances(&[(90.0, true), (then_m, true)]);
            assert_eq!(found, expected, "{then_m}");
        }
    }
}
