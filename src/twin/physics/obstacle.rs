//! Things that lie, fall and get hit: rigid bodies of rapier that appear at their time.

use super::consist::{OBSTACLE_GROUP, TRAIN_GROUP};
use super::convert::{isometry, pose, vector, vector3};
use super::ground::GROUND_GROUP;
use crate::track::{Alignment, Checker, Problem, TrackPoint};
use crate::twin::render::{Body, Shape};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rapier3d_f64::prelude::{
    ColliderBuilder, ColliderHandle, InteractionGroups, InteractionTestMode, PhysicsWorld,
    RigidBodyBuilder, RigidBodyHandle,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Shape of an obstacle with its size.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "shape", rename_all = "snake_case", deny_unknown_fields)]
pub enum ObstacleShape {
    /// A box: length along the line, width across, height, metres.
    Box {
        /// Length, width and height, metres.
        size_m: [f64; 3],
    },
    /// An upright cylinder.
    Cylinder {
        /// Diameter, metres.
        diameter_m: f64,
        /// Height, metres.
        height_m: f64,
    },
    /// A ball.
    Sphere {
        /// Diameter, metres.
        diameter_m: f64,
    },
}

impl ObstacleShape {
    /// Length, width and height of its bounding box at rest.
    pub fn size_m(&self) -> Vector3<f64> {
        match *self {
            Self::Box { size_m } => size_m.into(),
            Self::Cylinder {
                diameter_m,
                height_m,
            } => Vector3::new(diameter_m, diameter_m, height_m),
            Self::Sphere { diameter_m } => Vector3::repeat(diameter_m),
        }
    }

    /// As the renderer draws it.
    pub fn render_shape(&self) -> Shape {
        match *self {
            Self::Box { .. } => Shape::Box(self.size_m() / 2.0),
            Self::Cylinder {
                diameter_m,
                height_m,
            } => Shape::Cylinder(diameter_m / 2.0, height_m / 2.0),
            Self::Sphere { diameter_m } => Shape::Sphere(diameter_m / 2.0),
        }
    }
}

/// One obstacle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ObstacleSettings {
    /// Name, for the summary.
    pub name: String,
    /// Shape and size: `body = { shape = "box", size_m = [0.4, 0.25, 0.25] }`, or `cylinder` with
    /// `diameter_m` and `height_m`, or `sphere` with `diameter_m`.
    pub body: ObstacleShape,
    /// Mass, kilograms.
    pub mass_kg: f64,
    /// Coulomb friction.
    pub friction: f64,
    /// Restitution, 0 to 1.
    pub restitution: f64,
    /// Share of light reflected, 0 to 1.
    pub albedo: f64,
    /// Chainage of its centre, metres.
    pub chainage_m: f64,
    /// Left of the centreline, metres.
    pub lateral_m: f64,
    /// Height of its lowest point above top of rail when it appears, metres.
    pub height_m: f64,
    /// Turned about the vertical, degrees.
    pub yaw_deg: f64,
    /// When it appears, seconds.
    pub appears_s: f64,
    /// Velocity when it appears: up the line, to the left, up, m/s.
    pub velocity_mps: [f64; 3],
}

impl Default for ObstacleSettings {
    fn default() -> Self {
        Self {
            name: "box".to_owned(),
            body: ObstacleShape::Box {
                size_m: [0.3, 0.3, 0.3],
            },
            mass_kg: 10.0,
            friction: 0.6,
            restitution: 0.2,
            albedo: 0.3,
            chainage_m: 0.0,
            lateral_m: 0.0,
            height_m: 0.5,
            yaw_deg: 0.0,
            appears_s: 0.0,
            velocity_mps: [0.0; 3],
        }
    }
}

impl ObstacleSettings {
    /// Appends what is wrong with these settings; `at` is the dotted key that leads here.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        let mut check = Checker::new(at, problems);
        for size in self.body.size_m().iter() {
            check.within("body", *size, 0.01..=10.0, "m");
        }
        check.within("mass_kg", self.mass_kg, 0.01..=1e5, "kg");
        check.within("friction", self.friction, 0.0..=2.0, "");
        check.within("restitution", self.restitution, 0.0..=1.0, "");
        check.within("albedo", self.albedo, 0.0..=1.0, "");
        check.within("chainage_m", self.chainage_m, -1e6..=1e6, "m");
        check.within("lateral_m", self.lateral_m, -10.0..=10.0, "m");
        check.within("height_m", self.height_m, -1.0..=10.0, "m");
        check.within("yaw_deg", self.yaw_deg, -360.0..=360.0, "deg");
        check.within("appears_s", self.appears_s, 0.0..=1e6, "s");
        for v in self.velocity_mps {
            check.within("velocity_mps", v, -50.0..=50.0, "m/s");
        }
    }
}

/// Slower than this, a body lies still.
const RESTING_MPS: f64 = 0.02;
const RESTING_RAD_S: f64 = 0.1;
/// For this long.
const RESTING_S: f64 = 0.25;
/// Extra solver passes for contacts of light bodies with a train.
const EXTRA_PASSES: usize = 8;

/// An obstacle in the world.
pub(super) struct Obstacle {
    pub settings: ObstacleSettings,
    pub body: RigidBodyHandle,
    pub collider: ColliderHandle,
    still_s: f64,
    /// Before the step, for the record of a collision.
    pub velocity_before: Vector3<f64>,
}

impl Obstacle {
    /// Puts an obstacle where its settings say; its place is the middle of its underside.
    pub(super) fn insert(
        world: &mut PhysicsWorld,
        alignment: &Alignment,
        settings: &ObstacleSettings,
    ) -> Self {
        let half = settings.body.size_m() / 2.0;
        let frame = alignment.at(settings.chainage_m);
        let centre = alignment.world_from_track(TrackPoint {
            s_m: settings.chainage_m,
            l_m: settings.lateral_m,
            h_m: settings.height_m + half.z,
        });
        let heading = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), frame.heading_rad);
        let yaw =
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), settings.yaw_deg.to_radians());
        let place = Isometry3::from_parts(Translation3::from(centre), heading * yaw);
        let velocity = heading * Vector3::from(settings.velocity_mps);
        let body = world.insert_body(
            RigidBodyBuilder::dynamic()
                .pose(pose(&place))
                .linvel(vector(velocity))
                .ccd_enabled(true)
                .additional_solver_iterations(EXTRA_PASSES),
        );
        let collider = match settings.body {
            ObstacleShape::Box { .. } => ColliderBuilder::cuboid(half.x, half.y, half.z),
            ObstacleShape::Sphere { .. } => ColliderBuilder::ball(half.x),
            // Rapier's cylinders stand along y, ours along z.
            ObstacleShape::Cylinder { .. } => ColliderBuilder::cylinder(half.z, half.x)
                .rotation(vector(Vector3::x() * std::f64::consts::FRAC_PI_2)),
        };
        let collider = collider
            .mass(settings.mass_kg)
            .friction(settings.friction)
            .restitution(settings.restitution)
            .collision_groups(InteractionGroups::new(
                OBSTACLE_GROUP,
                OBSTACLE_GROUP | TRAIN_GROUP | GROUND_GROUP,
                InteractionTestMode::And,
            ));
        Self {
            settings: settings.clone(),
            body,
            collider: world.insert_collider(collider, Some(body)),
            still_s: 0.0,
            velocity_before: velocity,
        }
    }

    /// Notes how it moves; `false` where its state is not finite.
    pub(super) fn observe(&mut self, world: &PhysicsWorld, dt_s: f64) -> bool {
        let Some(body) = world.bodies.get(self.body).filter(|b| b.is_enabled()) else {
            return false;
        };
        let still = body.is_sleeping()
            || body.linvel().length() < RESTING_MPS && body.angvel().length() < RESTING_RAD_S;
        self.still_s = if still { self.still_s + dt_s } else { 0.0 };
        true
    }

    /// It lies still.
    pub(super) fn resting(&self) -> bool {
        self.still_s >= RESTING_S
    }

    /// For how long it has not moved.
    pub(super) fn still_s(&self) -> f64 {
        self.still_s
    }

    /// Where it is and how it moves.
    pub(super) fn state(&self, world: &PhysicsWorld) -> Option<(Isometry3<f64>, Vector3<f64>)> {
        let body = world.bodies.get(self.body)?;
        Some((
            isometry(body.translation(), *body.rotation()),
            vector3(body.linvel()),
        ))
    }

    /// As the renderer draws it.
    pub(super) fn draw(&self, world: &PhysicsWorld) -> Option<Body> {
        let (world_from_body, velocity_mps) = self.state(world)?;
        Some(Body {
            shape: self.settings.body.render_shape(),
            world_from_body,
            velocity_mps,
            albedo: self.settings.albedo,
            luminance_cd_m2: 0.0,
        })
    }
}
