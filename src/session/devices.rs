//! The wayside devices of a run: when they look, what they are given, what they send.
//!
//! The world is drawn and scanned through each device as it really hangs; the detector is given its
//! calibration.

use super::cameras::{Clock, Taken, wayside_view};
use super::score::{Presence, WaysideScore};
use super::watch::Stopwatch;
use crate::bus::{CameraHealth, Frame, LidarScan, SimTime, WaysideCalibration, WaysideReport};
use crate::scenario::{Scenario, WaysidePost};
use crate::stack::wayside::WaysideDetector;
use crate::track::{BED_M, Tunnel};
use crate::twin::comms::Comms;
use crate::twin::faults::{CameraTrouble, Grabber};
use crate::twin::physics::World;
use crate::twin::random::Stream;
use crate::twin::render::View;
use crate::twin::render::cpu::TunnelCaster;
use crate::twin::sensors::{AutoExposure, Lidar, Trigger, WaysideCameraSettings};
use image::GrayImage;
use nalgebra::Point3;
use std::sync::Arc;

/// One device: camera, lidar, and the box that looks at both.
pub struct Device {
    calibration: WaysideCalibration,
    outlook: Outlook,
    balise: String,
    camera: WaysideCameraSettings,
    exposure: AutoExposure,
    stream: Stream,
    trigger: Trigger,
    clock: Clock,
    trouble: CameraTrouble,
    grabber: Grabber,
    lidar: Option<(Lidar, Clock)>,
    scan: Option<LidarScan>,
    detector: WaysideDetector,
    score: WaysideScore,
}

/// What a device's frame shows, apart from the image.
pub struct Look {
    /// The latest scan that was complete when the last row closed.
    pub scan: Option<LidarScan>,
    /// All that was really there.
    pub present: Vec<Presence>,
}

impl Device {
    /// All devices of a scenario, with the map that they are given.
    pub fn all(scenario: &Scenario, map: &Arc<Tunnel>) -> Vec<Self> {
        let posts = scenario.wayside.iter();
        posts.map(|post| Self::new(scenario, post, map)).collect()
    }

    fn new(scenario: &Scenario, post: &WaysidePost, map: &Arc<Tunnel>) -> Self {
        let name = &post.calibration.name;
        let faults = &scenario.faults.cameras;
        let trouble = CameraTrouble::of(&[name], faults, scenario.seed);
        Self {
            calibration: post.calibration.clone(),
            outlook: Outlook::new(scenario, post),
            balise: post.balise.clone(),
            camera: post.camera.clone(),
            exposure: AutoExposure::of(
                &post.camera.exposure_control,
                post.camera.exposure_us,
                &post.camera.sensor,
            ),
            stream: Stream::new(scenario.seed, 0, &format!("wayside_camera/{name}")),
            trigger: Trigger::new(
                Stream::new(scenario.seed, 0, &format!("wayside_camera/{name}/trigger")),
                post.camera.frame_jitter_us,
            ),
            clock: Clock::new(post.camera.frames_per_s),
            grabber: Grabber::new(trouble.clone()),
            trouble,
            lidar: (post.lidar.as_ref().zip(post.actual.world_from_lidar)).map(
                |(settings, pose)| {
                    let stream = Stream::new(scenario.seed, 0, &format!("wayside_lidar/{name}"));
                    let lidar = Lidar::new(settings, &scenario.tunnel, &pose, stream);
                    let clock = Clock::new(1.0 / lidar.period_s());
                    (lidar, clock)
                },
            ),
            scan: None,
            detector: WaysideDetector::new(
                &scenario.stack.wayside,
                post.calibration.clone(),
                map.clone(),
            ),
            score: WaysideScore::new(
                scenario.tunnel.alignment.track_from_world(
                    &post.actual.world_from_camera.translation.vector.into(),
                    post.actual.chainage_m,
                ),
                post.actual.camera.intrinsics.height_px,
            ),
        }
    }

    /// A frame whose last row has closed by `now`, however long it was exposed, and that is not lost,
    /// with its view.
    pub fn due(&mut self, now: SimTime) -> Option<(Taken, View)> {
        let delay_s = self.outlook.span_s + self.trigger.latest_s();
        let (number, start) = self.clock.due(now, delay_s)?;
        if self.trouble.drops(number, start) {
            return None;
        }
        let mut view = wayside_view(
            &self.outlook.device,
            &self.camera,
            self.stream,
            number,
            self.trigger.really(number, start),
        );
        let with = self.exposure.expose(std::slice::from_mut(&mut view));
        let taken = Taken {
            number,
            start,
            with,
        };
        Some((taken, view))
    }

    /// The lidar's head turns at its own rate: takes the scan that is complete by now, if any.
    pub fn sweep(&mut self, world: &World) {
        let Some((lidar, clock)) = &mut self.lidar else {
            return;
        };
        if let Some((number, start)) = clock.due(world.time(), lidar.sweep_s()) {
            let mut bodies = world.bodies();
            bodies.extend(world.train_bodies());
            self.scan = Some(lidar.scan(start, number, world.time(), &bodies));
        }
    }

    /// By how much the images of a frame come late.
    pub fn late_s(&self, start: SimTime) -> f64 {
        self.trouble.late_s(start)
    }

    /// A frame as it is handed to the box. Exposure is set by what the sensor saw.
    pub fn frame(&mut self, taken: &Taken, image: GrayImage) -> Frame {
        self.exposure.on_image(&taken.with, &image);
        taken.frame(self.grabber.grab(taken.number, taken.start, image))
    }

    /// What goes with a frame that is complete now.
    pub fn look(&self, world: &World) -> Look {
        Look {
            scan: self.scan.clone(),
            present: self.outlook.present(world),
        }
    }

    /// The box looks at a frame and sends what it has to say.
    pub fn judge(
        &mut self,
        frame: &Frame,
        look: &Look,
        now: SimTime,
        comms: &mut Comms,
        watch: &mut Stopwatch,
    ) -> WaysideReport {
        let train = comms.train_report(now);
        let detector = &mut self.detector;
        let (report, seconds) = watch.time(|| detector.on_frame(frame, look.scan.as_ref(), train));
        self.score
            .report(&report, now, 1e3 * seconds, &look.present);
        if let Some(warning) = self.detector.message(&report) {
            comms.send(now, &self.balise, warning);
        }
        report
    }

    /// Time passes in the box; gives how its camera does where it has fallen silent.
    pub fn wait(&mut self, now: SimTime, comms: &mut Comms) -> Option<CameraHealth> {
        let train = comms.train_report(now);
        let report = self.detector.on_time(now, train)?;
        if let Some(warning) = self.detector.message(&report) {
            comms.send(now, &self.balise, warning);
        }
        Some(report.camera)
    }

    /// As surveyed.
    pub fn calibration(&self) -> &WaysideCalibration {
        &self.calibration
    }

    /// The scores.
    pub fn into_score(self) -> WaysideScore {
        self.score
    }
}

/// What a device can have in view: where it really hangs and looks, and the walls around it.
struct Outlook {
    device: WaysideCalibration,
    /// From the opening of a frame's first row to the closing of its last, at the longest.
    span_s: f64,
    reach_m: f64,
    walls: TunnelCaster,
    slab: usize,
}

impl Outlook {
    fn new(scenario: &Scenario, post: &WaysidePost) -> Self {
        let device = &post.actual;
        let walls = TunnelCaster::new(&scenario.tunnel);
        Self {
            slab: walls.slab_of(&device.world_from_camera.translation.vector.into(), None),
            device: device.clone(),
            span_s: post.camera.longest_span_s(),
            reach_m: scenario.stack.wayside.reach_m,
            walls,
        }
    }

    /// Whether a place is in the picture, within the detector's reach along the line, and not
    /// behind a wall. What moves in between does not matter.
    fn has_in_view(&self, place: &Point3<f64>, chainage_m: f64) -> bool {
        let camera = &self.device.camera.intrinsics;
        let pose = &self.device.world_from_camera;
        let pixel = camera.project(&pose.inverse_transform_point(place));
        let in_picture = pixel.is_some_and(|p| camera.contains(&p));
        let eye = Point3::from(pose.translation.vector);
        let sight = place - eye;
        in_picture
            && (chainage_m - self.device.chainage_m).abs() <= self.reach_m
            && self.walls.cast(self.slab, &eye, &sight, 1.0).is_none()
    }

    /// Everything that the device may rightly report.
    fn present(&self, world: &World) -> Vec<Presence> {
        let obstacles = world.obstacles().map(|o| Presence {
            name: o.name.to_owned(),
            size_m: o.size_m.max(),
            chainage_m: o.chainage_m,
            lateral_m: o.lateral_m,
            half_length_m: o.half_extents_m.x,
            half_width_m: o.half_extents_m.y,
            foot_m: o.height_m - o.half_extents_m.z - BED_M
                + (-o.velocity_mps.z * self.span_s).max(0.0),
            lies_in_view_since: o.resting_since.filter(|_| {
                self.has_in_view(&o.world_from_body.translation.vector.into(), o.chainage_m)
            }),
            obstacle: true,
        });
        let workers = world.workers().map(|w| Presence {
            name: w.name.to_owned(),
            size_m: w.stature_m,
            chainage_m: w.chainage_m,
            lateral_m: w.lateral_m,
            half_length_m: STRIDE_REACH_M,
            half_width_m: STRIDE_REACH_M,
            foot_m: 0.0,
            lies_in_view_since: None,
            obstacle: false,
        });
        let half = world.car_half_extents_m().unwrap_or_default();
        let own = world.head_m().zip(world.train_length_m());
        let trains = own.into_iter().chain(world.other_trains_m());
        let trains = trains.map(|(head_m, length_m)| Presence {
            name: "train".into(),
            size_m: length_m,
            chainage_m: head_m - 0.5 * length_m,
            lateral_m: 0.0,
            half_length_m: 0.5 * length_m,
            half_width_m: half.y,
            foot_m: 0.0,
            lies_in_view_since: None,
            obstacle: false,
        });
        obstacles.chain(workers).chain(trains).collect()
    }
}

/// How far a walking man's limbs reach from his middle.
const STRIDE_REACH_M: f64 = 0.4;

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::bus::TrainCommand;
    use crate::settings::read_toml;
    use crate::twin::sensors::ExposureMode;

    const TUNNEL: &str = include_str!("../../tunnels/chengdu_line1.toml");
    const SCENARIO: &str = r#"
        name = "post"
        tunnel = "given"
        [[wayside]]
        device = "W1530"
        lidar = { rate_hz = 4.0, step_deg = 5.0 }
        [wayside.camera]
        frames_per_s = 10.0
        calibration_error = { yaw_deg = 1.0 }
        [[obstacles]]
        name = "seen"
        chainage_m = 1505.0
        [[obstacles]]
        name = "behind the device"
        chainage_m = 1536.0
        [[obstacles]]
        name = "beyond its reach"
        chainage_m = 1440.0
    "#;

    fn post() -> (Scenario, World, Device) {
        let tunnel = Tunnel::from_toml(TUNNEL).unwrap();
        let scenario = Scenario::new(read_toml(SCENARIO).unwrap(), tunnel).unwrap();
        let world = World::new(scenario.tunnel.clone(), &scenario.physics, 1, 0).unwrap();
        let device = Device::all(&scenario, &scenario.map()).pop().unwrap();
        (scenario, world, device)
    }

    /// Fails where a scan is made for each frame instead of at the lidar's rate, or before the
    /// head has come round.
    #[test]
    fn the_lidar_turns_at_its_own_rate() {
        let (_, mut world, mut device) = post();
        let mut scans = Vec::new();
        let mut frames = 0;
        while world.time().secs() < 1.0 {
            world.step(&TrainCommand::default()).unwrap();
            device.sweep(&world);
            if device.due(world.time()).is_some() {
                frames += 1;
                let begun = device.look(&world).scan.map(|s| s.time);
                if begun != scans.last().copied() {
                    scans.extend(begun);
                }
            }
        }
        assert_eq!(frames, 10);
        let begun: Vec<_> = scans.into_iter().map(SimTime::secs).collect();
        // A sweep of 120 deg at 4 turns a second takes 83 ms: that begun at 0 is not complete when
        // the first frame closes, that begun at 0.75 s is when the last one does.
        assert_eq!(begun, [0.0, 0.25, 0.5, 0.75]);
    }

    /// Fails where a lengthened exposure is delivered before it is over.
    #[test]
    fn a_frame_is_due_when_its_longest_exposure_is_over() {
        let (mut scenario, ..) = post();
        let camera = &mut scenario.wayside[0].camera;
        camera.exposure_us = 1000.0;
        camera.exposure_control.mode = ExposureMode::Auto;
        camera.exposure_control.max_exposure_us = Some(50_000.0);
        let mut device = Device::all(&scenario, &scenario.map()).pop().unwrap();
        let span_s = 1079.0 * 14.8e-6 + 0.05;
        assert!(device.due(SimTime::from_secs(span_s - 1e-6)).is_none());
        let (taken, view) = device.due(SimTime::from_secs(span_s + 1e-6)).unwrap();
        assert!((taken.with.exposure_s - 1e-3).abs() < 1e-12);
        assert!((view.camera.shutter.exposure_s - 1e-3).abs() < 1e-12);
    }

    /// Fails where a device answers for what it cannot see, or the world is drawn through the
    /// calibration instead of the device.
    #[test]
    fn a_device_answers_for_what_it_has_in_view() {
        let (_, mut world, device) = post();
        while world.time().secs() < 2.0 {
            world.step(&TrainCommand::default()).unwrap();
        }
        let lying: Vec<_> = (device.look(&world).present.into_iter())
            .filter(|p| p.lies_in_view_since.is_some())
            .collect();
        assert_eq!(lying.len(), 1, "{lying:?}");
        assert_eq!(lying[0].name, "seen");
        // It fell from 0.67 m over the bed, and is still since it came to rest.
        let since_s = lying[0].lies_in_view_since.unwrap().secs();
        assert!((0.3..1.7).contains(&since_s), "{since_s}");
        let (is, said) = (&device.outlook.device, device.calibration());
        let turned = (is.world_from_camera.rotation).angle_to(&said.world_from_camera.rotation);
        assert!((turned - 1.0f64.to_radians()).abs() < 1e-9);
    }
}
