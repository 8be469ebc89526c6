//! Sensors of motion and range: each turns the world's state at its own mount into raw output.

mod imu;
mod odometer;

pub use imu::{Imu, ImuSettings};
pub use odometer::{Odometer, OdometerSettings};
