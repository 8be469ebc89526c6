//! TOML into a typed struct, with every wrong key named, and keys found again in the text.
//!
//! serde stops at the first thing it dislikes. Here the offending entry is taken out of the
//! document and the rest is tried again, so that a user sees all wrong keys at once.

use super::problem::{FileError, Problem, key_below};
use serde::de::DeserializeOwned;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Reads a file's text into its as-written form.
///
/// ```
/// #[derive(Debug, serde::Deserialize)]
/// #[serde(deny_unknown_fields)]
/// struct Lamps {
///     #[allow(dead_code, reason = "only its name matters here")]
///     spacing_m: f64,
/// }
///
/// let error = metrotwin::settings::read_toml::<Lamps>("spacing_mm = 10000.0").unwrap_err();
/// assert!(error.to_string().contains("did you mean `spacing_m`"));
/// ```
pub fn read_toml<T: DeserializeOwned>(text: &str) -> Result<T, FileError> {
    let mut document = DeTable::parse(text).map_err(|e| FileError::Syntax {
        message: e.message().to_owned(),
        span: e.span(),
    })?;
    let mut problems: Vec<Problem> = Vec::new();
    // Each turn takes one entry out of the document, so this ends.
    loop {
        let error = match T::deserialize(toml::Deserializer::from(document.clone())) {
            Ok(_) if !problems.is_empty() => return Err(FileError::Problems(problems)),
            Ok(value) => return Ok(value),
            Err(error) => error,
        };
        let wrong = Wrong::read(error.message());
        let entries = entries(document.get_ref());
        let culprit = wrong.culprit(&entries, error.span());
        let missing_only_because_removed = matches!(&wrong, Wrong::MissingKey { key }
            if problems.iter().any(|p| last_key(&p.key) == key));
        if !missing_only_because_removed {
            let key = match culprit {
                Some(entry) => entry.path.clone(),
                None => wrong.key(&entries, error.span()),
            };
            problems.push(wrong.problem(key));
        }
        let Some(key) = culprit.and_then(|entry| entry.key.as_ref()) else {
            return Err(FileError::Problems(problems));
        };
        take_out(document.get_mut(), key);
    }
}

/// Where a dotted key (`lamps.spacing_m`, `obstacles[2].mass_kg`) stands in a text: its value, or
/// the nearest table around it where it is not written. `None` only for text that is not TOML.
pub fn locate(text: &str, dotted_key: &str) -> Option<Range<usize>> {
    let document = DeTable::parse(text).ok()?;
    let leads_there = |entry: &Entry| {
        let rest = dotted_key.strip_prefix(&entry.path);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
    };
    let entries = entries(document.get_ref());
    let nearest = innermost(&entries, leads_there);
    Some(nearest.map_or(document.span(), |entry| entry.shown.clone()))
}

/// A key of a document with its value, or an element of a list.
struct Entry {
    /// Dotted, as `obstacles[2].mass_kg`.
    path: String,
    /// Where the key is written; an element has none.
    key: Option<Range<usize>>,
    value: Range<usize>,
    /// The value as messages quote it; a table or list has none.
    text: Option<String>,
    /// What to show of it. A table's own span is its header only when it has one, its key is always
    /// there.
    shown: Range<usize>,
}

impl Entry {
    /// At a path, with the span of its key.
    fn new(path: String, key: Option<Range<usize>>, value: &Spanned<DeValue<'_>>) -> Self {
        let table_key = key.clone().filter(|_| value.get_ref().is_table());
        Self {
            path,
            key,
            value: value.span(),
            text: quotable(value.get_ref()),
            shown: table_key.unwrap_or(value.span()),
        }
    }

    fn is_below(&self, table: &Self) -> bool {
        let rest = self.path.strip_prefix(&table.path);
        rest.is_some_and(|rest| rest.starts_with(['.', '[']))
    }
}

fn quotable(value: &DeValue<'_>) -> Option<String> {
    Some(match value {
        DeValue::String(text) => text.to_string(),
        DeValue::Integer(number) => number.to_string(),
        DeValue::Float(number) => number.to_string(),
        DeValue::Boolean(value) => value.to_string(),
        _ => return None,
    })
}

/// All entries of a table, each before those inside it.
fn entries(table: &DeTable<'_>) -> Vec<Entry> {
    let mut found = Vec::new();
    collect_table(table, "", &mut found);
    found
}

fn collect_table(table: &DeTable<'_>, path: &str, found: &mut Vec<Entry>) {
    for (key, value) in table {
        let path = key_below(path, key.get_ref());
        found.push(Entry::new(path.clone(), Some(key.span()), value));
        collect_value(value.get_ref(), &path, found);
    }
}

fn collect_value(value: &DeValue<'_>, path: &str, found: &mut Vec<Entry>) {
    match value {
        DeValue::Table(table) => collect_table(table, path, found),
        DeValue::Array(array) => {
            for (k, element) in array.iter().enumerate() {
                let path = format!("{path}[{k}]");
                found.push(Entry::new(path.clone(), None, element));
                collect_value(element.get_ref(), &path, found);
            }
        }
        _ => {}
    }
}

/// The innermost entry that fits.
fn innermost(entries: &[Entry], fits: impl Fn(&Entry) -> bool) -> Option<&Entry> {
    let fitting = entries.iter().filter(|entry| fits(entry));
    fitting.max_by_key(|entry| entry.path.len())
}

/// Takes the entry out whose key has a span.
fn take_out(table: &mut DeTable<'_>, key: &Range<usize>) {
    let found = table.keys().find(|other| other.span() == *key).cloned();
    if let Some(found) = found {
        table.remove(&found);
    }
    for (_, value) in table.iter_mut() {
        take_out_of_value(value.get_mut(), key);
    }
}

fn take_out_of_value(value: &mut DeValue<'_>, key: &Range<usize>) {
    match value {
        DeValue::Table(table) => take_out(table, key),
        DeValue::Array(array) => array
            .iter_mut()
            .for_each(|element| take_out_of_value(element.get_mut(), key)),
        _ => {}
    }
}

/// What serde found wrong, read from its message (it gives no other form).
enum Wrong {
    UnknownKey { key: String, known: Vec<String> },
    MissingKey { key: String },
    Value { message: String },
}

impl Wrong {
    fn read(message: &str) -> Self {
        let mut quoted = quoted(message);
        if message.starts_with("unknown field") {
            Self::UnknownKey {
                key: quoted.next().unwrap_or_default(),
                known: quoted.collect(),
            }
        } else if message.starts_with("missing field") {
            Self::MissingKey {
                key: quoted.next().unwrap_or_default(),
            }
        } else {
            Self::Value {
                message: message.to_owned(),
            }
        }
    }

    /// The entry that an error with a span is about, if it can be taken out.
    ///
    /// Spans are exact, unless an enum was read through a buffer: then they are those of the table
    /// around, and the outermost such key, or the first value that the message quotes, below it is the
    /// one.
    fn culprit<'e>(&self, entries: &'e [Entry], span: Option<Range<usize>>) -> Option<&'e Entry> {
        let span = span?;
        let keys = || entries.iter().filter(|entry| entry.key.is_some());
        let around = innermost(entries, |entry| entry.value == span);
        let below = || keys().filter(|entry| around.is_some_and(|around| entry.is_below(around)));
        match self {
            Self::MissingKey { .. } => None,
            Self::UnknownKey { key, .. } => {
                let exact = keys().find(|entry| entry.key.as_ref() == Some(&span));
                let named = below().filter(|entry| last_key(&entry.path) == key);
                exact.or_else(|| named.min_by_key(|entry| entry.path.len()))
            }
            Self::Value { message } => {
                let what = message.split(", expected ").next().unwrap_or_default();
                let is_quoted = |text: &String| {
                    what.contains(&format!("`{text}`")) || what.contains(&format!("\"{text}\""))
                };
                let exact = keys().find(|entry| entry.value == span);
                exact.or_else(|| below().find(|entry| entry.text.as_ref().is_some_and(is_quoted)))
            }
        }
    }

    /// Dotted key of an error with a span about an entry that cannot be taken out.
    fn key(&self, entries: &[Entry], span: Option<Range<usize>>) -> String {
        let span = span.unwrap_or_default();
        let around = |own: &Range<usize>| own.start <= span.start && span.end <= own.end;
        match self {
            Self::MissingKey { key } => {
                let table = innermost(entries, |entry| entry.value == span);
                key_below(table.map_or("", |table| &table.path), key)
            }
            _ => innermost(entries, |entry| around(&entry.value))
                .map_or_else(String::new, |entry| entry.path.clone()),
        }
    }

    fn problem(&self, key: String) -> Problem {
        match self {
            Self::UnknownKey { key: name, known } => Problem::new(
                key,
                format!("there is no key `{name}` here"),
                name_advice(name, known, "keys that may stand here", "take it out"),
            ),
            Self::MissingKey { .. } => Problem::new(key, "is missing", "give it a value"),
            Self::Value { message } => value_problem(key, message),
        }
    }
}

/// What stands between backquotes.
fn quoted(message: &str) -> impl Iterator<Item = String> {
    message.split('`').skip(1).step_by(2).map(str::to_owned)
}

/// "invalid type: string "x", expected f64" and its like, split at the comma.
fn value_problem(key: String, message: &str) -> Problem {
    let (what, expected) = message.split_once(", expected ").unwrap_or((message, ""));
    let allowed: Vec<String> = quoted(expected).collect();
    let wrong = quoted(what).next().unwrap_or_default();
    let similar = did_you_mean(&wrong, &allowed);
    let remedy = match (similar, expected) {
        (Some(similar), _) => format!("did you mean `{similar}`?"),
        (None, "") => "correct it".to_owned(),
        (None, "f64") => "give a number".to_owned(),
        (None, expected) => format!("expected {expected}"),
    };
    Problem::new(key, what, remedy)
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

fn last_key(dotted: &str) -> &str {
    dotted.rsplit('.').next().unwrap_or(dotted)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]
#[allow(dead_code, reason = "what is read matters, not what is done with it")]
mod tests;
