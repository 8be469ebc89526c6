//! Workers: processes that each run one scenario after the other.

use super::{Row, Status, StudyError};
use crate::scenario::draw::Template;
use std::collections::VecDeque;
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

/// How often whoever waits for rows is asked whether to go on.
const PATIENCE: Duration = Duration::from_millis(200);
/// It reads the study's files before that: a machine that swaps may be slow, but not so slow.
const START_LIMIT: Duration = Duration::from_secs(300);
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
    /// A run that takes longer has hung, and its worker is ended.
    pub run_limit: Duration,
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
            let at_desk = match worker.take() {
                Some(worker) => Ok(worker),
                None => Worker::start(self, number).map_err(StudyError::Worker),
            };
            let row = at_desk.map(|mut of: Worker| match of.ask(index, self.run_limit) {
                Ok(row) => {
                    worker = Some(of);
                    row
                }
                Err(error) => match template.draw(index) {
                    Ok(draw) => Row::without_figures(&draw, Status::Crashed, of.obituary(&error)),
                    Err(error) => Row::undrawn(index, &error),
                },
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
    /// Its lines, read by a thread that ends with it: a pipe itself cannot be waited for with a limit.
    lines: Receiver<io::Result<String>>,
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
        match worker.line(START_LIMIT) {
            Ok(line) if line.trim() == READY => Ok(worker),
            Ok(_) => Err(io::Error::other(
                worker.obituary(&ErrorKind::InvalidData.into()),
            )),
            Err(error) => Err(io::Error::other(worker.obituary(&error))),
        }
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

    /// Why it died.
    fn obituary(mut self, error: &io::Error) -> String {
        // It may only have said something wrong.
        self.child.kill().ok();
        let end = match self.child.wait() {
            Ok(status) if error.kind() == ErrorKind::UnexpectedEof => status.to_string(),
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
