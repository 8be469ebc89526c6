//! TOML into a typed struct, with every wrong key named.

mod edit;
mod entries;
mod message;
mod problems;

pub use entries::{locate, name_around};

use crate::settings::{FileError, Problem, Settings};
use problems::ProblemSearch;
use serde::de::DeserializeOwned;
use toml::de::DeTable;

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
    read(text, |_: &T, _| {})
}

/// As [`read_toml`], of settings: where keys are wrong, numbers out of their range are told with
/// them. Where none are, `check` is left to the caller, who may know more.
pub fn read_settings<T: DeserializeOwned + Settings>(text: &str) -> Result<T, FileError> {
    read(text, |settings: &T, problems| settings.check("", problems))
}

fn read<T: DeserializeOwned>(
    text: &str,
    check: impl Fn(&T, &mut Vec<Problem>),
) -> Result<T, FileError> {
    let document = DeTable::parse(text).map_err(|e| FileError::Syntax {
        message: e.message().to_owned(),
        span: e.span(),
    })?;
    T::deserialize(toml::Deserializer::from(document.clone()))
        .map_err(|error| ProblemSearch::of(document, text.len()).problems(error, check))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]
#[allow(dead_code, reason = "what is read matters, not what is done with it")]
mod tests;
