//! What sessions ask of the world to score by.

use super::cable::{Cable, bounds};
use super::obstacle::Piece;
use super::thing::Thing;
use super::{WheelExtremes, World};
use crate::bus::SimTime;
use crate::track::Alignment;
use crate::twin::geometry::Body;
use nalgebra::{Isometry3, Point3, Vector3};
use rapier3d_f64::prelude::PhysicsWorld;

/// One obstacle as it really is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObstacleTruth<'a> {
    /// Name.
    pub name: &'a str,
    /// Length, width and height of its own box.
    pub size_m: Vector3<f64>,
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
    /// Where he is along the line.
    pub chainage_m: f64,
    /// Left of the centreline.
    pub lateral_m: f64,
}

/// Who a body belongs to. Numbers stay with their owner for a whole run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum BodyOwner {
    /// Something loose or fixed to the lining, in the order of appearance.
    Thing(usize),
    /// A cable.
    Cable(usize),
    /// A worker.
    Worker(usize),
    /// What a worker carries; put down, it is a thing.
    Load(usize),
    /// A car of a train, from its front. Train 0 is the scenario's own, 1 the first of the others.
    Car(usize, usize),
}

/// A body's owner and the name that the scenario gives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Belonging<'a> {
    /// Who it belongs to.
    pub owner: BodyOwner,
    /// Name.
    pub name: &'a str,
}

/// What has been still for this long rests.
const RESTING_S: f64 = 0.25;

impl World {
    /// Chainage of the train head now; `None` without a train.
    pub fn head_m(&self) -> Option<f64> {
        self.chainage_of(&self.vehicle_motion()?.world_from_vehicle)
    }

    /// Chainage of the train head at a time of the recent past.
    pub fn chainage_at(&self, time: SimTime) -> Option<f64> {
        self.chainage_of(&self.vehicle_at(time)?)
    }

    /// Length of the train over couplers; `None` without a train.
    pub fn train_length_m(&self) -> Option<f64> {
        Some(self.train.as_ref()?.consist.length_m())
    }

    /// Chainage of the head and length of every other train.
    pub fn other_trains_m(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.others.iter().filter_map(|train| {
            let pose = train.motion()?.world_from_vehicle;
            let head_m = train.chainage_m(&self.tunnel, &pose);
            Some((head_m, train.consist.length_m()))
        })
    }

    /// What the worst of the train's wheels has been through; `None` without a train.
    pub fn wheel_extremes(&self) -> Option<WheelExtremes> {
        let wheelsets = self.train.as_ref()?.consist.wheelsets.iter();
        wheelsets.map(|w| w.extremes).reduce(WheelExtremes::and)
    }

    /// Normal force of a wheel at rest; `None` without a train.
    pub fn wheel_load_n(&self) -> Option<f64> {
        Some(self.train.as_ref()?.consist.vehicle.wheel_load_n())
    }

    /// [`World::bodies`] and, where asked for, [`World::train_bodies`], each with its owner.
    pub fn owned_bodies(&self, with_train: bool) -> (Vec<Body>, Vec<Belonging<'_>>) {
        let (line, now_s) = (&self.tunnel.alignment, self.time.secs());
        let mut owned = self.things.draw_owned(&self.rapier, line, now_s);
        let others = self.others.iter().enumerate();
        let others = others.map(|(k, train)| (k + 1, train, self.things.train_name(k)));
        let own = self.train.iter().filter(|_| with_train);
        let own = own.map(|train| (0, train, "train"));
        for (number, train, name) in others.chain(own) {
            let cars = train.consist.boxes().count();
            for (k, body) in train.bodies().into_iter().enumerate() {
                // After the cars come the lenses on the leading one.
                let car = if k < cars { k } else { 0 };
                let owner = BodyOwner::Car(number, car);
                owned.push((body, Belonging { owner, name }));
            }
        }
        owned.into_iter().unzip()
    }

    fn chainage_of(&self, world_from_vehicle: &Isometry3<f64>) -> Option<f64> {
        let train = self.train.as_ref()?;
        Some(train.chainage_m(&self.tunnel, world_from_vehicle))
    }
}

fn resting(since: Option<SimTime>, now: SimTime) -> Option<SimTime> {
    since.filter(|since| now.since(*since) >= RESTING_S)
}

/// A thing as it lies, flies or swings.
pub(super) fn thing_truth<'a>(
    thing: &'a Thing,
    world: &PhysicsWorld,
    line: &Alignment,
    now: SimTime,
) -> Option<ObstacleTruth<'a>> {
    let (world_from_body, velocity_mps) = thing.state(world)?;
    let Piece { settings, body } = &thing.piece;
    let centre = world_from_body.translation.vector.into();
    let place = line.track_from_world(&centre, thing.near_m);
    let world_from_line = line.at(place.s_m).world_from_line().rotation;
    let body_from_line = world_from_body.rotation.inverse() * world_from_line;
    let half = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| {
        let axis = body_from_line * axis;
        body.reach_m(&axis).max(body.reach_m(&-axis))
    });
    Some(ObstacleTruth {
        name: &settings.name,
        size_m: 2.0 * body.half_extents_m(),
        chainage_m: place.s_m,
        lateral_m: place.l_m,
        height_m: place.h_m,
        half_extents_m: half.into(),
        world_from_body,
        velocity_mps,
        resting_since: resting(thing.rest.since, now),
        temperature_c: settings.temperature_c,
    })
}

/// A cable as the box around it.
pub(super) fn cable_truth<'a>(
    cable: &'a Cable,
    world: &PhysicsWorld,
    line: &Alignment,
    now: SimTime,
) -> Option<ObstacleTruth<'a>> {
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
        chainage_m: place.s_m,
        lateral_m: place.l_m,
        height_m: place.h_m,
        half_extents_m,
        world_from_body: Isometry3::from_parts(centre.into(), frame.rotation),
        velocity_mps: cable.velocity_mps(world),
        resting_since: resting(cable.rest.since, now),
        temperature_c: settings.temperature_c,
    })
}
