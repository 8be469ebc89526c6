//! Sensors: each turns the world's state at its own mount into raw output.

mod auto_exposure;
mod balise_antenna;
mod camera;
mod doppler;
mod imu;
mod lidar;
mod odometer;
mod rig;
mod sensor;
mod stereo_camera;
mod wayside_unit;

pub use auto_exposure::{AutoExposure, Exposed, ExposureMode, ExposureSettings};
pub use balise_antenna::BaliseAntenna;
pub use camera::{ReadOut, Trigger, WaysideCameraSettings, WaysideError};
pub use doppler::{Doppler, DopplerSettings};
pub use imu::{Imu, ImuSettings};
pub use lidar::{Lidar, LidarSettings};
pub use odometer::{Odometer, OdometerSettings};
pub use rig::{MountSide, RigError, RigSettings, RightEye, ever_sees, visible_interval};
pub use sensor::{
    Capture, ClockSettings, FrameHeader, Output, Periodic, Sample, Sensor, SensorError,
};
pub use stereo_camera::StereoCamera;
pub use wayside_unit::{WaysideCamera, WaysideLidar};
