//! Runs what a study still lacks.

use super::journal::{self, Journal};
use super::pool::{Pool, Watch};
use super::stop::Precision;
use super::{INPUTS, Manifest, Row, Shard, Status, StudyError, table};
use crate::scenario::draw::{Inputs, MOST_RUNS, Template};
use crate::session::RendererChoice;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::available_parallelism;
use std::time::{Duration, Instant};

/// How to run a study, apart from what its file says.
#[derive(Default)]
pub struct Options<'a> {
    /// Workers; 0 is one a core.
    pub jobs: usize,
    /// Go on with what the folder holds.
    pub resume: bool,
    /// Only a part of it.
    pub shard: Option<Shard>,
    /// Which renderer.
    pub renderer: RendererChoice,
    /// A run that takes longer has hung: it is given up, as a row that says so. None of its own: an hour.
    pub run_limit: Option<Duration>,
    /// Set from elsewhere to begin no more runs.
    pub stop: Option<&'a AtomicBool>,
    /// Told how far it is, now and then.
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
pub fn check(template: &Template, in_shards: bool) -> Result<Option<Precision>, StudyError> {
    // The first run of each combination of swept values.
    for cell in 0..template.cells().min(MOST_CHECKED) {
        template.draw(cell)?;
    }
    table::check_names(template)?;
    if template.runs() > MOST_RUNS {
        let what = format!(
            "has {} runs, more than {MOST_RUNS}; ask for fewer",
            template.runs()
        );
        return Err(StudyError::Name("the study".into(), what));
    }
    let precision = Precision::of(template)?;
    if precision.is_some() && in_shards {
        return Err(StudyError::Shards(
            "study.stop.when looks at all runs, and a shard does not see the others': run the study \
             whole, or without it"
                .into(),
        ));
    }
    Ok(precision)
}

/// Runs what a folder lacks of a study, and gives all its rows in the order of their indexes. The
/// folder gets copies of the inputs, a manifest, the journal of rows, and `rows.parquet`.
pub fn run(
    template: &Template,
    folder: &Path,
    options: &Options<'_>,
) -> Result<Vec<Row>, StudyError> {
    let precision = check(template, options.shard.is_some())?;
    let manifest = Manifest::of(template, options.renderer, options.shard)?;
    fs::create_dir_all(folder).map_err(|e| StudyError::file(folder, e))?;
    let kept = Manifest::read(folder)?;
    check_same(folder, kept.as_ref(), &manifest)?;
    // With fewer runs than it has, a study keeps those that it has.
    let runs = kept.as_ref().map_or(0, |kept| kept.runs).max(manifest.runs);
    let manifest = Manifest { runs, ..manifest };
    let (journal, mut rows) = Journal::open(folder)?;
    if kept.is_none() && !rows.is_empty() {
        return Err(another(folder, "rows without a manifest".into()));
    }
    if !options.resume && !rows.is_empty() {
        return Err(StudyError::Exists {
            path: folder.to_owned(),
            rows: rows.len(),
        });
    }
    if kept.is_none() {
        let unreadable = |e| StudyError::file(folder, e);
        let inputs = Inputs::of(template).map_err(unreadable)?;
        inputs.copy_to(&folder.join(INPUTS)).map_err(unreadable)?;
    }
    manifest.write(folder)?;

    // What crashed may have done so for want of memory: it is tried again.
    journal::sort(&mut rows);
    rows.retain(|row| row.status != Status::Crashed);
    let done: BTreeSet<u64> = rows.iter().map(|row| row.index).collect();
    let wanted = |k: &u64| options.shard.is_none_or(|s| s.holds(*k));
    let lacking: Vec<u64> = (0..template.runs())
        .filter(wanted)
        .filter(|k| !done.contains(k))
        .collect();
    let mut office = Office::new(
        template,
        folder,
        options,
        journal,
        rows,
        precision,
        lacking.len(),
    );
    if !office.is_known_well_enough() {
        pool(folder, &manifest, options)?.work(template, lacking, &mut office)?;
    }
    let rows = office.rows();
    table::write(folder, template, &rows)?;
    Ok(rows)
}

fn check_same(folder: &Path, kept: Option<&Manifest>, now: &Manifest) -> Result<(), StudyError> {
    let Some(kept) = kept else {
        return Ok(());
    };
    let what = kept.difference(now).or_else(|| {
        let part = |m: &Manifest| m.shard.map_or("the whole".into(), |s| format!("shard {s}"));
        (kept.shard != now.shard).then(|| format!("{} of it, not {}", part(kept), part(now)))
    });
    match what {
        None => Ok(()),
        Some(what) => Err(another(folder, what)),
    }
}

fn another(folder: &Path, what: String) -> StudyError {
    let path = folder.to_owned();
    StudyError::Other { path, what }
}

fn pool<'a>(
    folder: &'a Path,
    manifest: &Manifest,
    options: &Options<'_>,
) -> Result<Pool<'a>, StudyError> {
    let cores = available_parallelism().map_or(1, usize::from);
    let jobs = if options.jobs == 0 {
        cores
    } else {
        options.jobs
    };
    Ok(Pool {
        program: std::env::current_exe().map_err(StudyError::Worker)?,
        folder,
        // What the manifest says, and nothing else where that fails.
        renderer: if manifest.renderer.backend == "cpu" {
            "cpu"
        } else {
            "gpu"
        },
        jobs,
        run_limit: options
            .run_limit
            .unwrap_or(Duration::from_secs_f64(RUN_LIMIT_S)),
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

/// Takes in the rows.
struct Office<'a> {
    template: &'a Template,
    folder: &'a Path,
    options: &'a Options<'a>,
    journal: Journal,
    rows: Vec<Row>,
    precision: Option<Precision>,
    begin: Instant,
    tabled: Instant,
    /// Rows that the precision has looked at.
    looked: usize,
    before: u64,
    of: u64,
}

impl<'a> Office<'a> {
    fn new(
        template: &'a Template,
        folder: &'a Path,
        options: &'a Options<'a>,
        journal: Journal,
        rows: Vec<Row>,
        precision: Option<Precision>,
        lacking: usize,
    ) -> Self {
        Self {
            looked: 0,
            before: rows.len() as u64,
            of: (rows.len() + lacking) as u64,
            template,
            folder,
            options,
            journal,
            rows,
            precision,
            begin: clock(),
            tabled: clock(),
        }
    }

    fn is_known_well_enough(&mut self) -> bool {
        journal::sort(&mut self.rows);
        let (rows, looked) = (&self.rows, &mut self.looked);
        (self.precision.as_ref()).is_some_and(|p| p.enough(rows, looked).is_some())
    }

    /// In order, up to where the study stops.
    fn rows(mut self) -> Vec<Row> {
        journal::sort(&mut self.rows);
        if let Some(precision) = &self.precision {
            precision.truncate(&mut self.rows);
        }
        self.rows
    }

    fn progress(&self) {
        let Some(show) = self.options.progress else {
            return;
        };
        let done = self.rows.len() as u64;
        let minutes = self.begin.elapsed().as_secs_f64() / 60.0;
        let failed = self.rows.iter().filter(|r| !r.is_complete()).count();
        show(&Progress {
            done,
            of: self.of,
            failed: failed as u64,
            per_minute: (done - self.before) as f64 / minutes.max(1e-9),
        });
    }
}

impl Watch for Office<'_> {
    fn row(&mut self, row: Row) -> Result<bool, StudyError> {
        self.journal.add(&row)?;
        self.rows.push(row);
        self.progress();
        if self.tabled.elapsed() > TABLE_EVERY {
            journal::sort(&mut self.rows);
            table::write(self.folder, self.template, &self.rows)?;
            self.tabled = clock();
        }
        Ok(!self.is_known_well_enough())
    }

    fn go_on(&mut self) -> bool {
        self.progress();
        let after_s = self.template.settings.stop.after_s;
        let late = after_s.is_some_and(|limit| self.begin.elapsed().as_secs_f64() > limit);
        let stopped = self.options.stop.is_some_and(|s| s.load(Ordering::Relaxed));
        !late && !stopped
    }
}
