//! The wayside devices of a run: when they look, what they are given, what they send.

use super::cameras::{Clock, wayside_view};
use super::score::{Presence, WaysideScore};
use super::watch::Stopwatch;
use crate::bus::{Frame, LidarScan, SimTime, WaysideCalibration, WaysideReport};
use crate::scenario::{Scenario, WaysidePost};
use crate::stack::wayside::WaysideDetector;
use crate::twin::comms::Comms;
use crate::twin::physics::World;
use crate::twin::random::Stream;
use crate::twin::render::{SensorSettings, View};
use crate::twin::sensors::Lidar;

/// One device: camera, lidar, and the box that looks at both.
pub struct Device {
    calibration: WaysideCalibration,
    balise: String,
    sensor: SensorSettings,
    stream: Stream,
    clock: Clock,
    lidar: Option<Lidar>,
    detector: WaysideDetector,
    score: WaysideScore,
}

/// What a device's frame shows, apart from the image.
pub struct Look {
    /// Echoes taken with it.
    pub scan: Option<LidarScan>,
    /// All that was really there.
    pub present: Vec<Presence>,
}

impl Device {
    /// All devices of a scenario.
    pub fn all(scenario: &Scenario) -> Vec<Self> {
        scenario
            .wayside
            .iter()
            .map(|post| Self::new(scenario, post))
            .collect()
    }

    fn new(scenario: &Scenario, post: &WaysidePost) -> Self {
        let name = &post.calibration.name;
        Self {
            calibration: post.calibration.clone(),
            balise: post.balise.clone(),
            sensor: post.camera.sensor_behind_lens(),
            stream: Stream::new(scenario.seed, 0, &format!("wayside_camera/{name}")),
            clock: Clock::new(post.camera.frames_per_s),
            lidar: (post.lidar.as_ref().zip(post.calibration.world_from_lidar)).map(
                |(settings, pose)| {
                    let stream = Stream::new(scenario.seed, 0, &format!("wayside_lidar/{name}"));
                    Lidar::new(settings, &scenario.tunnel, &pose, stream)
                },
            ),
            detector: WaysideDetector::new(
                &scenario.stack.wayside,
                post.calibration.clone(),
                scenario.tunnel.clone(),
            ),
            score: WaysideScore::default(),
        }
    }

    /// A frame whose last row has closed by `now`: its number, start and view.
    pub fn due(&mut self, now: SimTime) -> Option<(u32, SimTime, View)> {
        let camera = self.calibration.camera;
        let span_s = camera.shutter.frame_span_s(camera.intrinsics.height_px);
        let (number, start) = self.clock.due(now, span_s)?;
        let view = wayside_view(&self.calibration, self.sensor, self.stream, number, start);
        Some((number, start, view))
    }

    /// Echoes and truth of the same moment.
    pub fn look(&self, world: &World, start: SimTime, number: u32) -> Look {
        let scan = self.lidar.as_ref().map(|lidar| {
            let mut bodies = world.bodies();
            bodies.extend(world.train_bodies());
            lidar.scan(start, number, world.time(), &bodies)
        });
        Look {
            scan,
            present: present(world),
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
        self.score.report(&report, 1e3 * seconds, &look.present);
        if let Some(warning) = self.detector.message(&report) {
            comms.send(now, &self.balise, warning);
        }
        report
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

/// Everything that a device may rightly report.
fn present(world: &World) -> Vec<Presence> {
    let obstacles = world.obstacles().map(|o| Presence {
        name: o.name.to_owned(),
        size_m: o.size_m.max(),
        chainage_m: o.chainage_m,
        half_length_m: 0.5 * o.size_m.x,
        at_rest: o.resting,
        obstacle: true,
    });
    let workers = world.workers().map(|w| Presence {
        name: w.name.to_owned(),
        size_m: w.stature_m,
        chainage_m: w.chainage_m,
        half_length_m: 0.4,
        at_rest: false,
        obstacle: false,
    });
    let train = (world.head_m().zip(world.train_length_m())).map(|(head_m, length_m)| Presence {
        name: "train".into(),
        size_m: length_m,
        chainage_m: head_m - 0.5 * length_m,
        half_length_m: 0.5 * length_m,
        at_rest: false,
        obstacle: false,
    });
    obstacles.chain(workers).chain(train).collect()
}
