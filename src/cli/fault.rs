//! What went wrong, as the user sees it: wrong files with pointers into their text.

use crate::scenario::{Override, ScenarioError};
use crate::settings::{FileError, Problem, locate};
use miette::{Diagnostic, LabeledSpan, MietteHandlerOpts, NamedSource, Report, Severity};
use std::fmt;
use std::path::Path;

/// Why a subcommand failed.
#[derive(Debug)]
pub(super) enum Failure {
    /// The input is wrong: exit code 2.
    Input(Report),
    /// A run failed: exit code 1.
    Run(anyhow::Error),
    /// Said already: exit code 2.
    Reported,
}

impl Failure {
    pub(super) fn input(what: impl fmt::Display, remedy: impl fmt::Display) -> Self {
        Self::Input(Report::new(Fault {
            what: what.to_string(),
            remedy: Some(remedy.to_string()),
            place: None,
            others: Vec::new(),
        }))
    }

    pub(super) fn run(error: impl Into<anyhow::Error>) -> Self {
        Self::Run(error.into())
    }

    pub(super) fn code(&self) -> u8 {
        match self {
            Self::Run(_) => 1,
            Self::Input(_) | Self::Reported => 2,
        }
    }

    pub(super) fn print(&self) {
        match self {
            Self::Input(report) => eprintln!("{report:?}"),
            Self::Run(error) => eprintln!("error: {error:#}"),
            Self::Reported => {}
        }
    }
}

impl From<ScenarioError> for Failure {
    fn from(error: ScenarioError) -> Self {
        Self::Input(Report::new(Fault::of(error)))
    }
}

/// Long lines are left to the terminal: a path or key is never broken in two.
pub(super) fn set_style() {
    let set = miette::set_hook(Box::new(|_| {
        Box::new(MietteHandlerOpts::new().wrap_lines(false).build())
    }));
    if let Err(error) = set {
        tracing::debug!("error reports keep their default style: {error}");
    }
}

/// One thing that is wrong, with its place, or a heading over several.
#[derive(Debug, thiserror::Error)]
#[error("{what}")]
struct Fault {
    what: String,
    remedy: Option<String>,
    place: Option<Place>,
    others: Vec<Fault>,
}

#[derive(Debug)]
struct Place {
    source: NamedSource<String>,
    label: LabeledSpan,
}

impl Diagnostic for Fault {
    fn severity(&self) -> Option<Severity> {
        Some(Severity::Error)
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.remedy
            .as_ref()
            .map(|r| Box::new(r) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn miette::SourceCode> {
        self.place
            .as_ref()
            .map(|p| &p.source as &dyn miette::SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        self.place.as_ref().map(|place| {
            Box::new(std::iter::once(place.label.clone())) as Box<dyn Iterator<Item = _>>
        })
    }

    fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn Diagnostic> + 'a>> {
        (!self.others.is_empty()).then(|| {
            Box::new(self.others.iter().map(|f| f as &dyn Diagnostic))
                as Box<dyn Iterator<Item = _>>
        })
    }
}

impl Fault {
    fn of(error: ScenarioError) -> Self {
        match error {
            ScenarioError::Override(error) => Self {
                what: format!("--set {error}"),
                remedy: None,
                place: None,
                others: Vec::new(),
            },
            ScenarioError::Overridden {
                path,
                overrides,
                source,
            } => {
                let list: Vec<String> = overrides.iter().map(Override::to_string).collect();
                let heading = format!(
                    "{} is right by itself, but not with {}",
                    path.display(),
                    list.join(" ")
                );
                Self::of_file(heading, &path, "", &overrides, source)
            }
            ScenarioError::File {
                path,
                text,
                overrides,
                source,
            } => {
                let heading = format!("{} cannot be used", path.display());
                Self::of_file(heading, &path, &text, &overrides, source)
            }
        }
    }

    fn of_file(
        heading: String,
        path: &Path,
        text: &str,
        overrides: &[Override],
        source: FileError,
    ) -> Self {
        let others = match source {
            FileError::Read { source, .. } => {
                return Self {
                    what: format!("cannot read {}: {source}", path.display()),
                    remedy: Some("check the path; relative ones count from here".to_owned()),
                    place: None,
                    others: Vec::new(),
                };
            }
            FileError::Syntax { message, span } => vec![Self {
                what: format!("this is not TOML: {message}"),
                remedy: None,
                place: span.and_then(|span| place(path, text, span, "here")),
                others: Vec::new(),
            }],
            FileError::Problems(problems) => {
                let one = |problem| Self::of_problem(path, text, overrides, problem);
                problems.into_iter().map(one).collect()
            }
        };
        Self {
            what: heading,
            remedy: None,
            place: None,
            others,
        }
    }

    fn of_problem(path: &Path, text: &str, overrides: &[Override], problem: Problem) -> Self {
        let Problem { key, what, remedy } = problem;
        // An overridden value is not in the file: pointing there would mislead.
        let blamed = overrides.iter().find(|o| touches(&o.key, &key));
        let (what, place) = match blamed {
            Some(change) => (format!("{key}: {what} ({change})"), None),
            None => {
                let span = locate(text, &key).filter(|_| !text.is_empty());
                let place = span.and_then(|span| place(path, text, span, &key));
                (format!("{key}: {what}"), place)
            }
        };
        Self {
            what,
            remedy: Some(remedy),
            place,
            others: Vec::new(),
        }
    }
}

/// One of the keys lies at or below the other.
fn touches(a: &str, b: &str) -> bool {
    let below = |outer: &str, inner: &str| {
        inner
            .strip_prefix(outer)
            .is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
    };
    below(a, b) || below(b, a)
}

fn place(path: &Path, text: &str, span: std::ops::Range<usize>, label: &str) -> Option<Place> {
    let last = text.len().saturating_sub(1);
    let start = span.start.min(last);
    let end = span.end.clamp(start, text.len());
    text.get(start..end).map(|_| Place {
        source: NamedSource::new(path.display().to_string(), text.to_owned()),
        label: LabeledSpan::at(start..end, label),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An override of a neighbour, or of a key with the same beginning, is not to blame.
    #[test]
    fn only_the_overridden_key_is_blamed() {
        assert!(touches("train", "train.cars"));
        assert!(touches("train.cars", "train.cars"));
        assert!(touches("obstacles[0].body", "obstacles[0]"));
        assert!(!touches("train.cars", "train.car_length_m"));
        assert!(!touches("train", "training"));
        assert!(!touches("obstacles[1]", "obstacles[10]"));
    }
}
