//! What a wayside device sees, knows and says.

use super::{CameraHealth, CameraModel, PixelBox, SimTime};
use crate::track::{Direction, Stretch, TrackId};
use image::GrayImage;
use nalgebra::{Isometry3, Point3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// One lidar echo, in the lidar's own angles: X = R cos w sin a, Y = R cos w cos a, Z = R sin w,
/// Y along the lidar's axis, Z up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LidarReturn {
    /// Range R.
    pub range_m: f64,
    /// Horizontal angle a from the axis, positive to X.
    pub azimuth_rad: f64,
    /// Elevation w.
    pub elevation_rad: f64,
}

/// One sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LidarScan {
    /// When it began.
    pub time: SimTime,
    /// Its echoes.
    pub returns: Vec<LidarReturn>,
}

/// A wayside device as surveyed and calibrated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WaysideCalibration {
    /// Name of the device.
    pub name: String,
    /// Its camera.
    pub camera: CameraModel,
    /// Where the camera is and looks.
    pub world_from_camera: Isometry3<f64>,
    /// Where the lidar is and looks (its own frame: X right, Y along the axis, Z up).
    pub world_from_lidar: Option<Isometry3<f64>>,
    /// The track that it watches.
    pub track: TrackId,
    /// Chainage of the device (point A of the distance formulas).
    pub chainage_m: f64,
    /// Chainage of the balise (point C) that its distances count from.
    pub balise_chainage_m: f64,
}

/// How dangerous an obstacle is to a train.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum DangerLevel {
    /// Outside the structure gauge, or nothing.
    #[default]
    None,
    /// The driver is warned, with picture and data.
    Low,
    /// The train brakes without him.
    High,
}

/// What the report recommends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Plan {
    /// Pass normally.
    #[default]
    Pass,
    /// Warn the driver.
    WarnDriver,
    /// Brake automatically.
    BrakeAutomatically,
}

/// A connected region of the binary difference image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Blob {
    /// Where in the image.
    pub bounds: PixelBox,
    /// Pixels over the threshold.
    pub area_px: u32,
}

/// An obstacle, placed on the line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DetectedObstacle {
    /// Its region in the image.
    pub blob: Blob,
    /// Its foot in the world.
    pub position: Point3<f64>,
    /// Nearest range from the device and its angle to the running direction (r, theta).
    pub near_range_m: f64,
    /// Angle of the nearest point.
    pub near_angle_rad: f64,
    /// Farthest range (R).
    pub far_range_m: f64,
    /// Angle of the farthest point (alpha).
    pub far_angle_rad: f64,
    /// Lower chainage of its two ends.
    pub from_chainage_m: f64,
    /// Higher chainage.
    pub to_chainage_m: f64,
    /// Left of the centreline.
    pub lateral_m: f64,
    /// Width, across the line of sight.
    pub width_m: f64,
    /// Height over its foot.
    pub height_m: f64,
    /// Against the structure gauge.
    pub danger: DangerLevel,
}

/// What a train tells of itself to wayside devices and other trains.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TrainReport {
    /// The track that its head is on.
    pub track: TrackId,
    /// Chainage of its head.
    pub chainage_m: f64,
    /// One sigma of that.
    pub sigma_m: f64,
    /// Its length over couplers.
    pub length_m: f64,
    /// What it stands on, from its tail to its head, if its position is right.
    pub occupied: Vec<Stretch>,
    /// Which way its head runs along its track.
    pub direction: Direction,
    /// Speed that way.
    pub speed_mps: f64,
    /// When it was there.
    pub time: SimTime,
}

/// What a wayside device sees of the bed of the stretch that it watches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BedSight {
    /// Length of bed in view on which a body of the least contrast would not be found, m.
    pub unseen_m: f64,
    /// Standard deviation of the grey across the track (rails, sleepers, bed) as a share of the bed's grey:
    /// the median over the bed in view. A veil lowers it: it absorbs light and adds its own.
    pub track_contrast: Option<f64>,
}

/// The report of one frame. As text it is the list that the paper prints.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WaysideReport {
    /// Start of the frame.
    pub time: SimTime,
    /// Frame number.
    pub number: u32,
    /// How the camera does.
    pub camera: CameraHealth,
    /// It has shown nothing for so long that its stretch counts as occupied.
    pub blind: bool,
    /// The reference image is still being learnt: nothing can be found yet.
    pub learning: bool,
    /// A train stands or runs where the camera looks, so that part of its view is blind.
    pub train_in_view: bool,
    /// What of the bed it sees; `None` while it learns, and of a frame that shows a fault.
    pub bed: Option<BedSight>,
    /// Everything found, confirmed obstacles only.
    pub obstacles: Vec<DetectedObstacle>,
    /// All regions of the binary image over the size limit, confirmed or not.
    pub blobs: Vec<Blob>,
    /// Distance S from the train head to the farthest obstacle point by the paper's formula,
    /// where a train position is known.
    pub train_distance_m: Option<f64>,
    /// The same along the alignment.
    pub train_distance_exact_m: Option<f64>,
    /// A train is affected.
    pub train_affected: bool,
    /// Highest danger found.
    pub danger: DangerLevel,
    /// Normal passage is possible.
    pub passage_possible: bool,
    /// An emergency measure is needed.
    pub emergency_needed: bool,
    /// Which plan.
    pub plan: Plan,
    /// Difference image and binary image, for the record.
    #[serde(with = "super::image_serde::optional")]
    pub difference: Option<GrayImage>,
    /// Binary image, 0 or 255.
    #[serde(with = "super::image_serde::optional")]
    pub binary: Option<GrayImage>,
}

impl WaysideReport {
    /// The obstacle with the highest danger, the farthest from the device where several have it.
    pub fn worst(&self) -> Option<&DetectedObstacle> {
        self.obstacles
            .iter()
            .max_by(|a, b| (a.danger.cmp(&b.danger)).then(a.far_range_m.total_cmp(&b.far_range_m)))
    }
}

impl fmt::Display for WaysideReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let worst = self.worst();
        let angle_rad = worst.map(|o| o.far_angle_rad);
        let degrees = |angle_rad: f64| format!("{:.2} deg", angle_rad.to_degrees());
        let cosine = |angle_rad: f64| format!("{:.4}", angle_rad.cos());
        let metres = |m: f64| format!("{m:.2} m");
        let answer = |yes: bool| Some(if yes { "yes" } else { "no" }.to_owned());
        let plan = match self.plan {
            Plan::Pass => "pass",
            Plan::WarnDriver => "warn the driver",
            Plan::BrakeAutomatically => "brake automatically",
        };
        let lines = [
            ("time", Some(self.time.to_string())),
            ("angle of the farthest point", angle_rad.map(degrees)),
            ("its cosine", angle_rad.map(cosine)),
            ("farthest range", worst.map(|o| metres(o.far_range_m))),
            (
                "distance to the train head",
                self.train_distance_m.map(metres),
            ),
            ("obstacle present", answer(!self.obstacles.is_empty())),
            ("train affected", answer(self.train_affected)),
            ("normal passage possible", answer(self.passage_possible)),
            ("emergency measure needed", answer(self.emergency_needed)),
        ];
        for (name, value) in lines {
            if let Some(value) = value {
                writeln!(f, "{name:<28}{value}")?;
            }
        }
        write!(f, "{:<28}{plan}", "plan")
    }
}
