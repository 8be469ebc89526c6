//! What track occupancy comes to, as `summary.json` has it.

use super::statistics::ErrorStatistics;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;

/// Track occupancy: what was said after each fix, and how soon legs of switches were known.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct OccupancyFigures {
    /// Fixes after which something was said; without a receiver, such reports.
    pub fixes: u32,
    /// These, and the fixes after which nothing was said: all of `classes`, which shares of fixes are of.
    pub fixes_in_all: u32,
    /// Legs of switches that the train's head came to over the toe.
    pub switches: u32,
    /// Of these, legs that were not identified before they were left, or not to their end, or to that of the run.
    pub never_identified: u32,
    /// From the toe to where the train's head was when the leg was identified for good, which needs a report of the
    /// antenna's place on the leg; `null` without legs.
    pub identified_after_m: Option<LegDistances>,
    /// The same of each leg in order; `null` where it was never identified.
    pub legs_identified_after_m: Vec<Option<f64>>,
    /// How many fixes are of which class: `wc`, `wf`, `wu` wrong, `cu`, `cf`, `cc` correct, each confident, fairly
    /// confident or undecided; `ns` nothing said.
    pub classes: BTreeMap<OccupancyClass, u32>,
    /// Which way the train was said to face.
    pub facing: FacingFigures,
    /// Error of the antenna's place along the track, of fixes whose track is right.
    pub error_m: Option<ErrorStatistics>,
    /// Mean of (error/sigma)^2 of the same: 1 for an honest sigma.
    pub nees_mean: Option<f64>,
}

impl OccupancyClass {
    /// All of them, from the worst on.
    pub const ALL: [Self; 7] = [
        Self::WrongConfident,
        Self::WrongFairlyConfident,
        Self::WrongUndecided,
        Self::NothingSaid,
        Self::CorrectUndecided,
        Self::CorrectFairlyConfident,
        Self::CorrectConfident,
    ];

    /// The most probable track is the true one.
    pub fn is_right(self) -> bool {
        self > Self::NothingSaid
    }

    /// The most probable track is another than the true one.
    pub fn is_wrong(self) -> bool {
        self < Self::NothingSaid
    }
}

/// Which way along its track a train was said to face, after fixes and without.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct FacingFigures {
    /// Reports whose most probable track is the true one.
    pub reports: u32,
    /// Of these, the wrong way with a probability over 0.9.
    pub wrong_over_0_9: u32,
    /// Of these, the wrong way with a probability over 1 - 1e-9.
    pub wrong_certain: u32,
}

/// Distances from the toe to the head when a leg was identified for good.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct LegDistances {
    /// Of the legs that were identified, `null` where none was: those of `never_identified` have no distance.
    pub mean: Option<f64>,
    /// Median over all legs. One that was never identified counts as farther than any other; `null`: more than the leg,
    /// because the median falls among these.
    pub p50: Option<f64>,
    /// 95 % of all legs, as the median.
    pub p95: Option<f64>,
    /// The longest of all legs, as the median.
    pub max: Option<f64>,
}

impl LegDistances {
    /// Of the distances of legs, `None` of one that was never identified; `None` without legs.
    pub fn of(legs_m: &[Option<f64>]) -> Option<Self> {
        let all = legs_m.iter().map(|leg_m| leg_m.unwrap_or(f64::INFINITY));
        let mut all: Vec<f64> = all.collect();
        let of = ErrorStatistics::of(&mut all)?;
        let finite = |m: f64| m.is_finite().then_some(m);
        Some(Self {
            mean: mean_of_identified_m(legs_m),
            p50: finite(of.p50),
            p95: finite(of.p95),
            max: finite(of.max),
        })
    }
}

/// Mean of the distances of the legs that were identified; `None` where none was.
fn mean_of_identified_m(legs_m: &[Option<f64>]) -> Option<f64> {
    let identified = || legs_m.iter().flatten();
    let count = identified().count();
    (count > 0).then(|| identified().sum::<f64>() / count as f64)
}

/// What the most probable track after a fix is worth (Guo et al. 2020). Confident: no other track is left. Fairly
/// confident: its probability is over 0.9. Where nothing is said there is no such track: neither wrong nor right.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
pub enum OccupancyClass {
    /// Another track than the true one, and no other left.
    #[serde(rename = "wc")]
    WrongConfident,
    /// Another one, over 0.9.
    #[serde(rename = "wf")]
    WrongFairlyConfident,
    /// Another one.
    #[serde(rename = "wu")]
    WrongUndecided,
    /// None: no track is named.
    #[serde(rename = "ns")]
    NothingSaid,
    /// The true one.
    #[serde(rename = "cu")]
    CorrectUndecided,
    /// The true one, over 0.9.
    #[serde(rename = "cf")]
    CorrectFairlyConfident,
    /// The true one, and no other left.
    #[serde(rename = "cc")]
    CorrectConfident,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fails where a class is missing, or counts as wrong and right, or as neither though a track is named.
    #[test]
    fn all_classes_but_one_are_wrong_or_right() {
        assert!(OccupancyClass::ALL.is_sorted());
        let sides = OccupancyClass::ALL.map(|class| (class.is_wrong(), class.is_right()));
        let (wrong, right) = ((true, false), (false, true));
        let neither = (false, false);
        assert_eq!(sides, [wrong, wrong, wrong, neither, right, right, right]);
    }

    /// Fails where the quantiles leave out legs that were never identified, or the mean takes them in.
    #[test]
    fn a_leg_that_was_never_known_is_farther_than_any_other() {
        let of = |identified: u32, never: usize| {
            let identified = (1..=identified).map(|m| Some(f64::from(m)));
            let legs: Vec<_> = std::iter::repeat_n(None, never).chain(identified).collect();
            let statistics = LegDistances::of(&legs).map(|d| [d.p50, d.p95, d.max]);
            (statistics, mean_of_identified_m(&legs))
        };
        assert_eq!(of(0, 0), (None, None));
        assert_eq!(of(0, 3), (Some([None; 3]), None));
        // Of 21 the 20th in order is the 95 %.
        let known = Some([11.0, 20.0, 21.0].map(Some));
        assert_eq!(of(21, 0), (known, Some(11.0)));
        assert_eq!(
            of(20, 1),
            (Some([Some(11.0), Some(20.0), None]), Some(10.5))
        );
        assert_eq!(of(19, 2), (Some([Some(11.0), None, None]), Some(10.0)));
        assert_eq!(of(10, 11), (Some([None; 3]), Some(5.5)));
    }
}
