//! Lamp positioning as a piece of equipment of a train.
//!
//! Inside, distances are those of the route that the rig's cab looks along; what it says is the place
//! of the train head. A rig in the rear cab runs backwards along the opposite route.

use super::LedPositioner;
use crate::bus::{
    CameraHealth, CameraStatus, Content, EYES, Message, Node, OdometerSample, PositionFix,
    RigCalibration, SimTime, StereoPair, Ticker, TrainEnd,
};
use crate::stack::Equipment;
use crate::stack::led::LedSettings;
use crate::track::Track;
use crate::track::network::{Network, Route};
use std::sync::Arc;

/// How often a second it is looked whether the rig has fallen silent.
const WATCH_HZ: f64 = 10.0;

/// One sigma of the way from the rear end to the head along the track, metres: couplers give, and in
/// curves the cars are chords.
const LENGTH_SIGMA_M: f64 = 0.05;

/// The cab that the rig is in.
#[derive(Clone, Debug)]
pub struct CabMount {
    end: TrainEnd,
    /// The route that the cab looks along.
    route: Route,
    /// How far the train head is behind the cab's end, as the cab looks, with its standard deviation.
    head_behind_m: f64,
    length_sigma_m: f64,
}

impl CabMount {
    /// In the cab of an end of a train of a length; `route` is the way that this cab looks.
    pub fn new(end: TrainEnd, route: Route, train_length_m: f64) -> Self {
        let (head_behind_m, length_sigma_m) = match end {
            TrainEnd::Front => (0.0, 0.0),
            TrainEnd::Rear => (train_length_m, LENGTH_SIGMA_M),
        };
        Self {
            end,
            route,
            head_behind_m,
            length_sigma_m,
        }
    }

    /// A sample of the train's odometer, as the cab looks.
    fn of_cab(&self, sample: &OdometerSample) -> OdometerSample {
        let sign = self.end.sign();
        OdometerSample {
            distance_m: sign * sample.distance_m,
            speed_mps: sign * sample.speed_mps,
            ..*sample
        }
    }

    /// A fix of the cab, as one of the head.
    fn of_head(&self, fix: PositionFix, map: &Track) -> PositionFix {
        let run_m = fix.chainage_m - self.head_behind_m;
        let (place, _) = self.route.place(run_m);
        PositionFix {
            track: place.track,
            chainage_m: place.s_m,
            sigma_m: fix.sigma_m.hypot(self.length_sigma_m),
            position: match self.end {
                TrainEnd::Front => fix.position,
                TrainEnd::Rear => map.alignment.at(run_m).origin,
            },
            ..fix
        }
    }
}

/// Takes stereo pairs, inertial and odometer samples; says a [`Content::Led`] a pair.
#[derive(Debug)]
pub struct LampPositioning {
    node: Node,
    mount: CabMount,
    map: Arc<Track>,
    positioner: LedPositioner,
    watch: Ticker,
    reports: Vec<Message>,
}

impl LampPositioning {
    /// On a node, with the rig's calibration sheet, and the surveyed network.
    pub fn new(
        node: Node,
        mount: CabMount,
        settings: &LedSettings,
        rig: RigCalibration,
        network: &Network,
    ) -> Self {
        let map = network.along(&mount.route);
        Self {
            node,
            mount,
            positioner: LedPositioner::new(settings, rig, map.clone()),
            map,
            watch: Ticker::new(WATCH_HZ),
            reports: Vec::new(),
        }
    }

    fn on_pair(&mut self, pair: &StereoPair, received: SimTime) {
        let mut report = self.positioner.on_pair(pair);
        let fixes = std::mem::take(&mut report.fixes).into_iter();
        report.fixes = fixes
            .map(|fix| self.mount.of_head(fix, &self.map))
            .collect();
        self.reports.push(Message {
            valid_at: report.time,
            ..Message::own(self.node.clone(), received, Content::Led(report))
        });
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
            // What turns the rig's images is its own car.
            Content::Imu(sample) if sample.end == self.mount.end => {
                self.positioner.on_imu(sample);
            }
            Content::Odometer(sample) => {
                self.positioner.on_odometer(&self.mount.of_cab(sample));
            }
            Content::Pair(pair) => self.on_pair(pair, message.received_at),
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

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::stack::led::testing::track;
    use crate::track::Direction;

    /// Backwards, and with all else that the odometer says.
    #[test]
    fn the_rear_cab_runs_backwards() {
        let network = Network::of_one(track("manchester"));
        let route = network.only_track(Direction::Down).unwrap();
        let sample = OdometerSample {
            time: SimTime::from_secs(1.0),
            distance_m: 12.0,
            speed_mps: 6.0,
            slides: true,
        };
        let said = |end| CabMount::new(end, route.clone(), 118.0).of_cab(&sample);
        assert_eq!(said(TrainEnd::Front), sample);
        let backwards = OdometerSample {
            distance_m: -12.0,
            speed_mps: -6.0,
            ..sample
        };
        assert_eq!(said(TrainEnd::Rear), backwards);
    }
}
