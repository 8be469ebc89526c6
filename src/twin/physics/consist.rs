//! The train: rigid bodies of rapier for car bodies, bogies and wheelsets. What acts on them: forces.rs.

mod forces;

use super::PhysicsError;
use super::driver::Instruments;
use super::energy::{EnergyBook, Ledger};
use super::entity::{Entity, train_name};
use super::groups::{self, train_group};
use super::history::VehicleMotion;
use super::placement::{BODIES, body_name, is_wheelset, place_train, wheelset_of};
use super::route_track::RouteTrack;
use super::settings::TrainSettings;
use super::slide_protection::ReferenceSpeed;
use super::suspension::{BodyState, Wrench};
use super::vehicle::{GRAVITY_MPS2, Mass, Vehicle};
use super::wheelset::{WheelExtremes, Wheelset};
use crate::bus::{SimTime, TrainEnd, TrainId};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rapier3d_f64::math::{Pose, Vector};
use rapier3d_f64::prelude::{
    ColliderBuilder, ColliderHandle, Group, MassProperties, PhysicsWorld, RigidBodyBuilder,
    RigidBodyHandle,
};

/// Lowest parts of a car over top of rail: guard irons hang 60 mm over the rails.
const UNDERSIDE_M: f64 = 0.06;
/// How quickly a train that is brought to its starting state is held to its speed.
const HOLD_PER_S: f64 = 50.0;

/// The train.
#[derive(Clone, Default)]
pub(super) struct Consist {
    pub id: TrainId,
    pub vehicle: Vehicle,
    pub settings: TrainSettings,
    pub wheelsets: Vec<Wheelset>,
    reference: ReferenceSpeed,
    /// Of every car in turn: itself, its bogies, its wheelsets, at the start of the step.
    pub states: Vec<BodyState>,
    /// Mean compression of the leading axle's primary springs.
    pub primary_travel_m: f64,
    /// And of the secondary springs over it.
    pub secondary_travel_m: f64,
    /// Pull of every coupler.
    pub couplers_n: Vec<f64>,
    pub handles: Vec<RigidBodyHandle>,
    pub colliders: Vec<ColliderHandle>,
    wrenches: Vec<Wrench>,
    /// Leading car before the step.
    previous: BodyState,
    ledger: Ledger,
    book: EnergyBook,
    start_potential_j: f64,
}

impl Consist {
    /// Puts the train on the track with its head at a chainage, running.
    pub(super) fn new(
        world: &mut PhysicsWorld,
        track: &RouteTrack,
        settings: &TrainSettings,
        head_m: f64,
        id: TrainId,
    ) -> Self {
        let vehicle = settings.vehicle();
        let alignment = track.alignment();
        let speed_mps = settings.start_speed_kmh / 3.6;
        let cars = place_train(&vehicle, track, settings.cars, head_m, speed_mps);
        let Some(previous) = cars.first().map(|car| car[0]) else {
            unreachable!("a train has at least one car: the settings are checked");
        };
        let mut consist = Self {
            id,
            vehicle,
            settings: settings.clone(),
            states: cars.concat(),
            couplers_n: vec![0.0; cars.len() - 1],
            wrenches: vec![Wrench::default(); BODIES * cars.len()],
            reference: ReferenceSpeed::new(speed_mps),
            previous,
            ..Self::default()
        };
        for car in &cars {
            consist.insert(world, car);
            for state in &car[3..] {
                let s_m = alignment
                    .track_from_world(&state.position.into(), head_m)
                    .s_m;
                let roll_rad = alignment.at(s_m).roll_rad;
                let wheelset = Wheelset::new(s_m, roll_rad, speed_mps);
                consist.wheelsets.push(wheelset);
            }
        }
        consist
    }

    /// The bodies of a car, and the box that hits things.
    fn insert(&mut self, world: &mut PhysicsWorld, states: &[BodyState; BODIES]) {
        for (k, state) in states.iter().enumerate() {
            let Mass { kg, kg_m2 } = self.mass(k);
            let body = RigidBodyBuilder::dynamic()
                .pose(Pose::from_parts(state.position, state.rotation))
                .linvel(state.velocity)
                .angvel(state.angular)
                .additional_mass_properties(MassProperties::new(Vector::ZERO, kg, kg_m2))
                .gyroscopic_forces_enabled(is_wheelset(k))
                .can_sleep(false);
            self.handles.push(world.insert_body(body));
        }
        let half = self.half_extents_m();
        let collider = ColliderBuilder::cuboid(half.x, half.y, half.z)
            .translation(self.box_centre_m())
            .density(0.0)
            .friction(0.3)
            .restitution(0.1)
            .collision_groups(groups::train(self.id))
            // By default a body is of every group, and nobody could keep out of its way.
            .solver_groups(groups::groups(train_group(self.id), Group::ALL))
            .user_data(Entity::Train(self.id).user_data());
        let car = self.handles[self.handles.len() - BODIES];
        self.colliders
            .push(world.insert_collider(collider, Some(car)));
    }

    /// Of body `k`, for messages.
    fn body_name(&self, k: usize) -> String {
        match self.id.index() {
            0 => body_name(k),
            _ => format!("{} of {}", body_name(k), train_name(self.id)),
        }
    }

    /// Of body `k`.
    fn mass(&self, k: usize) -> Mass {
        match k % BODIES {
            0 => self.vehicle.car,
            1 | 2 => self.vehicle.bogie,
            _ => self.vehicle.wheelset,
        }
    }

    /// Half extents of a car's box, from its underside to its roof.
    pub(super) fn half_extents_m(&self) -> Vector3<f64> {
        let v = &self.vehicle;
        Vector3::new(v.length_m, v.width_m, v.height_m - UNDERSIDE_M) / 2.0
    }

    /// Centre of a car's box over its centre of gravity.
    fn box_centre_m(&self) -> Vector {
        let middle = 0.5 * (self.vehicle.height_m + UNDERSIDE_M);
        Vector::new(0.0, 0.0, middle - self.vehicle.car_cg_m)
    }

    /// Origin of the vehicle frame in the leading car's body.
    fn head_m(&self) -> Vector {
        Vector::new(0.5 * self.vehicle.length_m, 0.0, -self.vehicle.car_cg_m)
    }

    /// Length over couplers.
    pub(super) fn length_m(&self) -> f64 {
        self.vehicle.length_m * f64::from(self.settings.cars)
    }

    /// Mass of the train, without what rotating parts add.
    pub(super) fn mass_kg(&self) -> f64 {
        self.vehicle.total_kg() * f64::from(self.settings.cars)
    }

    /// Chainage of the train head, by its leading wheelset.
    pub(super) fn head_chainage_m(&self) -> f64 {
        let v = &self.vehicle;
        let overhang_m = 0.5 * v.length_m - v.semi_bogie_distance_m - v.semi_wheelbase_m;
        self.wheelsets[0].s_m + overhang_m
    }

    /// Distance along the route of its first wheelset.
    pub(super) fn front_axle_m(&self) -> f64 {
        self.wheelsets[0].s_m
    }

    /// Distances along the route of its head and of its tail.
    pub(super) fn stands_m(&self) -> (f64, f64) {
        let head_m = self.head_chainage_m();
        (head_m, head_m - self.length_m())
    }

    /// Chainage of the train's middle.
    fn middle_m(&self) -> f64 {
        self.head_chainage_m() - 0.5 * self.length_m()
    }

    /// What the driver goes by.
    pub(super) fn instruments(&self, time: SimTime, track: &RouteTrack) -> Instruments {
        let v = &self.vehicle;
        let slope = track.alignment().at(self.middle_m()).slope;
        let share = v.total_kg() / v.effective_kg();
        Instruments {
            time_s: time.secs(),
            chainage_m: self.head_chainage_m(),
            speed_mps: self.speed_mps(),
            resistance_mps2: self.davis_mps2(track) + GRAVITY_MPS2 * slope * share,
        }
    }

    /// Speed over ground of the leading bogie.
    pub(super) fn speed_mps(&self) -> f64 {
        let state = &self.states[1];
        state.velocity.dot(state.rotation * Vector::X)
    }

    /// Running resistance as a deceleration, without gradients and curves: those take theirs by
    /// weight and by creep.
    fn davis_mps2(&self, track: &RouteTrack) -> f64 {
        let (s, v) = (&self.settings, self.speed_mps().abs());
        let section = track.track.section_at(self.middle_m());
        let confined = match section.is_some_and(|section| section.closed) {
            true => s.tunnel_factor,
            false => 1.0,
        };
        s.davis_a_mps2 + s.davis_b_per_s * v + confined * s.davis_c_per_m * v * v
    }

    /// Reads the bodies back after a step.
    pub(super) fn read(&mut self, world: &PhysicsWorld, time: SimTime) -> Result<(), PhysicsError> {
        for (k, (handle, state)) in self.handles.iter().zip(&mut self.states).enumerate() {
            let Some(body) = world.bodies.get(*handle).filter(|b| b.is_enabled()) else {
                let body = self.body_name(k);
                return Err(PhysicsError::NonFinite { body, time });
            };
            *state = BodyState {
                position: body.translation(),
                rotation: *body.rotation(),
                velocity: body.linvel(),
                angular: body.angvel(),
            };
        }
        Ok(())
    }

    /// Whether a wheelset has left the rails.
    pub(super) fn on_rails(&self, time: SimTime) -> Result<(), PhysicsError> {
        let off = self.wheelsets.iter().position(Wheelset::derailed);
        off.map_or(Ok(()), |axle| {
            Err(PhysicsError::Derailed {
                train: self.id,
                body: self.body_name(wheelset_of(axle)),
                time,
            })
        })
    }

    /// Pulls every body towards a speed along the track, against its weight's share along it: a
    /// train that is being brought to the state in which its run begins.
    pub(super) fn hold_speed(&mut self, world: &mut PhysicsWorld, speed_mps: f64, dt_s: f64) {
        for (k, handle) in self.handles.iter().enumerate() {
            let state = &self.states[k];
            let along = if is_wheelset(k) {
                state.velocity.normalize_or_zero()
            } else {
                state.rotation * Vector::X
            };
            let off = speed_mps - state.velocity.dot(along);
            let pull = off * (HOLD_PER_S * dt_s).min(1.0) / dt_s + GRAVITY_MPS2 * along.z;
            if let Some(body) = world.bodies.get_mut(*handle) {
                body.add_force(along * (self.mass(k).kg * pull), true);
            }
        }
    }

    /// Starts the energy book.
    pub(super) fn open_book(&mut self) {
        self.book = EnergyBook::default();
        self.start_potential_j = self.potential_j();
        self.book.start_kinetic_j = self.kinetic_j();
        for wheelset in &mut self.wheelsets {
            wheelset.rolled_m = 0.0;
            wheelset.extremes = WheelExtremes::default();
        }
    }

    /// The energy book as it stands.
    pub(super) fn book(&self) -> EnergyBook {
        EnergyBook {
            kinetic_j: self.kinetic_j(),
            potential_j: self.potential_j() - self.start_potential_j,
            ..self.book
        }
    }

    fn kinetic_j(&self) -> f64 {
        let of = |(k, state): (usize, &BodyState)| {
            let Mass { kg, kg_m2 } = self.mass(k);
            let turn = state.rotation.inverse() * state.angular;
            0.5 * (kg * state.velocity.length_squared() + (kg_m2 * turn).dot(turn))
        };
        self.states.iter().enumerate().map(of).sum()
    }

    /// Of weights, and of springs as of the last step.
    fn potential_j(&self) -> f64 {
        let bodies = self.states.iter().enumerate();
        let weights: f64 = bodies
            .map(|(k, s)| self.mass(k).kg * GRAVITY_MPS2 * s.position.z)
            .sum();
        weights + self.ledger.springs_j
    }

    /// Motion of the vehicle frame of one end.
    pub(super) fn motion(&self, end: TrainEnd, time: SimTime) -> VehicleMotion {
        let front = self.head_m();
        let (body, origin) = match end {
            TrainEnd::Front => (0, front),
            TrainEnd::Rear => (
                self.states.len() - BODIES,
                Vector::new(-front.x, front.y, front.z),
            ),
        };
        let car = &self.states[body];
        let origin = car.point(origin);
        let world_from_car = Isometry3::from(Pose::from_parts(origin, car.rotation));
        VehicleMotion {
            time,
            world_from_vehicle: match end {
                TrainEnd::Front => world_from_car,
                TrainEnd::Rear => world_from_car * about_turned(),
            },
            velocity_mps: car.velocity_at(origin).into(),
            angular_rad_s: car.angular.into(),
        }
    }

    /// The car bodies, leading car first.
    fn cars(&self) -> impl Iterator<Item = &BodyState> + '_ {
        self.states.iter().step_by(BODIES)
    }

    /// Poses of the centres of the car bodies' boxes, leading car first.
    pub(super) fn boxes(&self) -> impl Iterator<Item = Isometry3<f64>> + '_ {
        let centre = self.box_centre_m();
        self.cars()
            .map(move |car| Pose::from_parts(car.point(centre), car.rotation).into())
    }

    /// Velocities of the car bodies.
    pub(super) fn velocities_mps(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        self.cars().map(|car| car.velocity.into())
    }

    /// Acceleration over the last step of the leading car's centre of gravity along a direction.
    pub(super) fn accel_mps2(&self, along: Vector3<f64>, dt_s: f64) -> f64 {
        (self.states[0].velocity - self.previous.velocity).dot(along.into()) / dt_s
    }

    /// Acceleration over the last step of the leading car's floor over its first bogie, in the
    /// car's axes.
    pub(super) fn floor_accel_mps2(&self, dt_s: f64) -> Vector3<f64> {
        let v = &self.vehicle;
        let floor = Vector::new(v.semi_bogie_distance_m, 0.0, v.floor_m - v.car_cg_m);
        let velocity = |s: &BodyState| s.velocity_at(s.point(floor));
        let change = velocity(&self.states[0]) - velocity(&self.previous);
        Vector3::from(self.states[0].rotation.inverse() * change) / dt_s
    }
}

/// The last car's frame in that of its cab, which looks back.
fn about_turned() -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI)
}
