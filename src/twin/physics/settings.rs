//! What a scenario may say about train, track, obstacles and workers.

use super::adhesion::{RailState, RailZone};
use super::cable_settings::CableSettings;
use super::defect::DefectSettings;
use super::irregularity::IrregularitySettings;
use super::obstacle::ObstacleSettings;
use super::stability::longest_step_s;
use super::vehicle::{AXLES, Vehicle};
use super::vehicle_file::VehicleFile;
use super::worker::WorkerSettings;
use crate::bus::TrainId;
use crate::track::{Checker, Direction, Problem, key_below};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Everything that moves, and the track under it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PhysicsSettings {
    /// Time step in seconds, a whole number of nanoseconds. Up to 2 ms, and as far
    /// as the train's springs and the rails bear it.
    pub step_s: f64,
    /// How far back poses can be asked for, in seconds; at least the longest frame of any camera.
    pub history_s: f64,
    /// How even the track is.
    pub track: TrackSettings,
    /// Trains, up to eight.
    pub trains: Vec<TrainSettings>,
    /// Surroundings that lie or fall on the line.
    pub obstacles: Vec<ObstacleSettings>,
    /// Cables that hang on the wall.
    pub cables: Vec<CableSettings>,
    /// People on the line.
    pub workers: Vec<WorkerSettings>,
}

impl Default for PhysicsSettings {
    fn default() -> Self {
        Self {
            step_s: 0.001,
            history_s: 0.5,
            track: TrackSettings::default(),
            trains: vec![TrainSettings::default()],
            obstacles: Vec::new(),
            cables: Vec::new(),
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
        self.track.check(&key_below(at, "track"), problems);
        let others = self.trains.len().saturating_sub(1) as f64;
        let most = TrainId::MOST as f64 - 1.0;
        Checker::new(at, problems).within("other_trains", others, 0.0..=most, "trains");
        for (k, train) in self.trains.iter().enumerate() {
            train.check(&key_below(at, &train_key(k)), problems);
        }
        self.check_step(at, problems);
        for (k, obstacle) in self.obstacles.iter().enumerate() {
            obstacle.check(&key_below(at, &format!("obstacles[{k}]")), problems);
        }
        for (k, cable) in self.cables.iter().enumerate() {
            cable.check(&key_below(at, &format!("cables[{k}]")), problems);
        }
        for (k, worker) in self.workers.iter().enumerate() {
            worker.check(&key_below(at, &format!("workers[{k}]")), problems);
        }
    }

    /// Whether the trains' springs, and the rails, bear the step.
    fn check_step(&self, at: &str, problems: &mut Vec<Problem>) {
        let support = self.track.support();
        for train in &self.trains {
            let (longest_s, what) = longest_step_s(&train.vehicle(), support);
            if self.step_s > longest_s {
                problems.push(Problem::new(
                    key_below(at, "step_s"),
                    format!(
                        "{what} of `{}` on rails of {} MN/m and {} kN s/m swings too fast for steps \
                         of {} ms",
                        train.vehicle,
                        self.track.support_mn_m,
                        self.track.support_kn_s_m,
                        1e3 * self.step_s
                    ),
                    format!("give at most {:.2} ms, or softer springs and rails", 1e3 * longest_s),
                ));
                return;
            }
        }
    }
}

/// Where a scenario has the train of a number.
pub fn train_key(number: usize) -> String {
    match number {
        0 => "train".to_owned(),
        _ => format!("other_trains[{}]", number - 1),
    }
}

/// A car of a train without a word about it.
const DEFAULT_VEHICLE: &str = "metro_b1_crush";

/// The track under the train: how even, how stiff, how slippery.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TrackSettings {
    /// Random deviation of the rails from their designed place.
    pub irregularity: IrregularitySettings,
    /// Joints, dipped welds, corrugation and other single defects.
    pub defects: Vec<DefectSettings>,
    /// Force under a wheel over what the rail gives, MN/m. Default 100: a 60 kg rail on fasteners
    /// of 40 kN/mm every 0.6 m.
    pub support_mn_m: f64,
    /// Damping of the same, kN s/m. Default 60: a tenth of critical.
    pub support_kn_s_m: f64,
    /// State of the rail heads along the line.
    pub rail: RailState,
    /// Stretches where it is another; the last one that covers a place counts.
    pub rail_zones: Vec<RailZone>,
}

impl Default for TrackSettings {
    fn default() -> Self {
        Self {
            irregularity: IrregularitySettings::default(),
            defects: Vec::new(),
            support_mn_m: 100.0,
            support_kn_s_m: 60.0,
            rail: RailState::Dry,
            rail_zones: Vec::new(),
        }
    }
}

impl TrackSettings {
    /// Stiffness (N/m) and damping (N s/m) of a rail under a wheel.
    pub(super) fn support(&self) -> (f64, f64) {
        (1e6 * self.support_mn_m, 1e3 * self.support_kn_s_m)
    }

    /// Appends what is wrong with these settings; `at` is the dotted key that leads here.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        let mut check = Checker::new(at, problems);
        check.within("support_mn_m", self.support_mn_m, 5.0..=500.0, "MN/m");
        check.within("support_kn_s_m", self.support_kn_s_m, 0.0..=300.0, "kN s/m");
        self.irregularity
            .check(&key_below(at, "irregularity"), problems);
        for (k, defect) in self.defects.iter().enumerate() {
            defect.check(&key_below(at, &format!("defects[{k}]")), problems);
        }
        for (k, zone) in self.rail_zones.iter().enumerate() {
            zone.check(&key_below(at, &format!("rail_zones[{k}]")), problems);
        }
    }
}

/// The train and how it is driven. The defaults are a B1 train of six cars, 118 m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TrainSettings {
    /// Dimensions, masses, springs and dampers of the cars: `metro_b1_empty`, `metro_b1_crush`,
    /// `manchester`, or the path of a vehicle file, counted from the scenario's folder.
    pub vehicle: String,
    /// The vehicle file, once it was read.
    #[serde(skip)]
    pub vehicle_file: Option<VehicleFile>,
    /// Number of cars, 1 to 8.
    pub cars: u32,
    /// Which way along the line it runs.
    pub direction: Direction,
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
    /// Running resistance a + b v + c v^2 over mass (rotating parts included): a in m/s^2.
    pub davis_a_mps2: f64,
    /// b in 1/s.
    pub davis_b_per_s: f64,
    /// c in the open, in 1/m.
    pub davis_c_per_m: f64,
    /// Times c in a tunnel, by the air that must get past the train.
    pub tunnel_factor: f64,
    /// Intensity of each of the two headlights along their axis, candela.
    pub headlight_cd: f64,
}

impl Default for TrainSettings {
    fn default() -> Self {
        Self {
            vehicle: DEFAULT_VEHICLE.to_owned(),
            vehicle_file: None,
            cars: 6,
            direction: Direction::Up,
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
            davis_a_mps2: 0.02,
            davis_b_per_s: 0.0,
            davis_c_per_m: 1.25e-5,
            tunnel_factor: 2.0,
            headlight_cd: 40_000.0,
        }
    }
}

impl TrainSettings {
    /// The car that was read, or comes with the program by this name.
    fn car(&self) -> Option<&VehicleFile> {
        (self.vehicle_file.as_ref()).or_else(|| VehicleFile::shipped(&self.vehicle))
    }

    /// The car in SI units. [`Self::check`] says where there is none; only until then it is the
    /// default one.
    pub(super) fn vehicle(&self) -> Vehicle {
        match self.car().or_else(|| VehicleFile::shipped(DEFAULT_VEHICLE)) {
            Some(file) => Vehicle::new(file),
            None => unreachable!("a test reads the vehicles that come with the program"),
        }
    }

    /// Mass of the train.
    pub fn mass_kg(&self) -> f64 {
        f64::from(self.cars) * self.vehicle().total_kg()
    }

    /// Wheelsets of the train.
    pub fn axles(&self) -> u32 {
        self.cars.saturating_mul(AXLES as u32)
    }

    /// Length of the train over couplers.
    pub fn length_m(&self) -> f64 {
        f64::from(self.cars) * self.vehicle().length_m
    }

    /// Appends what is wrong with these settings; `at` is the dotted key that leads here.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        if self.car().is_none() {
            problems.push(Problem::new(
                key_below(at, "vehicle"),
                format!("there is no vehicle {:?}", self.vehicle),
                format!(
                    "give one of {} or the path of a .toml file",
                    VehicleFile::shipped_names().join(", ")
                ),
            ));
        }
        let mut check = Checker::new(at, problems);
        check.within("cars", f64::from(self.cars), 1.0..=8.0, "cars");
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
            let ahead_m = match self.direction {
                Direction::Up => self.start_chainage_m..=1e6,
                Direction::Down => -1e6..=self.start_chainage_m,
            };
            check.within("stop_at_m", stop, ahead_m, "m");
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
        check.within("davis_a_mps2", self.davis_a_mps2, 0.0..=1.0, "m/s^2");
        check.within("davis_b_per_s", self.davis_b_per_s, 0.0..=0.1, "1/s");
        check.within("davis_c_per_m", self.davis_c_per_m, 0.0..=0.01, "1/m");
        check.within("tunnel_factor", self.tunnel_factor, 1.0..=10.0, "");
        check.within("headlight_cd", self.headlight_cd, 0.0..=1e7, "cd");
    }
}
