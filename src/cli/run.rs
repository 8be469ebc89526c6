//! `metrotwin run`: one scenario, from start to summary.

use super::fault::Failure;
use super::folder::{prepare, unusable};
use super::running::{ProgressBar, RUN_BAR, STOP, seed, stop_on_signals};
use super::scenario_fault::load_scenario;
use super::{notes, print, table};
use crate::files::{self, Listing};
use crate::record::{self, FixTable, Recording};
use crate::scenario::sampling::ScenarioSample;
use crate::scenario::{Override, Scenario};
use crate::session::{self, End, Observer, RendererChoice, RunOptions, Summary};
use crate::study::{Fixes, Row, Study, StudyError};
use std::io;
use std::net::{TcpStream, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::time::Duration;

const AFTER: &str = "\
Into the output folder go:
  recording.rrd   everything, for the rerun viewer: rerun out/line_run/recording.rrd
  summary.json    the figures; keys: docs/summary.schema.json of the source tree
  fixes.csv       every position, with its truth (of train k: fixes_train_k.csv)
  files.txt       the list of these files
The next run into the folder replaces them. Files that the list does not name are never removed or written
over: where one has the name of a result, nothing is run.
Each is written under a temporary name, .part, and renamed when it is complete. A run that is killed
leaves recording.rrd.part, up to its last second: renamed, it opens in the viewer.

Columns of fixes.csv:
  time_s                       when the train was there: mid-exposure of the lamp's row
  method                       paper (stereo) or mono (one camera)
  uid, identity                the lamp, and how it was named: decoded, joined, followed, predicted
  chainage_m, sigma_m          the estimate for the train's head, with one sigma
  true_chainage_m, error_m     the truth, and estimate less truth
  lamp_x_m, lamp_y_m, lamp_z_m the lamp in the left camera's frame: right, down, forward
  track                        name of the track that the fix is on

Examples:
  metrotwin run scenarios/line_run.toml
  metrotwin run scenarios/line_run.toml --set duration_s=5
  metrotwin run scenarios/line_run.toml --set train.cruise_speed_kmh=80 --out out/at_80
  metrotwin run scenarios/line_run.toml --set track.irregularity.class=german_high --seed 7
  metrotwin run scenarios/forgotten_toolbox.toml --view
  metrotwin run scenarios/static_bench.toml --no-recording --json | jq .positioning
  metrotwin run --from-study out/led_accuracy --index 17

Ctrl-C, SIGTERM and SIGHUP end a run cleanly: what it has recorded is kept. A second Ctrl-C ends it at
once, and so does a SIGTERM or SIGHUP a second or more after the first.
Exit code 0 for a whole run, 1 for one that failed or was broken off, 2 for wrong input.";

/// Run a scenario: recording, summary, fixes
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(super) struct RunArgs {
    /// Scenario file
    #[arg(required_unless_present = "from_study")]
    scenario: Option<PathBuf>,
    /// One run of a study again, with everything: the study's folder
    #[arg(long, value_name = "DIR", requires = "index", conflicts_with_all = ["scenario", "seed", "overrides"])]
    from_study: Option<PathBuf>,
    /// Which run of the study
    #[arg(long, value_name = "K", requires = "from_study")]
    index: Option<u64>,
    /// Folder for the results [default: out/<scenario name>, of a study's run <study>/run-<index>]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Everything random follows from it [default: the scenario's]
    #[arg(long, value_name = "N", value_parser = seed())]
    seed: Option<u64>,
    /// Change a value of the scenario, e.g. train.cruise_speed_kmh=80; may be given again
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<Override>,
    /// What draws the images
    #[arg(long, value_enum, default_value_t = RendererChoice::Auto)]
    renderer: RendererChoice,
    /// Write no recording.rrd
    #[arg(long)]
    no_recording: bool,
    /// Print summary.json on standard output, and nothing else there
    #[arg(long)]
    json: bool,
    /// Show the run in the rerun viewer as it goes
    #[arg(long, conflicts_with = "connect")]
    view: bool,
    /// Show the run in a viewer that listens there, e.g. 127.0.0.1:9876
    #[arg(long, value_name = "ADDR")]
    connect: Option<String>,
}

/// Name of the recording in its folder.
const RECORDING: &str = "recording.rrd";
/// Name of the figures' file.
const SUMMARY: &str = "summary.json";
/// Whose files are listed.
const COMMAND: &str = "metrotwin run";

pub(super) fn run(args: &RunArgs) -> Result<(), Failure> {
    let task = task(args)?;
    let scenario = &task.scenario;
    let live = live(args, scenario)?;
    let out = args.out.clone().unwrap_or_else(|| task.out.clone());
    prepare(&out)?;
    // Open until the end: no other command writes into the folder meanwhile.
    let listing = listing(args, scenario, &out).map_err(|error| unusable(&out, &error))?;

    stop_on_signals();
    let mut fixes = Fixes::default();
    let summary = observed(args, scenario, live, &out, &mut fixes)?;
    let text = serde_json::to_string_pretty(&summary).map_err(Failure::run)?;
    // What an earlier run has left would not belong to this summary.
    let written = listing
        .close()
        .and_then(|()| files::write_whole(&out.join(SUMMARY), format!("{text}\n").as_bytes()));
    written
        .map_err(|e| Failure::run(anyhow::Error::new(e).context("cannot write summary.json")))?;
    if args.json {
        print(&text)?;
    } else {
        print(&table::of(&summary, &out)?)?;
    }
    if let Some((sample, row)) = &task.of_study {
        compare(sample, row, &summary, &fixes)?;
    }
    match &summary.end {
        End::Complete => Ok(()),
        End::Interrupted => Err(Failure::Run(anyhow::anyhow!(
            "the run was broken off at {:.1} s of {:.1} s",
            summary.simulated_s,
            scenario.file.duration_s
        ))),
        End::Failed(why) => Err(Failure::Run(anyhow::anyhow!(
            "the run failed at {:.3} s: {why}",
            summary.simulated_s
        ))),
    }
}

/// What is to be run.
struct Task {
    scenario: Scenario,
    /// Where its results go.
    out: PathBuf,
    /// A study's draw, and its row.
    of_study: Option<(ScenarioSample, Row)>,
}

fn task(args: &RunArgs) -> Result<Task, Failure> {
    if let (Some(folder), Some(index)) = (&args.from_study, args.index) {
        return from_study(folder, index);
    }
    if args.index.is_some() {
        return Err(Failure::input(
            "--index says which run of a study, but no study is given",
            "give --from-study DIR in place of a scenario, or leave --index out",
        ));
    }
    let path = args.scenario.as_deref().unwrap_or(Path::new(""));
    let mut scenario = load_scenario(path, &args.overrides)?;
    for note in notes::of(&scenario) {
        eprintln!("note: {note}");
    }
    scenario.file.seed = args.seed.unwrap_or(scenario.file.seed);
    Ok(Task {
        out: Path::new("out").join(&scenario.file.name),
        scenario,
        of_study: None,
    })
}

/// From the copies of the inputs that the study keeps.
fn from_study(folder: &Path, index: u64) -> Result<Task, Failure> {
    let study = Study::open(folder)?;
    if let Some(file) = study.manifest.changed_outside() {
        let file = file.display();
        return Err(Failure::input(
            format!("{file} has changed since the study was run, or is gone"),
            "put it back as it was; the study's folder keeps copies of inputs with relative paths only",
        ));
    }
    let template = &study.template;
    let row = study
        .all_rows()?
        .into_iter()
        .find(|row| row.index == index)
        .ok_or_else(|| {
            Failure::input(
                format!("{} has no row of a run {index}", folder.display()),
                "give the index of one of its rows",
            )
        })?;
    let sample = template.sample(index).map_err(StudyError::from)?;
    Ok(Task {
        scenario: template.scenario(&sample)?,
        out: folder.join(format!("run-{index:06}")),
        of_study: Some((sample, row)),
    })
}

/// Says whether a run came out as it did in its study.
fn compare(
    sample: &ScenarioSample,
    row: &Row,
    summary: &Summary,
    fixes: &Fixes,
) -> Result<(), Failure> {
    match row.difference(&Row::of(sample, summary, fixes)) {
        None => {
            eprintln!("equal to its row in the study, in every figure");
            Ok(())
        }
        Some(what) => Err(Failure::Run(anyhow::anyhow!(
            "not what the study had: {what}; another version, or another graphics driver?"
        ))),
    }
}

/// Runs the session with everything that watches it.
fn observed(
    args: &RunArgs,
    scenario: &Scenario,
    mut live: Option<Recording>,
    out: &Path,
    errors: &mut Fixes,
) -> Result<Summary, Failure> {
    let mut file = (!args.no_recording)
        .then(|| Recording::to_file(&out.join(RECORDING), &scenario.file.record));
    let rigs = scenario.onboard.iter().filter(|o| o.rig.is_some());
    let mut fixes: Vec<_> = rigs.map(|o| FixTable::to_folder(out, o.id())).collect();
    let mut observers: Vec<&mut dyn Observer> = vec![errors];
    observers.extend(file.as_mut().map(|r| r as &mut dyn Observer));
    observers.extend(live.as_mut().map(|r| r as &mut dyn Observer));
    observers.extend(fixes.iter_mut().map(|t| t as &mut dyn Observer));

    let progress = ProgressBar::new(RUN_BAR);
    let show = |now_s| progress.show_run(now_s, scenario.file.duration_s);
    let options = RunOptions {
        renderer: args.renderer,
        stop: Some(&STOP),
        progress: Some(&show),
    };
    let summary = session::run(scenario, &options, &mut observers);
    progress.finish();
    summary.map_err(Failure::run)
}

/// The recording that a viewer shows while it is made.
fn live(args: &RunArgs, scenario: &Scenario) -> Result<Option<Recording>, Failure> {
    if let Some(address) = &args.connect {
        reach(address).map_err(|error| {
            Failure::input(
                format!("--connect {address}: no viewer answers there: {error}"),
                "start the viewer first (`rerun`), or run without --connect",
            )
        })?;
        return Ok(Some(Recording::connect(address, &scenario.file.record)));
    }
    if !args.view {
        return Ok(None);
    }
    Recording::view(&scenario.file.record)
        .map(Some)
        .map_err(|error| {
            Failure::input(
                error,
                "run without --view, and open recording.rrd afterwards",
            )
        })
}

/// Whether anything listens at a viewer's address, `HOST:PORT` or a URL: the recording's own stream
/// only waits for it.
fn reach(address: &str) -> io::Result<()> {
    let place = address
        .rsplit_once("://")
        .map_or(address, |(_, place)| place);
    let place = place.split('/').next().unwrap_or_default();
    let mut last = io::Error::new(io::ErrorKind::NotFound, "it is no HOST:PORT");
    for socket in place.to_socket_addrs()? {
        match TcpStream::connect_timeout(&socket, CONNECT_TIMEOUT) {
            Ok(_) => return Ok(()),
            Err(error) => last = error,
        }
    }
    Err(last)
}

/// A viewer on another continent answers in less.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(3);

/// Lists the files of a run before they are written.
fn listing(args: &RunArgs, scenario: &Scenario, out: &Path) -> io::Result<Listing> {
    let recording = (!args.no_recording).then(|| record::names_of_recording(RECORDING));
    let rigs = scenario.onboard.iter().filter(|o| o.rig.is_some());
    let fixes = rigs.map(|o| FixTable::file_name(o.id()));
    let names = recording.into_iter().flatten().chain(fixes);
    Listing::claim(out, COMMAND, names.chain([SUMMARY.to_owned()]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::FIX_COLUMNS;

    /// Fails where a column has no line in the help.
    #[test]
    fn help_tells_all_columns() {
        let told = AFTER
            .split_once("Columns of fixes.csv:")
            .map_or("", |t| t.1);
        let words: Vec<&str> = told.split([' ', ',', '\n']).collect();
        for column in FIX_COLUMNS.split(',') {
            assert!(words.contains(&column), "{column}");
        }
    }
}
