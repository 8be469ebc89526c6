//! Where the time of a picture goes: by pass, on the shipped scenes of [`speed`](super::speed) and what they
//! lack: other light, other exposure, other motion.
//!
//! The adapter times its passes by its own clock. What it copies between them, and what it waits for the
//! processor, is the rest of the time from the first pass's begin to the last one's end. One job at a time is
//! drawn, so that nothing else is drawn meanwhile: in a run the next one is prepared while one is drawn.
//!
//! What no renderer of this kind can undercut is the time that its bytes take through memory: the signal that
//! comes back is written and read, a word of every pixel's map is read, a byte of every pixel is written.

use super::costs::Stopwatch;
use super::speed::{Error, POST, TRAIN, Watched, scenario};
use super::statistics::Cost;
use super::{RunOptions, run_on};
use crate::scenario::Scenario;
use crate::twin::render::cpu::CpuRenderer;
use crate::twin::render::gpu::{GpuRenderer, PassTime};
use crate::twin::render::{Job, Renderer};
use serde::Serialize;
use std::hint::black_box;

/// What is drawn: its name, the scene, and its changes.
const CASES: [(&str, &str, &[&str]); 8] = [
    ("rig, no headlights", TRAIN, &["train.headlight_cd=0.0"]),
    ("rig", TRAIN, &[]),
    ("rig, exposed for 2 ms", TRAIN, &["rig.exposure_us=2000.0"]),
    (
        "rig, standing",
        TRAIN,
        &["train.start_speed_kmh=0.0", "train.cruise_speed_kmh=0.0"],
    ),
    ("wayside, nothing moves", POST, &[]),
    ("wayside, a worker walks", POST, &[WORKER]),
    (
        "wayside, a train stands",
        POST,
        &[
            "train.start_chainage_m=1500.0",
            "train.cruise_speed_kmh=0.0",
        ],
    ),
    (
        "wayside, a train passes",
        POST,
        &[
            "train.start_chainage_m=1490.0",
            "train.start_speed_kmh=60.0",
        ],
    ),
];

/// Of a pixel: its word in the map, and its grey.
const BYTES_A_PIXEL: f64 = 5.0;
/// Larger than any cache.
const COPIED_BYTES: usize = 64 << 20;
const COPIES: usize = 5;

/// Down the line, 20 to 30 m before the device.
const WORKER: &str = "workers=[{path=[{time_s=0.0, chainage_m=1510.0, lateral_m=0.3}, \
                      {time_s=7.0, chainage_m=1500.0, lateral_m=0.3}]}]";

/// One case.
#[derive(Clone, Debug, Serialize)]
pub struct DrawingProfile {
    /// What is drawn.
    pub case: &'static str,
    /// Pixels of a job: a pair, or a frame.
    pub pixels: u64,
    /// Preparing a job and handing it over, milliseconds; medians, as all times here.
    pub submit_ms: f64,
    /// From then until it is drawn.
    pub draw_ms: f64,
    /// From then until its images are there: what the processor adds of the sensor.
    pub develop_ms: f64,
    /// The time of its bytes through memory.
    pub memory_ms: f64,
    /// The plain renderer's time for the last job.
    pub plain_ms: f64,
    /// The adapter's time in each pass, in the order drawn; none where it has no clock.
    pub passes: Vec<PassCost>,
    /// Between the passes.
    pub between_ms: f64,
}

/// The time of all passes of a name in a job.
#[derive(Clone, Debug, Serialize)]
pub struct PassCost {
    /// Which.
    pub name: &'static str,
    /// Milliseconds.
    pub ms: f64,
    /// For each pixel of the job, nanoseconds.
    pub ns_per_pixel: f64,
}

/// Draws every case on the preferred adapter; tells `progress` what is drawn.
pub fn profile(progress: &dyn Fn(&str)) -> Result<Vec<DrawingProfile>, Error> {
    let memory = memory_bytes_per_ms();
    let cases = CASES.iter().map(|case| {
        progress(case.0);
        profile_of(case, memory)
    });
    cases.collect()
}

/// How fast memory copies, by the fastest of some copies: bytes read and written a millisecond.
fn memory_bytes_per_ms() -> f64 {
    let (from, mut to) = (vec![1u8; COPIED_BYTES], vec![0u8; COPIED_BYTES]);
    let copies = (0..COPIES).map(|_| {
        let ((), taken_s) =
            Stopwatch::default().time(|| black_box(&mut to).copy_from_slice(black_box(&from)));
        taken_s
    });
    let best_s = copies.fold(f64::INFINITY, f64::min);
    2.0 * COPIED_BYTES as f64 / (1e3 * best_s).max(1e-9)
}

/// Of the plain renderer, for the last job: at long exposures each takes many seconds.
fn plain_ms(scenario: &Scenario, jobs: &[Job]) -> Result<f64, Error> {
    let Some(job) = jobs.last() else {
        return Ok(0.0);
    };
    let mut renderer = CpuRenderer::quick(super::scene(scenario));
    let draw = || renderer.submit(job).and_then(|()| renderer.collect());
    let (images, taken_s) = Stopwatch::default().time(draw);
    images?;
    Ok(1e3 * taken_s)
}

fn profile_of(
    (case, text, changes): &(&'static str, &str, &[&str]),
    memory_bytes_per_ms: f64,
) -> Result<DrawingProfile, Error> {
    let scenario = scenario(text, 1, changes)?;
    let mut renderer = GpuRenderer::new(super::scene(&scenario))?;
    let jobs = jobs(&scenario, &mut renderer)?;
    // A run ends with pictures on their way.
    renderer.set_scene(super::scene(&scenario));
    renderer.time_passes();
    let drawn = jobs.iter().map(|job| draw(&mut renderer, job));
    let drawn: Vec<Drawn> = drawn.collect::<Result<_, Error>>()?;
    // The first ones build what later ones use.
    let drawn = &drawn[drawn.len() / 2..];
    let median = |of: &dyn Fn(&Drawn) -> f64| {
        let mut values: Vec<f64> = drawn.iter().map(of).collect();
        Cost::of(&mut values).map_or(0.0, |cost| cost.p50)
    };
    let lenses = jobs.first().map_or(&[][..], |job| &job.views[..]).iter();
    let lenses = lenses.map(|view| &view.camera.intrinsics);
    let pixels = lenses
        .map(|lens| u64::from(lens.width_px) * u64::from(lens.height_px))
        .sum();
    let passes = names(drawn).into_iter().map(|name| {
        let ms = median(&|drawn| drawn.pass_ms(name));
        let ns_per_pixel = 1e6 * ms / pixels as f64;
        PassCost {
            name,
            ms,
            ns_per_pixel,
        }
    });
    let bytes = median(&|drawn| drawn.bytes_back as f64);
    Ok(DrawingProfile {
        case,
        pixels,
        submit_ms: median(&|drawn| drawn.submit_ms),
        draw_ms: median(&|drawn| drawn.draw_ms),
        develop_ms: median(&|drawn| drawn.develop_ms),
        memory_ms: (2.0 * bytes + BYTES_A_PIXEL * pixels as f64) / memory_bytes_per_ms,
        plain_ms: plain_ms(&scenario, &jobs)?,
        passes: passes.collect(),
        between_ms: median(&Drawn::between_ms),
    })
}

/// Those of the scenario's camera.
fn jobs(scenario: &Scenario, renderer: &mut GpuRenderer) -> Result<Vec<Job>, Error> {
    let mut watched = Watched::default();
    run_on(
        scenario,
        renderer,
        &RunOptions::default(),
        &mut [&mut watched],
    )?;
    let Watched {
        mut pairs, frames, ..
    } = watched;
    pairs.extend(frames);
    Ok(pairs)
}

/// One job as it was drawn.
struct Drawn {
    submit_ms: f64,
    draw_ms: f64,
    develop_ms: f64,
    bytes_back: u64,
    passes: Vec<PassTime>,
}

fn draw(renderer: &mut GpuRenderer, job: &Job) -> Result<Drawn, Error> {
    let mut watch = Stopwatch::default();
    let (submitted, submit_s) = watch.time(|| renderer.submit(job));
    submitted?;
    let (bytes_back, draw_s) = watch.time(|| renderer.wait_until_drawn());
    let bytes_back = bytes_back?;
    let (collected, develop_s) = watch.time(|| renderer.collect());
    collected?;
    Ok(Drawn {
        submit_ms: 1e3 * submit_s,
        draw_ms: 1e3 * draw_s,
        develop_ms: 1e3 * develop_s,
        bytes_back,
        passes: renderer.pass_times(),
    })
}

impl Drawn {
    fn pass_ms(&self, name: &str) -> f64 {
        let passes = self.passes.iter().filter(|pass| pass.name == name);
        passes.map(PassTime::ms).sum()
    }

    fn between_ms(&self) -> f64 {
        let ends_ms = self.passes.iter().map(|pass| pass.end_ms);
        ends_ms.fold(0.0, f64::max) - self.passes.iter().map(PassTime::ms).sum::<f64>()
    }
}

/// Names of passes, each once, in the order drawn.
fn names(drawn: &[Drawn]) -> Vec<&'static str> {
    let mut names = Vec::new();
    for pass in drawn.iter().flat_map(|drawn| &drawn.passes) {
        if !names.contains(&pass.name) {
            names.push(pass.name);
        }
    }
    names
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    /// A change of a shipped default, or of a key, that a case cannot live with; a case without its camera.
    #[test]
    fn the_cases_are_right() {
        for (case, text, changes) in CASES {
            let scenario = scenario(text, 1, changes).unwrap();
            let cameras = scenario.wayside.len() + usize::from(scenario.rig().is_some());
            assert_eq!(cameras, 1, "{case}");
        }
    }

    /// A pass counted twice, or a gap that is none.
    #[test]
    fn passes_and_gaps_are_the_whole_time() {
        let pass = |name, begin_ms, end_ms| PassTime {
            name,
            begin_ms,
            end_ms,
        };
        let drawn = Drawn {
            submit_ms: 0.0,
            draw_ms: 0.0,
            develop_ms: 0.0,
            bytes_back: 0,
            passes: vec![
                pass("a", 0.0, 2.0),
                pass("b", 2.5, 3.0),
                pass("a", 4.0, 5.0),
            ],
        };
        assert_eq!(names(std::slice::from_ref(&drawn)), ["a", "b"]);
        let parts = [drawn.pass_ms("a"), drawn.pass_ms("b"), drawn.between_ms()];
        for (part, expected) in parts.into_iter().zip([3.0, 0.5, 1.5]) {
            assert!((part - expected).abs() < 1e-12, "{part}");
        }
    }
}
