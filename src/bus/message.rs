//! One message, and who sends and receives it.
//!
//! ```
//! use metrotwin::bus::{Content, Message, Node, OdometerSample, Receiver, SimTime, TrainId, Via};
//! let time = SimTime::from_secs(1.0);
//! let sample = OdometerSample { time, distance_m: 12.0, speed_mps: 6.0, slides: false };
//! let message = Message::own(Node::Train(TrainId(0)), time, Content::Odometer(sample));
//! assert_eq!((message.receiver, message.via), (Receiver::Own, Via::Wire));
//! ```

use super::{
    CameraStatus, DopplerSample, Frame, GnssFix, ImuSample, LedReport, LidarScan, ObstacleWarning,
    OccupancyReport, OdometerSample, PositionEstimate, ProtectionReport, RadarFrame, RadarReport,
    RadarSheet, RigCalibration, SimTime, StereoPair, TrainCommand, TrainId, TrainReport,
    WaysideCalibration, WaysideReport,
};
use serde::{Deserialize, Serialize};

/// A place with equipment, or with something that stores messages. Messages on one node reach all its
/// equipment at once; between nodes they travel by links.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Node {
    /// A train.
    Train(TrainId),
    /// A wayside device, by its name.
    Post(String),
    /// A balise, by its name: it keeps the last message written to it.
    Balise(String),
    /// The control centre.
    Control,
}

/// To whom a message goes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Receiver {
    /// Everything on the sender's node.
    Own,
    /// Another node.
    Node(Node),
    /// Every train that the radio reaches.
    Trains,
    /// Every wayside device.
    Posts,
    /// Every other node that the radio reaches.
    All,
}

/// By which way a message came.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Via {
    /// By the wiring of one node.
    Wire,
    /// From a balise, read as the train passes over it.
    Balise,
    /// By radio.
    Radio,
}

/// A message.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Message {
    /// The node that sent it.
    pub sender: Node,
    /// To whom.
    pub receiver: Receiver,
    /// When its content was true, by the clock of whoever measured it.
    pub valid_at: SimTime,
    /// When it was sent.
    pub sent_at: SimTime,
    /// When it arrived; until then, when it was sent.
    pub received_at: SimTime,
    /// By which way it came.
    pub via: Via,
    /// Its content.
    pub content: Content,
}

/// Content of a message.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[allow(
    clippy::large_enum_variant,
    reason = "messages are handed on by reference; the frequent ones are small"
)]
pub enum Content {
    /// An inertial sample.
    Imu(ImuSample),
    /// An odometer sample.
    Odometer(OdometerSample),
    /// A sample of the Doppler radar.
    Doppler(DopplerSample),
    /// A fix of the satellite receiver.
    Gnss(GnssFix),
    /// A stereo pair.
    Pair(StereoPair),
    /// A frame of a wayside camera.
    Frame(Frame),
    /// A sweep of a lidar.
    Scan(LidarScan),
    /// A frame of a radar.
    RadarFrame(RadarFrame),
    /// The antenna passed over the balise of this name.
    BalisePassed(String),
    /// The calibration sheet of a stereo rig.
    RigCalibration(RigCalibration),
    /// The sheet of a radar.
    RadarSheet(RadarSheet),
    /// The calibration sheet of a wayside device.
    WaysideCalibration(WaysideCalibration),
    /// What was read from a stereo pair.
    Led(LedReport),
    /// Where a train takes itself to be.
    Position(PositionEstimate),
    /// On which track a train takes itself to be.
    Occupancy(OccupancyReport),
    /// What was found in a wayside frame.
    Wayside(WaysideReport),
    /// What was found in a radar's frame.
    Radar(RadarReport),
    /// State of a camera that delivers no frames.
    Camera(CameraStatus),
    /// A wayside device warns, or takes a warning back.
    Warning(ObstacleWarning),
    /// A wayside device is alive and says what it sees.
    Heartbeat(ObstacleWarning),
    /// Position report of a train.
    Train(TrainReport),
    /// A cycle of a train protection.
    Protection(ProtectionReport),
    /// What the train is to do.
    Command(TrainCommand),
    /// Values of a sensor or an equipment of the user's own, by name.
    Values {
        /// What they are, with the unit.
        name: String,
        /// The values.
        values: Vec<f64>,
    },
}

impl Message {
    /// To everything on the sender's node, true and sent at one time.
    pub fn own(sender: Node, time: SimTime, content: Content) -> Self {
        Self::to(Receiver::Own, sender, time, content)
    }

    /// To a receiver, true and sent at one time.
    pub fn to(receiver: Receiver, sender: Node, time: SimTime, content: Content) -> Self {
        Self {
            sender,
            receiver,
            valid_at: time,
            sent_at: time,
            received_at: time,
            via: Via::Wire,
            content,
        }
    }

    /// As it arrives by a link.
    #[must_use]
    pub fn arrived(self, time: SimTime, via: Via) -> Self {
        Self {
            received_at: time,
            via,
            ..self
        }
    }
}
