//! Rigid bodies: the train on its springs and the uneven track, obstacles, workers. The only place
//! that knows rapier.
//!
//! Car bodies, bogies and wheelsets are rigid bodies with six degrees of freedom each. Primary and
//! secondary suspension, couplers, traction, brakes, resistance and the forces of the rails are put
//! on them in every step; the rails lie as designed, with cant, and with a random irregularity of
//! one of the published spectra, and they give. Obstacles fall, bounce, roll and rest by rapier's
//! contacts, panels come off the wall, cables sag, workers walk; a train that hits one of them
//! exchanges momentum with it, and [`Impact`] says what that costs.
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
//! more), flexible car bodies, air springs, pressure waves. Trains run up the line only. A thing that
//! slides fast may stumble at a seam of the ground, every 2 m.

mod adhesion;
mod cable;
mod catenary;
mod consist;
mod convert;
mod defect;
mod driver;
mod energy;
mod ground;
mod history;
mod impact;
mod irregularity;
mod line;
mod obstacle;
mod placement;
mod settings;
mod shape;
mod suspension;
#[cfg(test)]
mod tests;
mod thing;
mod things;
#[cfg(test)]
mod things_tests;
mod truth;
#[cfg(test)]
mod validation;
mod vehicle;
mod walker;
mod wheelset;
mod worker;

pub use adhesion::{RailState, RailZone};
pub use cable::{CableEnd, CableSettings};
pub use defect::{DefectSettings, DefectShape, Side};
pub use energy::EnergyBook;
pub use history::VehicleMotion;
pub use impact::{Damage, DamageBounds, Impact};
pub use irregularity::{IrregularityClass, IrregularitySettings};
pub use obstacle::{HingeEdge, HingeSettings, ObstacleSettings};
pub use shape::ObstacleShape;

pub use settings::{PhysicsSettings, TrackSettings, TrainSettings};
pub use things::{ObstacleTruth, WorkerTruth};
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
use history::History;
use irregularity::Irregularity;
use line::Line;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rapier3d_f64::math::Vector;
use rapier3d_f64::prelude::PhysicsWorld;
use std::sync::Arc;
use things::Things;

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

/// A train under way.
struct Train {
    consist: Consist,
    driver: Driver,
    effort: Effort,
    history: History,
}

/// So long a train runs, or stands, before its start: springs and dampers come to rest.
const RUN_IN_S: f64 = 5.0;
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
    train: Option<Train>,
    things: Things,
    time: SimTime,
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
        let train_mass_kg = train.as_ref().map(|train| {
            let consist = &train.consist;
            consist.vehicle.total_kg() * f64::from(consist.settings.cars)
        });
        let irregularity = Irregularity::new(
            &settings.track.irregularity,
            tunnel.alignment.length_m(),
            seed,
            index,
        )
        .with_defects(&settings.track.defects);
        let mut world = Self {
            settings: settings.clone(),
            tunnel,
            rapier,
            irregularity,
            train,
            things: Things::default(),
            time: SimTime::ZERO,
            step,
            step_s,
        };
        world.run_in()?;
        let run = [seed, index];
        world.things = Things::new(
            &mut world.rapier,
            &world.tunnel,
            settings,
            run,
            train_mass_kg,
        );
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
        let flying = self.things.moving();
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
        self.things.before_step(&mut self.rapier);
        self.time = SimTime::from_nanos(self.time.nanos() + self.step.nanos());
        self.step_train(effort, None)?;
        if let Some(train) = &mut self.train {
            train.history.push(train.consist.motion(self.time));
        }
        self.things
            .after_step(&mut self.rapier, &self.tunnel, self.time)
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

    /// Obstacles, cables and workers that are there now, to draw.
    pub fn bodies(&self) -> Vec<Body> {
        let line = &self.tunnel.alignment;
        self.things.draw(&self.rapier, line, self.time.secs())
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

    /// Obstacles that are there now: what lies, falls or swings. What is still fixed to the lining
    /// is none.
    pub fn obstacles(&self) -> impl Iterator<Item = ObstacleTruth<'_>> {
        let line = &self.tunnel.alignment;
        self.things.obstacles(&self.rapier, line, self.time)
    }

    /// Workers who are on the line now.
    pub fn workers(&self) -> impl Iterator<Item = WorkerTruth<'_>> {
        let line = &self.tunnel.alignment;
        self.things.workers(&self.rapier, line, self.time.secs())
    }

    /// Hits of the train on obstacles, cables and workers, in order of time; the first thousand.
    pub fn impacts(&self) -> &[Impact] {
        self.things.impacts()
    }
}
