//! Rows on disk as they come: a line of JSON each, appended and synced, so that a kill at any moment
//! loses at most the runs in flight. A last line that is torn is dropped.

use super::{Result, Row, StudyError};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Name of the file in a study's folder.
pub const JOURNAL: &str = "rows.jsonl";
/// The file that whoever writes into the folder has locked. It is never renamed or removed: a lock on
/// the journal would be lost when a merge puts another file in its place.
pub const LOCK: &str = "study.lock";

/// The rows of a study, open to be added to.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    /// Held until it is closed, by whatever end of the process.
    _lock: File,
}

impl Journal {
    /// Opens the journal of a folder, new or to go on with, and locks the folder; gives the rows that
    /// it has.
    pub fn open(folder: &Path) -> Result<(Self, Vec<Row>)> {
        let lock = lock(folder)?;
        let path = folder.join(JOURNAL);
        let failed = |source| StudyError::file(&path, source);
        let mut file = open(&path).map_err(failed)?;
        let mut text = Vec::new();
        file.read_to_end(&mut text).map_err(failed)?;
        let (rows, whole) = parse(&path, &text)?;
        file.set_len(whole as u64).map_err(failed)?;
        file.seek(SeekFrom::End(0)).map_err(failed)?;
        let journal = Self {
            path,
            file,
            _lock: lock,
        };
        Ok((journal, rows))
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
    let file = open(&path).map_err(failed)?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(StudyError::Busy(folder.to_owned())),
        Err(TryLockError::Error(source)) => Err(failed(source)),
    }
}

/// A file to be read and written, made where there is none.
fn open(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false);
    options.open(path)
}

/// The rows of a folder, in the order of their indexes; those that were run twice once.
pub fn read(folder: &Path) -> Result<Vec<Row>> {
    let path = folder.join(JOURNAL);
    let text = std::fs::read(&path).map_err(|source| StudyError::file(&path, source))?;
    let (mut rows, _) = parse(&path, &text)?;
    sort(&mut rows);
    Ok(rows)
}

/// In the order of indexes, each once: of a run that was tried again, the last.
pub fn sort(rows: &mut Vec<Row>) {
    rows.reverse();
    rows.sort_by_key(|row| row.index);
    rows.dedup_by_key(|row| row.index);
}

/// The rows, and how many bytes hold them.
fn parse(path: &Path, text: &[u8]) -> Result<(Vec<Row>, usize)> {
    let whole = text.iter().rposition(|b| *b == b'\n').map_or(0, |k| k + 1);
    let lines = text[..whole].split(|b| *b == b'\n').enumerate();
    let rows = lines.filter(|(_, line)| !line.is_empty());
    let rows = rows.map(|(k, line)| {
        serde_json::from_slice(line).map_err(|e| StudyError::Journal {
            path: path.to_owned(),
            line: k + 1,
            why: e.to_string(),
        })
    });
    Ok((rows.collect::<Result<_, _>>()?, whole))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::study::Status;
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

    /// A line cut anywhere by a kill, rows added after it, numbers that change by being written.
    #[test]
    fn a_torn_line_is_dropped_and_nothing_else() {
        let folder = std::env::temp_dir().join(format!("metrotwin-journal-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join(JOURNAL);
        std::fs::remove_file(&path).ok();
        let (mut journal, rows) = Journal::open(&folder).unwrap();
        assert!(rows.is_empty());
        assert!(matches!(Journal::open(&folder), Err(StudyError::Busy(_))));
        journal.add(&row(3)).unwrap();
        journal.add(&row(1)).unwrap();
        drop(journal);
        let whole = std::fs::read(&path).unwrap();
        let second = whole.iter().position(|b| *b == b'\n').unwrap() + 1;
        for cut in second..whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let (mut journal, rows) = Journal::open(&folder).unwrap();
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
        let folder = std::env::temp_dir().join(format!("metrotwin-lock-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let (journal, _) = Journal::open(&folder).unwrap();
        super::super::write_whole(&folder.join(JOURNAL), b"").unwrap();
        assert!(matches!(Journal::open(&folder), Err(StudyError::Busy(_))));
        drop(journal);
        assert!(Journal::open(&folder).is_ok());
        std::fs::remove_dir_all(&folder).ok();
    }
}
