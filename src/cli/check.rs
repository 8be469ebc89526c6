//! `metrotwin check`: is this file right, and what does it say?

#[cfg(feature = "twin")]
use super::check_scenario;
use super::fault::Failure;
use super::file_kind::FileKind;
use super::{chainage, print, tunnel};
#[cfg(feature = "twin")]
use crate::scenario::Override;
use crate::settings::{FileError, ReadLimit, read_text};
use crate::track::Tunnel;
use std::path::{Path, PathBuf};

const AFTER: &str = "\
Every wrong key of a file is shown at once, with its place, what is wrong and what would be right.
A file with any of [[track]], [[switches]], [[plan]], [[sections]], [lamps] is a tunnel, one with [body]
and [bogie] a vehicle, any other a scenario; of a scenario the files that it names are checked too, and of
one with a [study] what it draws.

Examples:
  metrotwin check tunnels/chengdu_line1.toml
  metrotwin check scenarios/*.toml tunnels/*.toml
  metrotwin check tunnels/terminus.toml --chainage YDK12+150
  metrotwin check scenarios/line_run.toml --set train.cruise_speed_kmh=80

Exit code 0 where all files are right, 2 where any is wrong or a --chainage is on no track.";

/// Check tunnels, vehicles, scenarios and studies: errors and a short report
#[derive(Default, clap::Args)]
#[command(after_help = AFTER)]
pub(super) struct CheckArgs {
    /// Tunnel, vehicle and scenario files
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Check scenarios with a value changed, e.g. train.cruise_speed_kmh=80; may be given again
    #[cfg(feature = "twin")]
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<Override>,
    /// Say where a tunnel states a chainage, e.g. DK12+340.5, and nothing else; may be given again
    #[arg(long = "chainage", value_name = "TEXT")]
    chainages: Vec<String>,
}

/// Checks every file, however many before it are wrong.
pub(super) fn check(args: &CheckArgs) -> Result<(), Failure> {
    let mut wrong = false;
    for file in &args.files {
        match report_on(file, args) {
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

/// What `metrotwin check` says of a text that stands in a file: its report, or its errors as they are
/// printed.
pub fn check_text(path: &Path, text: &str) -> Result<String, String> {
    report_of(path, text, &CheckArgs::default()).map_err(|failure| failure.text())
}

fn report_on(path: &Path, args: &CheckArgs) -> Result<String, Failure> {
    report_of(path, &read(path)?, args)
}

fn report_of(path: &Path, text: &str, args: &CheckArgs) -> Result<String, Failure> {
    match FileKind::of(text) {
        FileKind::Tunnel => {
            #[cfg(feature = "twin")]
            check_scenario::refuse_overrides(path, &args.overrides)?;
            let tunnel = Tunnel::from_toml(text).map_err(|e| Failure::file(path, text, e))?;
            if args.chainages.is_empty() {
                return Ok(tunnel::report(&tunnel));
            }
            let answers = args.chainages.iter();
            let answers = answers.map(|text| chainage::report(path, &tunnel, text));
            answers.collect()
        }
        kind => {
            chainage::refuse(path, &args.chainages)?;
            other(path, text, kind, args)
        }
    }
}

/// A vehicle, scenario or study.
#[cfg(feature = "twin")]
fn other(path: &Path, text: &str, kind: FileKind, args: &CheckArgs) -> Result<String, Failure> {
    check_scenario::report_on(path, text, kind, &args.overrides)
}

/// The onboard box knows tunnels only.
#[cfg(not(feature = "twin"))]
fn other(path: &Path, text: &str, _: FileKind, _: &CheckArgs) -> Result<String, Failure> {
    if let Err(error @ FileError::Syntax { .. }) = Tunnel::from_toml(text) {
        return Err(Failure::file(path, text, error));
    }
    Err(Failure::input(
        format!("{} is no tunnel file", path.display()),
        "scenarios and vehicles are checked by the whole program, built with its default features",
    ))
}

/// The text of a file.
pub(super) fn read(path: &Path) -> Result<String, Failure> {
    read_as(path, ReadLimit::TOML)
}

/// The text of a file of some kind.
pub(super) fn read_as(path: &Path, kind: ReadLimit) -> Result<String, Failure> {
    read_text(path, kind).map_err(|source| {
        let path = path.to_owned();
        Failure::file(&path.clone(), "", FileError::Read { path, source })
    })
}
