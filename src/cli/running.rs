//! What subcommands that run a scenario share.

use super::fault::Failure;
use crate::session::RendererChoice;
use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressStyle};
use std::cell::Cell;
use std::fs;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

#[derive(Clone, Copy, ValueEnum)]
pub(super) enum RendererArg {
    /// The graphics adapter, or the plain renderer where there is none
    Auto,
    /// The graphics adapter (a GPU, or a software adapter) or nothing
    Gpu,
    /// The plain renderer, on the CPU alone
    Cpu,
}

impl RendererArg {
    /// As it is given.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Gpu => "gpu",
            Self::Cpu => "cpu",
        }
    }
}

impl From<RendererArg> for RendererChoice {
    fn from(arg: RendererArg) -> Self {
        match arg {
            RendererArg::Auto => Self::Auto,
            RendererArg::Gpu => Self::Gpu,
            RendererArg::Cpu => Self::Cpu,
        }
    }
}

/// Set by the first Ctrl-C, or when there is nothing more to do.
pub(super) static STOP: AtomicBool = AtomicBool::new(false);

pub(super) fn stop_on_ctrl_c() {
    let handler = || {
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(1);
        }
        eprintln!("ending the run; Ctrl-C again ends it at once");
    };
    if let Err(error) = ctrlc::set_handler(handler) {
        tracing::warn!("Ctrl-C will end the run at once: {error}");
    }
}

/// Makes the folder for results, and makes sure that files can be written there.
pub(super) fn prepare(out: &Path) -> Result<(), Failure> {
    probe(out).map_err(|error| {
        let what = format!("cannot write into {}: {error}", out.display());
        Failure::input(
            what,
            "choose another folder with --out, or make that one writable",
        )
    })
}

fn probe(out: &Path) -> io::Result<()> {
    fs::create_dir_all(out)?;
    let probe = out.join(".metrotwin-probe");
    fs::write(&probe, b"")?;
    fs::remove_file(&probe)
}

/// How far a run is: a bar on a terminal, else a line for every tenth.
pub(super) struct Progress {
    bar: ProgressBar,
    duration_s: f64,
    tenths: Cell<u32>,
}

impl Progress {
    /// Of a run that takes so much simulated time.
    pub(super) fn new(duration_s: f64) -> Self {
        let bar = ProgressBar::new(millis(duration_s));
        let template = "{bar:40} {percent:>3} % of the run, {elapsed} so far, {eta} to go";
        Self {
            bar: match ProgressStyle::with_template(template) {
                Ok(style) => bar.with_style(style),
                Err(_) => bar,
            },
            duration_s,
            tenths: Cell::new(0),
        }
    }

    /// It has come to this simulated time.
    pub(super) fn show(&self, now_s: f64) {
        self.bar.set_position(millis(now_s));
        let reached = (10.0 * now_s / self.duration_s).min(10.0) as u32;
        if self.bar.is_hidden() && reached > self.tenths.replace(reached) {
            eprintln!("{} % of the run", 10 * reached);
        }
    }

    /// It is over.
    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

fn millis(seconds: f64) -> u64 {
    (seconds * 1e3) as u64
}
