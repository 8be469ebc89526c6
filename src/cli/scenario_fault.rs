//! What is wrong with a scenario, or with what `--set` made of it, as the user sees it.

use super::fault::{Failure, Fault};
use crate::scenario::{Override, ScenarioError, is_within};
use miette::Report;

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
