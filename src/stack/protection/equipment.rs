//! Train protection as a piece of equipment of a train.
//!
//! Inside, distances are those of the train's route; what it hears and says is in chainage of the
//! track.

use super::{Protection, ProtectionSettings};
use crate::bus::{
    Content, DangerLevel, Message, Node, ObstacleWarning, PositionEstimate, PositionFix,
    ProtectionReport, Receiver, SimTime, Ticker, TrainReport, Via,
};
use crate::stack::Equipment;
use crate::track::{Direction, Track, TrackRoute};
use std::sync::Arc;

/// Cycles of the protection a second.
const CYCLE_HZ: f64 = 10.0;

/// Takes positions, odometer samples, balises, warnings and the reports of other trains; commands the
/// train, and tells all others where it is.
#[derive(Debug)]
pub struct TrainProtection {
    node: Node,
    route: TrackRoute,
    protection: Protection,
    cycles: Ticker,
}

impl TrainProtection {
    /// On a node, with the surveyed map of the route, as the train runs it.
    pub fn new(
        node: Node,
        route: TrackRoute,
        settings: &ProtectionSettings,
        map: Arc<Track>,
    ) -> Self {
        let initial_chainage_m = settings.initial_chainage_m.map(|s_m| route.run_m(s_m));
        let settings = ProtectionSettings {
            initial_chainage_m,
            ..settings.clone()
        };
        Self {
            node,
            route,
            protection: Protection::new(&settings, map),
            cycles: Ticker::new(CYCLE_HZ),
        }
    }

    fn on_fix(&mut self, fix: &PositionFix) {
        let chainage_m = self.route.run_m(fix.chainage_m);
        self.protection.on_fix(&PositionFix {
            chainage_m,
            ..fix.clone()
        });
    }

    /// A warning with distances of the route.
    fn on_route(&self, warning: &ObstacleWarning) -> ObstacleWarning {
        let (from_chainage_m, to_chainage_m) =
            (self.route).stretch_m(warning.from_chainage_m, warning.to_chainage_m);
        ObstacleWarning {
            from_chainage_m,
            to_chainage_m,
            ..warning.clone()
        }
    }

    /// Another train is an obstacle from its tail to its head, each as far out as its position may be
    /// wrong, where it last said to be: it does not roll back.
    fn on_train(&mut self, sender: &Node, report: &TrainReport, received: SimTime) {
        let Node::Train(id) = sender else {
            return;
        };
        let sign = report.direction.sign();
        let margin_m = self.protection.settings.position_sigmas * report.sigma_m;
        let head_m = report.chainage_m + sign * margin_m;
        let tail_m = report.chainage_m - sign * (report.length_m + margin_m);
        let (from_chainage_m, to_chainage_m) = match report.direction {
            Direction::Up => (tail_m, head_m),
            Direction::Down => (head_m, tail_m),
        };
        let warning = ObstacleWarning {
            device: id.to_string(),
            number: 0,
            issued: report.time,
            danger: DangerLevel::High,
            from_chainage_m,
            to_chainage_m,
            blind: false,
        };
        let warning = self.on_route(&warning);
        self.protection.on_warning(&warning, received);
    }

    /// With the chainages of the track.
    fn in_chainage(&self, report: ProtectionReport) -> ProtectionReport {
        let on_track = |run_m: Option<f64>| run_m.map(|run_m| self.route.chainage_m(run_m));
        let mut display = report.display;
        display.position_m = on_track(display.position_m);
        ProtectionReport {
            position_m: on_track(report.position_m),
            authority_end_m: on_track(report.authority_end_m),
            display,
            ..report
        }
    }
}

impl Equipment for TrainProtection {
    fn on(&mut self, message: &Message) {
        match &message.content {
            Content::Odometer(sample) => self.protection.on_odometer(sample),
            Content::Led(report) => {
                if let Some(fix) = report.best_fix() {
                    self.on_fix(fix);
                }
            }
            Content::BalisePassed(name) => self.protection.on_balise(name, message.valid_at),
            Content::Warning(warning) => {
                let warning = self.on_route(warning);
                if message.via == Via::Radio {
                    (self.protection).on_heartbeat(&warning, message.sent_at, message.received_at);
                } else {
                    self.protection.on_warning(&warning, message.received_at);
                }
            }
            Content::Heartbeat(state) => {
                let state = self.on_route(state);
                (self.protection).on_heartbeat(&state, message.sent_at, message.received_at);
            }
            Content::Train(report) if report.track == self.route.track => {
                self.on_train(&message.sender, report, message.received_at);
            }
            _ => {}
        }
    }

    fn cycle(&mut self, now: SimTime) -> Vec<Message> {
        if self.cycles.due(now, 0.0).is_none() {
            return Vec::new();
        }
        let report = self.protection.cycle(now);
        let report = self.in_chainage(report);
        let own = |content| Message::own(self.node.clone(), now, content);
        let position = report.position_m.map(|chainage_m| {
            let train = TrainReport {
                track: self.route.track,
                chainage_m,
                sigma_m: report.sigma_m.unwrap_or_default(),
                length_m: self.protection.settings.length_m(),
                direction: self.route.direction,
                speed_mps: report.speed_mps,
                time: now,
            };
            Message::to(Receiver::All, self.node.clone(), now, Content::Train(train))
        });
        let estimate = self.protection.estimate(now, self.route.direction);
        let estimate = estimate.map(|estimate| {
            own(Content::Position(PositionEstimate {
                track: self.route.track,
                s_m: self.route.chainage_m(estimate.s_m),
                ..estimate
            }))
        });
        let command = own(Content::Command(report.command));
        let report = own(Content::Protection(report));
        let own = [report, command].into_iter().chain(estimate);
        own.chain(position).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::map;
    use super::*;
    use crate::bus::{OdometerSample, TrainId};

    /// The equipment of a train at 2000 m of a line of 4 km, and where its authority ends after it has
    /// heard `content` of `sender` by radio.
    fn authority_end_m(direction: Direction, sender: Node, content: Content) -> Option<f64> {
        let up = map(0.0);
        let route = TrackRoute::new(&up, direction);
        let map = match direction {
            Direction::Up => up,
            Direction::Down => Arc::new(up.reversed()),
        };
        let settings = ProtectionSettings {
            initial_chainage_m: Some(2000.0),
            ..ProtectionSettings::default()
        };
        let node = Node::Train(TrainId(0));
        let mut equipment = TrainProtection::new(node.clone(), route, &settings, map);
        let time = SimTime::from_secs(1.0);
        let odometer = OdometerSample {
            time,
            distance_m: 0.0,
            speed_mps: 0.0,
            slides: false,
        };
        equipment.on(&Message::own(node, time, Content::Odometer(odometer)));
        equipment
            .on(&Message::to(Receiver::Trains, sender, time, content).arrived(time, Via::Radio));
        let said = equipment.cycle(time);
        said.iter().find_map(|message| match &message.content {
            Content::Protection(report) => {
                assert_eq!(report.position_m, Some(2000.0));
                report.authority_end_m
            }
            _ => None,
        })
    }

    /// An obstacle or a train ahead that is met from the wrong end, or is ahead of a train that has
    /// passed it; a train whose length or sigma is left out.
    #[test]
    fn what_is_ahead_ends_the_authority_both_ways() {
        let obstacle = |from_chainage_m: f64| {
            Content::Warning(ObstacleWarning {
                device: "W1".into(),
                number: 0,
                issued: SimTime::ZERO,
                danger: DangerLevel::High,
                from_chainage_m,
                to_chainage_m: from_chainage_m + 1.0,
                blind: false,
            })
        };
        let post = || Node::Post("W1".into());
        let end = |direction, content| authority_end_m(direction, post(), content);
        assert_eq!(end(Direction::Up, obstacle(2300.0)), Some(2275.0));
        assert_eq!(end(Direction::Up, obstacle(1700.0)), None);
        assert_eq!(end(Direction::Down, obstacle(1700.0)), Some(1726.0));
        assert_eq!(end(Direction::Down, obstacle(2300.0)), None);

        let train = |chainage_m: f64, direction| {
            Content::Train(TrainReport {
                chainage_m,
                sigma_m: 2.0,
                length_m: 100.0,
                direction,
                ..TrainReport::default()
            })
        };
        let other = || Node::Train(TrainId(1));
        let end = |direction, content| authority_end_m(direction, other(), content);
        // The tail, three sigma, and 25 m before.
        let ahead = end(Direction::Up, train(2500.0, Direction::Up));
        assert_eq!(ahead, Some(2500.0 - 100.0 - 6.0 - 25.0));
        let ahead = end(Direction::Down, train(1500.0, Direction::Down));
        assert_eq!(ahead, Some(1500.0 + 100.0 + 6.0 + 25.0));
        assert_eq!(end(Direction::Up, train(1500.0, Direction::Up)), None);
        // One that comes: its head.
        let comes = end(Direction::Up, train(2500.0, Direction::Down));
        assert_eq!(comes, Some(2500.0 - 6.0 - 25.0));
    }
}
