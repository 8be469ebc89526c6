//! What is wrong with a file, in terms of its own keys.

use std::fmt;
use std::ops::Range;
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

    /// Its key is not there.
    pub fn is_missing(&self) -> bool {
        self.what == MISSING
    }

    /// Key and what is wrong with it, for people.
    pub fn said(&self) -> String {
        match self.key.as_str() {
            "" => self.what.clone(),
            key => format!("{}: {}", shortened(key, LONGEST_KEY), self.what),
        }
    }

    /// As [`said`](Self::said), with the name of what the key belongs to.
    pub fn said_of(&self, name: &str) -> String {
        let [key, name] = [&self.key, name].map(|text| shortened(text, LONGEST_KEY));
        format!("{key} (`{name}`): {}", self.what)
    }
}

pub(super) const MISSING: &str = "is missing";
pub(super) const OUT_OF_RANGE: &str = "is out of range";
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

/// The known key that a wrong one was most likely meant to be: the same stem with another unit,
/// else the nearest by edit distance if that is near.
pub fn did_you_mean<'k>(wrong: &str, known: &'k [String]) -> Option<&'k str> {
    let stem = |key: &str| key.rsplit_once('_').map(|(stem, _)| stem.to_owned());
    let same_stem = known.iter().find(|k| {
        k.as_str() == wrong
            || stem(k).is_some_and(|s| Some(&s) == stem(wrong).as_ref() || s == wrong)
    });
    same_stem
        .or_else(|| {
            known
                .iter()
                .map(|k| (strsim::levenshtein(wrong, k), k))
                .filter(|(distance, k)| *distance <= 1 + k.len().min(wrong.len()) / 4)
                .min_by_key(|(distance, _)| *distance)
                .map(|(_, k)| k)
        })
        .map(String::as_str)
}

/// What would be right in place of a wrong name: the known one that it was most likely meant to be,
/// else all known ones under a heading, or other advice where there is none.
pub fn name_advice(wrong: &str, known: &[String], heading: &str, without_any: &str) -> String {
    match did_you_mean(wrong, known) {
        Some(similar) => format!("did you mean `{similar}`?"),
        None if known.is_empty() => without_any.to_owned(),
        None => format!("{heading}: {}", known.join(", ")),
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
    /// Its values are wrong: those found before the search for more took too long, or could not go on.
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
