//! Obstacle detection as the equipment of a wayside post.

use super::{WaysideDetector, WaysideSettings};
use crate::bus::{
    CameraStatus, Content, LidarScan, Message, Node, Receiver, SimTime, Ticker, TrainId,
    TrainReport, WaysideCalibration, WaysideReport,
};
use crate::stack::Equipment;
use crate::track::{Track, TrackId};
use std::collections::BTreeMap;
use std::sync::Arc;

/// How often a second it is looked whether the camera has fallen silent.
const WATCH_HZ: f64 = 10.0;
/// A train that has not reported for this long may be anywhere.
const REPORT_LIFE_S: f64 = 5.0;

/// Takes frames, sweeps and the reports of trains; says a [`Content::Wayside`] a frame, warns trains
/// by radio and through its balise, and sends heartbeats while it sees.
#[derive(Debug)]
pub struct WaysideDetection {
    node: Node,
    name: String,
    track: TrackId,
    /// The balise that stores its messages.
    balise: Option<String>,
    detector: WaysideDetector,
    scan: Option<LidarScan>,
    trains: BTreeMap<TrainId, TrainReport>,
    watch: Ticker,
    heartbeat_s: f64,
    last_heartbeat: Option<SimTime>,
    messages: Vec<Message>,
}

impl WaysideDetection {
    /// Of a device as calibrated, with the surveyed map of its track, which knows its balise.
    pub fn new(
        settings: &WaysideSettings,
        calibration: WaysideCalibration,
        map: Arc<Track>,
    ) -> Self {
        let name = calibration.name.clone();
        let site = map.wayside.iter().find(|site| site.name == name);
        Self {
            node: Node::Post(name.clone()),
            balise: site.map(|site| site.balise.clone()),
            name,
            track: calibration.track,
            detector: WaysideDetector::new(settings, calibration, map),
            scan: None,
            trains: BTreeMap::new(),
            watch: Ticker::new(WATCH_HZ),
            heartbeat_s: settings.heartbeat_s,
            last_heartbeat: None,
            messages: Vec::new(),
        }
    }

    /// The trains with their heads on the device's track that have reported lately.
    fn trains(&self, now: SimTime) -> Vec<TrainReport> {
        let is_here = |train: &&TrainReport| {
            train.track == self.track && now.since(train.time) <= REPORT_LIFE_S
        };
        self.trains.values().filter(is_here).cloned().collect()
    }

    fn send(&mut self, receiver: Receiver, now: SimTime, content: Content) {
        let message = Message::to(receiver, self.node.clone(), now, content);
        self.messages.push(message);
    }

    /// What the trains are to know of a report.
    fn warn(&mut self, report: &WaysideReport, now: SimTime) {
        let Some(mut warning) = self.detector.message(report) else {
            return;
        };
        // The order of what it says is that of its own time, not of its camera's clock.
        warning.issued = now;
        let balise = self.balise.clone().map(Node::Balise).map(Receiver::Node);
        for receiver in balise.into_iter().chain([Receiver::Trains]) {
            self.send(receiver, now, Content::Warning(warning.clone()));
        }
    }

    /// The trains are to know that the device is alive and sees.
    fn beat(&mut self, now: SimTime) {
        let due = |last: SimTime| now.since(last) >= self.heartbeat_s - 1e-6;
        if !self.last_heartbeat.is_none_or(due) {
            return;
        }
        if let Some(mut state) = self.detector.heartbeat() {
            state.issued = now;
            self.last_heartbeat = Some(now);
            self.send(Receiver::Trains, now, Content::Heartbeat(state));
        }
    }
}

impl Equipment for WaysideDetection {
    fn on(&mut self, message: &Message) {
        match (&message.content, &message.sender) {
            (Content::Scan(scan), _) => self.scan = Some(scan.clone()),
            (Content::Train(report), Node::Train(id)) => {
                let newest = self.trains.entry(*id).or_insert_with(|| report.clone());
                if report.time > newest.time {
                    newest.clone_from(report);
                }
            }
            (Content::Frame(frame), _) => {
                let now = message.received_at;
                let trains = self.trains(now);
                let report = self.detector.on_frame(frame, self.scan.as_ref(), &trains);
                self.warn(&report, now);
                if report.camera.is_good() {
                    self.beat(now);
                }
                self.messages.push(Message {
                    valid_at: report.time,
                    ..Message::own(self.node.clone(), now, Content::Wayside(report))
                });
            }
            _ => {}
        }
    }

    fn cycle(&mut self, now: SimTime) -> Vec<Message> {
        if self.watch.due(now, 0.0).is_some() {
            let trains = self.trains(now);
            if let Some(report) = self.detector.on_time(now, &trains) {
                self.warn(&report, now);
                let status = CameraStatus {
                    camera: self.name.clone(),
                    health: report.camera,
                };
                self.send(Receiver::Own, now, Content::Camera(status));
            }
        }
        std::mem::take(&mut self.messages)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::super::test_scene::TestScene;
    use super::*;
    use crate::bus::Frame;

    /// Heartbeats that a device sends in frames 11 to 109, ten a second; `stuck` repeats one image.
    fn heartbeats(stuck: bool) -> usize {
        let scene = TestScene::new(320, 180);
        let settings = WaysideSettings::default();
        let mut device =
            WaysideDetection::new(&settings, scene.calibration.clone(), scene.map.clone());
        let first = scene.frame(10, |_, _| 1.0, &[]);
        let frames = (0..110).map(|n| {
            let frame = scene.frame(n, |_, _| 1.0, &[]);
            match stuck && n > 10 {
                true => Frame {
                    image: first.image.clone(),
                    ..frame
                },
                false => frame,
            }
        });
        let sent = frames.flat_map(|frame| {
            let (number, now) = (frame.number, frame.start);
            let node = Node::Post("W1".into());
            device.on(&Message::own(node, now, Content::Frame(frame)));
            let messages = device.cycle(now);
            messages.into_iter().filter(move |_| number > 10)
        });
        sent.filter(|m| matches!(m.content, Content::Heartbeat(_)))
            .count()
    }

    /// Fails where a device whose camera repeats itself says that it is alive.
    #[test]
    fn a_frozen_camera_has_no_heartbeat() {
        assert_eq!(heartbeats(false), 10);
        assert_eq!(heartbeats(true), 0);
    }
}
