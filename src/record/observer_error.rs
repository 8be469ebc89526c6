//! Errors of observers: each says what was being done.

use crate::session::ObserverError;
use std::error::Error;
use std::fs;
use std::path::Path;

/// What observers give.
pub(super) type Result<T = (), E = ObserverError> = std::result::Result<T, E>;

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
