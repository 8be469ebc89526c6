//! What tests share.

#![allow(
    dead_code,
    clippy::panic,
    clippy::unwrap_used,
    reason = "no test uses all of it, and a test fails by panicking"
)]

pub mod sample;

use image::GrayImage;
use metrotwin::scenario::{Scenario, ScenarioFile};
use metrotwin::settings::read_toml;
use metrotwin::track::Tunnel;
use metrotwin::twin::air::Air;
use metrotwin::twin::lights::LampLight;
use metrotwin::twin::reflectance::Wet;
use metrotwin::twin::render::cpu::CpuRenderer;
use metrotwin::twin::render::gpu::GpuRenderer;
use metrotwin::twin::render::{Job, Renderer, Scene};

/// Makes a renderer.
pub type Make = fn(Scene) -> Box<dyn Renderer>;

/// For tests that all renderers must pass.
pub const RENDERERS: [(&str, Make); 3] = [("cpu", cpu), ("gpu", gpu), ("gpu, whole", whole)];

/// The plain renderer with a ray through every pixel.
pub fn cpu(scene: Scene) -> Box<dyn Renderer> {
    Box::new(CpuRenderer::oracle(scene))
}

/// The plain renderer with few rays where it is dark.
pub fn quick(scene: Scene) -> Box<dyn Renderer> {
    Box::new(CpuRenderer::quick(scene))
}

/// The renderer on the graphics adapter, which must be there.
pub fn gpu(scene: Scene) -> Box<dyn Renderer> {
    Box::new(on_adapter(scene))
}

/// The same as it draws on hardware.
pub fn whole(scene: Scene) -> Box<dyn Renderer> {
    let mut renderer = on_adapter(scene);
    renderer.draw_parts(false);
    Box::new(renderer)
}

fn on_adapter(scene: Scene) -> GpuRenderer {
    match GpuRenderer::new(scene) {
        Ok(renderer) => renderer,
        Err(error) => panic!("{error}; install a driver: apt-get install mesa-vulkan-drivers"),
    }
}

/// All images of a job.
pub fn draw(renderer: &mut dyn Renderer, job: &Job) -> Vec<GrayImage> {
    renderer.submit(job).unwrap();
    renderer.collect().unwrap()
}

/// Nothing but lamps, and nothing else shines.
pub fn dark_scene(lamps: Vec<LampLight>) -> Scene {
    let mut track = sample::track();
    track.ambient_lx = 0.0;
    track.sections.clear();
    Scene {
        tracks: vec![track.into()],
        lamps,
        air: Air::default(),
        wet: Wet::default(),
    }
}

/// A train on its way past a wayside device, all cameras of few pixels: the track shows for 10 m in them.
const SMALL: &str = r#"
    name = "small"
    tunnel = "given"
    duration_s = 4.0
    train = { cars = 1, start_chainage_m = 1300.0, start_speed_kmh = 60.0, cruise_speed_kmh = 60.0 }
    stack = { protection = { initial_chainage_m = 1300.0 }, wayside = { reach_m = 10.0 } }
    [rig]
    pairs_per_s = 10.0
    width_px = 64
    height_px = 36
    pixel_um = 75.0
    [[wayside]]
    device = "W1530"
    camera = { width_px = 64, height_px = 36, pixel_um = 45.0 }
"#;

/// The small scenario, with more keys.
pub fn small_scenario(more: &str) -> Scenario {
    let file: ScenarioFile = read_toml(&format!("{SMALL}\n{more}")).unwrap();
    let tunnel = Tunnel::from_toml(include_str!("../../tunnels/chengdu_line1.toml")).unwrap();
    Scenario::new(file, tunnel).unwrap()
}
