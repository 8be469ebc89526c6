//! Files that are whole or not there: each is written under a temporary name, synced, and renamed.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Name of a file while it is written.
pub(crate) fn part_name(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    PathBuf::from(name)
}

/// A file that is being written under its temporary name. Where it is dropped before
/// [`Self::finish`], or the process is killed, it keeps that name.
#[derive(Debug)]
pub(crate) struct PartFile {
    path: PathBuf,
    file: File,
    /// What lay under the temporary name. It stays locked: another process may have opened it.
    _earlier: Option<File>,
}

impl PartFile {
    /// Begins a file. What a killed process has left under the temporary name is replaced; what a
    /// living one writes there is an error.
    pub fn create(path: &Path) -> io::Result<Self> {
        let part = part_name(path);
        let (file, earlier) = match File::create_new(&part) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                let earlier = left_over(path)?;
                (create_new(&part)?, earlier)
            }
            made => (made?, None),
        };
        Ok(Self {
            path: path.to_owned(),
            file: locked(file, path)?,
            _earlier: earlier,
        })
    }

    /// Gives the file its name, once its content is on the disk.
    pub fn finish(self) -> io::Result<()> {
        let path = self.path.clone();
        self.finish_as(&path)
    }

    /// Gives the file another name in the same folder.
    pub fn finish_as(self, path: &Path) -> io::Result<()> {
        self.file.sync_all()?;
        fs::rename(part_name(&self.path), path)?;
        sync_folder_of(path)
    }
}

impl Write for PartFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// What a killed process has left under the temporary name of a file, locked; what a living one writes
/// there is an error. What a link points to is not opened.
fn left_over(path: &Path) -> io::Result<Option<File>> {
    let part = part_name(path);
    match fs::symlink_metadata(&part) {
        Ok(about) if about.is_file() => locked(File::open(&part)?, path).map(Some),
        _ => Ok(None),
    }
}

/// Locks a file that is being written as `path`. File systems without locks lose only this check.
pub(super) fn locked(file: File, path: &Path) -> io::Result<File> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => {
            let what = format!("another process is writing {}", path.display());
            Err(io::Error::new(ErrorKind::ResourceBusy, what))
        }
        _ => Ok(file),
    }
}

/// A new, empty file. A file or a link of that name is removed; what the link points to stays.
pub(crate) fn create_new(path: &Path) -> io::Result<File> {
    gone(fs::remove_file(path))?;
    let mut options = OpenOptions::new();
    options.write(true).create_new(true).open(path)
}

/// Opens a file that is written in place, and makes it where there is none. Anything else of that name,
/// such as a link, is an error.
pub(crate) fn open_in_place(path: &Path, options: &mut OpenOptions) -> io::Result<File> {
    if fs::symlink_metadata(path).is_ok_and(|about| !about.is_file()) {
        return Err(taken(path));
    }
    options.create(true).truncate(false).open(path)
}

/// That a file is there which the program has not written.
pub(super) fn taken(path: &Path) -> io::Error {
    let what = format!(
        "{} is there already, and this command has not written it",
        path.display()
    );
    io::Error::new(ErrorKind::AlreadyExists, what)
}

/// Makes sure that the names in a file's folder outlast a loss of power.
fn sync_folder_of(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty());
    // Folders cannot be opened everywhere, nor synced on every file system.
    let Ok(folder) = File::open(folder.unwrap_or(Path::new("."))) else {
        return Ok(());
    };
    match folder.sync_all() {
        Err(error)
            if !matches!(
                error.kind(),
                ErrorKind::InvalidInput | ErrorKind::Unsupported
            ) =>
        {
            Err(error)
        }
        _ => Ok(()),
    }
}

/// Writes a whole file.
pub(crate) fn write_whole(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut part = PartFile::create(path)?;
    let written = part.write_all(content).and_then(|()| part.finish());
    if written.is_err() {
        fs::remove_file(part_name(path)).ok();
    }
    written
}

/// Name of the file by which [`probe`] tries a folder.
const PROBE: &str = ".metrotwin-probe";

/// Makes a folder, and makes sure that files can be written there.
pub(crate) fn probe(folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let probe = folder.join(PROBE);
    create_new(&probe)?;
    fs::remove_file(&probe)
}

/// Whether a folder holds nothing, or is not there.
#[cfg(feature = "twin")]
pub(crate) fn is_empty(folder: &Path) -> io::Result<bool> {
    match fs::read_dir(folder) {
        Ok(entries) => Ok(entries.flatten().all(|entry| entry.file_name() == PROBE)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(true),
        Err(error) => Err(error),
    }
}

/// What is gone already need not be removed.
pub(crate) fn gone(removed: io::Result<()>) -> io::Result<()> {
    match removed {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Removes a file, and what an interrupted process left of it; one that is being written is an error.
pub(crate) fn remove(path: &Path) -> io::Result<()> {
    let _left = left_over(path)?;
    gone(fs::remove_file(part_name(path)))?;
    gone(fs::remove_file(path))
}

#[cfg(all(test, unix))]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    /// Fails where a link that lies under a temporary name leads to another file being written over, two
    /// processes write one file, or one removes what the other writes.
    #[test]
    fn a_temporary_name_that_is_a_link_is_not_followed() {
        let folder = std::env::temp_dir().join(format!("metrotwin-part-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let [theirs, ours] = ["theirs", "ours"].map(|name| folder.join(name));
        fs::write(&theirs, "kept").unwrap();
        symlink(&theirs, part_name(&ours)).unwrap();
        write_whole(&ours, b"new").unwrap();
        symlink(&theirs, folder.join(PROBE)).unwrap();
        probe(&folder).unwrap();
        assert_eq!(fs::read(&theirs).unwrap(), b"kept");
        assert_eq!(fs::read(&ours).unwrap(), b"new");
        assert!(fs::symlink_metadata(&ours).unwrap().is_file());

        let first = PartFile::create(&ours).unwrap();
        let second = PartFile::create(&ours).unwrap_err();
        assert_eq!(second.kind(), ErrorKind::ResourceBusy);
        assert_eq!(remove(&ours).unwrap_err().kind(), ErrorKind::ResourceBusy);
        assert!(ours.exists() && part_name(&ours).exists());
        drop(first);
        PartFile::create(&ours).unwrap().finish().unwrap();

        // Between making a file and locking it, another process takes it for a left-over.
        let unlocked = File::create_new(part_name(&ours)).unwrap();
        let other = PartFile::create(&ours).unwrap();
        let late = locked(unlocked, &ours).unwrap_err();
        assert_eq!(late.kind(), ErrorKind::ResourceBusy);
        other.finish().unwrap();
        fs::remove_dir_all(&folder).unwrap();
    }
}
