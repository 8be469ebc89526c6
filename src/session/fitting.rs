//! What sensors and equipment trains and wayside posts carry, as the scenario has it.
//!
//! A sensor or an equipment of a new kind is one line here.
//!
#![doc = include_str!("../../docs/extending.md")]

use crate::bus::{Content, DopplerSample, ImuSample, Node, OdometerSample, TrainEnd, TrainId};
use crate::scenario::{OnboardEquipment, OnboardSettings, Scenario, WaysidePost};
use crate::stack::Equipment;
use crate::stack::occupancy::TrackOccupancy;
use crate::stack::positioning::{CabMount, LampPositioning};
use crate::stack::protection::TrainProtection;
use crate::stack::wayside::WaysideDetection;
use crate::track::Tunnel;
use crate::track::network::Route;
use crate::track::plan::PlanNetwork;
use crate::twin::physics::World;
use crate::twin::random::{Stream, branch};
use crate::twin::sensors::{
    BaliseAntenna, Doppler, Gnss, GnssSeeds, Imu, Lidar, MountedRadar, Odometer, Periodic, Radar,
    RadarSettings, Sensor, StereoCamera, WaysideCamera, WaysideLidar,
};
use std::sync::Arc;

/// A sensor at its node.
pub struct Mounted {
    /// Where it is.
    pub node: Node,
    /// The sensor.
    pub sensor: Box<dyn Sensor>,
}

/// A piece of equipment at its node.
pub struct Fitted {
    /// Where it is.
    pub node: Node,
    /// The equipment.
    pub equipment: Box<dyn Equipment>,
    /// It is the user's own, which the scenario does not know.
    pub is_added: bool,
}

/// Everything that senses and computes in a scenario.
#[derive(Default)]
pub struct Fitting {
    /// In the order in which they are sampled.
    pub sensors: Vec<Mounted>,
    /// In the order in which they work.
    pub equipment: Vec<Fitted>,
}

impl Fitting {
    /// Of all trains and posts of a scenario.
    pub fn new(scenario: &Scenario, world: &World) -> Self {
        let maps = Maps::new(scenario);
        let mut fitting = Self::default();
        for onboard in &scenario.onboard {
            fitting.add_train(scenario, onboard, world, &maps);
        }
        for post in &scenario.wayside {
            fitting.add_post(scenario, post, &maps);
        }
        fitting
    }

    /// A sensor of the user's own.
    pub fn add_sensor(&mut self, node: Node, sensor: impl Sensor + 'static) {
        let sensor = Box::new(sensor);
        self.sensors.push(Mounted { node, sensor });
    }

    /// A piece of equipment of the user's own.
    pub fn add_equipment(&mut self, node: Node, equipment: impl Equipment + 'static) {
        self.equipment.push(Fitted {
            node,
            equipment: Box::new(equipment),
            is_added: true,
        });
    }

    /// All nodes that have equipment, each once.
    pub fn nodes(&self) -> Vec<Node> {
        let mut nodes: Vec<Node> = self.equipment.iter().map(|e| e.node.clone()).collect();
        nodes.sort();
        nodes.dedup();
        nodes
    }

    fn add_train(
        &mut self,
        scenario: &Scenario,
        onboard: &OnboardSettings,
        world: &World,
        maps: &Maps,
    ) {
        let (train, seed) = (onboard.id(), train_seed(scenario.file.seed, onboard.id()));
        let node = Node::Train(train);
        if scenario.file.bench.is_none() {
            self.add_motion_sensors(onboard, &node, seed);
            let antenna = BaliseAntenna::new(train, world);
            self.add_sensor(node.clone(), antenna);
            if let Some((settings, datum)) = onboard.gnss.as_ref().zip(scenario.tunnel.datum) {
                let tracks = (scenario.tunnel.network.tracks.as_slice(), &datum);
                let seeds = GnssSeeds {
                    common: scenario.file.seed,
                    own: seed,
                };
                self.add_sensor(node.clone(), Gnss::new(settings, train, tracks, seeds));
            }
            self.add_radars(scenario, onboard, &node);
        }
        if let Some(rig) = &onboard.rig {
            let camera = StereoCamera::new(train, rig, &scenario.file.faults.cameras, seed);
            self.add_sensor(node.clone(), camera);
        }
        self.equipment.extend(onboard_equipment(onboard, maps));
    }

    fn add_motion_sensors(&mut self, onboard: &OnboardSettings, node: &Node, seed: u64) {
        let train = onboard.id();
        for (index, end) in (0..).zip(onboard.imu_ends()) {
            let mut imu = Imu::new(&onboard.imu, seed, index);
            let read = move |world: &World, time| {
                let sample = imu.sample(world, train, end)?;
                Some(Content::Imu(ImuSample { time, ..sample }))
            };
            let (rate_hz, clock) = (onboard.imu.rate_hz, onboard.imu.clock);
            self.add_sensor(node.clone(), Periodic::new(rate_hz, clock, read));
        }

        let mut odometer = Odometer::new(&onboard.odometer, seed, 0);
        let read = move |world: &World, time| {
            let sample = odometer.sample(world, train)?;
            Some(Content::Odometer(OdometerSample { time, ..sample }))
        };
        let (rate_hz, clock) = (onboard.odometer.rate_hz, onboard.odometer.clock);
        self.add_sensor(node.clone(), Periodic::new(rate_hz, clock, read));

        if let Some(settings) = &onboard.doppler {
            let mut doppler = Doppler::new(settings, seed, 0);
            let read = move |world: &World, time| {
                let sample = doppler.sample(world, train)?;
                Some(Content::Doppler(DopplerSample { time, ..sample }))
            };
            let radar = Periodic::new(settings.rate_hz, settings.clock, read);
            self.add_sensor(node.clone(), radar);
        }
    }

    fn add_radars(&mut self, scenario: &Scenario, onboard: &OnboardSettings, node: &Node) {
        let all: Vec<MountedRadar> = scenario
            .onboard
            .iter()
            .flat_map(|o| radars(scenario, o))
            .collect();
        let (tracks, air) = (&scenario.tunnel.network.tracks, scenario.file.air.air());
        for radar in radars(scenario, onboard) {
            self.add_sensor(node.clone(), Radar::new(radar, &all, tracks, &air));
        }
    }

    fn add_post(&mut self, scenario: &Scenario, post: &WaysidePost, maps: &Maps) {
        let name = &post.calibration.name;
        let node = Node::Post(name.clone());
        if let (Some(settings), Some(pose)) = (&post.lidar, post.actual.world_from_lidar) {
            let stream = Stream::new(scenario.file.seed, 0, &format!("wayside_lidar/{name}"));
            let lidar = Lidar::new(settings, &scenario.tunnel.network.tracks, &pose, stream);
            let delay_s = 1e-3 * scenario.file.stack.latency_ms;
            let lidar = WaysideLidar::new(lidar, delay_s);
            self.add_sensor(node.clone(), lidar);
        }
        let faults = &scenario.file.faults.cameras;
        let camera = WaysideCamera::new(&post.actual, &post.camera, faults, scenario.file.seed);
        self.add_sensor(node.clone(), camera);
        let (settings, calibration) = (&scenario.file.stack.wayside, post.calibration.clone());
        let map = maps.map.network.tracks[usize::from(calibration.track.0)].clone();
        let detection = WaysideDetection::new(settings, calibration, map);
        self.equipment.push(Fitted {
            node,
            equipment: Box::new(detection),
            is_added: false,
        });
    }
}

/// The equipment of a train.
pub fn onboard_equipment(onboard: &OnboardSettings, maps: &Maps) -> impl Iterator<Item = Fitted> {
    let kinds = onboard.equipment_kinds().into_iter();
    kinds.filter_map(|kind| one_of_onboard(kind, onboard, maps))
}

/// A piece of equipment of a train; `None` where the train lacks what it needs.
fn one_of_onboard(
    kind: OnboardEquipment,
    onboard: &OnboardSettings,
    maps: &Maps,
) -> Option<Fitted> {
    let node = Node::Train(onboard.id());
    let equipment: Box<dyn Equipment> = match kind {
        OnboardEquipment::Led => {
            let rig = onboard.rig.as_ref()?;
            let route = match rig.end {
                TrainEnd::Front => maps.route(onboard.id()),
                TrainEnd::Rear => maps.route(onboard.id()).reversed(),
            };
            let mount = CabMount::new(rig.end, route, onboard.protection.length_m());
            let (node, sheet, network) = (node.clone(), rig.calibration(), &maps.map.network);
            let led = &onboard.led;
            Box::new(LampPositioning::new(node, mount, led, sheet, network))
        }
        OnboardEquipment::Occupancy => {
            let (plan, node) = (maps.plan.clone()?, node.clone());
            let (network, settings) = (&maps.map.network, &onboard.occupancy);
            Box::new(TrackOccupancy::new(node, plan, network, settings))
        }
        OnboardEquipment::Protection => {
            let (node, settings) = (node.clone(), &onboard.protection);
            let (route, network) = (maps.route(onboard.id()), &maps.map.network);
            Box::new(TrainProtection::new(node, network, route, settings))
        }
    };
    Some(Fitted {
        node,
        equipment,
        is_added: false,
    })
}

/// The surveyed map, and the routes that trains are told to run.
pub struct Maps {
    map: Arc<Tunnel>,
    /// The tracks in plan, if a train's equipment needs them.
    plan: Option<Arc<PlanNetwork>>,
    routes: Vec<Route>,
}

impl Maps {
    /// Of a scenario.
    pub fn new(scenario: &Scenario) -> Self {
        Self {
            map: scenario.map(),
            plan: (scenario
                .onboard
                .iter()
                .any(OnboardSettings::tells_its_track))
            .then(|| Arc::new(scenario.plan())),
            routes: scenario
                .itineraries
                .iter()
                .map(|way| way.route.clone())
                .collect(),
        }
    }

    /// The route of a train.
    fn route(&self, train: TrainId) -> Route {
        self.routes[train.index()].clone()
    }
}

/// The radars of a train, each with the errors that follow from the scenario's seed.
pub fn radars(scenario: &Scenario, onboard: &OnboardSettings) -> Vec<MountedRadar> {
    let (train, seed) = (onboard.id(), train_seed(scenario.file.seed, onboard.id()));
    let at = |settings: &RadarSettings| {
        let ends = settings.ends.iter();
        let mounted = ends.map(|&end| MountedRadar {
            train,
            end,
            settings: settings.clone(),
            seed,
        });
        mounted.collect()
    };
    onboard.radar.as_ref().map_or_else(Vec::new, at)
}

/// What everything random on a train follows from: the scenario's seed for its first train.
pub fn train_seed(seed: u64, train: TrainId) -> u64 {
    if train == TrainId::default() {
        seed
    } else {
        branch(seed, &train.to_string())
    }
}

#[cfg(test)]
mod tests;
