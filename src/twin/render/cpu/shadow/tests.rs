#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]
use super::*;
use crate::bus::SimTime;
use crate::twin::geometry::Shape;
use crate::twin::lights::Headlight;
use crate::twin::render::constants::SIGHT_M;
use crate::twin::render::photometry::BlinkingLamp;
use crate::twin::render::sample;
use nalgebra::{Isometry3, UnitQuaternion};
use std::f64::consts::PI;

/// A headlight at (0, 0, 5) that looks down.
fn headlight() -> Headlight {
    Headlight {
        world_from_light: Isometry3::from_parts(
            nalgebra::Translation3::new(0.0, 0.0, 5.0),
            UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.5 * PI),
        ),
        intensity_cd: 1000.0,
        exponent: 1.0,
    }
}

/// A lamp of 0.25 m at (0, 0, 5) that looks down.
fn lamp() -> BlinkingLamp {
    let mut lamp = sample::scene().lamps.remove(0);
    lamp.centre = Point3::new(0.0, 0.0, 5.0);
    lamp.facing = -Vector3::z_axis();
    BlinkingLamp::new(lamp)
}

fn body(shape: Shape, at: Point3<f64>) -> Body {
    Body {
        shape,
        world_from_body: at.coords.into(),
        velocity_mps: Vector3::zeros(),
        albedo: 0.5,
        luminance_cd_m2: 0.0,
    }
}

fn share_at(source: &ShadowLight<'_>, x_m: f64, bodies: &[Body]) -> f64 {
    let bodies: Vec<_> = bodies.iter().map(|b| BodyBall::at(b, 0.0)).collect();
    source.hidden_share(&Point3::new(x_m, 0.0, 0.0), &Vector3::z(), bodies.iter())
}

/// Share of the disc of radius R that a disc of radius r, d away from it, covers (the lens of two
/// circles).
fn covered(big: f64, r: f64, d: f64) -> f64 {
    if d >= big + r {
        return 0.0;
    }
    if d <= (big - r).abs() {
        return (r / big).powi(2).min(1.0);
    }
    let a = ((d * d + r * r - big * big) / (2.0 * d * r)).acos();
    let b = ((d * d + big * big - r * r) / (2.0 * d * big)).acos();
    let lens = r * r * (a - 0.5 * (2.0 * a).sin()) + big * big * (b - 0.5 * (2.0 * b).sin());
    lens / (PI * big * big)
}

/// Fails where umbra or penumbra are too wide, too narrow or in the wrong place: seen from the
/// floor, a small sphere 2 m up passes before the disc of a lamp 5 m up as a disc of its own.
#[test]
fn a_sphere_hides_the_lens_of_two_circles() {
    let lamp = lamp();
    let source = ShadowLight::new(LightSource::lamp(&lamp), None);
    for radius_m in [0.03, 0.06, 0.2] {
        let ball = [body(Shape::Sphere(radius_m), Point3::new(0.0, 0.0, 2.0))];
        let (mut worst, mut bias, mut edges) = (0.0f64, 0.0, 0);
        for k in -60..60 {
            let x_m = 0.01 * f64::from(k);
            // From (x, 0) the sphere's centre line meets the lamp's plane at x - 2.5 x.
            let expected = covered(lamp.radius_m, 2.5 * radius_m, (1.5 * x_m).abs());
            let seen = share_at(&source, x_m, &ball);
            worst = worst.max((seen - expected).abs());
            bias += (seen - expected) / 120.0;
            edges += usize::from(seen > 0.0 && seen < 1.0);
        }
        // Counting 16 places is off by two at most, and as often over as under.
        assert!(worst < 2.0 / 16.0, "{radius_m}: {worst}");
        assert!(bias.abs() < 0.005, "{radius_m}: {bias}");
        assert!(edges > 5);
    }
}

/// Fails where the penumbra of a straight edge is not as wide as the disc seen through it: a
/// board 1 m under a lamp of 0.25 m, 4 m over the floor.
#[test]
fn the_penumbra_of_an_edge_is_the_disc_seen_through_it() {
    let lamp = lamp();
    let source = ShadowLight::new(LightSource::lamp(&lamp), None);
    // Its edge is at x = 0; everything beyond is covered.
    let board = [body(
        Shape::Box(Vector3::new(3.0, 3.0, 0.01)),
        Point3::new(-3.0, 0.0, 4.0),
    )];
    // Through the edge, x on the floor sees the disc cut at -x / 4.
    let half_m = 4.0 * lamp.radius_m;
    assert!((share_at(&source, -1.05 * half_m, &board) - 1.0).abs() < 1e-12);
    assert!(share_at(&source, 1.05 * half_m, &board).abs() < 1e-12);
    for k in -9..10 {
        let x = 0.1 * f64::from(k);
        // Share of a disc beyond a chord at x of its radius.
        let expected = (x.acos() - x * (1.0 - x * x).sqrt()) / PI;
        let seen = share_at(&source, x * half_m, &board);
        assert!(
            (seen - expected).abs() < 1.3 / 16.0,
            "{x}: {seen} {expected}"
        );
    }
}

/// Fails where a surface shades itself: the lit side of every shape, from the rim of its shadow
/// to the place under the light.
#[test]
fn bodies_do_not_shade_their_own_lit_side() {
    let lamp = lamp();
    let source = ShadowLight::new(LightSource::lamp(&lamp), None);
    for shape in [
        Shape::Sphere(0.5),
        Shape::Box(Vector3::new(0.4, 0.3, 0.5)),
        Shape::Capsule(0.2, 0.6),
        Shape::Cylinder(0.4, 0.5),
    ] {
        let own = [body(shape, Point3::new(0.3, -0.2, 1.0))];
        let bodies = [BodyBall::at(&own[0], 0.0)];
        let mut lit = 0;
        for k in 0..400 {
            let target = Point3::new(
                0.3 + 0.005 * f64::from(k % 20) - 0.05,
                -0.2 + 0.002 * f64::from(k / 20),
                1.0,
            );
            let eye = Point3::new(1.0 - 0.004 * f64::from(k), 0.6, 5.0);
            let Some((t, normal)) = bodies[0].solid.cast(&eye, &(target - eye)) else {
                continue;
            };
            let at = eye + (target - eye) * t;
            let places = source.places.iter();
            // All of the disc above the surface's horizon.
            if places.into_iter().all(|p| normal.dot(&(p - at)) > 0.01) {
                lit += 1;
                let share = source.hidden_share(&at, &normal, bodies.iter());
                assert!(share.abs() < 1e-12, "{at}");
            }
        }
        assert!(lit > 20, "{lit}");
    }
}

/// Fails where a running train, or the lens before its headlight, throws a shadow by its own light, or a
/// board ahead of it does not.
#[test]
fn a_train_throws_no_shadow_by_its_own_light() {
    let moving = |shape, at: Point3<f64>| Body {
        velocity_mps: Vector3::new(0.0, 0.0, -20.0),
        ..body(shape, at)
    };
    let (headlight, scene) = (headlight(), CastScene::new(sample::scene()));
    let thrown = |body: &Body| {
        let job = Job {
            bodies: vec![body.clone()],
            headlights: vec![headlight.clone()],
            ..Job::default()
        };
        BodyShadows::new(&scene, &job, &[]).at(0.0).falling.len()
    };
    let car = moving(
        Shape::Box(Vector3::new(1.4, 1.4, 10.0)),
        Point3::new(0.0, 0.5, 15.05),
    );
    let lens = moving(Shape::Sphere(0.1), Point3::new(0.0, 0.0, 4.95));
    let board = body(
        Shape::Box(Vector3::new(0.5, 0.5, 0.01)),
        Point3::new(0.0, 0.0, 4.0),
    );
    assert_eq!([&car, &lens, &board].map(thrown), [0, 0, 1]);
}

/// Fails where a shadow is forgotten, or where a body is taken where it was at the job's time: the
/// same light taken as by all lamps and all bodies together.
#[test]
fn every_shadow_is_found() {
    let track = sample::track();
    let scene = CastScene::new(sample::scene());
    let mut job = sample::wayside_job(&track, 300.0);
    job.time = SimTime::from_secs(0.01);
    for body in &mut job.bodies {
        body.velocity_mps = Vector3::new(3.0, -9.0, 1.0);
    }
    job.headlights = vec![Headlight {
        world_from_light: sample::on_bed(&track, 306.0, 0.5, 1.5),
        ..headlight()
    }];
    let view = &job.views[0];
    let pose = view.motion.poses[0];
    let eye = Point3::from(pose.translation.vector);
    let ray_start = scene.tunnel.ray_start(&eye, None);
    let shadows = BodyShadows::new(&scene, &job, &scene.lamps_about(view));
    let all_lamps = scene.lit.lamps.lamps();
    let blinking = Blinking::steady(all_lamps);
    let all_lights: Vec<_> = (all_lamps.iter().map(LightSource::lamp))
        .chain(job.headlights.iter().map(LightSource::headlight))
        .map(|source| ShadowLight::new(source, None))
        .collect();
    let mut shaded = 0;
    for k in 0..4000usize {
        let (u, v) = ((k * 37 % 1920) as f64, (k * 271 % 1080) as f64);
        let ray = pose * view.camera.intrinsics.ray(u, v);
        let Some(hit) = scene.tunnel.cast(ray_start, &eye, &ray, SIGHT_M) else {
            continue;
        };
        let at = scene.tunnel.surface_at(&eye, &ray, &hit);
        let after_s = view.camera.shutter.row_mid(view.start, v).since(job.time);
        let bodies: Vec<_> = (job.bodies.iter())
            .map(|body| BodyBall::at(body, after_s))
            .collect();
        let hidden_lx = |light: &ShadowLight<'_>| {
            let share = light.hidden_share(&at.position, &at.normal, bodies.iter());
            share * light.source.irradiance_lx(&at.position, &at.normal)
        };
        let all: f64 = all_lights.iter().map(hidden_lx).sum();
        let found = (shadows.at(after_s)).hidden_lx(&at.position, &at.normal, &blinking);
        assert!((found - all).abs() < 1e-9, "{u} {v}: {found} {all}");
        shaded += usize::from(all > 0.0);
    }
    assert!(shaded > 50, "{shaded}");
}
