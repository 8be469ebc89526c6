//! Lamp positioning as a piece of equipment of a train.
//!
//! Inside, distances are those of the route that the rig's cab looks along; what it says is the
//! chainage of the train head. A rig in the rear cab runs backwards along the opposite route.

use super::{LedPositioner, LedSettings};
use crate::bus::{
    CameraHealth, CameraStatus, Content, EYES, Message, Node, OdometerSample, RigCalibration,
    SimTime, Ticker, TrainEnd,
};
use crate::stack::Equipment;
use crate::track::{Route, Tunnel};
use std::sync::Arc;

/// How often a second it is looked whether the rig has fallen silent.
const WATCH_HZ: f64 = 10.0;

/// The cab that the rig is in.
#[derive(Clone, Copy, Debug)]
pub struct CabMount {
    end: TrainEnd,
    /// How far the train head is behind the cab's end, as the cab looks.
    head_behind_m: f64,
}

impl CabMount {
    /// The leading cab.
    pub fn front() -> Self {
        Self {
            end: TrainEnd::Front,
            head_behind_m: 0.0,
        }
    }

    /// The rear cab of a train of a length.
    pub fn rear(train_length_m: f64) -> Self {
        Self {
            end: TrainEnd::Rear,
            head_behind_m: train_length_m,
        }
    }
}

/// Takes stereo pairs, inertial and odometer samples; says a [`Content::Led`] a pair.
#[derive(Debug)]
pub struct LampPositioning {
    node: Node,
    route: Route,
    mount: CabMount,
    positioner: LedPositioner,
    watch: Ticker,
    reports: Vec<Message>,
}

impl LampPositioning {
    /// On a node, with the rig's calibration sheet, and the surveyed map of the route that the cab looks
    /// along.
    pub fn new(
        (node, route, mount): (Node, Route, CabMount),
        settings: &LedSettings,
        rig: RigCalibration,
        map: Arc<Tunnel>,
    ) -> Self {
        Self {
            node,
            route,
            mount,
            positioner: LedPositioner::new(settings, rig, map),
            watch: Ticker::new(WATCH_HZ),
            reports: Vec::new(),
        }
    }

    fn silent(&self, now: SimTime) -> impl Iterator<Item = Message> {
        EYES.map(|eye| {
            let status = CameraStatus {
                camera: eye.to_owned(),
                health: CameraHealth::SILENT,
            };
            Message::own(self.node.clone(), now, Content::Camera(status))
        })
        .into_iter()
    }
}

impl Equipment for LampPositioning {
    fn on(&mut self, message: &Message) {
        match &message.content {
            Content::Imu(sample) => self.positioner.on_imu(sample),
            Content::Odometer(sample) => {
                let sign = self.mount.end.sign();
                self.positioner.on_odometer(&OdometerSample {
                    time: sample.time,
                    distance_m: sign * sample.distance_m,
                    speed_mps: sign * sample.speed_mps,
                });
            }
            Content::Pair(pair) => {
                let mut report = self.positioner.on_pair(pair);
                for fix in &mut report.fixes {
                    fix.chainage_m = self
                        .route
                        .chainage_m(fix.chainage_m - self.mount.head_behind_m);
                }
                self.reports.push(Message {
                    valid_at: report.time,
                    ..Message::own(self.node.clone(), message.received_at, Content::Led(report))
                });
            }
            _ => {}
        }
    }

    fn cycle(&mut self, now: SimTime) -> Vec<Message> {
        let mut messages = std::mem::take(&mut self.reports);
        if self.watch.due(now, 0.0).is_some() && self.positioner.is_silent(now) {
            messages.extend(self.silent(now));
        }
        messages
    }
}
