//! `metrotwin study`: many runs, and what they come to.

use super::fault::Failure;
use super::folder::prepare;
use super::running::{ProgressBar, STOP, stop_on_signals};
use super::scenario_fault::load_template;
use super::{print, signals};
use crate::record::parquet::Kind;
use crate::record::render;
use crate::scenario::Override;
use crate::session::RendererChoice;
use crate::study::{
    self, Digest, MEASURES, MOST_SHARDS, Options, Progress, RUN_LIMIT_S, Row, Shard, Study,
    StudyError, Submission,
};
use clap::{Subcommand, ValueEnum};
use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Duration;

const AFTER: &str = "\
A study is a scenario file with a table [study]: which keys vary and how, conditions between them, how
many runs, when to stop. scenarios/studies has examples.

  metrotwin study run scenarios/studies/led_accuracy.toml --runs 100
  metrotwin study report out/led_accuracy
  metrotwin run --from-study out/led_accuracy --index 17     one of its runs again, recorded

On several machines that share a folder:
  metrotwin study run scenarios/studies/led_accuracy.toml --shard 1/4      and so on to 4/4
  metrotwin study merge out/led_accuracy";

/// Reasons for incomplete runs that are shown.
const MOST_REASONS: usize = 5;

/// Run a study: many runs, rows, statistics, report
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(super) struct StudyArgs {
    #[command(subcommand)]
    command: StudyCommand,
}

#[derive(Subcommand)]
enum StudyCommand {
    Run(RunArgs),
    Merge(MergeArgs),
    Report(ReportArgs),
    Compare(CompareArgs),
    Submit(SubmitArgs),
    /// List the figures of a run that events and stop rules may name
    Figures,
    #[command(hide = true)]
    Worker(WorkerArgs),
}

const AFTER_RUN: &str = "\
Into the output folder go:
  report.html    figures with intervals, plots, worst runs; the plots as SVG in plots/
  rows.parquet   a row a run: what was drawn, what came out, with units and meanings in the schema
  rows.jsonl     the same as they came, appended and synced: a kill loses the runs in flight at most
  study.json     hashes of all inputs, --set, version, renderer; a study goes on only while they are the same
  inputs/        copies of all inputs, from which any run can be made again
  study.lock     locked while a command writes there
  files.txt      the list of these files; others are never written over

Ctrl-C, SIGTERM and SIGHUP begin no more runs and wait for those in flight. A second Ctrl-C, or a SIGTERM or
SIGHUP a second or more after the first, ends at once. --resume goes on later.";

/// Run what a folder lacks of a study
#[derive(clap::Args)]
#[command(after_help = AFTER_RUN)]
struct RunArgs {
    /// Scenario file with a [study]
    study: PathBuf,
    /// Folder for the results [default: out/<name>, of a shard out/<name>/shard-I-of-N]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Number of runs, of a sweep for each combination [default: the study's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    runs: Option<u32>,
    /// Change a value of the study's scenario in all runs, e.g. train.cars=2; may be given again, and with --resume as
    /// before
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<Override>,
    /// Workers, each a process and a core's work [default: one a core]
    #[arg(long, value_name = "J", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Go on with what the folder holds
    #[arg(long)]
    resume: bool,
    /// Only the I-th of N parts, e.g. 2/4
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// What draws the images
    #[arg(long, value_enum, default_value_t = RendererChoice::Auto)]
    renderer: RendererChoice,
    /// Give up a run that takes longer, as one that has hung
    #[arg(long, value_name = "S", default_value_t = RUN_LIMIT_S, value_parser = seconds)]
    run_limit_s: f64,
}

/// Make one study of all shards below its folder
#[derive(clap::Args)]
struct MergeArgs {
    /// Folder that holds shard-1-of-N to shard-N-of-N
    folder: PathBuf,
}

/// Write a study's figures and plots as one page, and print the figures, those of each swept value too
#[derive(clap::Args)]
struct ReportArgs {
    /// Folder of the study
    folder: PathBuf,
}

/// Hold two studies against each other, run by run
#[derive(clap::Args)]
struct CompareArgs {
    /// Folder of a study
    a: PathBuf,
    /// Folder of another one, with the same seed and variables
    b: PathBuf,
    /// Fail unless both are the same, value by value (wall times aside)
    #[arg(long)]
    same: bool,
}

const AFTER_SUBMIT: &str = "\
Writes two scripts into <out>/slurm, an array with a task a shard and a job that merges them, and hands
them to sbatch. The folder must be on a file system that all machines share.

  metrotwin study submit scenarios/studies/led_accuracy.toml --shards 16 --cores 8 \\
      --sbatch=--partition=short --sbatch=--time=01:00:00";

/// Run a study as a Slurm job array, and merge it at the end
#[derive(clap::Args)]
#[command(after_help = AFTER_SUBMIT)]
struct SubmitArgs {
    /// Scenario file with a [study]
    study: PathBuf,
    /// Tasks of the array
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=MOST_SHARDS))]
    shards: u64,
    /// Cores of each task
    #[arg(long, value_name = "C", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    cores: u64,
    /// Folder for the results [default: out/<name>]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Number of runs, of a sweep for each combination [default: the study's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    runs: Option<u32>,
    /// What draws the images
    #[arg(long, value_enum, default_value_t = RendererChoice::Auto)]
    renderer: RendererChoice,
    /// One more argument for sbatch; may be given again
    #[arg(long, value_name = "ARG", allow_hyphen_values = true)]
    sbatch: Vec<String>,
    /// Only write the scripts
    #[arg(long)]
    dry_run: bool,
    /// Come back when the merge has ended
    #[arg(long)]
    wait: bool,
}

/// Answer indexes on standard input with rows on standard output
#[derive(clap::Args)]
struct WorkerArgs {
    folder: PathBuf,
    #[arg(long, value_enum, default_value_t = RendererChoice::Auto)]
    renderer: RendererChoice,
}

pub(super) fn study(args: &StudyArgs) -> Result<(), Failure> {
    match &args.command {
        StudyCommand::Run(args) => run(args),
        StudyCommand::Merge(args) => {
            study::merge(&args.folder)?;
            conclude(&args.folder, true)
        }
        StudyCommand::Report(args) => {
            let study = Study::open(&args.folder)?;
            let rows = study.rows()?;
            let digest = Digest::of(&study.template, &rows);
            let page = study::report(&study, &digest, &rows)?;
            print(&digest_text(&digest)?)?;
            if !digest.swept.is_empty() {
                print(&swept_text(&digest)?)?;
            }
            print(&format!("report  {}", page.display()))
        }
        StudyCommand::Compare(args) => compare(args),
        StudyCommand::Submit(args) => submit(args),
        StudyCommand::Figures => figures(),
        StudyCommand::Worker(args) => {
            // The study's own process is the one that decides when to stop.
            signals::handle(|_| {});
            let input = std::io::BufReader::new(std::io::stdin());
            let output = std::io::stdout().lock();
            Ok(study::serve(&args.folder, args.renderer, input, output)?)
        }
    }
}

fn run(args: &RunArgs) -> Result<(), Failure> {
    let template = load_template(&args.study, &args.overrides)?.with(None, args.runs);
    let out = args.out.clone().unwrap_or_else(|| {
        let out = Path::new("out").join(&template.file.name);
        args.shard
            .map_or(out.clone(), |shard| out.join(shard.folder()))
    });
    stop_on_signals();
    let bar = ProgressBar::new("{bar:40} {pos} of {len} runs{msg}, {elapsed} so far, {eta} to go");
    let show = |progress: &Progress| show(&bar, progress);
    let options = Options {
        jobs: args.jobs.map(usize::from),
        resume: args.resume,
        shard: args.shard,
        renderer: args.renderer,
        run_limit: Some(Duration::from_secs_f64(args.run_limit_s)),
        stop: Some(&STOP),
        progress: Some(&show),
    };
    let rows = study::run(&template, &out, &options);
    bar.finish();
    let rows = rows?;
    conclude(&out, args.shard.is_none())?;
    let is_whole = args.shard.is_none() && rows.len() as u64 >= template.runs();
    if STOP.load(Ordering::Relaxed) && !is_whole {
        let what = format!("broken off with {} rows; --resume goes on", rows.len());
        return Err(Failure::Run(anyhow::anyhow!(what)));
    }
    Ok(())
}

fn figures() -> Result<(), Failure> {
    let mut text =
        "In conditions of events: these figures of a run, and the study's variables, with\n\
         + - * / ^, < <= > >= == !=, && || !, abs sqrt ln exp floor min(x, y) max(x, y)\n\n"
            .to_owned();
    for m in MEASURES.iter().filter(|m| m.kind != Kind::Reals) {
        text += &format!("  {:<28} {:<6} {}\n", m.name, m.unit, m.meaning);
    }
    print(text.trim_end())
}

fn seconds(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().map_err(|e| e.to_string())?;
    let range = 1e-3..=1e9;
    let outside = || format!("is not from {} to {} s", range.start(), range.end());
    range
        .contains(&number)
        .then_some(number)
        .ok_or_else(outside)
}

fn compare(args: &CompareArgs) -> Result<(), Failure> {
    let found = study::compare(&args.a, &args.b)?;
    if args.same {
        return match found.first_difference {
            None => print(&format!("{} rows, the same value by value", found.rows)),
            Some(what) => Err(Failure::Run(anyhow::anyhow!("not the same: {what}"))),
        };
    }
    let template = include_str!("texts/comparison.txt");
    let text = render("comparison.txt", template, found).map_err(Failure::run)?;
    print(&text)
}

fn submit(args: &SubmitArgs) -> Result<(), Failure> {
    let template = load_template(&args.study, &[])?.with(None, args.runs);
    study::check(&template, true)?;
    let name = template.file.name.clone();
    let out = args
        .out
        .clone()
        .unwrap_or_else(|| Path::new("out").join(&name));
    let whole = |path: &Path| std::path::absolute(path).map_err(Failure::run);
    let runs = args
        .runs
        .iter()
        .flat_map(|n| ["--runs".to_owned(), n.to_string()]);
    let renderer = args.renderer.to_possible_value();
    let renderer = renderer
        .iter()
        .flat_map(|value| ["--renderer".to_owned(), value.get_name().to_owned()]);
    let submission = Submission {
        name,
        program: std::env::current_exe().map_err(Failure::run)?,
        study: whole(&args.study)?,
        folder: whole(&out)?,
        shards: args.shards,
        cores: args.cores,
        arguments: runs.chain(renderer).collect(),
        sbatch: args.sbatch.clone(),
    };
    submission.check()?;
    prepare(&out)?;
    if args.dry_run {
        let [array, merge] = submission.write()?;
        return print(&format!("{}\n{}", array.display(), merge.display()));
    }
    let jobs = submission.submit(args.wait)?;
    print(&format!(
        "array {}, merge {}; logs in {}",
        jobs.array,
        jobs.merge,
        submission.scripts().display()
    ))
}

/// Prints what there is now; of a whole study, writes the report.
fn conclude(out: &Path, whole: bool) -> Result<(), Failure> {
    let study = Study::open(out)?;
    let rows = study.rows()?;
    let digest = Digest::of(&study.template, &rows);
    print(&digest_text(&digest)?)?;
    let planned = study.template.runs();
    if whole && (rows.len() as u64) < planned {
        print(&format!("stopped after {} of {planned} runs", rows.len()))?;
    }
    for (reason, count) in reasons(&rows) {
        print(&format!("{count} not complete: {reason}"))?;
    }
    print(&format!("rows    {}", out.join("rows.parquet").display()))?;
    if whole {
        let page = study::report(&study, &digest, &rows)?;
        print(&format!("report  {}", page.display()))?;
    }
    Ok(())
}

/// Why runs are not complete, with how many, the most frequent first.
fn reasons(rows: &[Row]) -> Vec<(&str, usize)> {
    let mut counts = BTreeMap::<&str, usize>::new();
    for row in rows.iter().filter(|row| !row.is_complete()) {
        // What is wrong stands on the first line; the values on the others differ from run to run.
        let reason = row.reason.as_deref().unwrap_or_default();
        *counts
            .entry(reason.lines().next().unwrap_or_default())
            .or_default() += 1;
    }
    let mut counts: Vec<_> = counts.into_iter().collect();
    counts.sort_by_key(|(_, count)| Reverse(*count));
    counts.truncate(MOST_REASONS);
    counts
}

/// What all runs come to.
fn digest_text(digest: &Digest) -> Result<String, Failure> {
    let lines = include_str!("texts/digest_lines.txt");
    let template = lines.to_owned() + include_str!("texts/digest.txt");
    render("digest.txt", &template, digest).map_err(Failure::run)
}

/// What those of each swept value come to.
fn swept_text(digest: &Digest) -> Result<String, Failure> {
    let lines = include_str!("texts/digest_lines.txt");
    let template = lines.to_owned() + include_str!("texts/swept.txt");
    let text = render("swept.txt", &template, digest).map_err(Failure::run)?;
    Ok(text.trim().to_owned())
}

fn show(bar: &ProgressBar, progress: &Progress) {
    let Progress {
        done,
        of,
        failed,
        per_minute,
    } = *progress;
    let rate = format!("; {per_minute:.1} a minute, {failed} failed");
    bar.show(done, of, &rate, || {
        let left = (of - done) as f64 / per_minute;
        let left = left.is_finite().then(|| format!(", {left:.1} min to go"));
        format!("{done} of {of} runs{rate}{}", left.unwrap_or_default())
    });
}

impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Self {
        match error {
            StudyError::Scenario(error) => error.into(),
            StudyError::File { .. } | StudyError::Table(_) | StudyError::Worker(_) => {
                Self::run(error)
            }
            other => Self::input(other, "nothing that was there is lost"),
        }
    }
}
