//! What devices answer for.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use super::*;
use crate::scenario::ScenarioFile;
use crate::settings::read_toml;
use crate::track::Tunnel;

const TUNNEL: &str = include_str!("../../../tunnels/chengdu_line1.toml");
const SCENARIO: &str = r#"
    name = "post"
    tunnel = "given"
    [[wayside]]
    device = "W1530"
    [wayside.camera]
    calibration_error = { yaw_deg = 1.0 }
    [[obstacles]]
    name = "seen"
    chainage_m = 1505.0
    [[obstacles]]
    name = "behind the device"
    chainage_m = 1536.0
    [[obstacles]]
    name = "far away"
    chainage_m = 1440.0
"#;

/// Fails where a device answers for what it cannot see, does not answer for what its detector was told not
/// to look at, or the world is looked at through the
/// calibration instead of the device.
#[test]
fn a_device_answers_for_what_it_has_in_view() {
    let tunnel = Tunnel::from_toml(TUNNEL).unwrap();
    let mut file: ScenarioFile = read_toml(SCENARIO).unwrap();
    file.stack.wayside.reach_m = 50.0;
    let scenario = Scenario::new(file, tunnel).unwrap();
    let mut world = World::new(scenario.tunnel.clone(), &scenario.physics, 1, 0).unwrap();
    while world.time().secs() < 2.0 {
        world.step(&[]).unwrap();
    }
    let post = &scenario.wayside[0];
    let [view] = FieldOfView::of_all(&scenario).try_into().ok().unwrap();
    let lying: Vec<_> = (view.present(&world).into_iter())
        .filter(|p| p.lies_in_view_since.is_some())
        .collect();
    let names: Vec<_> = lying.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["seen", "far away"]);
    // It fell from 0.67 m over the bed, and is still since it came to rest.
    let since_s = lying[0].lies_in_view_since.unwrap().secs();
    assert!((0.3..1.7).contains(&since_s), "{since_s}");
    let (is, said) = (&view.device, &post.calibration);
    let turned = (is.world_from_camera.rotation).angle_to(&said.world_from_camera.rotation);
    assert!((turned - 1.0f64.to_radians()).abs() < 1e-9);
}
