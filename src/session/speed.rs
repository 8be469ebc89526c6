//! How fast this machine is.
//!
//! Every figure is the time of the code that a run uses, at work on a shipped scene: a train at
//! 60 km/h on `chengdu_line1`, its stereo pairs (1280 x 720 an eye), and, while nothing moves, the
//! frames of wayside device W1530 (1920 x 1080). The tunnel is part of the program, so it works anywhere.

use super::costs::Stopwatch;
use super::statistics::Cost;
use super::{Event, Observer, ObserverError, RendererChoice, RunOptions, Source, renderer, run_on};
use crate::bus::{Node, TrainCommand};
use crate::scenario::{Override, Scenario, ScenarioFile};
use crate::settings::read_toml;
use crate::track::Tunnel;
use crate::twin::physics::World;
use crate::twin::render::{Backend, Job, RenderError, Renderer, gpu};
use serde::Serialize;

/// Whatever goes wrong.
pub(super) type Error = Box<dyn std::error::Error + Send + Sync>;

const TUNNEL: &str = include_str!("../../tunnels/chengdu_line1.toml");

/// A train with a rig.
pub(super) const TRAIN: &str = r#"
name = "doctor"
tunnel = "chengdu_line1"
rig = { pairs_per_s = 30.0 }
train = { start_chainage_m = 1330.0, start_speed_kmh = 60.0, cruise_speed_kmh = 60.0 }
"#;

/// A wayside camera before a tunnel in which nothing moves, as it mostly is.
pub(super) const POST: &str = r#"
name = "doctor"
tunnel = "chengdu_line1"
wayside = [{ device = "W1530", camera = { frames_per_s = 30.0 } }]
stack = { wayside = { reference_frames = 10 } }
"#;

/// Frames in a round.
const ROUND: usize = 20;
/// Rounds; the plain renderer is slow enough for one to do.
const ROUNDS: usize = 3;
/// Steps of the world that are timed together.
const STEPS: u32 = 50;
/// Of both cameras.
const FRAMES_PER_S: f64 = 30.0;
/// Frames of which the detector learns its reference: it is not timed meanwhile.
const LEARNING: usize = 10;

/// Figures of this machine.
#[derive(Clone, Debug, Serialize)]
pub struct Speeds {
    /// What drew.
    pub adapter: String,
    /// By which interface.
    pub backend: String,
    /// Everything that could draw.
    pub adapters: Vec<Backend>,
    /// Stereo pairs drawn a second.
    pub stereo_pairs_per_s: f64,
    /// Wayside frames drawn a second.
    pub wayside_frames_per_s: f64,
    /// A step of the world, microseconds.
    pub physics_us_per_step: f64,
    /// The positioning stack reads a pair, milliseconds.
    pub led_ms_per_pair: f64,
    /// The wayside stack looks at a frame, milliseconds.
    pub wayside_ms_per_frame: f64,
}

/// Measures this machine: the best medians of rounds of 20 frames.
pub fn measure() -> Result<Speeds, Error> {
    let mut renderer = renderer(&scenario(TRAIN, 1, &[])?, RendererChoice::Auto)?;
    let drawn_by = renderer.backend();
    let rounds = if drawn_by.backend == "cpu" { 1 } else { ROUNDS };
    let (mut watched, options) = (Watched::default(), RunOptions::default());
    let train = scenario(TRAIN, rounds, &[])?;
    for scenario in [&train, &scenario(POST, rounds, &[])?] {
        run_on(scenario, renderer.as_mut(), &options, &mut [&mut watched])?;
    }
    let renderer = renderer.as_mut();
    Ok(Speeds {
        adapter: drawn_by.adapter,
        backend: drawn_by.backend,
        adapters: gpu::adapters(),
        stereo_pairs_per_s: 1.0 / best_median(&draw_seconds(renderer, &watched.pairs)?),
        wayside_frames_per_s: 1.0 / best_median(&draw_seconds(renderer, &watched.frames)?),
        physics_us_per_step: 1e6 * best_median(&step_seconds(&train)?),
        led_ms_per_pair: best_median(&watched.led_ms),
        wayside_ms_per_frame: best_median(&watched.wayside_ms),
    })
}

/// The scenario in `text` with some changes. It lasts for `rounds` rounds of frames, and for those that are not
/// timed: the first ones, which build what later ones use, and those of which the detector learns its reference.
pub(super) fn scenario(text: &str, rounds: usize, changes: &[&str]) -> Result<Scenario, Error> {
    let tunnel = Tunnel::from_toml(TUNNEL)?;
    let mut document = text.parse::<toml::Table>()?;
    for change in changes {
        change.parse::<Override>()?.apply(&mut document)?;
    }
    let mut file: ScenarioFile = read_toml(&document.to_string())?;
    file.duration_s = (LEARNING + 2 + rounds * ROUND) as f64 / FRAMES_PER_S;
    Ok(Scenario::new(file, tunnel)?)
}

/// What a session drew, and what reading it cost.
#[derive(Default)]
pub(super) struct Watched {
    pub pairs: Vec<Job>,
    pub frames: Vec<Job>,
    led_ms: Vec<f64>,
    wayside_ms: Vec<f64>,
    learnt: usize,
}

impl Observer for Watched {
    fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
        match event {
            Event::Exposure(exposure) => match exposure.source {
                Source::Rig(_) => self.pairs.push(exposure.job.clone()),
                Source::Wayside(_) => self.frames.push(exposure.job.clone()),
            },
            Event::Cost {
                node: Node::Train(_),
                cost_ms,
            } => self.led_ms.push(*cost_ms),
            Event::Cost { .. } if self.learnt < LEARNING => self.learnt += 1,
            Event::Cost { cost_ms, .. } => self.wayside_ms.push(*cost_ms),
            _ => {}
        }
        Ok(())
    }
}

/// Means of [`STEPS`] steps of the world.
fn step_seconds(scenario: &Scenario) -> Result<Vec<f64>, Error> {
    let mut world = World::new(
        scenario.tunnel.clone(),
        &scenario.physics,
        scenario.file.seed,
        0,
    )?;
    let command = TrainCommand {
        permitted_speed_mps: 80.0 / 3.6,
        ..TrainCommand::default()
    };
    let mut seconds = Vec::new();
    for _ in 0..ROUNDS * ROUND {
        let steps = || (0..STEPS).try_for_each(|_| world.step(&[command]));
        let (done, taken_s) = Stopwatch::default().time(steps);
        done?;
        seconds.push(taken_s / f64::from(STEPS));
    }
    Ok(seconds)
}

/// Draws all jobs; the seconds from each to the one before it. As in a run, the next is asked for before
/// the last is read back.
fn draw_seconds(renderer: &mut dyn Renderer, jobs: &[Job]) -> Result<Vec<f64>, RenderError> {
    let mut seconds = Vec::new();
    for (k, job) in jobs.iter().enumerate() {
        let work = || {
            renderer.submit(job)?;
            (k > 0).then(|| renderer.collect()).transpose()
        };
        let (images, draw_s) = Stopwatch::default().time(work);
        if images?.is_some() {
            seconds.push(draw_s);
        }
    }
    renderer.collect()?;
    Ok(seconds)
}

/// The least median of whole rounds.
fn best_median(values: &[f64]) -> f64 {
    values
        .chunks_exact(ROUND)
        .filter_map(|round| Cost::of(&mut round.to_vec()))
        .map(|cost| cost.p50)
        .fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    /// A change of the shipped tunnel or of a default that the scene cannot live with.
    #[test]
    fn the_scenes_are_right() {
        assert!(scenario(TRAIN, 1, &[]).unwrap().rig().is_some());
        let post = scenario(POST, 1, &[]).unwrap();
        assert_eq!(post.wayside.len(), 1);
        assert_eq!(post.file.stack.wayside.reference_frames as usize, LEARNING);
    }

    /// A median over a torn round, or the worst instead of the best.
    #[test]
    fn the_best_whole_round_counts() {
        let slow = vec![3.0; ROUND];
        let fast = vec![2.0; ROUND];
        let torn = vec![1.0; ROUND - 1];
        let best = best_median(&[slow, fast, torn].concat());
        assert!((best - 2.0).abs() < 1e-12);
    }
}
