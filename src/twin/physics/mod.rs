//! Rigid bodies: the train on its springs and the uneven track, obstacles, workers. The only place
//! that knows rapier.
//!
//! Car bodies, bogies and wheelsets are rigid bodies with six degrees of freedom each. Primary and
//! secondary suspension, couplers, traction, brakes, resistance and the forces of the rails are put
//! on them in every step; the rails lie as designed, with cant, and with a random irregularity of
//! one of the published spectra, and they give. Obstacles fall, bounce and rest by rapier's contacts, and a train that hits
//! one exchanges momentum with it.
//!
//! ```
//! use metrotwin::bus::TrainCommand;
//! use metrotwin::track::TunnelFile;
//! use metrotwin::twin::physics::{PhysicsSettings, World};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let tunnel = std::sync::Arc::new(metrotwin::track::Tunnel::from_toml(include_str!("../../../tunnels/test_bench.toml"))?);
//! let mut world = World::new(tunnel, &PhysicsSettings::default(), 1, 0)?;
//! let go = TrainCommand { permitted_speed_mps: 20.0, ..TrainCommand::default() };
//! for _ in 0..5000 {
//!     world.step(&go)?;
//! }
//! assert!(world.train().is_some_and(|t| t.speed_mps > 0.5));
//! # Ok(()) }
//! ```
//!
//! Vehicles are files; Manchester benchmark vehicle 1 (Iwnicki 1998) and a metro car of class B1
//! come with the program. The step moves positions with the new velocities (symplectic Euler, one solver iteration), so
//! springs gain no energy.
//!
//! Not modelled: real wheel profiles (treads are cones), the contact's own stiffness (the rail gives
//! more), flexible car bodies, air springs, pressure waves.
//! Trains run up the line only, and a worker cannot be run over: he is drawn, not collided with.

mod adhesion;
mod consist;
mod convert;
mod defect;
mod driver;
mod energy;
mod ground;
mod history;
mod irregularity;
mod line;
mod obstacle;
mod placement;
mod settings;
mod suspension;
#[cfg(test)]
mod tests;
mod truth;
mod vehicle;
mod wheelset;
mod worker;

pub use adhesion::{RailState, RailZone};
pub use defect::{DefectSettings, DefectShape, Side};
pub use energy::EnergyBook;
pub use history::VehicleMotion;
pub use irregularity::{IrregularityClass, IrregularitySettings};
pub use obstacle::{ObstacleSettings, ObstacleShape};

pub use settings::{PhysicsSettings, TrackSettings, TrainSettings};
pub use truth::WorkerTruth;
pub use vehicle::{
    BodyFile, BogieFile, CouplerFile, PrimaryFile, SecondaryFile, VehicleFile, WheelsetFile,
};
pub use wheelset::WheelForces;
pub use worker::{Waypoint, WorkerSettings};

use crate::bus::{SimTime, TrainCommand};
use crate::track::{Problem, Tunnel};
use crate::twin::render::{Body, Headlight, Shape};
use consist::Consist;
use driver::{Driver, Effort, STANDING_MPS};
use ground::Ground;
use history::History;
use irregularity::Irregularity;
use line::Line;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use obstacle::Obstacle;
use rapier3d_f64::math::Vector;
use rapier3d_f64::prelude::PhysicsWorld;
use std::sync::Arc;

/// Why the world could not be made, or could not go on.
#[derive(Debug, thiserror::Error)]
pub enum PhysicsError {
    /// Settings that no world can be made from.
    #[error("the physics settings are wrong: {}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    Settings(Vec<Problem>),
    /// A body's state is no longer a number.
    #[error("the state of {body} became non-finite at {time}")]
    NonFinite {
        /// Which body.
        body: String,
        /// When.
        time: SimTime,
    },
}

/// The train as it really is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrainState {
    /// When.
    pub time: SimTime,
    /// Chainage of the train head.
    pub chainage_m: f64,
    /// Speed along the line, positive up the line.
    pub speed_mps: f64,
    /// Acceleration along the line.
    pub accel_mps2: f64,
    /// Pose of the vehicle frame, fixed to the leading car's body.
    pub world_from_vehicle: Isometry3<f64>,
    /// Poses of the centres of all car bodies' boxes, leading car first.
    pub world_from_cars: Vec<Isometry3<f64>>,
    /// Acceleration of the leading car's floor over its first bogie, vehicle axes, without gravity.
    pub floor_accel_mps2: Vector3<f64>,
    /// Vertical travel of the primary suspension of the leading axle from its place at rest,
    /// positive where it is compressed.
    pub primary_travel_m: f64,
    /// And of the secondary suspension over it.
    pub secondary_travel_m: f64,
    /// The train stands.
    pub standing: bool,
    /// Traction in effect, as acceleration.
    pub traction_mps2: f64,
    /// Brake in effect, as deceleration.
    pub brake_mps2: f64,
    /// Every wheelset and its rails, from the front.
    pub wheels: Vec<WheelForces>,
    /// Pull of every coupler, from the front.
    pub couplers_n: Vec<f64>,
}

/// The first hit of the train on an obstacle.
#[derive(Clone, Debug, PartialEq)]
pub struct Collision {
    /// When.
    pub time: SimTime,
    /// Name of the obstacle.
    pub obstacle: String,
    /// Speed of the train relative to the obstacle just before.
    pub speed_mps: f64,
    /// Velocity of the obstacle just before, world.
    pub velocity_before_mps: Vector3<f64>,
    /// Momentum that the obstacle took.
    pub momentum_n_s: f64,
    /// Kinetic energy of the obstacle relative to the train just before.
    pub energy_j: f64,
}

/// One obstacle as it really is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObstacleTruth<'a> {
    /// Name.
    pub name: &'a str,
    /// Length, width and height of its own box.
    pub size_m: Vector3<f64>,
    /// Chainage of its centre.
    pub chainage_m: f64,
    /// Its centre, left of the centreline.
    pub lateral_m: f64,
    /// Its centre, above top of rail.
    pub height_m: f64,
    /// Half of what it extends along the line, across and up, turned as it is.
    pub half_extents_m: Vector3<f64>,
    /// Pose of its centre.
    pub world_from_body: Isometry3<f64>,
    /// Velocity of its centre, in the world's axes.
    pub velocity_mps: Vector3<f64>,
    /// Since when it lies still; `None` while it moves.
    pub resting_since: Option<SimTime>,
}

/// A train under way.
struct Train {
    consist: Consist,
    driver: Driver,
    effort: Effort,
    history: History,
}

/// So long a train runs, or stands, before its start: springs and dampers come to rest.
const RUN_IN_S: f64 = 5.0;
/// A collision is over after this; until then the obstacle's momentum may still grow.
const COLLISION_S: f64 = 0.05;
/// Steps between looks at where a moving obstacle is along the line.
const LOOK_STEPS: u64 = 50;
/// A headlight's lens.
const LENS_RADIUS_M: f64 = 0.09;
/// Headlights: beside the centreline, over top of rail, looking down to the track ahead.
const HEADLIGHT_LATERAL_M: f64 = 0.9;
const HEADLIGHT_HEIGHT_M: f64 = 1.0;
const HEADLIGHT_DOWN_RAD: f64 = 0.02;
/// Narrow beam: half its intensity at 9 degrees from the axis.
const HEADLIGHT_EXPONENT: f64 = 56.0;
/// Painted steel.
const CAR_ALBEDO: f64 = 0.5;

/// Everything that moves.
pub struct World {
    tunnel: Arc<Tunnel>,
    settings: PhysicsSettings,
    rapier: PhysicsWorld,
    irregularity: Irregularity,
    ground: Ground,
    train: Option<Train>,
    obstacles: Vec<Obstacle>,
    /// Obstacles still to come, the next one last.
    to_come: Vec<ObstacleSettings>,
    /// Which workers' loads are down.
    put_down: Vec<bool>,
    collision: Option<Collision>,
    time: SimTime,
    steps: u64,
    step: SimTime,
    step_s: f64,
}

impl World {
    /// A world at time zero. Everything random in it depends on `seed` and run `index` only.
    pub fn new(
        tunnel: Arc<Tunnel>,
        settings: &PhysicsSettings,
        seed: u64,
        index: u64,
    ) -> Result<Self, PhysicsError> {
        let mut problems = Vec::new();
        settings.check("", &mut problems);
        if !problems.is_empty() {
            return Err(PhysicsError::Settings(problems));
        }
        let step = SimTime::from_secs(settings.step_s);
        let step_s = step.secs();
        let mut rapier = PhysicsWorld::new();
        rapier.gravity = Vector::new(0.0, 0.0, -vehicle::GRAVITY_MPS2);
        rapier.integration_parameters.dt = step_s;
        // Substeps would move bodies with forces that belong to the step's start.
        rapier.integration_parameters.num_solver_iterations = 1;
        let train = settings.train.as_ref().map(|train| {
            let history = History::new((settings.history_s / step_s).ceil() as usize + 1);
            // It runs in over the last metres before its starting place.
            let head_m = train.start_chainage_m - train.start_speed_kmh / 3.6 * RUN_IN_S;
            Train {
                consist: Consist::new(&mut rapier, &tunnel, train, head_m),
                driver: Driver::new(train),
                effort: Effort::default(),
                history,
            }
        });
        let mut to_come = settings.obstacles.clone();
        to_come.sort_by(|a, b| b.appears_s.total_cmp(&a.appears_s));
        let irregularity = Irregularity::new(
            &settings.track.irregularity,
            tunnel.alignment.length_m(),
            seed,
            index,
        )
        .with_defects(&settings.track.defects);
        let mut world = Self {
            put_down: vec![false; settings.workers.len()],
            settings: settings.clone(),
            tunnel,
            rapier,
            irregularity,
            ground: Ground::default(),
            train,
            obstacles: Vec::new(),
            to_come,
            collision: None,
            time: SimTime::ZERO,
            steps: 0,
            step,
            step_s,
        };
        world.run_in()?;
        world.appear();
        Ok(world)
    }

    /// Brings the train to the state in which it runs, or stands, at its start: leaning in a curve,
    /// shaken by the track.
    fn run_in(&mut self) -> Result<(), PhysicsError> {
        let Some(settings) = &self.settings.train else {
            return Ok(());
        };
        let speed_mps = settings.start_speed_kmh / 3.6;
        let held_at = (speed_mps > STANDING_MPS).then_some(speed_mps);
        let effort = Effort {
            traction_mps2: 0.0,
            brake_mps2: held_at.map_or(settings.service_brake_mps2, |_| 0.0),
        };
        for _ in 0..(RUN_IN_S / self.step_s).round() as usize {
            self.step_train(effort, held_at)?;
        }
        if let Some(train) = &mut self.train {
            train.consist.open_book();
            train.history.push(train.consist.motion(self.time));
        }
        Ok(())
    }

    /// Forces on the train, a step of everything, and what the train comes to. A train that is
    /// `held_at` a speed has not begun its run.
    fn step_train(&mut self, effort: Effort, held_at: Option<f64>) -> Result<(), PhysicsError> {
        if let Some(train) = &mut self.train {
            let (alignment, track) = (&self.tunnel.alignment, &self.settings.track);
            let line = Line::new(alignment, &self.irregularity, track);
            let consist = &mut train.consist;
            consist.apply_forces(&mut self.rapier, &self.tunnel, &line, effort, self.step_s);
            if let Some(speed_mps) = held_at {
                consist.hold_speed(&mut self.rapier, speed_mps, self.step_s);
            }
        }
        // What lies or is not there needs no search for what it flies through.
        let flying = self.obstacles.iter().any(|o| !o.resting());
        self.rapier.integration_parameters.max_ccd_substeps = usize::from(flying);
        self.rapier.step();
        match &mut self.train {
            Some(train) => train.consist.read(&self.rapier, self.time),
            None => Ok(()),
        }
    }

    /// One step on.
    pub fn step(&mut self, command: &TrainCommand) -> Result<(), PhysicsError> {
        let mut effort = Effort::default();
        if let Some(train) = &mut self.train {
            let instruments = train.consist.instruments(self.time, &self.tunnel);
            effort = train.driver.step(&instruments, command, self.step_s);
            train.effort = effort;
        }
        for obstacle in &mut self.obstacles {
            if let Some((_, velocity)) = obstacle.state(&self.rapier) {
                obstacle.velocity_before = velocity;
            }
        }
        self.steps += 1;
        self.time = SimTime::from_nanos(self.time.nanos() + self.step.nanos());
        self.step_train(effort, None)?;
        if let Some(train) = &mut self.train {
            train.history.push(train.consist.motion(self.time));
        }
        self.watch_obstacles()?;
        self.appear();
        Ok(())
    }

    /// Now.
    pub fn time(&self) -> SimTime {
        self.time
    }

    /// The train now; `None` where there is none.
    pub fn train(&self) -> Option<TrainState> {
        let train = self.train.as_ref()?;
        let consist = &train.consist;
        let motion = train.history.latest()?;
        let guess = consist.instruments(self.time, &self.tunnel).chainage_m;
        let origin = motion.world_from_vehicle.translation.vector.into();
        let head = self.tunnel.alignment.track_from_world(&origin, guess);
        let frame = self.tunnel.alignment.at(head.s_m);
        let along = frame.world_from_line().rotation * Vector3::x();
        let speed_mps = motion.velocity_mps.dot(&along);
        Some(TrainState {
            time: self.time,
            chainage_m: head.s_m,
            speed_mps,
            accel_mps2: consist.accel_mps2(along, self.step_s),
            world_from_vehicle: motion.world_from_vehicle,
            world_from_cars: consist.boxes().collect(),
            floor_accel_mps2: consist.floor_accel_mps2(self.step_s),
            primary_travel_m: consist.travel_m[0],
            secondary_travel_m: consist.travel_m[1],
            standing: consist.speed_mps().abs() < STANDING_MPS,
            traction_mps2: train.effort.traction_mps2,
            brake_mps2: train.effort.brake_mps2,
            wheels: consist.wheel_forces().collect(),
            couplers_n: consist.couplers_n.clone(),
        })
    }

    /// Pose of the vehicle frame at a time of the recent past; `None` without a train, after now,
    /// or before what is kept.
    pub fn vehicle_at(&self, time: SimTime) -> Option<Isometry3<f64>> {
        self.train.as_ref()?.history.at(time)
    }

    /// Motion of the vehicle frame now; `None` without a train.
    pub fn vehicle_motion(&self) -> Option<&VehicleMotion> {
        self.train.as_ref()?.history.latest()
    }

    /// Distance that the treads of an axle, counted from 0 at the head, have rolled off since the
    /// start, slip and slide included; `None` without a train or such an axle.
    pub fn wheel_run_m(&self, axle: usize) -> Option<f64> {
        Some(self.train.as_ref()?.consist.wheelsets.get(axle)?.rolled_m)
    }

    /// The train's energy since the start; `None` without a train.
    pub fn energy(&self) -> Option<EnergyBook> {
        Some(self.train.as_ref()?.consist.book())
    }

    /// Half extents of a car body's box; `None` without a train.
    pub fn car_half_extents_m(&self) -> Option<Vector3<f64>> {
        Some(self.train.as_ref()?.consist.half_extents_m())
    }

    /// Obstacles and workers that are there now, to draw.
    pub fn bodies(&self) -> Vec<Body> {
        let drawn = self.obstacles.iter().filter_map(|o| o.draw(&self.rapier));
        let mut bodies: Vec<Body> = drawn.collect();
        for worker in &self.settings.workers {
            worker.draw(&self.tunnel.alignment, self.time.secs(), &mut bodies);
        }
        bodies
    }

    /// The train as boxes with the lenses of its headlights, for cameras that stand outside.
    pub fn train_bodies(&self) -> Vec<Body> {
        let Some(train) = &self.train else {
            return Vec::new();
        };
        let half = train.consist.half_extents_m();
        let cars = train.consist.boxes().zip(train.consist.velocities_mps());
        let mut bodies: Vec<Body> = cars
            .map(|(world_from_body, velocity_mps)| Body {
                shape: Shape::Box(half),
                world_from_body,
                velocity_mps,
                albedo: CAR_ALBEDO,
                luminance_cd_m2: 0.0,
            })
            .collect();
        let velocity_mps = bodies.first().map_or(Vector3::zeros(), |b| b.velocity_mps);
        let lens_m2 = std::f64::consts::PI * LENS_RADIUS_M.powi(2);
        bodies.extend(self.headlights().into_iter().map(|light| Body {
            shape: Shape::Sphere(LENS_RADIUS_M),
            world_from_body: light.world_from_light,
            velocity_mps,
            albedo: CAR_ALBEDO,
            luminance_cd_m2: light.intensity_cd / lens_m2,
        }));
        bodies
    }

    /// The train's headlights.
    pub fn headlights(&self) -> Vec<Headlight> {
        let (Some(train), Some(motion)) = (&self.train, self.vehicle_motion()) else {
            return Vec::new();
        };
        let down = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), HEADLIGHT_DOWN_RAD);
        let lights = [HEADLIGHT_LATERAL_M, -HEADLIGHT_LATERAL_M].map(|lateral| Headlight {
            world_from_light: motion.world_from_vehicle
                * Isometry3::translation(0.0, lateral, HEADLIGHT_HEIGHT_M)
                * down,
            intensity_cd: train.consist.settings.headlight_cd,
            exponent: HEADLIGHT_EXPONENT,
        });
        lights.to_vec()
    }

    /// Obstacles that are there now.
    pub fn obstacles(&self) -> impl Iterator<Item = ObstacleTruth<'_>> {
        self.obstacles.iter().filter_map(|obstacle| {
            let (world_from_body, velocity_mps) = obstacle.state(&self.rapier)?;
            let centre = world_from_body.translation.vector.into();
            let line = &self.tunnel.alignment;
            let place = line.track_from_world(&centre, obstacle.settings.chainage_m);
            let size_m = obstacle.settings.body.size_m();
            let line_from_world = line.at(place.s_m).world_from_line().rotation.inverse();
            let turned = (line_from_world * world_from_body.rotation).to_rotation_matrix();
            Some(ObstacleTruth {
                name: &obstacle.settings.name,
                size_m,
                chainage_m: place.s_m,
                lateral_m: place.l_m,
                height_m: place.h_m,
                half_extents_m: 0.5 * turned.matrix().abs() * size_m,
                world_from_body,
                velocity_mps,
                resting_since: (obstacle.resting()).then(|| self.time.plus(-obstacle.still_s())),
            })
        })
    }

    /// The first hit of the train on an obstacle.
    pub fn collision(&self) -> Option<&Collision> {
        self.collision.as_ref()
    }

    /// Lets appear what is due.
    fn appear(&mut self) {
        let now = self.time.secs();
        while let Some(next) = self.to_come.pop_if(|next| next.appears_s <= now) {
            self.insert(&next);
        }
        for k in 0..self.put_down.len() {
            if !self.put_down[k]
                && let Some(load) = self.settings.workers[k].put_down(now)
            {
                self.put_down[k] = true;
                self.insert(&load);
            }
        }
    }

    fn insert(&mut self, settings: &ObstacleSettings) {
        self.ground
            .lay(&mut self.rapier, &self.tunnel, settings.chainage_m);
        let alignment = &self.tunnel.alignment;
        let obstacle = Obstacle::insert(&mut self.rapier, alignment, settings);
        self.obstacles.push(obstacle);
    }

    /// After a step: finite states, rest, ground under what flies on, collisions.
    fn watch_obstacles(&mut self) -> Result<(), PhysicsError> {
        for k in 0..self.obstacles.len() {
            let obstacle = &mut self.obstacles[k];
            if !obstacle.observe(&self.rapier, self.step_s) {
                return Err(PhysicsError::NonFinite {
                    body: format!("obstacle {}", obstacle.settings.name),
                    time: self.time,
                });
            }
            if !obstacle.resting() && self.steps.is_multiple_of(LOOK_STEPS) {
                let place = obstacle.state(&self.rapier);
                let centre = place.map(|(pose, _)| pose.translation.vector.into());
                if let Some(centre) = centre {
                    let near = obstacle.settings.chainage_m;
                    let s_m = self.tunnel.alignment.track_from_world(&centre, near).s_m;
                    obstacle.settings.chainage_m = s_m;
                    self.ground.lay(&mut self.rapier, &self.tunnel, s_m);
                }
            }
            self.watch_collision(k);
        }
        Ok(())
    }

    /// Records the first contact of the train with obstacle `k`, and what it does to it.
    fn watch_collision(&mut self, k: usize) {
        let obstacle = &self.obstacles[k];
        let (Some(train), Some((_, velocity))) = (&self.train, obstacle.state(&self.rapier)) else {
            return;
        };
        let mass = obstacle.settings.mass_kg;
        if let Some(collision) = &mut self.collision {
            let lasts = self.time.since(collision.time) < COLLISION_S;
            if lasts && collision.obstacle == obstacle.settings.name {
                let taken = mass * (velocity - collision.velocity_before_mps).norm();
                collision.momentum_n_s = collision.momentum_n_s.max(taken);
            }
            return;
        }
        let mut pairs = self
            .rapier
            .narrow_phase
            .contact_pairs_with(obstacle.collider);
        let hit = pairs.any(|pair| {
            pair.has_any_active_contact() && train.consist.is_part(pair.collider1, pair.collider2)
        });
        if hit {
            let before = obstacle.velocity_before;
            let closing = (train.consist.velocity_before_mps() - before).norm();
            self.collision = Some(Collision {
                time: self.time,
                obstacle: obstacle.settings.name.clone(),
                speed_mps: closing,
                velocity_before_mps: before,
                momentum_n_s: mass * (velocity - before).norm(),
                energy_j: 0.5 * mass * closing * closing,
            });
        }
    }
}
