//! What went wrong, as the user sees it: wrong files with pointers into their text.

use crate::scenario::{Override, ScenarioError, is_within};
use crate::settings::{FileError, Problem, locate};
use miette::{Diagnostic, LabeledSpan, MietteHandlerOpts, NamedSource, Report};
use std::fmt;
use std::ops::Range;
use std::path::Path;

/// Why a subcommand failed.
#[derive(Debug)]
pub(super) enum Failure {
    /// The input is wrong: exit code 2.
    Input(Report),
    /// A run failed: exit code 1.
    Run(anyhow::Error),
    /// Printed already: exit code 2.
    Reported,
}

impl Failure {
    pub(super) fn input(what: impl fmt::Display, remedy: impl fmt::Display) -> Self {
        Self::Input(Report::new(Fault {
            remedy: Some(remedy.to_string()),
            ..Fault::new(what)
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
#[derive(Debug, thiserror::Error, Diagnostic)]
#[error("{what}")]
#[diagnostic(severity(Error))]
struct Fault {
    what: String,
    #[help]
    remedy: Option<String>,
    #[source_code]
    file: Option<NamedSource<String>>,
    #[label(collection)]
    places: Vec<LabeledSpan>,
    #[related]
    others: Vec<Fault>,
}

impl Fault {
    fn new(what: impl fmt::Display) -> Self {
        Self {
            what: what.to_string(),
            remedy: None,
            file: None,
            places: Vec::new(),
            others: Vec::new(),
        }
    }

    fn of(error: ScenarioError) -> Self {
        match error {
            ScenarioError::Override(error) => Self::new(format!("--set {error}")),
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
                let remedy = "check the path; relative ones count from here";
                return Self {
                    remedy: Some(remedy.to_owned()),
                    ..Self::new(format!("cannot read {}: {source}", path.display()))
                };
            }
            FileError::Syntax { message, span } => {
                let fault = Self::new(format!("this is not TOML: {message}"));
                vec![fault.at(path, text, span, "here")]
            }
            FileError::Problems(problems) => {
                let one = |problem| Self::of_problem(path, text, overrides, problem);
                problems.into_iter().map(one).collect()
            }
        };
        Self {
            others,
            ..Self::new(heading)
        }
    }

    fn of_problem(path: &Path, text: &str, overrides: &[Override], problem: Problem) -> Self {
        let Problem { key, what, remedy } = problem;
        // An overridden value is not in the file: pointing there would mislead.
        let fault = match overrides.iter().find(|o| touches(&o.key, &key)) {
            Some(change) => Self::new(format!("{key}: {what} ({change})")),
            None => {
                let span = locate(text, &key).filter(|_| !text.is_empty());
                Self::new(format!("{key}: {what}")).at(path, text, span, &key)
            }
        };
        Self {
            remedy: Some(remedy),
            ..fault
        }
    }

    /// With its place in a file.
    fn at(mut self, path: &Path, text: &str, span: Option<Range<usize>>, label: &str) -> Self {
        let last = text.len().saturating_sub(1);
        let span = span.map(|span| {
            let start = span.start.min(last);
            start..span.end.clamp(start, text.len())
        });
        if let Some(span) = span.filter(|span| text.get(span.clone()).is_some()) {
            self.file = Some(NamedSource::new(
                path.display().to_string(),
                text.to_owned(),
            ));
            self.places = vec![LabeledSpan::at(span, label)];
        }
        self
    }
}

/// One of the keys lies at or below the other.
fn touches(a: &str, b: &str) -> bool {
    is_within(b, a) || is_within(a, b)
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
