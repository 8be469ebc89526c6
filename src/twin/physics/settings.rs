//! What a scenario may say about train, track, obstacles and workers.

use super::defect::DefectSettings;
use super::irregularity::IrregularitySettings;
use super::obstacle::ObstacleSettings;
use super::worker::WorkerSettings;
use crate::track::{Checker, Problem, key_below};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Everything that moves, and the track under it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PhysicsSettings {
    /// Time step in seconds, a whole number of nanoseconds. The suspension is stable up to 2 ms.
    pub step_s: f64,
    /// How far back poses can be asked for, in seconds; at least the longest frame of any camera.
    pub history_s: f64,
    /// How even the track is.
    pub track: TrackSettings,
    /// The train, if there is one.
    pub train: Option<TrainSettings>,
    /// Things that lie or fall on the line.
    pub obstacles: Vec<ObstacleSettings>,
    /// People on the line.
    pub workers: Vec<WorkerSettings>,
}

impl Default for PhysicsSettings {
    fn default() -> Self {
        Self {
            step_s: 0.001,
            history_s: 0.5,
            track: TrackSettings::default(),
            train: Some(TrainSettings::default()),
            obstacles: Vec::new(),
            workers: Vec::new(),
        }
    }
}

impl PhysicsSettings {
    /// Appends what is wrong with these settings; `at` is the dotted key that leads here.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        let mut check = Checker::new(at, problems);
        check.within("step_s", self.step_s, 1e-4..=2e-3, "s");
        check.within("history_s", self.history_s, 0.01..=60.0, "s");
        self.track
            .irregularity
            .check(&key_below(at, "track.irregularity"), problems);
        for (k, defect) in self.track.defects.iter().enumerate() {
            defect.check(&key_below(at, &format!("track.defects[{k}]")), problems);
        }
        if let Some(train) = &self.train {
            train.check(&key_below(at, "train"), problems);
        }
        for (k, obstacle) in self.obstacles.iter().enumerate() {
            obstacle.check(&key_below(at, &format!("obstacles[{k}]")), problems);
        }
        for (k, worker) in self.workers.iter().enumerate() {
            worker.check(&key_below(at, &format!("workers[{k}]")), problems);
        }
    }
}

/// How even the track is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TrackSettings {
    /// Random deviation of the rails from their designed place.
    pub irregularity: IrregularitySettings,
    /// Joints, dipped welds, corrugation and other single defects.
    pub defects: Vec<DefectSettings>,
}

/// Whose masses, springs and dampers the cars have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum VehicleSet {
    /// A metro car of 34.5 t body mass (Shock and Vibration 2019, 2015465).
    #[default]
    Metro,
    /// Vehicle 1 of the Manchester benchmarks (Iwnicki 1998), a main-line coach; for validation.
    Manchester,
}

/// The train and how it is driven. The defaults are a B1 train of six cars, 118 m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TrainSettings {
    /// Whose masses, springs and dampers the cars have.
    pub vehicle: VehicleSet,
    /// Number of cars, 1 to 6.
    pub cars: u32,
    /// Length of a car over couplers, metres.
    pub car_length_m: f64,
    /// Width of a car, metres.
    pub width_m: f64,
    /// Height of a car's roof above top of rail, metres.
    pub height_m: f64,
    /// Chainage of the train head at the start, metres.
    pub start_chainage_m: f64,
    /// Speed at the start, km/h.
    pub start_speed_kmh: f64,
    /// The driver does not take power before this time, seconds.
    pub start_s: f64,
    /// Speed that the automatic driver aims at, km/h.
    pub cruise_speed_kmh: f64,
    /// Chainage where the train head shall stop, metres.
    pub stop_at_m: Option<f64>,
    /// Acceleration that the driver takes, m/s^2.
    pub accel_mps2: f64,
    /// Full service brake, m/s^2.
    pub service_brake_mps2: f64,
    /// Emergency brake, m/s^2.
    pub emergency_brake_mps2: f64,
    /// Most change of acceleration by driver and service brake, m/s^3.
    pub jerk_mps3: f64,
    /// From demand to the full service brake, seconds.
    pub service_build_up_s: f64,
    /// From demand to the full emergency brake, seconds.
    pub emergency_build_up_s: f64,
    /// Effect of the rotating parts as a share of the train's mass.
    pub rotating_mass_share: f64,
    /// Running resistance a + b v + c v^2 over mass: a in m/s^2.
    pub davis_a_mps2: f64,
    /// b in 1/s.
    pub davis_b_per_s: f64,
    /// c in 1/m.
    pub davis_c_per_m: f64,
    /// Intensity of each of the two headlights along their axis, candela.
    pub headlight_cd: f64,
}

impl Default for TrainSettings {
    fn default() -> Self {
        Self {
            vehicle: VehicleSet::Metro,
            cars: 6,
            car_length_m: 19.67,
            width_m: 2.8,
            height_m: 3.8,
            start_chainage_m: 150.0,
            start_speed_kmh: 0.0,
            start_s: 0.0,
            cruise_speed_kmh: 60.0,
            stop_at_m: None,
            accel_mps2: 1.0,
            service_brake_mps2: 1.0,
            emergency_brake_mps2: 1.3,
            jerk_mps3: 0.75,
            service_build_up_s: 1.0,
            emergency_build_up_s: 1.5,
            rotating_mass_share: 0.08,
            davis_a_mps2: 0.02,
            davis_b_per_s: 0.0,
            davis_c_per_m: 2.5e-5,
            headlight_cd: 40_000.0,
        }
    }
}

impl TrainSettings {
    /// Appends what is wrong with these settings; `at` is the dotted key that leads here.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        let mut check = Checker::new(at, problems);
        check.within("cars", f64::from(self.cars), 1.0..=6.0, "cars");
        // A car must hold two bogies 17.5 m (or 19 m) apart.
        check.within("car_length_m", self.car_length_m, 19.2..=30.0, "m");
        check.within("width_m", self.width_m, 2.0..=3.6, "m");
        check.within("height_m", self.height_m, 3.0..=5.0, "m");
        check.within("start_chainage_m", self.start_chainage_m, -1e6..=1e6, "m");
        check.within("start_speed_kmh", self.start_speed_kmh, 0.0..=160.0, "km/h");
        check.within("start_s", self.start_s, 0.0..=1e6, "s");
        check.within(
            "cruise_speed_kmh",
            self.cruise_speed_kmh,
            0.0..=160.0,
            "km/h",
        );
        if let Some(stop) = self.stop_at_m {
            check.within("stop_at_m", stop, self.start_chainage_m..=1e6, "m");
        }
        check.within("accel_mps2", self.accel_mps2, 0.05..=2.0, "m/s^2");
        check.within(
            "service_brake_mps2",
            self.service_brake_mps2,
            0.1..=2.5,
            "m/s^2",
        );
        check.within(
            "emergency_brake_mps2",
            self.emergency_brake_mps2,
            0.1..=3.0,
            "m/s^2",
        );
        check.within("jerk_mps3", self.jerk_mps3, 0.05..=10.0, "m/s^3");
        check.within(
            "service_build_up_s",
            self.service_build_up_s,
            0.0..=10.0,
            "s",
        );
        check.within(
            "emergency_build_up_s",
            self.emergency_build_up_s,
            0.0..=10.0,
            "s",
        );
        check.within(
            "rotating_mass_share",
            self.rotating_mass_share,
            0.0..=0.3,
            "",
        );
        check.within("davis_a_mps2", self.davis_a_mps2, 0.0..=1.0, "m/s^2");
        check.within("davis_b_per_s", self.davis_b_per_s, 0.0..=0.1, "1/s");
        check.within("davis_c_per_m", self.davis_c_per_m, 0.0..=0.01, "1/m");
        check.within("headlight_cd", self.headlight_cd, 0.0..=1e7, "cd");
    }
}
