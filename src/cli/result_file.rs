//! Files that a command writes under the name that its user gives.

use super::fault::Failure;
use crate::files;
use std::fs;
use std::path::Path;

/// Refuses to write over a file, or a link, that is there, without `--force`. `option` is the one that names it.
pub(super) fn refuse_taken(path: &Path, option: &str, force: bool) -> Result<(), Failure> {
    let another = format!("choose another file with {option}");
    match fs::symlink_metadata(path) {
        Ok(about) if about.is_dir() => Err(Failure::input(
            format!("{} is a folder", path.display()),
            another,
        )),
        Ok(_) if !force => Err(Failure::input(
            format!("{} is there already", path.display()),
            format!("{another}, or give --force to replace it"),
        )),
        _ => Ok(()),
    }
}

/// Whether two names are of one file, which need not be there.
pub(super) fn is_same_file(a: &Path, b: &Path) -> bool {
    let [a, b] = [a, b].map(|path| {
        let folder = path
            .parent()
            .filter(|folder| !folder.as_os_str().is_empty());
        let folder = fs::canonicalize(folder.unwrap_or(Path::new(".")));
        (folder.ok(), path.file_name())
    });
    a.0.is_some() && a == b
}

/// Writes a file: whole or not at all.
pub(super) fn write_whole(path: &Path, text: &str) -> Result<(), Failure> {
    let folder = path.parent().map_or(Ok(()), fs::create_dir_all);
    let written = folder.and_then(|()| files::write_whole(path, text.as_bytes()));
    written.map_err(|error| {
        let what = format!("cannot write {}", path.display());
        Failure::run(anyhow::Error::new(error).context(what))
    })
}
