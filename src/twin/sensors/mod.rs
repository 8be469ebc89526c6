//! Sensors: each turns the world's state at its own mount into raw output.

mod camera;
mod imu;
mod lidar;
mod odometer;

pub use camera::{RigError, RigSettings, WaysideCameraSettings, ever_sees, visible_interval};
pub use imu::{Imu, ImuSettings};
pub use lidar::{Lidar, LidarSettings};
pub use odometer::{Odometer, OdometerSettings};
