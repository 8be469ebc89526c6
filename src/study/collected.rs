//! The rows of a study while they come, in any order, and whether they are enough.
//!
//! What a row costs does not depend on how many there are: rows without a gap before them are moved to
//! the end of a list, and those that came too early wait in a map.

use super::Row;
use super::stop::{Precision, PrecisionCheck};
use std::collections::BTreeMap;

/// Rows by index, each once.
#[derive(Debug, Default)]
pub struct CollectedRows {
    /// Runs 0, 1, ... without a gap.
    in_order: Vec<Row>,
    /// Those behind the first gap.
    ahead: BTreeMap<u64, Row>,
    incomplete: u64,
    check: Option<PrecisionCheck>,
}

impl CollectedRows {
    /// None yet; looked at for a precision, where a study stops by one.
    pub fn new(precision: Option<Precision>) -> Self {
        Self {
            check: precision.map(PrecisionCheck::new),
            ..Self::default()
        }
    }

    /// Takes a row of a run that has none yet.
    pub fn add(&mut self, row: Row) {
        self.incomplete += u64::from(!row.is_complete());
        self.ahead.insert(row.index, row);
        let next = |rows: &Self| rows.in_order.len() as u64;
        while let Some(row) = self.ahead.remove(&next(self)) {
            if let Some(check) = &mut self.check {
                check.add(&row);
            }
            self.in_order.push(row);
        }
    }

    /// How many.
    pub fn len(&self) -> u64 {
        (self.in_order.len() + self.ahead.len()) as u64
    }

    /// How many are not complete.
    pub fn incomplete(&self) -> u64 {
        self.incomplete
    }

    /// Whether the figure that the study stops by is known.
    pub fn are_enough(&self) -> bool {
        self.check
            .as_ref()
            .is_some_and(|check| check.enough().is_some())
    }

    /// All of them, in order.
    pub fn iter(&self) -> impl Iterator<Item = &Row> {
        self.in_order.iter().chain(self.ahead.values())
    }

    /// In order, up to where the study stops.
    pub fn into_rows(self) -> Vec<Row> {
        let enough = self.check.as_ref().and_then(PrecisionCheck::enough);
        let rows = self.in_order.into_iter().chain(self.ahead.into_values());
        rows.take(enough.unwrap_or(usize::MAX)).collect()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::scenario::sampling::{PrecisionSettings, ScenarioSample, Template};
    use crate::study::Status;
    use std::path::Path;

    fn row(index: u64, most_slip_mps: f64) -> Row {
        let sample = ScenarioSample {
            index,
            ..ScenarioSample::default()
        };
        let mut row = Row::without_figures(&sample, Status::Complete, String::new());
        (row.figures).insert("most_slip_mps".into(), most_slip_mps.into());
        row
    }

    /// Stops when the rate of the event `slipped` of the small study is known.
    fn precision(half_width: f64) -> Precision {
        let mut template = Template::load(Path::new("tests/studies/small.toml")).unwrap();
        let of = "slipped".to_owned();
        template.settings.stop.when = Some(PrecisionSettings { of, half_width });
        Precision::of(&template).unwrap().unwrap()
    }

    /// As four workers bring them: never in order.
    fn mixed(rows: u64) -> impl Iterator<Item = Row> {
        (0..rows).map(|k| row(k ^ 3, if (k ^ 3) % 7 == 0 { 1.0 } else { 0.0 }))
    }

    /// A row that sorts or looks at all rows before it: 100,000 of them then take minutes, not a second.
    #[test]
    #[allow(
        clippy::disallowed_methods,
        reason = "the limit is a hundred times what it takes"
    )]
    fn a_row_costs_the_same_however_many_there_are() {
        let begin = std::time::Instant::now();
        let mut rows = CollectedRows::new(Some(precision(1e-6)));
        for row in mixed(100_000) {
            rows.add(row);
            assert!(!rows.are_enough() && rows.incomplete() == 0);
        }
        assert_eq!(rows.len(), 100_000);
        let took_s = begin.elapsed().as_secs_f64();
        assert!(took_s < 30.0, "{took_s} s");
        assert!(rows.iter().zip(0..).all(|(row, k)| row.index == k));
    }

    /// The same rows in whatever order they come, and those that are read from the folder later.
    #[test]
    fn a_study_stops_at_one_row_in_any_order() {
        let mut rows = CollectedRows::new(Some(precision(0.05)));
        mixed(1000).for_each(|row| rows.add(row));
        assert!(rows.are_enough());
        let rows = rows.into_rows();
        let mut again: Vec<Row> = mixed(1000).collect();
        again.sort_by_key(|row| row.index);
        precision(0.05).truncate(&mut again);
        assert!(rows.len() > 30 && rows.len() < 1000 && rows.len().is_multiple_of(10));
        assert_eq!(rows, again);
    }
}
