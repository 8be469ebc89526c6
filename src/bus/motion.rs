//! Samples of the sensors of motion.

use super::SimTime;
use nalgebra::Vector3;

/// One inertial sample, in the vehicle frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuSample {
    /// When it was taken.
    pub time: SimTime,
    /// Turn rates.
    pub gyro_rad_s: Vector3<f64>,
    /// Specific force (at rest on level track: +g along z).
    pub accel_m_s2: Vector3<f64>,
}

/// Wheel pulses turned into distance, as the odometer box sends them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdometerSample {
    /// When it was taken.
    pub time: SimTime,
    /// Distance run since power-on.
    pub distance_m: f64,
    /// Speed over the last interval.
    pub speed_mps: f64,
}
