//! What devices answer for.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use super::*;
use crate::bus::TrainCommand;
use crate::track::read_toml;
use crate::twin::sensors::ExposureMode;

const TUNNEL: &str = include_str!("../../tunnels/chengdu_line1.toml");
const SCENARIO: &str = r#"
    name = "post"
    tunnel = "given"
    [[wayside]]
    device = "W1530"
    lidar = { rate_hz = 4.0, step_deg = 5.0 }
    [wayside.camera]
    frames_per_s = 10.0
    calibration_error = { yaw_deg = 1.0 }
    [[obstacles]]
    name = "seen"
    chainage_m = 1505.0
    [[obstacles]]
    name = "behind the device"
    chainage_m = 1536.0
    [[obstacles]]
    name = "beyond its reach"
    chainage_m = 1440.0
"#;

fn post() -> (Scenario, World, Device) {
    let tunnel = Tunnel::from_toml(TUNNEL).unwrap();
    let scenario = Scenario::new(read_toml(SCENARIO).unwrap(), tunnel).unwrap();
    let world = World::new(scenario.tunnel.clone(), &scenario.physics, 1, 0).unwrap();
    let device = Device::all(&scenario, &scenario.map()).pop().unwrap();
    (scenario, world, device)
}

/// Fails where a scan is made for each frame instead of at the lidar's rate, or before the
/// head has come round.
#[test]
fn the_lidar_turns_at_its_own_rate() {
    let (_, mut world, mut device) = post();
    let mut scans = Vec::new();
    let mut frames = 0;
    while world.time().secs() < 1.0 {
        world.step(&TrainCommand::default()).unwrap();
        device.sweep(&world);
        if device.due(world.time()).is_some() {
            frames += 1;
            let begun = device.look(&world).scan.map(|s| s.time);
            if begun != scans.last().copied() {
                scans.extend(begun);
            }
        }
    }
    assert_eq!(frames, 10);
    let begun: Vec<_> = scans.into_iter().map(SimTime::secs).collect();
    // A sweep of 120 deg at 4 turns a second takes 83 ms: that begun at 0 is not complete when
    // the first frame closes, that begun at 0.75 s is when the last one does.
    assert_eq!(begun, [0.0, 0.25, 0.5, 0.75]);
}

/// Fails where a lengthened exposure is delivered before it is over.
#[test]
fn a_frame_is_due_when_its_longest_exposure_is_over() {
    let (mut scenario, ..) = post();
    let camera = &mut scenario.wayside[0].camera;
    camera.exposure_us = 1000.0;
    camera.exposure_control.mode = ExposureMode::Auto;
    camera.exposure_control.max_exposure_us = Some(50_000.0);
    let mut device = Device::all(&scenario, &scenario.map()).pop().unwrap();
    let span_s = 1079.0 * 14.8e-6 + 0.05;
    assert!(device.due(SimTime::from_secs(span_s - 1e-6)).is_none());
    let (taken, view) = device.due(SimTime::from_secs(span_s + 1e-6)).unwrap();
    assert!((taken.with.exposure_s - 1e-3).abs() < 1e-12);
    assert!((view.camera.shutter.exposure_s - 1e-3).abs() < 1e-12);
}

/// Fails where a device answers for what it cannot see, or the world is drawn through the
/// calibration instead of the device.
#[test]
fn a_device_answers_for_what_it_has_in_view() {
    let (_, mut world, device) = post();
    while world.time().secs() < 2.0 {
        world.step(&TrainCommand::default()).unwrap();
    }
    let lying: Vec<_> = (device.look(&world).present.into_iter())
        .filter(|p| p.lies_in_view_since.is_some())
        .collect();
    assert_eq!(lying.len(), 1, "{lying:?}");
    assert_eq!(lying[0].name, "seen");
    // It fell from 0.67 m over the bed, and is still since it came to rest.
    let since_s = lying[0].lies_in_view_since.unwrap().secs();
    assert!((0.3..1.7).contains(&since_s), "{since_s}");
    let (is, said) = (&device.outlook.device, device.calibration());
    let turned = (is.world_from_camera.rotation).angle_to(&said.world_from_camera.rotation);
    assert!((turned - 1.0f64.to_radians()).abs() < 1e-9);
}
