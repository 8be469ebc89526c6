//! Stopping when a figure is known well enough, at the same run for any number of workers.

use super::stats::{Estimate, mean, rate};
use super::table::events;
use super::{MEASURES, Row, StudyError};
use crate::scenario::draw::{Condition, Template};

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

impl Precision {
    /// What a study asks for.
    pub fn of(template: &Template) -> Result<Option<Self>, StudyError> {
        let Some(when) = &template.settings.stop.when else {
            return Ok(None);
        };
        let event = events(template)?
            .into_iter()
            .find(|(name, _)| *name == when.of);
        let known = MEASURES.iter().any(|m| m.name == when.of);
        let figure = match event {
            Some((_, condition)) => Figure::Rate(condition),
            None if known => Figure::Mean(when.of.clone()),
            None => return Err(StudyError::NoColumn(when.of.clone())),
        };
        Ok(Some(Self {
            figure,
            half_width: when.half_width,
        }))
    }

    /// After how many of these rows, which are in order, the figure is known. Rows are looked at only
    /// as far as none is missing.
    pub fn enough(&self, rows: &[Row]) -> Option<usize> {
        let gap = rows.iter().zip(0u64..).position(|(row, k)| row.index != k);
        let whole = gap.unwrap_or(rows.len());
        let looks = (AT_LEAST..=whole).step_by(EVERY);
        looks.into_iter().find(|n| self.is_known(&rows[..*n]))
    }

    /// Leaves out the rows after that.
    pub fn truncate(&self, rows: &mut Vec<Row>) {
        if let Some(n) = self.enough(rows) {
            rows.truncate(n);
        }
    }

    fn is_known(&self, rows: &[Row]) -> bool {
        let estimate: Option<Estimate> = match &self.figure {
            Figure::Mean(name) => mean(
                &rows
                    .iter()
                    .filter_map(|r| r.number(name))
                    .collect::<Vec<_>>(),
            ),
            Figure::Rate(condition) => {
                let happened: Vec<bool> =
                    rows.iter().filter_map(|r| r.happened(condition)).collect();
                let events = happened.iter().filter(|h| **h).count();
                rate(events as u64, happened.len() as u64).map(|r| r.wilson)
            }
        };
        estimate.is_some_and(|e| 0.5 * (e.high - e.low) <= self.half_width)
    }
}
