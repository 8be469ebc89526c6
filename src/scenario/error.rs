//! Why there is no scenario.

use super::{Override, OverrideError};
use crate::settings::{FileError, Problem, is_within};
use std::path::{Path, PathBuf};

/// Why there is no scenario.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// An override that cannot be applied.
    #[error("--set {0}")]
    Override(#[from] OverrideError),
    /// The file is right by itself, but not with these overrides.
    #[error("{} is right by itself, but not with {}: {source}", path.display(), list(overrides))]
    Overridden {
        /// The file.
        path: PathBuf,
        /// The overrides.
        overrides: Vec<Override>,
        /// What is wrong.
        source: FileError,
    },
    /// A file is wrong: the scenario, or the tunnel that it names.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Its text, empty where it could not be read.
        text: String,
        /// Values in it that overrides have replaced.
        overrides: Vec<Override>,
        /// What is wrong.
        source: FileError,
    },
    /// Several files are wrong: the scenario, and what it names.
    #[error("{}", lines(.0))]
    Files(Vec<ScenarioError>),
}

fn lines(errors: &[ScenarioError]) -> String {
    let lines: Vec<String> = errors.iter().map(ScenarioError::to_string).collect();
    lines.join("\n")
}

impl ScenarioError {
    /// Of a file as it stands, without overrides.
    pub(super) fn file(path: &Path, text: &str, source: FileError) -> Self {
        Self::File {
            path: path.to_owned(),
            text: text.to_owned(),
            overrides: Vec::new(),
            source,
        }
    }

    /// Whether any of its problems is at or below a key.
    pub(super) fn is_at(&self, key: &str) -> bool {
        match self {
            Self::Files(errors) => errors.iter().any(|error| error.is_at(key)),
            Self::File {
                source: FileError::Problems(problems),
                ..
            } => problems.iter().any(|problem| is_within(&problem.key, key)),
            _ => false,
        }
    }

    /// With more problems of a file.
    pub(super) fn joined(
        error: Option<Self>,
        path: &Path,
        text: &str,
        more: Vec<Problem>,
    ) -> Option<Self> {
        let mut errors = match error {
            Some(Self::Files(errors)) => errors,
            error => error.into_iter().collect(),
        };
        let mut of_file = errors.iter_mut().filter_map(|error| match error {
            Self::File {
                path: other,
                source: FileError::Problems(problems),
                ..
            } if other == path => Some(problems),
            _ => None,
        });
        match of_file.next() {
            Some(problems) => problems.extend(more),
            None if more.is_empty() => {}
            None => errors.insert(0, Self::file(path, text, FileError::Problems(more))),
        }
        match errors.len() {
            0 | 1 => errors.pop(),
            _ => Some(Self::Files(errors)),
        }
    }
}

fn list(overrides: &[Override]) -> String {
    let list: Vec<String> = overrides.iter().map(Override::to_string).collect();
    list.join(" ")
}
