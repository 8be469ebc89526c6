//! A train under way: its bodies, its driver, its recent past, and what it looks like.

use super::consist::Consist;
use super::driver::{AutomaticDriver, Effort, STANDING_MPS, Timetable};
use super::history::{MotionHistory, VehicleMotion};
use super::route_track::RouteTrack;
use super::settings::TrainSettings;
use super::wheelset::WheelForces;
use super::{PhysicsError, TrainState};
use crate::bus::{SimTime, TrainCommand, TrainEnd, TrainId};
use crate::track::network::{Itinerary, SpeedLimit};
use crate::twin::geometry::{Body, Shape};
use crate::twin::lights::Headlight;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rapier3d_f64::prelude::PhysicsWorld;

/// So long a train runs, or stands, before its start: springs and dampers come to rest.
pub(super) const RUN_IN_S: f64 = 5.0;
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

/// A train under way.
#[derive(Clone)]
pub(super) struct Train {
    pub track: RouteTrack,
    pub consist: Consist,
    /// Of its front and rear end.
    histories: [MotionHistory; 2],
    driver: AutomaticDriver,
    pub effort: Effort,
}

impl Train {
    /// A train that has yet to run in over the last metres before its starting place.
    pub(super) fn new(
        world: &mut PhysicsWorld,
        track: RouteTrack,
        settings: &TrainSettings,
        (way, limits): (&Itinerary, Vec<SpeedLimit>),
        id: TrainId,
        history_steps: usize,
    ) -> Self {
        // From here on, places are those of the train's run.
        let settings = TrainSettings {
            start_chainage_m: way.start_m,
            stop_at_m: way.stop_m,
            ..settings.clone()
        };
        let timetable = Timetable {
            calls_m: way.places_m.clone(),
            stop_m: way.stop_m,
            limits,
        };
        let head_m = settings.start_chainage_m - settings.start_speed_kmh / 3.6 * RUN_IN_S;
        Self {
            consist: Consist::new(world, &track, &settings, head_m, id),
            track,
            histories: [
                MotionHistory::new(history_steps),
                MotionHistory::new(history_steps),
            ],
            driver: AutomaticDriver::new(&settings, timetable),
            effort: Effort::default(),
        }
    }

    /// Forces of a step of the run-in: held at the starting speed, or braked at standstill.
    pub(super) fn run_in(&mut self, world: &mut PhysicsWorld, dt_s: f64) {
        let settings = &self.consist.settings;
        let speed_mps = settings.start_speed_kmh / 3.6;
        let runs = speed_mps > STANDING_MPS;
        let effort = Effort {
            traction_mps2: 0.0,
            brake_mps2: if runs {
                0.0
            } else {
                settings.service_brake_mps2
            },
        };
        self.consist.apply_forces(world, &self.track, effort, dt_s);
        if runs {
            self.consist.hold_speed(world, speed_mps, dt_s);
        }
    }

    /// The run begins.
    pub(super) fn begin(&mut self) {
        self.consist.open_book();
        self.remember(SimTime::ZERO);
    }

    fn remember(&mut self, now: SimTime) {
        let ends = [TrainEnd::Front, TrainEnd::Rear];
        for (history, end) in self.histories.iter_mut().zip(ends) {
            history.push(self.consist.motion(end, now));
        }
    }

    /// The driver's decision, and the forces of a step.
    pub(super) fn drive(
        &mut self,
        world: &mut PhysicsWorld,
        command: &TrainCommand,
        signal_m: Option<f64>,
        (now, dt_s): (SimTime, f64),
    ) {
        let instruments = self.consist.instruments(now, &self.track);
        self.effort = self.driver.step(&instruments, command, signal_m, dt_s);
        self.consist
            .apply_forces(world, &self.track, self.effort, dt_s);
    }

    /// It has been led onto another way than its own, from a distance on. Its driver stops.
    pub(super) fn divert(&mut self, track: RouteTrack, limits: Vec<SpeedLimit>, from_m: f64) {
        self.track = track;
        // Its mark is on the way that it was to go.
        self.consist.settings.stop_at_m = None;
        self.driver.diverted(limits, from_m);
    }

    /// What a step came to.
    pub(super) fn read(&mut self, world: &PhysicsWorld, now: SimTime) -> Result<(), PhysicsError> {
        self.consist.read(world, now)?;
        self.consist.on_rails(now)?;
        self.remember(now);
        Ok(())
    }

    /// The recent past of the vehicle frame of one end.
    pub(super) fn history(&self, end: TrainEnd) -> &MotionHistory {
        match end {
            TrainEnd::Front => &self.histories[0],
            TrainEnd::Rear => &self.histories[1],
        }
    }

    /// Motion of the leading vehicle frame now.
    fn motion(&self) -> Option<&VehicleMotion> {
        self.history(TrainEnd::Front).latest()
    }

    /// Distance along its route of the origin of its vehicle frame at a pose.
    pub(super) fn run_m(&self, world_from_vehicle: &Isometry3<f64>) -> f64 {
        let origin = world_from_vehicle.translation.vector.into();
        let near_m = self.consist.head_chainage_m();
        self.track.alignment().track_from_world(&origin, near_m).s_m
    }

    /// As it really is.
    pub(super) fn state(&self, dt_s: f64) -> Option<TrainState> {
        let (consist, motion) = (&self.consist, self.motion()?);
        let run_m = self.run_m(&motion.world_from_vehicle);
        let (place, direction) = self.track.route.place(run_m);
        let ahead = self.track.alignment().at(run_m).world_from_line().rotation * Vector3::x();
        let along = ahead * direction.sign();
        Some(TrainState {
            time: motion.time,
            track: place.track,
            direction,
            chainage_m: place.s_m,
            run_m,
            speed_mps: motion.velocity_mps.dot(&along),
            accel_mps2: consist.accel_mps2(along, dt_s),
            world_from_vehicle: motion.world_from_vehicle,
            world_from_cars: consist.boxes().collect(),
            floor_accel_mps2: consist.floor_accel_mps2(dt_s),
            primary_travel_m: consist.primary_travel_m,
            secondary_travel_m: consist.secondary_travel_m,
            standing: consist.speed_mps().abs() < STANDING_MPS,
            dwells: self.driver.dwells(),
            traction_mps2: self.effort.traction_mps2,
            brake_mps2: self.effort.brake_mps2,
            wheels: self.wheel_forces().collect(),
            couplers_n: consist.couplers_n.clone(),
        })
    }

    fn wheel_forces(&self) -> impl Iterator<Item = WheelForces> + '_ {
        self.consist.wheelsets.iter().map(|w| w.forces)
    }

    /// Boxes with the lenses of its headlights.
    pub(super) fn bodies(&self) -> Vec<Body> {
        let half = self.consist.half_extents_m();
        let cars = self.consist.boxes().zip(self.consist.velocities_mps());
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
        bodies.extend(self.headlights().into_iter().flatten().map(|light| Body {
            shape: Shape::Sphere(LENS_RADIUS_M),
            world_from_body: light.world_from_light,
            velocity_mps,
            albedo: CAR_ALBEDO,
            luminance_cd_m2: light.intensity_cd / lens_m2,
        }));
        bodies
    }

    /// The two headlights.
    pub(super) fn headlights(&self) -> Option<[Headlight; 2]> {
        let motion = self.motion()?;
        let down = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), HEADLIGHT_DOWN_RAD);
        Some(
            [HEADLIGHT_LATERAL_M, -HEADLIGHT_LATERAL_M].map(|lateral| Headlight {
                world_from_light: motion.world_from_vehicle
                    * Isometry3::translation(0.0, lateral, HEADLIGHT_HEIGHT_M)
                    * down,
                intensity_cd: self.consist.settings.headlight_cd,
                exponent: HEADLIGHT_EXPONENT,
            }),
        )
    }
}
