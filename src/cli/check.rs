//! `metrotwin check`: is this file right, and what does it say?

use super::fault::Failure;
use super::{print, report};
use crate::scenario::sampling::Template;
use crate::scenario::{self, Scenario};
use crate::study;
use std::path::{Path, PathBuf};

const AFTER: &str = "\
Every wrong key of a file is shown at once, with its place, what is wrong and what would be right.
A file with any of [[plan]], [[sections]], [lamps] is a tunnel, one with [body] and [bogie] a
vehicle, any other a scenario; of a scenario the files that it names are checked too, and of one with a
[study] what it draws.

Examples:
  metrotwin check tunnels/chengdu_line1.toml
  metrotwin check scenarios/*.toml tunnels/*.toml

Exit code 0 where all files are right, 2 where any is wrong.";

/// Check tunnels, vehicles, scenarios and studies: errors and a short report
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(super) struct CheckArgs {
    /// Tunnel, vehicle and scenario files
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
}

/// Checks every file, however many before it are wrong.
pub(super) fn check(args: &CheckArgs) -> Result<(), Failure> {
    let mut wrong = false;
    for file in &args.files {
        match report_on(file) {
            Ok(text) => print(&format!("{}: right\n{text}", file.display()))?,
            Err(error) => {
                error.print();
                wrong = true;
            }
        }
    }
    if wrong {
        Err(Failure::Reported)
    } else {
        Ok(())
    }
}

fn report_on(path: &Path) -> Result<String, Failure> {
    let text = scenario::read(path)?;
    let has = |keys: &[&str]| {
        text.parse::<toml::Table>()
            .is_ok_and(|table| keys.iter().any(|key| table.contains_key(*key)))
    };
    if has(&TUNNEL_KEYS) {
        Ok(report::tunnel(&scenario::parse_tunnel(path, &text)?))
    } else if has(&VEHICLE_KEYS) {
        Ok(report::vehicle(&scenario::parse_vehicle(path, &text)?))
    } else {
        let mut lines = report::scenario(&Scenario::from_text(path, &text, &[])?);
        if has(&["study"]) {
            let template = Template::load(path)?;
            study::check(&template, false)?;
            lines += &report::study(&template);
            lines += &invalid_draws(&template);
        }
        Ok(lines)
    }
}

/// What is wrong with the first runs that a study draws; each that is no scenario becomes a row that
/// says so.
fn invalid_draws(template: &Template) -> String {
    let looked = template.runs().min(MOST_DRAWN);
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
/// Keys that only tunnels have. What is not TOML is left to the scenario's parser to complain of.
const TUNNEL_KEYS: [&str; 6] = ["plan", "grades", "sections", "lamps", "lamp", "balises"];
/// Keys that only vehicles have.
const VEHICLE_KEYS: [&str; 3] = ["body", "bogie", "wheelset"];
