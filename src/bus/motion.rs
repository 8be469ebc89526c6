//! Samples of the sensors of motion.

use super::{SimTime, TrainEnd};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// One inertial sample, in the vehicle frame of its end of the train.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImuSample {
    /// When it was taken.
    pub time: SimTime,
    /// Where the unit is: in a curve the first and the last car turn at different rates.
    pub end: TrainEnd,
    /// Turn rates.
    pub gyro_rad_s: Vector3<f64>,
    /// Specific force (at rest on level track: +g along z).
    pub accel_m_s2: Vector3<f64>,
}

/// Wheel pulses turned into distance, as the odometer box sends them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OdometerSample {
    /// When it was taken.
    pub time: SimTime,
    /// Distance run since power-on; less again when it rolls back.
    pub distance_m: f64,
    /// Speed between the last edges of pulses.
    pub speed_mps: f64,
    /// Slide and slip protection holds effort back from the wheelset: what it counts may not be what the
    /// train runs. It sees a slide late, and a slow one of all axles never; after a slide it gives the effort
    /// back within a second or two.
    pub slides: bool,
}

/// What a Doppler radar says of the speed over ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DopplerSample {
    /// When it was taken: the end of the time that it is a mean of.
    pub time: SimTime,
    /// Speed along the vehicle, mean since the last sample. A radar with one beam does not know
    /// which way and says how fast; one with two says backwards as negative. `None` where the
    /// frequency is too low to be measured: slow, or at rest.
    pub speed_mps: Option<f64>,
}
