//! `metrotwin frames`: images with labels, as a data set, from any scenario.

use super::fault::Failure;
use super::folder::{self, prepare};
use super::print;
use super::running::{ProgressBar, RUN_BAR, STOP, seed, stop_on_signals};
use super::scenario_fault::load_scenario;
use crate::record::dataset::{DataSet, FolderError, FramePlan, LabelKinds, Provenance};
use crate::scenario::sampling::Inputs;
use crate::scenario::{Override, Scenario};
use crate::session::{self, End, RendererChoice, RunOptions, Summary};
use std::path::{Path, PathBuf};

const AFTER: &str = "\
Into the folder go, for each frame of each camera, the image as the stack gets it, and
  raw        digital numbers of the converter, 16-bit PNG
  clean      the same picture without noise, glare and most of the smear
  depth      metres, float32 .npy; with flow the largest and slowest: 11 MB for 1280 x 720
  mask       16-bit PNG, the number of the obstacle that a pixel shows
  flow       pixels to the camera's next frame in the set, float32 .npy
  rows       rows.parquet: time and pose of every row of every image
  lamps      lamps.parquet: outline, name, light and code phase of every lamp in view
  obstacles  obstacles.parquet and coco.json: boxes in the image and in space
and frames.parquet, README.md (describes every file and column), scenario.toml (as it was run), inputs/
(copies of what it names), meta.json and files.txt (the list of all files).
--labels takes some of these words, separated by commas.

The images are those of `metrotwin run` with the same scenario and seed; all that is taken is what
--every, --from, --to and --limit leave. The scenario runs from its start in any case.

Examples:
  metrotwin frames scenarios/obstacle_gallery.toml --out out/gallery --every 5
  metrotwin frames scenarios/line_run.toml --out out/lamps --from 20 --limit 100 --labels lamps,rows
  metrotwin frames scenarios/line_run.toml --out out/left --cameras left --to 30 --labels clean,depth
  metrotwin frames scenarios/forgotten_toolbox.toml --out out/day2 --seed 2 --cameras W1530

Ctrl-C, SIGTERM and SIGHUP end it cleanly: what has been taken is a whole, smaller set. A second Ctrl-C,
or a SIGTERM or SIGHUP a second or more after the first, ends it at once; the same command then begins
the set anew.
Exit code 0 for a whole set, 1 where the run failed or was broken off, 2 for wrong input.";

/// Images + labels of a scenario as a data set
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(super) struct FramesArgs {
    /// Scenario file
    scenario: PathBuf,
    /// Folder for the data set
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Everything random follows from it [default: the scenario's]
    #[arg(long, value_name = "N", value_parser = seed())]
    seed: Option<u64>,
    /// Change a value of the scenario, e.g. rig.width_px=640; may be given again
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<Override>,
    /// What draws the images
    #[arg(long, value_enum, default_value_t = RendererChoice::Auto)]
    renderer: RendererChoice,
    /// Take each N-th frame of a camera only
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Take frames from this time on
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    from: f64,
    /// Take frames until this time [default: the scenario's end]
    #[arg(long, value_name = "SECONDS")]
    to: Option<f64>,
    /// Take at most N frames of each camera
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    limit: Option<u32>,
    /// Names of the cameras: left, right, wayside devices [default: all]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    cameras: Vec<String>,
    /// What to write beside the images: all, none, or words from the list below
    #[arg(long, value_name = "WORD,...", default_value = "all")]
    labels: LabelKinds,
    /// Write into a folder that is not empty; of an earlier data set there, the files that it lists are
    /// removed, and nothing else
    #[arg(long)]
    force: bool,
}

pub(super) fn frames(args: &FramesArgs) -> Result<(), Failure> {
    let mut scenario = load_scenario(&args.scenario, &args.overrides)?;
    scenario.file.seed = args.seed.unwrap_or(scenario.file.seed);
    let plan = plan(args, &scenario)?;

    stop_on_signals();
    let renderer = session::renderer(&scenario, args.renderer).map_err(Failure::run)?;
    let overrides = args.overrides.iter();
    let provenance = Provenance {
        inputs: Some(Inputs::of_scenario(&args.scenario, &scenario.file).map_err(Failure::run)?),
        overrides: overrides.map(Override::assignment).collect(),
    };
    let progress = ProgressBar::new(RUN_BAR);
    let to_s = plan.to_s.min(scenario.file.duration_s);
    let mut set = DataSet::new(&args.out, &scenario, plan, provenance, renderer, &STOP);
    set.claim(args.force).map_err(|e| unusable(&args.out, &e))?;
    prepare(&args.out)?;
    let show = |now_s| progress.show_run(now_s, to_s);
    let options = RunOptions {
        renderer: args.renderer,
        stop: Some(&STOP),
        progress: Some(&show),
    };
    let summary = session::run(&scenario, &options, &mut [&mut set]);
    progress.finish();
    let summary = summary.map_err(Failure::run)?;
    print(&closing(&set, &summary, &args.out))?;
    match summary.end {
        End::Interrupted if !set.is_complete() => Err(Failure::Run(anyhow::anyhow!(
            "the run was broken off at {:.1} s; what was taken is kept",
            summary.simulated_s
        ))),
        End::Failed(why) => Err(Failure::Run(anyhow::anyhow!(
            "the run failed at {:.3} s: {why}; what was taken is kept",
            summary.simulated_s
        ))),
        _ => Ok(()),
    }
}

/// What the arguments ask for, held against what the scenario has.
fn plan(args: &FramesArgs, scenario: &Scenario) -> Result<FramePlan, Failure> {
    let there = DataSet::cameras_of(scenario);
    if there.is_empty() {
        return Err(Failure::input(
            format!("{} has no camera", args.scenario.display()),
            "give it a [rig] on a [train], or a [[wayside]] device",
        ));
    }
    if let Some(name) = args.cameras.iter().find(|name| !there.contains(name)) {
        return Err(Failure::input(
            format!("--cameras {name}: the scenario has no such camera"),
            format!("give some of: {}", there.join(", ")),
        ));
    }
    let to_s = args.to.unwrap_or(f64::INFINITY);
    let begins = args.from >= 0.0 && args.from < scenario.file.duration_s;
    // Each comparison with NaN is false.
    let ends = to_s >= args.from;
    if !begins || !ends {
        return Err(Failure::input(
            format!(
                "--from {} --to {to_s}: no frame of the scenario, which lasts {} s, is between them",
                args.from, scenario.file.duration_s
            ),
            "give seconds since the scenario's start, the earlier one as --from",
        ));
    }
    Ok(FramePlan {
        every: args.every,
        from_s: args.from,
        to_s,
        limit: args.limit,
        cameras: args.cameras.clone(),
        labels: args.labels.clone(),
    })
}

/// What is said of a folder that cannot be used.
fn unusable(out: &Path, error: &FolderError) -> Failure {
    let remedy = match error {
        FolderError::Occupied | FolderError::NotEmpty => {
            "choose another folder with --out, or give --force: of an earlier data set there, the files \
             that it lists are then removed, and nothing else"
        }
        FolderError::Taken(_) => "choose another folder with --out, or move that file away",
        FolderError::Io(error) => return folder::unusable(out, error),
    };
    Failure::input(format!("cannot use {}: {error}", out.display()), remedy)
}

/// What there is now, and how fast it came.
fn closing(set: &DataSet<'_>, summary: &Summary, out: &Path) -> String {
    let (frames, wall_s) = (set.frames(), summary.wall_s);
    let backend = &summary.renderer;
    format!(
        "{frames} frames in {}\n{wall_s:.1} s, {:.2} frames/s; drawn by {} ({})\n\
         Every file and column: {}",
        out.display(),
        frames as f64 / wall_s,
        backend.backend,
        backend.adapter,
        out.join("README.md").display()
    )
}
