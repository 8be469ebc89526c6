//! What moves while a row is exposed, against a brute-force integration in 256 instants.
//!
//! A machine without a graphics adapter fails here: `apt-get install mesa-vulkan-drivers` gives a
//! software one.

use crate::common::{Make, RENDERERS, cpu, dark_scene, draw, gpu, sample};
use image::GrayImage;
use metrotwin::bus::Intrinsics;
use metrotwin::twin::geometry::{Body, Shape};
use metrotwin::twin::render::cpu::CpuRenderer;
use metrotwin::twin::render::{CameraMotion, Job, Renderer, Scene, View};
use nalgebra::{UnitQuaternion, Vector3};

fn brute_force(scene: Scene) -> Box<dyn Renderer> {
    Box::new(CpuRenderer::oracle(scene).sliced(256))
}

/// Root of the mean square of the difference.
fn apart(a: &GrayImage, b: &GrayImage) -> f64 {
    let square = |(a, b): (&u8, &u8)| f64::from(a.abs_diff(*b)).powi(2);
    (a.iter().zip(b.iter()).map(square).sum::<f64>() / a.len() as f64).sqrt()
}

/// A small picture of the rig at 100 km/h with a long exposure, `grey` levels for a luminance.
fn small_view(exposure_s: f64, luminance_cd_m2: f64, grey: f64) -> View {
    let mut view = sample::rig_view(&sample::track(), 101.0, 100.0 / 3.6);
    view.camera.intrinsics = Intrinsics::centred(320, 180, 260.0);
    view.camera.shutter.exposure_s = exposure_s;
    view.camera.shutter.line_time_s = 80e-6;
    view.sensor = view.sensor.without_flaws();
    // No electron is lost in a full well: that is another test's.
    view.sensor.full_well_e = 1e5;
    let electrons = view.electrons_per_cd_m2() * luminance_cd_m2;
    view.lens.f_number *= (electrons / 2e4).sqrt().max(1.0);
    view.set_gain_for(luminance_cd_m2, grey);
    view
}

/// Provokes discs drawn at too few instants of a long exposure, or with their light at the wrong
/// ones: under one grey level RMS, over the picture and over what lamps light of it.
#[test]
fn lamps_smear_as_in_brute_force() {
    let scene = dark_scene(sample::scene().lamps);
    for exposure_s in [30e-6, 300e-6, 2e-3] {
        let mut view = small_view(exposure_s, 4e4, 200.0);
        view.lens.f_number = view.lens.f_number.min(64.0);
        let job = Job {
            views: vec![view],
            ..Job::default()
        };
        let right = draw(&mut *brute_force(scene.clone()), &job).remove(0);
        let lit = right.iter().filter(|p| **p > 10).count() as f64;
        assert!(lit > 100.0, "{lit}");
        for (name, make) in RENDERERS {
            let off = apart(&draw(&mut *make(scene.clone()), &job).remove(0), &right);
            let off_lit = off * (right.len() as f64 / lit).sqrt();
            println!("{name} {exposure_s}: {off:.3} RMS, {off_lit:.3} where lit");
            assert!(off < 1.0 && off_lit < 1.0, "{name}: {off} {off_lit}");
        }
    }
}

/// Root of the mean square of the difference from the mean of 256 pictures by the same renderer, one
/// for each part of the exposure.
fn apart_from_parts(make: Make, scene: &Scene, job: &Job) -> f64 {
    const PARTS: u32 = 256;
    let mut renderer = make(scene.clone());
    let mut sum = vec![0.0; 320 * 180];
    for k in 0..PARTS {
        let mut part = job.clone();
        let view = &mut part.views[0];
        view.camera.shutter.exposure_s /= f64::from(PARTS);
        let after_s = view.camera.shutter.exposure_s * f64::from(k);
        view.start = view.start.plus(after_s);
        view.sensor.gain_db += 20.0 * f64::from(PARTS).log10();
        renderer.submit(&part).unwrap();
        let picture = renderer.collect().unwrap().remove(0);
        for (sum, pixel) in sum.iter_mut().zip(picture.iter()) {
            *sum += f64::from(*pixel) / f64::from(PARTS);
        }
    }
    let whole = draw(&mut *make(scene.clone()), job).remove(0);
    let square = |(mean, pixel): (&f64, &u8)| (mean - f64::from(*pixel)).powi(2);
    (sum.iter().zip(whole.iter()).map(square).sum::<f64>() / sum.len() as f64).sqrt()
}

/// What a camera does while it exposes.
#[derive(Clone, Copy, Debug)]
enum Motion {
    AlongTheLine,
    None,
    /// By 1 rad/s, with a lens that shows nothing near.
    Turns,
}

/// Walls in floodlight, and a board that moves across.
fn a_lit_tunnel_that_passes(name: &str, make: Make) {
    let mut scene = sample::scene();
    let mut track = (*scene.tracks[0]).clone();
    track.ambient_lx = 20_000.0;
    scene.tracks = vec![track.into()];
    scene.lamps.clear();
    for (exposure_s, motion) in [
        (30e-6, Motion::AlongTheLine),
        (300e-6, Motion::AlongTheLine),
        (2e-3, Motion::AlongTheLine),
        (2e-3, Motion::None),
        (2e-3, Motion::Turns),
    ] {
        // Nothing is white: the mean of what is cut off is not what is cut off from the mean.
        let mut view = small_view(exposure_s, 2000.0, 80.0);
        let time = view.start.plus(8e-3);
        let pose = view.motion.pose_at(time);
        match motion {
            Motion::AlongTheLine => {}
            Motion::None => view.motion = CameraMotion::still(pose),
            Motion::Turns => {
                view.camera.intrinsics = Intrinsics::centred(320, 180, 2600.0);
                let turned = |rad| pose * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), rad);
                view.motion = CameraMotion {
                    first: time.plus(-0.05),
                    step_s: 0.1,
                    poses: vec![turned(-0.05), turned(0.05)],
                };
            }
        }
        let ahead = pose * nalgebra::Isometry3::translation(-0.4, 0.2, 3.0);
        let job = Job {
            time,
            bodies: vec![Body {
                shape: Shape::Box(Vector3::new(0.2, 0.3, 0.01)),
                world_from_body: ahead,
                velocity_mps: ahead * Vector3::new(15.0, -8.0, 0.0),
                albedo: 0.9,
                luminance_cd_m2: 0.0,
            }],
            views: vec![view],
            ..Job::default()
        };
        let off = apart_from_parts(make, &scene, &job);
        println!("{name} {exposure_s}, {motion:?}: {off:.3} RMS");
        assert!(off < 1.0, "{name}: {off}");
    }
}

/// Provokes a picture that is sharp where everything has moved by many pixels.
#[test]
fn all_else_smears_on_the_cpu() {
    a_lit_tunnel_that_passes("cpu", cpu);
}

/// The same.
#[test]
fn all_else_smears_on_the_gpu() {
    a_lit_tunnel_that_passes("gpu", gpu);
}
