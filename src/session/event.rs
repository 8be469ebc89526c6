//! What passes in a session, as observers (recordings, tables, scores) see it.

use crate::bus::{
    CameraFault, Frame, LedReport, Message, Node, RigCalibration, SimTime, StereoPair, TrainId,
    WaysideCalibration, WaysideReport,
};
use crate::track::Tunnel;
use crate::twin::geometry::Body;
use crate::twin::physics::{BodyLabel, TrainState};
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
    /// Trains with equipment, and the rig of a bench.
    pub trains: &'a [TrainOpening],
    /// Wayside devices in use.
    pub wayside: &'a [WaysideCalibration],
}

/// What is known of a train before the first step.
#[derive(Clone, Copy, Debug)]
pub struct TrainOpening {
    /// Its number.
    pub id: TrainId,
    /// Its rig.
    pub rig: Option<RigCalibration>,
    /// Half extents of every car body and the pose of its centre over the vehicle frame.
    pub car_half_extents_m: Vector3<f64>,
    /// Its cars, 0 on a bench.
    pub cars: usize,
    /// It has a Doppler radar.
    pub radar: bool,
    /// A protection runs: its reports and the driver's display will come.
    pub protection: bool,
}

/// Whose images they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The pair of a train's rig, left then right.
    Rig(TrainId),
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
    pub owners: &'a [BodyLabel<'a>],
    /// The train in the middle of the exposure of the first view's middle row.
    pub train: Option<TrainPoint>,
}

impl Opening<'_> {
    /// The first train, or the rig of a bench.
    pub fn first(&self) -> Option<&TrainOpening> {
        self.trains
            .iter()
            .find(|train| train.id == TrainId::default())
    }
}

/// Where a train is at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainPoint {
    /// Chainage of its head.
    pub chainage_m: f64,
    /// Speed along the line.
    pub speed_mps: f64,
    /// Pose of the vehicle frame at the end that its rig is at.
    pub world_from_vehicle: Isometry3<f64>,
}

/// One thing that happened. Events come in order of their time of completion.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// A train as it really is and the pose of its left camera, where it has a rig; 50 times a
    /// second.
    Train(TrainId, &'a TrainState, Option<&'a Isometry3<f64>>),
    /// A message arrived at a node, or was sent there; those with images come as [`Event::Pair`] and
    /// [`Event::Wayside`].
    Message(&'a Node, &'a Message),
    /// Everything solid but the first train, 10 times a second.
    Bodies(SimTime, &'a [Body]),
    /// A frame has been taken.
    Exposure(&'a Exposure<'a>),
    /// A pair of images, what the stack said of it, and the true chainage at each fix's time.
    Pair(TrainId, &'a StereoPair, &'a LedReport, &'a [f64]),
    /// A wayside frame and its report; the index is into [`Opening::wayside`].
    Wayside(usize, &'a Frame, &'a WaysideReport),
    /// The equipment of a node says that a camera has failed, with another fault than before, or that
    /// it is well again.
    Camera(SimTime, &'a Node, &'a str, Option<CameraFault>),
    /// How long the equipment of a node worked on an image, in milliseconds of wall time. Nothing depends
    /// on it.
    Cost(&'a Node, f64),
    /// Anything worth a line in the log.
    Note(SimTime, &'a str),
}

/// Something that watches a session. It cannot change what happens.
pub trait Observer {
    /// Before the first step.
    fn open(&mut self, _opening: &Opening<'_>) -> Result<(), ObserverError> {
        Ok(())
    }
    /// After each happening.
    fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError>;
    /// After the last one; also when a run is broken off or fails.
    fn close(&mut self) -> Result<(), ObserverError> {
        Ok(())
    }
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
