//! Lamp positioning as a piece of equipment of a train.
//!
//! Inside, distances are those of the train's route; what it says is in chainage of the track.

use super::{LedPositioner, LedSettings};
use crate::bus::{
    CameraHealth, CameraStatus, Content, EYES, Message, Node, RigCalibration, SimTime, Ticker,
};
use crate::stack::Equipment;
use crate::track::{Route, Tunnel};
use std::sync::Arc;

/// How often a second it is looked whether the rig has fallen silent.
const WATCH_HZ: f64 = 10.0;

/// Takes stereo pairs, inertial and odometer samples; says a [`Content::Led`] a pair.
#[derive(Debug)]
pub struct LampPositioning {
    node: Node,
    route: Route,
    positioner: LedPositioner,
    watch: Ticker,
    reports: Vec<Message>,
}

impl LampPositioning {
    /// On a node, with the rig's calibration sheet and the surveyed map of the route, as the train
    /// runs it.
    pub fn new(
        (node, route): (Node, Route),
        settings: &LedSettings,
        rig: RigCalibration,
        map: Arc<Tunnel>,
    ) -> Self {
        Self {
            node,
            route,
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
            Content::Odometer(sample) => self.positioner.on_odometer(sample),
            Content::Pair(pair) => {
                let mut report = self.positioner.on_pair(pair);
                for fix in &mut report.fixes {
                    fix.chainage_m = self.route.chainage_m(fix.chainage_m);
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
