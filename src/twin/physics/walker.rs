//! A worker as a body that a train can hit.
//!
//! He is a capsule of his height and mass. While he walks it is led along his path without gravity,
//! and meets the train only, so that the solver lets the train hit a body of his mass, not a wall.
//! From then on it is a body like others: it is thrown, falls, and lies.

use super::entity::Entity;
use super::groups::{OBSTACLE_GROUP, TRAIN_GROUPS, groups, loose};
use super::obstacle::{ObstacleSettings, SingleObstacle};
use super::obstacle_body::EXTRA_PASSES;
use super::worker::{Feet, Stance, WorkerSettings};
use crate::track::{Alignment, TrackId};
use crate::twin::geometry::Body;
use nalgebra::Isometry3;
use rapier3d_f64::math::Vector;
use rapier3d_f64::prelude::{ColliderBuilder, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle};

/// Half the depth and width of a body, the mean of both.
const RADIUS_M: f64 = 0.2;
/// He reaches what lies this near.
const REACH_M: f64 = 1.5;

/// A worker in the world.
#[derive(Clone)]
pub(super) struct Walker {
    pub settings: WorkerSettings,
    /// What he carries, or has put down.
    load: Option<SingleObstacle>,
    load_is: Load,
    /// While he is on the line.
    pub body: Option<RigidBodyHandle>,
    /// The track that he walks on, or beside.
    pub track: TrackId,
    /// Where he was last along that.
    pub near_m: f64,
    /// How he stood when the train hit him.
    hit: Option<Stance>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Load {
    InHand,
    /// Lies where it was put down, under this number.
    Down(usize),
    /// Put down and picked up; stays in his hand.
    Kept,
}

/// What a worker does with his load now.
pub(super) enum Act {
    PutDown(Box<SingleObstacle>),
    /// Wants to pick up what lies under this number, if it is within his reach of a place (chainage,
    /// left of the centreline).
    PickUp(usize, [f64; 2]),
}

impl Walker {
    /// A worker, with what he carries.
    pub(super) fn new(
        settings: &WorkerSettings,
        track: TrackId,
        load: Option<SingleObstacle>,
    ) -> Self {
        Self {
            track,
            settings: settings.clone(),
            load,
            load_is: Load::InHand,
            body: None,
            near_m: settings.path.first().map_or(0.0, |p| p.chainage_m),
            hit: None,
        }
    }

    /// What he carries, or has put down.
    pub(super) fn carries(&self) -> Option<&ObstacleSettings> {
        self.load.as_ref().map(|load| &load.settings)
    }

    /// He can pick up what lies there.
    pub(super) fn reaches(place: [f64; 2], chainage_m: f64, lateral_m: f64) -> bool {
        (chainage_m - place[0]).hypot(lateral_m - place[1]) <= REACH_M
    }

    fn half_m(&self) -> f64 {
        0.5 * self.settings.stature_m
    }

    /// Leads him to where he is at a time: into the world, along, and out of it.
    pub(super) fn lead(
        &mut self,
        world: &mut PhysicsWorld,
        alignment: &Alignment,
        now_s: f64,
        entity: Entity,
    ) {
        if self.hit.is_some() {
            return;
        }
        let Some(stance) = self.settings.stance(now_s) else {
            if let Some(body) = self.body.take() {
                world.remove_body(body);
            }
            return;
        };
        let (feet, velocity) = self.settings.feet(alignment, &stance);
        let centre = feet * Isometry3::translation(0.0, 0.0, self.half_m());
        let body = match self.body {
            Some(body) => body,
            None => *self.body.insert(self.insert(world, &centre, entity)),
        };
        if let Some(body) = world.bodies.get_mut(body) {
            body.set_position(centre.into(), true);
            body.set_linvel(velocity.into(), true);
            body.set_angvel(Vector::ZERO, true);
        }
    }

    fn insert(
        &self,
        world: &mut PhysicsWorld,
        at: &Isometry3<f64>,
        entity: Entity,
    ) -> RigidBodyHandle {
        let body = world.insert_body(
            RigidBodyBuilder::dynamic()
                .pose((*at).into())
                .gravity_scale(0.0)
                .user_data(entity.user_data())
                .additional_solver_iterations(EXTRA_PASSES),
        );
        let collider = ColliderBuilder::capsule_z(self.half_m() - RADIUS_M, RADIUS_M)
            .mass(self.settings.mass_kg)
            .friction(0.6)
            .restitution(0.0)
            .user_data(entity.user_data())
            .collision_groups(groups(OBSTACLE_GROUP, TRAIN_GROUPS));
        world.insert_collider(collider, Some(body));
        body
    }

    /// The train has hit him: he is thrown.
    pub(super) fn knock_down(&mut self, world: &mut PhysicsWorld, now_s: f64) {
        if self.hit.is_some() {
            return;
        }
        self.hit = self.settings.stance(now_s);
        let Some(body) = self.body.and_then(|body| world.bodies.get_mut(body)) else {
            return;
        };
        body.set_gravity_scale(1.0, true);
        for collider in body.colliders() {
            if let Some(collider) = world.colliders.get_mut(*collider) {
                collider.set_collision_groups(loose());
            }
        }
    }

    /// What he does now.
    pub(super) fn act(&self, now_s: f64) -> Option<Act> {
        if self.hit.is_some() {
            return None;
        }
        let (load, s) = (self.load.as_ref()?, &self.settings);
        let due = |when: Option<f64>| when.filter(|when| *when <= now_s);
        match self.load_is {
            Load::InHand => {
                let stance = s.stance(due(s.puts_down_s)?)?;
                Some(Act::PutDown(Box::new(s.put_down(&stance, load))))
            }
            Load::Down(number) => {
                let stance = s.stance(due(s.picks_up_s)?)?;
                Some(Act::PickUp(number, [stance.s_m, stance.l_m]))
            }
            Load::Kept => None,
        }
    }

    /// His load lies under a number now.
    pub(super) fn has_put_down(&mut self, number: usize) {
        self.load_is = Load::Down(number);
    }

    /// He has it again, or it was out of his reach: then it stays where it is.
    pub(super) fn has_picked_up(&mut self, taken: bool) {
        self.load_is = Load::Kept;
        if !taken {
            self.load = None;
        }
    }

    /// Where his feet are, turned as he is, and his velocity; `None` while he is not on the line.
    fn feet(
        &self,
        world: &PhysicsWorld,
        alignment: &Alignment,
        now_s: f64,
    ) -> Option<(Stance, Feet)> {
        let Some(hit) = self.hit else {
            let stance = self.settings.stance(now_s)?;
            return Some((stance, self.settings.feet(alignment, &stance)));
        };
        let body = world.bodies.get(self.body?)?;
        let centre = Isometry3::from(*body.position());
        let feet = centre * Isometry3::translation(0.0, 0.0, -self.half_m());
        Some((hit, (feet, body.linvel().into())))
    }

    /// Chainage and place left of the centreline of his middle; `None` while he is not on the line.
    pub(super) fn place_m(
        &self,
        world: &PhysicsWorld,
        alignment: &Alignment,
        now_s: f64,
    ) -> Option<(f64, f64)> {
        let (stance, (feet, _)) = self.feet(world, alignment, now_s)?;
        if self.hit.is_none() {
            return Some((stance.s_m, stance.l_m));
        }
        let middle = feet * nalgebra::Point3::new(0.0, 0.0, self.half_m());
        let place = alignment.track_from_world(&middle, stance.s_m);
        Some((place.s_m, place.l_m))
    }

    /// His limbs as the renderer draws them.
    pub(super) fn draw(
        &self,
        world: &PhysicsWorld,
        alignment: &Alignment,
        now_s: f64,
    ) -> Vec<Body> {
        let feet = self.feet(world, alignment, now_s);
        feet.map_or(Vec::new(), |(stance, feet)| {
            self.settings.draw(&stance, feet)
        })
    }

    /// What he has in his hand as the renderer draws it, with its name.
    pub(super) fn draw_load(
        &self,
        world: &PhysicsWorld,
        alignment: &Alignment,
        now_s: f64,
    ) -> Option<(Body, &str)> {
        let in_hand = !matches!(self.load_is, Load::Down(_));
        let load = self.load.as_ref().filter(|_| in_hand)?;
        let (_, feet) = self.feet(world, alignment, now_s)?;
        Some((self.settings.draw_load(feet, load), &load.settings.name))
    }
}
