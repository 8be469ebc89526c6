//! Files that are whole or not there: each is written under a temporary name and renamed.

use crate::session::ObserverError;
use std::error::Error;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// What observers give.
pub(super) type Result<T = (), E = ObserverError> = std::result::Result<T, E>;

/// Name of a file while it is written.
pub(super) fn part_name(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    PathBuf::from(name)
}

/// Writes a whole file.
pub(crate) fn write_whole(path: &Path, content: &[u8]) -> io::Result<()> {
    let part = part_name(path);
    fs::write(&part, content)?;
    fs::rename(&part, path)
}

/// What is gone already need not be removed.
pub(crate) fn gone(removed: io::Result<()>) -> io::Result<()> {
    match removed {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Gives a file that has been written its name.
pub(super) fn finish(path: &Path) -> Result {
    fs::rename(part_name(path), path).map_err(broken(path))
}

/// Makes the folder of a file.
pub(super) fn make_folder_of(path: &Path) -> Result {
    let made = path.parent().map_or(Ok(()), fs::create_dir_all);
    made.map_err(failed(format!("making the folder of {}", path.display())))
}

/// An error at a file.
pub(super) fn broken<E: Into<Box<dyn Error + Send + Sync>>>(
    path: &Path,
) -> impl FnOnce(E) -> ObserverError + use<E> {
    failed(format!("writing {}", path.display()))
}

/// Turns an error into an observer's, saying what was being done.
pub(super) fn failed<E: Into<Box<dyn Error + Send + Sync>>>(
    what: impl Into<String>,
) -> impl FnOnce(E) -> ObserverError {
    let what = what.into();
    move |source| ObserverError {
        what,
        source: source.into(),
    }
}
