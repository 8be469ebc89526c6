//! The folder that a command writes its results into.

use super::fault::Failure;
use crate::files;
use std::io::{self, ErrorKind};
use std::path::Path;

/// Makes the folder for results, and makes sure that files can be written there.
pub(super) fn prepare(out: &Path) -> Result<(), Failure> {
    files::probe(out).map_err(|error| {
        let what = format!("cannot write into {}: {error}", out.display());
        Failure::input(
            what,
            "choose another folder with --out, or make that one writable",
        )
    })
}

/// What is said of a folder in which a command cannot write its files.
pub(super) fn unusable(out: &Path, error: &io::Error) -> Failure {
    let remedy = match error.kind() {
        ErrorKind::ResourceBusy => "wait for it to end, or choose another folder with --out",
        ErrorKind::AlreadyExists => "choose another folder with --out, or move what is there away",
        _ => "choose another folder with --out",
    };
    Failure::input(format!("cannot use {}: {error}", out.display()), remedy)
}
