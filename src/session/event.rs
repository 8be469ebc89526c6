//! What passes in a session, as observers (recordings, tables, scores) see it.

use crate::bus::{
    CameraFault, Delivery, DopplerSample, Frame, LedReport, OdometerSample, ProtectionReport,
    RigCalibration, SimTime, StereoPair, WaysideCalibration, WaysideReport,
};
use crate::track::Tunnel;
use crate::twin::geometry::Body;
use crate::twin::physics::{Belonging, TrainState};
use crate::twin::render::Job;
use nalgebra::{Isometry3, Vector3};

/// What is known before the first step.
#[derive(Clone, Copy, Debug)]
pub struct Opening<'a> {
    /// Name of the scenario.
    pub scenario: &'a str,
    /// Seed of the run.
    pub seed: u64,
    /// The line.
    pub tunnel: &'a Tunnel,
    /// The rig on the train.
    pub rig: Option<&'a RigCalibration>,
    /// Wayside devices in use.
    pub wayside: &'a [WaysideCalibration],
    /// Half extents of every car body and the pose of its centre over the vehicle frame.
    pub car_half_extents_m: Vector3<f64>,
    /// Cars of the train, 0 where there is none.
    pub cars: usize,
    /// The train has a Doppler radar.
    pub radar: bool,
    /// A protection runs: its reports and the driver's display will come.
    pub protection: bool,
}

/// Whose images they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The rig's pair, left then right.
    Rig,
    /// A wayside device; the index is into [`Opening::wayside`].
    Wayside(usize),
}

/// What there is to see when the last row of a frame has closed. The images themselves reach the
/// stack later: [`Event::Pair`] and [`Event::Wayside`] of the same number.
#[derive(Clone, Copy, Debug)]
pub struct Exposure<'a> {
    /// Whose.
    pub source: Source,
    /// Number of the frame.
    pub number: u32,
    /// The scene and the views, as the renderer is given them.
    pub job: &'a Job,
    /// Owners of the job's bodies, in order.
    pub owners: &'a [Belonging<'a>],
    /// The train in the middle of the exposure of the first view's middle row.
    pub train: Option<TrainPoint>,
}

/// Where a train is at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainPoint {
    /// Chainage of its head.
    pub chainage_m: f64,
    /// Speed along the line.
    pub speed_mps: f64,
    /// Pose of the vehicle frame.
    pub world_from_vehicle: Isometry3<f64>,
}

/// One thing that happened. Events come in order of their time of completion.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// The train as it really is and the pose of its left camera, where it has a rig; 50 times a
    /// second.
    Train(&'a TrainState, Option<&'a Isometry3<f64>>),
    /// What the odometer says.
    Odometer(&'a OdometerSample),
    /// What the Doppler radar says.
    Doppler(&'a DopplerSample),
    /// Everything solid but the train, 10 times a second.
    Bodies(SimTime, &'a [Body]),
    /// A frame has been taken.
    Exposure(&'a Exposure<'a>),
    /// A pair of images, what the stack said of it, and the true chainage at each fix's time.
    Pair(&'a StereoPair, &'a LedReport, &'a [f64]),
    /// A wayside frame and its report; the index is into [`Opening::wayside`].
    Wayside(usize, &'a Frame, &'a WaysideReport),
    /// A cycle of the protection.
    Protection(&'a ProtectionReport),
    /// The stack says that a camera has failed, with another fault than before, or that it is well
    /// again.
    Camera(SimTime, &'a str, Option<CameraFault>),
    /// A message arrived at the train.
    Delivery(&'a Delivery),
    /// Anything worth a line in the log.
    Note(SimTime, &'a str),
}

/// Something that watches a session. It cannot change what happens.
pub trait Observer {
    /// Before the first step.
    fn open(&mut self, opening: &Opening<'_>) -> Result<(), ObserverError>;
    /// After each happening.
    fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError>;
    /// After the last one; also when a run is broken off or fails.
    fn close(&mut self) -> Result<(), ObserverError>;
}

/// Why an observer could not write down what it saw.
#[derive(Debug, thiserror::Error)]
#[error("{what}: {source}")]
pub struct ObserverError {
    /// What it was doing.
    pub what: String,
    /// What went wrong.
    pub source: Box<dyn std::error::Error + Send + Sync>,
}
