//! Rates and times of what trains and posts carry.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use super::*;
use crate::bus::{SimTime, TrainCommand};
use crate::settings::read_toml;
use crate::track::Tunnel;
use crate::twin::sensors::{ExposureMode, Output};

const TUNNEL: &str = include_str!("../../../tunnels/chengdu_line1.toml");
const POST: &str = r#"
    [[wayside]]
    device = "W1530"
    lidar = { rate_hz = 4.0, step_deg = 5.0 }
    [wayside.camera]
    frames_per_s = 10.0
"#;
const TRAIN: &str = "[train]\nstart_chainage_m = 400.0\nstart_speed_kmh = 54.0\n";

fn scenario(more: &str) -> Scenario {
    let text = format!("name = \"fitting\"\ntunnel = \"given\"\n{more}");
    let tunnel = Tunnel::from_toml(TUNNEL).unwrap();
    Scenario::new(read_toml(&text).unwrap(), tunnel).unwrap()
}

fn world(scenario: &Scenario) -> World {
    World::new(scenario.tunnel.clone(), &scenario.physics, 1, 0).unwrap()
}

/// Steps the world to a time and hands on all that the sensors give.
fn run(
    scenario: &Scenario,
    world: &mut World,
    until_s: f64,
    mut take: impl FnMut(SimTime, &World, Output),
) {
    let mut sensors = Fitting::new(scenario, world).sensors;
    let command = TrainCommand {
        permitted_speed_mps: 15.0,
        ..TrainCommand::default()
    };
    while world.time().secs() < until_s {
        world.step(&[command]).unwrap();
        for mounted in &mut sensors {
            let outputs = mounted.sensor.sample(world).unwrap();
            outputs
                .into_iter()
                .for_each(|o| take(world.time(), world, o));
        }
    }
}

/// A radar at either end gives its frames by number, each when its last chirp is over, 3.2 ms after its start; the clock of
/// both is 20 ms fast.
#[test]
fn radars_at_both_ends_give_their_frames() {
    let radar = "[radar]\nends = [\"front\", \"rear\"]\nframes_per_s = 20.0\nclock = { offset_ms = 20.0 }\n";
    let scenario = scenario(&format!("{TRAIN}{radar}"));
    let sheets = radars(&scenario, &scenario.onboard[0]).len();
    let mut world = world(&scenario);
    let mut frames = Vec::new();
    run(&scenario, &mut world, 0.3, |now, _, output| {
        if let Output::Sample(sample) = output
            && let Content::RadarFrame(frame) = sample.content
        {
            assert_eq!(sample.valid_at, frame.start);
            let late_s = now.secs() + 0.020 - frame.start.secs();
            assert!((0.0032 - 1e-9..0.0043).contains(&late_s), "{late_s}");
            assert_eq!(frame.counts.len(), 2 * 4 * 128 * 256);
            frames.push((frame.end, frame.number, frame.start));
        }
    });
    assert_eq!(sheets, 2);
    for end in [TrainEnd::Front, TrainEnd::Rear] {
        let of_end: Vec<_> = frames.iter().filter(|(at, ..)| *at == end).collect();
        let numbers: Vec<u32> = of_end.iter().map(|(_, number, _)| *number).collect();
        assert_eq!(numbers, [1, 2, 3, 4, 5, 6], "{end:?}");
        let starts = of_end
            .iter()
            .map(|(_, number, start)| start.secs() - 0.05 * f64::from(*number));
        assert!(starts.into_iter().all(|off| off.abs() < 1e-9));
    }
}

/// Each has its own rate, and all agree on the speed of a rolling train within their errors:
/// wheels to three times 0.3 %, the radar to its mount, its noise and the car's pitch.
#[test]
fn rates_and_speeds() {
    let scenario = scenario(&format!("{TRAIN}[doppler]\nrate_hz = 20.0\njanus = true\n"));
    let mut world = world(&scenario);
    let (mut imus, mut odometers, mut radars) = (0, 0, 0);
    let (mut wheel, mut radar, mut truth) = (0.0, 0.0, 0.0);
    run(&scenario, &mut world, 4.0, |_, world, output| {
        let Output::Sample(sample) = output else {
            return;
        };
        match sample.content {
            Content::Imu(_) => imus += 1,
            Content::Odometer(sample) => {
                odometers += 1;
                wheel = sample.speed_mps;
            }
            Content::Doppler(sample) => {
                radars += 1;
                radar += sample.speed_mps.unwrap();
                truth += world.train(TrainId(0)).unwrap().speed_mps;
            }
            _ => {}
        }
    });
    // Of inertial unit and radar the first call only starts them.
    assert_eq!((imus, odometers, radars), (800, 201, 80));
    let speed = world.train(TrainId(0)).unwrap().speed_mps;
    assert!((wheel / speed - 1.0).abs() < 0.0095, "{wheel} of {speed}");
    assert!((radar / truth - 1.0).abs() < 0.005, "{radar} of {truth}");
}

/// A train whose rig looks back has a unit in its last car, and one in its first if track occupancy goes by that: at
/// 15 m/s into a curve of 500 m the first car turns at 30 mrad/s while the last one is on the straight before.
#[test]
fn each_end_that_needs_one_has_an_inertial_unit() {
    let rear = "[rig]\nend = 'rear'\nside = 'right'\nyaw_deg = 141.0\n";
    for (more, ends) in [
        ("", vec![TrainEnd::Rear]),
        ("[gnss]\n", vec![TrainEnd::Rear, TrainEnd::Front]),
    ] {
        let train = TRAIN.replace("400.0", "465.0");
        let scenario = scenario(&format!("{train}stop_at_m = 900.0\n{rear}{more}"));
        let mut turned = [(TrainEnd::Front, 0.0, 0), (TrainEnd::Rear, 0.0, 0)];
        run(&scenario, &mut world(&scenario), 1.0, |_, _, output| {
            if let Output::Sample(sample) = output
                && let Content::Imu(imu) = sample.content
            {
                let of_end = turned.iter_mut().find(|(end, ..)| *end == imu.end).unwrap();
                of_end.1 += imu.gyro_rad_s.z;
                of_end.2 += 1;
            }
        });
        for (end, sum, count) in turned {
            assert_eq!(count > 0, ends.contains(&end), "{end:?}: {count}");
            let expected = if end == TrainEnd::Front { 0.03 } else { 0.0 };
            let mean = sum / f64::from(count.max(1));
            assert!(
                count == 0 || (mean - expected).abs() < 0.005,
                "{end:?}: {mean}"
            );
        }
    }
}

/// A clock that is fast and drifts stamps samples ahead of the time, and samples as much sooner.
#[test]
fn each_sensor_has_its_own_clock() {
    let clock = "[odometer]\nclock = { offset_ms = 30.0, drift_ppm = 500.0 }\n";
    let scenario = scenario(&format!("{TRAIN}{clock}"));
    let mut world = world(&scenario);
    let mut ahead_s = Vec::new();
    run(&scenario, &mut world, 2.0, |now, _, output| {
        if let Output::Sample(sample) = output {
            let ahead = sample.valid_at.since(now);
            match sample.content {
                Content::Odometer(odometer) => {
                    assert_eq!(odometer.time, sample.valid_at);
                    ahead_s.push(ahead);
                }
                _ => assert!(ahead.abs() < 1e-12),
            }
        }
    });
    assert!((ahead_s[0] - 0.03).abs() < 1e-5, "{}", ahead_s[0]);
    let last_s = ahead_s[ahead_s.len() - 1];
    assert!((last_s - 0.031).abs() < 2e-5, "{last_s}");
}

/// Fails where a sweep is made for each frame instead of at the lidar's rate, or before the head has
/// come round.
#[test]
fn the_lidar_turns_at_its_own_rate() {
    let scenario = scenario(POST);
    let (mut sweeps, mut frames) = (Vec::new(), 0);
    run(
        &scenario,
        &mut world(&scenario),
        1.0,
        |now, _, output| match output {
            Output::Sample(sample) => sweeps.push((sample.valid_at.secs(), now.secs())),
            Output::Capture(_) => frames += 1,
        },
    );
    assert_eq!(frames, 10);
    let begun: Vec<f64> = sweeps.iter().map(|(begun_s, _)| *begun_s).collect();
    assert_eq!(begun, [0.0, 0.25, 0.5, 0.75]);
    // A sweep of 120 deg at 4 turns a second takes 83 ms.
    for (begun_s, given_s) in sweeps {
        assert!(
            (given_s - begun_s - 0.0833).abs() < 2e-3,
            "{begun_s} {given_s}"
        );
    }
}

/// Fails where a lengthened exposure is delivered before it is over.
#[test]
fn a_frame_is_due_when_its_longest_exposure_is_over() {
    let mut scenario = scenario(POST);
    let camera = &mut scenario.wayside[0].camera;
    camera.exposure_us = 1000.0;
    camera.exposure_control.mode = ExposureMode::Auto;
    camera.exposure_control.max_exposure_us = Some(50_000.0);
    let span_s = 1079.0 * 14.8e-6 + 0.05;
    let mut first = None;
    run(&scenario, &mut world(&scenario), 0.09, |now, _, output| {
        if let Output::Capture(capture) = output {
            first.get_or_insert((now, capture));
        }
    });
    let (due, capture) = first.unwrap();
    assert!((0.0..1e-3).contains(&(due.secs() - span_s)), "{due}");
    assert!((capture.header.with.exposure_s - 1e-3).abs() < 1e-12);
    assert!((capture.views[0].camera.shutter.exposure_s - 1e-3).abs() < 1e-12);
}
