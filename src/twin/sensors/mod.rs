//! Sensors: each turns the world's state at its own mount into raw output.

mod camera;
mod imu;
mod odometer;

pub use camera::{RigError, RigSettings, WaysideCameraSettings, ever_sees, visible_interval};
pub use imu::{Imu, ImuSettings};
pub use odometer::{Odometer, OdometerSettings};
/// Stand-in.
#[derive(
    Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
pub struct LidarSettings {}
impl LidarSettings {
    /// None.
    pub fn check(&self, _at: &str, _problems: &mut Vec<crate::track::Problem>) {}
}
