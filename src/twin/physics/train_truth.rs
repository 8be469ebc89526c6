//! What sessions ask of the trains; `None` for a train that is not there.

use super::history::VehicleMotion;
use super::wheelset::{WheelExtremes, WheelForces};
use super::{EnergyBook, World};
use crate::bus::{SimTime, TrainEnd, TrainId};
use crate::track::network::Route;
use crate::track::{Direction, Place, Track, TrackId};
use crate::twin::lights::Headlight;
use nalgebra::{Isometry3, Vector3};
use std::sync::Arc;

/// A train as it really is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrainState {
    /// When.
    pub time: SimTime,
    /// The track that its head is on.
    pub track: TrackId,
    /// Which way it runs along that.
    pub direction: Direction,
    /// Chainage of the train head.
    pub chainage_m: f64,
    /// Distance of the train head along its route.
    pub run_m: f64,
    /// Speed along the track, positive up the track.
    pub speed_mps: f64,
    /// Acceleration along the track, positive up the track.
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
    /// It stands at a station on its way.
    pub dwells: bool,
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
        train.state(self.step_s)
    }

    /// Pose of the vehicle frame of one of its ends at a time of the recent past; `None` after now, and
    /// before what is kept.
    pub fn vehicle_at(&self, id: TrainId, end: TrainEnd, time: SimTime) -> Option<Isometry3<f64>> {
        match self.get(id) {
            Some(train) => train.history(end).at(time),
            None => Some(self.carrier(id)?.state.world_from_vehicle),
        }
    }

    /// Motion of the vehicle frame of one of its ends now.
    pub fn vehicle_motion(&self, id: TrainId, end: TrainEnd) -> Option<&VehicleMotion> {
        self.get(id)?.history(end).latest()
    }

    /// The route that it runs.
    pub fn route(&self, id: TrainId) -> Option<&Route> {
        match self.get(id) {
            Some(train) => Some(&train.track.route),
            None => self.carrier(id).map(|carrier| &carrier.route),
        }
    }

    /// The track along its route: distances along the route are its chainages.
    pub fn along_route(&self, id: TrainId) -> Option<&Arc<Track>> {
        match self.get(id) {
            Some(train) => Some(&train.track.track),
            None => self.carrier(id).map(|carrier| &carrier.track),
        }
    }

    /// Distance of its head along its route now.
    pub fn run_m(&self, id: TrainId) -> Option<f64> {
        let motion = self.vehicle_motion(id, TrainEnd::Front)?;
        Some(self.get(id)?.run_m(&motion.world_from_vehicle))
    }

    /// Place of its head now.
    pub fn head(&self, id: TrainId) -> Option<Place> {
        Some(self.route(id)?.place(self.run_m(id)?).0)
    }

    /// Distance along its route at which its head is to stop.
    pub fn stop_m(&self, id: TrainId) -> Option<f64> {
        self.get(id)?.consist.settings.stop_at_m
    }

    /// Distance of its head along its route at a time of the recent past.
    pub fn run_at(&self, id: TrainId, time: SimTime) -> Option<f64> {
        match self.carrier(id) {
            Some(carrier) => Some(carrier.state.run_m),
            None => {
                let pose = self.vehicle_at(id, TrainEnd::Front, time)?;
                Some(self.get(id)?.run_m(&pose))
            }
        }
    }

    /// Place of its head at a time of the recent past.
    pub fn place_at(&self, id: TrainId, time: SimTime) -> Option<Place> {
        Some(self.route(id)?.place(self.run_at(id, time)?).0)
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
