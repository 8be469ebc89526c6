//! Files that a command writes under the name that its user gives.

use super::fault::Failure;
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

/// Writes a file: whole or not at all.
pub(super) fn write_whole(path: &Path, text: &str) -> Result<(), Failure> {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let write = || {
        if let Some(folder) = folder {
            fs::create_dir_all(folder)?;
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let part = path.with_file_name(format!(".{name}.part"));
        fs::write(&part, text)?;
        fs::rename(part, path)
    };
    write().map_err(|error: std::io::Error| {
        let what = format!("cannot write {}", path.display());
        Failure::run(anyhow::Error::new(error).context(what))
    })
}
