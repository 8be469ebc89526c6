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
        let removed = remove_wrong(document.get_mut(), &wrong, error.span());
        let missing_only_because_removed = matches!(&wrong, Wrong::MissingKey { key }
            if problems.iter().any(|p| last_key(&p.key) == key));
        if !missing_only_because_removed {
            let key = match (&removed, &wrong) {
                (Some(key), _) => key.clone(),
                (None, Wrong::MissingKey { key }) => {
                    key_below(&table_path(document.get_ref(), error.span()), key)
                }
                (None, _) => key_at(document.get_ref(), error.span()),
            };
            problems.push(wrong.problem(key));
        }
        if removed.is_none() {
            return Err(FileError::Problems(problems));
        }
    }
}

/// Where a dotted key (`lamps.spacing_m`, `obstacles[2].mass_kg`) stands in a text: its value, or
/// the nearest table around it where it is not written. `None` only for text that is not TOML.
pub fn locate(text: &str, dotted_key: &str) -> Option<Range<usize>> {
    let document = DeTable::parse(text).ok()?;
    let mut best = document.span();
    let mut table = Some(document.get_ref());
    let mut parts = dotted_key.split('.');
    while let (Some(current), Some(part)) = (table, parts.next()) {
        let mut pieces = part.split('[');
        let name = pieces.next().unwrap_or_default();
        let Some((key, mut value)) = current.iter().find(|(k, _)| k.get_ref() == name) else {
            break;
        };
        // A table's own span is its header only when it has one, its key is always there.
        best = if value.get_ref().is_table() {
            key.span()
        } else {
            value.span()
        };
        for piece in pieces {
            let index: Option<usize> = piece.trim_end_matches(']').parse().ok();
            let Some(element) =
                index.and_then(|i| value.get_ref().as_array().and_then(|a| a.get(i)))
            else {
                return Some(best);
            };
            value = element;
            best = value.span();
        }
        table = value.get_ref().as_table();
    }
    Some(best)
}

/// What serde found wrong, read from its message (it gives no other form).
enum Wrong {
    UnknownKey { key: String, known: Vec<String> },
    MissingKey { key: String },
    Value { message: String },
}

impl Wrong {
    fn read(message: &str) -> Self {
        let mut quoted = message.split('`').skip(1).step_by(2).map(str::to_owned);
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

    fn problem(&self, key: String) -> Problem {
        match self {
            Self::UnknownKey { key: name, known } => Problem::new(
                key,
                format!("there is no key `{name}` here"),
                match did_you_mean(name, known) {
                    Some(similar) => format!("did you mean `{similar}`?"),
                    None if known.is_empty() => "take it out".to_owned(),
                    None => format!("keys that may stand here: {}", known.join(", ")),
                },
            ),
            Self::MissingKey { .. } => Problem::new(key, "is missing", "give it a value"),
            Self::Value { message } => value_problem(key, message),
        }
    }
}

/// "invalid type: string "x", expected f64" and its like, split at the comma.
fn value_problem(key: String, message: &str) -> Problem {
    let (what, expected) = message.split_once(", expected ").unwrap_or((message, ""));
    let allowed: Vec<String> = expected
        .split('`')
        .skip(1)
        .step_by(2)
        .map(str::to_owned)
        .collect();
    let wrong = what.split('`').nth(1).unwrap_or_default();
    let similar = did_you_mean(wrong, &allowed);
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

/// Takes the entry that an error is about out of the document; its dotted key.
fn remove_wrong(
    table: &mut DeTable<'_>,
    wrong: &Wrong,
    span: Option<Range<usize>>,
) -> Option<String> {
    let span = span?;
    // Spans are exact, unless an enum was read through a buffer: then they are that of the table
    // around, and the first such key, or quoted value, in it is the one.
    match wrong {
        Wrong::MissingKey { .. } => None,
        Wrong::UnknownKey { key, .. } => remove_in_table(table, "", &|k, _| k.span() == span)
            .or_else(|| remove_below(table, "", &span, &|k, _| k.get_ref() == key)),
        Wrong::Value { message } => {
            remove_in_table(table, "", &|_, v| v.span() == span).or_else(|| {
                let what = message.split(", expected ").next().unwrap_or_default();
                let quoted = |text: &str| {
                    what.contains(&format!("`{text}`")) || what.contains(&format!("\"{text}\""))
                };
                remove_below(table, "", &span, &|_, v| {
                    v.get_ref().as_str().is_some_and(quoted)
                })
            })
        }
    }
}

type Pick<'p> = &'p dyn Fn(&Spanned<std::borrow::Cow<'_, str>>, &Spanned<DeValue<'_>>) -> bool;

fn remove_in_table(table: &mut DeTable<'_>, path: &str, pick: Pick<'_>) -> Option<String> {
    let found = table
        .iter()
        .find(|(k, v)| pick(k, v))
        .map(|(k, _)| k.clone());
    if let Some(key) = found {
        table.remove(&key);
        return Some(key_below(path, key.get_ref()));
    }
    table.iter_mut().find_map(|(key, value)| {
        let path = key_below(path, key.get_ref());
        remove_in_value(value.get_mut(), &path, pick)
    })
}

fn remove_in_value(value: &mut DeValue<'_>, path: &str, pick: Pick<'_>) -> Option<String> {
    match value {
        DeValue::Table(table) => remove_in_table(table, path, pick),
        DeValue::Array(array) => array.iter_mut().enumerate().find_map(|(i, element)| {
            remove_in_value(element.get_mut(), &format!("{path}[{i}]"), pick)
        }),
        _ => None,
    }
}

/// Takes an entry out of the innermost table or list with a span.
fn remove_below(
    table: &mut DeTable<'_>,
    path: &str,
    span: &Range<usize>,
    pick: Pick<'_>,
) -> Option<String> {
    table.iter_mut().find_map(|(key, value)| {
        remove_below_value(value, &key_below(path, key.get_ref()), span, pick)
    })
}

fn remove_below_value(
    value: &mut Spanned<DeValue<'_>>,
    path: &str,
    span: &Range<usize>,
    pick: Pick<'_>,
) -> Option<String> {
    let own = value.span();
    let deeper = match value.get_mut() {
        DeValue::Table(table) => remove_below(table, path, span, pick),
        DeValue::Array(array) => array
            .iter_mut()
            .enumerate()
            .find_map(|(i, v)| remove_below_value(v, &format!("{path}[{i}]"), span, pick)),
        _ => None,
    };
    if deeper.is_some() || own != *span {
        return deeper;
    }
    remove_in_value(value.get_mut(), path, pick)
}

/// Dotted path of the innermost value that holds a span.
fn key_at(table: &DeTable<'_>, span: Option<Range<usize>>) -> String {
    span.and_then(|span| innermost(table, "", &span, false))
        .unwrap_or_default()
}

/// Dotted path of the table with a span.
fn table_path(table: &DeTable<'_>, span: Option<Range<usize>>) -> String {
    span.and_then(|span| innermost(table, "", &span, true))
        .unwrap_or_default()
}

fn innermost(table: &DeTable<'_>, path: &str, span: &Range<usize>, exact: bool) -> Option<String> {
    table.iter().find_map(|(key, value)| {
        innermost_value(value, &key_below(path, key.get_ref()), span, exact)
    })
}

fn innermost_value(
    value: &Spanned<DeValue<'_>>,
    path: &str,
    span: &Range<usize>,
    exact: bool,
) -> Option<String> {
    let inside = match value.get_ref() {
        DeValue::Table(table) => innermost(table, path, span, exact),
        DeValue::Array(array) => array
            .iter()
            .enumerate()
            .find_map(|(i, v)| innermost_value(v, &format!("{path}[{i}]"), span, exact)),
        _ => None,
    };
    let own = value.span();
    let holds = if exact {
        own == *span
    } else {
        own.start <= span.start && span.end <= own.end
    };
    inside.or_else(|| holds.then(|| path.to_owned()))
}

fn last_key(dotted: &str) -> &str {
    dotted.rsplit('.').next().unwrap_or(dotted)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]
#[allow(dead_code, reason = "what is read matters, not what is done with it")]
mod tests;
