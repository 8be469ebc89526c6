//! The GPU renderer against closed forms and brute force in double precision. These tests need an
//! adapter; on a machine without graphics hardware `apt-get install mesa-vulkan-drivers` gives one.

#![allow(clippy::disallowed_methods, reason = "an answer must come in time")]

use crate::common::{Make, dark_scene, draw, gpu, quick, sample};
use metrotwin::bus::SimTime;
use metrotwin::track::TrackPoint;
use metrotwin::track::uid::ChipFrame;
use metrotwin::twin::air::Air;
use metrotwin::twin::geometry::{Body, Shape};
use metrotwin::twin::lights::LampLight;
use metrotwin::twin::render::cpu::CpuRenderer;
use metrotwin::twin::render::gpu::GpuRenderer;
use metrotwin::twin::render::{Job, Pattern, SensorSettings, View};
use nalgebra::{Isometry3, Point3, Vector3};

const SPEED_MPS: f64 = 100.0 / 3.6;

/// A sensor without noise, glare and offset, and light enough for 200 grey levels a `luminance`.
fn plain(view: &mut View, luminance_cd_m2: f64) {
    view.sensor = view.sensor.without_flaws();
    view.lens = view.lens.without_flaws();
    view.lens.halo_share = 0.0;
    view.sensor.black_level_grey = 0.0;
    view.lens.vignetting = 0.0;
    even(&mut view.sensor);
    view.set_gain_for(luminance_cd_m2, 200.0);
}

/// Every pixel like the others.
fn even(sensor: &mut SensorSettings) {
    sensor.prnu = 0.0;
    sensor.dsnu_e = 0.0;
    sensor.dark_current_e_per_s = 0.0;
    sensor.hot_pixel_share = 0.0;
}

/// Centre of gravity of grey levels: u, v.
fn centroid(weight: impl Fn(u32, u32) -> f64, size: (u32, u32)) -> (f64, f64) {
    let (mut sum, mut u, mut v) = (0.0, 0.0, 0.0);
    for y in 0..size.1 {
        for x in 0..size.0 {
            let w = weight(x, y);
            sum += w;
            u += w * f64::from(x);
            v += w * f64::from(y);
        }
    }
    assert!(sum > 0.0, "nothing in the picture");
    (u / sum, v / sum)
}

/// Where `hit(ray, camera_from_world, time)` says a pixel is lit, by `side` x `side` rays a pixel:
/// as many as the renderer takes, or the jagged edge of a small thing outweighs its place.
fn expected(
    view: &View,
    side: u32,
    hit: impl Fn(Vector3<f64>, &Isometry3<f64>, SimTime) -> bool,
) -> (f64, f64) {
    let lens = view.camera.intrinsics;
    let rows: Vec<_> = (0..lens.height_px)
        .map(|v| {
            let t = view.camera.shutter.row_mid(view.start, f64::from(v));
            (view.motion.pose_at(t).inverse(), t)
        })
        .collect();
    let shifts: Vec<f64> = (0..side)
        .map(|k| (f64::from(k) + 0.5) / f64::from(side) - 0.5)
        .collect();
    centroid(
        |x, y| {
            let (pose, t) = &rows[y as usize];
            shifts
                .iter()
                .flat_map(|i| shifts.iter().map(move |j| (i, j)))
                .filter(|(i, j)| hit(lens.ray(f64::from(x) + *i, f64::from(y) + *j), pose, *t))
                .count() as f64
        },
        (lens.width_px, lens.height_px),
    )
}

fn close(what: &str, found: (f64, f64), right: (f64, f64), tolerance_px: f64) {
    let error = (found.0 - right.0).hypot(found.1 - right.1);
    assert!(error < tolerance_px, "{what}: {found:?}, not {right:?}");
}

fn always_on(mut lamp: LampLight) -> LampLight {
    lamp.waveform.frame = ChipFrame { bits: 1, len: 1 };
    // As bright from every side, so that its centre of light is that of its outline.
    lamp.exponent = 1.0;
    lamp
}

/// Provokes a pose for the whole frame, a wrong row time, a wrong pixel centre.
#[test]
fn lamps_at_100_kmh_are_where_they_belong() {
    let lamps = sample::scene().lamps;
    for ahead_m in [2.0, 3.0, 4.5] {
        let lamp = always_on(lamps[10].clone());
        let mut view = sample::rig_view(&sample::track(), 105.0 - ahead_m, SPEED_MPS);
        plain(&mut view, lamp.luminance_cd_m2);
        let right = expected(&view, 4, |ray, pose, _| {
            let c = pose * lamp.centre;
            let n = pose.rotation * lamp.facing.into_inner();
            let t = n.dot(&c.coords) / n.dot(&ray);
            t > 0.0 && (ray * t - c.coords).norm() < lamp.radius_m
        });
        let job = Job {
            views: vec![view],
            ..Job::default()
        };
        let image = &draw(&mut *gpu(dark_scene(vec![lamp])), &job)[0];
        let found = centroid(
            |x, y| f64::from(image.get_pixel(x, y)[0]),
            image.dimensions(),
        );
        close(&format!("lamp {ahead_m} m ahead"), found, right, 0.05);
    }
}

fn ball(centre: Point3<f64>, velocity_mps: Vector3<f64>) -> Body {
    Body {
        shape: Shape::Sphere(0.4),
        world_from_body: Isometry3::translation(centre.x, centre.y, centre.z),
        velocity_mps,
        albedo: 0.0,
        luminance_cd_m2: 1.0,
    }
}

/// Mean error over nine places a fraction of a pixel apart: one alone is known to 0.03 px only,
/// because its edge is cut out in whole pixels.
fn balls_are_in_place(mut view: View, centre: Point3<f64>, velocity_mps: Vector3<f64>, what: &str) {
    plain(&mut view, 1.0);
    let time = view.start.plus(0.004);
    let mut renderer = gpu(dark_scene(Vec::new()));
    let (mut u, mut v) = (0.0, 0.0);
    for k in 0..9 {
        let shift = Vector3::new(f64::from(k % 3), f64::from(k), f64::from(k / 3)) * 1.3e-3;
        let centre = centre + shift;
        let right = expected(&view, 1, |ray, pose, t| {
            let c = pose * (centre + velocity_mps * t.since(time));
            let along = ray.dot(&c.coords) / ray.norm();
            along > 0.0 && c.coords.norm_squared() - along * along < 0.4 * 0.4
        });
        let job = Job {
            time,
            bodies: vec![ball(centre, velocity_mps)],
            views: vec![view.clone()],
            ..Job::default()
        };
        let image = &draw(&mut *renderer, &job)[0];
        let found = centroid(
            |x, y| f64::from(image.get_pixel(x, y)[0]),
            image.dimensions(),
        );
        u += (found.0 - right.0) / 9.0;
        v += (found.1 - right.1) / 9.0;
    }
    assert!(u.hypot(v) < 0.05, "{what}: off by {u:.3}, {v:.3} px");
}

/// Provokes a vertex that is projected with another row's pose.
#[test]
fn bodies_at_100_kmh_are_where_they_belong() {
    for (u, v) in [(200.0, 150.0), (640.0, 360.0), (1050.0, 560.0)] {
        let view = sample::rig_view(&sample::track(), 100.0, SPEED_MPS);
        let ray = view.camera.intrinsics.ray(u, v).normalize();
        let middle = view.motion.pose_at(SimTime::from_secs(0.008));
        let centre = middle * Point3::from(ray * 6.0);
        balls_are_in_place(
            view,
            centre,
            Vector3::zeros(),
            &format!("ball near {u}, {v}"),
        );
    }
}

/// Provokes bodies that stand still during a frame, or move from the wrong time.
#[test]
fn moving_bodies_are_where_they_belong() {
    let track = sample::track();
    let mut view = sample::wayside_job(&track, 80.0).views.remove(0);
    // In a long one the ball's picture grows: its middle is not that of the exposure's middle.
    view.camera.shutter.exposure_s = 1e-3;
    let centre = track.alignment.world_from_track(TrackPoint {
        s_m: 90.0,
        l_m: 0.0,
        h_m: 1.5,
    });
    let along = track.alignment.at(90.0).world_from_line() * Vector3::x();
    balls_are_in_place(view, centre, along * -SPEED_MPS, "passing ball");
}

/// Provokes anything that depends on time, order or what was drawn before.
#[test]
fn same_job_same_bytes() {
    let scene = sample::scene();
    let a = sample::stereo_job(&scene.tracks[0], 40.0, SPEED_MPS);
    let b = sample::wayside_job(&scene.tracks[0], 300.0);
    let mut one = gpu(scene.clone());
    let first = draw(&mut *one, &a);
    let other = draw(&mut *one, &b);
    // Both in flight at once, in the same and in a new renderer.
    let mut two = gpu(scene);
    for renderer in [&mut one, &mut two] {
        renderer.submit(&a).unwrap();
        renderer.submit(&b).unwrap();
        assert!(renderer.collect().unwrap() == first);
        assert!(renderer.collect().unwrap() == other);
    }
    assert!(first[0] != first[1]);
}

/// Provokes views of one job that get into each other's way: in another order, and without bodies (which
/// are cut as finely as the nearest view needs) alone, each is the same.
#[test]
fn views_do_not_touch_each_other() {
    let scene = sample::scene();
    let mut all = sample::wayside_job(&scene.tracks[0], 300.0);
    let pair = sample::stereo_job(&scene.tracks[0], 290.0, SPEED_MPS);
    all.views.splice(0..0, pair.views);
    let mut renderer = gpu(scene);
    let together = draw(&mut *renderer, &all);
    all.views.reverse();
    let mut reversed = draw(&mut *renderer, &all);
    reversed.reverse();
    assert!(together.len() == 3 && together == reversed);

    all.bodies.clear();
    for (image, view) in draw(&mut *renderer, &all).iter().zip(&all.views) {
        let alone = Job {
            views: vec![view.clone()],
            ..all.clone()
        };
        assert!(draw(&mut *renderer, &alone)[0] == *image);
    }
}

/// Provokes a signal that ends at what half precision holds: a lamp that floods a deep well is as white
/// behind dim glass, and in blue pixels, as the plain renderer has it.
#[test]
fn a_flooded_deep_well_is_white() {
    let scene = sample::scene();
    let mut view = sample::rig_view(&scene.tracks[0], 102.0, 0.0);
    view.sensor.full_well_e = 6e4;
    view.sensor.pattern = Pattern::Rggb;
    view.lens.transmission = 1.0;
    view.camera.shutter.exposure_s = 2e-3;
    let job = Job {
        views: vec![view],
        ..Job::default()
    };
    let image = &draw(&mut *gpu(scene.clone()), &job)[0];
    let right = CpuRenderer::oracle(scene).draw(&job, &job.views[0]);
    let white = right.pixels().filter(|p| p[0] == 255).count();
    let grey = (image.pixels().zip(right.pixels())).filter(|(p, q)| q[0] == 255 && p[0] < 250);
    let grey = grey.count();
    assert!(white > 1000 && 100 * grey < white, "{grey} of {white}");
}

/// Provokes a panic instead of an error.
#[test]
fn collecting_nothing_is_an_error() {
    assert!(gpu(dark_scene(Vec::new())).collect().is_err());
}

/// A renderer that takes another scene draws it as a new one would: nothing of the first scene is left
/// in meshes, textures, lamps' light, or the still camera's kept tunnel.
#[test]
fn another_scene_is_as_good_as_new() {
    let first = sample::scene();
    let mut second = sample::scene();
    second.air = Air::of_visibility(60.0);
    second.lamps.truncate(second.lamps.len() / 2);
    let track = first.tracks[0].clone();
    let jobs = [
        sample::stereo_job(&track, 70.0, 15.0),
        sample::wayside_job(&track, 100.0),
    ];
    for (name, make) in [("quick", quick as Make), ("gpu", gpu)] {
        let mut used = make(first.clone());
        for job in jobs.iter().cycle().take(4) {
            draw(used.as_mut(), job);
        }
        used.submit(&jobs[0]).unwrap();
        used.set_scene(second.clone());
        let mut new = make(second.clone());
        for job in &jobs {
            let equal = draw(used.as_mut(), job) == draw(new.as_mut(), job);
            assert!(equal, "{name} draws something of the first scene");
        }
    }
}

/// Passes that are left out, in another order than drawn, or longer than the whole job; pictures that change
/// by being timed. Where an adapter has no clock there are no times, and nothing else changes.
#[test]
fn timed_passes_are_parts_of_the_job() {
    let scene = sample::scene();
    let job = sample::stereo_job(&scene.tracks[0], 101.0, 60.0 / 3.6);
    let mut renderer = GpuRenderer::new(scene).unwrap();
    renderer.draw_parts(false);
    let untimed = draw(&mut renderer, &job);
    let has_clock = renderer.time_passes();
    let begin = std::time::Instant::now();
    let timed = draw(&mut renderer, &job);
    let whole_ms = 1e3 * begin.elapsed().as_secs_f64();
    assert!(untimed == timed);
    let passes = renderer.pass_times();
    assert_eq!(passes.is_empty(), !has_clock);
    let names: Vec<_> = passes.iter().map(|pass| pass.name).collect();
    let of_eye = ["clear", "background", "lamps", "glare", "sensor"];
    assert!(
        !has_clock || names == [of_eye, of_eye].concat(),
        "{names:?}"
    );
    for (pass, next) in passes.iter().zip(&passes[1.min(passes.len())..]) {
        assert!(
            pass.begin_ms <= pass.end_ms && pass.end_ms <= next.end_ms,
            "{pass:?}"
        );
    }
    assert!(passes.iter().all(|pass| pass.end_ms <= whole_ms));
    // Each job has times of its own.
    draw(&mut renderer, &job);
    assert_eq!(renderer.pass_times().len(), passes.len());
}
