//! A scenario as written.

use super::RecordSettings;
use super::sampling::StudySettings;
use crate::stack::positioning::LedSettings;
use crate::stack::protection::ProtectionSettings;
use crate::stack::wayside::WaysideSettings;
use crate::track::Problem;
use crate::twin::air::AirSettings;
use crate::twin::comms::RadioSettings;
use crate::twin::faults::FaultSettings;
use crate::twin::physics::{
    CableSettings, ObstacleSettings, ObstacleShape, PhysicsSettings, TrackSettings, TrainSettings,
    WorkerSettings,
};
use crate::twin::sensors::{
    DopplerSettings, ImuSettings, LidarSettings, OdometerSettings, RigSettings,
    WaysideCameraSettings,
};
use crate::twin::survey::SurveySettings;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A metrotwin scenario: one run, said in full.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScenarioFile {
    /// Short name: letters, digits, `_` and `-`. Results go to `out/<name>` by default.
    pub name: String,
    /// What it shows, in a sentence or two. Default empty.
    #[serde(default)]
    pub description: String,
    /// Tunnel file; a relative path counts from this file's folder.
    pub tunnel: String,
    /// Everything random follows from it. Default 1.
    #[serde(default = "default_seed")]
    pub seed: u64,
    /// Simulated time, s. A bench run ends after its last point instead. Default 60.
    #[serde(default = "default_duration_s")]
    pub duration_s: f64,
    /// End earlier, once the train has run and then stood for this long, s. Default: never.
    #[serde(default)]
    pub stop_after_standstill_s: Option<f64>,
    /// Time step of the physics, s. Default 0.001.
    #[serde(default = "default_step_s")]
    pub step_s: f64,
    /// How well the lamps of the map that the stack is given were surveyed. Default: without
    /// error.
    #[serde(default)]
    pub survey: SurveySettings,
    /// How even the track is. Default: German spectra, low disturbance.
    #[serde(default)]
    pub track: TrackSettings,
    /// The train and how it is driven. Default: no train.
    #[serde(default)]
    pub train: Option<TrainSettings>,
    /// Other trains on the line, up to three: each with a driver of its own, whom nothing supervises.
    /// Default: none.
    #[serde(default)]
    pub other_trains: Vec<TrainSettings>,
    /// A still rig moved from point to point, in place of a train. Default: none.
    #[serde(default)]
    pub bench: Option<BenchSettings>,
    /// Things that lie or fall on the line. Default: none.
    #[serde(default)]
    pub obstacles: Vec<ObstacleSettings>,
    /// Cables that hang on the wall. Default: none.
    #[serde(default)]
    pub cables: Vec<CableSettings>,
    /// People on the line. Default: none.
    #[serde(default)]
    pub workers: Vec<WorkerSettings>,
    /// The stereo rig on the train head. Default: no rig, so no positioning by lamps.
    #[serde(default)]
    pub rig: Option<RigSettings>,
    /// The inertial unit on the train. Default: ADIS16488 class.
    #[serde(default)]
    pub imu: ImuSettings,
    /// The odometer on the train.
    #[serde(default)]
    pub odometer: OdometerSettings,
    /// A Doppler radar on the train. Default: none.
    #[serde(default)]
    pub doppler: Option<DopplerSettings>,
    /// Wayside devices in use, each at a place that the tunnel file names. Default: none.
    #[serde(default)]
    pub wayside: Vec<WaysidePostSettings>,
    /// The radio from wayside devices to the train.
    #[serde(default)]
    pub radio: RadioSettings,
    /// What one sees through. Default: clear air.
    #[serde(default)]
    pub air: AirSettings,
    /// Lamps and cameras that are out of order. Default: none.
    #[serde(default)]
    pub faults: FaultSettings,
    /// The stack: positioning, detection, protection.
    #[serde(default)]
    pub stack: StackSettings,
    /// What goes into the recording.
    #[serde(default)]
    pub record: RecordSettings,
    /// What varies from run to run, for `generate` and `study`. Default: nothing.
    #[serde(default)]
    pub study: Option<StudySettings>,
}

fn default_seed() -> u64 {
    1
}

fn default_duration_s() -> f64 {
    60.0
}

fn default_step_s() -> f64 {
    0.001
}

/// A wayside device in use.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WaysidePostSettings {
    /// Name of the device in the tunnel file, which says where it hangs and looks.
    pub device: String,
    /// Its camera. Default: 1920 x 1080, 10 frames a second.
    #[serde(default)]
    pub camera: WaysideCameraSettings,
    /// Its lidar. Default: none, the camera alone.
    #[serde(default)]
    pub lidar: Option<LidarSettings>,
}

/// The stack's own settings. They are what an engineer would commission the equipment with; the
/// world does not depend on them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StackSettings {
    /// Positioning by lamps, on the train.
    pub led: LedSettings,
    /// Obstacle detection, in every wayside device.
    pub wayside: WaysideSettings,
    /// Onboard warning and control.
    pub protection: ProtectionSettings,
    /// From the last row of a frame to the result, ms. Default 50.
    pub latency_ms: f64,
}

impl Default for StackSettings {
    fn default() -> Self {
        Self {
            led: LedSettings::default(),
            wayside: WaysideSettings::default(),
            protection: ProtectionSettings::default(),
            latency_ms: 50.0,
        }
    }
}

impl StackSettings {
    /// Appends what is wrong.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        self.led.check(&format!("{at}.led"), problems);
        self.wayside.check(&format!("{at}.wayside"), problems);
        self.protection.check(&format!("{at}.protection"), problems);
        let key = format!("{at}.latency_ms");
        Problem::unless_within(problems, key, self.latency_ms, 0.0..=5000.0, "ms");
    }
}

/// A static test: the rig stands at one point after the other and takes some fixes at each, as
/// in the paper's experiment (20 points 0.5 m apart, 10 fixes each).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BenchSettings {
    /// Number of points. Default 20.
    pub points: u32,
    /// Chainage of the train head at the first point, m. Default 0.
    pub first_m: f64,
    /// From point to point, m. Default 0.5.
    pub step_m: f64,
    /// Fixes to take at each point, or as many as 5 s yield. Default 10.
    pub fixes_per_point: u32,
}

impl Default for BenchSettings {
    fn default() -> Self {
        Self {
            points: 20,
            first_m: 0.0,
            step_m: 0.5,
            fixes_per_point: 10,
        }
    }
}

impl BenchSettings {
    /// Chainage of the head at each point, in order.
    pub fn heads_m(&self) -> impl Iterator<Item = f64> + use<> {
        let Self {
            first_m, step_m, ..
        } = *self;
        (0..self.points).map(move |k| first_m + f64::from(k) * step_m)
    }

    /// Time that all pairs of images take.
    pub fn duration_s(&self, pairs_per_s: f64) -> f64 {
        f64::from(self.points) * f64::from(self.fixes_per_point) / pairs_per_s
    }

    /// Appends what is wrong.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        let points = f64::from(self.points);
        let fixes = f64::from(self.fixes_per_point);
        Problem::unless_within(problems, format!("{at}.points"), points, 1.0..=1e5, "");
        Problem::unless_within(
            problems,
            format!("{at}.fixes_per_point"),
            fixes,
            1.0..=1e5,
            "",
        );
        Problem::unless_within(
            problems,
            format!("{at}.step_m"),
            self.step_m,
            -1e3..=1e3,
            "m",
        );
    }
}

impl ScenarioFile {
    /// Paths of the files that it names, as written.
    pub fn files_mut(&mut self) -> Vec<&mut String> {
        let trains = self.train.iter_mut().chain(&mut self.other_trains);
        let vehicles = trains
            .map(|train| &mut train.vehicle)
            .filter(|vehicle| Path::new(vehicle).extension().is_some());
        let loads = self.workers.iter_mut().filter_map(|w| w.carries.as_mut());
        let bodies = self.obstacles.iter_mut().map(|o| &mut o.body);
        let bodies = bodies.chain(loads.map(|load| &mut load.body));
        let meshes = bodies.filter_map(|body| match body {
            ObstacleShape::Mesh { file, .. } => Some(file),
            _ => None,
        });
        let tunnel = std::iter::once(&mut self.tunnel);
        tunnel.chain(vehicles).chain(meshes).collect()
    }

    /// What the physics is made from.
    pub(super) fn physics(&self) -> PhysicsSettings {
        PhysicsSettings {
            step_s: self.step_s,
            track: self.track.clone(),
            train: self.train.clone(),
            other_trains: self.other_trains.clone(),
            obstacles: self.obstacles.clone(),
            cables: self.cables.clone(),
            workers: self.workers.clone(),
            ..PhysicsSettings::default()
        }
    }
}
