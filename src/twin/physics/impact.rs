//! What happens when a train hits something: momentum, energy, damage. Where two trains hit each
//! other, each of them has its own record.
//!
//! The solver's impulse J (along the normals; friction is left out) acts on the thing at the
//! contact, and -J on the train. With u the velocity of the thing's point against the train's,
//! before and after, both together lose -J (u_before + u_after) / 2: exact for rigid bodies,
//! spinning or not, on springs or not. A hit lasts until the train has left the thing, 50 ms at
//! most: what is pushed along after that is no blow any more.

use super::damage::Damage;
use super::entity::Entity;
use super::placement::BODIES;
use super::train::Train;
use crate::bus::{SimTime, TrainId};
use rapier3d_f64::geometry::ContactPair;
use rapier3d_f64::math::Vector;
use rapier3d_f64::prelude::{ColliderHandle, PhysicsWorld, RigidBodyHandle};
use schemars::JsonSchema;
use serde::{Serialize, Serializer};

/// One hit of a train on something.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Impact {
    /// The train. Files list hits by train.
    #[serde(skip)]
    pub train: TrainId,
    /// When it began; seconds in files.
    #[serde(rename = "time_s", serialize_with = "seconds")]
    #[schemars(with = "f64")]
    pub time: SimTime,
    /// Name of what was hit.
    pub with: String,
    /// Speed of the train against it just before, at the point of contact.
    pub speed_mps: f64,
    /// Momentum that it took from the train.
    pub momentum_n_s: f64,
    /// Kinetic energy that it had, seen from the train, just before.
    pub energy_j: f64,
    /// Kinetic energy that both lost.
    pub energy_lost_j: f64,
    /// What that does to the train.
    pub damage: Damage,
}

fn seconds<S: Serializer>(time: &SimTime, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_f64(time.secs())
}

/// After this, a hit is over.
const BLOW_S: f64 = 0.05;
/// A contact that has been lost for this long is over.
const GAP_S: f64 = 0.1;
/// What the train touches again slower than this, it pushes along.
const AGAIN_MPS: f64 = 0.5;
/// Hits that are kept.
const MOST: usize = 1000;

/// Motion of a body.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Motion {
    pub linear: Vector,
    pub angular: Vector,
}

impl Motion {
    pub(super) fn of(world: &PhysicsWorld, body: RigidBodyHandle) -> Self {
        let body = world.bodies.get(body).filter(|body| !body.is_sleeping());
        body.map_or(Self::default(), |body| Self {
            linear: body.linvel(),
            angular: body.angvel(),
        })
    }

    fn at(&self, arm: Vector) -> Vector {
        self.linear + self.angular.cross(arm)
    }
}

/// The box of a car, which things can hit.
#[derive(Clone)]
struct CarBox {
    train: TrainId,
    collider: ColliderHandle,
    body: RigidBodyHandle,
    before: Motion,
}

/// What a train is in touch with.
#[derive(Clone)]
struct Touch {
    train: TrainId,
    with: Entity,
    /// Which hit, unless that was too slow or too late to be kept.
    impact: Option<usize>,
    since: SimTime,
    last: SimTime,
    momentum: Vector,
    /// Bodies of it that have been hit.
    bodies: Vec<RigidBodyHandle>,
}

/// One contact of a car in one step.
pub(super) struct Hit {
    /// What was hit.
    pub with: Entity,
    /// With force, not by its touch alone.
    pub force: bool,
    body: RigidBodyHandle,
    car: usize,
    pair: Vec<Push>,
}

/// Impulse on a thing at one point of contact, with the arms from both bodies' centres.
struct Push {
    impulse: Vector,
    arm: Vector,
    train_arm: Vector,
}

/// All hits so far.
#[derive(Clone, Default)]
pub(super) struct Impacts {
    cars: Vec<CarBox>,
    /// Of the trains.
    masses_kg: Vec<f64>,
    touches: Vec<Touch>,
    pub list: Vec<Impact>,
}

impl Impacts {
    /// Of trains that are in the world already.
    pub(super) fn new(trains: &[Train]) -> Self {
        let cars = trains.iter().flat_map(|train| {
            let consist = &train.consist;
            let bodies = consist.handles.iter().step_by(BODIES);
            bodies
                .zip(&consist.colliders)
                .map(|(body, collider)| CarBox {
                    train: consist.id,
                    collider: *collider,
                    body: *body,
                    before: Motion::default(),
                })
        });
        let masses_kg = trains.iter().map(|train| train.consist.mass_kg());
        Self {
            cars: cars.collect(),
            masses_kg: masses_kg.collect(),
            ..Self::default()
        }
    }

    /// To be called before a step.
    pub(super) fn before_step(&mut self, world: &PhysicsWorld) {
        for car in &mut self.cars {
            car.before = Motion::of(world, car.body);
        }
    }

    /// What the trains are in touch with after a step.
    pub(super) fn hits(&self, world: &PhysicsWorld) -> Vec<Hit> {
        let mut hits = Vec::new();
        for (k, car) in self.cars.iter().enumerate() {
            for pair in world.narrow_phase.contact_pairs_with(car.collider) {
                hits.extend(hit(world, car, k, pair));
            }
        }
        hits
    }

    /// Records a hit; `before` is how a body that is no car moved before the step.
    pub(super) fn record(
        &mut self,
        world: &PhysicsWorld,
        hit: &Hit,
        name: &str,
        before: impl Fn(RigidBodyHandle) -> Motion,
        now: SimTime,
    ) {
        let car = &self.cars[hit.car];
        let train = car.train;
        let other_car = self.cars.iter().find(|other| other.body == hit.body);
        let was = other_car.map_or_else(|| before(hit.body), |other| other.before);
        let is = Motion::of(world, hit.body);
        let (train_was, train_is) = (car.before, Motion::of(world, car.body));
        let closing = |push: &Push| was.at(push.arm) - train_was.at(push.train_arm);
        let fastest = hit.pair.iter().map(|push| closing(push).length());
        let speed_mps = fastest.fold(0.0, f64::max);
        let k = self.touch((train, hit.with), name, speed_mps, now);
        let touch = &mut self.touches[k];
        touch.last = now;
        let blow = now.since(touch.since) <= BLOW_S;
        let Some(impact) = touch.impact.filter(|_| blow) else {
            return;
        };
        let impact = &mut self.list[impact];
        if !touch.bodies.contains(&hit.body) {
            touch.bodies.push(hit.body);
            let mass_kg = world.bodies.get(hit.body).map_or(0.0, |body| body.mass());
            // Seen from the point of the train that hits it.
            let seen = hit
                .pair
                .first()
                .map_or(Vector::ZERO, |push| train_was.at(push.train_arm));
            impact.energy_j += 0.5 * mass_kg * (was.linear - seen).length_squared();
        }
        for push in &hit.pair {
            touch.momentum += push.impulse;
            let after = is.at(push.arm) - train_is.at(push.train_arm);
            impact.energy_lost_j -= 0.5 * push.impulse.dot(closing(push) + after);
        }
        impact.momentum_n_s = touch.momentum.length();
        impact.damage = Damage::of_hit(impact.energy_lost_j, self.masses_kg[train.index()]);
    }

    /// The touch that goes on, or a new one, with a hit of its own where it is one.
    fn touch(
        &mut self,
        (train, with): (TrainId, Entity),
        name: &str,
        speed_mps: f64,
        now: SimTime,
    ) -> usize {
        let known = (self.touches.iter()).position(|t| (t.train, t.with) == (train, with));
        if let Some(k) = known
            && now.since(self.touches[k].last) <= GAP_S
        {
            return k;
        }
        let hit = (known.is_none() || speed_mps >= AGAIN_MPS) && self.list.len() < MOST;
        let touch = Touch {
            train,
            with,
            impact: hit.then_some(self.list.len()),
            since: now,
            last: now,
            momentum: Vector::ZERO,
            bodies: Vec::new(),
        };
        if hit {
            self.list.push(Impact {
                train,
                time: now,
                with: name.to_owned(),
                speed_mps,
                ..Impact::default()
            });
        }
        if let Some(k) = known {
            self.touches.swap_remove(k);
        }
        self.touches.push(touch);
        self.touches.len() - 1
    }
}

/// A contact pair of a car with a thing, where they touch.
fn hit(world: &PhysicsWorld, car: &CarBox, k: usize, pair: &ContactPair) -> Option<Hit> {
    let train_first = pair.collider1 == car.collider;
    let other = if train_first {
        pair.collider2
    } else {
        pair.collider1
    };
    let other = world.colliders.get(other)?;
    let mut pushes = Vec::new();
    for manifold in pair.solver_manifolds() {
        for point in manifold.points.iter().filter(|p| p.data.impulse > 0.0) {
            // The normal points from the first to the second.
            let push = manifold.data.normal * point.data.impulse;
            let arms = [point.data.solver_dp1, point.data.solver_dp2];
            pushes.push(Push {
                impulse: if train_first { push } else { -push },
                arm: arms[usize::from(train_first)],
                train_arm: arms[usize::from(!train_first)],
            });
        }
    }
    let touching = || {
        let points = pair.manifolds().iter().flat_map(|m| &m.points);
        points.into_iter().any(|point| point.dist <= 0.0)
    };
    (!pushes.is_empty() || touching()).then_some(Hit {
        with: Entity::of(other.user_data)?,
        force: !pushes.is_empty(),
        body: other.parent()?,
        car: k,
        pair: pushes,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fails where a key of summary.json or the name of a class of damage in it is another one.
    #[test]
    fn files_keep_their_keys() {
        let impact = Impact {
            train: TrainId::default(),
            time: SimTime::from_nanos(1_500_000_000),
            with: "crate".to_owned(),
            speed_mps: 10.0,
            momentum_n_s: 2.5,
            energy_j: 4.0,
            energy_lost_j: 3.0,
            damage: Damage::BeyondDesign,
        };
        assert_eq!(
            serde_json::to_string(&impact).ok().as_deref(),
            Some(
                "{\"time_s\":1.5,\"with\":\"crate\",\"speed_mps\":10.0,\"momentum_n_s\":2.5,\
                 \"energy_j\":4.0,\"energy_lost_j\":3.0,\"damage\":\"beyond_design\"}"
            )
        );
    }
}
