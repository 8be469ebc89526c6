//! Rows on disk as they come: a line of JSON each, appended and synced, so that a kill at any moment
//! loses at most the runs in flight. A last line that is torn is dropped.

use super::{
    MANIFEST, Manifest, REPORT, Result, Row, Status, StudyError, announce, not_read, not_written,
    table::TABLE,
};
use crate::files::open_in_place;
use crate::settings::open_regular;
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Name of the file in a study's folder.
pub const JOURNAL: &str = "rows.jsonl";
/// The file that whoever writes into the folder has locked. It is never renamed or removed: a lock on
/// the journal would be lost when a merge puts another file in its place.
pub const LOCK: &str = "study.lock";
/// Longest line that is read. Of a run of a day with a fix a frame it has a quarter of this.
const MOST_LINE: u64 = 64 << 20;

/// The rows of a study, open to be added to.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    /// Held until it is closed, by whatever end of the process.
    _lock: File,
}

impl Journal {
    /// Opens the journal of a folder, new or to go on with, and locks the folder; gives the manifest
    /// and the rows that it has.
    pub fn open(folder: &Path) -> Result<(Self, Option<Manifest>, Vec<Row>)> {
        let own = [LOCK, JOURNAL, MANIFEST, TABLE, REPORT];
        announce(folder, own.map(str::to_owned))?;
        // The folder is locked before anything else is read.
        let lock = lock(folder)?;
        let manifest = Manifest::read(folder)?;
        let path = folder.join(JOURNAL);
        let failed = |source| StudyError::file(&path, source);
        let mut file = open(&path)?;
        let (rows, whole) = match &manifest {
            Some(manifest) => {
                manifest.check_copies(folder)?;
                parse(&path, &file, manifest)?
            }
            None if file.metadata().map_err(failed)?.len() == 0 => (Vec::new(), 0),
            None => {
                return Err(StudyError::Other {
                    path: folder.to_owned(),
                    what: "rows without a manifest".to_owned(),
                });
            }
        };
        file.set_len(whole).map_err(failed)?;
        file.seek(SeekFrom::End(0)).map_err(failed)?;
        let journal = Self {
            path,
            file,
            _lock: lock,
        };
        Ok((journal, manifest, rows))
    }

    /// Adds a row. One that could not be written whole is taken away again.
    pub fn add(&mut self, row: &Row) -> Result {
        let mut line = serde_json::to_vec(row).map_err(io::Error::other);
        if let Ok(line) = &mut line {
            line.push(b'\n');
        }
        let written = line.and_then(|line| {
            let end = self.file.stream_position()?;
            let written = self
                .file
                .write_all(&line)
                .and_then(|()| self.file.sync_data());
            if written.is_err() {
                self.file.set_len(end)?;
            }
            written
        });
        written.map_err(|source| StudyError::file(&self.path, source))
    }
}

fn lock(folder: &Path) -> Result<File> {
    let path = folder.join(LOCK);
    let failed = |source| StudyError::file(&path, source);
    let file = open(&path)?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(StudyError::Busy(folder.to_owned())),
        Err(TryLockError::Error(source)) => Err(failed(source)),
    }
}

/// A file to be read and written, made where there is none.
fn open(path: &Path) -> Result<File> {
    let file = open_in_place(path, OpenOptions::new().read(true).write(true));
    file.map_err(|source| not_written(path, source))
}

/// The rows of a folder, in the order of their indexes; those that were run twice once.
pub fn read(folder: &Path) -> Result<Vec<Row>> {
    let manifest = Manifest::read(folder)?;
    let manifest = manifest.ok_or_else(|| StudyError::NoStudy(folder.to_owned()))?;
    read_of(folder, &manifest)
}

/// As [`read`], of a folder with this manifest.
pub fn read_of(folder: &Path, manifest: &Manifest) -> Result<Vec<Row>> {
    let path = folder.join(JOURNAL);
    let file = open_regular(&path).map_err(|source| not_read(&path, source))?;
    Ok(parse(&path, &file, manifest)?.0)
}

/// The rows in the order of their indexes, and how many bytes hold them. Of a run that crashed and was
/// tried again it is the last one.
fn parse(path: &Path, file: &File, manifest: &Manifest) -> Result<(Vec<Row>, u64)> {
    let mut rows = BTreeMap::new();
    let (mut file, mut line, mut whole) = (BufReader::new(file), Vec::new(), 0);
    for number in 1.. {
        line.clear();
        let read = (&mut file).take(MOST_LINE).read_until(b'\n', &mut line);
        read.map_err(|source| StudyError::file(path, source))?;
        let wrong = |why| StudyError::Journal {
            path: path.to_owned(),
            line: number,
            why,
        };
        if line.len() as u64 == MOST_LINE {
            return Err(wrong(format!("it is longer than {MOST_LINE} bytes")));
        }
        if line.pop() != Some(b'\n') {
            break;
        }
        whole += line.len() as u64 + 1;
        if !line.is_empty() {
            let row = serde_json::from_slice(&line).map_err(|e| wrong(e.to_string()))?;
            manifest.check_row(&row).map_err(wrong)?;
            insert(&mut rows, row).map_err(wrong)?;
        }
    }
    Ok((rows.into_values().collect(), whole))
}

fn insert(rows: &mut BTreeMap<u64, Row>, row: Row) -> Result<(), String> {
    let index = row.index;
    match rows.insert(index, row) {
        Some(earlier) if earlier.status != Status::Crashed => {
            Err(format!("run {index} is there twice"))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::twin::render::Backend;
    use serde_json::json;

    fn row(index: u64) -> Row {
        let figures = json!({"paper_error_mean_m": 0.1 + 0.2, "list": [1e-5, 3.0]});
        Row {
            index,
            seed: (1 << 53) - 1,
            status: Status::Complete,
            reason: None,
            rejected: 0,
            ln_weight: -0.1,
            values: json!({"speed": 1.0 / 3.0}).as_object().unwrap().clone(),
            figures: figures.as_object().unwrap().clone(),
        }
    }

    /// A folder with the manifest of a study of four runs.
    fn folder(name: &str) -> PathBuf {
        let name = format!("metrotwin-{name}-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        std::fs::remove_dir_all(&folder).ok();
        std::fs::create_dir_all(&folder).unwrap();
        drop(Journal::open(&folder).unwrap());
        let manifest = Manifest {
            metrotwin: String::new(),
            program: String::new(),
            study: "study.toml".into(),
            inputs: BTreeMap::new(),
            set: Vec::new(),
            runs: 4,
            renderer: Backend {
                backend: String::new(),
                adapter: String::new(),
            },
            shard: None,
        };
        manifest.write(&folder).unwrap();
        folder
    }

    /// A line cut anywhere by a kill, rows added after it, numbers that change by being written.
    #[test]
    fn a_torn_line_is_dropped_and_nothing_else() {
        let folder = folder("journal");
        let path = folder.join(JOURNAL);
        let (mut journal, _, rows) = Journal::open(&folder).unwrap();
        assert!(rows.is_empty());
        assert!(matches!(Journal::open(&folder), Err(StudyError::Busy(_))));
        journal.add(&row(3)).unwrap();
        journal.add(&row(1)).unwrap();
        drop(journal);
        let whole = std::fs::read(&path).unwrap();
        let second = whole.iter().position(|b| *b == b'\n').unwrap() + 1;
        for cut in second..whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let (mut journal, _, rows) = Journal::open(&folder).unwrap();
            assert_eq!(rows, [row(3)], "cut at {cut}");
            journal.add(&row(2)).unwrap();
            drop(journal);
            assert_eq!(read(&folder).unwrap(), [row(2), row(3)]);
        }
        std::fs::write(&path, b"{}\n").unwrap();
        assert!(matches!(
            Journal::open(&folder),
            Err(StudyError::Journal { line: 1, .. })
        ));
        std::fs::remove_dir_all(&folder).ok();
    }

    /// A merge puts another file in the journal's place while a study runs there: whoever comes then must
    /// still find the folder locked.
    #[test]
    fn a_folder_stays_locked_when_its_journal_is_replaced() {
        let folder = folder("lock");
        let (journal, ..) = Journal::open(&folder).unwrap();
        super::super::write_whole(&folder.join(JOURNAL), b"").unwrap();
        assert!(matches!(Journal::open(&folder), Err(StudyError::Busy(_))));
        drop(journal);
        assert!(Journal::open(&folder).is_ok());
        std::fs::remove_dir_all(&folder).ok();
    }

    /// Rows that no such study has, doubled ones, a line without an end; and a user's file that is written
    /// through a link.
    #[cfg(unix)]
    #[test]
    fn a_journal_holds_only_rows_of_its_study() {
        let folder = folder("rows");
        let path = folder.join(JOURNAL);
        let line = |row: &Row| serde_json::to_string(row).unwrap() + "\n";
        let crashed = Row {
            status: Status::Crashed,
            ..row(1)
        };
        let again = line(&crashed) + &line(&row(1));
        std::fs::write(&path, &again).unwrap();
        assert_eq!(read(&folder).unwrap(), [row(1)]);
        for text in [line(&row(4)), line(&row(u64::MAX)), again + &line(&row(1))] {
            std::fs::write(&path, &text).unwrap();
            let number = text.lines().count();
            for error in [read(&folder).err(), Journal::open(&folder).err()] {
                let Some(StudyError::Journal { line, .. }) = error else {
                    panic!("{error:?}");
                };
                assert_eq!(line, number);
            }
        }
        let endless = File::create(&path).unwrap();
        endless.set_len(MOST_LINE + 1).unwrap();
        assert!(matches!(read(&folder), Err(StudyError::Journal { .. })));

        let theirs = folder.join("theirs");
        for name in [JOURNAL, LOCK] {
            let path = folder.join(name);
            std::fs::remove_file(&path).unwrap();
            std::fs::write(&theirs, "no line break").unwrap();
            std::os::unix::fs::symlink(&theirs, &path).unwrap();
            assert!(matches!(Journal::open(&folder), Err(StudyError::Taken(_))));
            assert_eq!(std::fs::read(&theirs).unwrap(), b"no line break");
            std::fs::remove_file(&path).unwrap();
        }
        std::fs::remove_dir_all(&folder).ok();
    }
}
