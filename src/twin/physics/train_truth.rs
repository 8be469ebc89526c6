//! What sessions ask of the trains; `None` for a train that is not there.

use super::history::VehicleMotion;
use super::wheelset::{WheelExtremes, WheelForces};
use super::{EnergyBook, World};
use crate::bus::{SimTime, TrainEnd, TrainId};
use crate::track::Direction;
use crate::twin::lights::Headlight;
use nalgebra::{Isometry3, Vector3};

/// A train as it really is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrainState {
    /// When.
    pub time: SimTime,
    /// Which way it runs.
    pub direction: Direction,
    /// Chainage of the train head.
    pub chainage_m: f64,
    /// Speed along the line, positive up the line.
    pub speed_mps: f64,
    /// Acceleration along the line, positive up the line.
    pub accel_mps2: f64,
    /// Pose of the leading vehicle frame, fixed to the leading car's body, with its x axis ahead.
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

impl World {
    /// A train now, or what carries a rig in place of one.
    pub fn train(&self, id: TrainId) -> Option<TrainState> {
        let Some(train) = self.get(id) else {
            return self.carrier_state(id);
        };
        train.state(&self.tunnel.alignment, self.step_s)
    }

    /// Pose of the vehicle frame of one of its ends at a time of the recent past; `None` after now, and
    /// before what is kept.
    pub fn vehicle_at(&self, id: TrainId, end: TrainEnd, time: SimTime) -> Option<Isometry3<f64>> {
        match self.get(id) {
            Some(train) => train.history(end).at(time),
            None => Some(self.carrier(id)?.world_from_vehicle),
        }
    }

    /// Motion of the vehicle frame of one of its ends now.
    pub fn vehicle_motion(&self, id: TrainId, end: TrainEnd) -> Option<&VehicleMotion> {
        self.get(id)?.history(end).latest()
    }

    /// Chainage of its head now.
    pub fn head_m(&self, id: TrainId) -> Option<f64> {
        self.chainage_of(
            id,
            &self.vehicle_motion(id, TrainEnd::Front)?.world_from_vehicle,
        )
    }

    /// Chainage of its head at a time of the recent past.
    pub fn chainage_at(&self, id: TrainId, time: SimTime) -> Option<f64> {
        match self.carrier(id) {
            Some(carrier) => Some(carrier.chainage_m),
            None => self.chainage_of(id, &self.vehicle_at(id, TrainEnd::Front, time)?),
        }
    }

    fn chainage_of(&self, id: TrainId, world_from_vehicle: &Isometry3<f64>) -> Option<f64> {
        let line = &self.tunnel.alignment;
        Some(self.get(id)?.chainage_m(line, world_from_vehicle))
    }

    /// Its length over couplers.
    pub fn train_length_m(&self, id: TrainId) -> Option<f64> {
        Some(self.get(id)?.consist.length_m())
    }

    /// Deceleration of its emergency brake on dry rails.
    pub fn emergency_brake_mps2(&self, id: TrainId) -> Option<f64> {
        Some(self.get(id)?.consist.settings.emergency_brake_mps2)
    }

    /// Half extents of the box of one of its car bodies.
    pub fn car_half_extents_m(&self, id: TrainId) -> Option<Vector3<f64>> {
        Some(self.get(id)?.consist.half_extents_m())
    }

    /// Distance that the treads of an axle, counted from 0 at the head, have rolled off since the
    /// start, slip and slide included; `None` without such an axle.
    pub fn wheel_run_m(&self, id: TrainId, axle: usize) -> Option<f64> {
        Some(self.get(id)?.consist.wheelsets.get(axle)?.rolled_m)
    }

    /// Whether slide and slip protection of an axle, counted from 0 at the head, holds effort back.
    pub fn wheel_protection_acts(&self, id: TrainId, axle: usize) -> Option<bool> {
        Some(self.get(id)?.consist.wheelsets.get(axle)?.protection_acts())
    }

    /// What the worst of its wheels has been through.
    pub fn wheel_extremes(&self, id: TrainId) -> Option<WheelExtremes> {
        let wheelsets = self.get(id)?.consist.wheelsets.iter();
        wheelsets.map(|w| w.extremes).reduce(WheelExtremes::and)
    }

    /// Normal force of one of its wheels at rest.
    pub fn wheel_load_n(&self, id: TrainId) -> Option<f64> {
        Some(self.get(id)?.consist.vehicle.wheel_load_n())
    }

    /// Its energy since the start.
    pub fn energy(&self, id: TrainId) -> Option<EnergyBook> {
        Some(self.get(id)?.consist.book())
    }

    /// The headlights of all trains.
    pub fn headlights(&self) -> Vec<Headlight> {
        let lights = self.trains.iter().filter_map(|train| train.headlights());
        lights.flatten().collect()
    }
}
