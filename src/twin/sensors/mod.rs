//! Sensors of motion and range: each turns the world's state at its own mount into raw output.

mod lidar;

pub use lidar::{Lidar, LidarSettings};
