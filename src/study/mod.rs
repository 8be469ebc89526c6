//! Many sessions: a study draws scenarios, runs them on all cores, keeps a row of each, and says what
//! they come to, with how sure that is.
//!
//! ```no_run
//! use metrotwin::scenario::sampling::Template;
//! use metrotwin::study::{Options, run};
//!
//! let template = Template::load("scenarios/studies/led_accuracy.toml".as_ref())?;
//! let rows = run(&template, "out/led_accuracy".as_ref(), &Options::default())?;
//! println!("{} runs", rows.len());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # How it goes
//!
//! Run k depends on the study's seed and k alone ([`scenario::sampling`](crate::scenario::sampling)), so rows are
//! the same for one worker and many, for shards on other machines, and for a study that was killed and
//! resumed. Workers are processes of their own, one a core: a software graphics driver starts threads
//! of its own, and two processes with one each do more than one with two; and a driver that
//! crashes costs one run. Each row is appended to a journal and synced; a table in Parquet is made
//! of it. A run that fails is a row with its reason.
//!
//! # What it does not do
//!
//! Schedule over machines: `submit` hands the shards to Slurm as a job array.

mod all_trains;
mod collected;
mod compare;
mod digest;
mod folder;
mod journal;
mod manifest;
mod measures;
mod merge;
mod pool;
mod report;
mod row;
mod runner;
mod scale;
mod shard;
mod slurm;
pub mod stats;
mod stop;
mod swept;
mod table;
mod worker;

pub use compare::{Comparison, Difference, compare};
pub use digest::{Digest, EarlyStop, EventDigest, FigureDigest, QUANTILES, Sensitivity, WorstCase};
pub use folder::Study;
pub use journal::read as read_rows;
pub use manifest::{INPUTS, MANIFEST, Manifest};
pub use measures::{Fixes, MEASURES, Measure, measure};
pub use merge::merge;
pub use report::{REPORT, report};
pub use row::{Row, Status};
pub use runner::{Options, Progress, RUN_LIMIT_S, check, run};
pub use scale::WorseSide;
pub use shard::{MOST_SHARDS, Shard};
pub use slurm::{Submission, Submitted};
pub use swept::{ByValue, SweptDigest, ValueDigest};
pub use worker::{ScenarioRunner, serve};

use crate::files::{self, LIST, Listing};
use crate::scenario::ScenarioError;
use crate::scenario::sampling::{Inputs, SampleError};
use crate::session::ObserverError;
use std::io;
use std::path::{Path, PathBuf};

type Result<T = (), E = StudyError> = std::result::Result<T, E>;

/// Why a study cannot begin or go on. Rows written before are kept.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A file of the study's folder.
    #[error("{}: {source}{}", path.display(), advice(source))]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A line that is no row.
    #[error(
        "{}, line {line}: {why}; put the file back as `study run` wrote it, or choose another folder",
        path.display()
    )]
    Journal {
        /// The journal.
        path: PathBuf,
        /// Line, counted from 1.
        line: usize,
        /// What the parser says.
        why: String,
    },
    /// A manifest or a journal that no study has written.
    #[error(
        "{}: {what}; put the file back as `study run` wrote it, or run the study into another folder",
        path.display()
    )]
    Manifest {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, or with which of its keys.
        what: String,
    },
    /// A copy of an input in the study's folder.
    #[error(
        "{} is not what the study was run with, or is gone; put it back as it was, or run the study \
         into another folder",
        .0.display()
    )]
    Changed(PathBuf),
    /// A file that no study has written has the name of one of the study's, or the folder is another
    /// command's.
    #[error("{0}; choose another folder, or move what is there away")]
    Taken(io::Error),
    /// Nothing can be written into a folder.
    #[error("cannot write into {}: {source}; give another --out, or make that one writable", path.display())]
    Unwritable {
        /// The folder.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The folder holds a study already.
    #[error("{} holds {rows} rows of this study already; give --resume to go on, or another --out", path.display())]
    Exists {
        /// The folder.
        path: PathBuf,
        /// How many rows.
        rows: usize,
    },
    /// The folder holds another study.
    #[error("{} holds another study: {what}; give another --out", path.display())]
    Other {
        /// The folder.
        path: PathBuf,
        /// What differs.
        what: String,
    },
    /// Another process runs it.
    #[error("another `study run` is at work in {}", .0.display())]
    Busy(PathBuf),
    /// There is no study in a folder.
    #[error("{} holds no study (no {MANIFEST}); give the --out of a `study run`", .0.display())]
    NoStudy(PathBuf),
    /// No run can be drawn.
    #[error(transparent)]
    Sample(#[from] SampleError),
    /// A name or number that cannot be used, shards that are not a whole, or an error of Slurm's.
    #[error("{0}")]
    Unusable(String),
    /// A copy of the inputs is wrong.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The table of rows.
    #[error("{0}; all rows are kept in rows.jsonl, and --resume writes the table again")]
    Table(#[from] ObserverError),
    /// No worker could be started.
    #[error("cannot start a worker: {0}")]
    Worker(io::Error),
    /// There is nothing to draw with.
    #[error("no graphics adapter found; install a driver, or give --renderer auto or cpu")]
    NoAdapter,
}

impl StudyError {
    pub(crate) fn file(path: &Path, source: io::Error) -> Self {
        Self::File {
            path: path.to_owned(),
            source,
        }
    }
}

/// Whose files are listed.
const COMMAND: &str = "metrotwin study";

/// Lists files of a study's folder before they are written, by their paths below it.
fn announce(folder: &Path, names: impl IntoIterator<Item = String>) -> Result {
    let listed = Listing::claim(folder, COMMAND, names.into_iter().collect());
    listed
        .map(drop)
        .map_err(|source| not_written(&folder.join(LIST), source))
}

/// Why a file of a study's folder is not written.
fn not_written(path: &Path, source: io::Error) -> StudyError {
    match source.kind() {
        io::ErrorKind::AlreadyExists => StudyError::Taken(source),
        _ => StudyError::file(path, source),
    }
}

/// Why a file of a study's folder is not read.
fn not_read(path: &Path, source: io::Error) -> StudyError {
    match source.kind() {
        io::ErrorKind::InvalidInput => StudyError::Manifest {
            path: path.to_owned(),
            what: source.to_string(),
        },
        _ => StudyError::file(path, source),
    }
}

/// Copies the inputs into a study's folder.
fn copy_inputs(folder: &Path, inputs: &Inputs) -> Result {
    let names = inputs.copies(Path::new(INPUTS));
    announce(
        folder,
        names.map(|name| name.to_string_lossy().into_owned()),
    )?;
    let copied = inputs.copy_to(&folder.join(INPUTS), files::write_whole);
    copied.map_err(|source| StudyError::file(folder, source))
}

fn write_whole(path: &Path, content: &[u8]) -> Result {
    files::write_whole(path, content).map_err(|source| StudyError::file(path, source))
}

fn advice(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge => {
            "; make room and give --resume: all rows before are kept"
        }
        _ => "",
    }
}
