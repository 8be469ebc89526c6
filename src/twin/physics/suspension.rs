//! Forces of springs and dampers between car, bogie, wheelset and the next car.
//!
//! Every force is evaluated from the state at the start of a step and held through it, and the
//! step moves the bodies with their new velocities (symplectic Euler): stable while the fastest
//! mode turns by less than 2 rad a step. Both bodies get a force at the same point, so that no
//! angular momentum comes from nowhere. What a damper takes and a spring holds goes into a
//! [`Ledger`].

use super::energy::Ledger;
use super::vehicle::{Coupler, Element, Vehicle};
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

    /// Force of an element stretched by `stretch` that grows by `rate` (world).
    fn force(
        self,
        element: &Element,
        stretch: Vector,
        rate: Vector,
        ledger: &mut Ledger,
    ) -> Vector {
        let (x, v) = (self.into(stretch), self.into(rate));
        let spring = element.stiffness_n_m * x;
        let damper = element.damping_n_s_m * v;
        ledger.springs_j += 0.5 * spring.dot(x) - element.preload_n * x.z;
        ledger.dampers_w += damper.dot(v);
        self.out(Vector::new(0.0, 0.0, element.preload_n) - spring - damper)
    }
}

/// Force of a spring with free play to either side, and what it holds.
fn beyond(x: f64, play: f64, stiffness: f64) -> (f64, f64) {
    let past = x - x.clamp(-play, play);
    (-stiffness * past, 0.5 * stiffness * past * past)
}

/// Springs of the axle boxes of a wheelset `along_m` ahead of the bogie's centre. Returns how far
/// they are compressed, mean of both.
pub(super) fn primary(
    vehicle: &Vehicle,
    along_m: f64,
    (bogie, axes, on_bogie): (&BodyState, &Axes, &mut Wrench),
    (wheelset, on_wheelset): (&BodyState, &mut Wrench),
    ledger: &mut Ledger,
) -> f64 {
    let mut compression_m = 0.0;
    let axle = wheelset.rotation * Vector::Y;
    let drop = vehicle.wheel_radius_m - vehicle.bogie_cg_m;
    let over_axle = bogie.position + axes.x * along_m + axes.z * drop;
    for side in [-1.0, 1.0] {
        let lateral = side * vehicle.half_primary_m;
        let above = over_axle + axes.y * lateral;
        // The box sits on the axle's line: turning, the wheelset does not move it, and takes no
        // torque about that line from it.
        let bearing = wheelset.position + axle * lateral;
        let rate = bogie.velocity_at(bearing) - wheelset.velocity_at(bearing);
        let stretch = above - bearing;
        compression_m -= 0.5 * axes.z.dot(stretch);
        let force = axes.force(&vehicle.primary, stretch, rate, ledger);
        on_bogie.add_at(bogie, force, bearing);
        on_wheelset.add_at(wheelset, -force, bearing);
    }
    compression_m
}

/// Springs, bump stops, roll bar and traction rod between a car and a bogie `along_m` ahead of its
/// centre. Returns how far the springs are compressed, mean of both sides.
pub(super) fn secondary(
    vehicle: &Vehicle,
    along_m: f64,
    (car, on_car): (&BodyState, &mut Wrench),
    (bogie, on_bogie): (&BodyState, &mut Wrench),
    ledger: &mut Ledger,
) -> f64 {
    // Halfway between both bodies, as the points where the forces act: so they have a potential.
    let axes = Axes::of(car.rotation.lerp(bogie.rotation, 0.5));
    let mut compression_m = 0.0;
    let mut pair = |force: Vector, world: Vector| {
        on_car.add_at(car, force, world);
        on_bogie.add_at(bogie, -force, world);
    };
    let ends = |lateral: f64, height: f64| {
        let upper = car.point(Vector::new(along_m, lateral, height - vehicle.car_cg_m));
        let lower = bogie.point(Vector::new(0.0, lateral, height - vehicle.bogie_cg_m));
        let middle = (upper + lower) * 0.5;
        let rate = car.velocity_at(middle) - bogie.velocity_at(middle);
        (upper - lower, rate, middle)
    };
    let (play, stop) = vehicle.stop;
    for side in [-1.0, 1.0] {
        let (stretch, rate, middle) = ends(side * vehicle.half_secondary_m, vehicle.secondary_m);
        let up = axes.z.dot(stretch);
        compression_m -= 0.5 * up;
        let (push, stored) = beyond(up, play, stop);
        ledger.springs_j += stored;
        let force = axes.force(&vehicle.secondary, stretch, rate, ledger);
        pair(force + axes.z * push, middle);
    }
    let (stiffness, damping) = vehicle.traction_rod;
    let (stretch, rate, middle) = ends(0.0, vehicle.bogie_cg_m);
    let (x, v) = (axes.x.dot(stretch), axes.x.dot(rate));
    let (push, stored) = beyond(axes.y.dot(stretch), play, stop);
    ledger.springs_j += 0.5 * stiffness * x * x + stored;
    ledger.dampers_w += damping * v * v;
    pair(
        axes.x * -(stiffness * x + damping * v) + axes.y * push,
        middle,
    );
    let turn = bogie.rotation.inverse() * car.rotation;
    let roll_rad = 2.0 * turn.x * turn.w.signum();
    let torque = axes.x * (-vehicle.roll_bar_n_m_rad * roll_rad);
    ledger.springs_j += 0.5 * vehicle.roll_bar_n_m_rad * roll_rad * roll_rad;
    on_car.torque += torque;
    on_bogie.torque -= torque;
    compression_m
}

/// Coupler between the rear end of one car and the front end of the next: it pulls and buffs
/// along, with its slack between, and leaves the rest free. Returns its pull.
pub(super) fn coupler(
    coupler: &Coupler,
    (rear_end, front_end): (Vector, Vector),
    (leading, on_leading): (&BodyState, &mut Wrench),
    (following, on_following): (&BodyState, &mut Wrench),
    ledger: &mut Ledger,
) -> f64 {
    let (a, b) = (leading.point(rear_end), following.point(front_end));
    let middle = (a + b) * 0.5;
    let along = (leading.rotation * Vector::X + following.rotation * Vector::X).normalize();
    let rate = along.dot(leading.velocity_at(middle) - following.velocity_at(middle));
    let play = 0.5 * coupler.slack_m;
    let (spring, stored) = beyond(along.dot(a - b), play, coupler.stiffness_n_m);
    let touching = coupler.slack_m <= 0.0 || spring.abs() > 0.0;
    let damper = f64::from(u8::from(touching)) * coupler.damping_n_s_m * rate;
    ledger.springs_j += stored;
    ledger.dampers_w += damper * rate;
    let force = along * (spring - damper);
    on_leading.add_at(leading, force, middle);
    on_following.add_at(following, -force, middle);
    damper - spring
}
