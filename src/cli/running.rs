//! What subcommands that run a scenario share.

use super::signals::{self, Signal};
use crate::scenario::MOST_SEED;
use clap::builder::RangedU64ValueParser;
use indicatif::ProgressStyle;
use std::cell::Cell;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Set by the first signal to end, or when there is nothing more to do.
pub(super) static STOP: AtomicBool = AtomicBool::new(false);

/// From now on Ctrl-C, SIGTERM (Slurm, containers) and SIGHUP (a terminal that is closed) set [`STOP`].
/// A second one ends the process at once; but some send SIGTERM or SIGHUP twice and mean it once.
#[allow(
    clippy::disallowed_methods,
    reason = "signals of people and of machines are told apart by the time between them"
)]
pub(super) fn stop_on_signals() {
    let first = OnceLock::new();
    signals::handle(
        move |signal| match (first.get().map(Instant::elapsed), signal) {
            (None, _) => {
                first.get_or_init(Instant::now);
                STOP.store(true, Ordering::Relaxed);
                eprintln!("ending the run; Ctrl-C again ends it at once");
            }
            (Some(after), Signal::Ended) if after < SENT_TWICE => {}
            (Some(_), _) => std::process::exit(1),
        },
    );
}

/// Signals of one request follow each other faster.
const SENT_TWICE: Duration = Duration::from_secs(1);

/// Seeds that a file can hold.
pub(super) fn seed() -> RangedU64ValueParser {
    RangedU64ValueParser::new().range(..=MOST_SEED as u64)
}

/// How far something is: a bar on a terminal, else a line at the start and for every tenth.
pub(super) struct ProgressBar {
    bar: indicatif::ProgressBar,
    tenths: Cell<Option<u64>>,
}

impl ProgressBar {
    pub(super) fn new(template: &str) -> Self {
        let bar = indicatif::ProgressBar::new(0);
        Self {
            bar: match ProgressStyle::with_template(template) {
                Ok(style) => bar.with_style(style),
                Err(_) => bar,
            },
            tenths: Cell::new(None),
        }
    }

    /// Of a run that takes so much simulated time, and has come to this one.
    pub(super) fn show_run(&self, now_s: f64, duration_s: f64) {
        let [now, all] = [now_s.min(duration_s), duration_s].map(|s| (s * 1e3) as u64);
        let percent = 10 * (10 * now / all.max(1));
        self.show(now, all, "", || format!("{percent} % of the run"));
    }

    /// So many are done of all; `line` is for where there is no terminal.
    pub(super) fn show(&self, done: u64, all: u64, message: &str, line: impl Fn() -> String) {
        self.bar.set_length(all);
        self.bar.set_position(done);
        self.bar.set_message(message.to_owned());
        let reached = Some(10 * done / all.max(1));
        if self.bar.is_hidden() && reached > self.tenths.replace(reached) {
            eprintln!("{}", line());
        }
    }

    /// It is over.
    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// Of a run.
pub(super) const RUN_BAR: &str =
    "{bar:40} {percent:>3} % of the run, {elapsed} so far, {eta} to go";
