//! What is wrong with a scenario, or with what `--set` made of it, as the user sees it.

use super::fault::{Failure, Fault};
use super::file_kind::FileKind;
use crate::scenario::sampling::Template;
use crate::scenario::{self, Override, Scenario, ScenarioError};
use crate::settings::is_within;
use miette::Report;
use std::path::Path;

/// A scenario with its text.
pub(super) fn load_scenario(path: &Path, overrides: &[Override]) -> Result<Scenario, Failure> {
    let text = scenario::read(path)?;
    refuse_other(path, &text)?;
    if FileKind::of(&text) == FileKind::Study {
        let path = path.display();
        eprintln!(
            "note: [study] of {path} is left out; `metrotwin study run {path}` makes its runs"
        );
    }
    Ok(Scenario::from_text(path, &text, overrides)?)
}

/// A study's scenario.
pub(super) fn load_template(path: &Path, overrides: &[Override]) -> Result<Template, Failure> {
    let text = scenario::read(path)?;
    refuse_other(path, &text)?;
    Ok(Template::from_text(path, text, overrides)?)
}

/// Every key of a tunnel or a vehicle would be unknown in a scenario: what it is says more.
fn refuse_other(path: &Path, text: &str) -> Result<(), Failure> {
    let (what, key, name) = match FileKind::of(text) {
        FileKind::Tunnel => ("tunnel", "tunnel", "../tunnels/x.toml"),
        FileKind::Vehicle => ("vehicle", "train.vehicle", "vehicles/x.toml"),
        FileKind::Study | FileKind::Scenario => return Ok(()),
    };
    Err(Failure::input(
        format!("{} is a {what}, not a scenario", path.display()),
        format!(
            "give a scenario that names it ({key} = \"{name}\"); `metrotwin check` checks it by itself"
        ),
    ))
}

impl From<ScenarioError> for Failure {
    fn from(error: ScenarioError) -> Self {
        Self::Input(Report::new(fault(error)))
    }
}

fn fault(error: ScenarioError) -> Fault {
    match error {
        ScenarioError::Override(error) => Fault::new(format!("--set {error}")),
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
            Fault::of_file(heading, (&path, ""), source, &changed_by(&overrides))
        }
        ScenarioError::Files(errors) => Fault::several(errors.into_iter().map(fault)),
        ScenarioError::File {
            path,
            text,
            overrides,
            source,
        } => {
            let heading = format!("{} cannot be used", path.display());
            Fault::of_file(heading, (&path, &text), source, &changed_by(&overrides))
        }
    }
}

/// Which override a key was changed by.
fn changed_by(overrides: &[Override]) -> impl Fn(&str) -> Option<String> {
    move |key| {
        let change = overrides.iter().find(|o| touches(&o.key, key));
        change.map(Override::to_string)
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
