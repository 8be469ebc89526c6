//! What is wrong with a file, in terms of its own keys.

use super::unit::of_key;
use super::{Numbers, Settings};
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
    /// A problem at `key`, which is empty for the whole file. What is wrong may quote a file, whose
    /// values may have any length: it is cut.
    pub fn new(key: impl Into<String>, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            key: key.into(),
            what: shortened(&what.into(), LONGEST_TEXT),
            remedy: shortened(&remedy.into(), LONGEST_TEXT),
        }
    }

    /// A number is out of its range: nothing else can be the reason.
    pub(super) fn is_of_range(&self) -> bool {
        self.what.ends_with(OUT_OF_RANGE)
    }

    /// Key and what is wrong with it, for people.
    pub fn said(&self) -> String {
        match self.key.as_str() {
            "" => self.what.clone(),
            key => format!("{}: {}", shortened(key, LONGEST_KEY), self.what),
        }
    }
}

const OUT_OF_RANGE: &str = "is out of range";
/// Letters that are shown of what is wrong, and of what would be right.
const LONGEST_TEXT: usize = 1000;
/// Letters that are shown of a key.
pub const LONGEST_KEY: usize = 120;

/// A text of a file for a message: its first letters, and none that would steer a terminal.
pub fn shortened(text: &str, most: usize) -> String {
    let shown = |c: char| if c.is_control() && c != '\n' { '?' } else { c };
    let mut short: String = text.chars().take(most).map(shown).collect();
    if short.len() < text.len() && text.chars().nth(most).is_some() {
        short += " ...";
    }
    short
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; {}", self.said(), self.remedy)
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

/// What a dotted key has behind another one: nothing where it is that one; `None` where it does not lie
/// below it.
pub(super) fn rest_within<'k>(key: &'k str, other: &str) -> Option<&'k str> {
    let rest = key.strip_prefix(other)?;
    (rest.is_empty() || rest.starts_with(['.', '['])).then_some(rest)
}

/// Whether a dotted key is another one or lies below it.
pub fn is_within(key: &str, other: &str) -> bool {
    rest_within(key, other).is_some()
}

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

    /// Nothing is wrong at or below one of its keys.
    pub fn is_right(&self, key: &str) -> bool {
        let at = self.key(key);
        !self.problems.iter().any(|p| is_within(&p.key, &at))
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
    #[error("{}", lines(.0, true))]
    Problems(Vec<Problem>),
    /// Its values are wrong: those found first, before the search for more took too long.
    #[error("{}", lines(.0, false))]
    FirstProblems(Vec<Problem>),
}

/// Problems that are kept of a file.
pub const MOST_PROBLEMS: usize = 1000;
/// Problems that are shown of a file.
const MOST_SHOWN: usize = 20;

/// The problems of a file that are shown, and what is said of the others; `are_all` where the file has no
/// more than these.
pub fn shown(problems: &[Problem], are_all: bool) -> (&[Problem], Option<String>) {
    let shown = problems.get(..MOST_SHOWN).unwrap_or(problems);
    let rest = match (
        problems.len() - shown.len(),
        are_all && problems.len() < MOST_PROBLEMS,
    ) {
        (0, true) => None,
        (0, false) => Some("there may be more problems".to_owned()),
        (more, true) => Some(format!("{more} more problems are not shown")),
        (more, false) => Some(format!("at least {more} more problems are not shown")),
    };
    (shown, rest)
}

fn lines(problems: &[Problem], are_all: bool) -> String {
    let (shown, rest) = shown(problems, are_all);
    let lines = shown.iter().map(Problem::to_string).chain(rest);
    lines.collect::<Vec<String>>().join("\n")
}
