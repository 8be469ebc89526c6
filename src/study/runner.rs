//! Runs what a study still lacks.

use super::collected::CollectedRows;
use super::journal::Journal;
use super::manifest;
use super::pool::{Next, Pool, worker_log};
use super::stop::Precision;
use super::{Manifest, Result, Row, Shard, Status, StudyError, announce, copy_inputs, table};
use crate::files;
use crate::scenario::sampling::{Inputs, MOST_RUNS, Template};
use crate::session::RendererChoice;
use crate::settings::Problem;
use crate::twin::render::Backend;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::available_parallelism;
use std::time::{Duration, Instant};

/// How to run a study, apart from what its file says.
#[derive(Default)]
pub struct Options<'a> {
    /// Workers. Default: one a core.
    pub jobs: Option<usize>,
    /// Go on with what the folder holds.
    pub resume: bool,
    /// Only a part of it.
    pub shard: Option<Shard>,
    /// Which renderer.
    pub renderer: RendererChoice,
    /// A run that takes longer has hung: it is given up, as a row that says so. Default: an hour.
    pub run_limit: Option<Duration>,
    /// Set from elsewhere to begin no more runs.
    pub stop: Option<&'a AtomicBool>,
    /// Called now and then with how far the study is.
    pub progress: Option<&'a dyn Fn(&Progress)>,
}

/// How far a study is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// Rows there are.
    pub done: u64,
    /// Rows there are to be.
    pub of: u64,
    /// Of the rows, how many are not complete.
    pub failed: u64,
    /// Runs a minute, since the start.
    pub per_minute: f64,
}

/// No run is known to take so long, s.
pub const RUN_LIMIT_S: f64 = 3600.0;
/// Combinations of swept values that are drawn from before the first run.
const MOST_CHECKED: u64 = 1000;
/// How often the table is written while runs go on.
const TABLE_EVERY: Duration = Duration::from_secs(60);

/// Says what can be wrong with all runs before the first; gives the precision at which to stop.
pub fn check(template: &Template, in_shards: bool) -> Result<Option<Precision>> {
    // The first run of each combination of swept values.
    for cell in 0..template.cells().min(MOST_CHECKED) {
        template.sample(cell)?;
    }
    table::check_names(template)?;
    if template.runs() > MOST_RUNS {
        let what = format!("{} runs are more than {MOST_RUNS}", template.runs());
        let problem = Problem::new("study.runs", what, "ask for fewer");
        return Err(template.wrong(problem).into());
    }
    let precision = Precision::of(template)?;
    if precision.is_some() && in_shards {
        let what = "looks at all runs, and a shard has only some of them";
        let problem = Problem::new(
            "study.stop.when",
            what,
            "run the study whole, or without it",
        );
        return Err(template.wrong(problem).into());
    }
    Ok(precision)
}

/// Runs what a folder lacks of a study, and gives all its rows in the order of their indexes. The
/// folder gets copies of the inputs, a manifest, the journal of rows, and `rows.parquet`.
pub fn run(template: &Template, folder: &Path, options: &Options<'_>) -> Result<Vec<Row>> {
    let precision = check(template, options.shard.is_some())?;
    let renderer = manifest::renderer(options.renderer)?;
    files::probe(folder).map_err(|source| StudyError::Unwritable {
        path: folder.to_owned(),
        source,
    })?;
    let (journal, rows) = prepare(template, folder, options, &renderer)?;

    let done: BTreeSet<u64> = rows.iter().map(|row| row.index).collect();
    let is_wanted = |k: &u64| options.shard.is_none_or(|s| s.holds(*k)) && !done.contains(k);
    let lacking: Vec<u64> = (0..template.runs()).filter(is_wanted).collect();
    let (before, of) = (rows.len() as u64, (rows.len() + lacking.len()) as u64);
    let mut collected = CollectedRows::new(precision);
    rows.into_iter().for_each(|row| collected.add(row));
    let now = clock();
    let mut collector = Collector {
        template,
        folder,
        options,
        journal,
        begin: now,
        table_written: now,
        before,
        of,
        rows: collected,
    };
    if !collector.rows.are_enough() {
        let next = |row| collector.next(row);
        pool(folder, &renderer, options)?.work(template, lacking, next)?;
    }
    let rows = collector.rows.into_rows();
    table::write(folder, template, &rows)?;
    Ok(rows)
}

/// Makes a folder ready for a study, or makes sure that it holds this one; gives the journal and the
/// rows to keep.
fn prepare(
    template: &Template,
    folder: &Path,
    options: &Options<'_>,
    renderer: &Backend,
) -> Result<(Journal, Vec<Row>)> {
    let (journal, kept, mut rows) = Journal::open(folder)?;
    let unreadable = |e| StudyError::file(&template.path, e);
    let inputs = Inputs::of(template).map_err(unreadable)?;
    let manifest = Manifest::of(template, &inputs, renderer, options.shard)?;
    if let Some(what) = kept.as_ref().and_then(|kept| another_part(kept, &manifest)) {
        let path = folder.to_owned();
        return Err(StudyError::Other { path, what });
    }
    if !options.resume && !rows.is_empty() {
        return Err(StudyError::Exists {
            path: folder.to_owned(),
            rows: rows.len(),
        });
    }
    if kept.is_none() {
        copy_inputs(folder, &inputs)?;
    }
    // With fewer runs than it has, a study keeps those that it has.
    let runs = kept.map_or(0, |kept| kept.runs).max(manifest.runs);
    Manifest { runs, ..manifest }.write(folder)?;
    // What crashed may have done so for want of memory: it is tried again.
    rows.retain(|row| row.status != Status::Crashed);
    Ok((journal, rows))
}

/// What makes the study of a folder another one, or another part of it.
fn another_part(kept: &Manifest, now: &Manifest) -> Option<String> {
    kept.difference(now).or_else(|| {
        let part = |m: &Manifest| m.shard.map_or("the whole".into(), |s| format!("shard {s}"));
        (kept.shard != now.shard).then(|| format!("{} of it, not {}", part(kept), part(now)))
    })
}

fn pool<'a>(folder: &'a Path, renderer: &Backend, options: &Options<'_>) -> Result<Pool<'a>> {
    let cores = available_parallelism().map_or(1, usize::from);
    // What the manifest says, and nothing else where that fails.
    let is_plain = renderer.backend == "cpu";
    let limit = Duration::from_secs_f64(RUN_LIMIT_S);
    let jobs = options.jobs.unwrap_or(cores);
    announce(folder, (1..=jobs).map(worker_log))?;
    Ok(Pool {
        program: std::env::current_exe().map_err(StudyError::Worker)?,
        folder,
        renderer: if is_plain { "cpu" } else { "gpu" },
        jobs,
        run_limit: options.run_limit.unwrap_or(limit),
    })
}

/// The wall clock: for rates, and for the budget of time that the user gives.
#[allow(
    clippy::disallowed_methods,
    reason = "how long a study takes is shown and may be limited; no row depends on it"
)]
fn clock() -> Instant {
    Instant::now()
}

/// Collects the rows, and says when there are enough.
struct Collector<'a> {
    template: &'a Template,
    folder: &'a Path,
    options: &'a Options<'a>,
    journal: Journal,
    rows: CollectedRows,
    begin: Instant,
    table_written: Instant,
    before: u64,
    of: u64,
}

impl Collector<'_> {
    fn next(&mut self, row: Option<Row>) -> Result<Next> {
        let has_come = row.is_some();
        row.map_or(Ok(()), |row| self.add(row))?;
        self.show_progress();
        if has_come && self.rows.are_enough() {
            return Ok(Next::End);
        }
        let after_s = self.template.settings.stop.after_s;
        let is_late = after_s.is_some_and(|limit| self.begin.elapsed().as_secs_f64() > limit);
        let is_stopped = self.options.stop.is_some_and(|s| s.load(Ordering::Relaxed));
        Ok(if is_late || is_stopped {
            Next::BeginNoMore
        } else {
            Next::GoOn
        })
    }

    fn add(&mut self, row: Row) -> Result {
        self.journal.add(&row)?;
        self.rows.add(row);
        if self.table_written.elapsed() > TABLE_EVERY {
            table::write(self.folder, self.template, self.rows.iter())?;
            self.table_written = clock();
        }
        Ok(())
    }

    fn show_progress(&self) {
        let Some(show) = self.options.progress else {
            return;
        };
        let done = self.rows.len();
        let minutes = self.begin.elapsed().as_secs_f64() / 60.0;
        show(&Progress {
            done,
            of: self.of,
            failed: self.rows.incomplete(),
            per_minute: (done - self.before) as f64 / minutes.max(1e-9),
        });
    }
}
