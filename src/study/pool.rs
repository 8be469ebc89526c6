//! Workers: processes that each run one scenario after the other.

use super::{Result, Row, Status, StudyError};
use crate::files;
use crate::scenario::sampling::Template;
use std::collections::VecDeque;
use std::fs;
use std::io::{self, BufRead, BufReader, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

/// How long to wait for a row before asking whether to go on.
const ASK_EVERY: Duration = Duration::from_millis(200);
/// A worker reads the study's files before it is ready: a machine that swaps may be slow, but not so
/// slow.
const START_LIMIT: Duration = Duration::from_secs(300);
/// The line that a worker writes before its first row.
pub const READY: &str = "ready";
/// Lines at the end of a dead worker's log that are kept as the reason.
const LOG_LINES: usize = 3;

/// Name of the file, in the study's folder, with what a worker says on standard error.
pub fn worker_log(number: usize) -> String {
    format!("worker-{number}.log")
}

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
    /// A run that takes longer has hung, and its worker is ended.
    pub run_limit: Duration,
}

/// How to go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// As before.
    GoOn,
    /// Wait for the runs in flight.
    BeginNoMore,
    /// Their rows are not needed either.
    End,
}

impl Pool<'_> {
    /// Runs all indexes. `next` gets each row when it is done, and is asked now and then without one.
    pub fn work(
        &self,
        template: &Template,
        todo: impl IntoIterator<Item = u64>,
        mut next: impl FnMut(Option<Row>) -> Result<Next>,
    ) -> Result {
        self.remove_empty_logs();
        let todo = Mutex::new(todo.into_iter().collect::<VecDeque<_>>());
        let halt = AtomicBool::new(false);
        let (rows, arriving) = channel();
        thread::scope(|scope| {
            for number in 1..=self.jobs {
                let (todo, halt, rows) = (&todo, &halt, rows.clone());
                scope.spawn(move || {
                    let next_index = || {
                        let halted = halt.load(Ordering::Relaxed);
                        let mut todo = todo.lock().unwrap_or_else(PoisonError::into_inner);
                        todo.pop_front().filter(|_| !halted)
                    };
                    self.run_worker(number, template, next_index, &rows);
                });
            }
            drop(rows);
            let result = loop {
                let row = match arriving.recv_timeout(ASK_EVERY) {
                    Ok(row) => row.map(Some),
                    Err(RecvTimeoutError::Timeout) => Ok(None),
                    Err(RecvTimeoutError::Disconnected) => break Ok(()),
                };
                match row.and_then(&mut next) {
                    Ok(Next::GoOn) => {}
                    Ok(Next::BeginNoMore) => halt.store(true, Ordering::Relaxed),
                    Ok(Next::End) => break Ok(()),
                    Err(error) => break Err(error),
                }
            };
            halt.store(true, Ordering::Relaxed);
            result
        })
    }

    /// Logs that workers of a killed study have left, without a word in them.
    fn remove_empty_logs(&self) {
        let is_log = |path: &Path| {
            let name = path.file_name().and_then(|name| name.to_str());
            let number = name.and_then(|n| n.strip_prefix("worker-")?.strip_suffix(".log"));
            number.is_some_and(|n| n.parse::<usize>().is_ok())
        };
        let files = fs::read_dir(self.folder).into_iter().flatten().flatten();
        let logs = files.map(|file| file.path()).filter(|path| is_log(path));
        logs.for_each(|log| remove_if_empty(&log));
    }

    /// Keeps one worker running: a new one is started when the last has died.
    fn run_worker(
        &self,
        number: usize,
        template: &Template,
        mut next_index: impl FnMut() -> Option<u64>,
        rows: &Sender<Result<Row>>,
    ) {
        let mut running = None;
        while let Some(index) = next_index() {
            let worker = running
                .take()
                .map_or_else(|| Worker::start(self, number), Ok)
                .map_err(StudyError::Worker);
            let row = worker.map(|mut worker| match worker.ask(index, self.run_limit) {
                Ok(row) => {
                    running = Some(worker);
                    row
                }
                Err(error) => match template.sample(index) {
                    Ok(sample) => {
                        Row::without_figures(&sample, Status::Crashed, worker.end_reason(&error))
                    }
                    Err(error) => Row::not_sampled(index, &error),
                },
            });
            if rows.send(row).is_err() {
                return;
            }
        }
        if let Some(worker) = running {
            worker.finish();
        }
    }
}

struct Worker {
    child: Child,
    to: ChildStdin,
    /// Its lines, read by a thread that ends with it: a pipe itself cannot be waited for with a limit.
    lines: Receiver<io::Result<String>>,
    log: PathBuf,
}

impl Worker {
    fn start(pool: &Pool<'_>, number: usize) -> io::Result<Self> {
        let log = pool.folder.join(worker_log(number));
        let mut command = Command::new(&pool.program);
        command
            .args(["study", "worker", "--renderer", pool.renderer])
            .arg(pool.folder)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(files::create_new(&log)?);
        // A worker is a core's work: none beside the driver's own thread.
        for (variable, threads) in [("LP_NUM_THREADS", "0"), ("RAYON_NUM_THREADS", "1")] {
            if std::env::var_os(variable).is_none() {
                command.env(variable, threads);
            }
        }
        let mut child = command.spawn()?;
        let pipes = child.stdin.take().zip(child.stdout.take());
        let (to, from) = pipes.ok_or_else(|| io::Error::other("it has no pipes"))?;
        let (line, lines) = channel();
        thread::spawn(move || {
            let all = BufReader::new(from).lines();
            all.map(|text| line.send(text))
                .take_while(Result::is_ok)
                .count()
        });
        let mut worker = Self {
            child,
            to,
            lines,
            log,
        };
        let error = match worker.line(START_LIMIT) {
            Ok(line) if line.trim() == READY => return Ok(worker),
            Ok(_) => ErrorKind::InvalidData.into(),
            Err(error) => error,
        };
        Err(io::Error::other(worker.end_reason(&error)))
    }

    fn ask(&mut self, index: u64, limit: Duration) -> io::Result<Row> {
        writeln!(self.to, "{index}").and_then(|()| self.to.flush())?;
        Ok(serde_json::from_str(&self.line(limit)?)?)
    }

    fn line(&mut self, limit: Duration) -> io::Result<String> {
        match self.lines.recv_timeout(limit) {
            Ok(line) => line,
            Err(RecvTimeoutError::Disconnected) => Err(ErrorKind::UnexpectedEof.into()),
            Err(RecvTimeoutError::Timeout) => Err(io::Error::other(format!(
                "no word from it for {} s",
                limit.as_secs_f64()
            ))),
        }
    }

    /// Ends it after an error, and says why it ended.
    fn end_reason(mut self, error: &io::Error) -> String {
        // It may still run, and only have written something wrong.
        self.child.kill().ok();
        let end = match self.child.wait() {
            Ok(status) if error.kind() == ErrorKind::UnexpectedEof => status.to_string(),
            _ => error.to_string(),
        };
        let log = fs::read_to_string(&self.log).unwrap_or_default();
        let lines: Vec<_> = log.lines().collect();
        let last = lines[lines.len().saturating_sub(LOG_LINES)..].join(" / ");
        format!("the worker ended ({end}): {last}")
    }

    /// Ends it after its last row; an empty log is removed.
    fn finish(mut self) {
        drop(self.to);
        self.child.wait().ok();
        remove_if_empty(&self.log);
    }
}

fn remove_if_empty(log: &Path) {
    if fs::metadata(log).is_ok_and(|log| log.len() == 0) {
        fs::remove_file(log).ok();
    }
}
