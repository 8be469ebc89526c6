//! What travels between the world and the stack, as plain data: each [`Message`] has a sender, a
//! receiver, its times and a [`Content`]: frames with their row times, calibrations, samples and scans
//! on the way in; fixes, reports, warnings and commands on the way out. Nothing here computes more than
//! a unit conversion.
//!
//! Frames of reference: world x east, y north, z up; vehicle x forward, y left, z up (ISO 8855);
//! camera x right, y down, z forward. A transform is named `a_from_b`: it takes coordinates in
//! `b` to coordinates in `a`.
//!
//! ```
//! use metrotwin::bus::{Shutter, SimTime};
//! let shutter = Shutter { line_time_s: 22.2e-6, exposure_s: 30e-6, first_row: 0 };
//! let start = SimTime::from_secs(1.0);
//! // Row 100 is exposed from 2.22 ms after the frame's start.
//! assert_eq!(shutter.row_open(start, 100.0), SimTime::from_nanos(1_002_220_000));
//! ```

mod camera;
mod command;
mod distortion;
mod estimate;
mod fix;
mod gnss;
mod health;
mod image_serde;
#[cfg(test)]
pub mod lenses;
mod message;
mod motion;
mod occupancy;
mod radar;
mod time;
mod train_id;
mod warning;
mod wayside;

pub use camera::{CameraModel, Frame, Intrinsics, RigCalibration, Shutter, StereoPair};
pub use command::{
    BrakeDemand, DriverDisplay, Indicator, ProtectionReport, Supervision, TrainCommand,
};
pub use distortion::{Distortion, DistortionCoefficients};
pub use estimate::{PositionEstimate, PositionSource};
pub use fix::{Ellipse, Identity, LedReport, Method, PixelBox, PositionFix, Spot};
pub use gnss::{GnssFix, GnssSolution};
pub use health::{CameraFault, CameraHealth, CameraStatus, EYES};
pub use message::{Content, Message, Node, Receiver, Via};
pub use motion::{DopplerSample, ImuSample, OdometerSample};
pub use occupancy::{OccupancyReport, OccupiedTrack};
pub use radar::{RadarDetection, RadarFrame, RadarReport, RadarSheet, RadarTrack, RadarWaveform};
pub use time::{SimTime, Ticker};
pub use train_id::{TrainEnd, TrainId};
pub use warning::ObstacleWarning;
pub use wayside::{
    BedSight, Blob, DangerLevel, DetectedObstacle, LidarReturn, LidarScan, Plan, TrainReport,
    WaysideCalibration, WaysideReport,
};
