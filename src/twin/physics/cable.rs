//! Cables on the wall: chains of stiff links that hang between two fixed ends, until one lets go.
//!
//! Links are capsules joined by balls and sockets (rapier's impulse joints). At the start they hang
//! along the catenary, which is where they would come to rest. Bending stiffness is left out: under
//! its own weight a 25 mm cable of some metres is shaped by gravity. What a real cable loses
//! to the air and between its strands, the links lose to a drag in proportion to their speed: a
//! swing dies out within some ten seconds, a falling end loses less than a tenth of its speed.

use super::cable_settings::CableSettings;
use super::catenary::Catenary;
use super::entity::Entity;
use super::groups::{GROUND_GROUP, OBSTACLE_GROUP, SOLID_GROUP, TRAIN_GROUPS, groups};
use super::obstacle_body::{RESTING_MPS, Rest};
use crate::bus::SimTime;
use crate::track::{Alignment, TrackId};
use crate::twin::geometry::{Body, Shape};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rapier3d_f64::math::Vector;
use rapier3d_f64::prelude::{
    ColliderBuilder, ImpulseJointHandle, InteractionGroups, PhysicsWorld, RigidBodyBuilder,
    RigidBodyHandle, SphericalJointBuilder,
};

/// Length of a link.
const LINK_M: f64 = 0.25;
const LINKS: (usize, usize) = (8, 64);
/// Solver passes for a chain of links under tension.
const CHAIN_PASSES: usize = 7;
/// Drag on the turning of a link, which nothing else keeps from spinning about its own axis.
const TWIST_PER_S: f64 = 2.0;
/// Pull is averaged over this: blows of the solver's single steps do not tear a cable.
const PULL_S: f64 = 0.01;

/// A cable in the world.
#[derive(Clone)]
pub(super) struct Cable {
    pub settings: CableSettings,
    pub links: Vec<Link>,
    /// Joints in order: at the first end, between links, at the other end.
    joints: Vec<Option<ImpulseJointHandle>>,
    /// Pull between its links, averaged over a short time.
    pulls_n: Vec<f64>,
    /// The track that it is beside.
    pub track: TrackId,
    /// Where it was last along that.
    pub near_m: f64,
    pub rest: Rest,
    loose: bool,
}

/// A stiff piece of a cable.
#[derive(Clone)]
pub(super) struct Link {
    pub body: RigidBodyHandle,
    half_m: f64,
}

impl Cable {
    /// Hangs a cable up.
    pub(super) fn insert(
        world: &mut PhysicsWorld,
        (track, alignment): (TrackId, &Alignment),
        settings: &CableSettings,
        entity: Entity,
    ) -> Self {
        let [from, to] =
            [&settings.from, &settings.to].map(|end| alignment.world_from_track(end.place()));
        let count = (settings.length_m / LINK_M).round() as usize;
        let count = count.clamp(LINKS.0, LINKS.1);
        let curve: Vec<Point3<f64>> = Catenary::new(from, to, settings.length_m)
            .points(count)
            .collect();
        Self {
            track,
            ..Self::along(world, settings, &curve, entity)
        }
    }

    /// A cable whose joints are at the points of a curve.
    pub(super) fn along(
        world: &mut PhysicsWorld,
        settings: &CableSettings,
        curve: &[Point3<f64>],
        entity: Entity,
    ) -> Self {
        let count = curve.len() - 1;
        let links: Vec<Link> = (curve.windows(2).enumerate())
            .map(|(k, ends)| {
                let end = k == 0 || k + 1 == count;
                insert_link(world, settings, [ends[0], ends[1]], end, entity)
            })
            .collect();
        let joints = (0..=count).map(|k| {
            let anchor = |world: &mut PhysicsWorld| {
                let at = Isometry3::from(Translation3::from(curve[k]));
                (
                    world.insert_body(RigidBodyBuilder::fixed().pose(at.into())),
                    Vector::ZERO,
                )
            };
            let (before, its) = match k.checked_sub(1) {
                Some(k) => (links[k].body, Vector::Z * links[k].half_m),
                None => anchor(world),
            };
            let (after, own) = match links.get(k) {
                Some(link) => (link.body, Vector::Z * -link.half_m),
                None => anchor(world),
            };
            let joint = SphericalJointBuilder::new()
                .local_anchor1(its)
                .local_anchor2(own)
                .contacts_enabled(false);
            Some(world.insert_impulse_joint(before, after, joint))
        });
        let joints = joints.collect();
        Self {
            settings: settings.clone(),
            links,
            joints,
            pulls_n: vec![0.0; count - 1],
            track: TrackId::default(),
            near_m: settings.from.chainage_m,
            rest: Rest::default(),
            loose: false,
        }
    }

    /// An end has let go, or it has torn: it is no part of the lining any more.
    pub(super) fn loose(&self) -> bool {
        self.loose
    }

    /// Lets go the ends that are due.
    pub(super) fn release(&mut self, world: &mut PhysicsWorld, now_s: f64) {
        let last = self.joints.len() - 1;
        for (k, end) in [(0, self.settings.from), (last, self.settings.to)] {
            if end.lets_go_s.is_some_and(|at_s| at_s <= now_s) {
                self.part(world, k);
            }
        }
    }

    /// Tears where it is pulled too hard. To be called after each step while it is awake.
    pub(super) fn tear(&mut self, world: &mut PhysicsWorld) {
        let share = (world.integration_parameters.dt / PULL_S).min(1.0);
        let mut hardest = (0.0, 0);
        for k in 0..self.pulls_n.len() {
            let pull_n = self.tension_n(world, k + 1);
            self.pulls_n[k] += share * (pull_n - self.pulls_n[k]);
            if self.pulls_n[k] > hardest.0 {
                hardest = (self.pulls_n[k], k);
            }
        }
        let (pull_n, k) = hardest;
        if pull_n > self.settings.breaking_n {
            self.part(world, k + 1);
            self.pulls_n.fill(0.0);
        }
    }

    /// Force in a joint between links over the last step. The solver makes the rows of a joint
    /// independent of each other, so its figures are forces along axes only where these are the
    /// links' own: not at a wall.
    pub(super) fn tension_n(&self, world: &PhysicsWorld, joint: usize) -> f64 {
        let handle = self.joints.get(joint).copied().flatten();
        let joint = handle.and_then(|handle| world.impulse_joints.get(handle));
        let solver = &world.integration_parameters;
        let passes = (solver.num_solver_iterations + CHAIN_PASSES) as f64;
        joint.map_or(0.0, |joint| {
            let impulse = Vector3::from([0, 1, 2].map(|k| joint.impulses[k]));
            impulse.norm() * passes / solver.dt
        })
    }

    fn part(&mut self, world: &mut PhysicsWorld, joint: usize) {
        let Some(handle) = self.joints[joint].take() else {
            return;
        };
        world.remove_impulse_joint(handle);
        self.loose = true;
        self.rest = Rest::default();
        // The piece at the wall did not touch it while it hung there.
        let ends = [self.links.first(), self.links.last()];
        for link in ends.into_iter().flatten() {
            world.wake_up(link.body, true);
            let Some(body) = world.bodies.get(link.body) else {
                continue;
            };
            for collider in body.colliders() {
                if let Some(collider) = world.colliders.get_mut(*collider) {
                    collider.set_collision_groups(touching(false));
                }
            }
        }
    }

    /// Notes whether it moves, when a link is awake.
    pub(super) fn observe(&mut self, world: &PhysicsWorld, now: SimTime) {
        let still = self.links.iter().all(|link| {
            (world.bodies.get(link.body))
                .is_some_and(|body| body.is_sleeping() || body.linvel().length() < RESTING_MPS)
        });
        self.rest.note(still, now);
    }

    /// Both ends of each link.
    pub(super) fn ends(&self, world: &PhysicsWorld) -> impl Iterator<Item = [Point3<f64>; 2]> {
        self.links.iter().filter_map(move |link| {
            let body = world.bodies.get(link.body)?;
            let half = *body.rotation() * (Vector::Z * link.half_m);
            let centre = body.translation();
            Some([centre - half, centre + half].map(Point3::from))
        })
    }

    /// Its mean velocity.
    pub(super) fn velocity_mps(&self, world: &PhysicsWorld) -> Vector3<f64> {
        let bodies = self.links.iter().filter_map(|l| world.bodies.get(l.body));
        let sum = bodies.fold(Vector::ZERO, |sum, body| sum + body.linvel());
        Vector3::from(sum) / self.links.len() as f64
    }

    /// As the renderer draws it.
    pub(super) fn draw(&self, world: &PhysicsWorld) -> impl Iterator<Item = Body> {
        self.links.iter().filter_map(|link| {
            let body = world.bodies.get(link.body)?;
            Some(Body {
                shape: Shape::Capsule(0.5 * self.settings.diameter_m, link.half_m),
                world_from_body: (*body.position()).into(),
                velocity_mps: body.linvel().into(),
                albedo: self.settings.albedo,
                luminance_cd_m2: 0.0,
            })
        })
    }
}

/// What a link touches; the pieces at its ends do not touch the wall that they are fixed to.
fn touching(at_wall: bool) -> InteractionGroups {
    let others = TRAIN_GROUPS | SOLID_GROUP;
    let of = if at_wall {
        others
    } else {
        others | GROUND_GROUP
    };
    groups(OBSTACLE_GROUP, of)
}

fn insert_link(
    world: &mut PhysicsWorld,
    settings: &CableSettings,
    ends: [Point3<f64>; 2],
    at_wall: bool,
    entity: Entity,
) -> Link {
    let along = ends[1] - ends[0];
    let half_m = 0.5 * along.norm();
    let turn = UnitQuaternion::rotation_between(&Vector3::z(), &along).unwrap_or_else(|| {
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
    });
    let place = Isometry3::from_parts(Translation3::from(ends[0] + 0.5 * along), turn);
    let body = world.insert_body(
        RigidBodyBuilder::dynamic()
            .pose(place.into())
            .linear_damping(settings.drag_per_s())
            .angular_damping(TWIST_PER_S)
            .user_data(entity.user_data())
            .additional_solver_iterations(CHAIN_PASSES),
    );
    if let Some(body) = world.bodies.get_mut(body) {
        // A slow swing is slowest where it turns: it is no rest.
        body.activation_mut().normalized_linear_threshold = RESTING_MPS;
    }
    let collider = ColliderBuilder::capsule_z(half_m, 0.5 * settings.diameter_m)
        .mass(2.0 * half_m * settings.mass_kg_per_m)
        .friction(settings.friction)
        .restitution(0.0)
        .user_data(entity.user_data())
        .collision_groups(touching(at_wall));
    world.insert_collider(collider, Some(body));
    Link { body, half_m }
}

/// Corners of the box around points, in a frame.
pub(super) fn bounds(
    points: impl Iterator<Item = Point3<f64>>,
    frame_from_world: &Isometry3<f64>,
) -> Option<[Vector3<f64>; 2]> {
    points
        .map(|p| (frame_from_world * p).coords)
        .map(|p| [p, p])
        .reduce(|[low, high], [p, _]| [low.inf(&p), high.sup(&p)])
}
