//! The rerun stream under a recording: where it goes, on which timelines, and when it is flushed.
//!
//! Two runs with one seed must give recordings that `rerun rrd compare` finds equal. So the ids
//! come from scenario and seed, no row carries the wall clock, and batches are cut where simulated
//! time says, never by a timer. The sdk puts rows of one entity that hold different components
//! into different batches, in no fixed order; so all rows of an entity hold the same ones.

use super::observer_error::{Result, failed};
use super::recording_file::{RecordingFile, SIM_TIME};
use crate::bus::SimTime;
use rerun::external::re_log_types::{BlueprintActivationCommand, LogMsg};
use rerun::log::{ChunkBatcherConfig, TimeColumn};
use rerun::{
    ApplicationId, AsComponents, RecordingStream, RecordingStreamBuilder,
    SerializedComponentColumn, StoreId, StoreKind, TimeCell,
};
use std::path::PathBuf;
use std::time::Duration;

/// Number of the camera frame.
pub(super) const FRAME: &str = "frame";

/// How long a viewer may take to answer before the recording gives up on it.
const VIEWER_TIMEOUT: Duration = Duration::from_secs(10);

/// Where a recording goes.
#[derive(Clone, Debug)]
pub(super) enum Target {
    /// Into this file.
    File(PathBuf),
    /// To the viewer that listens at this address.
    Viewer(String),
}

/// Simulated time between flushes. A killed process loses no more of a recording than this and the time to
/// the next event, together under a second; a viewer lags as far. A finished file has larger batches.
pub(super) const FLUSH_S: f64 = 0.8;

/// An open stream; clones of it are the same one.
#[derive(Clone)]
pub(super) struct RowStream {
    rerun: RecordingStream,
    file: Option<RecordingFile>,
    application: ApplicationId,
}

impl RowStream {
    /// Opens the stream of one run. A file is written beside its final name until [`Self::finish`].
    pub(super) fn open(target: &Target, scenario: &str, seed: u64) -> Result<Self> {
        // Viewers keep one layout an application, and each scenario has its own.
        let application = ApplicationId::new_or_unknown(format!("metrotwin-{scenario}"));
        let id = match target {
            Target::File(_) => StoreId::new(
                StoreKind::Recording,
                application.clone(),
                format!("{scenario}-seed-{seed}"),
            ),
            // A viewer would mix two runs under one id.
            Target::Viewer(_) => StoreId::random(StoreKind::Recording, application.clone()),
        };
        let builder = RecordingStreamBuilder::from_store_id(&id)
            .enabled(true)
            .send_properties(false)
            .batcher_config(ChunkBatcherConfig::NEVER);
        let (rerun, file) = match target {
            Target::File(path) => {
                let file = RecordingFile::create(path)?;
                let (_, store, properties, batches, hooks, _) = builder.into_args();
                let sink = Box::new(file.clone());
                let stream = RecordingStream::new(store, properties, batches, hooks, sink);
                (stream, Some(file))
            }
            Target::Viewer(url) => (builder.connect_grpc_opts(url.as_str()), None),
        };
        let rerun = rerun.map_err(failed("opening the recording"))?;
        rerun.set_log_time_enabled(false);
        rerun.set_log_tick_enabled(false);
        rerun
            .send_recording_name(format!("{scenario}, seed {seed}"))
            .map_err(failed("naming the recording"))?;
        let stream = Self {
            rerun,
            file,
            application,
        };
        stream.flush()?;
        Ok(stream)
    }

    /// The name that viewers file this recording and its layout under.
    pub(super) fn application(&self) -> &ApplicationId {
        &self.application
    }

    /// All rows from here on happen at this time.
    pub(super) fn at(&self, time: SimTime) {
        self.rerun.reset_time();
        self.rerun
            .set_time(SIM_TIME, TimeCell::from_duration_nanos(time.nanos()));
    }

    /// As [`Self::at`], of a numbered camera frame.
    pub(super) fn at_frame(&self, time: SimTime, number: u32) {
        self.at(time);
        self.rerun.set_time_sequence(FRAME, number);
    }

    /// One row.
    pub(super) fn log(&self, path: &str, what: &dyn AsComponents) -> Result {
        self.rerun.log(path, what).map_err(failed(path))
    }

    /// What holds for the whole run.
    pub(super) fn log_static(&self, path: &str, what: &dyn AsComponents) -> Result {
        self.rerun.log_static(path, what).map_err(failed(path))
    }

    /// Many rows at once.
    pub(super) fn columns(
        &self,
        path: &str,
        times_ns: &[i64],
        columns: impl IntoIterator<Item = SerializedComponentColumn>,
    ) -> Result {
        let times = TimeColumn::new_duration_nanos(SIM_TIME, times_ns.iter().copied());
        self.rerun
            .send_columns(path, [times], columns)
            .map_err(failed(path))
    }

    /// A layout for the viewer.
    pub(super) fn blueprint(&self, messages: Vec<LogMsg>, id: StoreId) {
        let activation = BlueprintActivationCommand {
            blueprint_id: id,
            make_active: true,
            make_default: true,
        };
        self.rerun.send_blueprint(messages, activation);
    }

    /// Cuts the batches here and passes them on.
    pub(super) fn flush(&self) -> Result {
        let (flushed, doing) = match self.file {
            Some(_) => (self.rerun.flush_blocking(), "writing the recording"),
            None => (
                self.rerun.flush_with_timeout(VIEWER_TIMEOUT),
                "sending the recording to the viewer",
            ),
        };
        flushed.map_err(failed(doing))
    }

    /// Ends the stream; a file gets its name.
    pub(super) fn finish(self) -> Result {
        self.flush()?;
        match self.file {
            Some(file) => file.finish(),
            None => {
                self.rerun.finalize_deferred_sinks();
                Ok(())
            }
        }
    }
}
