//! One run: twin -> bus -> stack -> bus -> twin, step by step, scored against the truth.
//!
//! ```no_run
//! use metrotwin::scenario::Scenario;
//! use metrotwin::session::{RendererChoice, RunOptions, run};
//! use std::path::Path;
//!
//! let scenario = Scenario::load(Path::new("scenarios/line_run.toml"), &[])?;
//! let options = RunOptions { renderer: RendererChoice::Cpu, ..RunOptions::default() };
//! let summary = run(&scenario, &options, &mut [])?;
//! println!("{}", summary.real_time_factor);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Truth exists here and in the twin only: what goes to the stack is images, samples, scans and
//! messages. [`Observer`]s watch (a recording, a table of fixes) and cannot change anything.
//!
//! What it does not do: many runs, and files (observers write them).

mod bench;
mod cameras;
mod devices;
mod event;
mod eyes;
mod health;
mod motion;
mod outcome;
mod ride;
mod run;
mod score;
mod shots;
mod speed;
mod summary;
mod watch;

pub use event::{Event, Exposure, Observer, ObserverError, Opening, Source, TrainPoint};
pub use speed::{Speeds, measure};
pub use summary::{
    CameraFigures, Cost, Distribution, End, FaultSpan, ObstacleScore, Physics, Positioning,
    Protection, Summary, TrainFigures, WallShares, Wayside,
};

use crate::scenario::Scenario;
use crate::twin::faults;
use crate::twin::lights::LampLight;
use crate::twin::physics::PhysicsError;
use crate::twin::physics::RailState;
use crate::twin::random::Stream;
use crate::twin::reflectance::Wet;
use crate::twin::render::cpu::CpuRenderer;
use crate::twin::render::gpu::GpuRenderer;
use crate::twin::render::{RenderError, Renderer, Scene};
use std::sync::atomic::{AtomicBool, Ordering};

/// What draws the images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RendererChoice {
    /// The graphics adapter, or the plain renderer where there is none.
    #[default]
    Auto,
    /// The graphics adapter or nothing.
    Gpu,
    /// The plain renderer.
    Cpu,
}

/// How to run, apart from what the scenario says.
#[derive(Clone, Copy, Default)]
pub struct RunOptions<'a> {
    /// Which renderer.
    pub renderer: RendererChoice,
    /// Set from elsewhere to break the run off.
    pub stop: Option<&'a AtomicBool>,
    /// Told the simulated time, in seconds, now and then.
    pub progress: Option<&'a dyn Fn(f64)>,
}

impl RunOptions<'_> {
    fn stopped(&self) -> bool {
        self.stop.is_some_and(|s| s.load(Ordering::Relaxed))
    }
}

/// Why a run could not begin or go on.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// No picture can be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The world could not be made.
    #[error(transparent)]
    Physics(#[from] PhysicsError),
    /// An observer failed.
    #[error(transparent)]
    Observer(#[from] ObserverError),
    /// A frame is longer than the poses that the world keeps.
    #[error(
        "the pose of the train at {0:.4} s is no longer known: a frame is longer than the world's memory"
    )]
    PoseForgotten(f64),
    /// The renderer broke its word.
    #[error("{1} images were drawn in place of {0}")]
    Images(usize, usize),
}

/// Runs a scenario to its end. A failure of the world in the middle of the run ends it as
/// [`End::Failed`], with everything up to there scored and recorded.
pub fn run(
    scenario: &Scenario,
    options: &RunOptions<'_>,
    observers: &mut [&mut dyn Observer],
) -> Result<Summary, SessionError> {
    run_on(
        scenario,
        renderer(scenario, options.renderer)?.as_mut(),
        options,
        observers,
    )
}

/// As [`run`], with a renderer that has the scenario's [`scene`]; the choice of the options is not used.
pub fn run_on(
    scenario: &Scenario,
    renderer: &mut dyn Renderer,
    options: &RunOptions<'_>,
    observers: &mut [&mut dyn Observer],
) -> Result<Summary, SessionError> {
    match (&scenario.bench, &scenario.rig) {
        (Some(bench), Some(rig)) => {
            bench::Bench::new(scenario, *bench, rig, renderer).run(options, observers)
        }
        _ => run::Run::new(scenario, renderer)?.run(options, observers),
    }
}

/// The renderer of a scenario, as [`run`] uses it; says so once where it has to fall back on the plain one.
pub fn renderer(
    scenario: &Scenario,
    choice: RendererChoice,
) -> Result<Box<dyn Renderer>, SessionError> {
    let scene = scene(scenario);
    if choice == RendererChoice::Cpu {
        return Ok(Box::new(CpuRenderer::quick(scene)));
    }
    match GpuRenderer::new(scene.clone()) {
        Ok(renderer) => Ok(Box::new(renderer)),
        Err(RenderError::NoAdapter(why)) if choice == RendererChoice::Auto => {
            tracing::warn!(
                "no graphics driver: drawing with the plain CPU renderer, right but several times \
                 slower than a software driver. {why}"
            );
            Ok(Box::new(CpuRenderer::quick(scene)))
        }
        Err(error) => Err(error.into()),
    }
}

/// One sigma of a lamp's clock: a crystal without temperature compensation.
const LAMP_CLOCK_SIGMA: f64 = 20e-6;

/// What stands still in a scenario. The lamps start to send at times of their own, by clocks of
/// their own, and fail as the scenario has it.
pub fn scene(scenario: &Scenario) -> Scene {
    let tunnel = scenario.tunnel.clone();
    let phase = Stream::new(scenario.seed, 0, "lamp phase");
    let clock = Stream::new(scenario.seed, 0, "lamp clock");
    let mut lamps: Vec<_> = (0u64..)
        .zip(&tunnel.lamps)
        .map(|(k, site)| {
            let mut lamp = LampLight::from_site(site, phase.uniform(k));
            lamp.waveform.chip_s *= 1.0 + LAMP_CLOCK_SIGMA * clock.normal(k);
            lamp
        })
        .collect();
    faults::age(&mut lamps, &scenario.faults.lamps, &tunnel, scenario.seed);
    let everywhere = f64::NEG_INFINITY..f64::INFINITY;
    let zones = scenario.physics.track.rail_zones.iter();
    let zones = zones.map(|zone| (zone.from_m..zone.to_m, zone.rail));
    let rails = std::iter::once((everywhere, scenario.physics.track.rail)).chain(zones);
    Scene {
        tunnel,
        lamps,
        air: scenario.air.air(),
        wet: Wet {
            ranges: rails
                .map(|(range, rail)| (range, rail == RailState::Wet))
                .collect(),
        },
    }
}
