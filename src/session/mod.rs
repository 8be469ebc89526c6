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
mod cost_tally;
mod costs;
mod event;
mod fitting;
mod health;
mod image_box;
mod imaging;
mod leg_score;
mod occupancy_figures;
mod occupancy_score;
mod outcome;
mod positioning_score;
mod posts;
mod presence;
mod profile;
mod ride;
mod scheduler;
mod scoring;
mod speed;
mod statistics;
mod summary;
mod train_score;
mod wayside_score;

pub use event::{
    Event, Exposure, Observer, ObserverError, Opening, Source, TrainOpening, TrainPoint,
};
pub use fitting::{Fitted, Fitting, Mounted};
pub use occupancy_figures::{FacingFigures, LegDistances, OccupancyClass, OccupancyFigures};
pub(crate) use presence::FieldOfView;
pub use profile::{DrawingProfile, PassCost, profile};
pub use speed::{Speeds, measure};
pub(crate) use statistics::quantile;
pub use statistics::{Cost, ErrorStatistics};
pub use summary::{
    CameraFigures, End, FaultSpan, ObstacleScore, Physics, Positioning, ProtectionFigures, Summary,
    TrainFigures, TrainSummary, WallShares, Wayside,
};

use crate::scenario::Scenario;
use crate::twin::blades;
use crate::twin::lamps;
use crate::twin::physics::PhysicsError;
use crate::twin::physics::RailState;
use crate::twin::reflectance::{Wet, WetRange};
use crate::twin::render::cpu::CpuRenderer;
use crate::twin::render::gpu::GpuRenderer;
use crate::twin::render::{RenderError, Renderer, Scene};
use crate::twin::sensors::SensorError;
use std::sync::atomic::{AtomicBool, Ordering};

/// What draws the images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum RendererChoice {
    /// The graphics adapter, or the plain renderer where there is none.
    #[default]
    Auto,
    /// The graphics adapter (a GPU, or a software adapter) or nothing.
    Gpu,
    /// The plain renderer, on the CPU alone.
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
    /// A sensor could not work.
    #[error(transparent)]
    Sensor(#[from] SensorError),
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
    run_with(scenario, renderer, &|_| (), options, observers)
}

/// As [`run_on`], with sensors and equipment of the user's own: `add` puts them in.
pub fn run_with(
    scenario: &Scenario,
    renderer: &mut dyn Renderer,
    add: &dyn Fn(&mut Fitting),
    options: &RunOptions<'_>,
    observers: &mut [&mut dyn Observer],
) -> Result<Summary, SessionError> {
    scheduler::Session::new(scenario, renderer, add, observers)?.run(options)
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

/// What stands still in a scenario.
pub fn scene(scenario: &Scenario) -> Scene {
    let network = &scenario.tunnel.network;
    let track = &scenario.physics.track;
    let everywhere = WetRange {
        track: None,
        chainage_m: f64::NEG_INFINITY..f64::INFINITY,
        wet: track.rail == RailState::Wet,
    };
    let zones = track.rail_zones.iter().map(|zone| WetRange {
        // Without a name it is of the first track.
        track: Some(
            zone.track
                .as_ref()
                .map_or(0, |name| network.named(name).unwrap_or_default().0.into()),
        ),
        chainage_m: zone.from_m..zone.to_m,
        wet: zone.rail == RailState::Wet,
    });
    Scene {
        tracks: blades::tracks_without_blades(network),
        lamps: lamps::shining(
            &scenario.tunnel,
            &scenario.file.faults.lamps,
            scenario.file.seed,
        ),
        air: scenario.file.air.air(),
        wet: Wet {
            ranges: std::iter::once(everywhere).chain(zones).collect(),
        },
    }
}
