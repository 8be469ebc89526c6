//! From a file to a checked scenario.

use super::file::{OnboardEquipment, OnboardSettings, ScenarioFile};
use super::meshes::read_meshes;
use super::parts::{Parts, all_errors, read};
use super::{Override, ScenarioError, check};
use crate::bus::{TrainEnd, TrainId, WaysideCalibration};
use crate::settings::{Checker, FileError, Problem, Settings, read_settings};
use crate::track::network::{Itinerary, Network};
use crate::track::plan::PlanNetwork;
use crate::track::{Direction, Place, Track, Tunnel};
use crate::twin::physics::{HISTORY_S, PhysicsSettings, TrainSettings};
use crate::twin::sensors::{CameraSettings, LidarSettings, RigSettings};
use std::path::Path;
use std::sync::Arc;

/// A scenario, checked and ready to run.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// As written, without its study; a bench run lasts until its last pair of images is taken.
    pub file: ScenarioFile,
    /// The line as it really is.
    pub tunnel: Arc<Tunnel>,
    /// Train, track, obstacles, workers.
    pub physics: PhysicsSettings,
    /// The ways of the trains by their numbers; of a bench, that of its rig.
    pub itineraries: Vec<Itinerary>,
    /// Sensors and equipment of the trains that have any, in the order of their numbers; of a bench,
    /// those of its rig.
    pub onboard: Vec<OnboardSettings>,
    /// Wayside devices in use.
    pub wayside: Vec<WaysidePost>,
}

impl OnboardSettings {
    /// Which train.
    pub fn id(&self) -> TrainId {
        TrainId(self.train)
    }

    /// Its equipment in the order in which it works: as named, or all that it has the sensors for.
    pub fn equipment_kinds(&self) -> Vec<OnboardEquipment> {
        let has_sensors = |kind: &OnboardEquipment| match kind {
            OnboardEquipment::Led => self.rig.is_some(),
            OnboardEquipment::Occupancy => self.gnss.is_some(),
            OnboardEquipment::Protection => true,
        };
        match &self.equipment {
            Some(named) => named.clone(),
            None => (OnboardEquipment::ALL.into_iter().filter(has_sensors)).collect(),
        }
    }

    /// It finds its position by lamps.
    pub fn positions(&self) -> bool {
        self.rig.is_some() && self.equipment_kinds().contains(&OnboardEquipment::Led)
    }

    /// The end at which its rig is.
    pub fn rig_end(&self) -> TrainEnd {
        self.rig.as_ref().map_or(TrainEnd::Front, |rig| rig.end)
    }

    /// The ends at which it has inertial units: that of its rig, and the front, whose turn track occupancy goes by.
    pub fn imu_ends(&self) -> Vec<TrainEnd> {
        match self.rig_end() {
            TrainEnd::Rear if self.tells_its_track() => vec![TrainEnd::Rear, TrainEnd::Front],
            end => vec![end],
        }
    }

    /// It says on which track it is.
    pub fn tells_its_track(&self) -> bool {
        self.equipment_kinds()
            .contains(&OnboardEquipment::Occupancy)
    }

    /// Its speed is supervised.
    pub fn protects(&self) -> bool {
        self.equipment_kinds()
            .contains(&OnboardEquipment::Protection)
    }

    /// Of the first train, or of a bench.
    fn first(file: &ScenarioFile) -> Self {
        Self {
            train: 0,
            rig: file.rig.clone(),
            imu: file.imu,
            odometer: file.odometer,
            doppler: file.doppler,
            radar: file.radar.clone(),
            gnss: file.gnss,
            led: file.stack.led.clone(),
            occupancy: file.stack.occupancy,
            protection: file.stack.protection.clone(),
            equipment: match file.bench {
                Some(_) => Some(vec![OnboardEquipment::Led]),
                None => file.stack.onboard.clone(),
            },
        }
    }

    /// Of all trains of a file.
    fn all(file: &ScenarioFile) -> Vec<Self> {
        let has_first = file.train.is_some() || file.bench.is_some();
        let first = has_first.then(|| Self::first(file));
        let others = file.onboard.iter().cloned();
        let mut all: Vec<Self> = first.into_iter().chain(others).collect();
        all.sort_by_key(|onboard| onboard.train);
        for onboard in &mut all {
            let number = onboard.train.into();
            let train = file.trains().nth(number);
            let protection = &mut onboard.protection;
            let length_m = train.map(TrainSettings::length_m);
            protection.train_length_m = protection.train_length_m.or(length_m);
            // A train that starts at speed has run before, and its equipment with it.
            let runs = train.is_some_and(|train| train.start_speed_kmh > 0.0);
            protection.starts_under_way.get_or_insert(runs);
        }
        all
    }
}

/// A wayside device in use, at its place.
#[derive(Clone, Debug, PartialEq)]
pub struct WaysidePost {
    /// As surveyed and calibrated.
    pub calibration: WaysideCalibration,
    /// As it really hangs and looks.
    pub actual: WaysideCalibration,
    /// Name of the balise that gets its messages.
    pub balise: String,
    /// Its camera's settings.
    pub camera: CameraSettings,
    /// Its lidar's settings.
    pub lidar: Option<LidarSettings>,
}

impl Scenario {
    /// Reads and checks a scenario file and the tunnel that it names.
    pub fn load(path: &Path, overrides: &[Override]) -> Result<Self, ScenarioError> {
        Self::from_text(path, &read(path)?, overrides)
    }

    /// As [`Self::load`], of a text already read; `path` is where relative paths count from.
    pub fn from_text(
        path: &Path,
        text: &str,
        overrides: &[Override],
    ) -> Result<Self, ScenarioError> {
        let wrong = |source| ScenarioError::File {
            path: path.to_owned(),
            text: text.to_owned(),
            overrides: overrides.to_vec(),
            source,
        };
        // The file must be right by itself, so that its errors are not taken for those
        // of the command line.
        let mut file: ScenarioFile = read_settings(text).map_err(wrong)?;
        if !overrides.is_empty() {
            file = overridden(path, text, overrides)?;
        }

        let mut parts = Parts::default();
        let folder = path.parent().unwrap_or(Path::new(""));
        parts.read_vehicles(&mut file, folder);
        read_meshes(&mut file, folder, &mut parts.problems);
        file.check("", &mut parts.problems);
        let tunnel = parts.read_tunnel(&file.tunnel, folder);
        let checked = match tunnel {
            Some(tunnel) => Self::in_tunnel(file, tunnel, parts.problems),
            None => Err(FileError::Problems(parts.problems)),
        };
        all_errors(checked.map_err(wrong), parts.wrong_files)
    }

    /// From a file's content and a tunnel that are at hand already; `file.tunnel` is not read.
    pub fn new(file: ScenarioFile, tunnel: Tunnel) -> Result<Self, FileError> {
        let mut problems = Vec::new();
        file.check("", &mut problems);
        Self::in_tunnel(file, tunnel, problems)
    }

    /// Sensors and equipment of the first train, or of a bench.
    pub fn first(&self) -> Option<&OnboardSettings> {
        self.onboard.first().filter(|onboard| onboard.train == 0)
    }

    /// The rig of the first train, or of a bench.
    pub fn rig(&self) -> Option<&RigSettings> {
        self.first()?.rig.as_ref()
    }

    /// The track along the way of a train.
    pub fn along(&self, train: TrainId) -> Option<Arc<Track>> {
        let way = self.itineraries.get(train.index())?;
        Some(self.tunnel.network.along(&way.route))
    }

    /// The track as the cab of a rig looks along it.
    pub fn seen_from_rig(&self, onboard: &OnboardSettings) -> Option<Arc<Track>> {
        let way = self.itineraries.get(onboard.id().index())?;
        let route = match onboard.rig_end() {
            TrainEnd::Front => way.route.clone(),
            TrainEnd::Rear => way.route.reversed(),
        };
        Some(self.tunnel.network.along(&route))
    }

    /// The map of the line that the stack is given: its lamps as surveyed, and the wayside devices that
    /// are in use.
    pub fn map(&self) -> Arc<Tunnel> {
        let mut map = self.file.survey.map(&self.tunnel, self.file.seed);
        let in_use = |name: &str| {
            self.wayside
                .iter()
                .any(|post| post.calibration.name == name)
        };
        for track in &mut map.network.tracks {
            Arc::make_mut(track)
                .wayside
                .retain(|site| in_use(&site.name));
        }
        Arc::new(map)
    }

    /// The tracks in plan that the stack is given.
    pub fn plan(&self) -> PlanNetwork {
        self.file.survey.plan(&self.tunnel, self.file.seed)
    }

    /// In its tunnel, unless there are problems already, or are then.
    fn in_tunnel(
        mut file: ScenarioFile,
        tunnel: Tunnel,
        mut problems: Vec<Problem>,
    ) -> Result<Self, FileError> {
        let mut check = Checker::new("", &mut problems);
        let wayside = check::in_tunnel(&file, &tunnel, &mut check);
        check_history(&file, &mut check);
        if !problems.is_empty() {
            return Err(FileError::Problems(problems));
        }
        let physics = PhysicsSettings {
            history_s: history_s(&file),
            ..file.physics()
        };
        let onboard = OnboardSettings::all(&file);
        let itineraries = itineraries(&file, &tunnel.network);
        if let (Some(bench), Some(rig)) = (&file.bench, &file.rig) {
            file.duration_s = bench.duration_s(rig.pairs_per_s);
        }
        file.study = None;
        Ok(Self {
            file,
            tunnel: Arc::new(tunnel),
            physics,
            itineraries,
            onboard,
            wayside,
        })
    }
}

/// Ways of all trains, which were checked; on a bench that of its rig.
fn itineraries(file: &ScenarioFile, network: &Network) -> Vec<Itinerary> {
    let trains = file
        .trains()
        .filter_map(|train| train.itinerary(network).ok());
    let bench = file.bench.iter().filter_map(|_| {
        let start = (Place::on_first_track(0.0), Direction::Up);
        network.itinerary(start, &[], None, 0.0)
    });
    trains.chain(bench).collect()
}

/// A file with some of its keys set anew.
pub(super) fn overridden(
    path: &Path,
    text: &str,
    overrides: &[Override],
) -> Result<ScenarioFile, ScenarioError> {
    let wrong = |source| ScenarioError::Overridden {
        path: path.to_owned(),
        overrides: overrides.to_vec(),
        source,
    };
    let syntax = |message: String| FileError::Syntax {
        message,
        span: None,
    };
    let mut document: toml::Table = text
        .parse()
        .map_err(|e: toml::de::Error| wrong(syntax(e.message().to_owned())))?;
    for change in overrides {
        change.apply(&mut document)?;
    }
    let text = toml::to_string(&document).map_err(|e| wrong(syntax(e.to_string())))?;
    read_settings(&text).map_err(wrong)
}

/// Frames, clocks and faults together must not be later than the world remembers.
fn check_history(file: &ScenarioFile, check: &mut Checker<'_>) {
    let (needed_s, longest_s) = (history_s(file), *HISTORY_S.end());
    if needed_s > longest_s {
        check.problem(
            "duration_s",
            format!(
                "by then images come {needed_s:.0} s after what they show, with long frames, slow \
                 clocks and late cameras together, and poses are kept for {longest_s} s"
            ),
            "give more frames a second, less clock.drift_ppm, or a shorter run",
        );
    }
}

/// Poses are asked for until the last row of a frame has closed.
fn history_s(file: &ScenarioFile) -> f64 {
    let others = file.onboard.iter().filter_map(|other| other.rig.as_ref());
    let spans = file.rig.iter().chain(others);
    // A clock that is slow stamps what was longer ago.
    let needed_s = |rig: &RigSettings| {
        let drift_s = 1e-6 * rig.clock.drift_ppm.abs() * file.duration_s;
        rig.as_built().pair_span_s() + 1e-3 * rig.clock.offset_ms.abs() + drift_s
    };
    let span_s = spans.fold(0.0, |s: f64, rig| s.max(needed_s(rig)));
    let late_s = file.faults.cameras.iter().map(|fault| fault.late_s());
    let latency_s = 1e-3 * file.stack.latency_ms + late_s.fold(0.0, f64::max);
    // A radar's frame is made when it is over.
    let others = file.onboard.iter().filter_map(|other| other.radar.as_ref());
    let radars = file.radar.iter().chain(others);
    let frame_s = radars.fold(0.0, |s: f64, radar| s.max(radar.frame_s()));
    // A fix is scored when it has gone through the stack.
    (2.0 * span_s + latency_s + 0.1)
        .max(2.0 * frame_s + 0.1)
        .max(PhysicsSettings::default().history_s)
}
