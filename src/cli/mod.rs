//! The command line, one file a subcommand.
//!
//! Results go to standard output, everything else to standard error. Exit codes: 0 it worked,
//! 1 a run failed or was broken off, 2 the input is wrong and nothing was begun.
//!
//! ```text
//! metrotwin run SCENARIO      one run: recording.rrd, summary.json, fixes.csv
//! metrotwin frames SCENARIO   images + labels as a data set
//! metrotwin generate SCENARIO concrete scenarios drawn from a template
//! metrotwin study run STUDY   many runs, and what they come to
//! metrotwin check FILE...     tunnels and scenarios: errors and a short report
//! metrotwin locate            on which track a train was, from recorded fixes
//! metrotwin import osm FILE   a tunnel from a map of others
//! metrotwin export geojson    a tunnel on a map
//! metrotwin doctor            graphics adapters, and how fast this machine is
//! ```

mod chainage;
mod check;
mod excerpt;
mod export;
mod fault;
mod file_kind;
mod folder;
mod import;
mod locate;
mod map;
mod result_file;
mod tunnel;

/// What needs the simulated world.
#[cfg(feature = "twin")]
mod check_scenario;
#[cfg(feature = "twin")]
mod doctor;
#[cfg(feature = "twin")]
mod driver_noise;
#[cfg(feature = "twin")]
mod frames;
#[cfg(feature = "twin")]
mod generate;
#[cfg(feature = "twin")]
mod notes;
#[cfg(feature = "twin")]
mod report;
#[cfg(feature = "twin")]
mod run;
#[cfg(feature = "twin")]
mod running;
#[cfg(feature = "twin")]
mod scenario_fault;
#[cfg(feature = "twin")]
mod signals;
#[cfg(feature = "twin")]
mod study;
#[cfg(feature = "twin")]
mod table;

pub use check::check_text;

use clap::{ArgAction, Parser, Subcommand};
use fault::Failure;
use std::io::{IsTerminal, Write};
use std::process::ExitCode;
use tracing::level_filters::LevelFilter;

const ABOUT: &str = "\
A digital twin of a metro tunnel. A simulated train shakes along a surveyed line; cameras on its
head and on the tunnel wall see what such cameras would see; the positioning and detection stack
reads those pixels, never the truth; its decisions act on the train.";

const AFTER: &str = "\
A first run:
  metrotwin check scenarios/*.toml                what the shipped scenarios do
  metrotwin run scenarios/static_bench.toml       writes out/static_bench/
  rerun out/static_bench/recording.rrd            shows it

Exit codes:
  0  it worked
  1  a run failed or was broken off; what it had recorded is kept
  2  the input is wrong; nothing was begun and nothing written";

#[derive(Parser)]
#[command(name = "metrotwin", version, about = ABOUT, after_help = AFTER)]
struct Cli {
    /// Say more on standard error: -v what happens, -vv in detail
    #[arg(short, long, action = ArgAction::Count, global = true)]
    verbose: u8,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    #[cfg(feature = "twin")]
    Run(run::RunArgs),
    #[cfg(feature = "twin")]
    Frames(frames::FramesArgs),
    #[cfg(feature = "twin")]
    Generate(generate::GenerateArgs),
    #[cfg(feature = "twin")]
    Study(study::StudyArgs),
    Check(check::CheckArgs),
    Locate(locate::LocateArgs),
    Import(import::ImportArgs),
    Export(export::ExportArgs),
    #[cfg(feature = "twin")]
    Doctor(doctor::DoctorArgs),
}

/// Reads the arguments, does what they say, and gives the exit code.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    start_messages(cli.verbose);
    #[cfg(feature = "twin")]
    if !matches!(
        cli.command,
        Command::Check(_)
            | Command::Export(_)
            | Command::Generate(_)
            | Command::Import(_)
            | Command::Locate(_)
    ) {
        driver_noise::silence();
    }
    let result = match cli.command {
        #[cfg(feature = "twin")]
        Command::Run(args) => run::run(&args),
        #[cfg(feature = "twin")]
        Command::Frames(args) => frames::frames(&args),
        #[cfg(feature = "twin")]
        Command::Generate(args) => generate::generate(&args),
        #[cfg(feature = "twin")]
        Command::Study(args) => study::study(&args),
        Command::Check(args) => check::check(&args),
        Command::Locate(args) => locate::locate(&args),
        Command::Import(args) => import::import(&args),
        Command::Export(args) => export::export(&args),
        #[cfg(feature = "twin")]
        Command::Doctor(args) => doctor::doctor(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.print();
            ExitCode::from(failure.code())
        }
    }
}

fn start_messages(verbose: u8) {
    let level = match verbose {
        0 => LevelFilter::WARN,
        1 => LevelFilter::INFO,
        _ => LevelFilter::DEBUG,
    };
    tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .with_max_level(level)
        .with_target(verbose > 1)
        .without_time()
        .init();
    fault::set_style();
}

/// Writes a result to standard output; a closed pipe is no failure.
fn print(text: &str) -> Result<(), Failure> {
    match writeln!(std::io::stdout().lock(), "{}", text.trim_end()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(Failure::run(
            anyhow::Error::new(error).context("cannot write to standard output"),
        )),
        _ => Ok(()),
    }
}
