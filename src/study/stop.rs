//! Stopping when a figure is known well enough, at the same run for any number of workers.
//!
//! An interval that was looked at again and again until it was short holds the truth somewhat less often
//! than it says, the more so the skewer the figure is: reports mark it.

use super::stats::{IntervalEstimate, Moments, Tally};
use super::table::meant;
use super::{Measure, Result, Row, measure};
use crate::record::parquet::Kind;
use crate::scenario::sampling::{Condition, Template};
use crate::settings::Problem;

/// Runs between two looks.
const EVERY: usize = 10;
/// Runs before the first look.
const AT_LEAST: usize = 30;

/// A figure and how well it is to be known.
#[derive(Clone, Debug)]
pub struct Precision {
    figure: Figure,
    half_width: f64,
}

#[derive(Clone, Debug)]
enum Figure {
    Mean(&'static Measure),
    Rate(Condition),
}

/// Wall times differ from run to run, and lists have no mean.
fn can_be_known(measure: &Measure) -> bool {
    measure.kind != Kind::Reals && !measure.is_wall_time()
}

impl Precision {
    /// What a study asks for.
    pub fn of(template: &Template) -> Result<Option<Self>> {
        let Some(when) = &template.settings.stop.when else {
            return Ok(None);
        };
        if template.is_weighted() {
            let what = "does not go with `propose`: weighted figures have other intervals";
            let problem = Problem::new("study.stop.when", what, "leave one of them out");
            return Err(template.wrong(problem).into());
        }
        let known = || measure(&when.of).filter(|m| can_be_known(m));
        let figure = match template.events.get(&when.of) {
            Some(condition) => Some(Figure::Rate(condition.clone())),
            None => known().map(Figure::Mean),
        };
        let figure = figure.ok_or_else(|| {
            let name = &when.of;
            let what = format!("`{name}` is no event of this study and no single figure of a run");
            let key = "study.stop.when.of";
            template.wrong(Problem::new(key, what, meant(name, template)))
        })?;
        Ok(Some(Self {
            figure,
            half_width: when.half_width,
        }))
    }

    /// Leaves out the rows, which are in order, after the one at which the figure is known.
    pub fn truncate(self, rows: &mut Vec<Row>) {
        let enough = PrecisionCheck::over(self, rows).enough();
        rows.truncate(enough.unwrap_or(usize::MAX));
    }
}

/// Whether the figure is known, from the rows of a study one by one, from run 0 on without a gap.
#[derive(Debug)]
pub struct PrecisionCheck {
    precision: Precision,
    rows: usize,
    tally: Tally,
    moments: Moments,
    enough: Option<usize>,
}

impl PrecisionCheck {
    /// Before the first row.
    pub fn new(precision: Precision) -> Self {
        Self {
            precision,
            rows: 0,
            tally: Tally::default(),
            moments: Moments::default(),
            enough: None,
        }
    }

    /// Over rows in order, as far as none is missing.
    pub fn over(precision: Precision, rows: &[Row]) -> Self {
        let mut check = Self::new(precision);
        let whole = rows.iter().zip(0u64..);
        let whole = whole.take_while(|(row, k)| row.index == *k);
        whole.for_each(|(row, _)| check.add(row));
        check
    }

    /// Takes the next row.
    pub fn add(&mut self, row: &Row) {
        self.rows += 1;
        match &self.precision.figure {
            Figure::Mean(measure) => {
                let x = row.number(measure.name).filter(|x| x.is_finite());
                if let Some(x) = x.filter(|_| row.is_complete()) {
                    self.moments.add(x);
                }
            }
            Figure::Rate(condition) => self.tally.add(row.outcome(condition)),
        }
        let is_time = self.rows >= AT_LEAST && (self.rows - AT_LEAST).is_multiple_of(EVERY);
        if is_time && self.enough.is_none() && self.is_known() {
            self.enough = Some(self.rows);
        }
    }

    /// After how many rows the figure was known.
    pub fn enough(&self) -> Option<usize> {
        self.enough
    }

    fn is_known(&self) -> bool {
        let estimate = match self.precision.figure {
            Figure::Mean(measure) => self.moments.mean(measure.range()),
            Figure::Rate(_) => self.tally.rate().map(|r| r.wilson),
        };
        // A figure that has not varied yet is not known at all.
        let known = |e: IntervalEstimate| {
            e.high > e.low && 0.5 * (e.high - e.low) <= self.precision.half_width
        };
        estimate.is_some_and(known)
    }
}
