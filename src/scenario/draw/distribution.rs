//! Distributions by their quantile functions: a number of the unit interval in, a value out, so
//! that any plan of points serves any distribution.

use super::settings::Distribution;
use crate::track::Problem;
use statrs::distribution::{Continuous, ContinuousCDF, Normal};
use toml::Value;

/// A truncated distribution must leave this much of the whole.
const LEAST_SHARE: f64 = 1e-12;

impl Distribution {
    /// Whether it is swept, not drawn.
    pub fn is_swept(&self) -> bool {
        matches!(self, Self::Sweep { .. } | Self::Grid { .. })
    }

    /// Whether it has a density, and so can be weighed against another one.
    pub fn has_density(&self) -> bool {
        matches!(
            self,
            Self::Uniform { .. }
                | Self::LogUniform { .. }
                | Self::Normal { .. }
                | Self::LogNormal { .. }
                | Self::Triangular { .. }
        )
    }

    /// Whether it reaches wherever another one does.
    pub fn covers(&self, other: &Self) -> bool {
        let ([a0, a1], [b0, b1]) = (self.ends(), other.ends());
        a0 <= b0 && b1 <= a1
    }

    fn ends(&self) -> [f64; 2] {
        match *self {
            Self::Uniform { min, max }
            | Self::LogUniform { min, max }
            | Self::Triangular { min, max, .. } => [min, max],
            Self::Normal { min, max, .. } => [
                min.unwrap_or(f64::NEG_INFINITY),
                max.unwrap_or(f64::INFINITY),
            ],
            Self::LogNormal { min, max, .. } => [min.unwrap_or(0.0), max.unwrap_or(f64::INFINITY)],
            _ => [f64::NAN; 2],
        }
    }

    /// Whether all its values are numbers (a table's are looked at when it is read).
    pub fn is_of_numbers(&self) -> bool {
        match self {
            Self::Choice { values, .. } | Self::Sweep { values } => {
                values.iter().all(|v| v.is_integer() || v.is_float())
            }
            _ => true,
        }
    }

    /// The values of a swept one, in order; none of others.
    pub fn swept(&self) -> Vec<Value> {
        match self {
            Self::Sweep { values } => values.clone(),
            Self::Grid { min, max, count } => (0..*count)
                .map(|k| {
                    let share = f64::from(k) / f64::from(count - 1);
                    Value::Float(min + share * (max - min))
                })
                .collect(),
            _ => Vec::new(),
        }
    }

    /// Where a share `u` of all values lies below, 0 < u < 1. `None` of those that are swept or
    /// stand in a table.
    pub fn quantile(&self, u: f64) -> Option<Value> {
        Some(match self {
            Self::Integer { min, max } => {
                let count = (max - min) as f64 + 1.0;
                Value::Integer((min + (u * count) as i64).min(*max))
            }
            Self::Choice { values, weights } => values.get(pick(u, values.len(), weights))?.clone(),
            _ => Value::Float(self.real_quantile(u)?),
        })
    }

    fn real_quantile(&self, u: f64) -> Option<f64> {
        Some(match *self {
            Self::Uniform { min, max } => min + u * (max - min),
            Self::LogUniform { min, max } => min * (u * (max / min).ln()).exp(),
            Self::Normal {
                mean,
                sigma,
                min,
                max,
            } => Cut::normal(mean, sigma, min, max).quantile(u),
            Self::LogNormal {
                median,
                sigma_ln,
                min,
                max,
            } => Cut::log_normal(median, sigma_ln, min, max)
                .quantile(u)
                .exp(),
            Self::Triangular { min, mode, max } => {
                let rising = (mode - min) / (max - min);
                if u < rising {
                    min + ((max - min) * (mode - min) * u).sqrt()
                } else {
                    max - ((max - min) * (max - mode) * (1.0 - u)).sqrt()
                }
            }
            _ => return None,
        })
    }

    /// Natural logarithm of the density at `x`: minus infinity where it has none.
    pub fn ln_density(&self, x: f64) -> f64 {
        let within = |min: f64, max: f64, density: f64| {
            if (min..=max).contains(&x) {
                density.ln()
            } else {
                f64::NEG_INFINITY
            }
        };
        match *self {
            Self::Uniform { min, max } => within(min, max, 1.0 / (max - min)),
            Self::LogUniform { min, max } => within(min, max, 1.0 / (x * (max / min).ln())),
            Self::Normal {
                mean,
                sigma,
                min,
                max,
            } => Cut::normal(mean, sigma, min, max).ln_density(x),
            Self::LogNormal { .. } if x <= 0.0 => f64::NEG_INFINITY,
            Self::LogNormal {
                median,
                sigma_ln,
                min,
                max,
            } => Cut::log_normal(median, sigma_ln, min, max).ln_density(x.ln()) - x.ln(),
            Self::Triangular { min, mode, max } => {
                let height = 2.0 / (max - min);
                let share = if x < mode {
                    (x - min) / (mode - min)
                } else {
                    (max - x) / (max - mode)
                };
                // At a mode that is an end, the line is upright.
                within(min, max, height * if share.is_nan() { 1.0 } else { share })
            }
            _ => f64::NEG_INFINITY,
        }
    }

    /// Appends what is wrong.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        let mut wrong = |what: String, remedy: &str| problems.push(Problem::new(at, what, remedy));
        let order = |min: f64, max: f64| {
            let fits = min < max && min.is_finite() && max.is_finite();
            (!fits).then(|| format!("min {min} is not below max {max}"))
        };
        let ordered = "give finite numbers, the smaller one as min";
        let cut = |cut: Cut| {
            (cut.share() < LEAST_SHARE || !cut.share().is_finite())
                .then(|| "min and max leave nothing of it".to_owned())
        };
        let some = |min: Option<f64>, max: Option<f64>| {
            order(min.unwrap_or(f64::MIN), max.unwrap_or(f64::MAX))
        };
        match self {
            Self::Uniform { min, max } => {
                if let Some(what) = order(*min, *max) {
                    wrong(what, ordered);
                }
            }
            Self::LogUniform { min, max } => {
                if let Some(what) = order(*min, *max) {
                    wrong(what, ordered);
                } else if *min <= 0.0 {
                    wrong(format!("min {min} has no logarithm"), "give a min over 0");
                }
            }
            Self::Normal {
                mean,
                sigma,
                min,
                max,
            } => {
                if !(mean.is_finite() && *sigma > 0.0 && sigma.is_finite()) {
                    wrong(
                        format!("mean {mean}, sigma {sigma}"),
                        "give a finite mean and a sigma over 0",
                    );
                } else if let Some(what) = some(*min, *max) {
                    wrong(what, ordered);
                } else if let Some(what) = cut(Cut::normal(*mean, *sigma, *min, *max)) {
                    wrong(what, "give limits nearer to the mean");
                }
            }
            Self::LogNormal {
                median,
                sigma_ln,
                min,
                max,
            } => {
                let positive = |x: f64| x > 0.0 && x.is_finite();
                if !(positive(*median) && positive(*sigma_ln)) {
                    wrong(
                        format!("median {median}, sigma_ln {sigma_ln}"),
                        "give both over 0",
                    );
                } else if let Some(what) = some(*min, *max) {
                    wrong(what, ordered);
                } else if min.is_some_and(|m| m < 0.0) || max.is_some_and(|m| m <= 0.0) {
                    wrong("limits below 0".into(), "its values are all over 0");
                } else if let Some(what) = cut(Cut::log_normal(*median, *sigma_ln, *min, *max)) {
                    wrong(what, "give limits nearer to the median");
                }
            }
            Self::Triangular { min, mode, max } => {
                if let Some(what) = order(*min, *max) {
                    wrong(what, ordered);
                } else if !(*min..=*max).contains(mode) {
                    wrong(
                        format!("mode {mode} is not from min {min} to max {max}"),
                        "give a mode between them",
                    );
                }
            }
            Self::Integer { min, max } => {
                if min >= max || max.checked_sub(*min).is_none_or(|n| n > 1 << 52) {
                    wrong(format!("min {min} is not below max {max}"), ordered);
                }
            }
            Self::Choice { values, weights } => {
                if values.is_empty() {
                    wrong("there is nothing to choose from".into(), "give `values`");
                } else if !weights.is_empty() && weights.len() != values.len() {
                    wrong(
                        format!("{} weights for {} values", weights.len(), values.len()),
                        "give one weight a value, or none at all",
                    );
                } else if weights.iter().any(|w| !(*w >= 0.0 && w.is_finite()))
                    || (!weights.is_empty() && weights.iter().sum::<f64>() <= 0.0)
                {
                    wrong(
                        "weights must not be negative, and some over 0".into(),
                        "give weights like [3, 1]",
                    );
                }
            }
            Self::Table { .. } => {}
            Self::Sweep { values } => {
                if values.is_empty() {
                    wrong("there is nothing to sweep".into(), "give `values`");
                }
            }
            Self::Grid { min, max, count } => {
                if let Some(what) = order(*min, *max) {
                    wrong(what, ordered);
                } else if !(2..=100_000).contains(count) {
                    wrong(format!("{count} steps"), "give a count of 2 to 100000");
                }
            }
        }
    }
}

/// Which of `len` entries a share `u` of all weight falls on.
fn pick(u: f64, len: usize, weights: &[f64]) -> usize {
    if weights.is_empty() {
        return ((u * len as f64) as usize).min(len.saturating_sub(1));
    }
    let total: f64 = weights.iter().sum();
    let mut left = u * total;
    let found = weights.iter().position(|w| {
        left -= w;
        left < 0.0
    });
    let last = weights.iter().rposition(|w| *w > 0.0).unwrap_or(0);
    found.unwrap_or(last)
}

/// What two limits leave of a normal distribution.
struct Cut {
    mean: f64,
    sigma: f64,
    /// Limits in standard deviations.
    from: f64,
    to: f64,
}

impl Cut {
    fn normal(mean: f64, sigma: f64, min: Option<f64>, max: Option<f64>) -> Self {
        let score = |x: f64| (x - mean) / sigma;
        Self {
            mean,
            sigma,
            from: min.map_or(f64::NEG_INFINITY, score),
            to: max.map_or(f64::INFINITY, score),
        }
    }

    /// Of the logarithm.
    fn log_normal(median: f64, sigma_ln: f64, min: Option<f64>, max: Option<f64>) -> Self {
        Self::normal(median.ln(), sigma_ln, min.map(f64::ln), max.map(f64::ln))
    }

    /// Of the whole curve's area. In the tail that is not 1 minus almost 1.
    fn share(&self) -> f64 {
        let curve = Normal::standard();
        if self.from > 0.0 {
            curve.sf(self.from) - curve.sf(self.to)
        } else {
            curve.cdf(self.to) - curve.cdf(self.from)
        }
    }

    fn quantile(&self, u: f64) -> f64 {
        let curve = Normal::standard();
        let score = if self.from > 0.0 {
            // By symmetry, where small numbers are exact.
            -curve.inverse_cdf(curve.sf(self.from) - u * self.share())
        } else {
            curve.inverse_cdf(curve.cdf(self.from) + u * self.share())
        };
        self.mean + self.sigma * score.clamp(self.from, self.to)
    }

    fn ln_density(&self, x: f64) -> f64 {
        let score = (x - self.mean) / self.sigma;
        if !(self.from..=self.to).contains(&score) {
            return f64::NEG_INFINITY;
        }
        Normal::standard().ln_pdf(score) - self.sigma.ln() - self.share().ln()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    const SHARES: [f64; 4] = [1e-6, 0.1, 0.5, 0.999];

    fn normal(mean: f64, sigma: f64, min: Option<f64>, max: Option<f64>) -> Distribution {
        Distribution::Normal {
            mean,
            sigma,
            min,
            max,
        }
    }

    fn log_normal() -> Distribution {
        Distribution::LogNormal {
            median: 2.0,
            sigma_ln: 0.5,
            min: None,
            max: None,
        }
    }

    const TRIANGLE: Distribution = Distribution::Triangular {
        min: 1.0,
        mode: 2.0,
        max: 5.0,
    };

    /// scipy's norm, truncnorm, lognorm and triang (tests/studies/figures.py).
    #[test]
    fn val_quantiles_and_densities_are_scipys() {
        let known = [
            (
                normal(3.0, 2.0, None, None),
                [
                    -6.506848617645797,
                    0.43689686891079926,
                    3.0,
                    9.180464612335626,
                ],
            ),
            (
                normal(0.0, 1.0, Some(-1.0), Some(2.0)),
                [
                    -0.9999966169740943,
                    -0.704647821094745,
                    0.17116391801782482,
                    1.985063085944169,
                ],
            ),
            // Far out in the tail, where 1 - 1e-9 would be all that is left.
            (
                normal(0.0, 1.0, Some(6.0), None),
                [
                    6.000000162377741,
                    6.017085062660678,
                    6.111565061813439,
                    7.036366493709704,
                ],
            ),
            (
                log_normal(),
                [
                    0.18571074059915316,
                    1.053767036592073,
                    2.0,
                    9.377032362017918,
                ],
            ),
            (
                TRIANGLE,
                [
                    1.002,
                    1.632455532033676,
                    2.550510257216822,
                    4.890455488498967,
                ],
            ),
        ];
        for (distribution, quantiles) in known {
            for (u, expected) in SHARES.into_iter().zip(quantiles) {
                let x = distribution.quantile(u).unwrap().as_float().unwrap();
                assert!(
                    (x - expected).abs() < 1e-8,
                    "{distribution:?} at {u}: {x}, not {expected}"
                );
            }
        }
        let densities = [
            (
                normal(0.0, 1.0, Some(-1.0), Some(2.0)),
                0.5,
                -0.84377223888021,
            ),
            (log_normal(), 3.0, -1.653207549099168),
            (TRIANGLE, 3.0, -1.0986122886681098),
        ];
        for (distribution, x, expected) in densities {
            assert!(
                (distribution.ln_density(x) - expected).abs() < 1e-9,
                "{distribution:?}"
            );
        }
    }

    /// Densities are those of the quantiles: the slope of one is the inverse of the other; and none
    /// outside.
    #[test]
    fn densities_are_slopes_of_quantiles() {
        let uniform = Distribution::Uniform { min: 2.0, max: 6.0 };
        let log_uniform = Distribution::LogUniform {
            min: 0.1,
            max: 10.0,
        };
        let cut = Distribution::LogNormal {
            median: 2.0,
            sigma_ln: 0.5,
            min: Some(1.0),
            max: Some(3.0),
        };
        for distribution in [
            uniform,
            log_uniform,
            cut,
            TRIANGLE,
            normal(1.0, 0.1, Some(1.05), None),
        ] {
            let at = |u: f64| distribution.quantile(u).unwrap().as_float().unwrap();
            for u in [0.05, 0.3, 0.62, 0.9] {
                let slope = (at(u + 1e-5) - at(u - 1e-5)) / 2e-5;
                let product = slope * distribution.ln_density(at(u)).exp();
                assert!(
                    (product - 1.0).abs() < 1e-3,
                    "{distribution:?} at {u}: {product}"
                );
            }
            for x in [-1.0, 0.0, 11.0] {
                assert!(distribution.ln_density(x) < -1e3, "{distribution:?} at {x}");
            }
        }
    }

    /// Both ends of whole numbers, weights of nothing, all of a list.
    #[test]
    fn whole_numbers_and_choices_take_their_shares() {
        let whole = Distribution::Integer { min: -1, max: 2 };
        let choice = Distribution::Choice {
            values: vec!["a".into(), "b".into(), "c".into()],
            weights: vec![3.0, 0.0, 1.0],
        };
        let count = |distribution: &Distribution, value: Value| {
            let draws = (0..1000).map(|k| distribution.quantile((f64::from(k) + 0.5) / 1000.0));
            draws.filter(|v| v.as_ref() == Some(&value)).count()
        };
        for value in -1..=2 {
            assert_eq!(count(&whole, value.into()), 250);
        }
        let counts = ["a", "b", "c"].map(|v| count(&choice, v.into()));
        assert_eq!(counts, [750, 0, 250]);
    }

    /// Each wrong distribution is refused, with the key.
    #[test]
    fn wrong_distributions_say_why() {
        let wrong = [
            ("uniform = { min = 2.0, max = 1.0 }", "not below"),
            ("uniform = { min = 1.0, max = inf }", "not below"),
            ("log_uniform = { min = 0.0, max = 1.0 }", "no logarithm"),
            ("normal = { mean = 0.0, sigma = 0.0 }", "sigma"),
            (
                "normal = { mean = 0.0, sigma = 1.0, min = 40.0 }",
                "leave nothing",
            ),
            ("log_normal = { median = -1.0, sigma_ln = 1.0 }", "median"),
            ("triangular = { min = 0.0, mode = 3.0, max = 2.0 }", "mode"),
            ("integer = { min = 3, max = 3 }", "not below"),
            ("choice = { values = [] }", "nothing"),
            ("choice = { values = [1, 2], weights = [1.0] }", "weights"),
            ("sweep = { values = [] }", "nothing"),
            ("grid = { min = 0.0, max = 1.0, count = 1 }", "steps"),
        ];
        for (text, why) in wrong {
            let distribution: Distribution = toml::from_str(text).unwrap();
            let mut problems = Vec::new();
            distribution.check("study.variables.x.from", &mut problems);
            assert!(
                problems.len() == 1 && problems[0].what.contains(why),
                "{text}: {problems:?}"
            );
        }
    }
}
