//! What a session comes to, as `summary.json` has it.

use super::occupancy_figures::OccupancyFigures;
use super::statistics::{Cost, ErrorStatistics};
use crate::bus::{CameraFault, Method, TrainId};
use crate::twin::physics::{EnergyBook, Impact, Incident};
use crate::twin::render::Backend;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;

/// The figures of one run. Lengths in metres, times in seconds; `null` where a scenario has none.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Summary {
    /// Name of the scenario.
    pub scenario: String,
    /// Its seed.
    pub seed: u64,
    /// How the run ended.
    pub end: End,
    /// Simulated time.
    pub simulated_s: f64,
    /// Time that it took.
    pub wall_s: f64,
    /// `simulated_s / wall_s`.
    pub real_time_factor: f64,
    /// What drew the images.
    pub renderer: Backend,
    /// Stereo pairs drawn.
    pub stereo_frames: u32,
    /// Wayside frames drawn.
    pub wayside_frames: u32,
    /// Cost of the physics.
    pub physics: Physics,
    /// Where the wall time went, seconds.
    pub wall_shares_s: WallShares,
    /// Positioning, by method.
    pub positioning: BTreeMap<Method, Positioning>,
    /// Wayside detection.
    pub wayside: Option<Wayside>,
    /// What the stack says of its cameras: `rig.left`, `rig.right`, and the wayside devices by name.
    pub cameras: BTreeMap<String, CameraFigures>,
    /// Lamps that the stack says do not shine, by their UIDs, in the order passed.
    pub dark_lamps: Vec<String>,
    /// Track occupancy.
    pub occupancy: Option<OccupancyFigures>,
    /// Train protection.
    pub protection: Option<ProtectionFigures>,
    /// How the train ran.
    pub train: Option<TrainFigures>,
    /// What went wrong with switches, ends of tracks and trains in each other's way, in order of time.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub incidents: Vec<Incident>,
    /// Every train, where there are several; the figures over this list are the first one's.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub trains: Vec<TrainSummary>,
}

/// The figures of one train, as in [`Summary`].
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub struct TrainSummary {
    /// Its number.
    pub id: TrainId,
    /// Stereo pairs read.
    pub stereo_frames: u32,
    /// Positioning, by method.
    pub positioning: BTreeMap<Method, Positioning>,
    /// What the equipment says of its cameras.
    pub cameras: BTreeMap<String, CameraFigures>,
    /// Lamps that the equipment says do not shine, by their UIDs, in the order passed.
    pub dark_lamps: Vec<String>,
    /// Track occupancy.
    pub occupancy: Option<OccupancyFigures>,
    /// Train protection.
    pub protection: Option<ProtectionFigures>,
    /// How it ran.
    pub train: Option<TrainFigures>,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum End {
    /// As the scenario has it.
    Complete,
    /// Broken off by the user.
    Interrupted,
    /// Something failed; the text says what.
    Failed(String),
}

/// Cost of the physics.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct Physics {
    /// Microseconds of wall time a step of the world.
    pub us_per_step: f64,
}

/// Where the wall time went.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct WallShares {
    /// Stepping the world.
    pub physics_s: f64,
    /// Handing scenes to the renderer.
    pub submit_s: f64,
    /// Waiting for images.
    pub wait_s: f64,
    /// The stack at work.
    pub stack_s: f64,
    /// Recording.
    pub record_s: f64,
}

/// One method's figures. Errors are along the track, without sign.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Positioning {
    /// Positions given.
    pub fixes: u32,
    /// Fixes a pair.
    pub availability: Option<f64>,
    /// Share of the lamps passed whose name was read from the stripes.
    pub uid_decode_rate: Option<f64>,
    /// Fixes that rest on the wrong lamp.
    pub wrong_uid: u32,
    /// Error of the chainage.
    pub error_m: Option<ErrorStatistics>,
    /// Cost of the stack a pair of images (all methods together).
    pub ms_per_frame: Option<Cost>,
    /// Mean of (error/sigma)^2: 1 for an honest sigma.
    pub nees_mean: Option<f64>,
}

/// What the stack says of one camera.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct CameraFigures {
    /// Frames that never came, by the gaps in their numbers.
    pub lost_frames: u32,
    /// Its faults, in order of time.
    pub faults: Vec<FaultSpan>,
}

/// One fault of a camera, as the stack saw it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct FaultSpan {
    /// Which.
    pub fault: CameraFault,
    /// Start of the first frame that showed it; where none came, when that was noticed.
    pub from_s: f64,
    /// Start of the first frame that did not; `null` where it lasted to the end.
    pub to_s: Option<f64>,
}

/// Wayside detection.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Wayside {
    /// Every obstacle that came to lie in view of a device (in its picture, not behind a
    /// wall; however small and far away), or was reported while it moved.
    pub obstacles: Vec<ObstacleScore>,
    /// Dangers reported, counted once a frame, whose region in the picture is of nothing that is there:
    /// region and outline have less than half of the smaller of them in common, or less than a tenth of what
    /// either covers. What is still reported after it has gone or left the picture counts too.
    pub false_alarms: u32,
    /// Dangers reported, counted once a frame, with no thing, worker or train at the place reported: the
    /// middle of the report is more than 2.5 m along the line or 0.5 m across from all of it, or the report is
    /// more than 5 m longer or 1 m wider than it.
    pub misplaced_alarms: u32,
    /// Cost of the stack a frame.
    pub ms_per_frame: Option<Cost>,
}

/// How one obstacle was found.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ObstacleScore {
    /// Its name in the scenario.
    pub name: String,
    /// Its largest dimension.
    pub size_m: f64,
    /// When the first report of it was given, moving or at rest: `stack.latency_ms` after the last
    /// row of the frame.
    pub first_detected_s: Option<f64>,
    /// From when it lay visible (at rest, in view) to the first report given from then on; of a
    /// thing reported on its way already, to the next report of it, not below 0. The detector's
    /// confirmation over several frames is part of it, and so is all the time for which a worker or
    /// a train stood before it. A report is of it by its region in the picture. `null` where it never lay,
    /// or was not reported after that.
    pub latency_s: Option<f64>,
    /// The same to the first report of its place: its middle within 2.5 m of the thing along the line and
    /// 0.5 m across, and no more than 5 m longer and 1 m wider.
    pub placed_latency_s: Option<f64>,
    /// How far the middle of the report is from its own along the line, without sign: mean over the frames
    /// that report it at rest.
    pub distance_error_m: Option<f64>,
}

/// How the train ran: figures of the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct TrainFigures {
    /// Distance of its head, along the line.
    pub run_m: f64,
    /// Where its head stood at the end less the stop mark; `null` where there is none, or it runs, or a switch led it
    /// off its route.
    pub stop_error_m: Option<f64>,
    /// A wheelset left the rails, and the run ended there.
    pub derailed: bool,
    /// RMS of the acceleration of the leading car's floor over its first bogie: forward, left, up; 50
    /// samples a second.
    pub floor_accel_rms_mps2: [f64; 3],
    /// Least normal force of any wheel in any step, over its load at rest.
    pub least_wheel_load_share: f64,
    /// Most that any wheel slipped or slid in any step.
    pub most_slip_mps: f64,
    /// Most that the rails pressed any wheelset aside, either way.
    pub most_lateral_n: f64,
    /// Where the energy went.
    pub energy: EnergyBook,
    /// Energy that the book cannot place, over what was turned over.
    pub energy_gap_share: f64,
}

/// Train protection.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub struct ProtectionFigures {
    /// When the train first braked for an obstacle, by the equipment or by a driver who keeps to the
    /// permitted speed.
    pub brake_commanded_s: Option<f64>,
    /// When the equipment first demanded the emergency brake of a running train, for whatever reason: speed,
    /// an unknown place, what is ahead, a fault.
    pub emergency_brake_s: Option<f64>,
    /// When the train first stood after it braked for an obstacle: slower than 0.01 m/s.
    pub stopped_s: Option<f64>,
    /// Closest approach, whether the train stopped or not: the least distance from its head to an obstacle
    /// within the gauge, or a train, ahead of it; where it hit something, minus the way that it would still
    /// have needed to stop: v^2 / (2 b), v its speed just before the first hit, b the deceleration of its
    /// emergency brake on dry rails (`train.emergency_brake_mps2`), whatever it did after that. `null` where
    /// nothing was ever ahead.
    pub stop_margin_m: Option<f64>,
    /// The train hit something.
    pub collision: bool,
    /// What it hit, in order of time.
    pub impacts: Vec<Impact>,
}
