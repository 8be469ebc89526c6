//! What the rows of a study come to.

use super::stats::{
    IntervalEstimate, Rate, Weighted, effective_runs, first_order, first_order_of_groups, mean,
    quantile, rank_correlation, rate, weighted_mean, weighted_rate,
};
use super::{MEASURES, Measure, Row};
use crate::record::parquet::Kind;
use crate::scenario::sampling::{Distribution, Template};
use serde::Serialize;
use std::collections::BTreeSet;

/// Quantiles that are shown.
pub const QUANTILES: [f64; 3] = [0.5, 0.9, 0.95];

/// All figures of a study.
#[derive(Clone, Debug, Serialize)]
pub struct Digest {
    /// Rows there are.
    pub runs: usize,
    /// Of these, complete ones; the rest gives its reasons in the table.
    pub complete: usize,
    /// Draws that did not meet the conditions.
    pub rejected: u64,
    /// Kish's effective number of runs, where they are weighted.
    pub effective_runs: Option<f64>,
    /// Events, in the order of their names.
    pub events: Vec<EventDigest>,
    /// Figures that vary, in the order of columns.
    pub figures: Vec<FigureDigest>,
}

/// An event.
#[derive(Clone, Debug, Serialize)]
pub struct EventDigest {
    /// Its name.
    pub name: String,
    /// Its condition.
    pub condition: String,
    /// Runs that have the figures that it names.
    pub runs: usize,
    /// How often it happened in these.
    pub rate: Option<Rate>,
    /// The rate of the distributions that were asked for, where runs are weighted.
    pub weighted: Option<Weighted>,
}

/// A figure.
#[derive(Clone, Debug, Serialize)]
pub struct FigureDigest {
    /// Which.
    pub measure: &'static Measure,
    /// How many runs have it.
    pub runs: usize,
    /// Its mean.
    pub mean: Option<IntervalEstimate>,
    /// Its [`QUANTILES`].
    pub quantiles: [Option<IntervalEstimate>; QUANTILES.len()],
    /// What drives it: each variable with its rank correlation and first-order share. Weighed runs have
    /// no quantiles and drivers: theirs are not those of the distributions that were asked for.
    pub drivers: Vec<Sensitivity>,
}

/// A variable as the cause of a figure.
#[derive(Clone, Debug, Serialize)]
pub struct Sensitivity {
    /// The variable.
    pub variable: String,
    /// Spearman's rank correlation; `None` of names.
    pub correlation: Option<IntervalEstimate>,
    /// First-order Sobol index; `None` where inputs are not independent.
    pub first_order: Option<f64>,
}

impl Digest {
    /// Of rows in order.
    pub fn of(template: &Template, rows: &[Row]) -> Self {
        let weighted = is_weighted(template);
        let complete: Vec<&Row> = rows.iter().filter(|r| r.is_complete()).collect();
        let ln_weights: Vec<f64> = complete.iter().map(|r| r.ln_weight).collect();
        // Weights have mean 1 by themselves only if no condition cut draws off and no run is missing.
        let cut_off = !template.settings.require.is_empty();
        let events = template.events.iter().map(|(name, condition)| {
            let known = complete
                .iter()
                .filter_map(|r| Some((r.ln_weight, r.happened(condition)?)));
            let known: Vec<(f64, bool)> = known.collect();
            let happened = known.iter().filter(|k| k.1).count() as u64;
            EventDigest {
                name: name.clone(),
                condition: condition.text().to_owned(),
                runs: known.len(),
                rate: rate(happened, known.len() as u64),
                weighted: weighted
                    .then(|| weighted_rate(&known, cut_off || known.len() < rows.len()))
                    .flatten(),
            }
        });
        let shown = MEASURES.iter().filter(|m| is_shown(m));
        Self {
            runs: rows.len(),
            complete: complete.len(),
            rejected: rows.iter().map(|r| u64::from(r.rejected)).sum(),
            effective_runs: weighted.then(|| effective_runs(&ln_weights)),
            events: events.collect(),
            figures: shown
                .filter_map(|m| FigureDigest::of(template, m, &complete))
                .collect(),
        }
    }
}

/// Whether runs carry weights.
pub fn is_weighted(template: &Template) -> bool {
    template
        .settings
        .variables
        .values()
        .any(|v| v.propose.is_some())
}

/// Whether two variables come from one table, whose rows tie them together.
fn shares_a_table(template: &Template) -> bool {
    let mut files = BTreeSet::new();
    let mut variables = template.settings.variables.values();
    variables.any(|v| match &v.from {
        Distribution::Table { file, .. } => !files.insert(file),
        _ => false,
    })
}

fn is_shown(measure: &Measure) -> bool {
    matches!(measure.kind, Kind::Real | Kind::Int | Kind::Flag) && !measure.is_wall_time()
}

impl FigureDigest {
    /// `None` of a figure that no run has, or that is the same in all.
    fn of(template: &Template, measure: &'static Measure, rows: &[&Row]) -> Option<Self> {
        let known = rows
            .iter()
            .filter_map(|r| Some((r.ln_weight, r.number(measure.name)?)));
        let known: Vec<(f64, f64)> = known.collect();
        let first = known.first()?.1.to_bits();
        if known.iter().all(|(_, x)| x.to_bits() == first) {
            return None;
        }
        if is_weighted(template) {
            return Some(Self {
                measure,
                runs: known.len(),
                mean: weighted_mean(&known),
                quantiles: [None; QUANTILES.len()],
                drivers: Vec::new(),
            });
        }
        let mut sample: Vec<f64> = known.into_iter().map(|(_, x)| x).collect();
        let mean = mean(&sample);
        sample.sort_by(f64::total_cmp);
        let variables = template.settings.variables.keys();
        let drivers = variables.map(|name| Sensitivity::of(template, name, measure, rows));
        Some(Self {
            measure,
            runs: sample.len(),
            mean,
            quantiles: QUANTILES.map(|p| quantile(&sample, p)),
            drivers: drivers.collect(),
        })
    }
}

impl Sensitivity {
    fn of(template: &Template, name: &str, measure: &Measure, rows: &[&Row]) -> Self {
        let settings = &template.settings;
        let pairs = rows
            .iter()
            .filter_map(|r| Some((r.number(name)?, r.number(measure.name)?)));
        let pairs: Vec<(f64, f64)> = pairs.collect();
        // Inputs that conditions tie together explain no share alone, nor do those of runs that have
        // the figure: a thing that was found is near or large.
        let independent = settings.correlated.is_empty()
            && settings.require.is_empty()
            && !shares_a_table(template)
            && rows.iter().all(|r| r.number(measure.name).is_some());
        let share = || {
            if pairs.is_empty() {
                first_order_of_groups(&by_name(name, measure, rows))
            } else {
                first_order(&pairs)
            }
        };
        Self {
            variable: name.to_owned(),
            correlation: rank_correlation(&pairs),
            first_order: independent.then(share).flatten(),
        }
    }
}

/// Runs by which of the names of a variable they have.
fn by_name(variable: &str, measure: &Measure, rows: &[&Row]) -> Vec<(usize, f64)> {
    let name = |row: &Row| Some(row.values.get(variable)?.to_string());
    let names: BTreeSet<String> = rows.iter().filter_map(|r| name(r)).collect();
    let place = |row: &Row| names.iter().position(|n| Some(n) == name(row).as_ref());
    let pairs = rows
        .iter()
        .filter_map(|r| Some((place(r)?, r.number(measure.name)?)));
    pairs.collect()
}
