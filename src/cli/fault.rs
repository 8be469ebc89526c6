//! What went wrong, as the user sees it: wrong files with pointers into their text.

use super::excerpt::Excerpt;
use crate::settings::{FileError, LONGEST_KEY, Problem, locate, name_around, shortened, shown};
use miette::{Diagnostic, LabeledSpan, MietteHandlerOpts, Report};
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

    /// A file that cannot be used.
    pub(super) fn file(path: &Path, text: &str, error: FileError) -> Self {
        let heading = format!("{} cannot be used", path.display());
        let fault = Fault::of_file(heading, (path, text), error, &|_| None);
        Self::Input(Report::new(fault))
    }

    pub(super) fn code(&self) -> u8 {
        match self {
            Self::Run(_) => 1,
            Self::Input(_) | Self::Reported => 2,
        }
    }

    pub(super) fn print(&self) {
        if !matches!(self, Self::Reported) {
            eprintln!("{}", self.text());
        }
    }

    /// As it is printed.
    pub(super) fn text(&self) -> String {
        match self {
            Self::Input(report) => format!("{report:?}"),
            Self::Run(error) => format!("error: {error:#}"),
            Self::Reported => String::new(),
        }
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

/// Of a key of a track its name, by which people know it better than by its number.
fn track_name(text: &str, key: &str) -> Option<String> {
    key.starts_with("track[").then(|| name_around(text, key))?
}

/// One thing that is wrong, with its place, or a heading over several.
#[derive(Debug, thiserror::Error, Diagnostic)]
#[error("{what}")]
#[diagnostic(severity(Error))]
pub(super) struct Fault {
    what: String,
    #[help]
    remedy: Option<String>,
    #[source_code]
    file: Option<Excerpt>,
    #[label(collection)]
    places: Vec<LabeledSpan>,
    #[related]
    others: Vec<Fault>,
}

impl Fault {
    pub(super) fn new(what: impl fmt::Display) -> Self {
        Self {
            what: what.to_string(),
            remedy: None,
            file: None,
            places: Vec::new(),
            others: Vec::new(),
        }
    }

    /// Of several wrong files: the first, and then the others.
    #[cfg(feature = "twin")]
    pub(super) fn several(faults: impl Iterator<Item = Self>) -> Self {
        let mut faults = faults;
        let mut first = faults
            .next()
            .unwrap_or_else(|| Self::new("nothing is wrong"));
        for mut other in faults {
            let related = std::mem::take(&mut other.others);
            first.others.push(other);
            first.others.extend(related);
        }
        first
    }

    /// Of a wrong file; `changed` tells what a key was changed by from outside, if it was.
    pub(super) fn of_file(
        heading: String,
        (path, text): (&Path, &str),
        source: FileError,
        changed: &dyn Fn(&str) -> Option<String>,
    ) -> Self {
        let is_first = matches!(source, FileError::FirstProblems(_));
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
            FileError::Problems(problems) | FileError::FirstProblems(problems) => {
                let (shown, rest) = shown(&problems, !is_first);
                let one = |problem| Self::of_problem((path, text), problem, changed);
                shown.iter().map(one).chain(rest.map(Self::new)).collect()
            }
        };
        Self {
            others,
            ..Self::new(heading)
        }
    }

    fn of_problem(
        (path, text): (&Path, &str),
        problem: &Problem,
        changed: &dyn Fn(&str) -> Option<String>,
    ) -> Self {
        let key = problem.key.as_str();
        let said = match track_name(text, key) {
            Some(name) => problem.said_of(&name),
            None => problem.said(),
        };
        // A changed value is not in the file: pointing there would mislead.
        let fault = match changed(key) {
            Some(change) => Self::new(format!("{said} ({change})")),
            None => {
                let span = locate(text, key).filter(|_| !text.is_empty() && !key.is_empty());
                Self::new(said).at(path, text, span, &shortened(key, LONGEST_KEY))
            }
        };
        Self {
            remedy: Some(problem.remedy.clone()),
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
        let name = path.display().to_string();
        let excerpt = span.and_then(|span| Excerpt::around(name, text, span));
        if let Some(excerpt) = excerpt {
            self.places = vec![LabeledSpan::at(excerpt.place.clone(), label)];
            self.file = Some(excerpt);
        }
        self
    }
}
