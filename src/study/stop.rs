//! Stopping when a figure is known well enough, at the same run for any number of workers.
//!
//! An interval that was checked at again and again until it was short holds the truth somewhat less often
//! than it says, the more so the skewer the figure is.

use super::digest::is_weighted;
use super::stats::{IntervalEstimate, mean, rate};
use super::table::meant;
use super::{Measure, Result, Row, StudyError, measure};
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
    Mean(String),
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
        if is_weighted(template) {
            return Err(StudyError::Unusable(
                "study.stop.when does not go with `propose`: weighted figures have other intervals; leave \
                 one of them out"
                    .into(),
            ));
        }
        let figure = match template.events.get(&when.of) {
            Some(condition) => Figure::Rate(condition.clone()),
            None if measure(&when.of).is_some_and(can_be_known) => Figure::Mean(when.of.clone()),
            None => {
                let name = &when.of;
                let what =
                    format!("`{name}` is no event of this study and no single figure of a run");
                let key = "study.stop.when.of";
                return Err(template
                    .wrong(Problem::new(key, what, meant(name, template)))
                    .into());
            }
        };
        Ok(Some(Self {
            figure,
            half_width: when.half_width,
        }))
    }

    /// After how many of these rows, which are in order, the figure is known. Rows are looked at only
    /// as far as none is missing. `checked` is how far earlier looks came, and found nothing.
    pub fn enough(&self, rows: &[Row], checked: &mut usize) -> Option<usize> {
        let gap = rows.iter().zip(0u64..).position(|(row, k)| row.index != k);
        let whole = gap.unwrap_or(rows.len());
        let looks = (AT_LEAST..=whole).step_by(EVERY).filter(|n| *n > *checked);
        let found = looks.into_iter().find(|n| self.is_known(&rows[..*n]));
        *checked = whole;
        found
    }

    /// Leaves out the rows after that.
    pub fn truncate(&self, rows: &mut Vec<Row>) {
        if let Some(n) = self.enough(rows, &mut 0) {
            rows.truncate(n);
        }
    }

    fn is_known(&self, rows: &[Row]) -> bool {
        let rows = || rows.iter().filter(|r| r.is_complete());
        let estimate: Option<IntervalEstimate> = match &self.figure {
            Figure::Mean(name) => mean(&rows().filter_map(|r| r.number(name)).collect::<Vec<_>>()),
            Figure::Rate(condition) => {
                let happened: Vec<bool> = rows().filter_map(|r| r.happened(condition)).collect();
                let events = happened.iter().filter(|h| **h).count();
                rate(events as u64, happened.len() as u64).map(|r| r.wilson)
            }
        };
        // A figure that has not varied yet is not known at all.
        let known =
            |e: IntervalEstimate| e.high > e.low && 0.5 * (e.high - e.low) <= self.half_width;
        estimate.is_some_and(known)
    }
}
