#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]
use super::*;
use crate::bus::{CameraModel, Shutter, SimTime};
use crate::track::uid::{ChipFrame, LineCode, Uid};
use crate::track::waveform::{Ripple, Waveform};
use crate::track::{
    Alignment, CrossSection, Material, OutlinePoint, PlanElement, SectionRange, Track,
};
use crate::twin::air::Air;
use crate::twin::geometry::{Body, Shape};
use crate::twin::lights::{Headlight, LampLight};
use crate::twin::random::Stream;
use crate::twin::reflectance::Wet;
use crate::twin::render::paint::Painting;
use crate::twin::render::{CameraMotion, LensSettings, NoiseKey, SensorSettings, sample};
use nalgebra::{Matrix3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use std::f64::consts::PI;
use std::sync::Arc;

const AMBIENT_LX: f64 = 50.0;

/// A straight box, 8 m wide and 10 m high, up the x axis, of plain walkway concrete.
fn hall() -> Track {
    let corner = |l_m: f64, h_m: f64| OutlinePoint { l_m, h_m };
    Track {
        name: "hall".into(),
        alignment: Alignment::new(
            Point3::origin(),
            0.0,
            &[PlanElement {
                length_m: 100.0,
                start_per_m: 0.0,
                end_per_m: 0.0,
                start_cant_m: 0.0,
                end_cant_m: 0.0,
            }],
            &[],
        ),
        stated_chainage: None,
        sections: vec![SectionRange {
            from_m: 0.0,
            to_m: 100.0,
            missing_rail: None,
            section: CrossSection {
                points: vec![
                    corner(4.0, -5.0),
                    corner(-4.0, -5.0),
                    corner(-4.0, 5.0),
                    corner(4.0, 5.0),
                ],
                materials: vec![Material::Walkway; 4],
                closed: true,
            },
        }],
        lamps: Vec::new(),
        wayside: Vec::new(),
        balises: Vec::new(),
        base_stations: Vec::new(),
        stations: Vec::new(),
        ambient_lx: AMBIENT_LX,
        daylight_lx: 0.0,
    }
}

fn renderer(lamps: Vec<LampLight>) -> CpuRenderer {
    CpuRenderer::oracle(Scene {
        tracks: vec![Arc::new(hall())],
        lamps,
        air: Air::default(),
        wet: Wet::default(),
    })
}

/// Looks to the left from (50, 0, 1): image right is up the line.
fn looking_left() -> Isometry3<f64> {
    let world_from_camera = Matrix3::new(
        1.0, 0.0, 0.0, //
        0.0, 0.0, 1.0, //
        0.0, -1.0, 0.0,
    );
    Isometry3::from_parts(
        Translation3::new(50.0, 0.0, 1.0),
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(world_from_camera)),
    )
}

fn view(intrinsics: Intrinsics) -> View {
    View {
        camera: CameraModel {
            intrinsics,
            shutter: Shutter {
                line_time_s: 20e-6,
                exposure_s: 30e-6,
                first_row: 0,
            },
            blur_px: 0.5,
        },
        start: SimTime::from_secs(0.5),
        motion: CameraMotion::still(looking_left()),
        pixel_m: 3.75e-6,
        lens: LensSettings {
            vignetting: 0.0,
            ..LensSettings::default()
        },
        sensor: SensorSettings {
            noise: false,
            prnu: 0.0,
            dsnu_e: 0.0,
            dark_current_e_per_s: 0.0,
            hot_pixel_share: 0.0,
            ..SensorSettings::default()
        },
        noise: NoiseKey {
            stream: Stream::new(1, 2, "test"),
            frame: 3,
        },
    }
}

fn lamp(waveform: Waveform) -> LampLight {
    LampLight {
        centre: Point3::new(50.0, 2.0, 1.0),
        facing: Unit::new_unchecked(-Vector3::y()),
        radius_m: 0.5,
        luminance_cd_m2: 5000.0,
        exponent: 1.0,
        waveform,
        level: 1.0,
        ripple: Ripple::default(),
        changes: Vec::new(),
    }
}

fn always_on() -> Waveform {
    Waveform::sharp(ChipFrame { bits: 1, len: 1 }, 1.0, 0.0)
}

fn grey_of(view: &View, luminance: f64) -> f64 {
    view.sensor.black_level_grey + view.grey_per_cd_m2() * luminance
}

/// Fails where light, albedo, pi or gain is lost on the way, or where a pixel sees another part of
/// the painting than its own: a wall lit by a lamp behind the camera and by ambient light.
#[test]
fn a_wall_has_the_luminance_of_the_closed_form() {
    let mut light = lamp(always_on());
    light.centre = Point3::new(50.0, -1.0, 1.0);
    light.facing = Unit::new_unchecked(Vector3::y());
    let intensity = light.axial_intensity_cd();
    let mut view = view(Intrinsics::centred(9, 9, 6.0));
    view.set_gain_for(1.0, 2.5e5 * view.camera.shutter.exposure_s);
    let painting = Painting::of(&hall().sections[0].section);
    let image = renderer(vec![light]).draw(&Job::default(), &view);
    let steps = || (0..60).map(|k| (f64::from(k) + 0.5) / 60.0 - 0.5);
    for (u, v, pixel) in image.enumerate_pixels() {
        let ray = |du, dv| (view.camera.intrinsics).ray(f64::from(u) + du, f64::from(v) + dv);
        let (x, z) = (4.0 * ray(0.0, 0.0).x, -4.0 * ray(0.0, 0.0).y);
        let d2 = 25.0 + x * x + z * z;
        // cos(out) = cos(in) = 5 / d.
        let lux = AMBIENT_LX + intensity * 25.0 / (d2 * d2);
        // The left wall is the last edge, from (4, 5) down to (4, -5).
        let albedo = steps().flat_map(|du| steps().map(move |dv| (du, dv)));
        let albedo = albedo.map(|(du, dv)| {
            let ray = ray(du, dv);
            painting.albedo(50.0 + 4.0 * ray.x, 26.0 + 5.0 - (1.0 - 4.0 * ray.y))
        });
        let albedo = albedo.sum::<f64>() / 3600.0;
        let expected = grey_of(&view, albedo * lux / PI);
        assert!(
            (f64::from(pixel[0]) - expected).abs() <= 0.5 + 0.01 * expected,
            "{u} {v}: {expected} {}",
            pixel[0]
        );
    }
    assert!(image.get_pixel(4, 4)[0] > image.get_pixel(0, 0)[0] + 50);
}

/// Fails where air dims over the depth instead of the distance, or where its own light is wrong:
/// a black and a white board, both straight ahead and aside, by Koschmieder's law. At the
/// visibility a black body before the lit air keeps 2 % of contrast.
#[test]
fn val_mist_keeps_koschmieders_contrast() {
    let visibility_m = 30.0;
    let scene = |air| Scene {
        tracks: vec![Arc::new(hall())],
        lamps: Vec::new(),
        air,
        wet: Wet::default(),
    };
    let mut view = view(Intrinsics::centred(301, 101, 150.0));
    view.motion =
        CameraMotion::still(looking_left() * Isometry3::rotation(Vector3::y() * 0.5 * PI));
    // Boards of 1 m around a place: x is up the line, the camera looks up it.
    let board = |away_m: f64, right_m: f64, luminance_cd_m2: f64| Body {
        shape: Shape::Box(Vector3::new(1e-6, 0.4, 0.4)),
        world_from_body: Isometry3::translation(50.0 + away_m, -right_m, 1.0),
        velocity_mps: Vector3::zeros(),
        albedo: 0.0,
        luminance_cd_m2,
    };
    let airlight = AMBIENT_LX / PI;
    view.set_gain_for(airlight, 200.0);
    let mut renderer = CpuRenderer::oracle(scene(Air::of_visibility(visibility_m)));
    for (away_m, right_m, own) in [
        (visibility_m, 0.0, 0.0),
        (0.5 * visibility_m, 0.0, 0.0),
        (3.0, 2.5, 0.0),
        (10.0, -1.0, 18.0),
    ] {
        let job = Job {
            time: view.start,
            bodies: vec![board(away_m, right_m, own)],
            ..Job::default()
        };
        let image = renderer.draw(&job, &view);
        let u = (150.0 + 150.0 * right_m / away_m).round() as u32;
        let clear = 0.02f64.powf(away_m.hypot(right_m) / visibility_m);
        let expected = grey_of(&view, own * clear + airlight * (1.0 - clear));
        let seen = f64::from(image.get_pixel(u, 50)[0]);
        assert!(
            (seen - expected).abs() <= 1.0,
            "{away_m} m: {seen} {expected}"
        );
    }
    // In clear air it is black.
    let job = Job {
        time: view.start,
        bodies: vec![board(10.0, 0.0, 0.0)],
        ..Job::default()
    };
    let image = CpuRenderer::oracle(scene(Air::default())).draw(&job, &view);
    let black = grey_of(&view, 0.0).round() as u8;
    assert_eq!(image.get_pixel(150, 50)[0], black);
}

/// Fails where a lamp's shadow is missing from a picture, drawn in the wrong place, or kept with
/// a still camera's view after the body has gone.
#[test]
fn a_body_throws_its_shadow_on_the_wall_and_takes_it_along() {
    let mut light = lamp(always_on());
    light.centre = Point3::new(50.0, -1.0, 1.0);
    light.facing = Unit::new_unchecked(Vector3::y());
    light.radius_m = 0.1;
    light.luminance_cd_m2 = 1e5;
    let mut view = view(Intrinsics::centred(201, 151, 100.0));
    view.set_gain_for(5.0, 100.0);
    let ball = |x_m: f64| Job {
        time: view.start,
        bodies: vec![Body {
            shape: Shape::Sphere(0.3),
            // Halfway to the wall, beside the camera's axis: its shadow is twice as far out.
            world_from_body: Isometry3::translation(50.0 + x_m, 1.5, 1.0),
            velocity_mps: Vector3::zeros(),
            albedo: 0.0,
            luminance_cd_m2: 0.0,
        }],
        ..Job::default()
    };
    let mut renderer = renderer(vec![light]);
    let bare = renderer.draw(&Job::default(), &view);
    for x_m in [0.8, -0.6, 0.8] {
        let image = renderer.draw(&ball(x_m), &view);
        let column = |wall_m: f64| (100.0 + 100.0 * wall_m / 4.0).round() as u32;
        let at = |wall_m: f64| {
            let [a, b] = [&image, &bare].map(|i| f64::from(i.get_pixel(column(wall_m), 75)[0]));
            a / b
        };
        // In the umbra ambient light is left; the ball itself is seen at 4 / 1.5 of its place.
        assert!(at(2.0 * x_m) < 0.5, "{x_m}: {}", at(2.0 * x_m));
        assert!((at(2.0 * x_m - 0.9) - 1.0).abs() < 0.02 || x_m < 0.0);
        assert!((at(-2.0 * x_m) - 1.0).abs() < 1e-9);
    }
    assert_eq!(renderer.draw(&Job::default(), &view), bare);
}

/// Fails where a row sees the lamp at another time than its own, or through a pose of its own
/// instead of a waveform: rows inside a large lamp are the waveform's exact integral.
#[test]
fn rows_in_a_lamp_are_the_waveform_over_their_exposure() {
    let waveform = Waveform::sharp(
        Uid { line: 3, lamp: 77 }.frame(LineCode::Manchester),
        70e-6,
        0.123_456,
    );
    let mut light = lamp(waveform);
    light.luminance_cd_m2 = 7000.0;
    let mut view = view(Intrinsics::centred(200, 300, 700.0));
    view.lens = view.lens.without_flaws();
    let image = renderer(vec![light]).draw(&Job::default(), &view);
    let (mut low, mut high) = (255.0f64, 0.0f64);
    for v in 0..300 {
        let open = 0.5 + 20e-6 * f64::from(v);
        let expected = grey_of(&view, 7000.0 * waveform.on_share(open, open + 30e-6));
        let mean = (50..150)
            .map(|u| f64::from(image.get_pixel(u, v)[0]))
            .sum::<f64>()
            / 100.0;
        assert!(
            (mean - expected).abs() < 0.01 * 255.0,
            "row {v}: {mean} {expected}"
        );
        (low, high) = (low.min(mean), high.max(mean));
    }
    assert!(low < 10.0 && high > 200.0, "no stripes: {low} to {high}");
}

/// Fails where a body is drawn where it was at the job's time: rows from top to bottom see the
/// edge of a fast box walk along.
#[test]
fn rows_see_moving_bodies_where_they_are_by_then() {
    let mut view = view(Intrinsics::centred(400, 300, 400.0));
    view.camera.shutter.line_time_s = 40e-6;
    view.set_gain_for(1.0, 1e5 * view.camera.shutter.exposure_s);
    let job = Job {
        time: SimTime::from_secs(0.49),
        bodies: vec![Body {
            shape: Shape::Box(Vector3::new(2.0, 1e-6, 4.0)),
            // A board whose right side is at x = 49.5 at the job's time.
            world_from_body: Isometry3::translation(47.5, 2.0, 1.0),
            velocity_mps: Vector3::new(30.0, 0.0, 0.0),
            albedo: 0.0,
            luminance_cd_m2: 60.0,
        }],
        ..Job::default()
    };
    let image = renderer(Vec::new()).draw(&job, &view);
    let bright = grey_of(&view, 60.0).round() as u8;
    for v in 0..300 {
        let seen = (0..400)
            .filter(|u| image.get_pixel(*u, v)[0] == bright)
            .count() as f64;
        let time = 0.5 + 40e-6 * f64::from(v) + 15e-6 - 0.49;
        let edge = 400.0 * (49.5 + 30.0 * time - 50.0) / 2.0 + 199.5;
        assert!((seen - 1.0 - edge).abs() <= 1.0, "row {v}: {seen} {edge}");
    }
}

/// Fails where noise has the wrong strength or is the same in all pixels, rows or frames.
#[test]
fn noise_has_the_mean_and_variance_of_the_sensor() {
    let mut view = view(Intrinsics::centred(300, 200, 300.0));
    view.sensor.noise = true;
    // Noise of more than a grey level, and room for it on both sides.
    view.camera.shutter.exposure_s = 0.1;
    view.sensor.read_noise_e = 60.0;
    view.sensor.black_level_grey = 20.0;
    view.set_gain_for(60.0, 180.0);
    for luminance in [0.0, 5.0, 60.0] {
        let job = Job {
            time: view.start,
            bodies: vec![Body {
                shape: Shape::Box(Vector3::new(30.0, 0.5, 30.0)),
                world_from_body: Isometry3::translation(50.0, 2.5, 1.0),
                velocity_mps: Vector3::zeros(),
                albedo: 0.0,
                luminance_cd_m2: luminance,
            }],
            ..Job::default()
        };
        let mut renderer = renderer(Vec::new());
        let image = renderer.draw(&job, &view);
        let n = image.len() as f64;
        let mean = image.iter().map(|p| f64::from(*p)).sum::<f64>() / n;
        let deviation = |p: &u8| f64::from(*p) - mean;
        let variance = image.iter().map(|p| deviation(p).powi(2)).sum::<f64>() / n;
        let gain = view.sensor.grey_per_e();
        let shot = gain * (grey_of(&view, luminance) - view.sensor.black_level_grey);
        let expected = shot + (gain * view.sensor.read_noise_e).powi(2);
        // Five standard errors of mean and variance; rounding adds 1/12.
        assert!((mean - grey_of(&view, luminance)).abs() < 5.0 * (expected / n).sqrt());
        assert!((variance - expected - 1.0 / 12.0).abs() < 5.0 * expected * (2.0 / n).sqrt());
        let neighbours = image
            .windows(2)
            .map(|w| deviation(&w[0]) * deviation(&w[1]));
        assert!((neighbours.sum::<f64>() / n).abs() < 5.0 * variance / n.sqrt());
        view.noise.frame += 1;
        assert_ne!(image, renderer.draw(&job, &view));
    }
}

/// Fails where a row depends on the thread that draws it, or where what is kept of a still
/// camera's view is not what it would see now.
#[test]
fn threads_and_kept_views_change_no_byte() {
    let mut job = sample::wayside_job(&sample::track(), 280.0);
    job.views[0].camera.intrinsics = Intrinsics::centred(320, 180, 180.0);
    job.headlights.push(Headlight {
        world_from_light: sample::on_bed(&sample::track(), 270.0, 0.0, 1.5),
        intensity_cd: 40_000.0,
        exponent: 30.0,
    });
    // Two equal poses are a camera that might move: nothing is kept.
    let mut moving = job.clone();
    let pose = moving.views[0].motion.poses[0];
    moving.views[0].motion.poses.push(pose);
    let draw = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| {
            let mut renderer = CpuRenderer::oracle(sample::scene());
            for job in [&job, &moving, &job] {
                renderer.submit(job).unwrap();
            }
            [(); 3].map(|()| renderer.collect().unwrap().remove(0))
        })
    };
    let [first, fresh, kept] = draw(1);
    assert!(first.iter().max() > Some(&100) && first.iter().min() < Some(&20));
    assert_eq!(first, fresh);
    assert_eq!(first, kept);
    assert_eq!(draw(3), [first, fresh, kept]);
}

/// Fails where a job without pixels or poses brings the renderer down.
#[test]
fn empty_jobs_give_empty_images() {
    let mut renderer = renderer(Vec::new());
    assert!(matches!(
        renderer.collect(),
        Err(RenderError::NothingSubmitted)
    ));
    let mut none = view(Intrinsics::centred(0, 0, 100.0));
    assert_eq!(renderer.draw(&Job::default(), &none).len(), 0);
    none = view(Intrinsics::centred(4, 4, 100.0));
    none.motion.poses.clear();
    assert!(
        renderer
            .draw(&Job::default(), &none)
            .iter()
            .all(|p| *p == 0)
    );
    none.motion = CameraMotion::still(Isometry3::translation(f64::NAN, 0.0, 0.0));
    assert_eq!(renderer.draw(&Job::default(), &none).len(), 16);
}

/// Fails where the quick renderer leaves out something that shows: a bright place between dark
/// corners, a body before a dark wall, a lamp behind a body.
#[test]
fn the_quick_renderer_draws_what_the_oracle_draws() {
    let track = sample::track();
    for k in 0..6 {
        let s_m = 60.0 + 31.7 * f64::from(k);
        let mut job = sample::stereo_job(&track, s_m, 27.8);
        job.bodies = sample::worker(&track, s_m + 4.0, 1.4);
        job.headlights = vec![Headlight {
            world_from_light: sample::on_bed(&track, s_m, 0.0, 1.5),
            intensity_cd: 40_000.0,
            exponent: 30.0,
        }];
        let view = &mut job.views[0];
        view.sensor.noise = k % 2 == 1;
        let view = view.clone();
        let oracle = CpuRenderer::oracle(sample::scene()).draw(&job, &view);
        let quick = CpuRenderer::quick(sample::scene()).draw(&job, &view);
        let away = oracle.iter().zip(quick.iter()).map(|(a, b)| a.abs_diff(*b));
        let (worst, off) = away.fold((0, 0usize), |(worst, off), d| {
            (worst.max(d), off + usize::from(d > 0))
        });
        let share = off as f64 / oracle.len() as f64;
        assert!(oracle.iter().max() > Some(&250));
        assert!(worst <= 1 && share < 0.01, "{s_m} m: {worst} in {share}");
    }
}
