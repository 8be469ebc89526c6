//! All that is no train: obstacles, cables and workers, what they lie on, and what trains do to
//! them.
//!
//! A step costs by what is awake. Rapier puts to sleep what lies still for half a second; nothing
//! here looks at a sleeping body, and the contacts of trains are asked of the trains.

use super::PhysicsError;
use super::cable::Cable;
use super::entity::{Entity, train_name};
use super::ground::Ground;
use super::impact::{Impacts, Motion};
use super::obstacle::{ObstacleSettings, SingleObstacle};
use super::obstacle_body::ObstacleBody;
use super::settings::PhysicsSettings;
use super::shape::ObstacleShape;
use super::train::Train;
use super::truth::{BodyLabel, BodyOwner};
use super::walker::{Act, Walker};
use crate::bus::{SimTime, TrainId};
use crate::track::network::{Beyond, Network};
use crate::track::{Alignment, BED_M, Direction, Place, TrackId};
use crate::twin::geometry::Body;
use rapier3d_f64::prelude::{PhysicsWorld, RigidBodyHandle};

/// Steps between looks at where a moving obstacle is along the line.
const LOOK_STEPS: u64 = 50;
/// A body that was awake before the step.
#[derive(Clone)]
struct Awake {
    body: RigidBodyHandle,
    entity: Entity,
    before: Motion,
}

/// Everything that trains may hit.
#[derive(Clone, Default)]
pub(super) struct Surroundings {
    /// `None` for what was taken away again.
    pub obstacles: Vec<Option<ObstacleBody>>,
    pub cables: Vec<Cable>,
    pub walkers: Vec<Walker>,
    /// Names of the trains.
    trains: Vec<String>,
    ground: Ground,
    /// Still to come, the next one last.
    to_come: Vec<SingleObstacle>,
    /// Times when something fixed lets go, the next one last.
    releases_s: Vec<f64>,
    pub impacts: Impacts,
    awake: Vec<Awake>,
    steps: u64,
}

impl Surroundings {
    /// What is there at time zero, besides trains that are in the world already. Everything random in
    /// it depends on `seed` and run `index`.
    pub(super) fn new(
        world: &mut PhysicsWorld,
        network: &Network,
        settings: &PhysicsSettings,
        [seed, index]: [u64; 2],
        trains: &[Train],
    ) -> Self {
        let solver = &mut world.integration_parameters;
        // Each step goes on from the tension that a cable had in the last one.
        solver.warmstart_joints = true;
        // Contacts that are kept while a body turns by some degrees make a wheel a polygon.
        solver.contact_recycling = false;
        let entries = settings.obstacles.iter().enumerate();
        let mut to_come: Vec<SingleObstacle> = entries
            .flat_map(|(k, entry)| entry.pieces(&format!("obstacle {k}"), seed, index))
            .chain(buffers(network))
            .collect();
        to_come.sort_by(|a, b| a.settings.appears_s.total_cmp(&b.settings.appears_s));
        to_come.reverse();
        let walkers = settings.workers.iter().enumerate().map(|(k, worker)| {
            let load = worker.carries.as_ref();
            let load = load.map(|load| load.pieces(&format!("load {k}"), seed, index));
            let track = track_of(network, worker.track.as_ref());
            Walker::new(
                worker,
                track,
                load.and_then(|pieces| pieces.into_iter().next()),
            )
        });
        let mut surroundings = Self {
            walkers: walkers.collect(),
            trains: trains
                .iter()
                .map(|train| train_name(train.consist.id))
                .collect(),
            releases_s: releases_s(settings),
            to_come,
            impacts: Impacts::new(trains),
            ..Self::default()
        };
        for (k, cable) in settings.cables.iter().enumerate() {
            let track = track_of(network, cable.track.as_ref());
            for end in [&cable.from, &cable.to] {
                let s_m = end.chainage_m;
                let place = Place { track, s_m };
                surroundings.ground.lay(world, network, place);
            }
            let entity = Entity::Cable(k);
            let beside = (track, line(network, track));
            let cable = Cable::insert(world, beside, cable, entity);
            surroundings.cables.push(cable);
        }
        surroundings.go_on(world, network, 0.0);
        surroundings
    }

    /// To be called before a step.
    pub(super) fn before_step(&mut self, world: &PhysicsWorld) {
        self.impacts.before_step(world);
        self.awake.clear();
        let awake = world.active_bodies().filter_map(|(body, state)| {
            Some(Awake {
                body,
                entity: Entity::of(state.user_data)?,
                before: Motion::of(world, body),
            })
        });
        self.awake.extend(awake);
    }

    /// Something moves, or did before the last step.
    pub(super) fn moving(&self) -> bool {
        !self.awake.is_empty()
    }

    /// To be called after a step.
    pub(super) fn after_step(
        &mut self,
        world: &mut PhysicsWorld,
        network: &Network,
        now: SimTime,
    ) -> Result<(), PhysicsError> {
        self.steps += 1;
        self.watch_awake(world, network, now)?;
        self.watch_trains(world, now);
        self.go_on(world, network, now.secs());
        Ok(())
    }

    /// Finite states, rest, rolling resistance, torn cables, ground under what flies on.
    fn watch_awake(
        &mut self,
        world: &mut PhysicsWorld,
        network: &Network,
        now: SimTime,
    ) -> Result<(), PhysicsError> {
        let look = self.steps.is_multiple_of(LOOK_STEPS);
        let mut last_cable = None;
        for k in 0..self.awake.len() {
            let Awake {
                body,
                entity,
                before,
            } = self.awake[k];
            if !world.bodies.get(body).is_some_and(|b| b.is_enabled()) {
                return Err(PhysicsError::NonFinite {
                    body: self.name(entity).to_owned(),
                    time: now,
                });
            }
            if look {
                self.lay_ground(world, network, body, entity);
            }
            match entity {
                Entity::Obstacle(k) => {
                    if let Some(obstacle) = &mut self.obstacles[k] {
                        obstacle.observe(world, now);
                        obstacle.resist_rolling(world, &before);
                    }
                }
                // The links of a cable follow one another.
                Entity::Cable(k) if last_cable != Some(k) => {
                    last_cable = Some(k);
                    self.cables[k].observe(world, now);
                    self.cables[k].tear(world);
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Ground around a body that moves.
    fn lay_ground(
        &mut self,
        world: &mut PhysicsWorld,
        network: &Network,
        body: RigidBodyHandle,
        entity: Entity,
    ) {
        let Some(at) = world.bodies.get(body).map(|body| body.translation()) else {
            return;
        };
        let near = match entity {
            Entity::Obstacle(k) => self.obstacles[k]
                .as_mut()
                .map(|obstacle| (obstacle.track, &mut obstacle.near_m)),
            Entity::Cable(k) => {
                let cable = &mut self.cables[k];
                Some((cable.track, &mut cable.near_m))
            }
            Entity::Worker(k) => {
                let walker = &mut self.walkers[k];
                Some((walker.track, &mut walker.near_m))
            }
            Entity::Train(_) => None,
        };
        let Some((track, near_m)) = near else {
            return;
        };
        let line = line(network, track);
        *near_m = line.track_from_world(&at.into(), *near_m).s_m;
        let s_m = *near_m;
        self.ground.lay(world, network, Place { track, s_m });
    }

    /// Hits of the trains, and what they tear off and knock down.
    fn watch_trains(&mut self, world: &mut PhysicsWorld, now: SimTime) {
        for hit in self.impacts.hits(world) {
            if hit.force {
                let name = self.name(hit.with).to_owned();
                let before = |body| {
                    let awake = self.awake.iter().find(|awake| awake.body == body);
                    awake.map_or(Motion::default(), |awake| awake.before)
                };
                self.impacts.record(world, &hit, &name, before, now);
            }
            match hit.with {
                Entity::Obstacle(k) => {
                    if let Some(obstacle) = &mut self.obstacles[k] {
                        obstacle.tear_off(world);
                    }
                }
                Entity::Worker(k) if hit.force => {
                    self.walkers[k].knock_down(world, now.secs());
                }
                _ => {}
            }
        }
    }

    /// Lets appear, let go, walk, put down and pick up what is due.
    fn go_on(&mut self, world: &mut PhysicsWorld, network: &Network, now_s: f64) {
        while let Some(next) = self.to_come.pop_if(|next| next.settings.appears_s <= now_s) {
            let track = track_of(network, next.settings.track.as_ref());
            self.insert(world, network, track, &next);
        }
        while self.releases_s.pop_if(|at_s| *at_s <= now_s).is_some() {
            for obstacle in self.obstacles.iter_mut().flatten() {
                obstacle.release(world, now_s);
            }
            for cable in &mut self.cables {
                cable.release(world, now_s);
            }
        }
        for k in 0..self.walkers.len() {
            let track = self.walkers[k].track;
            let line = line(network, track);
            self.walkers[k].lead(world, line, now_s, Entity::Worker(k));
            match self.walkers[k].act(now_s) {
                Some(Act::PutDown(load)) => {
                    let number = self.insert(world, network, track, &load);
                    self.walkers[k].has_put_down(number);
                }
                Some(Act::PickUp(number, place)) => {
                    let taken = self.take_away(world, line, number, place);
                    self.walkers[k].has_picked_up(taken);
                }
                None => {}
            }
        }
    }

    fn insert(
        &mut self,
        world: &mut PhysicsWorld,
        network: &Network,
        track: TrackId,
        piece: &SingleObstacle,
    ) -> usize {
        let number = self.obstacles.len();
        let s_m = piece.settings.chainage_m;
        self.ground.lay(world, network, Place { track, s_m });
        let entity = Entity::Obstacle(number);
        let beside = (track, line(network, track));
        let obstacle = ObstacleBody::insert(world, beside, piece, entity);
        self.obstacles.push(Some(obstacle));
        number
    }

    /// Takes an obstacle out of the world if it is within reach.
    fn take_away(
        &mut self,
        world: &mut PhysicsWorld,
        line: &Alignment,
        number: usize,
        place: [f64; 2],
    ) -> bool {
        let slot = &mut self.obstacles[number];
        let reached = slot.take_if(|obstacle| {
            obstacle.state(world).is_some_and(|(pose, _)| {
                let at = line.track_from_world(&pose.translation.vector.into(), place[0]);
                Walker::reaches(place, at.s_m, at.l_m)
            })
        });
        if let Some(obstacle) = &reached {
            world.remove_body(obstacle.body);
        }
        reached.is_some()
    }

    fn name(&self, entity: Entity) -> &str {
        match entity {
            Entity::Obstacle(k) => {
                let obstacle = self.obstacles.get(k).and_then(Option::as_ref);
                obstacle.map_or("obstacle", |obstacle| &obstacle.piece.settings.name)
            }
            Entity::Cable(k) => self.cables.get(k).map_or("cable", |c| &c.settings.name),
            Entity::Worker(k) => self.walkers.get(k).map_or("worker", |w| &w.settings.name),
            Entity::Train(k) => self.trains.get(k.index()).map_or("train", String::as_str),
        }
    }

    /// As renderers draw them, with their labels.
    pub(super) fn draw(
        &self,
        world: &PhysicsWorld,
        network: &Network,
        now_s: f64,
    ) -> Vec<(Body, BodyLabel<'_>)> {
        let mut drawn = Vec::new();
        for (k, obstacle) in self.obstacles.iter().enumerate() {
            let Some(obstacle) = obstacle else {
                continue;
            };
            let (owner, name) = (BodyOwner::Obstacle(k), &obstacle.piece.settings.name);
            drawn.extend(labelled(obstacle.draw(world), owner, name));
        }
        for (k, cable) in self.cables.iter().enumerate() {
            let (owner, name) = (BodyOwner::Cable(k), &cable.settings.name);
            drawn.extend(labelled(cable.draw(world), owner, name));
        }
        for (k, walker) in self.walkers.iter().enumerate() {
            let line = line(network, walker.track);
            let (owner, name) = (BodyOwner::Worker(k), &walker.settings.name);
            drawn.extend(labelled(walker.draw(world, line, now_s), owner, name));
            if let Some((body, name)) = walker.draw_load(world, line, now_s) {
                drawn.extend(labelled([body], BodyOwner::Load(k), name));
            }
        }
        drawn
    }

    /// Name of a train.
    pub(super) fn train_name(&self, id: TrainId) -> &str {
        self.name(Entity::Train(id))
    }
}

/// The buffer stops of a network: they stand until a train hits them, and then slide along.
fn buffers(network: &Network) -> Vec<SingleObstacle> {
    let ends = network.ends();
    let buffers = ends.filter(|end| network.beyond(*end) == Beyond::Buffer);
    let all = buffers.flat_map(|end| {
        let track = &network.tracks[usize::from(end.track.0)];
        let beyond_m = match end.way {
            Direction::Up => track.alignment.length_m() + BUFFER_BEYOND_M,
            Direction::Down => -BUFFER_BEYOND_M,
        };
        let buffer = ObstacleSettings {
            name: format!("buffer of {}", track.name),
            track: Some(track.name.clone()),
            chainage_m: beyond_m,
            height_m: BED_M,
            body: ObstacleShape::Box {
                size_m: BUFFER_SIZE_M,
            },
            mass_kg: BUFFER_KG,
            held_until_s: Some(1e6),
            ..ObstacleSettings::default()
        };
        buffer.pieces("buffer", 0, 0)
    });
    all.collect()
}

/// A sliding buffer stop of a metro: as heavy as holds a train of 340 t from 15 km/h on some 10 m.
const BUFFER_KG: f64 = 20_000.0;
const BUFFER_SIZE_M: [f64; 3] = [1.5, 2.4, 1.4];
/// Its middle is behind the end of the track by half of its length.
const BUFFER_BEYOND_M: f64 = 0.75;

/// The track of a name; the first one without.
fn track_of(network: &Network, name: Option<&String>) -> TrackId {
    // A world is not made with a name that is none.
    name.and_then(|name| network.named(name))
        .unwrap_or_default()
}

/// The centreline of a track of a network.
fn line(network: &Network, track: TrackId) -> &Alignment {
    &network.tracks[usize::from(track.0)].alignment
}

/// Bodies with the label that they share.
fn labelled(
    bodies: impl IntoIterator<Item = Body>,
    owner: BodyOwner,
    name: &str,
) -> impl Iterator<Item = (Body, BodyLabel<'_>)> {
    let label = BodyLabel { owner, name };
    bodies.into_iter().map(move |body| (body, label))
}

/// All times when something lets go, the first one last.
fn releases_s(settings: &PhysicsSettings) -> Vec<f64> {
    let obstacles = settings.obstacles.iter().flat_map(|o| {
        let hinge = o.hinge.and_then(|hinge| hinge.until_s);
        [o.held_until_s, hinge]
    });
    let cables = settings.cables.iter();
    let cables = cables.flat_map(|c| [c.from.lets_go_s, c.to.lets_go_s]);
    let mut times: Vec<f64> = obstacles.chain(cables).flatten().collect();
    times.sort_by(|a, b| b.total_cmp(a));
    times
}
