//! A network of tracks: walls across the line, strips of bed, switch blades, sky and daylight, by both
//! renderers.

use crate::common::sample;
use crate::gpu_vs_cpu::{compare, scaled};
use metrotwin::track::{Track, TrackPoint, Tunnel};
use metrotwin::twin::blades::{SwitchBlades, tracks_without_blades};
use metrotwin::twin::lamps;
use metrotwin::twin::render::{CameraMotion, Job, Scene};
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
