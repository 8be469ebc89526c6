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
use std::cmp::Ordering;

/// Pose of a centre of gravity with its velocities, world.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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
    let damper = coupler.damping_n_s_m * rate;
    // With slack, what buffs does not pull, what pulls does not buff, and between is nothing.
    let damper = match spring.partial_cmp(&0.0) {
        _ if coupler.slack_m <= 0.0 => damper,
        Some(Ordering::Less) => damper.max(spring),
        Some(Ordering::Greater) => damper.min(spring),
        _ => 0.0,
    };
    ledger.springs_j += stored;
    ledger.dampers_w += damper * rate;
    let force = along * (spring - damper);
    on_leading.add_at(leading, force, middle);
    on_following.add_at(following, -force, middle);
    damper - spring
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "nothing is exactly nothing")]
mod tests {
    use super::*;
    use crate::twin::physics::vehicle_file::VehicleFile;

    fn vehicle() -> Vehicle {
        match VehicleFile::shipped("metro_b1_empty") {
            Some(file) => Vehicle::new(file),
            None => unreachable!("it comes with the program"),
        }
    }

    fn at(position: Vector, velocity: Vector) -> BodyState {
        BodyState {
            position,
            rotation: Rotation::IDENTITY,
            velocity,
            angular: Vector::ZERO,
        }
    }

    /// Fails where a coupler pulls or buffs within its slack, by another stiffness beyond it, where it
    /// sticks as its ends part, or where its account is not force times way.
    #[test]
    fn a_coupler_takes_up_its_slack_first() {
        let v = vehicle();
        let gear = Coupler {
            slack_m: 0.02,
            ..v.coupler
        };
        let pull = |apart_m: f64, parting_mps: f64| {
            let ahead = at(Vector::X * apart_m, Vector::X * parting_mps);
            let behind = at(-Vector::X * v.length_m, Vector::ZERO);
            let ends = (v.coupler_m(-1.0), v.coupler_m(1.0));
            let (mut a, mut b, mut ledger) = Default::default();
            let pull_n = coupler(
                &gear,
                ends,
                (&ahead, &mut a),
                (&behind, &mut b),
                &mut ledger,
            );
            assert_eq!(a.force, -b.force);
            assert!((a.force.x + pull_n).abs() < 1e-9);
            (pull_n, ledger)
        };
        for (apart_m, want_n) in [
            (0.0, 0.0),
            (0.0099, 0.0),
            (-0.0099, 0.0),
            (0.015, 0.005 * gear.stiffness_n_m),
            (-0.015, -0.005 * gear.stiffness_n_m),
        ] {
            let (got_n, ledger) = pull(apart_m, 0.0);
            assert!((got_n - want_n).abs() < 1e-3, "{apart_m}: {got_n}");
            let stored_j = 0.5 * want_n * want_n / gear.stiffness_n_m;
            assert!((ledger.springs_j - stored_j).abs() < 1e-6);
        }
        // Within the slack nothing damps; parting fast out of a buff does not pull.
        assert_eq!(pull(0.0, 1.0).0, 0.0);
        let (got_n, ledger) = pull(-0.011, 1.0);
        assert_eq!(got_n, 0.0);
        assert!((ledger.dampers_w - 0.001 * gear.stiffness_n_m).abs() < 1e-6);
    }

    /// Fails where a bump stop is met early, late, on one side only, or not at all.
    #[test]
    fn bump_stops_are_met_after_their_play() {
        let v = vehicle();
        let (play, stop) = v.stop;
        let force = |aside: Vector| {
            let car = at(Vector::Z * v.car_cg_m + aside, Vector::ZERO);
            let bogie = at(Vector::Z * v.bogie_cg_m, Vector::ZERO);
            let (mut on_car, mut on_bogie, mut ledger) = Default::default();
            secondary(
                &v,
                0.0,
                (&car, &mut on_car),
                (&bogie, &mut on_bogie),
                &mut ledger,
            );
            on_car.force
        };
        let spring = v.secondary.stiffness_n_m;
        for sign in [-1.0, 1.0] {
            for past_m in [-0.02, 0.0, 0.01] {
                let x = play + past_m;
                let stops_n = stop * past_m.max(0.0);
                let across = -sign * (2.0 * spring.y * x + stops_n);
                let got = force(Vector::Y * (sign * x)).y;
                assert!((got - across).abs() < 1e-6 * across.abs(), "{got} {across}");
                let up = 2.0 * (v.secondary.preload_n - sign * (spring.z * x + stops_n));
                let got = force(Vector::Z * (sign * x)).z;
                assert!((got - up).abs() < 1e-6 * up.abs().max(1e3), "{got} {up}");
            }
        }
    }
}
