//! A scenario as written.

use super::RecordSettings;
use super::sampling::StudySettings;
use crate::settings::settings;
use crate::stack::led::LedSettings;
use crate::stack::occupancy::OccupancySettings;
use crate::stack::protection::ProtectionSettings;
use crate::stack::wayside::WaysideSettings;
use crate::twin::air::AirSettings;
use crate::twin::faults::FaultSettings;
use crate::twin::links::RadioSettings;
use crate::twin::physics::{
    CableSettings, InterlockingSettings, ObstacleSettings, ObstacleShape, PhysicsSettings, STEP_S,
    TrackSettings, TrainSettings, WorkerSettings, train_key,
};
use crate::twin::sensors::{
    CameraSettings, DopplerSettings, GnssSettings, ImuSettings, LidarSettings, OdometerSettings,
    RadarSettings, RigSettings,
};
use crate::twin::survey::SurveySettings;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

settings! {
    /// A metrotwin scenario: one run, said in full.
    pub struct ScenarioFile {
        /// Short name: letters, digits, `_` and `-`. Results go to `out/<name>` by default.
        name: String;
        /// What it shows, in a sentence or two. Default empty.
        #[serde(default)]
        description: String;
        /// Tunnel file; a relative path counts from this file's folder.
        tunnel: String;
        /// Everything random follows from it.
        #[serde(default = "crate::settings::one::<u64>")]
        seed: u64, in 0.0..=MOST_SEED;
        /// Simulated time, s. A bench run ends after its last point instead.
        #[serde(default = "default_duration_s")]
        duration_s: f64, in 1e-3..=LONGEST_RUN_S;
        /// End earlier, once the train has run and then stood for this long, s. Default: never.
        stop_after_standstill_s: Option<f64>, in 0.0..=86_400.0;
        /// Time step of the physics, s.
        #[serde(default = "default_step_s")]
        step_s: f64, in STEP_S;
        /// How well the lamps of the map that the stack is given were surveyed. Default: without
        /// error.
        #[serde(default)]
        survey: SurveySettings, nested;
        /// How even the track is. Default: German spectra, low disturbance.
        #[serde(default)]
        track: TrackSettings, nested;
        /// The train and how it is driven. Default: no train.
        train: Option<TrainSettings>, nested;
        /// Other trains on the line, up to seven: each with a driver of its own, whom nothing
        /// supervises but the equipment of `onboard`. Default: none.
        #[serde(default)]
        other_trains: Vec<TrainSettings>, nested;
        /// How switches are set. Default: for the routes of the trains, before each of them.
        #[serde(default)]
        interlocking: InterlockingSettings, nested;
        /// A still rig moved from point to point, in place of a train. Default: none.
        bench: Option<BenchSettings>, nested;
        /// Things that lie or fall on the line. Default: none.
        #[serde(default)]
        obstacles: Vec<ObstacleSettings>, nested;
        /// Cables that hang on the wall. Default: none.
        #[serde(default)]
        cables: Vec<CableSettings>, nested;
        /// People on the line. Default: none.
        #[serde(default)]
        workers: Vec<WorkerSettings>, nested;
        /// The stereo rig on the train head. Default: no rig, so no positioning by lamps.
        rig: Option<RigSettings>, nested;
        /// The inertial unit on the train, at the end where its rig is, or at the front; where track occupancy needs
        /// another one at the front, that is of the same kind. Default: ADIS16488 class.
        #[serde(default)]
        imu: ImuSettings, nested;
        /// The odometer on the train.
        #[serde(default)]
        odometer: OdometerSettings, nested;
        /// A Doppler radar on the train. Default: none.
        doppler: Option<DopplerSettings>, nested;
        /// A 77 GHz radar that looks along the track. Default: none.
        radar: Option<RadarSettings>, nested;
        /// A satellite receiver on the train. Default: none, so no track occupancy.
        gnss: Option<GnssSettings>, nested;
        /// Sensors and equipment of other trains. Default: none.
        #[serde(default)]
        onboard: Vec<OnboardSettings>, nested;
        /// Wayside devices in use, each at a place that the tunnel file names. Default: none.
        #[serde(default)]
        wayside: Vec<WaysidePostSettings>, nested;
        /// The radio from wayside devices to the train.
        #[serde(default)]
        radio: RadioSettings, nested;
        /// What one sees through. Default: clear air.
        #[serde(default)]
        air: AirSettings, nested;
        /// Lamps and cameras that are out of order. Default: none.
        #[serde(default)]
        faults: FaultSettings, nested;
        /// The stack: positioning, detection, protection.
        #[serde(default)]
        stack: StackSettings, nested;
        /// What goes into the recording.
        #[serde(default)]
        record: RecordSettings, nested;
        /// What varies from run to run, for `generate` and `study`. Default: nothing.
        study: Option<StudySettings>, nested;
    }
    also check_together
}

/// Whole numbers of a file, and of the tables that seeds stand in, reach little further.
pub const MOST_SEED: f64 = 9e18;
/// A day: what a line does repeats then.
pub(super) const LONGEST_RUN_S: f64 = 86_400.0;

fn default_duration_s() -> f64 {
    60.0
}

fn default_step_s() -> f64 {
    0.001
}

settings! {
    /// Sensors and equipment of one of the other trains; what is left out is as on the first train
    /// without a word about it.
    pub struct OnboardSettings {
        /// Which train: 1 is the first of `other_trains`.
        train: u8;
        /// Its stereo rig. Default: none.
        rig: Option<RigSettings>, nested;
        /// Its inertial unit.
        #[serde(default)]
        imu: ImuSettings, nested;
        /// Its odometer.
        #[serde(default)]
        odometer: OdometerSettings, nested;
        /// Its Doppler radar. Default: none.
        doppler: Option<DopplerSettings>, nested;
        /// Its 77 GHz radar. Default: none.
        radar: Option<RadarSettings>, nested;
        /// Its satellite receiver. Default: none.
        gnss: Option<GnssSettings>, nested;
        /// Its positioning by lamps.
        #[serde(default)]
        led: LedSettings, nested;
        /// Its track occupancy.
        #[serde(default)]
        occupancy: OccupancySettings, nested;
        /// Its warning and control.
        #[serde(default)]
        protection: ProtectionSettings, nested;
        /// Its equipment. Default: all that it has the sensors for.
        equipment: Option<Vec<OnboardEquipment>>;
    }
}

/// A kind of equipment of trains.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OnboardEquipment {
    /// Positioning by lamps; needs a rig.
    Led,
    /// On which track it is, by a satellite receiver; if named, by balises alone where there is none.
    Occupancy,
    /// Warning and control.
    Protection,
}

impl OnboardEquipment {
    /// In the order in which they work.
    pub const ALL: [Self; 3] = [Self::Led, Self::Occupancy, Self::Protection];
}

settings! {
    /// A wayside device in use.
    pub struct WaysidePostSettings {
        /// Name of the device in the tunnel file, which says where it hangs and looks.
        device: String;
        /// Its camera. Default: 1920 x 1080, 10 frames a second.
        #[serde(default)]
        camera: CameraSettings, nested;
        /// Its lidar. Default: none, the camera alone.
        lidar: Option<LidarSettings>, nested;
    }
}

settings! {
    /// The stack's own settings. They are what an engineer would commission the equipment with; the
    /// world does not depend on them.
    pub struct StackSettings {
        /// Positioning by lamps, on the train.
        led: LedSettings = LedSettings::default(), nested;
        /// Track occupancy, on the train.
        occupancy: OccupancySettings = OccupancySettings::default(), nested;
        /// Obstacle detection, in every wayside device.
        wayside: WaysideSettings = WaysideSettings::default(), nested;
        /// Onboard warning and control.
        protection: ProtectionSettings = ProtectionSettings::default(), nested;
        /// From the last row of a frame to the result, ms.
        latency_ms: f64 = 50.0, in 0.0..=5000.0;
        /// Equipment of the first train. Default: all that it has the sensors for.
        onboard: Option<Vec<OnboardEquipment>> = None;
    }
}

settings! {
    /// A static test: the rig stands at one point after the other and takes some fixes at each, as
    /// in the paper's experiment (20 points 0.5 m apart, 10 fixes each).
    #[derive(Copy)]
    pub struct BenchSettings {
        /// Number of points.
        points: u32 = 20, in 1.0..=1e5;
        /// Chainage of the train head at the first point, m.
        first_m: f64 = 0.0, in -1e6..=1e6;
        /// From point to point, m.
        step_m: f64 = 0.5, in -1e3..=1e3;
        /// Fixes to take at each point, or as many as 5 s yield.
        fixes_per_point: u32 = 10, in 1.0..=1e5;
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

    /// Chainage of the head at the last point.
    pub fn last_m(&self) -> f64 {
        self.first_m + f64::from(self.points.saturating_sub(1)) * self.step_m
    }

    /// Time that all pairs of images take.
    pub fn duration_s(&self, pairs_per_s: f64) -> f64 {
        f64::from(self.points) * f64::from(self.fixes_per_point) / pairs_per_s
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

    /// All trains, by number.
    pub(super) fn trains(&self) -> impl Iterator<Item = &TrainSettings> {
        self.train.iter().chain(&self.other_trains)
    }

    /// Key of the `k`-th of [`Self::trains`].
    pub(super) fn train_key(&self, k: usize) -> String {
        train_key(k + usize::from(self.train.is_none()))
    }

    /// What the physics is made from.
    pub(super) fn physics(&self) -> PhysicsSettings {
        PhysicsSettings {
            step_s: self.step_s,
            track: self.track.clone(),
            trains: self.trains().cloned().collect(),
            obstacles: self.obstacles.clone(),
            cables: self.cables.clone(),
            workers: self.workers.clone(),
            interlocking: self.interlocking.clone(),
            ..PhysicsSettings::default()
        }
    }
}
