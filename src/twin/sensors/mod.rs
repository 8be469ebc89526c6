//! Sensors: each turns the world's state at its own mount, by its own clock, into raw output.
//!
//! A [`Sensor`] is asked after every step of the world what has become due. Most give a sample at once;
//! a camera gives the views to draw, and gets the images back to read them out. What is read at a fixed
//! rate is a [`Periodic`] with a closure.
//!
//! ```
//! use metrotwin::bus::{Content, TrainId};
//! use metrotwin::twin::sensors::{ClockSettings, Periodic};
//! let clock = ClockSettings { offset_ms: 1.0, drift_ppm: 20.0 };
//! let speedometer = Periodic::new(10.0, clock, |world, _| {
//!     let values = vec![world.train(TrainId(0))?.speed_mps];
//!     Some(Content::Values { name: "speed_mps".into(), values })
//! });
//! # let _ = speedometer;
//! ```
//!
//! What it does not do: odometer, Doppler radar or balise antenna at the rear end; a clock drift
//! that varies; time stamps that jump.

mod auto_exposure;
mod balise_antenna;
mod camera;
mod doppler;
mod gnss;
mod imager;
mod imu;
mod lamp_view;
mod lidar;
mod odometer;
pub mod radar;
mod rig;
mod sensor;
mod stereo_camera;
mod wayside_unit;

pub use auto_exposure::{AutoExposure, Exposed, ExposureMode, ExposureSettings};
pub use balise_antenna::BaliseAntenna;
pub use camera::{CameraSettings, ReadOut, WaysideError};
pub use doppler::{Doppler, DopplerSettings};
pub use gnss::{Gnss, GnssSeeds, GnssSettings};
pub use imu::{Imu, ImuSettings};
pub use lamp_view::{ever_sees, visible_interval};
pub use lidar::{Lidar, LidarSettings};
pub use odometer::{Odometer, OdometerSettings};
pub use radar::{MountedRadar, Radar, RadarSettings};
pub use rig::{MountSide, RigError, RigSettings, RightEye};
pub use sensor::{
    Capture, ClockSettings, FrameHeader, Output, Periodic, Sensor, SensorError, SensorSample,
};
pub use stereo_camera::StereoCamera;
pub use wayside_unit::{WaysideCamera, WaysideLidar};
