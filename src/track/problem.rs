//! What is wrong with a file, in terms of its own keys.

use std::fmt;
use std::ops::{Range, RangeInclusive};
use std::path::PathBuf;

/// One wrong value: where, what, and what would be right.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Dotted path of the key, as in the file: `lamps.spacing_m`, `obstacles[2].mass_kg`.
    /// [`locate`](super::locate) finds it in the text.
    pub key: String,
    /// What is wrong, with the numbers and their units.
    pub what: String,
    /// What would be right.
    pub remedy: String,
}

impl Problem {
    /// A problem at `key`.
    pub fn new(key: impl Into<String>, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            key: key.into(),
            what: what.into(),
            remedy: remedy.into(),
        }
    }

    /// Adds a problem unless a number lies in a range (a number that is none never does).
    pub fn unless_within(
        problems: &mut Vec<Self>,
        key: impl Into<String>,
        value: f64,
        range: RangeInclusive<f64>,
        unit: &str,
    ) {
        if !range.contains(&value) {
            let space = if unit.is_empty() { "" } else { " " };
            let (low, high) = range.into_inner();
            problems.push(Self::new(
                key,
                format!("{value}{space}{unit} is out of range"),
                format!("give {low} to {high}{space}{unit}"),
            ));
        }
    }
}

/// Dotted key of `key` below `at`, which is empty for the whole file.
pub fn key_below(at: &str, key: &str) -> String {
    if at.is_empty() {
        key.to_owned()
    } else {
        format!("{at}.{key}")
    }
}

/// Checks the numbers of one part of a file.
///
/// ```
/// use metrotwin::track::Checker;
///
/// let mut problems = Vec::new();
/// let mut check = Checker::new("train", &mut problems);
/// check.within("cars", 0.0, 1.0..=6.0, "cars");
/// assert_eq!(problems[0].to_string(), "train.cars: 0 cars is out of range; give 1 to 6 cars");
/// ```
#[derive(Debug)]
pub struct Checker<'a> {
    at: &'a str,
    problems: &'a mut Vec<Problem>,
}

impl<'a> Checker<'a> {
    /// Of what stands under the dotted key `at`; adds to `problems`.
    pub fn new(at: &'a str, problems: &'a mut Vec<Problem>) -> Self {
        Self { at, problems }
    }

    /// As [`Problem::unless_within`].
    pub fn within(&mut self, key: &str, value: f64, range: RangeInclusive<f64>, unit: &str) {
        let key = key_below(self.at, key);
        Problem::unless_within(self.problems, key, value, range, unit);
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}; {}", self.key, self.what, self.remedy)
    }
}

/// Why a tunnel or scenario file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// It cannot be read at all.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// It is not TOML.
    #[error("not TOML: {message}")]
    Syntax {
        /// What the parser says.
        message: String,
        /// Where, in bytes.
        span: Option<Range<usize>>,
    },
    /// Its values are wrong: all of them, in the order found.
    #[error("{}", lines(.0))]
    Problems(Vec<Problem>),
}

fn lines(problems: &[Problem]) -> String {
    let lines: Vec<String> = problems.iter().map(Problem::to_string).collect();
    lines.join("\n")
}
