//! How fast this machine is.
//!
//! Every figure is the time of the code that a run uses, at work on a shipped scene: a train at
//! 60 km/h on `chengdu_line1`, its stereo pairs (1280 x 720 an eye), and the frames of wayside
//! device W1530 (1920 x 1080). The tunnel is part of the program, so it works anywhere.

use super::cameras::{Taken, wayside_view};
use super::eyes::Eyes;
use super::motion::MotionSensors;
use super::summary::Cost;
use super::watch::Stopwatch;
use super::{RendererChoice, SessionError, renderer};
use crate::bus::{Frame, SimTime, TrainCommand};
use crate::scenario::{Scenario, ScenarioFile};
use crate::settings::read_toml;
use crate::stack::wayside::WaysideDetector;
use crate::track::Tunnel;
use crate::twin::physics::World;
use crate::twin::random::Stream;
use crate::twin::render::{Backend, Job, Renderer, View, gpu};
use image::GrayImage;
use serde::Serialize;

/// Whatever goes wrong.
type Error = Box<dyn std::error::Error + Send + Sync>;

const TUNNEL: &str = include_str!("../../tunnels/chengdu_line1.toml");

const SCENE: &str = r#"
name = "doctor"
tunnel = "chengdu_line1"
duration_s = 5.0
rig = {}
train = { start_chainage_m = 1330.0, start_speed_kmh = 60.0, cruise_speed_kmh = 60.0 }
wayside = [{ device = "W1530" }]
"#;

/// Frames in a round.
const ROUND: usize = 20;
/// Rounds; the plain renderer is slow enough for one to do.
const ROUNDS: usize = 3;
/// Steps of the world that are timed together.
const STEPS: u64 = 50;

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
    let scenario = scene()?;
    let mut renderer = renderer(&scenario, RendererChoice::Auto)?;
    let drawn_by = renderer.backend();
    let rounds = if drawn_by.backend == "cpu" { 1 } else { ROUNDS };

    let mut world = World::new(scenario.tunnel.clone(), &scenario.physics, scenario.seed, 0)?;
    let train = train_seconds(&scenario, &mut world, renderer.as_mut(), rounds)?;
    let wayside = wayside_seconds(&scenario, &world, renderer.as_mut(), rounds)?;
    Ok(Speeds {
        adapter: drawn_by.adapter,
        backend: drawn_by.backend,
        adapters: gpu::adapters(),
        stereo_pairs_per_s: 1.0 / best_median(&train.draw_s),
        wayside_frames_per_s: 1.0 / best_median(&wayside.draw_s),
        physics_us_per_step: 1e6 * best_median(&train.step_s),
        led_ms_per_pair: 1e3 * best_median(&train.stack_s),
        wayside_ms_per_frame: 1e3 * best_median(&wayside.stack_s),
    })
}

fn scene() -> Result<Scenario, Error> {
    let tunnel = Tunnel::from_toml(TUNNEL)?;
    let file: ScenarioFile = read_toml(SCENE)?;
    Ok(Scenario::new(file, tunnel)?)
}

#[derive(Default)]
struct Times {
    step_s: Vec<f64>,
    draw_s: Vec<f64>,
    stack_s: Vec<f64>,
}

/// The train runs, its camera takes pairs, the positioning reads them.
fn train_seconds(
    scenario: &Scenario,
    world: &mut World,
    renderer: &mut dyn Renderer,
    rounds: usize,
) -> Result<Times, Error> {
    let rig = scenario.rig.as_ref().ok_or("the scene has no rig")?;
    let mut eyes = Eyes::new(scenario, rig, &scenario.map());
    let mut motion = MotionSensors::new(scenario);
    let command = TrainCommand {
        permitted_speed_mps: 80.0 / 3.6,
        ..TrainCommand::default()
    };

    let mut times = Times::default();
    let (mut steps, mut stack) = (Stopwatch::default(), Stopwatch::default());
    let mut jobs = Vec::new();
    // One pair more than is timed: the first one also builds what later ones use.
    while jobs.len() <= rounds * ROUND {
        steps.time(|| world.step(&command)).0?;
        if steps.times == STEPS {
            times.step_s.push(steps.total_s / STEPS as f64);
            steps = Stopwatch::default();
        }
        let now = world.time();
        let samples = motion.sample(world);
        samples.imu.iter().for_each(|s| eyes.positioner.on_imu(s));
        let odometer = samples.odometer.iter();
        odometer.for_each(|s| eyes.positioner.on_odometer(s));
        let Some((number, start)) = eyes.clock.due(now, eyes.camera.delay_s()) else {
            continue;
        };
        let vehicle_at = |t| world.vehicle_at(t);
        let mut views = (eyes.camera.views(number, start, vehicle_at))
            .ok_or(SessionError::PoseForgotten(start.secs()))?;
        let taken = Taken {
            number,
            start,
            with: eyes.expose(&mut views),
        };
        jobs.push(job(world, views.into()));
        let before_s = stack.total_s;
        let head_at = |t| world.chainage_at(t);
        draw(renderer, &jobs[jobs.len() - 1..], |images| {
            Ok(eyes
                .read(&taken, images, &mut stack, vehicle_at, head_at)
                .map(drop)?)
        })?;
        times.stack_s.push(stack.total_s - before_s);
    }
    times.stack_s.remove(0);
    // Once more for the time that it takes, with nothing else to do.
    times.draw_s = draw(renderer, &jobs, |_| Ok(()))?;
    Ok(times)
}

/// The wayside camera takes frames, and its detector looks at them; while it learns its reference
/// it is not timed.
fn wayside_seconds(
    scenario: &Scenario,
    world: &World,
    renderer: &mut dyn Renderer,
    rounds: usize,
) -> Result<Times, Error> {
    let post = scenario.wayside.first().ok_or("the scene has no device")?;
    let stream = Stream::new(scenario.seed, 0, "doctor");
    let learning = scenario.stack.wayside.reference_frames as usize;
    let settings = &scenario.stack.wayside;
    let map = scenario.map();
    let mut detector = WaysideDetector::new(settings, post.calibration.clone(), map);
    let start = |k: u32| SimTime::from_secs(f64::from(k) / post.camera.frames_per_s);
    let jobs: Vec<_> = (0..(learning + 1 + rounds * ROUND) as u32)
        .map(|k| wayside_view(&post.calibration, &post.camera, stream, k, start(k)))
        .map(|view| job(world, vec![view]))
        .collect();
    let mut times = Times::default();
    for (number, job) in (0..).zip(&jobs) {
        draw(renderer, std::slice::from_ref(job), |mut images| {
            let frame = Frame {
                number,
                start: start(number),
                exposure_s: post.calibration.camera.shutter.exposure_s,
                gain_db: post.camera.sensor.gain_db,
                image: images.pop().ok_or("the renderer did not draw a frame")?,
            };
            let work = || detector.on_frame(&frame, None, None);
            times.stack_s.push(Stopwatch::default().time(work).1);
            Ok(())
        })?;
    }
    // Once more for the time that it takes, with nothing else to do.
    times.draw_s = draw(renderer, &jobs[learning..], |_| Ok(()))?;
    times.stack_s.drain(..=learning);
    Ok(times)
}

fn job(world: &World, views: Vec<View>) -> Job {
    Job {
        time: world.time(),
        bodies: world.bodies(),
        headlights: world.headlights(),
        views,
        ..Job::default()
    }
}

/// Draws all jobs and hands their images on; the seconds from each to the one before it. As in a run,
/// the next is asked for before the last is read back, and an image does not outlive its use.
fn draw(
    renderer: &mut dyn Renderer,
    jobs: &[Job],
    mut take: impl FnMut(Vec<GrayImage>) -> Result<(), Error>,
) -> Result<Vec<f64>, Error> {
    let mut seconds = Vec::new();
    for (k, job) in jobs.iter().enumerate() {
        let work = || {
            renderer.submit(job)?;
            (k > 0).then(|| renderer.collect()).transpose()
        };
        let (images, draw_s) = Stopwatch::default().time(work);
        if let Some(images) = images? {
            seconds.push(draw_s);
            take(images)?;
        }
    }
    take(renderer.collect()?)?;
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
    fn the_scene_is_right() {
        let scenario = scene().unwrap();
        assert_eq!((scenario.wayside.len(), scenario.rig.is_some()), (1, true));
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
