//! Shadows against geometry: what a ball hides of a lamp's disc on the flat bed has a closed form.

use crate::common::{cpu, draw, gpu, sample};
use image::GrayImage;
use metrotwin::bus::Intrinsics;
use metrotwin::track::TrackPoint;
use metrotwin::twin::geometry::{Body, Hull, Shape};
use metrotwin::twin::lights::Headlight;
use metrotwin::twin::render::photometry::BlinkingLamp;
use metrotwin::twin::render::{CameraMotion, Job, Renderer, Scene, View};
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use std::f64::consts::PI;

const S_M: f64 = 102.0;
/// Of the lamp's disc over the bed, and of the ball's centre, straight below it.
const LAMP_M: f64 = 2.5;
const BALL_M: f64 = 0.6;
const BALL_RADIUS_M: f64 = 0.2;
const BLACK: f64 = 8.0;

/// One lamp that hangs over the middle of the bed and looks down.
fn scene() -> Scene {
    let mut scene = sample::scene();
    scene.lamps.truncate(1);
    let lamp = &mut scene.lamps[0];
    lamp.centre = Point3::from(
        sample::on_bed(&scene.tracks[0], S_M, 0.0, LAMP_M)
            .translation
            .vector,
    );
    lamp.facing = Unit::new_unchecked(-Vector3::z());
    scene
}

fn ball(scene: &Scene) -> Body {
    Body {
        shape: Shape::Sphere(BALL_RADIUS_M),
        world_from_body: sample::on_bed(&scene.tracks[0], S_M, 0.0, BALL_M),
        velocity_mps: Vector3::zeros(),
        albedo: 0.5,
        luminance_cd_m2: 0.0,
    }
}

/// From beside the shadow down on it.
fn view(scene: &Scene) -> View {
    let at = TrackPoint {
        s_m: S_M - 1.6,
        l_m: -0.8,
        h_m: 1.6,
    };
    let mut view = sample::wayside_job(&scene.tracks[0], S_M).views.remove(0);
    let pose = sample::camera_pose(&scene.tracks[0], at, 0.46, -0.78);
    view.motion = CameraMotion::still(pose);
    view.sensor.noise = false;
    view.sensor.black_level_grey = BLACK;
    view.lens.halo_share = 0.0;
    view.set_gain_for(15.0, 200.0);
    view
}

/// From the place below the lamp to where a line from `aside_m` beside the lamp's centre, that
/// touches the ball on its far side, meets the bed: at x the line passes the ball's centre at
/// (a z / H + x (H - z) / H) H / sqrt(H^2 + (x - a)^2).
fn edge_m(aside_m: f64) -> f64 {
    let passes = |x: f64| {
        let level = (aside_m * BALL_M + x * (LAMP_M - BALL_M)) / LAMP_M;
        level * LAMP_M / LAMP_M.hypot(x - aside_m)
    };
    let (mut low, mut high) = (0.0, 2.0);
    for _ in 0..60 {
        let x = 0.5 * (low + high);
        if passes(x) < BALL_RADIUS_M {
            low = x;
        } else {
            high = x;
        }
    }
    low
}

/// Where a pixel sees the bed, from the place below the lamp; none where the ball hides it.
fn on_bed(pixel: (u32, u32), view: &View, world_from_foot: &Isometry3<f64>) -> Option<Point3<f64>> {
    let eye = world_from_foot.inverse() * view.motion.poses[0];
    let lens = &view.camera.intrinsics;
    let ray = eye * lens.ray(f64::from(pixel.0), f64::from(pixel.1));
    let from = eye.translation.vector;
    let at = from - ray * (from.z / ray.z);
    let to_ball = Vector3::new(0.0, 0.0, BALL_M) - from;
    let past = (to_ball - ray * (ray.dot(&to_ball) / ray.norm_squared())).norm();
    (ray.z < 0.0 && past > 1.1 * BALL_RADIUS_M).then(|| Point3::from(at))
}

/// Provokes shadows of another size, place or strength, without a penumbra or with one of another
/// width. With the ball and without it the same pixels differ by the light that the ball hides.
fn a_ball_has_umbra_and_penumbra(renderer: &mut dyn Renderer) {
    let scene = scene();
    let lamp = &scene.lamps[0];
    let view = view(&scene);
    let mut job = Job {
        views: vec![view.clone()],
        ..Job::default()
    };
    let free = draw(renderer, &job).remove(0);
    job.bodies.push(ball(&scene));
    let shaded = draw(renderer, &job).remove(0);
    let [umbra_m, middle_m, penumbra_m] = [lamp.radius_m, 0.0, -lamp.radius_m].map(edge_m);
    println!("umbra {umbra_m:.3} m, middle {middle_m:.3} m, penumbra {penumbra_m:.3} m");
    let foot = sample::on_bed(&scene.tracks[0], S_M, 0.0, 0.0);
    let (mut inside, mut outside, mut between) = (0, 0, 0);
    let (mut halfway, mut halfway_sum) = (0, 0.0);
    for (u, v, pixel) in free.enumerate_pixels() {
        let Some(at) = on_bed((u, v), &view, &foot) else {
            continue;
        };
        let away_m = at.coords.xy().norm();
        let (light, left) = (
            f64::from(pixel[0]) - BLACK,
            f64::from(shaded.get_pixel(u, v)[0]) - BLACK,
        );
        // Not as far as the rails.
        if away_m > 0.6 || light < 25.0 {
            continue;
        }
        let p = foot * at;
        let lamp_lx = BlinkingLamp::new(lamp.clone()).irradiance_lx(&p, &Vector3::z());
        let ambient = scene.tracks[0].ambient_lx / (scene.tracks[0].ambient_lx + lamp_lx);
        let hidden = (1.0 - left / light) / (1.0 - ambient);
        // A pixel of two millimetres, and places that do not reach the rim of the disc.
        if away_m < umbra_m - 0.004 {
            inside += 1;
            assert!(
                (left - light * ambient).abs() < 2.0,
                "{u} {v}: {left} of {light}"
            );
        } else if away_m > penumbra_m + 0.004 {
            outside += 1;
            assert!((left - light).abs() < 1.01, "{u} {v}: {left} of {light}");
        } else if away_m > umbra_m + 0.015 && away_m < penumbra_m - 0.015 {
            between += 1;
            assert!(hidden > 0.02 && hidden < 0.98, "{u} {v}: {hidden}");
        }
        if (away_m - middle_m).abs() < 0.003 {
            halfway += 1;
            halfway_sum += hidden;
        }
    }
    // From there the ball's edge runs through the middle of the disc, as a circle of radius r H / z
    // in its plane: that is so much less than half.
    let edge_radius_m = BALL_RADIUS_M * LAMP_M / BALL_M;
    let half = 0.5 - lamp.radius_m / (3.0 * PI * edge_radius_m);
    let halfway_share = halfway_sum / f64::from(halfway);
    println!("{inside} pixels in the umbra, {between} in the penumbra, {outside} outside");
    println!("halfway {halfway_share:.3} of the disc is hidden, {half:.3} expected");
    assert!(inside > 2000 && outside > 10_000 && between > 1000 && halfway > 300);
    assert!((halfway_share - half).abs() < 0.01);
}

#[test]
fn a_ball_has_umbra_and_penumbra_on_the_cpu() {
    a_ball_has_umbra_and_penumbra(&mut *cpu(scene()));
}

#[test]
fn a_ball_has_umbra_and_penumbra_on_the_gpu() {
    a_ball_has_umbra_and_penumbra(&mut *gpu(scene()));
}

/// A worker, a box, a cylinder, a boulder, and a train that comes with its headlights on.
fn busy_job(scene: &Scene, s_m: f64) -> Job {
    let track = &scene.tracks[0];
    let mut job = sample::wayside_job(track, s_m);
    let body = |shape, world_from_body, velocity_mps| Body {
        shape,
        world_from_body,
        velocity_mps,
        albedo: 0.4,
        luminance_cd_m2: 0.0,
    };
    let corners = [
        [0.5, 0.4, -0.3],
        [0.5, -0.3, -0.3],
        [-0.4, -0.4, -0.2],
        [-0.5, 0.3, -0.3],
        [0.2, 0.1, 0.5],
        [-0.3, 0.2, 0.3],
    ];
    let boulder = Hull::around(&corners.map(Point3::from)).unwrap();
    let still = Vector3::zeros();
    let tilt = Isometry3::rotation(Vector3::new(0.4, 0.9, 0.0));
    job.bodies.extend([
        body(
            Shape::Hull(boulder.into()),
            sample::on_bed(track, s_m + 9.0, 0.9, 0.3),
            still,
        ),
        body(
            Shape::Cylinder(0.15, 0.5),
            sample::on_bed(track, s_m + 14.0, 1.2, 0.6) * tilt,
            Vector3::new(0.0, -3.0, 1.0),
        ),
        body(
            Shape::Box(Vector3::new(10.0, 1.4, 1.8)),
            sample::on_bed(track, s_m + 45.0, 0.0, 2.0),
            Vector3::new(-8.0, -4.0, 0.0),
        ),
    ]);
    // In the train's front.
    job.headlights.extend([-0.8, 0.8].map(|l_m| Headlight {
        world_from_light: sample::on_bed(track, s_m + 35.05, l_m, 1.2)
            * Isometry3::rotation(Vector3::z() * PI),
        intensity_cd: 40_000.0,
        exponent: 60.0,
    }));
    let view = &mut job.views[0];
    view.camera.intrinsics = Intrinsics::centred(960, 540, 550.0);
    view.sensor.noise = false;
    view.sensor.gain_db += 20.0;
    job
}

/// Provokes a shape, a light or a rule of what carries a headlight that only one renderer knows:
/// what all shadows take from the tunnel's grey levels, by both.
#[test]
fn both_renderers_hide_the_same_light() {
    let scene = sample::scene();
    let (mut gpu, mut cpu) = (gpu(scene.clone()), cpu(scene.clone()));
    for s_m in [100.0, 270.0, 420.0] {
        let shaded = busy_job(&scene, s_m);
        let free = Job {
            bodies: Vec::new(),
            ..shaded.clone()
        };
        let mut bright = shaded.clone();
        for body in &mut bright.bodies {
            body.luminance_cd_m2 = 1e6;
        }
        let bodies = draw(&mut *gpu, &bright).remove(0);
        let [g, g_free] = [&shaded, &free].map(|job| draw(&mut *gpu, job).remove(0));
        let [c, c_free] = [&shaded, &free].map(|job| draw(&mut *cpu, job).remove(0));
        let (mut off, mut fell, mut all) = (0, 0, 0);
        for (u, v, pixel) in bodies.enumerate_pixels() {
            let at = |image: &GrayImage| f64::from(image.get_pixel(u, v)[0]);
            // Neither a body nor white, and paint that both see alike.
            if pixel[0] < 255 && (at(&g_free) - at(&c_free)).abs() < 1.5 {
                let [ours, theirs] = [at(&g) - at(&g_free), at(&c) - at(&c_free)];
                all += 1;
                fell += usize::from(theirs < -2.0);
                off += usize::from((ours - theirs).abs() > 2.0);
            }
        }
        let share = |n: usize| 100.0 * n as f64 / all as f64;
        println!(
            "{s_m}: shade on {:.2} %, off by more than 2 on {:.3} %",
            share(fell),
            share(off)
        );
        if let Ok(dir) = std::env::var("METROTWIN_PICTURES") {
            g.save(format!("{dir}/shadows_{s_m}_gpu.png")).unwrap();
            c.save(format!("{dir}/shadows_{s_m}_cpu.png")).unwrap();
        }
        assert!(all > 300_000, "only {all} pixels are alike");
        assert!(share(fell) > 5.0, "there is no shade");
        assert!(share(off) < 1.0, "{} %", share(off));
    }
}
