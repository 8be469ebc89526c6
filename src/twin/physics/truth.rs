//! What sessions ask of the world to score by.

use super::cable::{Cable, bounds};
use super::obstacle::{ObstacleSettings, SingleObstacle};
use super::obstacle_body::{ObstacleBody, Rest};
use super::walker::Walker;
use super::{Impact, ObstacleMaterial, World};
use crate::bus::{SimTime, TrainId};
use crate::track::TrackId;
use crate::twin::geometry::Body;
use nalgebra::{Isometry3, Point3, Vector3};

/// One obstacle as it really is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObstacleTruth<'a> {
    /// Name.
    pub name: &'a str,
    /// Length, width and height of its own box.
    pub size_m: Vector3<f64>,
    /// The track that it is on, or beside.
    pub track: TrackId,
    /// Chainage of its centre.
    pub chainage_m: f64,
    /// Its centre, left of the centreline.
    pub lateral_m: f64,
    /// Its centre, above top of rail.
    pub height_m: f64,
    /// Half of what it extends along the line, across and up, turned as it is.
    pub half_extents_m: Vector3<f64>,
    /// Pose of its centre.
    pub world_from_body: Isometry3<f64>,
    /// Velocity of its centre, in the world's axes.
    pub velocity_mps: Vector3<f64>,
    /// Since when it lies still; `None` while it moves.
    pub resting_since: Option<SimTime>,
    /// Temperature of its surface, degrees Celsius.
    pub temperature_c: f64,
}

/// One worker as he really is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkerTruth<'a> {
    /// Name.
    pub name: &'a str,
    /// Height of the body.
    pub stature_m: f64,
    /// The track that he is on, or beside.
    pub track: TrackId,
    /// Where he is along it.
    pub chainage_m: f64,
    /// Left of the centreline.
    pub lateral_m: f64,
}

/// What a body belongs to. Numbers stay with their owner for a whole run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum BodyOwner {
    /// An obstacle, loose or fixed to the lining, in the order of appearance.
    Obstacle(usize),
    /// A cable.
    Cable(usize),
    /// A worker.
    Worker(usize),
    /// What a worker carries; put down, it is an obstacle.
    Load(usize),
    /// A car of a train, from its front.
    Car(TrainId, usize),
    /// The blades of a switch, by its number.
    Blade(usize),
}

/// A body's owner and the name that the scenario gives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BodyLabel<'a> {
    /// What it belongs to.
    pub owner: BodyOwner,
    /// Name.
    pub name: &'a str,
}

/// What has been still for this long rests.
const RESTING_S: f64 = 0.25;

impl World {
    /// All bodies that are there now, to draw, but for those of one train: a camera does not see the
    /// train that carries it.
    pub fn bodies(&self, without: Option<TrainId>) -> Vec<Body> {
        self.owned_bodies(without).0
    }

    /// [`World::bodies`], each with its label.
    pub fn owned_bodies(&self, without: Option<TrainId>) -> (Vec<Body>, Vec<BodyLabel<'_>>) {
        let (network, now_s) = (&self.tunnel.network, self.time.secs());
        let mut owned = self.surroundings.draw(&self.rapier, network, now_s);
        // The order may decide pixels: the first train comes last.
        let trains = self.trains.iter().skip(1).chain(self.trains.first());
        for train in trains.filter(|train| Some(train.consist.id) != without) {
            let id = train.consist.id;
            let name = self.surroundings.train_name(id);
            let cars = train.consist.boxes().count();
            for (k, body) in train.bodies().into_iter().enumerate() {
                // After the cars come the lenses on the leading one.
                let car = if k < cars { k } else { 0 };
                let owner = BodyOwner::Car(id, car);
                owned.push((body, BodyLabel { owner, name }));
            }
        }
        owned.into_iter().unzip()
    }

    /// The blades of all switches, or of those within a distance of a place, each with its label.
    pub fn blades(&self, near: Option<(&[Point3<f64>], f64)>) -> (Vec<Body>, Vec<BodyLabel<'_>>) {
        let is_near = |tip: &Point3<f64>| {
            near.is_none_or(|(places, away_m)| places.iter().any(|p| (tip - p).norm() < away_m))
        };
        let switches = self.tunnel.network.switches.iter().zip(&self.blades);
        let drawn = switches.enumerate().filter_map(|(k, (switch, blades))| {
            let blades = blades.as_ref().filter(|blades| is_near(&blades.tip))?;
            let (owner, name) = (BodyOwner::Blade(k), switch.name.as_str());
            let bodies = blades.bodies(self.switch_share(k));
            Some(bodies.map(move |body| (body, BodyLabel { owner, name })))
        });
        drawn.flatten().unzip()
    }

    /// Obstacles that are there now: what lies, falls or swings. What is still fixed to the lining
    /// is none.
    pub fn obstacles(&self) -> impl Iterator<Item = ObstacleTruth<'_>> {
        let around = &self.surroundings;
        let loose = around.obstacles.iter().flatten().filter(|o| !o.fixed());
        let fallen = around.cables.iter().filter(|cable| cable.loose());
        let loose = loose.filter_map(|obstacle| self.obstacle_truth(obstacle));
        loose.chain(fallen.filter_map(|cable| self.cable_truth(cable)))
    }

    /// What an obstacle or a load is made of; all else is metal.
    pub fn material(&self, owner: BodyOwner) -> ObstacleMaterial {
        let around = &self.surroundings;
        let settings = match owner {
            BodyOwner::Obstacle(k) => {
                let obstacle = around.obstacles.get(k).and_then(Option::as_ref);
                obstacle.map(|obstacle| &obstacle.piece.settings)
            }
            BodyOwner::Load(k) => around.walkers.get(k).and_then(Walker::carries),
            _ => None,
        };
        settings.map_or(ObstacleMaterial::Metal, ObstacleSettings::made_of)
    }

    /// Workers who are on the line now.
    pub fn workers(&self) -> impl Iterator<Item = WorkerTruth<'_>> {
        let now_s = self.time.secs();
        self.surroundings.walkers.iter().filter_map(move |walker| {
            let line = self.tunnel.network.alignment(walker.track)?;
            let (chainage_m, lateral_m) = walker.place_m(&self.rapier, line, now_s)?;
            Some(WorkerTruth {
                name: &walker.settings.name,
                stature_m: walker.settings.stature_m,
                track: walker.track,
                chainage_m,
                lateral_m,
            })
        })
    }

    /// Hits of trains on obstacles, cables, workers and other trains, in order of time; the first
    /// thousand. Where two trains hit each other, each of them has its own.
    pub fn impacts(&self) -> &[Impact] {
        &self.surroundings.impacts.list
    }

    fn resting(&self, rest: Rest) -> Option<SimTime> {
        rest.since
            .filter(|since| self.time.since(*since) >= RESTING_S)
    }

    /// An obstacle as it lies, flies or swings.
    fn obstacle_truth<'a>(&self, obstacle: &'a ObstacleBody) -> Option<ObstacleTruth<'a>> {
        let line = self.tunnel.network.alignment(obstacle.track)?;
        let (world_from_body, velocity_mps) = obstacle.state(&self.rapier)?;
        let SingleObstacle { settings, body } = &obstacle.piece;
        let centre = world_from_body.translation.vector.into();
        let place = line.track_from_world(&centre, obstacle.near_m);
        let world_from_line = line.at(place.s_m).world_from_line().rotation;
        let body_from_line = world_from_body.rotation.inverse() * world_from_line;
        let half = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| {
            let axis = body_from_line * axis;
            body.reach_m(&axis).max(body.reach_m(&-axis))
        });
        Some(ObstacleTruth {
            name: &settings.name,
            size_m: 2.0 * body.half_extents_m(),
            track: obstacle.track,
            chainage_m: place.s_m,
            lateral_m: place.l_m,
            height_m: place.h_m,
            half_extents_m: half.into(),
            world_from_body,
            velocity_mps,
            resting_since: self.resting(obstacle.rest),
            temperature_c: settings.temperature_c,
        })
    }

    /// A cable as the box around it.
    fn cable_truth<'a>(&self, cable: &'a Cable) -> Option<ObstacleTruth<'a>> {
        let line = self.tunnel.network.alignment(cable.track)?;
        let world = &self.rapier;
        let settings = &cable.settings;
        let middle = cable.ends(world).flatten().map(|p| p.coords);
        let middle = middle.sum::<Vector3<f64>>() / (2.0 * cable.links.len() as f64);
        let s_m = line
            .track_from_world(&Point3::from(middle), cable.near_m)
            .s_m;
        let frame = line.at(s_m).world_from_line();
        let [low, high] = bounds(cable.ends(world).flatten(), &frame.inverse())?;
        let half_extents_m = 0.5 * (high - low).add_scalar(settings.diameter_m);
        let centre = frame * Point3::from(0.5 * (low + high));
        let place = line.track_from_world(&centre, s_m);
        Some(ObstacleTruth {
            name: &settings.name,
            size_m: 2.0 * half_extents_m,
            track: cable.track,
            chainage_m: place.s_m,
            lateral_m: place.l_m,
            height_m: place.h_m,
            half_extents_m,
            world_from_body: Isometry3::from_parts(centre.into(), frame.rotation),
            velocity_mps: cable.velocity_mps(world),
            resting_since: self.resting(cable.rest),
            temperature_c: settings.temperature_c,
        })
    }
}
