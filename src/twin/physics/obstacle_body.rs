//! An obstacle in the world: a rigid body of rapier that falls, rolls, rests, or is still held.

use super::entity::Entity;
use super::groups::{fixed, loose};
use super::impact::Motion;
use super::obstacle::{HingeEdge, HingeSettings, SingleObstacle};
use crate::bus::SimTime;
use crate::track::{Alignment, TrackId, TrackPoint};
use crate::twin::geometry::{Body, Shape};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rapier3d_f64::math::Vector;
use rapier3d_f64::prelude::{
    ColliderBuilder, ColliderHandle, ImpulseJointHandle, PhysicsWorld, RevoluteJointBuilder,
    RigidBodyBuilder, RigidBodyHandle, RigidBodyType,
};

/// Slower than this, a body lies still.
pub(super) const RESTING_MPS: f64 = 0.02;
pub(super) const RESTING_RAD_S: f64 = 0.1;
/// Extra solver passes for contacts of light bodies with a train.
pub(super) const EXTRA_PASSES: usize = 8;

/// Since when something has not moved; `None` while it moves.
#[derive(Clone, Copy, Default)]
pub(super) struct Rest {
    pub since: Option<SimTime>,
}

impl Rest {
    /// It is still now, or moves.
    pub(super) fn note(&mut self, still: bool, now: SimTime) {
        self.since = still.then(|| self.since.unwrap_or(now));
    }
}

/// What still holds an obstacle.
#[derive(Clone, Copy)]
enum Hold {
    Nothing,
    Fixed {
        until_s: f64,
    },
    Hinge {
        until_s: f64,
        joint: ImpulseJointHandle,
    },
}

/// An obstacle.
#[derive(Clone)]
pub(super) struct ObstacleBody {
    pub piece: SingleObstacle,
    pub body: RigidBodyHandle,
    pub collider: ColliderHandle,
    hold: Hold,
    /// The track that it is on, or beside.
    pub track: TrackId,
    /// Where it was last along that.
    pub near_m: f64,
    pub rest: Rest,
}

impl ObstacleBody {
    /// Puts an obstacle where its settings say: its lowest point at their height.
    pub(super) fn insert(
        world: &mut PhysicsWorld,
        (track, alignment): (TrackId, &Alignment),
        piece: &SingleObstacle,
        entity: Entity,
    ) -> Self {
        let settings = &piece.settings;
        let frame = alignment.at(settings.chainage_m);
        let centre = alignment.world_from_track(TrackPoint {
            s_m: settings.chainage_m,
            l_m: settings.lateral_m,
            h_m: settings.centre_height_m(&piece.body),
        });
        let heading = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), frame.heading_rad);
        let place =
            Isometry3::from_parts(Translation3::from(centre), heading * settings.attitude());
        let builder = match settings.held_until_s {
            Some(_) => RigidBodyBuilder::fixed(),
            None => RigidBodyBuilder::dynamic()
                .linvel((heading * Vector3::from(settings.velocity_mps)).into())
                .angvel((heading * Vector3::from(settings.spin_rad_s)).into()),
        };
        let body = world.insert_body(
            builder
                .pose(place.into())
                .ccd_enabled(true)
                .user_data(entity.user_data())
                .additional_solver_iterations(EXTRA_PASSES),
        );
        let (hold, solver) = match settings.held_until_s {
            Some(until_s) => (Hold::Fixed { until_s }, fixed()),
            None => (Hold::Nothing, loose()),
        };
        let collider = collider_of(&piece.body)
            .mass(settings.mass_kg)
            .friction(settings.friction)
            .restitution(settings.restitution)
            .user_data(entity.user_data())
            .collision_groups(loose())
            .solver_groups(solver);
        Self {
            body,
            collider: world.insert_collider(collider, Some(body)),
            piece: piece.clone(),
            hold,
            track,
            near_m: settings.chainage_m,
            rest: Rest::default(),
        }
    }

    /// It is fixed to the lining, as a part of it.
    pub(super) fn fixed(&self) -> bool {
        matches!(self.hold, Hold::Fixed { .. })
    }

    /// The train has touched it where it was held.
    pub(super) fn tear_off(&mut self, world: &mut PhysicsWorld) {
        if !matches!(self.hold, Hold::Nothing) {
            self.let_go(world);
        }
    }

    /// Lets go what is due.
    pub(super) fn release(&mut self, world: &mut PhysicsWorld, now_s: f64) {
        let (Hold::Fixed { until_s } | Hold::Hinge { until_s, .. }) = self.hold else {
            return;
        };
        if until_s > now_s {
            return;
        }
        match self.piece.settings.hinge.filter(|_| self.fixed()) {
            Some(hinge) => self.swing(world, &hinge),
            None => self.let_go(world),
        }
    }

    fn set_free(&mut self, world: &mut PhysicsWorld) {
        if let Some(body) = world.bodies.get_mut(self.body) {
            body.set_body_type(RigidBodyType::Dynamic, true);
        }
        self.rest = Rest::default();
    }

    fn let_go(&mut self, world: &mut PhysicsWorld) {
        if let Hold::Hinge { joint, .. } = self.hold {
            world.remove_impulse_joint(joint);
        }
        self.set_free(world);
        if let Some(collider) = world.colliders.get_mut(self.collider) {
            collider.set_solver_groups(loose());
        }
        self.hold = Hold::Nothing;
    }

    fn swing(&mut self, world: &mut PhysicsWorld, hinge: &HingeSettings) {
        let Some((place, _)) = self.state(world) else {
            return;
        };
        self.set_free(world);
        let half = self.piece.body.half_extents_m();
        let (edge, axis) = match hinge.edge {
            HingeEdge::Top => (Vector3::z() * half.z, Vector::X),
            HingeEdge::Bottom => (Vector3::z() * -half.z, Vector::X),
            HingeEdge::Front => (Vector3::x() * half.x, Vector::Z),
            HingeEdge::Back => (Vector3::x() * -half.x, Vector::Z),
        };
        let at = place * Isometry3::translation(edge.x, edge.y, edge.z);
        let wall = world.insert_body(RigidBodyBuilder::fixed().pose(at.into()));
        let joint = RevoluteJointBuilder::new(axis)
            .local_anchor1(Vector::ZERO)
            .local_anchor2(edge.into());
        self.hold = Hold::Hinge {
            until_s: hinge.until_s.unwrap_or(f64::INFINITY),
            joint: world.insert_impulse_joint(wall, self.body, joint),
        };
    }

    /// Notes whether it moves, when awake.
    pub(super) fn observe(&mut self, world: &PhysicsWorld, now: SimTime) {
        let still = world.bodies.get(self.body).is_some_and(|body| {
            body.is_sleeping()
                || body.linvel().length() < RESTING_MPS && body.angvel().length() < RESTING_RAD_S
        });
        self.rest.note(still, now);
    }

    /// Where it is and how it moves.
    pub(super) fn state(&self, world: &PhysicsWorld) -> Option<(Isometry3<f64>, Vector3<f64>)> {
        let body = world.bodies.get(self.body)?;
        Some(((*body.position()).into(), body.linvel().into()))
    }

    /// As the renderer draws it.
    pub(super) fn draw(&self, world: &PhysicsWorld) -> Option<Body> {
        let (world_from_body, velocity_mps) = self.state(world)?;
        Some(Body {
            shape: self.piece.body.clone(),
            world_from_body,
            velocity_mps,
            albedo: self.piece.settings.albedo,
            luminance_cd_m2: 0.0,
        })
    }

    /// Rolling resistance. A wheel under the load N that rolls evenly has to be pulled with
    /// c N, because the ground's reaction is ahead of its centre by c r: a moment c N r against
    /// its turning, about an axis in the contact's plane. Rapier knows point contacts only, so the
    /// moment is put on the body here, no greater than what stops it. The load is what changed its
    /// momentum over the last step, besides its weight.
    ///
    /// Forces along the normals never turn a body of revolution about its axis. Rapier keeps the
    /// contact points of a cylinder while it rolls by up to a degree, and these lag behind, which
    /// drives it on; that moment is taken off again.
    pub(super) fn resist_rolling(&self, world: &mut PhysicsWorld, before: &Motion) {
        let (mut normal, mut arm_m, mut turning) = (Vector::ZERO, 0.0f64, Vector::ZERO);
        for pair in world.narrow_phase.contact_pairs_with(self.collider) {
            let second = pair.collider2 == self.collider;
            for manifold in pair.solver_manifolds() {
                let own = if second { 1.0 } else { -1.0 };
                for point in manifold.points.iter().filter(|p| p.data.impulse > 0.0) {
                    let arms = [point.data.solver_dp1, point.data.solver_dp2];
                    let (push, arm) = (manifold.data.normal * own, arms[usize::from(second)]);
                    normal += push * point.data.impulse;
                    turning += arm.cross(push) * point.data.impulse;
                    arm_m = arm_m.max(-push.dot(arm));
                }
            }
        }
        let (gravity, dt_s) = (world.gravity, world.integration_parameters.dt);
        let Some(body) = world.bodies.get_mut(self.body).filter(|_| arm_m > 0.0) else {
            return;
        };
        if let Shape::Cylinder(..) = self.piece.body {
            let axis = *body.rotation() * Vector::Z;
            body.apply_torque_impulse(axis * -axis.dot(turning), false);
        }
        let normal = normal.normalize_or_zero();
        let load_n_s = (body.linvel() - before.linear - gravity * dt_s).dot(normal) * body.mass();
        let moment = self.piece.settings.rolling_resistance * load_n_s.max(0.0) * arm_m;
        let spin = body.angvel() - normal * normal.dot(body.angvel());
        let rate = spin.length();
        if rate > 1e-9 {
            let axis = spin / rate;
            let turned = body.mass_properties().effective_world_inv_inertia * axis;
            let stops = rate / axis.dot(turned);
            body.apply_torque_impulse(axis * -moment.min(stops), false);
        }
    }
}

fn collider_of(body: &Shape) -> ColliderBuilder {
    // Rapier's cylinders stand along y, ours along z.
    let upright = Vector::X * std::f64::consts::FRAC_PI_2;
    match body {
        Shape::Box(half) => ColliderBuilder::cuboid(half.x, half.y, half.z),
        Shape::Sphere(radius) => ColliderBuilder::ball(*radius),
        Shape::Cylinder(radius, half) => {
            ColliderBuilder::cylinder(*half, *radius).rotation(upright)
        }
        Shape::Capsule(radius, half) => ColliderBuilder::capsule_z(*half, *radius),
        Shape::Hull(hull) => {
            let corners: Vec<Vector> = hull.corners().iter().map(|c| (*c).into()).collect();
            // It is a hull already; a ball in its place would only stand for a broken library.
            ColliderBuilder::convex_hull(&corners)
                .unwrap_or_else(|| ColliderBuilder::ball(hull.half_extents_m().min()))
        }
    }
}
