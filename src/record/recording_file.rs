//! The file of a rerun recording. While it grows, all that is passed to it is in the file when
//! [`LogSink::send`] comes back: a process that is killed loses only rows of a batch that is not cut
//! yet. Its end makes a file of it that is quick to look at: batches of some seconds, and an index. Both
//! would be kept in memory if they were made on the way.

use super::observer_error::{Result, broken, make_folder_of};
use crate::files::{PartFile, part_name};
use rerun::external::re_log_encoding::{DecoderApp, EncodeError, Encoder, EncodingOptions};
use rerun::log::{Chunk, LogMsg};
use rerun::sink::{LogSink, SinkFlushError};
use rerun::{SizeBytes, StoreId, StoreKind};
use std::error::Error;
use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Simulated time since the scenario's start.
pub(super) const SIM_TIME: &str = "sim_time";
/// Recorded time of a batch in the finished file.
const BATCH_NS: i64 = 10_000_000_000;
/// A batch that takes this much memory is written at once; the viewer has the same limit.
const BATCH_BYTES: u64 = 384 << 10;

/// A recording on its way into a file; clones are the same one.
#[derive(Clone)]
pub(super) struct RecordingFile {
    path: PathBuf,
    /// Until the end, or the first error.
    encoder: Arc<Mutex<Result<Encoder<PartFile>, String>>>,
}

impl RecordingFile {
    /// Begins a file, and its folder.
    pub fn create(path: &Path) -> Result<Self> {
        make_folder_of(path)?;
        let part = PartFile::create(path).map_err(broken(path))?;
        let mut encoder = encoder(part).map_err(broken(path))?;
        encoder.do_not_emit_footer();
        Ok(Self {
            path: path.to_owned(),
            encoder: Arc::new(Mutex::new(Ok(encoder))),
        })
    }

    /// Gives the file its name, in larger batches and with an index.
    pub fn finish(&self) -> Result {
        let closed = Err("it is closed".to_owned());
        let encoder = self.with(|encoder| std::mem::replace(encoder, closed));
        let part = encoder.map_err(broken(&self.path))?.into_inner();
        let part = part.map_err(broken(&self.path))?;
        rewrite(&self.path).map_err(broken(&self.path))?;
        drop(part);
        fs::remove_file(part_name(&self.path)).map_err(broken(&self.path))
    }

    fn with<T>(&self, act: impl FnOnce(&mut Result<Encoder<PartFile>, String>) -> T) -> T {
        act(&mut self.encoder.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl LogSink for RecordingFile {
    fn send(&self, message: LogMsg) {
        self.with(|encoder| {
            let sent = encoder.as_mut().map(|encoder| encoder.append(&message));
            if let Ok(Err(error)) = sent {
                *encoder = Err(EncodeError::to_string(&error));
            }
        });
    }

    fn flush_blocking(&self, _: Duration) -> Result<(), SinkFlushError> {
        self.with(|encoder| encoder.as_ref().map(drop).map_err(SinkFlushError::failed))
    }
}

fn encoder(part: PartFile) -> Result<Encoder<PartFile>, EncodeError> {
    let options = EncodingOptions::PROTOBUF_COMPRESSED;
    Encoder::new_eager(rerun::build_info().version, options, part)
}

/// Name under which the finished file is written, while its rows are in `<path>.part`.
fn indexed_name(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".indexed");
    PathBuf::from(name)
}

/// Files that a recording of some name may leave, finished or not, apart from temporary names.
pub(crate) fn names_of_recording(name: &str) -> [String; 2] {
    let indexed = indexed_name(Path::new(name));
    [name.to_owned(), indexed.to_string_lossy().into_owned()]
}

/// Writes the finished file from the rows in `<path>.part`.
fn rewrite(path: &Path) -> Result<(), Box<dyn Error + Send + Sync>> {
    let rows = BufReader::new(File::open(part_name(path))?);
    let mut batches = Batches {
        encoder: encoder(PartFile::create(&indexed_name(path))?)?,
        waiting: Vec::new(),
        begin_ns: 0,
    };
    for message in DecoderApp::decode_lazy(rows) {
        batches.add(message?)?;
    }
    batches.pass_on()?;
    batches.encoder.finish()?;
    Ok(batches.encoder.into_inner()?.finish_as(path)?)
}

/// Puts batches of one entity together.
struct Batches {
    encoder: Encoder<PartFile>,
    /// One of each entity, in the order of their first rows.
    waiting: Vec<(StoreId, Chunk)>,
    begin_ns: i64,
}

impl Batches {
    fn add(&mut self, message: LogMsg) -> Result<(), Box<dyn Error + Send + Sync>> {
        let (store, batch) = match &message {
            LogMsg::ArrowMsg(store, rows) if store.kind() == StoreKind::Recording => {
                (store, Chunk::from_arrow_msg(rows)?)
            }
            _ => {
                self.encoder.append(&message)?;
                return Ok(());
            }
        };
        let Some(times) = batch.timelines().get(&SIM_TIME.into()) else {
            self.encoder.append(&message)?;
            return Ok(());
        };
        let first_ns = times.time_range().min().as_i64();
        if first_ns >= self.begin_ns + BATCH_NS {
            self.pass_on()?;
            self.begin_ns = first_ns;
        }
        let mut waiting = self.waiting.iter();
        let Some(k) = waiting.position(|(_, earlier)| earlier.concatenable(&batch)) else {
            self.waiting.push((store.clone(), batch));
            return Ok(());
        };
        let joined = Chunk::concat_and_sort(&self.waiting[k].1, &batch)?;
        if joined.heap_size_bytes() < BATCH_BYTES {
            self.waiting[k].1 = joined;
            return Ok(());
        }
        let (store, _) = self.waiting.remove(k);
        write(&mut self.encoder, store, &joined)
    }

    fn pass_on(&mut self) -> Result<(), Box<dyn Error + Send + Sync>> {
        for (store, batch) in self.waiting.drain(..) {
            write(&mut self.encoder, store, &batch)?;
        }
        Ok(())
    }
}

fn write(
    encoder: &mut Encoder<PartFile>,
    store: StoreId,
    batch: &Chunk,
) -> Result<(), Box<dyn Error + Send + Sync>> {
    encoder.append(&LogMsg::ArrowMsg(store, batch.to_arrow_msg()?))?;
    Ok(())
}
