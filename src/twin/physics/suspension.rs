//! Forces of springs and dampers between car, bogie and wheelset.
//!
//! Every force is evaluated from the state at the start of a step and held through it, and the
//! step moves the bodies with their new velocities (symplectic Euler): stable while the fastest
//! mode turns by less than 2 rad a step. That is the yaw of a bogie on its axle boxes, 0.2 rad in
//! 1 ms. Wheelsets are no bodies of their own: the rails guide them, as in the usual models with
//! rigid track and without creep.

use super::vehicle::{Element, Vehicle};
use rapier3d_f64::math::{Rotation, Vector};

/// Pose of a centre of gravity with its velocities, world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BodyState {
    pub position: Vector,
    pub rotation: Rotation,
    pub velocity: Vector,
    pub angular: Vector,
}

impl BodyState {
    /// World position of a point of the body.
    pub(super) fn point(&self, local: Vector) -> Vector {
        self.position + self.rotation * local
    }

    /// Velocity of the body's point at a world position.
    pub(super) fn velocity_at(&self, world: Vector) -> Vector {
        self.velocity + self.angular.cross(world - self.position)
    }
}

/// What acts on a body, about its centre of gravity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Wrench {
    pub force: Vector,
    pub torque: Vector,
}

impl Wrench {
    pub(super) fn add_at(&mut self, state: &BodyState, force: Vector, world: Vector) {
        self.force += force;
        self.torque += (world - state.position).cross(force);
    }
}

/// Orthonormal directions in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axes {
    pub x: Vector,
    pub y: Vector,
    pub z: Vector,
}

impl Axes {
    pub(super) fn of(rotation: Rotation) -> Self {
        Self {
            x: rotation * Vector::X,
            y: rotation * Vector::Y,
            z: rotation * Vector::Z,
        }
    }

    fn into(self, world: Vector) -> Vector {
        Vector::new(self.x.dot(world), self.y.dot(world), self.z.dot(world))
    }

    fn out(self, local: Vector) -> Vector {
        self.x * local.x + self.y * local.y + self.z * local.z
    }

    /// Force of an element stretched by `stretch` that grows by `rate` (world), under a static
    /// load along z.
    fn force(self, element: &Element, stretch: Vector, rate: Vector, preload_n: f64) -> Vector {
        let local =
            element.stiffness_n_m * self.into(stretch) + element.damping_n_s_m * self.into(rate);
        self.out(Vector::new(-local.x, -local.y, preload_n - local.z))
    }
}

/// A wheelset as the rails hold it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Wheelset {
    /// Centreline at the top of the rails as they really lie.
    pub origin: Vector,
    pub axes: Axes,
    /// Velocity of the point of contact's frame as it runs along, and its turn rate.
    pub velocity: Vector,
    pub angular: Vector,
}

/// Springs of a bogie's axle boxes on one wheelset, `along_m` ahead of the bogie's centre.
pub(super) fn primary(
    vehicle: &Vehicle,
    wheelset: &Wheelset,
    along_m: f64,
    bogie: &BodyState,
    on_bogie: &mut Wrench,
) {
    let drop = vehicle.wheel_radius_m - vehicle.bogie_cg_m;
    for side in [-1.0, 1.0] {
        let lateral = side * vehicle.semi_spring_base_m;
        let above = bogie.point(Vector::new(along_m, lateral, drop));
        let arm = wheelset.axes.y * lateral + wheelset.axes.z * vehicle.wheel_radius_m;
        let below = wheelset.origin + arm;
        let rate = bogie.velocity_at(above) - wheelset.velocity - wheelset.angular.cross(arm);
        let force = wheelset.axes.force(
            &vehicle.primary,
            above - below,
            rate,
            vehicle.primary_preload_n(),
        );
        on_bogie.add_at(bogie, force, above);
    }
}

/// Springs, roll bar and traction rod between a car and a bogie `along_m` ahead of its centre.
/// Returns how far the springs are compressed, mean of both sides.
pub(super) fn secondary(
    vehicle: &Vehicle,
    along_m: f64,
    (car, on_car): (&BodyState, &mut Wrench),
    (bogie, on_bogie): (&BodyState, &mut Wrench),
) -> f64 {
    let axes = Axes::of(car.rotation);
    let mut compression_m = 0.0;
    // Both bodies get the force at the same point, so that no angular momentum comes from nowhere.
    let mut pair = |force: Vector, world: Vector| {
        on_car.add_at(car, force, world);
        on_bogie.add_at(bogie, -force, world);
    };
    let ends = |lateral: f64, height: f64| {
        let upper = car.point(Vector::new(along_m, lateral, height - vehicle.car_cg_m));
        let lower = bogie.point(Vector::new(0.0, lateral, height - vehicle.bogie_cg_m));
        let rate = car.velocity_at(upper) - bogie.velocity_at(lower);
        (upper - lower, rate, (upper + lower) * 0.5)
    };
    for side in [-1.0, 1.0] {
        let lateral = side * vehicle.semi_spring_base_m;
        let (stretch, rate, middle) = ends(lateral, vehicle.secondary_m);
        compression_m -= 0.5 * axes.z.dot(stretch);
        let preload = vehicle.secondary_preload_n();
        pair(
            axes.force(&vehicle.secondary, stretch, rate, preload),
            middle,
        );
    }
    let (stiffness, damping) = vehicle.traction_rod;
    let (stretch, rate, middle) = ends(0.0, vehicle.bogie_cg_m);
    let pull = stiffness * axes.x.dot(stretch) + damping * axes.x.dot(rate);
    pair(axes.x * -pull, middle);
    let turn = bogie.rotation.inverse() * car.rotation;
    let roll_rad = 2.0 * turn.x * turn.w.signum();
    let torque = axes.x * (-vehicle.roll_bar_n_m_rad * roll_rad);
    on_car.torque += torque;
    on_bogie.torque -= torque;
    compression_m
}

/// Coupler between the rear end of one car and the front end of the next: it pulls and buffs
/// along, and leaves the rest free.
pub(super) fn coupler(
    (stiffness, damping): (f64, f64),
    rear_end: Vector,
    front_end: Vector,
    (leading, on_leading): (&BodyState, &mut Wrench),
    (following, on_following): (&BodyState, &mut Wrench),
) {
    let (a, b) = (leading.point(rear_end), following.point(front_end));
    let along = (leading.rotation * Vector::X + following.rotation * Vector::X).normalize();
    let rate = leading.velocity_at(a) - following.velocity_at(b);
    let pull = along * (stiffness * along.dot(a - b) + damping * along.dot(rate));
    let middle = (a + b) * 0.5;
    on_leading.add_at(leading, -pull, middle);
    on_following.add_at(following, pull, middle);
}
