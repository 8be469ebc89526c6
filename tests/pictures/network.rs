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
        track.daylight_lx = 4.0;
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
    scaled(&mut job.views[0], 1.0, 2);
    job.headlights = vec![Headlight {
        world_from_light: sample::on_bed(lead, 427.0, -0.8, 1.6),
        intensity_cd: 40_000.0,
        exponent: 60.0,
    }];
    job.bodies = vec![];
    let scene = scene(&tunnel);
    let pictures = |job: &Job| {
        let job = quiet(job);
        let [a, b] =
            [gpu(scene.clone()), cpu(scene.clone())].map(|mut r| draw(&mut *r, &job).remove(0));
        (a, b)
    };
    let (_, empty) = pictures(&job);
    // One behind the portal at 445 m, one before it.
    for s_m in [437.0, 448.0] {
        job.bodies = vec![box_at(s_m, -0.2)];
        let (by_gpu, by_cpu) = pictures(&job);
        let pixels = || empty.iter().zip(by_cpu.iter()).zip(by_gpu.iter());
        let changed: Vec<_> = pixels().filter(|((e, c), _)| e.abs_diff(**c) > 8).collect();
        let off: f64 = changed
            .iter()
            .map(|((_, c), g)| f64::from(c.abs_diff(**g)))
            .sum();
        let mean_off = off / changed.len() as f64;
        println!(
            "box at {s_m} m: {} pixels changed, off by {mean_off:.2} grey levels",
            changed.len()
        );
        assert!(changed.len() > 300, "{s_m}: {}", changed.len());
        assert!(mean_off < 2.0, "{s_m}: {mean_off}");
        if let Ok(dir) = std::env::var("METROTWIN_PICTURES") {
            by_gpu
                .save(format!("{dir}/portal_shadow_{s_m}_gpu.png"))
                .unwrap();
            by_cpu
                .save(format!("{dir}/portal_shadow_{s_m}_cpu.png"))
                .unwrap();
        }
    }
}
