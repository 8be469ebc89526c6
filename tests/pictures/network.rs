//! A network of tracks: walls across the line, strips of bed, switch blades, sky and daylight, by both
//! renderers.

use crate::common::{cpu, draw, gpu, sample};
use crate::gpu_vs_cpu::{compare, quiet, scaled};
use metrotwin::track::{Track, TrackPoint, Tunnel};
use metrotwin::twin::blades::{SwitchBlades, tracks_without_blades};
use metrotwin::twin::geometry::{Body, Shape};
use metrotwin::twin::lamps;
use metrotwin::twin::lights::Headlight;
use metrotwin::twin::render::{CameraMotion, Job, Scene};
use nalgebra::Vector3;
use std::sync::Arc;

fn terminus() -> Tunnel {
    let text = include_str!("../../tunnels/terminus.toml");
    Tunnel::from_toml(text).unwrap()
}

fn scene(tunnel: &Tunnel) -> Scene {
    Scene {
        tracks: tracks_without_blades(&tunnel.network),
        lamps: lamps::shining(tunnel, &[], 1),
        ..sample::scene()
    }
}

fn track<'a>(tunnel: &'a Tunnel, name: &str) -> &'a Arc<Track> {
    let number = tunnel.network.named(name).unwrap();
    tunnel.network.track(number).unwrap()
}

/// What a wayside camera of the tunnel sees of tracks, walls and blades, with so much gain.
fn seen_from(tunnel: &Tunnel, device: &str, gain: f64) -> Job {
    let mut tracks = tunnel.network.tracks.iter();
    let (track, site) = tracks
        .find_map(|track| {
            let site = track.wayside.iter().find(|site| site.name == device)?;
            Some((track, site))
        })
        .unwrap();
    let at = TrackPoint {
        s_m: site.chainage_m,
        l_m: site.lateral_m,
        h_m: site.height_m,
    };
    let (yaw, pitch) = (site.yaw_deg.to_radians(), site.pitch_deg.to_radians());
    let mut job = sample::wayside_job(track, site.chainage_m);
    job.views[0].motion = CameraMotion::still(sample::camera_pose(track, at, yaw, pitch));
    scaled(&mut job.views[0], gain, 2);
    let switches = tunnel.network.switches.iter().enumerate();
    job.bodies = switches
        .flat_map(|(k, switch)| {
            let blades = SwitchBlades::of(&tunnel.network, switch).unwrap();
            let bodies: Vec<_> = blades.bodies(0.25 * (k % 5) as f64).collect();
            bodies
        })
        .collect();
    job
}

/// Fails where an end wall, a strip of bed or a blade is elsewhere in one renderer than in the other.
#[test]
fn halls_switches_and_platforms() {
    let tunnel = terminus();
    for device in ["V-hall", "V-crossover", "V-station"] {
        let job = seen_from(&tunnel, device, 1.0);
        compare(&format!("flood_{device}"), &scene(&tunnel), &job);
    }
}

/// Fails where the sky shows through a tunnel or not at all, and where daylight is another.
#[test]
fn portal_and_depot_by_day() {
    let tunnel = terminus();
    for (device, gain) in [("V-portal", 0.02), ("V-depot", 0.02)] {
        let job = seen_from(&tunnel, device, gain);
        compare(&format!("flood_{device}"), &scene(&tunnel), &job);
    }
}

/// Fails where what a running train passes across the line is smeared as what is along it: out of the hall
/// before the platforms, and out of the portal.
#[test]
fn from_a_running_train() {
    let tunnel = terminus();
    for (name, s_m, gain) in [("u3", 4.0, 3.0), ("lead", 442.0, 4.0)] {
        let mut view = sample::rig_view(track(&tunnel, name), s_m, 20.0);
        scaled(&mut view, gain, 2);
        let job = Job {
            views: vec![view],
            ..Job::default()
        };
        compare(&format!("flood_train_{name}"), &scene(&tunnel), &job);
    }
}

/// Fails where a shadow's depth follows the light at the camera instead of that where it falls: a train's headlights
/// in a tunnel throw shadows of boxes before and behind a portal at dusk.
#[test]
fn shadows_before_and_behind_a_portal() {
    let mut tunnel = terminus();
    let mut tracks: Vec<_> = tunnel
        .network
        .tracks
        .iter()
        .map(|t| (**t).clone())
        .collect();
    for track in &mut tracks {
        track.daylight_lx = 60.0;
    }
    tunnel.network.tracks = tracks.into_iter().map(Arc::new).collect();
    let lead = track(&tunnel, "lead");
    let at = |s_m, h_m| TrackPoint { s_m, l_m: 1.5, h_m };
    let box_at = |s_m, l_m| Body {
        shape: Shape::Box(Vector3::new(0.4, 0.4, 0.4)),
        world_from_body: sample::on_bed(lead, s_m, l_m, 0.4),
        velocity_mps: Vector3::zeros(),
        albedo: 0.3,
        luminance_cd_m2: 0.0,
    };
    let mut job = sample::wayside_job(lead, 425.0);
    let pose = sample::camera_pose(lead, at(425.0, 3.5), 0.0, -0.12);
    job.views[0].motion = CameraMotion::still(pose);
    job.headlights = vec![Headlight {
        world_from_light: sample::on_bed(lead, 427.0, -0.8, 1.6),
        intensity_cd: 40_000.0,
        exponent: 60.0,
    }];
    job.bodies = vec![];
    let scene = scene(&tunnel);
    let pictures = |job: &Job| {
        let job = quiet(job);
        [gpu(scene.clone()), cpu(scene.clone())].map(|mut r| draw(&mut *r, &job).remove(0))
    };
    let dir = std::env::var("METROTWIN_PICTURES");
    let depths = |s_m: f64, gain: f64| {
        let mut job = job.clone();
        scaled(&mut job.views[0], gain, 2);
        let empty = pictures(&job);
        job.bodies = vec![box_at(s_m, -0.2)];
        let full = pictures(&job);
        for (picture, renderer) in full.iter().zip(["gpu", "cpu"]) {
            if let Ok(dir) = &dir {
                let name = format!("{dir}/portal_shadow_{s_m}_{renderer}.png");
                picture.save(name).unwrap();
            }
        }
        let [by_gpu, by_cpu] = [0, 1].map(|k| {
            let pixels = empty[k].iter().zip(full[k].iter());
            pixels.map(|(lit, shaded)| f64::from(*lit) - f64::from(*shaded))
        });
        by_gpu.zip(by_cpu).collect::<Vec<_>>()
    };
    // In the tunnel, near its portal at 445 m and farther away from it.
    for s_m in [437.0, 432.0] {
        let mut shaded = depths(s_m, 5.0);
        shaded.retain(|(_, by_cpu)| *by_cpu > 4.0);
        let mean =
            |of: fn(&(f64, f64)) -> f64| shaded.iter().map(of).sum::<f64>() / shaded.len() as f64;
        let [by_gpu, by_cpu] = [mean(|depth| depth.0), mean(|depth| depth.1)];
        let count = shaded.len();
        println!(
            "box at {s_m} m: {count} pixels darker by {by_gpu:.2} and {by_cpu:.2} grey levels"
        );
        assert!(count > 1000, "{s_m}: {count}");
        assert!(
            (by_gpu - by_cpu).abs() < 0.1 * by_cpu,
            "{s_m}: {by_gpu} {by_cpu}"
        );
    }
    // In the open the headlights are weaker than the day.
    let outside = depths(448.0, 0.5);
    let dark = outside.iter().filter(|(by_gpu, _)| *by_gpu > 8.0).count();
    println!("box at 448 m: {dark} pixels darker");
    assert!(dark < 30, "{dark}");
}
