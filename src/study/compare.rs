//! Two studies held against each other, run by run: with the same seed and variables, run k of both
//! met the same chances, and the differences of pairs scatter far less than the runs do.

use super::stats::{Bounds, IntervalEstimate, bounded_mean, weighted_mean};
use super::{MEASURES, Result, Row, Study};
use crate::record::parquet::Kind;
use serde::Serialize;
use std::path::Path;

/// What differs between two studies, b less a.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Rows of the first.
    pub rows: usize,
    /// Runs that both have, by their indexes.
    pub both: usize,
    /// Of these, those that are complete in both.
    pub pairs: usize,
    /// Of these, how many were not drawn alike: then pairs are no pairs, and weighted runs, whose weights
    /// are then two, have no differences.
    pub sampled_otherwise: usize,
    /// Each figure and event that differs in some run.
    pub differences: Vec<Difference>,
    /// The first thing in which they are not the same, value by value, wall times aside.
    pub first_difference: Option<String>,
}

/// A figure that differs.
#[derive(Clone, Debug, Serialize)]
pub struct Difference {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The mean difference.
    pub mean: IntervalEstimate,
    /// Pairs that it is of.
    pub pairs: usize,
    /// Pairs that are not in it because the figure is censored in one of both runs.
    pub censored: usize,
}

/// Compares the studies of two folders.
pub fn compare(a: &Path, b: &Path) -> Result<Comparison> {
    let (a, b) = (Study::open(a)?, Study::open(b)?);
    let (rows_a, rows_b) = (a.rows()?, b.rows()?);
    let of_b = |row: &Row| rows_b.binary_search_by_key(&row.index, |r| r.index).ok();
    let pairs = rows_a
        .iter()
        .filter_map(|row| Some((row, &rows_b[of_b(row)?])));
    let mut pairs: Vec<(&Row, &Row)> = pairs.collect();
    let both = pairs.len();
    pairs.retain(|(a, b)| a.is_complete() && b.is_complete());
    let alike = |a: &Row, b: &Row| {
        a.seed == b.seed && a.values == b.values && a.ln_weight.to_bits() == b.ln_weight.to_bits()
    };
    let sampled_otherwise = pairs.iter().filter(|(a, b)| !alike(a, b)).count();

    let weighted = a.template.is_weighted() || b.template.is_weighted();
    let mut differences = Vec::new();
    let mut add = |name: &str, unit: &str, bounds: Bounds, of: &dyn Fn(&Row) -> Option<f64>| {
        let both = pairs
            .iter()
            .filter_map(|(a, b)| Some((a.ln_weight, of(b)? - of(a)?)));
        let mut both: Vec<(f64, f64)> = both.collect();
        // One of the pair is censored; where both are, the difference is no number.
        let censored = both.iter().filter(|(_, d)| d.is_infinite()).count();
        both.retain(|(_, d)| d.is_finite());
        let estimate = if weighted {
            weighted_mean(&both, bounds).filter(|_| sampled_otherwise == 0)
        } else {
            bounded_mean(&both.iter().map(|(_, d)| *d).collect::<Vec<_>>(), bounds)
        };
        let differs = censored > 0 || both.iter().any(|(_, d)| d.abs() > 0.0);
        let estimate = estimate.filter(|_| differs);
        differences.extend(estimate.map(|mean| Difference {
            name: name.to_owned(),
            unit: unit.to_owned(),
            pairs: mean.n,
            censored,
            mean,
        }));
    };
    for (name, condition) in &a.template.events {
        let happened = |row: &Row| row.happened(condition).map(f64::from);
        let bounds = Bounds::SHARE_DIFFERENCE;
        add(&format!("rate of {name}"), "1", bounds, &happened);
    }
    for m in MEASURES
        .iter()
        .filter(|m| m.kind != Kind::Reals && !m.is_wall_time())
    {
        let bounds = if m.range() == Bounds::SHARE {
            Bounds::SHARE_DIFFERENCE
        } else {
            Bounds::NONE
        };
        add(m.name, m.unit, bounds, &|row: &Row| row.number(m.name));
    }
    let lengths = (rows_a.len() != rows_b.len())
        .then(|| format!("{} rows and {}", rows_a.len(), rows_b.len()));
    let mut together = rows_a.iter().zip(&rows_b);
    let row = |(a, b): (&Row, &Row)| Some(format!("run {}: {}", a.index, a.difference(b)?));
    Ok(Comparison {
        rows: rows_a.len(),
        both,
        pairs: pairs.len(),
        sampled_otherwise,
        differences,
        first_difference: lengths.or_else(|| together.find_map(row)),
    })
}
