//! What the positioning stack says of one pair of images.

use super::{CameraHealth, SimTime};
use crate::track::uid::Uid;
use crate::track::{Place, TrackId};
use nalgebra::{Point2, Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Which estimator made a fix.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Stereo triangulation of the lamp centre, as in the paper; `paper` in files.
    #[serde(rename = "paper")]
    Stereo,
    /// One camera, range from the lamp's apparent size.
    Mono,
}

impl Method {
    /// Every method.
    pub const ALL: [Self; 2] = [Self::Stereo, Self::Mono];
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

/// How a lamp got its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Identity {
    /// Read whole from the stripes of this frame.
    Decoded,
    /// Read from the stripes of several frames joined.
    Joined,
    /// Read in earlier frames; the lamp was followed to this one, in which it cannot be read.
    Followed,
    /// Never read: the lamp of the map nearest to where the last fix predicts one.
    Predicted,
}

impl Identity {
    /// Whether the lamp itself told its name, in this frame or together with earlier ones.
    pub fn is_read(self) -> bool {
        matches!(self, Self::Decoded | Self::Joined)
    }
}

impl fmt::Display for Identity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

/// Pixel rectangle, both corners inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PixelBox {
    /// Leftmost column.
    pub u0: u32,
    /// Top row.
    pub v0: u32,
    /// Rightmost column.
    pub u1: u32,
    /// Bottom row.
    pub v1: u32,
}

impl PixelBox {
    /// Of some columns, from the first to the last, of one row.
    pub fn of_row(row: u32, (first, last): (u32, u32)) -> Self {
        Self {
            u0: first,
            v0: row,
            u1: last,
            v1: row,
        }
    }

    /// With so many columns and rows more on each side; those to the left and above end at 0.
    #[must_use]
    pub fn widened(&self, columns: u32, rows: u32) -> Self {
        Self {
            u0: self.u0.saturating_sub(columns),
            v0: self.v0.saturating_sub(rows),
            u1: self.u1 + columns,
            v1: self.v1 + rows,
        }
    }

    /// The least one around two.
    #[must_use]
    pub fn joined(&self, other: &Self) -> Self {
        Self {
            u0: self.u0.min(other.u0),
            v0: self.v0.min(other.v0),
            u1: self.u1.max(other.u1),
            v1: self.v1.max(other.v1),
        }
    }

    /// Whether another one is no farther away than `gap` pixels.
    pub fn is_near(&self, other: &Self, gap: u32) -> bool {
        self.u0 <= other.u1 + gap
            && other.u0 <= self.u1 + gap
            && self.v0 <= other.v1 + gap
            && other.v0 <= self.v1 + gap
    }

    /// Whether a pixel is in it.
    pub fn contains(&self, pixel: &Point2<f64>) -> bool {
        (f64::from(self.u0)..=f64::from(self.u1)).contains(&pixel.x)
            && (f64::from(self.v0)..=f64::from(self.v1)).contains(&pixel.y)
    }
}

/// An ellipse in the image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ellipse {
    /// Centre.
    pub centre: Point2<f64>,
    /// Longer half axis.
    pub semi_major_px: f64,
    /// Shorter half axis.
    pub semi_minor_px: f64,
    /// From the u axis to the longer axis, towards v.
    pub angle_rad: f64,
}

/// One lamp image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spot {
    /// Its bounding box.
    pub bounds: PixelBox,
    /// Centre by the method's weighting.
    pub centre: Point2<f64>,
    /// Fitted outline, where the fit held.
    pub ellipse: Option<Ellipse>,
    /// 4 pi S / P^2: 1 for a circle.
    pub roundness: f64,
    /// The image border cuts it.
    pub cut: bool,
    /// Name, and how it was found.
    pub uid: Option<(Uid, Identity)>,
}

/// A position.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PositionFix {
    /// When the train was there (mid-exposure of the lamp's centre row).
    pub time: SimTime,
    /// By which method.
    pub method: Method,
    /// The track that the train head is on.
    pub track: TrackId,
    /// Chainage of the train head.
    pub chainage_m: f64,
    /// One sigma along the track.
    pub sigma_m: f64,
    /// Vehicle origin in the world.
    pub position: Point3<f64>,
    /// The lamp it rests on.
    pub uid: Uid,
    /// How the lamp was named.
    pub identity: Identity,
    /// The lamp in the left eye's frame.
    pub lamp_in_camera: Vector3<f64>,
}

impl PositionFix {
    /// Place of the train head.
    pub fn place(&self) -> Place {
        Place {
            track: self.track,
            s_m: self.chainage_m,
        }
    }
}

/// Everything said of one pair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LedReport {
    /// Start of the pair's first row.
    pub time: SimTime,
    /// The pair's frame number.
    pub number: u32,
    /// How the eyes do, left then right. What one of them shows while it has a fault is not used.
    pub eyes: [CameraHealth; 2],
    /// The method whose fix a train should run by: both eyes, or the one that is left.
    pub best: Method,
    /// Lamps seen by the left eye.
    pub left: Vec<Spot>,
    /// Lamps seen by the right eye.
    pub right: Vec<Spot>,
    /// Lamps that have just gone by without shining.
    pub dark: Vec<Uid>,
    /// Fixes, at most one a method.
    pub fixes: Vec<PositionFix>,
}

impl LedReport {
    /// The position that a train should run by.
    pub fn best_fix(&self) -> Option<&PositionFix> {
        self.fixes.iter().find(|fix| fix.method == self.best)
    }
}
