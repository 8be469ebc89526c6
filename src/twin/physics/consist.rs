//! The train: rigid bodies of rapier for car bodies and bogies, wheelsets held by the rails.
//!
//! Wheelsets and rotating parts have no body, but their inertia along the track is there: since
//! every force on a bogie is applied by hand, a share m_add/(m + m_add) of the sum along the
//! track is taken off again, which leaves exactly the acceleration of m + m_add.

use super::PhysicsError;
use super::convert::{isometry, point, point3, rotation, vector, vector3};
use super::driver::{Effort, Instruments};
use super::history::VehicleMotion;
use super::irregularity::Irregularity;
use super::settings::TrainSettings;
use super::suspension::{Axes, BodyState, Wheelset, Wrench, coupler, primary, secondary};
use super::vehicle::{COUPLER, COUPLER_HEIGHT_M, GRAVITY_MPS2, Vehicle};
use crate::bus::SimTime;
use crate::track::Alignment;
use nalgebra::{Isometry3, Vector3};
use rapier3d_f64::math::{Pose, Rotation, Vector};
use rapier3d_f64::prelude::{
    ColliderBuilder, ColliderHandle, Group, InteractionGroups, InteractionTestMode, MassProperties,
    PhysicsWorld, RigidBodyBuilder, RigidBodyHandle,
};

/// What trains hit and are hit by: obstacles only.
pub(super) const TRAIN_GROUP: Group = Group::GROUP_1;
pub(super) const OBSTACLE_GROUP: Group = Group::GROUP_2;
/// Lowest parts of a car over top of rail: guard irons hang 60 mm over the rails.
const UNDERSIDE_M: f64 = 0.06;
/// Brake discs and pads give by this before they slip.
const BRAKE_STIFFNESS_N_M: f64 = 5.0e6;
const BRAKE_DAMPING_N_S_M: f64 = 3.0e5;
/// The floor over top of rail, where comfort is measured.
const FLOOR_M: f64 = 1.1;

/// Where a wheelset stands.
#[derive(Clone, Copy)]
struct Contact {
    s_m: f64,
    /// By cant; its change turns the wheelset.
    roll_rad: f64,
}

/// The train.
pub(super) struct Consist {
    pub vehicle: Vehicle,
    pub settings: TrainSettings,
    pub cars: Vec<Car>,
    /// Distance that the leading wheelset has run.
    pub run_m: f64,
    /// Mean compression of the leading car's front secondary springs.
    pub secondary_travel_m: f64,
    bogies: Vec<Bogie>,
    /// State of bodies at the start of the step: car, front bogie, rear bogie of each car.
    states: Vec<BodyState>,
    wrenches: Vec<Wrench>,
    /// Leading car before the step.
    previous: BodyState,
}

/// A car body.
pub(super) struct Car {
    pub body: RigidBodyHandle,
    pub collider: ColliderHandle,
}

struct Bogie {
    body: RigidBodyHandle,
    /// Its front and rear wheelset.
    contacts: [Contact; 2],
    /// Elastic slip of its brake.
    brake_slip_m: f64,
}

impl Consist {
    /// Puts the train on the track with its head at the starting chainage, running.
    pub(super) fn new(
        world: &mut PhysicsWorld,
        alignment: &Alignment,
        settings: &TrainSettings,
    ) -> Self {
        let vehicle = Vehicle::of(settings.vehicle);
        let mut consist = Self {
            vehicle,
            settings: settings.clone(),
            cars: Vec::new(),
            bogies: Vec::new(),
            run_m: 0.0,
            secondary_travel_m: 0.0,
            states: Vec::new(),
            wrenches: Vec::new(),
            previous: BodyState {
                position: Vector::ZERO,
                rotation: Rotation::IDENTITY,
                velocity: Vector::ZERO,
                angular: Vector::ZERO,
            },
        };
        let mut front_end: Option<Vector> = None;
        let mut front_s = settings.start_chainage_m
            - (0.5 * settings.car_length_m - vehicle.semi_bogie_distance_m);
        for _ in 0..settings.cars {
            // Where the track bends, cars are chords: their couplers shall meet all the same.
            let [mut car, mut front, mut rear] = consist.placed(alignment, front_s);
            if let Some(end) = front_end {
                for _ in 0..6 {
                    let gap = end - car.point(consist.coupler_m(1.0));
                    front_s += gap.dot(car.rotation * Vector::X);
                    [car, front, rear] = consist.placed(alignment, front_s);
                }
            }
            front_end = Some(car.point(consist.coupler_m(-1.0)));
            front_s -= settings.car_length_m;
            consist.insert(world, alignment, [car, front, rear]);
        }
        consist.previous = consist.states[0];
        consist
    }

    /// A car with its bogies at rest on the track's designed place, the front bogie at `front_s`.
    fn placed(&self, alignment: &Alignment, front_s: f64) -> [BodyState; 3] {
        let v = &self.vehicle;
        let speed = self.settings.start_speed_kmh / 3.6;
        let distance = 2.0 * v.semi_bogie_distance_m;
        let bogie = |s_m: f64| {
            let frame = alignment.at(s_m);
            let rotation = rotation(&frame.world_from_rails().rotation);
            let along = rotation * Vector::X;
            BodyState {
                position: point(frame.origin) + rotation * Vector::Z * v.bogie_cg_m,
                rotation,
                velocity: along * speed,
                angular: Vector::Z * (speed * frame.curvature_per_m),
            }
        };
        let front = bogie(front_s);
        let mut rear_s = front_s - distance;
        let mut rear = bogie(rear_s);
        for _ in 0..4 {
            let short = distance - (front.position - rear.position).length();
            rear_s -= short;
            rear = bogie(rear_s);
        }
        // The car's x axis joins the bogies, its z axis leans as they do.
        let x = (front.position - rear.position).normalize();
        let lean = front.rotation * Vector::Z + rear.rotation * Vector::Z;
        let y = lean.cross(x).normalize();
        let z = x.cross(y);
        let axes = nalgebra::Matrix3::from_columns(&[vector3(x), vector3(y), vector3(z)]);
        let turn = nalgebra::UnitQuaternion::from_matrix(&axes);
        let middle = (front.position + rear.position) * 0.5;
        let car = BodyState {
            position: middle + z * (v.car_cg_m - v.bogie_cg_m),
            rotation: rotation(&turn),
            velocity: (front.velocity + rear.velocity) * 0.5,
            angular: (front.angular + rear.angular) * 0.5,
        };
        [car, front, rear]
    }

    fn insert(&mut self, world: &mut PhysicsWorld, alignment: &Alignment, states: [BodyState; 3]) {
        let v = self.vehicle;
        let masses = [
            (v.car_mass_kg, v.car_inertia_kg_m2),
            (v.bogie_mass_kg, v.bogie_inertia_kg_m2),
            (v.bogie_mass_kg, v.bogie_inertia_kg_m2),
        ];
        let bodies = [0, 1, 2].map(|k| {
            let s = &states[k];
            let (mass, inertia) = masses[k];
            world.insert_body(
                RigidBodyBuilder::dynamic()
                    .pose(Pose::from_parts(s.position, s.rotation))
                    .linvel(s.velocity)
                    .angvel(s.angular)
                    .additional_mass_properties(MassProperties::new(Vector::ZERO, mass, inertia))
                    .can_sleep(false),
            )
        });
        let half = self.half_extents_m();
        let collider = ColliderBuilder::cuboid(half.x, half.y, half.z)
            .translation(vector(self.box_centre_m()))
            .density(0.0)
            .friction(0.3)
            .restitution(0.1)
            .collision_groups(InteractionGroups::new(
                TRAIN_GROUP,
                OBSTACLE_GROUP,
                InteractionTestMode::And,
            ));
        let collider = world.insert_collider(collider, Some(bodies[0]));
        self.cars.push(Car {
            body: bodies[0],
            collider,
        });
        for k in [1, 2] {
            let p = point3(states[k].position);
            let s_m = alignment
                .track_from_world(&p, self.settings.start_chainage_m)
                .s_m;
            self.bogies.push(Bogie {
                body: bodies[k],
                contacts: [v.semi_wheelbase_m, -v.semi_wheelbase_m].map(|ahead| Contact {
                    s_m: s_m + ahead,
                    roll_rad: alignment.at(s_m + ahead).roll_rad,
                }),
                brake_slip_m: 0.0,
            });
        }
        self.states.extend(states);
        self.wrenches.extend([Wrench::default(); 3]);
    }

    /// Half extents of a car's box, from its underside to its roof.
    pub(super) fn half_extents_m(&self) -> Vector3<f64> {
        let s = &self.settings;
        Vector3::new(s.car_length_m, s.width_m, s.height_m - UNDERSIDE_M) / 2.0
    }

    /// Centre of a car's box over its centre of gravity.
    fn box_centre_m(&self) -> Vector3<f64> {
        let middle = 0.5 * (self.settings.height_m + UNDERSIDE_M);
        Vector3::new(0.0, 0.0, middle - self.vehicle.car_cg_m)
    }

    fn coupler_m(&self, end: f64) -> Vector {
        Vector::new(
            end * 0.5 * self.settings.car_length_m,
            0.0,
            COUPLER_HEIGHT_M - self.vehicle.car_cg_m,
        )
    }

    /// Origin of the vehicle frame in the leading car's body.
    fn head_m(&self) -> Vector {
        Vector::new(
            0.5 * self.settings.car_length_m,
            0.0,
            -self.vehicle.car_cg_m,
        )
    }

    /// Whole mass, rotating parts included, over the number of bogies.
    fn effective_mass_per_bogie_kg(&self) -> f64 {
        0.5 * self.vehicle.total_mass_kg() * (1.0 + self.settings.rotating_mass_share)
    }

    /// What the driver goes by.
    pub(super) fn instruments(&self, time: SimTime, alignment: &Alignment) -> Instruments {
        let speed_mps = self.speed_mps();
        let s = &self.settings;
        let middle = self.bogies[0].contacts[0].s_m - 0.5 * s.car_length_m * f64::from(s.cars);
        let slope = alignment.at(middle).slope;
        Instruments {
            time_s: time.secs(),
            chainage_m: self.bogies[0].contacts[0].s_m + self.overhang_m(),
            speed_mps,
            resistance_mps2: self.davis_mps2(speed_mps)
                + GRAVITY_MPS2 * slope / (1.0 + s.rotating_mass_share),
        }
    }

    fn overhang_m(&self) -> f64 {
        let v = &self.vehicle;
        0.5 * self.settings.car_length_m - v.semi_bogie_distance_m - v.semi_wheelbase_m
    }

    /// Speed over ground of the leading bogie.
    pub(super) fn speed_mps(&self) -> f64 {
        let state = &self.states[1];
        state.velocity.dot(state.rotation * Vector::X)
    }

    fn davis_mps2(&self, speed_mps: f64) -> f64 {
        let (s, v) = (&self.settings, speed_mps.abs());
        s.davis_a_mps2 + s.davis_b_per_s * v + s.davis_c_per_m * v * v
    }

    /// Puts the forces of this step on the bodies.
    pub(super) fn apply_forces(
        &mut self,
        world: &mut PhysicsWorld,
        alignment: &Alignment,
        irregularity: &Irregularity,
        effort: Effort,
        dt_s: f64,
    ) {
        self.previous = self.states[0];
        self.wrenches.fill(Wrench::default());
        self.body_forces();
        for k in 0..self.bogies.len() {
            self.bogie_forces(k, alignment, irregularity, effort, dt_s);
        }
        let handles = handles(&self.cars, &self.bogies);
        for (handle, wrench) in handles.zip(&self.wrenches) {
            if let Some(body) = world.bodies.get_mut(handle) {
                body.reset_forces(false);
                body.reset_torques(false);
                body.add_force(wrench.force, true);
                body.add_torque(wrench.torque, true);
            }
        }
    }

    /// Secondary suspension and couplers.
    fn body_forces(&mut self) {
        let a = self.vehicle.semi_bogie_distance_m;
        for k in 0..self.cars.len() {
            let states = &self.states[3 * k..3 * k + 3];
            if let [on_car, on_front, on_rear] = &mut self.wrenches[3 * k..3 * k + 3] {
                let v = &self.vehicle;
                let travel = secondary(v, a, (&states[0], on_car), (&states[1], on_front));
                secondary(v, -a, (&states[0], on_car), (&states[2], on_rear));
                if k == 0 {
                    self.secondary_travel_m = travel;
                }
            }
        }
        let (rear_end, front_end) = (self.coupler_m(-1.0), self.coupler_m(1.0));
        for k in 1..self.cars.len() {
            let (before, after) = self.wrenches.split_at_mut(3 * k);
            let (leading, following) = (3 * (k - 1), 3 * k);
            coupler(
                COUPLER,
                rear_end,
                front_end,
                (&self.states[leading], &mut before[leading]),
                (&self.states[following], &mut after[0]),
            );
        }
    }

    /// Primary suspension, traction, brake and resistance of bogie `k`.
    fn bogie_forces(
        &mut self,
        k: usize,
        alignment: &Alignment,
        irregularity: &Irregularity,
        effort: Effort,
        dt_s: f64,
    ) {
        let at = 3 * (k / 2) + 1 + k % 2;
        let (state, mut wrench) = (self.states[at], self.wrenches[at]);
        let v = self.vehicle;
        let mut along = Vector::ZERO;
        for (end, sign) in [1.0, -1.0].into_iter().enumerate() {
            let along_m = sign * v.semi_wheelbase_m;
            let axle = Vector::new(along_m, 0.0, v.wheel_radius_m - v.bogie_cg_m);
            let axle = state.point(axle);
            let velocity = state.velocity_at(axle);
            let contact = &mut self.bogies[k].contacts[end];
            let wheelset = contact.follow(alignment, irregularity, axle, velocity, dt_s);
            if k == 0 && end == 0 {
                self.run_m += wheelset.velocity.dot(wheelset.axes.x) * dt_s;
            }
            primary(&v, &wheelset, along_m, &state, &mut wrench);
            along += wheelset.axes.x * 0.5;
        }
        let speed = state.velocity.dot(along);
        let mass = self.effective_mass_per_bogie_kg();
        let push = effort.traction_mps2 * mass
            + self.bogies[k].brake(effort.brake_mps2 * mass, speed, dt_s)
            - self.davis_mps2(speed) * mass * (speed / 0.1).clamp(-1.0, 1.0);
        let axle_level = Vector::new(0.0, 0.0, v.wheel_radius_m - v.bogie_cg_m);
        wrench.add_at(&state, along * push, state.point(axle_level));
        // Weight of the wheelsets down the gradient, and all inertia without a body.
        let gravity = along.dot(Vector::Z) * -GRAVITY_MPS2;
        let unsprung = 2.0 * v.wheelset_mass_kg;
        let added = mass - 0.5 * v.car_mass_kg - v.bogie_mass_kg;
        let total = wrench.force.dot(along) + gravity * (v.bogie_mass_kg + unsprung);
        let accel = total / (v.bogie_mass_kg + added);
        wrench.force += along * (gravity * unsprung - accel * added);
        self.wrenches[at] = wrench;
    }

    /// Reads the bodies back after a step.
    pub(super) fn read(&mut self, world: &PhysicsWorld, time: SimTime) -> Result<(), PhysicsError> {
        for (k, handle) in handles(&self.cars, &self.bogies).enumerate() {
            let Some(body) = world.bodies.get(handle).filter(|b| b.is_enabled()) else {
                let part = ["body", "front bogie", "rear bogie"][k % 3];
                return Err(PhysicsError::NonFinite {
                    body: format!("{part} of car {}", k / 3 + 1),
                    time,
                });
            };
            self.states[k] = BodyState {
                position: body.translation(),
                rotation: *body.rotation(),
                velocity: body.linvel(),
                angular: body.angvel(),
            };
        }
        Ok(())
    }

    /// Motion of the vehicle frame.
    pub(super) fn motion(&self, time: SimTime) -> VehicleMotion {
        let car = &self.states[0];
        let origin = car.point(self.head_m());
        VehicleMotion {
            time,
            world_from_vehicle: isometry(origin, car.rotation),
            velocity_mps: vector3(car.velocity_at(origin)),
            angular_rad_s: vector3(car.angular),
        }
    }

    /// Poses of the centres of the car bodies' boxes, leading car first.
    pub(super) fn boxes(&self) -> impl Iterator<Item = Isometry3<f64>> + '_ {
        let centre = vector(self.box_centre_m());
        let cars = self.states.iter().step_by(3);
        cars.map(move |car| isometry(car.point(centre), car.rotation))
    }

    /// Velocities of the car bodies.
    pub(super) fn velocities_mps(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        let cars = self.states.iter().step_by(3);
        cars.map(|car| vector3(car.velocity))
    }

    /// Whether one of two colliders belongs to the train.
    pub(super) fn is_part(&self, a: ColliderHandle, b: ColliderHandle) -> bool {
        self.cars.iter().any(|c| c.collider == a || c.collider == b)
    }

    /// Velocity of the leading car before the last step.
    pub(super) fn velocity_before_mps(&self) -> Vector3<f64> {
        vector3(self.previous.velocity)
    }

    /// Acceleration over the last step of the leading car's centre of gravity along a direction.
    pub(super) fn accel_mps2(&self, along: Vector3<f64>, dt_s: f64) -> f64 {
        (self.states[0].velocity - self.previous.velocity).dot(vector(along)) / dt_s
    }

    /// Acceleration over the last step of the leading car's floor over its first bogie, in the
    /// car's axes.
    pub(super) fn floor_accel_mps2(&self, dt_s: f64) -> Vector3<f64> {
        let v = &self.vehicle;
        let floor = Vector::new(v.semi_bogie_distance_m, 0.0, FLOOR_M - v.car_cg_m);
        let velocity = |s: &BodyState| s.velocity_at(s.point(floor));
        let change = velocity(&self.states[0]) - velocity(&self.previous);
        vector3(self.states[0].rotation.inverse() * change) / dt_s
    }

    #[cfg(test)]
    pub(super) fn state(&self, k: usize) -> &BodyState {
        &self.states[k]
    }
}

fn handles<'a>(cars: &'a [Car], bogies: &'a [Bogie]) -> impl Iterator<Item = RigidBodyHandle> + 'a {
    cars.iter()
        .zip(bogies.chunks_exact(2))
        .flat_map(|(car, pair)| [car.body, pair[0].body, pair[1].body])
}

impl Bogie {
    /// Force of a brake that can hold `most_n`, as a friction with elastic slip (Dahl): the same
    /// law brakes a running train and holds a standing one on a gradient.
    fn brake(&mut self, most_n: f64, speed_mps: f64, dt_s: f64) -> f64 {
        let most_slip = most_n / BRAKE_STIFFNESS_N_M;
        self.brake_slip_m = (self.brake_slip_m + speed_mps * dt_s).clamp(-most_slip, most_slip);
        let force = BRAKE_STIFFNESS_N_M * self.brake_slip_m + BRAKE_DAMPING_N_S_M * speed_mps;
        -force.clamp(-most_n, most_n)
    }
}

impl Contact {
    /// The wheelset under an axle, a step of `dt_s` on.
    fn follow(
        &mut self,
        alignment: &Alignment,
        irregularity: &Irregularity,
        axle: Vector,
        axle_velocity: Vector,
        dt_s: f64,
    ) -> Wheelset {
        // Predicted to some micrometres; the rest is a step along the tangent.
        let guess = self.s_m + axle_velocity.length() * dt_s;
        let frame = alignment.at(guess);
        let designed = Axes::of(rotation(&frame.world_from_rails().rotation));
        let along = (axle - point(frame.origin)).dot(designed.x);
        self.s_m = guess + along / frame.slope.hypot(1.0);
        let d = irregularity.at(self.s_m);
        let speed = axle_velocity.dot(designed.x);
        let roll_rate = (frame.roll_rad - self.roll_rad) / dt_s + d.roll_rad_per_m * speed;
        self.roll_rad = frame.roll_rad;
        // The angle is some mrad at most.
        let (sin, cos) = d.roll_rad.sin_cos();
        let moved = designed.x + designed.y * d.left_per_m + designed.z * d.up_per_m;
        Wheelset {
            origin: point(frame.origin)
                + designed.x * along
                + designed.y * d.left_m
                + designed.z * d.up_m,
            axes: Axes {
                x: designed.x,
                y: designed.y * cos + designed.z * sin,
                z: designed.z * cos - designed.y * sin,
            },
            velocity: moved * speed,
            angular: Vector::Z * (frame.curvature_per_m * speed) + designed.x * roll_rate,
        }
    }
}
