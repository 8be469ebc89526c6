//! What a scenario may say about train, track, obstacles and workers.

use super::adhesion::{RailState, RailZone};
use super::cable_settings::CableSettings;
use super::defect::DefectSettings;
use super::irregularity::IrregularitySettings;
use super::obstacle::ObstacleSettings;
use super::stability::longest_step_s;
use super::switches::InterlockingSettings;
use super::vehicle::{AXLES, Vehicle};
use super::vehicle_file::VehicleFile;
use super::worker::WorkerSettings;
use crate::bus::TrainId;
use crate::settings::{Checker, settings};
use crate::track::Direction;
use std::ops::RangeInclusive;

/// Time steps that can be asked for.
pub const STEP_S: RangeInclusive<f64> = 1e-4..=2e-3;

settings! {
    /// Everything that moves, and the track under it.
    pub struct PhysicsSettings {
        /// Time step in seconds, a whole number of nanoseconds. Up to 2 ms, and as far
        /// as the train's springs and the rails bear it.
        step_s: f64 = 0.001, in STEP_S;
        /// How far back poses can be asked for, in seconds; at least the longest frame of any
        /// camera.
        history_s: f64 = 0.5, in HISTORY_S;
        /// How even the track is.
        track: TrackSettings = TrackSettings::default(), nested;
        /// Trains, up to eight, by number.
        trains: Vec<TrainSettings> = vec![TrainSettings::default()], nested;
        /// Things that lie or fall on the line.
        obstacles: Vec<ObstacleSettings> = Vec::new(), nested;
        /// Cables that hang on the wall.
        cables: Vec<CableSettings> = Vec::new(), nested;
        /// People on the line.
        workers: Vec<WorkerSettings> = Vec::new(), nested;
        /// How switches are set.
        interlocking: InterlockingSettings = InterlockingSettings::default(), nested;
    }
    also check_together
}

impl PhysicsSettings {
    /// What the trains and the step say together.
    pub fn check_together(&self, check: &mut Checker<'_>) {
        let others = self.trains.len().saturating_sub(1) as f64;
        check.within("other_trains", others, 0.0..=TrainId::MOST as f64 - 1.0);
        self.check_step(check);
    }

    /// Whether the trains' springs, and the rails, bear the step.
    fn check_step(&self, check: &mut Checker<'_>) {
        let support = self.track.support();
        for train in &self.trains {
            let (longest_s, what) = longest_step_s(&train.vehicle(), support);
            if self.step_s > longest_s {
                check.problem(
                    "step_s",
                    format!(
                        "{what} of `{}` on rails of {} MN/m and {} kN s/m swings too fast for steps \
                         of {} ms",
                        train.vehicle,
                        self.track.support_mn_m,
                        self.track.support_kn_s_m,
                        1e3 * self.step_s
                    ),
                    format!("give at most {:.2} ms, or softer springs and rails", 1e3 * longest_s),
                );
                return;
            }
        }
    }
}

/// How long poses may be kept, s: of a minute they take some ten megabytes a car.
pub const HISTORY_S: RangeInclusive<f64> = 0.01..=60.0;

/// Where a scenario has the train of a number.
pub fn train_key(number: usize) -> String {
    match number {
        0 => "train".to_owned(),
        _ => format!("other_trains[{}]", number - 1),
    }
}

/// A car of a train without a word about it.
const DEFAULT_VEHICLE: &str = "metro_b1_crush";

settings! {
    /// The track under the train: how even, how stiff, how slippery.
    pub struct TrackSettings {
        /// Random deviation of the rails from their designed place.
        irregularity: IrregularitySettings = IrregularitySettings::default(), nested;
        /// Joints, dipped welds, corrugation and other single defects.
        defects: Vec<DefectSettings> = Vec::new(), nested;
        /// Force under a wheel over what the rail gives, MN/m. Default 100: a 60 kg rail on
        /// fasteners of 40 kN/mm every 0.6 m.
        support_mn_m: f64 = 100.0, in 5.0..=500.0;
        /// Damping of the same, kN s/m. Default 60: a tenth of critical.
        support_kn_s_m: f64 = 60.0, in 0.0..=300.0;
        /// State of the rail heads along the line.
        rail: RailState = RailState::Dry;
        /// Stretches where it is another; the last one that covers a place counts.
        rail_zones: Vec<RailZone> = Vec::new(), nested;
    }
}

impl TrackSettings {
    /// Stiffness (N/m) and damping (N s/m) of a rail under a wheel.
    pub(super) fn support(&self) -> (f64, f64) {
        (1e6 * self.support_mn_m, 1e3 * self.support_kn_s_m)
    }
}

settings! {
    /// The train and how it is driven. The defaults are a B1 train of six cars, 118 m.
    pub struct TrainSettings {
        /// Dimensions, masses, springs and dampers of the cars: `metro_b1_empty`, `metro_b1_crush`,
        /// `manchester`, or the path of a vehicle file, counted from the scenario's folder.
        vehicle: String = DEFAULT_VEHICLE.to_owned();
        /// The vehicle file, once it was read.
        #[serde(skip)]
        vehicle_file: Option<VehicleFile> = None;
        /// Number of cars, 1 to 8.
        cars: u32 = 6, in 1.0..=8.0;
        /// Which way along the line it runs.
        direction: Direction = Direction::Up;
        /// Name of the track on which it starts. Default: the tunnel's first.
        start_track: Option<String> = None;
        /// Chainage of the train head at the start, metres.
        start_chainage_m: f64 = 150.0, in -1e6..=1e6;
        /// Speed at the start, km/h.
        start_speed_kmh: f64 = 0.0, in 0.0..=160.0;
        /// The driver does not take power before this time, seconds.
        start_s: f64 = 0.0, in 0.0..=1e6;
        /// After an emergency brake the driver starts again this long after the train stands and the
        /// emergency brake is no longer demanded, seconds: he must ask for leave.
        restart_after_s: f64 = 60.0, in 0.0..=1e6;
        /// Speed that the automatic driver aims at, km/h.
        cruise_speed_kmh: f64 = 60.0, in 0.0..=160.0;
        /// Names of tracks that it runs over on its way, and of stations at which it stops; from each to the
        /// next it takes the shortest way.
        via: Vec<String> = Vec::new();
        /// How long it stands at each station of `via`, seconds.
        dwell_s: f64 = 20.0, in 0.0..=1e6;
        /// Name of the track on which it stops. Default: the last of `via`, or that on which it starts.
        stop_track: Option<String> = None;
        /// Chainage where the train head shall stop, metres.
        stop_at_m: Option<f64> = None, in -1e6..=1e6;
        /// Acceleration that the driver takes, m/s^2.
        accel_mps2: f64 = 1.0, in 0.05..=2.0;
        /// Full service brake, m/s^2.
        service_brake_mps2: f64 = 1.0, in 0.1..=2.5;
        /// Emergency brake, m/s^2.
        emergency_brake_mps2: f64 = 1.3, in 0.1..=3.0;
        /// Most change of acceleration by driver and service brake, m/s^3.
        jerk_mps3: f64 = 0.75, in 0.05..=10.0;
        /// From demand to the full service brake, seconds.
        service_build_up_s: f64 = 1.0, in 0.0..=10.0;
        /// From demand to the full emergency brake, seconds.
        emergency_build_up_s: f64 = 1.5, in 0.0..=10.0;
        /// Running resistance a + b v + c v^2 over mass (rotating parts included): a in m/s^2.
        davis_a_mps2: f64 = 0.02, in 0.0..=1.0;
        /// b in 1/s.
        davis_b_per_s: f64 = 0.0, in 0.0..=0.1;
        /// c in the open, in 1/m.
        davis_c_per_m: f64 = 1.25e-5, in 0.0..=0.01;
        /// Times c in a tunnel, by the air that must get past the train.
        tunnel_factor: f64 = 2.0, in 1.0..=10.0;
        /// Intensity of each of the two headlights along their axis, candela.
        headlight_cd: f64 = 40_000.0, in 0.0..=1e7;
    }
    also check_together
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

    /// Width and height of its cars over top of rail.
    pub fn profile_m(&self) -> [f64; 2] {
        let vehicle = self.vehicle();
        [vehicle.width_m, vehicle.height_m]
    }

    fn check_together(&self, check: &mut Checker<'_>) {
        if self.car().is_none() {
            check.problem(
                "vehicle",
                format!("there is no vehicle {:?}", self.vehicle),
                format!(
                    "give one of {} or the path of a .toml file",
                    VehicleFile::shipped_names().join(", ")
                ),
            );
        }
        let (start_m, way) = (self.start_chainage_m, self.direction);
        let one_track = self.via.is_empty()
            && (self.stop_track.is_none() || self.stop_track == self.start_track);
        let is_behind = |stop_m: &f64| one_track && way.ahead_m(start_m, *stop_m) < 0.0;
        if let Some(stop_m) = self.stop_at_m.filter(is_behind) {
            check.problem(
                "stop_at_m",
                format!(
                    "{stop_m} m lies behind the head of the train, which runs {way} the line from {start_m} m"
                ),
                format!("give {start_m} m, or a place further {way} the line"),
            );
        }
    }
}
