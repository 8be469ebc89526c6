//! A small line to draw without any file: 300 m of straight, then 300 m of left-hand arc of radius
//! 300 m, a circular tunnel with a flat bed, lamps every 10 m on the left wall.

use metrotwin::bus::{CameraModel, Intrinsics, Shutter, SimTime};
use metrotwin::track::uid::{LineCode, Uid};
use metrotwin::track::{
    Alignment, BED_M, CrossSection, LampSite, PlanElement, SectionRange, Track, TrackPoint,
};
use metrotwin::twin::air::Air;
use metrotwin::twin::geometry::{Body, Shape};
use metrotwin::twin::lights::LampLight;
use metrotwin::twin::random::Stream;
use metrotwin::twin::reflectance::Wet;
use metrotwin::twin::render::{
    CameraMotion, Job, LensSettings, NoiseKey, Scene, SensorSettings, View,
};
use nalgebra::{Isometry3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use std::sync::Arc;

/// Length of the line.
pub const LENGTH_M: f64 = 600.0;
/// From lamp to lamp.
pub const LAMP_SPACING_M: f64 = 10.0;
/// Chainage of the first lamp.
pub const FIRST_LAMP_M: f64 = 5.0;
/// Width of the pixels of both cameras.
const PIXEL_M: f64 = 3.75e-6;
/// Radius of the lining, and the height of its centre above top of rail: a lamp 2.78 m left and
/// 3.25 m up stands clear of the wall.
const RADIUS_M: f64 = 3.4;
const CENTRE_M: f64 = 1.7;

/// The line with its lamps.
pub fn track() -> Track {
    let half_m = 0.5 * LENGTH_M;
    let plan = [
        PlanElement::straight(half_m),
        PlanElement::arc(half_m, 1.0 / 300.0, 0.0),
    ];
    let alignment = Alignment::new(Point3::new(1000.0, 2000.0, -15.0), 0.3, &plan, &[]);
    let lamps = (0..(LENGTH_M / LAMP_SPACING_M) as u16)
        .map(|k| lamp_site(&alignment, k))
        .collect();
    Track {
        name: "sample".into(),
        alignment,
        stated_chainage: None,
        sections: vec![SectionRange {
            from_m: 0.0,
            to_m: LENGTH_M,
            missing_rail: None,
            section: CrossSection::circular(RADIUS_M, CENTRE_M, None),
        }],
        lamps,
        wayside: Vec::new(),
        balises: Vec::new(),
        base_stations: Vec::new(),
        stations: Vec::new(),
        ambient_lx: 5.0,
        daylight_lx: 0.0,
    }
}

/// The sample tunnel with its lamps blinking their names, each with a phase of its own.
pub fn scene() -> Scene {
    let track = track();
    let lamps = track
        .lamps
        .iter()
        .map(|site| LampLight::from_site(site, 1e-4 * f64::from(site.uid.lamp % 17)))
        .collect();
    Scene {
        tracks: vec![Arc::new(track)],
        lamps,
        air: Air::default(),
        wet: Wet::default(),
    }
}

/// A camera fixed to the track frame at `at`, turned `yaw_rad` to the left and `pitch_rad` up
/// from the direction up the line: `world_from_camera`.
pub fn camera_pose(track: &Track, at: TrackPoint, yaw_rad: f64, pitch_rad: f64) -> Isometry3<f64> {
    let line = track.alignment.at(at.s_m).world_from_line();
    // Camera x is right, y is down, z is forward.
    let vehicle_from_camera = Rotation3::from_matrix_unchecked(nalgebra::Matrix3::new(
        0.0, 0.0, 1.0, //
        -1.0, 0.0, 0.0, //
        0.0, -1.0, 0.0,
    ));
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), yaw_rad)
        * Rotation3::from_axis_angle(&Vector3::y_axis(), -pitch_rad);
    Isometry3::from_parts(
        Translation3::from(track.alignment.world_from_track(at)),
        line.rotation * UnitQuaternion::from_rotation_matrix(&(turn * vehicle_from_camera)),
    )
}

/// The left eye of a rig on a train at chainage `s_m` at time 0, running at `speed_mps`; the view
/// of frame 0.
pub fn rig_view(track: &Track, s_m: f64, speed_mps: f64) -> View {
    let step_s = 1e-3;
    let poses = (-1..=30)
        .map(|k| {
            let at = TrackPoint {
                s_m: s_m + speed_mps * step_s * f64::from(k),
                l_m: 1.08,
                h_m: 1.75,
            };
            camera_pose(track, at, 41f64.to_radians(), 26f64.to_radians())
        })
        .collect();
    let motion = CameraMotion {
        first: SimTime::from_secs(-step_s),
        step_s,
        poses,
    };
    let lens = Intrinsics::centred(1280, 720, 1040.0);
    view("sample rig", lens, (22.2e-6, 30e-6), motion)
}

fn view(
    name: &str,
    intrinsics: Intrinsics,
    (line_time_s, exposure_s): (f64, f64),
    motion: CameraMotion,
) -> View {
    View {
        camera: CameraModel {
            intrinsics,
            shutter: Shutter {
                line_time_s,
                exposure_s,
                first_row: 0,
            },
            blur_px: 0.5,
        },
        start: SimTime::ZERO,
        motion,
        pixel_m: PIXEL_M,
        lens: LensSettings::default(),
        sensor: SensorSettings::default(),
        noise: NoiseKey {
            stream: Stream::new(1, 0, name),
            frame: 0,
        },
    }
}

/// Both eyes of the rig of [`rig_view`], the right one 0.12 m to the right.
pub fn stereo_job(track: &Track, s_m: f64, speed_mps: f64) -> Job {
    let left = rig_view(track, s_m, speed_mps);
    let mut right = left.clone();
    right.noise.stream = Stream::new(1, 0, "sample rig right");
    for pose in &mut right.motion.poses {
        *pose *= Translation3::new(0.12, 0.0, 0.0);
    }
    Job {
        views: vec![left, right],
        ..Job::default()
    }
}

/// A camera on the right wall that looks up the line over [`worker`] and a 0.3 m box.
pub fn wayside_job(track: &Track, s_m: f64) -> Job {
    let at = TrackPoint {
        s_m,
        l_m: -2.4,
        h_m: 3.0,
    };
    let pose = camera_pose(track, at, 8f64.to_radians(), -12f64.to_radians());
    let half_m = 0.15;
    let mut bodies = worker(track, s_m + 18.0, 0.4);
    bodies.push(body(
        Shape::Box(Vector3::repeat(half_m)),
        on_bed(track, s_m + 12.0, -0.3, half_m),
        0.5,
    ));
    Job {
        bodies,
        views: vec![view(
            "sample wayside",
            Intrinsics::centred(1920, 1080, 1100.0),
            (14.8e-6, 8e-3),
            CameraMotion::still(pose),
        )],
        ..Job::default()
    }
}

/// Somebody standing on the bed in a dark coat: legs, arms, trunk and head.
pub fn worker(track: &Track, s_m: f64, l_m: f64) -> Vec<Body> {
    let part = |shape: Shape, left_m: f64, up_m: f64, albedo: f64| {
        body(shape, on_bed(track, s_m, l_m + left_m, up_m), albedo)
    };
    vec![
        part(Shape::Capsule(0.09, 0.34), 0.12, 0.43, 0.1),
        part(Shape::Capsule(0.09, 0.34), -0.12, 0.43, 0.1),
        part(Shape::Capsule(0.19, 0.2), 0.0, 1.15, 0.4),
        part(Shape::Capsule(0.06, 0.26), 0.27, 1.12, 0.4),
        part(Shape::Capsule(0.06, 0.26), -0.27, 1.12, 0.4),
        part(Shape::Sphere(0.12), 0.0, 1.66, 0.5),
    ]
}

fn body(shape: Shape, world_from_body: Isometry3<f64>, albedo: f64) -> Body {
    Body {
        shape,
        world_from_body,
        velocity_mps: Vector3::zeros(),
        albedo,
        luminance_cd_m2: 0.0,
    }
}

/// A pose `up_m` above the bed, axes along the line.
pub fn on_bed(track: &Track, s_m: f64, l_m: f64, up_m: f64) -> Isometry3<f64> {
    let at = TrackPoint {
        s_m,
        l_m,
        h_m: BED_M + up_m,
    };
    Isometry3::from_parts(
        Translation3::from(track.alignment.world_from_track(at)),
        track.alignment.at(s_m).world_from_line().rotation,
    )
}

fn lamp_site(alignment: &Alignment, k: u16) -> LampSite {
    let s_m = FIRST_LAMP_M + LAMP_SPACING_M * f64::from(k);
    let (lateral_m, height_m) = (2.78, 3.25);
    // Turned 65 deg from lateral (to the right) towards trains coming up the line.
    let line = alignment.at(s_m).world_from_line();
    let (along, across) = 65f64.to_radians().sin_cos();
    LampSite {
        uid: Uid {
            line: 1,
            lamp: k + 1,
        },
        chainage_m: s_m,
        lateral_m,
        height_m,
        centre: alignment.world_from_track(TrackPoint {
            s_m,
            l_m: lateral_m,
            h_m: height_m,
        }),
        facing: Unit::new_normalize(line * Vector3::new(-along, -across, 0.0)),
        diameter_m: 0.25,
        power_w: 21.0,
        efficacy_lm_per_w: 100.0,
        beam_deg: 60.0,
        chip_s: 100e-6,
        code: LineCode::Manchester,
    }
}
