//! The process that runs scenarios for a study: indexes in, rows out.

use super::measures::Fixes;
use super::pool::READY;
use super::{Result, Row, Status, Study, StudyError};
use crate::scenario::Scenario;
use crate::scenario::sampling::{ScenarioSample, Template};
use crate::session::{self, Observer, RendererChoice, RunOptions, SessionError, Summary};
use crate::twin::render::Renderer;
use std::io::{self, BufRead, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::mpsc::channel;
use std::thread;

/// Answers every index with a row, a line each, until the input ends; then the process ends too.
pub fn serve(
    folder: &Path,
    renderer: RendererChoice,
    input: impl BufRead + Send + 'static,
    mut output: impl Write,
) -> Result {
    let template = Study::open(folder)?.template;
    let mut runner = ScenarioRunner::new(renderer);
    let failed = |source| StudyError::file(Path::new("the worker's pipe"), source);
    writeln!(output, "{READY}")
        .and_then(|()| output.flush())
        .map_err(failed)?;
    for line in lines_while_wanted(input) {
        let line = line.map_err(failed)?;
        let index = line
            .trim()
            .parse()
            .map_err(|e| failed(io::Error::other(e)))?;
        let row = serde_json::to_string(&runner.run(&template, index));
        let row = row.map_err(|e| failed(e.into()))?;
        writeln!(output, "{row}")
            .and_then(|()| output.flush())
            .map_err(failed)?;
    }
    Ok(())
}

/// The lines of the input. The pool closes it after the last row. When it ends before, as after a kill,
/// no row is wanted any more, and the process ends.
fn lines_while_wanted(
    input: impl BufRead + Send + 'static,
) -> impl Iterator<Item = io::Result<String>> {
    let (sender, lines) = channel();
    thread::spawn(move || {
        for line in input.lines() {
            if sender.send(line).is_err() {
                return;
            }
        }
        std::process::exit(0);
    });
    lines.into_iter()
}

/// Runs one scenario after the other, with one renderer.
pub struct ScenarioRunner {
    choice: RendererChoice,
    renderer: Option<Box<dyn Renderer>>,
}

impl ScenarioRunner {
    /// Before the first run.
    pub fn new(choice: RendererChoice) -> Self {
        Self {
            choice,
            renderer: None,
        }
    }

    /// Runs one run of a study, without a recording.
    pub fn run(&mut self, template: &Template, index: u64) -> Row {
        let sample = match template.sample(index) {
            Ok(sample) => sample,
            Err(error) => return Row::not_sampled(index, &error),
        };
        let run = AssertUnwindSafe(|| self.run_sample(template, &sample));
        catch_unwind(run).unwrap_or_else(|panic| {
            // Its state may be broken.
            self.renderer = None;
            let message = panic.downcast_ref::<String>().map(String::as_str);
            let message = message.or_else(|| panic.downcast_ref::<&str>().copied());
            let reason = format!("panic: {}", message.unwrap_or("without a word"));
            Row::without_figures(&sample, Status::Failed, reason)
        })
    }

    fn run_sample(&mut self, template: &Template, sample: &ScenarioSample) -> Row {
        let without = |status, reason| Row::without_figures(sample, status, reason);
        let scenario = match template.scenario(sample) {
            Ok(scenario) => scenario,
            Err(error) => return without(Status::Invalid, error.to_string()),
        };
        let mut fixes = Fixes::default();
        match self.session(scenario, &mut fixes) {
            Ok(summary) => Row::of(sample, &summary, &fixes),
            Err(error) => {
                self.renderer = None;
                without(Status::Failed, error.to_string())
            }
        }
    }

    /// Without the images that wayside reports carry for a recording: no figure is made of them.
    fn session(
        &mut self,
        mut scenario: Scenario,
        observer: &mut dyn Observer,
    ) -> Result<Summary, SessionError> {
        scenario.file.stack.wayside.keep_images = false;
        let renderer = match &mut self.renderer {
            Some(renderer) => {
                renderer.set_scene(session::scene(&scenario));
                renderer
            }
            none => none.insert(session::renderer(&scenario, self.choice)?),
        };
        session::run_on(
            &scenario,
            renderer.as_mut(),
            &RunOptions::default(),
            &mut [observer],
        )
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::bus::WaysideReport;
    use crate::session::{Event, ObserverError};

    struct Images(u32, u32);

    impl Observer for Images {
        fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
            if let Event::Wayside { report, .. } = event
                && !report.learning
            {
                let WaysideReport {
                    difference, binary, ..
                } = report;
                self.0 += 1;
                self.1 += u32::from(difference.is_some()) + u32::from(binary.is_some());
            }
            Ok(())
        }
    }

    /// Two copies of every wayside frame that nobody looks at.
    #[test]
    fn a_run_of_a_study_copies_no_images() {
        let template =
            Template::load(Path::new("scenarios/studies/wayside_detection.toml")).unwrap();
        let mut sample = template.sample(0).unwrap();
        sample.index = 0;
        let mut scenario = template.scenario(&sample).unwrap();
        scenario.file.duration_s = 1.0;
        scenario.file.stack.wayside.reference_frames = 3;
        let mut images = Images(0, 0);
        let mut runner = ScenarioRunner::new(RendererChoice::Cpu);
        assert!(scenario.file.stack.wayside.keep_images);
        runner.session(scenario, &mut images).unwrap();
        assert!(
            images.0 > 1 && images.1 == 0,
            "{} frames, {} images",
            images.0,
            images.1
        );
    }
}
