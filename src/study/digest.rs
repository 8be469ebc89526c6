//! What the rows of a study come to.

use super::stats::{
    IntervalEstimate, LEAST_WORTH, Rate, Tally, Weighted, bounded_mean, effective_runs,
    first_order, first_order_of_groups, mean_of_lists, rank_correlation, weighted_mean,
    weighted_rate,
};
use super::stop::{Precision, PrecisionCheck};
use super::{MEASURES, Measure, Row, SweptDigest, WorseSide};
use crate::record::parquet::Kind;
use crate::scenario::sampling::{Condition, Distribution, Template};
use serde::Serialize;
use std::collections::BTreeSet;

/// Shares of the runs; of each, the value that it is no worse than is shown.
pub const QUANTILES: [f64; 3] = [0.5, 0.9, 0.95];

/// All figures of a study.
#[derive(Clone, Debug, Serialize)]
pub struct Digest {
    /// Rows there are.
    pub runs: usize,
    /// Of these, complete ones; the rest gives its reasons in the table. Rates of events are over all runs,
    /// means and quantiles over complete ones.
    pub complete: usize,
    /// Where the study ended before all of its runs, because a figure was known well enough.
    pub early: Option<EarlyStop>,
    /// Draws that did not meet the conditions.
    pub rejected: u64,
    /// Kish's effective number of runs, where they are weighted.
    pub effective_runs: Option<f64>,
    /// Events, in the order of their names.
    pub events: Vec<EventDigest>,
    /// Figures that vary, in the order of columns.
    pub figures: Vec<FigureDigest>,
    /// The others.
    pub unvarying: Vec<Unvarying>,
    /// Events and figures again, by the values of each variable that is swept.
    pub swept: Vec<SweptDigest>,
}

/// A figure that is the same in all runs.
#[derive(Clone, Debug, Serialize)]
pub struct Unvarying {
    /// Which.
    pub measure: &'static Measure,
    /// In its unit; a flag is 0 or 1.
    pub value: f64,
}

/// The figure that a study stopped by.
#[derive(Clone, Debug, Serialize)]
pub struct EarlyStop {
    /// Name of the event or figure. Its interval was looked at until it was short enough, and holds the
    /// truth somewhat less often than 95 %.
    pub of: String,
    /// Half the width that was asked for.
    pub half_width: f64,
}

/// An event.
#[derive(Clone, Debug, Serialize)]
pub struct EventDigest {
    /// Its name.
    pub name: String,
    /// Its condition.
    pub condition: String,
    /// Runs, those included of which it is not known whether it happened.
    pub runs: usize,
    /// How often it happened in these; `None` where runs are weighted, and where nothing is known.
    pub rate: Option<Rate>,
    /// The rate of the distributions that were asked for, where runs are weighted.
    pub weighted: Option<Weighted>,
    /// What weighted runs in which it happened must be worth for a rate.
    pub least_worth: f64,
}

/// A figure.
#[derive(Clone, Debug, Serialize)]
pub struct FigureDigest {
    /// Which.
    pub measure: &'static Measure,
    /// How many complete runs have it: its mean and quantiles are over these.
    pub runs: usize,
    /// How many numbers these runs have together: one of each, or all of each one's list.
    pub numbers: usize,
    /// Of these, how many are censored, for what they tell of never came about in the run: as infinite ones they count in
    /// quantiles and for the worst, and are not in the mean.
    pub censored: usize,
    /// Their sum, of a figure that is a count.
    pub sum: Option<f64>,
    /// How many runs have it not, or only of a part of the run.
    pub lacking: usize,
    /// Which of its values are worse.
    pub worse_side: WorseSide,
    /// The worst of all runs, those included that are not complete; `None` where no value is worse.
    pub worst: Option<WorstCase>,
    /// Its mean, of flags the rate.
    pub mean: Option<IntervalEstimate>,
    /// Values that the shares [`QUANTILES`] of the runs are no worse than: sizes, where the figure has a sign;
    /// not above, where no side is worse.
    pub quantiles: [Option<IntervalEstimate>; QUANTILES.len()],
    /// What drives it: each variable with its rank correlation and first-order share. Weighed runs have
    /// no quantiles and drivers: theirs are not those of the distributions that were asked for.
    pub drivers: Vec<Sensitivity>,
}

/// The run in which a figure is worst.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct WorstCase {
    /// The figure.
    pub value: f64,
    /// Which run.
    pub index: u64,
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
        let weighted = template.is_weighted();
        let ln_weights: Vec<f64> = rows.iter().map(|r| r.ln_weight).collect();
        let events = template.events.iter();
        let early = EarlyStop::of(template, rows);
        let rows: &[&Row] = &rows.iter().collect::<Vec<_>>();
        let shown = MEASURES.iter().filter(|m| is_shown(m));
        let unvarying = shown.clone().filter(|m| !varies(m, rows));
        let unvarying = unvarying.filter_map(|measure| {
            let value = rows.iter().find_map(|row| row.number(measure.name))?;
            Some(Unvarying { measure, value })
        });
        Self {
            runs: rows.len(),
            complete: rows.iter().filter(|r| r.is_complete()).count(),
            early,
            rejected: rows.iter().map(|r| u64::from(r.rejected)).sum(),
            effective_runs: weighted.then(|| effective_runs(&ln_weights)),
            events: events
                .map(|(name, condition)| EventDigest::of(template, name, condition, rows))
                .collect(),
            figures: shown
                .filter(|m| varies(m, rows))
                .map(|m| FigureDigest::of(template, m, rows))
                .collect(),
            unvarying: unvarying.collect(),
            swept: SweptDigest::all(template, rows),
        }
    }
}

impl EarlyStop {
    fn of(template: &Template, rows: &[Row]) -> Option<Self> {
        let when = template.settings.stop.when.as_ref()?;
        let check = PrecisionCheck::over(Precision::of(template).ok()??, rows);
        let is_early = check.enough().is_some() && (rows.len() as u64) < template.runs();
        is_early.then(|| Self {
            of: when.of.clone(),
            half_width: when.half_width,
        })
    }
}

impl EventDigest {
    pub(super) fn of(
        template: &Template,
        name: &str,
        condition: &Condition,
        rows: &[&Row],
    ) -> Self {
        let outcomes = || rows.iter().map(|r| (r.ln_weight, r.outcome(condition)));
        // Weights have mean 1 by themselves only if no condition cut draws off.
        let cut_off = !template.settings.require.is_empty();
        let is_weighted = template.is_weighted();
        let weighted = || weighted_rate(&outcomes().collect::<Vec<_>>(), cut_off);
        let rate = || Tally::of(outcomes().map(|o| o.1)).rate();
        Self {
            name: name.to_owned(),
            condition: condition.text().to_owned(),
            runs: rows.len(),
            rate: (!is_weighted).then(rate).flatten(),
            weighted: is_weighted.then(weighted),
            least_worth: LEAST_WORTH,
        }
    }
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

/// Whether a figure has one number a run, and says nothing of the machine.
pub(super) fn is_shown(measure: &Measure) -> bool {
    matches!(measure.kind, Kind::Real | Kind::Int | Kind::Flag) && !measure.is_wall_time()
}

/// Whether runs have a figure, and it is not the same in all of them.
pub(super) fn varies(measure: &Measure, rows: &[&Row]) -> bool {
    let first = rows
        .iter()
        .find_map(|row| row.values_of(measure).first().copied());
    let Some(first) = first else {
        return false;
    };
    let is_same = |x: f64| x.to_bits() == first.to_bits();
    rows.iter().any(|row| {
        let values = row.values_of(measure);
        !row.is_complete() || values.is_empty() || !values.into_iter().all(is_same)
    })
}

impl Row {
    /// All numbers of a figure: one, those of a list, or none.
    fn values_of(&self, measure: &Measure) -> Vec<f64> {
        match measure.kind {
            Kind::Reals => self.numbers(measure.name),
            _ => self.number(measure.name).into_iter().collect(),
        }
    }
}

impl FigureDigest {
    /// With what drives it.
    fn of(template: &Template, measure: &'static Measure, rows: &[&Row]) -> Self {
        let figure = Self::over(template, measure, rows);
        if template.is_weighted() {
            return figure;
        }
        let complete: Vec<&Row> = rows.iter().copied().filter(|r| r.is_complete()).collect();
        let variables = template.settings.variables.keys();
        let drivers = variables.map(|name| Sensitivity::of(template, name, measure, &complete));
        Self {
            drivers: drivers.collect(),
            ..figure
        }
    }

    /// Without what drives it.
    pub(super) fn over(template: &Template, measure: &'static Measure, rows: &[&Row]) -> Self {
        let complete = rows.iter().filter(|r| r.is_complete());
        let known = complete.map(|row| (row.ln_weight, row.values_of(measure)));
        let known: Vec<_> = known.filter(|(_, values)| !values.is_empty()).collect();
        let (ln_weights, lists): (Vec<f64>, Vec<Vec<f64>>) = known.into_iter().unzip();
        let finite: Vec<Vec<f64>> = lists.iter().map(|list| finite_of(list)).collect();
        let numbers = || lists.iter().flatten().copied();
        let count = numbers().count();
        let bare = Self {
            measure,
            runs: lists.len(),
            numbers: count,
            censored: count - finite.iter().flatten().count(),
            sum: (measure.kind == Kind::Int).then(|| numbers().sum()),
            lacking: rows.len() - lists.len(),
            worse_side: measure.worse_side(),
            worst: WorstCase::of(measure, rows),
            mean: None,
            quantiles: [None; QUANTILES.len()],
            drivers: Vec::new(),
        };
        if template.is_weighted() {
            // The numbers of a list share their run's weight: they are worth fewer than they are.
            let is_list = measure.kind == Kind::Reals;
            let weighted = ln_weights.iter().zip(&finite);
            let weighted = weighted.filter_map(|(ln, values)| Some((*ln, *values.first()?)));
            let weighted: Vec<(f64, f64)> = weighted.collect();
            let mean = weighted_mean(&weighted, measure.range()).filter(|_| !is_list);
            return Self { mean, ..bare };
        }
        let is_flag = measure.kind == Kind::Flag;
        Self {
            mean: measure.mean_of_runs(&finite),
            quantiles: QUANTILES.map(|p| measure.quantile(&lists, p).filter(|_| !is_flag)),
            ..bare
        }
    }
}

/// Those numbers that are not censored.
fn finite_of(numbers: &[f64]) -> Vec<f64> {
    let finite = numbers.iter().copied().filter(|x| x.is_finite());
    finite.collect()
}

impl WorstCase {
    fn of(measure: &Measure, rows: &[&Row]) -> Option<Self> {
        let values = |row: &&Row| {
            let index = row.index;
            let values = row.values_of(measure).into_iter();
            values.map(move |value| Self { value, index })
        };
        let cases = rows.iter().flat_map(values);
        let known = cases.filter_map(|case| Some((measure.badness(case.value)?, case)));
        // The first of several that are equal.
        let worst = known.reduce(|worst, case| if case.0 > worst.0 { case } else { worst });
        worst.map(|(_, case)| case)
    }
}

impl Measure {
    /// The mean of its values in runs, of a flag the rate.
    pub fn mean(&self, values: &[f64]) -> Option<IntervalEstimate> {
        if self.kind == Kind::Flag {
            return Tally::of(values.iter().map(|x| Some(*x > 0.5)))
                .rate()
                .map(|r| r.wilson);
        }
        bounded_mean(values, self.range())
    }

    /// The mean of all numbers that runs have; the interval is by runs.
    fn mean_of_runs(&self, runs: &[Vec<f64>]) -> Option<IntervalEstimate> {
        match self.kind {
            Kind::Reals => mean_of_lists(runs, self.range()),
            _ => self.mean(&runs.concat()),
        }
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
            && rows
                .iter()
                .all(|r| r.number(measure.name).is_some_and(f64::is_finite));
        let share = || {
            if pairs.is_empty() {
                let named = rows.iter().filter_map(|r| {
                    Some((r.values.get(name)?.to_string(), r.number(measure.name)?))
                });
                first_order_of_groups(&named.collect::<Vec<_>>())
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
