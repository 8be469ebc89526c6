//! Workers: processes that each run one scenario after the other.

use super::{Row, Status, StudyError};
use crate::scenario::draw::Template;
use std::collections::VecDeque;
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

/// How often whoever waits for rows is asked whether to go on.
const PATIENCE: Duration = Duration::from_millis(200);
/// What a worker says before its first row.
pub const READY: &str = "ready";
/// Lines of a dead worker's messages that are kept as the reason.
const LAST_WORDS: usize = 3;

/// How workers are started.
#[derive(Clone, Debug)]
pub struct Pool<'a> {
    /// The program, whose `study worker` answers.
    pub program: PathBuf,
    /// Folder of the study.
    pub folder: &'a Path,
    /// `--renderer` of the workers.
    pub renderer: &'static str,
    /// How many.
    pub jobs: usize,
}

/// What happens while workers are at it.
pub trait Watch {
    /// A row has come; `false` ends it all.
    fn row(&mut self, row: Row) -> Result<bool, StudyError>;
    /// Asked now and then; `false` begins no more runs.
    fn go_on(&mut self) -> bool;
}

impl Pool<'_> {
    /// Runs all indexes; rows come in the order in which they are done.
    pub fn work(
        &self,
        template: &Template,
        todo: impl IntoIterator<Item = u64>,
        watch: &mut impl Watch,
    ) -> Result<(), StudyError> {
        let todo = Mutex::new(todo.into_iter().collect::<VecDeque<_>>());
        let halt = AtomicBool::new(false);
        let (rows, arriving) = channel();
        thread::scope(|scope| {
            for number in 1..=self.jobs {
                let (todo, halt, rows) = (&todo, &halt, rows.clone());
                scope.spawn(move || {
                    let next = || {
                        let halted = halt.load(Ordering::Relaxed);
                        let mut todo = todo.lock().unwrap_or_else(PoisonError::into_inner);
                        todo.pop_front().filter(|_| !halted)
                    };
                    self.employ(number, template, next, &rows);
                });
            }
            drop(rows);
            let result = loop {
                match arriving.recv_timeout(PATIENCE) {
                    Ok(row) => match row.and_then(|row| watch.row(row)) {
                        Ok(true) => {}
                        Ok(false) => break Ok(()),
                        Err(error) => break Err(error),
                    },
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => break Ok(()),
                }
                if !watch.go_on() {
                    halt.store(true, Ordering::Relaxed);
                }
            };
            halt.store(true, Ordering::Relaxed);
            result
        })
    }

    /// One worker after the other at one desk: a new one when the last has died.
    fn employ(
        &self,
        number: usize,
        template: &Template,
        mut next: impl FnMut() -> Option<u64>,
        rows: &Sender<Result<Row, StudyError>>,
    ) {
        let mut worker = None;
        while let Some(index) = next() {
            let row = match worker.take() {
                Some(worker) => Ok(worker),
                None => Worker::start(self, number).map_err(StudyError::Worker),
            }
            .and_then(|mut of: Worker| match of.ask(index) {
                Ok(row) => {
                    worker = Some(of);
                    Ok(row)
                }
                Err(error) => {
                    let draw = template.draw(index)?;
                    Ok(Row::without_figures(
                        &draw,
                        Status::Crashed,
                        of.obituary(&error),
                    ))
                }
            });
            if rows.send(row).is_err() {
                return;
            }
        }
        if let Some(worker) = worker {
            worker.dismiss();
        }
    }
}

struct Worker {
    child: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    log: PathBuf,
}

impl Worker {
    fn start(pool: &Pool<'_>, number: usize) -> io::Result<Self> {
        let log = pool.folder.join(format!("worker-{number}.log"));
        let mut command = Command::new(&pool.program);
        command
            .args(["study", "worker", "--renderer", pool.renderer])
            .arg(pool.folder)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(File::create(&log)?);
        // A worker is a core's work: none beside the driver's own thread.
        for (variable, threads) in [("LP_NUM_THREADS", "0"), ("RAYON_NUM_THREADS", "1")] {
            if std::env::var_os(variable).is_none() {
                command.env(variable, threads);
            }
        }
        let mut child = command.spawn()?;
        let pipes = child.stdin.take().zip(child.stdout.take());
        let (to, from) = pipes.ok_or_else(|| io::Error::other("it has no pipes"))?;
        let mut worker = Self {
            child,
            to,
            from: BufReader::new(from),
            log,
        };
        let mut line = String::new();
        match worker.from.read_line(&mut line) {
            Ok(_) if line.trim() == READY => Ok(worker),
            _ => {
                let end = io::ErrorKind::UnexpectedEof.into();
                Err(io::Error::other(worker.obituary(&end)))
            }
        }
    }

    fn ask(&mut self, index: u64) -> io::Result<Row> {
        writeln!(self.to, "{index}").and_then(|()| self.to.flush())?;
        let mut line = String::new();
        if self.from.read_line(&mut line)? == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        Ok(serde_json::from_str(&line)?)
    }

    /// Why it died.
    fn obituary(mut self, error: &io::Error) -> String {
        // It may only have said something wrong.
        self.child.kill().ok();
        let end = match self.child.wait() {
            Ok(status) if error.kind() == io::ErrorKind::UnexpectedEof => status.to_string(),
            _ => error.to_string(),
        };
        let said = fs::read_to_string(&self.log).unwrap_or_default();
        let lines: Vec<_> = said.lines().collect();
        let last = lines[lines.len().saturating_sub(LAST_WORDS)..].join(" / ");
        format!("the worker ended ({end}): {last}")
    }

    fn dismiss(mut self) {
        drop(self.to);
        self.child.wait().ok();
        if fs::metadata(&self.log).is_ok_and(|log| log.len() == 0) {
            fs::remove_file(&self.log).ok();
        }
    }
}
