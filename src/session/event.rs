//! What passes in a session, as observers (recordings, tables, scores) see it.

use super::OccupancyClass;
use crate::bus::{
    CameraFault, Frame, LedReport, Message, Node, OccupancyReport, RigCalibration, SimTime,
    StereoPair, TrainId, WaysideCalibration, WaysideReport,
};
use crate::track::{Place, TrackId, Tunnel};
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
    /// The tracks and what stands along them.
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
    /// Track occupancy runs: its reports will come.
    pub occupancy: bool,
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
    /// The track that its head is on.
    pub track: TrackId,
    /// Chainage of its head.
    pub chainage_m: f64,
    /// Speed along the track.
    pub speed_mps: f64,
    /// Pose of the vehicle frame at the end that its rig is at.
    pub world_from_vehicle: Isometry3<f64>,
}

/// One thing that happened. Events come in order of their time of completion.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// Where a train really is; 50 times a second.
    Train {
        /// Which train.
        train: TrainId,
        /// Its state.
        truth: &'a TrainState,
        /// Pose `world_from_camera` of its left camera, where it has a rig.
        left_eye: Option<&'a Isometry3<f64>>,
    },
    /// A train's track occupancy reported.
    Occupancy {
        /// Which train.
        train: TrainId,
        /// What it says.
        report: &'a OccupancyReport,
        /// Its class, if it comes of a fix or the train has no receiver.
        class: Option<OccupancyClass>,
        /// Where the antenna really was at the time of the report; none where the world does not go so far back.
        truth: Option<Place>,
    },
    /// A message arrived at a node, or was sent there; those with images come as [`Event::Pair`] and
    /// [`Event::Wayside`].
    Message {
        /// Where.
        node: &'a Node,
        /// What it says.
        message: &'a Message,
    },
    /// Everything solid but the first train, 10 times a second.
    Bodies {
        /// When.
        time: SimTime,
        /// In world coordinates.
        bodies: &'a [Body],
    },
    /// The blades of all switches: at first, and while any of them moves.
    Blades {
        /// When.
        time: SimTime,
        /// In world coordinates.
        bodies: &'a [Body],
    },
    /// A frame has been taken.
    Exposure(&'a Exposure<'a>),
    /// A pair of images that reached the equipment of a train.
    Pair {
        /// Which train.
        train: TrainId,
        /// The images.
        pair: &'a StereoPair,
        /// What the equipment said of them.
        report: &'a LedReport,
        /// True chainage of the head at the time of each fix of the report, metres.
        true_chainages_m: &'a [f64],
    },
    /// A frame that reached the equipment of a wayside post.
    Wayside {
        /// Index into [`Opening::wayside`].
        post: usize,
        /// The image.
        frame: &'a Frame,
        /// What the equipment said of it.
        report: &'a WaysideReport,
    },
    /// Equipment says that a camera has failed, with another fault than before, or that it is well
    /// again.
    Camera {
        /// When.
        time: SimTime,
        /// Where the equipment is.
        node: &'a Node,
        /// Name of the camera.
        camera: &'a str,
        /// What is wrong with it.
        fault: Option<CameraFault>,
    },
    /// How long the equipment of a node worked on an image. Nothing depends on it.
    Cost {
        /// Where the equipment is.
        node: &'a Node,
        /// Wall time, milliseconds.
        cost_ms: f64,
    },
    /// Anything worth a line in the log.
    Note {
        /// When.
        time: SimTime,
        /// The line.
        text: &'a str,
    },
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
