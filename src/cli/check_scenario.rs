//! `metrotwin check` of vehicles, scenarios and studies.

use super::fault::Failure;
use super::file_kind::FileKind;
use super::{notes, report};
use crate::scenario::sampling::Template;
use crate::scenario::{self, Override, Scenario};
use crate::study;
use std::path::Path;

/// What is to say of a file that is no tunnel.
pub(super) fn report_on(
    path: &Path,
    text: &str,
    kind: FileKind,
    overrides: &[Override],
) -> Result<String, Failure> {
    if kind == FileKind::Vehicle {
        refuse_overrides(path, overrides)?;
        return Ok(report::vehicle(&scenario::parse_vehicle(path, text)?));
    }
    let template = match kind {
        FileKind::Study => Some(Template::from_text(path, text.to_owned(), overrides)?),
        _ => None,
    };
    let scenario = Scenario::from_text(path, text, overrides)?;
    let mut said = report::scenario(&scenario);
    for note in notes::of(&scenario) {
        said += &format!("  note: {note}\n");
    }
    if let Some(template) = template {
        study::check(&template, false)?;
        said += &report::study(&template);
        said += &invalid_draws(&template);
    }
    Ok(said)
}

/// Of a tunnel or a vehicle.
pub(super) fn refuse_overrides(path: &Path, overrides: &[Override]) -> Result<(), Failure> {
    match overrides.first() {
        None => Ok(()),
        Some(change) => Err(Failure::input(
            format!("{change} changes scenarios, and {} is none", path.display()),
            "check it by itself, without --set",
        )),
    }
}

/// What is wrong with the first runs that a study draws; each that is no scenario becomes a row that
/// says so.
fn invalid_draws(template: &Template) -> String {
    let affordable = MOST_BYTES_DRAWN / template.text_len().max(1) as u64;
    let looked = template.runs().min(affordable.clamp(1, MOST_DRAWN));
    let wrong = |k: u64| match template.sample(k) {
        Ok(sample) => template.scenario(&sample).err().map(|e| e.to_string()),
        Err(error) => Some(error.to_string()),
    };
    let wrong: Vec<String> = (0..looked).filter_map(wrong).collect();
    match wrong.first() {
        None => String::new(),
        Some(first) => format!(
            "\n    {} of the first {looked} runs cannot be run: {first}",
            wrong.len()
        ),
    }
}

/// Runs of a study that are drawn to see whether they can be run.
const MOST_DRAWN: u64 = 200;
/// For each, the whole file is read: so many bytes take less than a second.
const MOST_BYTES_DRAWN: u64 = 4 << 20;
