//! Distributions that are none.

use super::TruncatedNormal;
use crate::scenario::sampling::settings::{CaseSettings, Distribution};
use crate::settings::{Problem, Settings};
use std::collections::BTreeSet;

/// A truncated distribution must leave this much of the whole.
const LEAST_SHARE: f64 = 1e-12;
/// More steps than a grid can be waited for.
const MOST_STEPS: u32 = 100_000;

/// What is wrong, and what to do about it.
type Flaw = (String, &'static str);

impl Settings for Distribution {
    fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        if let Some((what, remedy)) = self.flaw() {
            problems.push(Problem::new(at, what, remedy));
        }
    }
}

impl Distribution {
    fn flaw(&self) -> Option<Flaw> {
        match self {
            Self::Uniform { min, max } => order(*min, *max),
            Self::LogUniform { min, max } => order(*min, *max).or_else(|| {
                let what = || format!("min {min} has no logarithm");
                (*min <= 0.0).then(|| (what(), "give a min over 0"))
            }),
            Self::Normal {
                mean,
                sigma,
                min,
                max,
            } => {
                if !(mean.is_finite() && is_positive(*sigma)) {
                    let what = format!("mean {mean}, sigma {sigma}");
                    return Some((what, "give a finite mean and a sigma over 0"));
                }
                limits(*min, *max).or_else(|| left(self.truncated_normal()?))
            }
            Self::LogNormal {
                median,
                sigma_ln,
                min,
                max,
            } => {
                if !(is_positive(*median) && is_positive(*sigma_ln)) {
                    let what = format!("median {median}, sigma_ln {sigma_ln}");
                    return Some((what, "give both over 0"));
                }
                if min.is_some_and(|m| m < 0.0) || max.is_some_and(|m| m <= 0.0) {
                    return Some(("limits below 0".into(), "its values are all over 0"));
                }
                limits(*min, *max).or_else(|| left(self.truncated_normal()?))
            }
            Self::Triangular { min, mode, max } => order(*min, *max).or_else(|| {
                let what = || format!("mode {mode} is not from min {min} to max {max}");
                (!(*min..=*max).contains(mode)).then(|| (what(), "give a mode between them"))
            }),
            Self::Integer { min, max } => {
                let few = max
                    .checked_sub(*min)
                    .is_some_and(|n| (1..=1 << 52).contains(&n));
                let what = || format!("min {min} is not below max {max}");
                (!few).then(|| (what(), "give whole numbers, the smaller one as min"))
            }
            Self::Choice { values, weights } => choice(values.len(), weights),
            Self::Table { .. } => None,
            Self::Sweep { values } => {
                (values.is_empty()).then(|| ("there is nothing to sweep".into(), "give `values`"))
            }
            Self::Cases(list) => cases(list),
            Self::Grid { min, max, count } => order(*min, *max).or_else(|| {
                let what = || format!("{count} steps");
                (!(2..=MOST_STEPS).contains(count)).then(|| (what(), "give a count of 2 to 100000"))
            }),
        }
    }
}

fn is_positive(x: f64) -> bool {
    x > 0.0 && x.is_finite()
}

fn order(min: f64, max: f64) -> Option<Flaw> {
    let fits = min < max && min.is_finite() && max.is_finite();
    let what = || format!("min {min} is not below max {max}");
    (!fits).then(|| (what(), "give finite numbers, the smaller one as min"))
}

fn limits(min: Option<f64>, max: Option<f64>) -> Option<Flaw> {
    order(min.unwrap_or(f64::MIN), max.unwrap_or(f64::MAX))
}

fn left(normal: TruncatedNormal) -> Option<Flaw> {
    let enough = normal.share() >= LEAST_SHARE && normal.share().is_finite();
    let what = "min and max leave nothing of it";
    (!enough).then(|| (what.into(), "give limits nearer to its middle"))
}

fn cases(cases: &[CaseSettings]) -> Option<Flaw> {
    if cases.is_empty() {
        return Some((
            "there are no cases".into(),
            "give one or more, each with a `name`",
        ));
    }
    let mut seen = BTreeSet::new();
    let mut names = cases.iter().map(|case| &case.name);
    let k = names.position(|name| name.is_empty() || !seen.insert(name))?;
    let what = format!("case {} has no name of its own: `{}`", k + 1, cases[k].name);
    Some((what, "give each case a name that no other has"))
}

fn choice(values: usize, weights: &[f64]) -> Option<Flaw> {
    if values == 0 {
        return Some(("there is nothing to choose from".into(), "give `values`"));
    }
    if weights.is_empty() {
        return None;
    }
    if weights.len() != values {
        let what = format!("{} weights for {values} values", weights.len());
        return Some((what, "give one weight a value, or none at all"));
    }
    let none_below = weights.iter().all(|w| *w >= 0.0 && w.is_finite());
    let what = "weights must not be negative, and some over 0";
    (!none_below || weights.iter().sum::<f64>() <= 0.0)
        .then(|| (what.into(), "give weights like [3, 1]"))
}
