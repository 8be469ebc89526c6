//! Order statistics of errors and costs, as `summary.json` has them.

use schemars::JsonSchema;
use serde::Serialize;

/// Order statistics.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[allow(missing_docs, reason = "the names say it")]
pub struct ErrorStatistics {
    pub mean: f64,
    pub p50: f64,
    pub p75: f64,
    pub p95: f64,
    pub p99: f64,
    pub max: f64,
}

impl ErrorStatistics {
    /// Of the values given (sorted in passing); `None` of none.
    pub fn of(values: &mut [f64]) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        let max = *values.last()?;
        Some(Self {
            mean: values.iter().sum::<f64>() / values.len() as f64,
            p50: quantile(values, 0.50),
            p75: quantile(values, 0.75),
            p95: quantile(values, 0.95),
            p99: quantile(values, 0.99),
            max,
        })
    }
}

/// Median and 99th percentile of a cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[allow(missing_docs, reason = "the names say it")]
pub struct Cost {
    pub p50: f64,
    pub p99: f64,
}

impl Cost {
    /// Of the values given (sorted in passing); `None` of none.
    pub fn of(values: &mut [f64]) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        (!values.is_empty()).then(|| Self {
            p50: quantile(values, 0.50),
            p99: quantile(values, 0.99),
        })
    }
}

/// Linear interpolation between order statistics (numpy's default) of sorted values. Between a number and infinity lies
/// infinity.
pub(crate) fn quantile(sorted: &[f64], p: f64) -> f64 {
    let x = p * (sorted.len() - 1) as f64;
    let k = x.floor() as usize;
    let share = x - k as f64;
    let (low, high) = (sorted[k], sorted[(k + 1).min(sorted.len() - 1)]);
    if high.is_infinite() {
        return if share > 0.0 { high } else { low };
    }
    low + (high - low) * share
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Off-by-one in the quantiles, mean over the wrong count. Figures from numpy.percentile
    /// (tests/studies/figures.py).
    #[test]
    fn distribution_matches_numpy() {
        let mut v = vec![5.0, 1.0, 4.0, 2.0];
        let d = ErrorStatistics::of(&mut v).unwrap_or_else(|| unreachable!());
        assert!((d.mean - 3.0).abs() < 1e-15);
        assert!((d.p50 - 3.0).abs() < 1e-15);
        assert!((d.p75 - 4.25).abs() < 1e-15);
        assert!((d.p95 - 4.85).abs() < 1e-12);
        assert!((d.max - 5.0).abs() < 1e-15);
        assert_eq!(ErrorStatistics::of(&mut []), None);
        assert_eq!(Cost::of(&mut []), None);
    }

    /// Between a number and infinity lies infinity, and at neither end something that is no number.
    #[test]
    fn quantiles_may_be_infinite() {
        let sorted = [1.0, 3.0, f64::INFINITY, f64::INFINITY, f64::INFINITY];
        for (p, expected) in [
            (0.125, 2.0),
            (0.25, 3.0),
            (0.3, f64::INFINITY),
            (0.75, f64::INFINITY),
        ] {
            let found = quantile(&sorted, p);
            assert_eq!(found.to_bits(), f64::to_bits(expected), "{p}: {found}");
        }
    }
}
