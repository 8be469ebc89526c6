//! Whether a folder may take a data set: what lies there is told apart by the `meta.json` and the list
//! of files that every set has from its beginning.

use super::INPUTS;
use super::files::{FILES, FOLDERS};
use crate::files::{LIST, Listing, foreign, is_empty};
use crate::settings::{ReadLimit, read_bytes};
use serde_json::Value;
use std::io;
use std::path::{Path, PathBuf};

/// Who has written the files of a data set, in their list.
pub(super) const COMMAND: &str = "metrotwin frames";
/// What `meta.json` says in `format`.
pub(super) const FORMAT: &str = "metrotwin frames";
/// What differs between the `meta.json` of a set's beginning and that of its end.
const PROGRESS: [&str; 3] = ["finished", "frames", "cameras"];

/// Why a data set cannot be written into a folder.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The folder cannot be read, or an earlier set cannot be removed.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It holds a data set, or the beginning of another one.
    #[error("it holds a data set already")]
    Occupied,
    /// It holds other things.
    #[error("it is not empty, and holds no data set")]
    NotEmpty,
    /// A file that every set has would be written over.
    #[error("{} is there already, and is not of a data set", .0.display())]
    Taken(PathBuf),
}

/// Claims a folder for the set that `meta` is about. An earlier set is removed by `force`, file
/// by file as it has listed them, and nothing else ever is. The beginning of the same set, as a kill
/// leaves it, is gone on with.
pub(super) fn claim(folder: &Path, meta: &Value, force: bool) -> Result<(), FolderError> {
    let listed = Listing::read(folder, COMMAND)?;
    let kept = read_bytes(&folder.join("meta.json"), ReadLimit::JSON).ok();
    let kept = kept.and_then(|text| serde_json::from_slice::<Value>(&text).ok());
    let kept = kept.filter(|kept| kept["format"] == FORMAT && listed.is_some());
    match (kept, listed) {
        (Some(_), _) if force => Listing::clear(folder, COMMAND)?,
        (Some(kept), _) if goes_on(&kept, meta) => {}
        (Some(_), _) => return Err(FolderError::Occupied),
        // A kill before the first file leaves a list alone.
        (None, Some(listed)) if listed.iter().all(|name| !folder.join(name).exists()) => {}
        (None, Some(_)) => return Err(FolderError::Taken(folder.join(LIST))),
        (None, None) if !force && !is_empty(folder)? => return Err(FolderError::NotEmpty),
        (None, None) => {}
    }
    let is_link = |name: &&str| folder.join(name).is_symlink();
    let link = FOLDERS.into_iter().chain([INPUTS]).find(is_link);
    let taken = link.or(foreign(folder, COMMAND, FILES)?);
    taken.map_or(Ok(()), |name| Err(FolderError::Taken(folder.join(name))))
}

/// Whether a set that is not finished is the same as another one.
fn goes_on(kept: &Value, now: &Value) -> bool {
    let same = |value: &Value| {
        let mut value = value.clone();
        if let Some(object) = value.as_object_mut() {
            object.retain(|key, _| !PROGRESS.contains(&key.as_str()));
        }
        value
    };
    kept["finished"] == false && same(kept) == same(now)
}
