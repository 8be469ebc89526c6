//! `metrotwin doctor`: which graphics adapters there are, and how fast this machine is.
//!
//! Every figure is the time of the code that `run` uses, at work on a shipped scene: a train at
//! 60 km/h on `chengdu_line1`, its stereo pairs (1280 x 720 an eye), and the frames of wayside
//! device W1530 (1920 x 1080). The tunnel is part of the program, so it works anywhere.

use super::fault::Failure;
use super::print;
use crate::bus::{Frame, SimTime, TrainCommand};
use crate::scenario::{Scenario, ScenarioFile};
use crate::session::cameras::{StereoCamera, pair, wayside_view};
use crate::session::{self, Cost, RendererChoice};
use crate::stack::positioning::LedPositioner;
use crate::stack::wayside::WaysideDetector;
use crate::track::{Tunnel, read_toml};
use crate::twin::physics::World;
use crate::twin::random::Stream;
use crate::twin::render::{Backend, Job, Renderer, View, gpu};
use crate::twin::sensors::{Imu, Odometer};
use anyhow::{Context, anyhow};
use image::GrayImage;
use serde::Serialize;

const AFTER: &str = "\
A figure is the best median of rounds of 20 frames.

Examples:
  metrotwin doctor
  metrotwin doctor --json | jq .stereo_pairs_per_s";

/// List graphics adapters and measure how fast this machine is
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(super) struct DoctorArgs {
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
}

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
const STEPS: usize = 50;

#[derive(Serialize)]
struct Speeds {
    /// What drew.
    adapter: String,
    backend: String,
    /// Everything that could draw.
    adapters: Vec<Backend>,
    stereo_pairs_per_s: f64,
    wayside_frames_per_s: f64,
    physics_us_per_step: f64,
    led_ms_per_pair: f64,
    wayside_ms_per_frame: f64,
}

pub(super) fn doctor(args: &DoctorArgs) -> Result<(), Failure> {
    let speeds = measure().map_err(Failure::run)?;
    if args.json {
        let text = serde_json::to_string_pretty(&speeds).map_err(Failure::run)?;
        print(&text)
    } else {
        print(&table(&speeds))
    }
}

fn table(s: &Speeds) -> String {
    let mut text = String::new();
    for a in &s.adapters {
        text += &format!("adapter    {} ({})\n", a.adapter, a.backend);
    }
    if s.adapters.is_empty() {
        text += "adapter    none; on Debian or Ubuntu: apt-get install mesa-vulkan-drivers\n";
    }
    text += &format!("drawn by   {} ({})\n\n", s.adapter, s.backend);
    let mut line = |what: &str, value: f64, unit: &str| {
        text += &format!("{what:34} {value:9.2} {unit}\n");
    };
    line(
        "stereo pairs, 2 x 1280 x 720",
        s.stereo_pairs_per_s,
        "a second",
    );
    line(
        "wayside frames, 1920 x 1080",
        s.wayside_frames_per_s,
        "a second",
    );
    line("physics, six cars", s.physics_us_per_step, "us a step");
    line("lamp positioning", s.led_ms_per_pair, "ms a pair");
    line("wayside detection", s.wayside_ms_per_frame, "ms a frame");
    text
}

fn scene() -> anyhow::Result<Scenario> {
    let tunnel = Tunnel::from_toml(TUNNEL)?;
    let file: ScenarioFile = read_toml(SCENE)?;
    Ok(Scenario::new(file, tunnel)?)
}

fn measure() -> anyhow::Result<Speeds> {
    let scenario = scene()?;
    let mut renderer = session::renderer(&scenario, RendererChoice::Auto)?;
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
) -> anyhow::Result<Times> {
    let rig = scenario.rig.as_ref().context("the scene has a rig")?;
    let camera = StereoCamera::new(rig, scenario.seed);
    let map = scenario.tunnel.clone();
    let mut positioner = LedPositioner::new(&scenario.stack.led, rig.calibration(), map);
    let mut imu = Imu::new(&scenario.imu, scenario.seed, 0);
    let mut odometer = Odometer::new(&scenario.odometer, scenario.seed, 0);
    let (mut next_imu, mut next_odometer) = (SimTime::ZERO, SimTime::ZERO);

    let mut times = Times::default();
    let mut batch_s = 0.0;
    let mut steps = 0;
    // One pair more than is timed: the first one also builds what later ones use.
    while times.draw_s.len() <= rounds * ROUND {
        let (step, seconds) = timed(|| {
            world.step(&TrainCommand {
                permitted_speed_mps: 80.0 / 3.6,
                ..TrainCommand::default()
            })
        });
        step?;
        batch_s += seconds;
        steps += 1;
        if steps % STEPS == 0 {
            times.step_s.push(batch_s / STEPS as f64);
            batch_s = 0.0;
        }
        let now = world.time();
        if now >= next_imu {
            imu.sample(world).iter().for_each(|s| positioner.on_imu(s));
            next_imu = next_imu.plus(imu.period_s());
        }
        if now >= next_odometer {
            odometer
                .sample(world)
                .iter()
                .for_each(|s| positioner.on_odometer(s));
            next_odometer = next_odometer.plus(odometer.period_s());
        }
        let number = times.draw_s.len() as u32;
        let start = SimTime::from_secs(f64::from(number) / rig.pairs_per_s);
        if now < start.plus(camera.delay_s()) {
            continue;
        }
        let views = camera
            .views(number, start, |t| world.vehicle_at(t))
            .ok_or_else(|| anyhow!("the train's pose at {start} is not known"))?;
        let (images, seconds) = timed(|| draw(renderer, world, views.into()));
        times.draw_s.push(seconds);
        let [left, right] = <[GrayImage; 2]>::try_from(images?)
            .map_err(|_| anyhow!("the renderer did not draw a pair"))?;
        let pair = pair(number, start, [left, right]);
        let (_, seconds) = timed(|| positioner.on_pair(&pair));
        times.stack_s.push(seconds);
    }
    times.draw_s.remove(0);
    times.stack_s.remove(0);
    Ok(times)
}

/// The wayside camera takes frames, and its detector looks at them; while it learns its reference
/// it is not timed.
fn wayside_seconds(
    scenario: &Scenario,
    world: &World,
    renderer: &mut dyn Renderer,
    rounds: usize,
) -> anyhow::Result<Times> {
    let post = scenario.wayside.first().context("the scene has a device")?;
    let stream = Stream::new(scenario.seed, 0, "doctor");
    let learning = scenario.stack.wayside.reference_frames as usize;
    let settings = &scenario.stack.wayside;
    let map = scenario.tunnel.clone();
    let mut detector = WaysideDetector::new(settings, post.calibration.clone(), map);
    let mut times = Times::default();
    for k in 0..(learning + 1 + rounds * ROUND) as u32 {
        let start = SimTime::from_secs(f64::from(k) / post.camera.frames_per_s);
        let view = wayside_view(
            &post.calibration,
            post.camera.sensor_behind_lens(),
            stream,
            k,
            start,
        );
        let (images, draw_s) = timed(|| draw(renderer, world, vec![view]));
        let image = images?.pop().context("the renderer did not draw a frame")?;
        let frame = Frame {
            number: k,
            start,
            image,
        };
        let (_, stack_s) = timed(|| detector.on_frame(&frame, None, None));
        if k as usize > learning {
            times.draw_s.push(draw_s);
            times.stack_s.push(stack_s);
        }
    }
    Ok(times)
}

fn draw(
    renderer: &mut dyn Renderer,
    world: &World,
    views: Vec<View>,
) -> anyhow::Result<Vec<GrayImage>> {
    renderer.submit(&Job {
        time: world.time(),
        bodies: world.bodies(),
        headlights: world.headlights(),
        views,
    })?;
    Ok(renderer.collect()?)
}

/// The least median of whole rounds.
fn best_median(values: &[f64]) -> f64 {
    values
        .chunks_exact(ROUND)
        .filter_map(|round| Cost::of(&mut round.to_vec()))
        .map(|cost| cost.p50)
        .fold(f64::INFINITY, f64::min)
}

#[allow(
    clippy::disallowed_methods,
    reason = "how fast this machine is can only be told by the clock"
)]
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let begin = std::time::Instant::now();
    let result = work();
    (result, begin.elapsed().as_secs_f64())
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
