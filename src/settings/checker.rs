//! Checks of one part of a file, each problem with its key.

use super::problem::{MOST_PROBLEMS, OUT_OF_RANGE, Problem, is_within, key_below};
use super::unit::of_key;
use super::{Numbers, Settings};
use std::ops::RangeInclusive;

/// Checks one part of a file.
///
/// ```
/// use metrotwin::settings::Checker;
///
/// let mut problems = Vec::new();
/// let mut check = Checker::new("train", &mut problems);
/// check.within("start_s", -1.0, 0.0..=60.0);
/// assert_eq!(problems[0].to_string(), "train.start_s: -1 s is out of range; give 0 to 60 s");
/// ```
#[derive(Debug)]
pub struct Checker<'a> {
    at: String,
    problems: &'a mut Vec<Problem>,
}

impl<'a> Checker<'a> {
    /// Of what stands under the dotted key `at`; adds to `problems`.
    pub fn new(at: &str, problems: &'a mut Vec<Problem>) -> Self {
        Self {
            at: at.to_owned(),
            problems,
        }
    }

    /// Dotted key of one of its keys.
    pub fn key(&self, key: &str) -> String {
        key_below(&self.at, key)
    }

    /// Adds a problem, unless the key has one already: a second may only follow from the first. Of a
    /// file with very many only the first `MOST_PROBLEMS` are kept.
    pub fn problem(&mut self, key: &str, what: impl Into<String>, remedy: impl Into<String>) {
        let key = self.key(key);
        let is_full = self.problems.len() >= MOST_PROBLEMS;
        if !is_full && self.problems.iter().all(|p| p.key != key) {
            self.problems.push(Problem::new(key, what, remedy));
        }
    }

    /// Adds problems that were found apart, with their whole keys.
    pub fn add(&mut self, found: Vec<Problem>) {
        let mut whole = Checker::new("", self.problems);
        for Problem { key, what, remedy } in found {
            whole.problem(&key, what, remedy);
        }
    }

    /// Adds a problem unless all numbers under a key lie in a range (one that is no number never
    /// does).
    pub fn within(&mut self, key: &str, numbers: impl Numbers, range: RangeInclusive<f64>) {
        let Some(value) = numbers.first_outside(&range) else {
            return;
        };
        let (low, high) = range.into_inner();
        let unit = of_key(key);
        let space = if unit.is_empty() { "" } else { " " };
        self.problem(
            key,
            format!("{value}{space}{unit} {OUT_OF_RANGE}"),
            match (low.is_finite(), high.is_finite()) {
                (true, false) => format!("give at least {low}{space}{unit}"),
                (false, true) => format!("give at most {high}{space}{unit}"),
                _ => format!("give {low} to {high}{space}{unit}"),
            },
        );
    }

    /// Nothing is wrong at or below one of its keys; in the whole file, if that is empty.
    pub fn is_right(&self, key: &str) -> bool {
        let at = self.key(key);
        let within = |p: &Problem| at.is_empty() || is_within(&p.key, &at);
        !self.problems.iter().any(within)
    }

    /// A checker of what stands below one of its keys.
    pub fn below(&mut self, key: &str) -> Checker<'_> {
        Checker::new(&self.key(key), self.problems)
    }

    /// Adds what the settings under a key find wrong with themselves.
    pub fn nested(&mut self, key: &str, settings: &impl Settings) {
        settings.check(&self.key(key), self.problems);
    }
}
