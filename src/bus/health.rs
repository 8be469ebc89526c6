//! What the stack says of the cameras that it looks through.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// What is wrong with a camera, as one can tell from what it delivers. An image with any of these
/// is not used.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum CameraFault {
    /// Nothing comes any more.
    Silent,
    /// A frame came without an image, or with one of the wrong size.
    Missing,
    /// All pixels are equal: nothing reaches the sensor's output.
    Dead,
    /// The image is the one before again, bit for bit, which the noise of a real sensor never
    /// gives.
    Frozen,
    /// It came so late that the samples of odometer and inertial unit of its time are no longer kept.
    Late,
}

impl fmt::Display for CameraFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Silent => "silent",
            Self::Missing => "no image",
            Self::Dead => "dead",
            Self::Frozen => "frozen",
            Self::Late => "too late",
        })
    }
}

/// How a camera does at one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct CameraHealth {
    /// What is wrong with it.
    pub fault: Option<CameraFault>,
    /// Frames lost since the one before, by the gap in their numbers.
    pub lost: u32,
}

/// How a camera does, by its name on its node: `rig.left`, `rig.right`, or the device's name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CameraStatus {
    /// Which camera.
    pub camera: String,
    /// How it does.
    pub health: CameraHealth,
}

/// Names of the eyes of a stereo rig, left then right.
pub const EYES: [&str; 2] = ["rig.left", "rig.right"];

impl CameraHealth {
    /// It delivers nothing any more.
    pub const SILENT: Self = Self {
        fault: Some(CameraFault::Silent),
        lost: 0,
    };

    /// The image may be used.
    pub fn is_good(&self) -> bool {
        self.fault.is_none()
    }
}
