//! The labels against closed forms and against each other.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test fails by panicking"
)]

use super::*;
use crate::track::TrackPoint;
use crate::twin::geometry::Shape;
use crate::twin::render::{View, sample};
use nalgebra::{Translation3, UnitQuaternion};

const SPEED_MPS: f64 = 40.0;

/// The sample rig in a quarter of its size.
fn small(mut view: View) -> View {
    view.camera.intrinsics = Intrinsics::centred(320, 180, 260.0);
    view.camera.shutter.line_time_s *= 4.0;
    view
}

fn rig_job(s_m: f64) -> Job {
    Job {
        views: vec![small(sample::rig_view(&sample::track(), s_m, SPEED_MPS))],
        ..Job::default()
    }
}

/// Fails where a depth is a range, a pixel is off by a half, or a row is seen from another row's
/// place: the bed is a plane, so its depth is known in closed form, row by row.
#[test]
fn depth_of_the_bed_is_that_of_a_plane() {
    let tunnel = sample::track();
    let mut view = small(sample::rig_view(&tunnel, 50.0, 0.0));
    // A camera that looks down at the bed between the rails and sinks at 20 m/s.
    view.motion.poses = (0..32)
        .map(|k| {
            let at = TrackPoint {
                s_m: 50.0,
                l_m: 0.0,
                h_m: 2.0 - 20.0 * 1e-3 * f64::from(k - 1),
            };
            sample::camera_pose(&tunnel, at, 0.0, -90f64.to_radians())
        })
        .collect();
    let job = Job::default();
    let projection = Projection::new(&view, job.time);
    let labels = Labeller::new(&sample::scene()).look(&job, &projection);
    let shutter = view.camera.shutter;
    for v in [0usize, 45, 90, 179] {
        let t = shutter.delay_s(v as f64) + 0.5 * shutter.exposure_s;
        let height_m = 2.0 - 20.0 * t + 0.17;
        let depth_m = labels.depth_m[v * 320 + 160];
        assert!((depth_m - height_m).abs() < 1e-9, "row {v}: {depth_m}");
        assert_eq!(labels.surface[v * 320 + 160], Surface::Tunnel);
    }
}

/// Fails where the row-time equation is solved with another row's pose, or a sign is wrong: each
/// pixel's surface is seen in that pixel.
#[test]
fn what_a_pixel_shows_is_seen_in_that_pixel() {
    for first_row in [0, 179] {
        let mut job = rig_job(100.0);
        job.views[0].camera.shutter.first_row = first_row;
        let projection = Projection::new(&job.views[0], job.time);
        let labels = Labeller::new(&sample::scene()).look(&job, &projection);
        let camera = &job.views[0].camera.intrinsics;
        let mut asked = 0;
        for k in (0..labels.depth_m.len()).step_by(97) {
            let (u, v) = ((k % 320) as f64, (k / 320) as f64);
            if labels.surface[k] == Surface::Nothing {
                continue;
            }
            let in_camera = Point3::from(camera.ray(u, v) * labels.depth_m[k]);
            let seen = projection.of(&(projection.pose(v) * in_camera)).unwrap();
            assert!((seen.pixel - Point2::new(u, v)).norm() < 1e-6, "{seen:?}");
            assert!((seen.depth_m - labels.depth_m[k]).abs() < 1e-6);
            asked += 1;
        }
        assert!(asked > 400);
    }
}

/// Fails where the equation is not solved for some point, as with times in whole nanoseconds: all
/// that is in its picture or close by has its row.
#[test]
fn every_point_in_view_has_its_row() {
    for first_row in [0, 719] {
        let mut view = sample::rig_view(&sample::track(), 100.0, 160.0 / 3.6);
        view.camera.shutter.first_row = first_row;
        let projection = Projection::new(&view, view.start);
        let pose = projection.pose(359.5);
        for k in 0..2000u32 {
            let (x, y) = (
                f64::from(k % 41) / 20.0 - 1.0,
                f64::from(k / 41) / 24.0 - 1.0,
            );
            let depth_m = 5.0 + f64::from(k % 13);
            let point = pose * (Point3::new(0.55 * x, 0.3 * y, 1.0) * depth_m);
            let seen = projection.of(&point);
            let seen = seen.unwrap_or_else(|| panic!("{point} has no row"));
            let there = projection
                .pose(seen.pixel.y)
                .inverse_transform_point(&point);
            let again = view.camera.intrinsics.project(&there).unwrap();
            assert!(
                (again - seen.pixel).norm() < 1e-6,
                "{point}: {again} {seen:?}"
            );
        }
    }
}

/// Fails where the quick solution parts from the exact one by more than its table may.
#[test]
fn interpolated_rows_agree_with_exact_ones() {
    let mut job = rig_job(100.0);
    // Shaken: 2 mrad to and fro from pose to pose.
    for (k, pose) in job.views[0].motion.poses.iter_mut().enumerate() {
        let shake = if k % 2 == 0 { 1e-3 } else { -1e-3 };
        pose.rotation *= UnitQuaternion::from_euler_angles(shake, 0.5 * shake, 0.0);
    }
    let projection = Projection::new(&job.views[0], job.time);
    let mut worst: f64 = 0.0;
    for lamp in &sample::scene().lamps {
        let Some(seen) = projection
            .of(&lamp.centre)
            .filter(|s| projection.contains(&s.pixel))
        else {
            continue;
        };
        let quick = projection
            .within_image(&lamp.centre, &Vector3::zeros())
            .unwrap();
        worst = worst.max((quick.pixel - seen.pixel).norm());
    }
    assert!(worst > 0.0 && worst < 0.02, "{worst}");
}

/// Fails where flow goes to the wrong time, body or side: what flows from A to B flows back from B
/// to A, on walls and on a body that moves and turns.
#[test]
fn flow_there_and_back_is_nothing() {
    let tunnel = sample::track();
    let body = |turned: f64, l_m: f64| Body {
        shape: Shape::Box(Vector3::new(0.6, 0.5, 0.4)),
        world_from_body: sample::on_bed(&tunnel, 104.5, l_m, 3.4)
            * UnitQuaternion::from_euler_angles(0.0, 0.0, turned),
        velocity_mps: Vector3::new(0.4, -0.8, 0.0),
        albedo: 0.5,
        luminance_cd_m2: 0.0,
    };
    let [mut a, mut b] = [rig_job(100.0), rig_job(100.3)];
    a.bodies.push(body(0.3, 2.0));
    b.bodies.push(body(0.4, 1.9));
    let [from, to] = [&a, &b].map(|job| Projection::new(&job.views[0], job.time));
    let mut labeller = Labeller::new(&sample::scene());
    let (there, back) = (labeller.look(&a, &from), labeller.look(&b, &to));
    let same = |k| Some(usize::from(k));
    let forth = labeller.flow((&a, &from, &there), (&b, &to), same);
    let (mut walls, mut sides) = (0, 0);
    let camera = a.views[0].camera.intrinsics;
    for (k, flow) in forth.iter().enumerate().filter(|(_, f)| f[0].is_finite()) {
        let (u, v) = ((k % 320) as f64, (k / 320) as f64);
        let there_px = Point2::new(u + f64::from(flow[0]), v + f64::from(flow[1]));
        // The other frame's own ray through that place, at that row's time.
        let pose = to.pose(there_px.y);
        let ray = pose * camera.ray(there_px.x, there_px.y);
        let eye = Point3::from(pose.translation.vector);
        let (hit, point) = match there.surface[k] {
            Surface::Body(_) => {
                let solid = Solid::at(&b.bodies[0], to.after_s(there_px.y));
                let Some((t, _)) = solid.cast(&eye, &ray) else {
                    continue;
                };
                let was = Solid::at(&a.bodies[0], from.after_s(v));
                let point = from.pose(v) * Point3::from(camera.ray(u, v) * there.depth_m[k]);
                (solid.in_body(&(eye + ray * t)), was.in_body(&point))
            }
            _ => {
                let point = from.pose(v) * Point3::from(camera.ray(u, v) * there.depth_m[k]);
                let depth = pose.inverse_transform_point(&point).z;
                (eye + ray * depth, point)
            }
        };
        // Sides of a body that have turned away are hidden by it.
        let hidden = matches!(there.surface[k], Surface::Body(_)) && (hit - point).norm() > 0.05;
        if !hidden {
            assert!((hit - point).norm() < 1e-4, "{u} {v}: {hit} {point}");
        }
        match there.surface[k] {
            Surface::Body(_) => sides += usize::from(!hidden),
            _ => walls += 1,
        }
    }
    assert!(walls > 10_000 && sides > 200, "{walls} {sides}");
    assert!(back.surface.contains(&Surface::Body(0)));
}

/// Fails where a part out of the frame, or a hidden one, is counted as seen.
#[test]
fn the_whole_of_a_ball_is_a_disc() {
    let tunnel = sample::track();
    let view = small(sample::rig_view(&tunnel, 100.0, 0.0));
    let pose = view.motion.pose_at(view.start);
    let ball = |x: f64| Body {
        shape: Shape::Sphere(0.5),
        world_from_body: pose * Translation3::new(x, 0.0, 5.0),
        velocity_mps: Vector3::zeros(),
        albedo: 0.5,
        luminance_cd_m2: 0.0,
    };
    let projection = Projection::new(&view, view.start);
    let (centred, cut) = (ball(0.0), ball(159.5 / 260.0 * 5.0));
    let all = whole(&[&centred], &projection).unwrap();
    // A ball of radius r at distance d is a disc of radius f r / sqrt(d^2 - r^2).
    let radius = 260.0 * 0.5 / (25.0f64 - 0.25).sqrt();
    assert!((all.pixels / (std::f64::consts::PI * radius * radius) - 1.0).abs() < 0.01);
    assert!((all.high.x + 1.0 - all.low.x - 2.0 * radius).abs() <= 1.0);
    assert!((all.in_frame - all.pixels).abs() < 1e-9);
    let half = whole(&[&cut], &projection).unwrap();
    assert!((half.in_frame / half.pixels - 0.5).abs() < 0.03, "{half:?}");
    assert_eq!(whole(&[&ball(1e3)], &projection), None);
}
