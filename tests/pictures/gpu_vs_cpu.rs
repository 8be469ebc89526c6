//! The renderers against each other and against geometry.
//!
//! Two programs draw the same jobs. They share the scene, the constants of surfaces, the light of lamps
//! in time and of their glare, airlight, paintings, the fixed pattern and the pose at a time; all else,
//! from rays and triangles to noise, each does in its own way. Where they may differ, and by how much:
//!
//! | where | why | bound |
//! |---|---|---|
//! | silhouettes, facet edges | one sample a pixel, f32 against f64, coarse rings far away | pixels off by more than 2 grey levels: 1 % |
//! | paint in floodlight or at ten times the gain | one texel of a mip or rip map against the mean over the pixel's slanted footprint: softer edges | off by more than 2: 20 %, by more than 20: 2 %; and no shift by a pixel fits as well |
//! | the same, where both sides differ much | no more than silhouettes have pixels | off by more than 20: 0.3 % |
//! | silhouettes before wet ground | it is as bright as the lamps that it mirrors | off by more than 2: 1.5 % |
//! | edges out of focus | a Gaussian for a disc, and light of what is hidden from the middle of the pupil | off by more than 2: 3 % |
//! | everywhere else | f32, light interpolated over facets | 2 grey levels |
//! | edges and joints close to the camera | the rasteriser moves corners row by row and draws straight between them: 0.2 px | within the same bounds |
//! | walls beside a lamp | light falls with a power of the distance; cells are cut to a quarter of it | within the same bounds |
//! | a lamp's bounding box, full size | a closed form against rays spread over the pixel | 2 % over 2 |
//! | noise | none: the same streams (`tests/pictures/sensor.rs`) | equal mean and variance in every grey band |
//!
//! A machine without a graphics adapter fails here: `apt-get install mesa-vulkan-drivers` gives a
//! software one.

use crate::common::{Make, cpu, draw, gpu, sample};
use image::GrayImage;
use metrotwin::bus::{Distortion, DistortionCoefficients, Intrinsics, SimTime};
use metrotwin::track::{Track, TrackPoint};
use metrotwin::twin::geometry::{Body, Hull, Shape};
use metrotwin::twin::lights::{Headlight, LampLight};
use metrotwin::twin::reflectance::{Wet, WetRange};
use metrotwin::twin::render::{CameraMotion, Job, Renderer, Scene, View};
use nalgebra::{Isometry3, Point2, Point3, UnitQuaternion, Vector3};
use std::f64::consts::TAU;

const SPEED_MPS: f64 = 100.0 / 3.6;

pub fn quiet(job: &Job) -> Job {
    let mut job = job.clone();
    for view in &mut job.views {
        view.sensor.noise = false;
    }
    job
}

pub fn scaled(view: &mut View, gain: f64, divisor: u32) {
    // Less gain than none would show a full well instead of white.
    view.lens.transmission *= gain.min(1.0);
    view.sensor.gain_db += 20.0 * gain.max(1.0).log10();
    let i = view.camera.intrinsics;
    view.camera.intrinsics = Intrinsics::centred(
        i.width_px / divisor,
        i.height_px / divisor,
        i.fx_px / f64::from(divisor),
    );
}

/// Poses a millisecond apart of a train that bounces, pitches and sways as it runs.
fn shaken(track: &Track, s_m: f64, start: SimTime) -> CameraMotion {
    let poses = (-2..40)
        .map(|k| {
            let t = 1e-3 * f64::from(k);
            let swing = |hz: f64| (TAU * hz * t + hz).sin();
            let at = TrackPoint {
                s_m: s_m + SPEED_MPS * t,
                l_m: 1.08 + 0.004 * swing(11.0),
                h_m: 1.75 + 0.006 * swing(17.0),
            };
            let (yaw, pitch) = (41.0 + 0.2 * swing(23.0), 26.0 + 0.4 * swing(13.0));
            sample::camera_pose(track, at, yaw.to_radians(), pitch.to_radians())
        })
        .collect();
    CameraMotion {
        first: start.plus(-2e-3),
        step_s: 1e-3,
        poses,
    }
}

/// The sample scene, with so much light on all surfaces that every pattern shows.
fn floodlit() -> Scene {
    let mut scene = sample::scene();
    let mut track = (*scene.tracks[0]).clone();
    track.ambient_lx = 20_000.0;
    scene.tracks = vec![track.into()];
    scene
}

/// The rig at 100 km/h.
fn rig_job(track: &Track, s_m: f64, gain: f64) -> Job {
    let mut view = sample::rig_view(track, s_m, SPEED_MPS);
    view.start = SimTime::from_secs(12.345);
    view.motion = shaken(track, s_m, view.start);
    scaled(&mut view, gain, 2);
    Job {
        time: view.start.plus(-5e-3),
        headlights: vec![headlight(track, s_m + 1.0)],
        bodies: vec![Body {
            shape: Shape::Cylinder(0.1, 0.25),
            world_from_body: sample::on_bed(track, s_m + 2.0, 2.2, 3.1),
            velocity_mps: Vector3::new(3.0, -2.0, 1.0),
            albedo: 0.4,
            luminance_cd_m2: 0.0,
        }],
        views: vec![view],
    }
}

fn headlight(track: &Track, s_m: f64) -> Headlight {
    Headlight {
        world_from_light: sample::on_bed(track, s_m, 0.8, 1.2),
        intensity_cd: 40_000.0,
        exponent: 60.0,
    }
}

/// A lopsided body with flat faces, some as large as a light cell.
fn boulder() -> Shape {
    let corners = [
        [0.9, 0.7, -0.5],
        [1.0, -0.6, -0.5],
        [-0.8, -0.8, -0.4],
        [-0.9, 0.6, -0.5],
        [0.4, 0.2, 0.8],
        [-0.5, 0.3, 0.6],
        [0.1, -0.7, 0.4],
    ];
    Shape::Hull(Hull::around(&corners.map(Point3::from)).unwrap().into())
}

/// The wayside camera over a worker, a box and a boulder, and a train that comes with its
/// headlights on.
fn wayside_job(track: &Track, s_m: f64, gain: f64) -> Job {
    let mut job = sample::wayside_job(track, s_m);
    scaled(&mut job.views[0], gain, 2);
    job.headlights.push(headlight(track, s_m - 30.0));
    job.bodies.push(Body {
        shape: boulder(),
        world_from_body: sample::on_bed(track, s_m + 12.0, -0.6, 0.6),
        velocity_mps: Vector3::zeros(),
        albedo: 0.35,
        luminance_cd_m2: 0.0,
    });
    job.bodies.push(Body {
        shape: Shape::Box(Vector3::new(10.0, 1.4, 1.8)),
        world_from_body: sample::on_bed(track, s_m + 60.0, 0.0, 2.0),
        velocity_mps: Vector3::new(-8.0, -4.0, 0.0),
        albedo: 0.6,
        luminance_cd_m2: 0.0,
    });
    job
}

/// Share of pixels that differ by more than a number of grey levels.
fn share_off(a: &GrayImage, b: &GrayImage, levels: u8) -> f64 {
    let off = a
        .iter()
        .zip(b.iter())
        .filter(|(a, b)| a.abs_diff(**b) > levels);
    off.count() as f64 / a.len() as f64
}

/// Shares of pixels that may be off by more than 2 and by more than 20 grey levels.
const OVER_2: f64 = 0.01;
/// The same out of focus.
const BLUR_OVER_2: f64 = 0.03;
/// The same before wet ground.
const WET_OVER_2: f64 = 0.015;
/// The same where every bolt shows.
const PAINT_OVER_2: f64 = 0.2;
const PAINT_OVER_20: f64 = 0.02;
const OVER_20: f64 = 0.003;

pub fn compare(name: &str, scene: &Scene, job: &Job) {
    let job = quiet(job);
    let gpu = draw(&mut *gpu(scene.clone()), &job).remove(0);
    let cpu = draw(&mut *cpu(scene.clone()), &job).remove(0);
    let (over_2, over_20) = (share_off(&gpu, &cpu, 2), share_off(&gpu, &cpu, 20));
    println!(
        "{name}: {:.3} % over 2, {:.4} % over 20",
        100.0 * over_2,
        100.0 * over_20
    );
    if let Ok(dir) = std::env::var("METROTWIN_PICTURES") {
        save(&dir, name, &gpu, &cpu);
    }
    let spread = cpu.iter().max().unwrap() - cpu.iter().min().unwrap();
    assert!(spread > 80, "{name} shows nothing: {spread}");
    let every_bolt_shows = name.starts_with("flood") || name.ends_with("gain_10");
    let (most_2, most_20) = if every_bolt_shows {
        let shifted = squares_shifted(&gpu, &cpu);
        println!("{name}: shifted by a pixel {shifted:.2} times as far off");
        assert!(shifted > 1.5, "{name}: fits {shifted} when shifted");
        (PAINT_OVER_2, PAINT_OVER_20)
    } else if name.starts_with("blur") {
        (BLUR_OVER_2, OVER_20)
    } else if name.starts_with("wet") {
        (WET_OVER_2, OVER_20)
    } else {
        (OVER_2, OVER_20)
    };
    assert!(over_2 <= most_2, "{name}: {over_2} over 2 grey levels");
    assert!(over_20 <= most_20, "{name}: {over_20} over 20 grey levels");
}

/// Least sum of squared differences of pictures shifted by a pixel against each other, over that
/// of the pictures as they are.
fn squares_shifted(a: &GrayImage, b: &GrayImage) -> f64 {
    let squares = |du: i32, dv: i32| -> f64 {
        let (width, height) = (a.width() as i32, a.height() as i32);
        let at =
            |image: &GrayImage, u: i32, v: i32| f64::from(image.get_pixel(u as u32, v as u32)[0]);
        (1..height - 1)
            .flat_map(|v| (1..width - 1).map(move |u| (u, v)))
            .map(|(u, v)| (at(a, u, v) - at(b, u + du, v + dv)).powi(2))
            .sum()
    };
    let shifts = [(1, 0), (-1, 0), (0, 1), (0, -1)];
    let least = shifts
        .map(|(du, dv)| squares(du, dv))
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    least / squares(0, 0)
}

/// Both pictures and ten times their difference, to look at.
fn save(dir: &str, name: &str, gpu: &GrayImage, cpu: &GrayImage) {
    let off = GrayImage::from_fn(cpu.width(), cpu.height(), |u, v| {
        let off = cpu.get_pixel(u, v)[0].abs_diff(gpu.get_pixel(u, v)[0]);
        image::Luma([off.saturating_mul(10)])
    });
    for (kind, picture) in [("gpu", gpu), ("cpu", cpu), ("off", &off)] {
        picture.save(format!("{dir}/{name}_{kind}.png")).unwrap();
    }
}

/// Provokes one pose a frame, wrong row times, lamps out of phase: on the straight, across the
/// begin of the curve, and in it.
#[test]
fn the_rig_in_lamp_light() {
    for s_m in [100.0, 101.6, 98.2, 300.5, 401.5] {
        let job = rig_job(&sample::track(), s_m, 1.0);
        compare(&format!("rig_{s_m:.0}"), &sample::scene(), &job);
    }
}

/// Provokes surfaces, joints and stains that are elsewhere or of another strength.
#[test]
fn the_rig_in_floodlight() {
    for s_m in [100.0, 101.6, 300.5, 401.5] {
        let job = rig_job(&sample::track(), s_m, 2.0);
        compare(&format!("flood_rig_{s_m:.0}"), &floodlit(), &job);
    }
}

/// Provokes bodies and headlights that are drawn elsewhere, and a far tunnel that is not there.
#[test]
fn the_wayside_view() {
    let track = sample::track();
    for s_m in [100.0, 270.0, 420.0] {
        let flat = wayside_job(&track, s_m, 0.01);
        compare(&format!("flood_way_{s_m}"), &floodlit(), &flat);
        for gain in [1.0, 10.0] {
            let lit = wayside_job(&track, s_m, gain);
            let name = format!("way_{s_m}_gain_{gain}");
            compare(&name, &sample::scene(), &lit);
        }
    }
}

/// Provokes reflections that are elsewhere, of another size or light, or blink with another row: a wet
/// bed and rails, by lamps and by headlights that come.
#[test]
fn wet_ground_mirrors() {
    let track = sample::track();
    let mut scene = sample::scene();
    scene.wet = Wet {
        ranges: vec![WetRange {
            track: None,
            chainage_m: 0.0..130.0,
            wet: true,
        }],
    };
    for (s_m, exposure_s, gain) in [(100.0, 16e-3, 1.0), (100.0, 1e-3, 15.0), (60.0, 2e-4, 40.0)] {
        let mut job = wayside_job(&track, s_m, gain);
        let view = &mut job.views[0];
        view.camera.shutter.exposure_s = exposure_s;
        view.camera.intrinsics.cy_px -= 0.25 * f64::from(view.camera.intrinsics.height_px);
        let name = format!("wet_{s_m}_{:.0}_us", 1e6 * exposure_s);
        compare(&name, &scene, &job);
    }
}

/// Provokes blur that grows with another power of depth, or that is another on one renderer: lamps, walls
/// and bodies before lenses that look at what is near. One follows rays through many points of the
/// pupil, the other has formulas for lamps and blurs the rest by its depth.
#[test]
fn out_of_focus() {
    let track = sample::track();
    for (camera, focus_m, mut job) in [
        ("rig", 0.3, rig_job(&track, 100.0, 1.0)),
        ("way", 0.5, wayside_job(&track, 100.0, 1.0)),
    ] {
        let view = &mut job.views[0];
        view.pixel_m *= 2.0;
        view.lens.focus_m = Some(focus_m);
        println!(
            "circle of confusion at infinity {:.2} px",
            view.confusion_px(f64::INFINITY)
        );
        compare(&format!("blur_{camera}"), &sample::scene(), &job);
    }
}

/// Provokes a pupil or a circle of confusion of another size: the edge of a board at 4 m, of which a
/// lens in focus at 1 m makes a ramp whose slope has the variance of a disc along a line, c^2 / 16.
fn an_edge_is_a_ramp(name: &str, make: Make) {
    let mut view = sample::wayside_job(&sample::track(), 100.0).views.remove(0);
    even(&mut view);
    view.camera.intrinsics = Intrinsics::centred(480, 120, 1100.0);
    view.lens.focus_m = Some(1.0);
    view.lens.f_number = 0.5;
    let board = Body {
        shape: Shape::Box(Vector3::new(1.0, 1.0, 1e-3)),
        world_from_body: view.motion.poses[0] * Isometry3::translation(1.0, 0.0, 4.0),
        velocity_mps: Vector3::zeros(),
        albedo: 0.0,
        luminance_cd_m2: 100.0,
    };
    view.set_gain_for(100.0, 200.0);
    let confusion_px = view.confusion_px(4.0);
    let mut scene = sample::scene();
    scene.lamps.clear();
    let mut track = (*scene.tracks[0]).clone();
    (track.ambient_lx, track.sections) = (0.0, Vec::new());
    scene.tracks = vec![track.into()];
    let job = Job {
        bodies: vec![board],
        views: vec![view],
        ..Job::default()
    };
    let image = draw(&mut *make(scene), &job).remove(0);
    let column = |u: u32| {
        (40..80)
            .map(|v| f64::from(image.get_pixel(u, v)[0]))
            .sum::<f64>()
    };
    let slopes: Vec<_> = (200..280)
        .map(|u| (f64::from(u) + 0.5, column(u + 1) - column(u)))
        .collect();
    let sum: f64 = slopes.iter().map(|(_, slope)| slope).sum();
    let mean = slopes.iter().map(|(u, slope)| u * slope).sum::<f64>() / sum;
    let square = |(u, slope): &(f64, f64)| (u - mean).powi(2) * slope;
    let variance = slopes.iter().map(square).sum::<f64>() / sum;
    // Of a thin lens's disc, and of a pixel.
    let right = confusion_px.powi(2) / 16.0 + 1.0 / 12.0;
    println!(
        "{name}: circle of {confusion_px:.2} px, edge at {mean:.3}, {variance:.3} of {right:.3} px^2"
    );
    assert!(confusion_px > 6.0 && (mean - 239.5).abs() < 0.1, "{mean}");
    assert!((variance / right - 1.0).abs() < 0.05, "{variance} {right}");
}

#[test]
fn an_edge_is_a_ramp_on_the_cpu() {
    an_edge_is_a_ramp("cpu", cpu);
}

#[test]
fn an_edge_is_a_ramp_on_the_gpu() {
    an_edge_is_a_ramp("gpu", gpu);
}

/// Left camera of the EuRoC MAV data set (M. Burri et al., Int. J. Robotics Research 2016).
const WIDE: DistortionCoefficients = DistortionCoefficients {
    k1: -0.283_408_11,
    k2: 0.073_959_07,
    k3: 0.0,
    p1: 0.000_193_59,
    p2: 1.761_871_14e-5,
};

/// Provokes a tunnel that stays straight before a lens that bends it, or rows that open in another
/// order or together: with the coefficients of a real wide lens.
#[test]
fn through_a_real_lens_read_upwards_and_at_once() {
    let track = sample::track();
    let rig = |s_m, gain| ("rig", rig_job(&track, s_m, gain));
    let way = |s_m, gain| ("way", wayside_job(&track, s_m, gain));
    let lit = [rig(100.0, 1.0), rig(300.5, 1.0), way(100.0, 1.0)];
    let flooded = [rig(101.6, 2.0), rig(401.5, 2.0), way(270.0, 0.01)];
    let all = (lit.into_iter().map(|job| (sample::scene(), "bent", job))).chain(
        flooded
            .into_iter()
            .map(|job| (floodlit(), "flood_bent", job)),
    );
    for (scene, light, (camera, mut job)) in all {
        let view = &mut job.views[0];
        let (lens, shutter) = (&mut view.camera.intrinsics, &mut view.camera.shutter);
        lens.distortion = Distortion::new(WIDE);
        for (order, line_time_s, first_row) in [
            ("down", shutter.line_time_s, 0),
            ("up", shutter.line_time_s, lens.height_px - 1),
            ("at_once", 0.0, 0),
        ] {
            let mut job = job.clone();
            let shutter = &mut job.views[0].camera.shutter;
            if line_time_s <= 0.0 {
                // A bit of every lamp's name, or none would shine by chance.
                shutter.exposure_s = shutter.exposure_s.max(140e-6);
            }
            (shutter.line_time_s, shutter.first_row) = (line_time_s, first_row);
            compare(&format!("{light}_{camera}_{order}"), &scene, &job);
        }
    }
}

/// Where the rim of a disc is in the image, rounded outwards; `None` unless all of it is inside.
fn disc_box(view: &View, lamp: &LampLight) -> Option<[u32; 4]> {
    let size = &view.camera.intrinsics;
    let in_front = rim(lamp).all(|(p, _)| {
        let seen = view.motion.poses[0].inverse_transform_point(&p);
        seen.z > 0.5 && size.project(&seen).is_some()
    });
    if !in_front
        || lamp
            .facing
            .dot(&(view.motion.poses[0].translation.vector - lamp.centre.coords))
            <= 0.0
    {
        return None;
    }
    let polygon = outline(view, rim(lamp), view.start);
    let low = polygon[1..]
        .iter()
        .fold(polygon[0], |a, b| a.inf(b))
        .map(|x| x.floor());
    let high = polygon[1..]
        .iter()
        .fold(polygon[0], |a, b| a.sup(b))
        .map(|x| x.ceil());
    let inside = low.x >= 0.0
        && low.y >= 0.0
        && high.x < f64::from(size.width_px)
        && high.y < f64::from(size.height_px);
    inside.then(|| [low.x, low.y, high.x - low.x + 1.0, high.y - low.y + 1.0].map(|x| x as u32))
}

/// Provokes stripes or rims that a whole picture's share of pixels would hide: a lamp's box alone,
/// at the size that the stack sees.
#[test]
fn the_box_of_a_lamp_at_full_size() {
    let track = sample::track();
    let mut compared = 0;
    for s_m in [100.0, 101.6, 401.5] {
        let mut job = quiet(&rig_job(&track, s_m, 1.0));
        job.views[0].camera.intrinsics = Intrinsics::centred(1280, 720, 1040.0);
        let gpu = draw(&mut *gpu(sample::scene()), &job).remove(0);
        let cpu = draw(&mut *cpu(sample::scene()), &job).remove(0);
        for lamp in &sample::scene().lamps {
            let Some([u, v, width, height]) = disc_box(&job.views[0], lamp) else {
                continue;
            };
            let [a, b] = [&gpu, &cpu]
                .map(|image| image::imageops::crop_imm(image, u, v, width, height).to_image());
            let over_2 = share_off(&a, &b, 2);
            println!(
                "lamp at {s_m}: {width} x {height} px, {:.3} % over 2",
                100.0 * over_2
            );
            assert!(over_2 <= 0.02, "{over_2} of the box over 2 grey levels");
            compared += usize::from(width * height > 300);
        }
    }
    assert!(compared >= 3, "only {compared} lamps of some size");
}

/// Mean and variance of what noise adds, by bands of the clean grey level.
fn noise_by_band(renderer: &mut dyn Renderer, job: &Job) -> Vec<(f64, f64, f64)> {
    let clean = draw(renderer, &quiet(job)).remove(0);
    let noisy = draw(renderer, job).remove(0);
    let mut bands = vec![(0.0, 0.0, 0.0); 8];
    for (c, n) in clean.iter().zip(noisy.iter()) {
        // Near 255 noise is cut off.
        if *c < 240 {
            let added = f64::from(*n) - f64::from(*c);
            let band = &mut bands[usize::from(*c) / 32];
            *band = (band.0 + 1.0, band.1 + added, band.2 + added * added);
        }
    }
    bands
        .into_iter()
        .map(|(n, sum, squares)| (n, sum / n, squares / n - (sum / n) * (sum / n)))
        .collect()
}

/// Provokes noise of another strength, or noise that depends on brightness in another way.
#[test]
fn noise_is_equal_in_distribution() {
    let job = rig_job(&sample::track(), 100.0, 1200.0);
    let one = noise_by_band(&mut *gpu(sample::scene()), &job);
    let other = noise_by_band(&mut *cpu(sample::scene()), &job);
    let mut compared = 0;
    for (k, (g, c)) in one.iter().zip(&other).enumerate() {
        let n = g.0.min(c.0);
        if n < 500.0 {
            continue;
        }
        compared += 1;
        println!(
            "grey {}..: n {n}, mean {:.3} {:.3}, variance {:.3} {:.3}",
            32 * k,
            g.1,
            c.1,
            g.2,
            c.2
        );
        // Five standard errors of a difference.
        assert!((g.1 - c.1).abs() < 5.0 * (2.0 * c.2 / n).sqrt() + 0.02);
        assert!((g.2 / c.2 - 1.0).abs() < 5.0 * (4.0 / n).sqrt());
    }
    assert!(compared >= 4, "only {compared} bands have pixels");
}

/// Image outline of points that stand still or move, each seen by the row that it falls on: the
/// row-time equation solved by fixed-point iteration.
fn outline(
    view: &View,
    points: impl Iterator<Item = (Point3<f64>, Vector3<f64>)>,
    at: SimTime,
) -> Vec<Point2<f64>> {
    let camera = &view.camera;
    points
        .map(|(p, velocity)| {
            let mut pixel = Point2::new(0.0, f64::from(camera.intrinsics.height_px) / 2.0);
            for _ in 0..30 {
                let t = camera.shutter.row_mid(view.start, pixel.y);
                let moved = p + velocity * t.since(at);
                let seen = view.motion.pose_at(t).inverse_transform_point(&moved);
                pixel = camera.intrinsics.project(&seen).unwrap();
            }
            pixel
        })
        .collect()
}

/// Area and centroid of a polygon.
fn moments(polygon: &[Point2<f64>]) -> (f64, Point2<f64>) {
    let (mut area, mut sum) = (0.0, Vector3::zeros().xy());
    let origin = polygon[0];
    for (k, a) in polygon.iter().enumerate() {
        let (a, b) = (a - origin, polygon[(k + 1) % polygon.len()] - origin);
        let cross = 0.5 * a.perp(&b);
        area += cross;
        sum += (a + b) * cross / 3.0;
    }
    (area.abs(), origin + sum / area)
}

/// The same of what is bright in an image, in shares of `full` over `black`.
fn bright_moments(image: &GrayImage, black: f64, full: f64) -> (f64, Point2<f64>) {
    let (mut area, mut sum) = (0.0, Vector3::zeros().xy());
    for (u, v, pixel) in image.enumerate_pixels() {
        let share = (f64::from(pixel[0]) - black) / (full - black);
        area += share;
        sum += Vector3::new(f64::from(u), f64::from(v), 0.0).xy() * share;
    }
    (area, Point2::from(sum / area))
}

/// Without noise, and every pixel like the others.
fn even(view: &mut View) {
    view.lens = view.lens.without_flaws();
    view.lens.vignetting = 0.0;
    view.sensor = view.sensor.without_flaws();
}

fn rim(lamp: &LampLight) -> impl Iterator<Item = (Point3<f64>, Vector3<f64>)> {
    let side = lamp.facing.cross(&Vector3::z()).normalize();
    let up = side.cross(&lamp.facing);
    let (centre, radius_m) = (lamp.centre, lamp.radius_m);
    (0..720).map(move |k| {
        let (sin, cos) = (TAU * f64::from(k) / 720.0).sin_cos();
        (
            centre + (side * cos + up * sin) * radius_m,
            Vector3::zeros(),
        )
    })
}

/// Provokes bodies drawn at the job's time or with one pose a frame: a luminous board that moves,
/// seen from the running train. (The rasteriser moves corners only: it draws the sides straight,
/// which over 100 rows is good to 0.01 px.)
fn a_board_obeys_the_row_times(make: Make) {
    let track = sample::track();
    let mut view = sample::rig_view(&track, 150.0, SPEED_MPS);
    view.start = SimTime::from_secs(3.2);
    view.motion = shaken(&track, 150.0, view.start);
    even(&mut view);
    let middle = view.motion.pose_at(view.start.plus(8e-3));
    // Across the camera's axis, tilted in the image.
    let tilt = Isometry3::from_parts(
        Vector3::new(0.2, -0.1, 2.0).into(),
        UnitQuaternion::from_euler_angles(0.0, 0.0, 0.3),
    );
    let board = Body {
        shape: Shape::Box(Vector3::new(0.15, 0.1, 1e-4)),
        world_from_body: middle * tilt,
        velocity_mps: middle * Vector3::new(4.0, -3.0, 0.0),
        albedo: 0.0,
        luminance_cd_m2: 6000.0,
    };
    let at = view.start.plus(8e-3);
    let corner = |x: f64, y: f64| board.world_from_body * Point3::new(0.15 * x, 0.1 * y, 0.0);
    // Each side in many points: under a rolling shutter a straight side is bent.
    let sides = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let rim = (0..400).map(|k| {
        let (a, b, x) = (
            sides[k / 100],
            sides[(k / 100 + 1) % 4],
            (k % 100) as f64 / 100.0,
        );
        (
            corner(a[0] + (b[0] - a[0]) * x, a[1] + (b[1] - a[1]) * x),
            board.velocity_mps,
        )
    });
    let polygon = outline(&view, rim, at);
    let full = view.sensor.black_level_grey + 6000.0 * view.grey_per_cd_m2();
    let black = view.sensor.black_level_grey;
    let mut scene = sample::scene();
    scene.lamps.clear();
    let job = Job {
        time: at,
        bodies: vec![board],
        views: vec![view],
        ..Job::default()
    };
    let image = draw(&mut *make(scene), &job).remove(0);
    let (area, middle) = moments(&polygon);
    let (area_seen, middle_seen) = bright_moments(&image, black, full);
    println!("board: area {area:.1} {area_seen:.1} px, middle {middle:.3} {middle_seen:.3}");
    assert!(area > 10_000.0, "the board is not in the image");
    assert!((area_seen / area - 1.0).abs() < 0.001);
    assert!((middle_seen - middle).amax() < 0.05);
}

#[test]
fn a_board_obeys_the_row_times_on_the_cpu() {
    a_board_obeys_the_row_times(cpu);
}

#[test]
fn a_board_obeys_the_row_times_on_the_gpu() {
    a_board_obeys_the_row_times(gpu);
}
