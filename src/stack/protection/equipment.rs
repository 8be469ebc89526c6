//! Train protection as a piece of equipment of a train.
//!
//! Inside, distances are those of the train's route; what it hears and says is in places of the network.

use super::{Protection, ProtectionSettings};
use crate::bus::{
    Content, DangerLevel, Message, Node, ObstacleWarning, PositionEstimate, PositionFix,
    ProtectionReport, Receiver, SimTime, Ticker, TrainReport, Via,
};
use crate::stack::Equipment;
use crate::track::network::{Network, Route, RouteEnvelope};
use crate::track::{Direction, Place, TrackId};

/// Cycles of the protection a second.
const CYCLE_HZ: f64 = 10.0;

/// Takes positions, odometer samples, balises, warnings and the reports of other trains; commands the
/// train, and tells all others where it is.
#[derive(Debug)]
pub struct TrainProtection {
    node: Node,
    envelope: RouteEnvelope,
    /// Where the head was last taken to be, along the route.
    head_m: f64,
    protection: Protection,
    cycles: Ticker,
}

impl TrainProtection {
    /// On a node, of a train that runs a route, with the surveyed network.
    pub fn new(node: Node, network: &Network, route: Route, settings: &ProtectionSettings) -> Self {
        let settings = ProtectionSettings {
            initial_chainage_m: initial_run_m(settings, network, &route),
            ..settings.clone()
        };
        let map = network.along(&route);
        Self {
            node,
            envelope: RouteEnvelope::new(network, route),
            head_m: settings.initial_chainage_m.unwrap_or(0.0),
            protection: Protection::new(&settings, map),
            cycles: Ticker::new(CYCLE_HZ),
        }
    }

    fn route(&self) -> &Route {
        self.envelope.route()
    }

    /// A fix on another track than those of the route is none.
    fn on_fix(&mut self, fix: &PositionFix) {
        if let Some(run_m) = self.route().run_near_m(fix.place(), self.head_m) {
            self.protection.on_fix(&PositionFix {
                track: TrackId::default(),
                chainage_m: run_m,
                ..fix.clone()
            });
        }
    }

    /// A warning with distances of the route: the nearest stretch of it that is not behind the train. What is not
    /// in the way of the route is no danger on it.
    fn on_route(&self, warning: &ObstacleWarning) -> ObstacleWarning {
        let runs = || self.envelope.runs_over(warning.stretch());
        let ahead = runs().filter(|(_, to_m)| *to_m >= self.head_m);
        let nearest = ahead.min_by(|a, b| a.0.total_cmp(&b.0)).or(runs().last());
        let (from_chainage_m, to_chainage_m) = nearest.unwrap_or_default();
        ObstacleWarning {
            track: TrackId::default(),
            from_chainage_m,
            to_chainage_m,
            danger: match nearest {
                Some(_) => warning.danger,
                None => DangerLevel::None,
            },
            ..warning.clone()
        }
    }

    /// Another train is an obstacle from its tail to its head, each as far out as its position may be
    /// wrong, where it last said to be: it does not roll back.
    fn on_train(&mut self, sender: &Node, report: &TrainReport, received: SimTime) {
        let Node::Train(id) = sender else {
            return;
        };
        let margin_m = self.protection.settings.position_sigmas * report.sigma_m;
        let stretches = report.occupied.iter().map(|s| s.widened(margin_m));
        let runs = stretches.flat_map(|stretch| self.envelope.runs_over(stretch));
        let whole = runs.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        let (from_chainage_m, to_chainage_m) = whole.unwrap_or_default();
        let warning = ObstacleWarning {
            device: id.to_string(),
            number: 0,
            issued: report.time,
            danger: match whole {
                Some(_) => DangerLevel::High,
                None => DangerLevel::None,
            },
            track: TrackId::default(),
            from_chainage_m,
            to_chainage_m,
            blind: false,
        };
        self.protection.on_warning(&warning, received);
    }

    /// With places on the tracks.
    fn in_places(&self, report: ProtectionReport) -> ProtectionReport {
        let on_track = |run: Option<Place>| run.map(|run| self.route().place(run.s_m).0);
        let mut display = report.display;
        display.position = on_track(display.position);
        ProtectionReport {
            position: on_track(report.position),
            authority_end: on_track(report.authority_end),
            display,
            ..report
        }
    }

    /// What the train tells all others of a cycle's report, in distances of the route.
    fn train_report(&self, report: &ProtectionReport, now: SimTime) -> Option<TrainReport> {
        let head_m = report.position?.s_m;
        let length_m = self.protection.settings.length_m();
        let (place, direction) = self.route().place(head_m);
        Some(TrainReport {
            track: place.track,
            chainage_m: place.s_m,
            sigma_m: report.sigma_m.unwrap_or_default(),
            length_m,
            occupied: self.route().stretches(head_m - length_m, head_m).collect(),
            direction,
            speed_mps: report.speed_mps,
            time: now,
        })
    }
}

/// The driver's setting, along the route. On a route that comes to that place more than once, the first time.
fn initial_run_m(settings: &ProtectionSettings, network: &Network, route: &Route) -> Option<f64> {
    let track = match &settings.initial_track {
        Some(name) => network.named(name)?,
        None => route.place(0.0).0.track,
    };
    let s_m = settings.initial_chainage_m?;
    route.runs_m(Place { track, s_m }).next()
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
            Content::Train(report) => {
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
        if let Some(head) = report.position {
            self.head_m = head.s_m;
        }
        let own = |content| Message::own(self.node.clone(), now, content);
        let train = self
            .train_report(&report, now)
            .map(|train| Message::to(Receiver::All, self.node.clone(), now, Content::Train(train)));
        let estimate = self.protection.estimate(now, Direction::Up);
        let estimate = estimate.map(|estimate| {
            let (place, direction) = self.route().place(estimate.s_m);
            own(Content::Position(PositionEstimate {
                track: place.track,
                direction,
                s_m: place.s_m,
                ..estimate
            }))
        });
        let command = own(Content::Command(report.command));
        let report = own(Content::Protection(self.in_places(report)));
        let own = [report, command].into_iter().chain(estimate);
        own.chain(train).collect()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::super::tests::map;
    use super::*;
    use crate::bus::{OdometerSample, TrainId};
    use crate::track::network::Waypoint;
    use crate::track::{Stretch, Track, Tunnel};

    /// What a train stands on that is all on one track.
    fn occupied(head_m: f64, length_m: f64, direction: Direction) -> Stretch {
        let tail_m = head_m - direction.sign() * length_m;
        Stretch {
            track: TrackId::default(),
            from_m: head_m.min(tail_m),
            to_m: head_m.max(tail_m),
        }
    }

    /// The equipment of a train at 2000 m of a line of 4 km, and where its authority ends after it has
    /// heard `content` of `sender` by radio.
    fn authority_end_m(direction: Direction, sender: Node, content: Content) -> Option<f64> {
        let network = Network::of_one(Track::clone(&map(0.0)));
        let route = network.only_track(direction).unwrap();
        let settings = ProtectionSettings {
            initial_chainage_m: Some(2000.0),
            ..ProtectionSettings::default()
        };
        let equipment = TrainProtection::new(Node::Train(TrainId(0)), &network, route, &settings);
        let report = report_after(equipment, sender, content)?;
        assert_eq!(report.position.map(|place| place.s_m), Some(2000.0));
        report.authority_end.map(|end| end.s_m)
    }

    /// What the equipment of train 0 reports after its odometer stood still and it has heard `content` of `sender`
    /// by radio.
    fn report_after(
        mut equipment: TrainProtection,
        sender: Node,
        content: Content,
    ) -> Option<ProtectionReport> {
        let time = SimTime::from_secs(1.0);
        let odometer = OdometerSample {
            time,
            distance_m: 0.0,
            speed_mps: 0.0,
            slides: false,
        };
        let own = Node::Train(TrainId(0));
        equipment.on(&Message::own(own, time, Content::Odometer(odometer)));
        let message = Message::to(Receiver::Trains, sender, time, content);
        equipment.on(&message.arrived(time, Via::Radio));
        let said = equipment.cycle(time);
        said.into_iter().find_map(|message| match message.content {
            Content::Protection(report) => Some(report),
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
                track: TrackId::default(),
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
                occupied: vec![occupied(chainage_m, 100.0, direction)],
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

    /// Where the authority of a train ends, along its route from u1 over u2 and u3 of the terminus, that stands at
    /// 300 m of u1 and has heard of an obstacle or a train at some metres of a track.
    fn on_terminus(heard: impl Fn(TrackId, f64) -> Content, track: &str, s_m: f64) -> Option<f64> {
        let text = include_str!("../../../tunnels/terminus.toml");
        let network = Tunnel::from_toml(text).unwrap().network;
        let place = |name, s_m| Place {
            track: network.named(name).unwrap(),
            s_m,
        };
        let start = (place("u1", 300.0), Direction::Up);
        let via = [Waypoint::Track(network.named("u2").unwrap())];
        let way = network.itinerary(start, &via, Some(place("u3", 100.0)), 200.0);
        let settings = ProtectionSettings {
            initial_track: Some("u1".to_owned()),
            initial_chainage_m: Some(300.0),
            // Its devices have been heard.
            starts_under_way: Some(true),
            ..ProtectionSettings::default()
        };
        let route = way.unwrap().route;
        let own = Node::Train(TrainId(0));
        let equipment = TrainProtection::new(own, &network, route.clone(), &settings);
        let content = heard(network.named(track).unwrap(), s_m);
        let sender = match &content {
            Content::Train(_) => Node::Train(TrainId(1)),
            _ => Node::Post("V1".into()),
        };
        let end = report_after(equipment, sender, content)?.authority_end;
        end.and_then(|end| route.runs_m(end).next())
    }

    /// Provokes: an obstacle or a train on the other track that brakes a train, and one in the overlap of gauges at a
    /// switch that does not; distances counted over the wrong leg.
    #[test]
    fn only_what_is_in_the_way_of_the_route_ends_the_authority() {
        let obstacle = |track, s_m| {
            Content::Warning(ObstacleWarning {
                device: "V1".into(),
                number: 0,
                issued: SimTime::ZERO,
                danger: DangerLevel::High,
                track,
                from_chainage_m: s_m,
                to_chainage_m: s_m + 1.0,
                blind: false,
            })
        };
        let train = |track, s_m| {
            Content::Train(TrainReport {
                track,
                chainage_m: s_m + 1.0,
                occupied: vec![Stretch {
                    track,
                    from_m: s_m,
                    to_m: s_m + 1.0,
                }],
                ..TrainReport::default()
            })
        };
        let near = |found: Option<f64>, right: Option<f64>| match (found, right) {
            (Some(found), Some(right)) => (found - right).abs() < 1e-6,
            (found, right) => found.is_none() && right.is_none(),
        };
        // The switch W1 is at 460 m; 25 m before what is ahead the authority ends.
        for (track, s_m, end_m) in [
            ("u1", 400.0, Some(375.0)),
            ("u2", 50.0, Some(485.0)),
            ("d1", 400.0, None),
            ("d3", 100.0, None),
            ("A", 10.0, Some(445.0)),
            ("A", 60.0, None),
            ("siding", 10.0, None),
            ("u1", 100.0, None),
        ] {
            let found = on_terminus(obstacle, track, s_m);
            assert!(near(found, end_m), "{track} {s_m}: {found:?}");
            let found = on_terminus(train, track, s_m);
            assert!(near(found, end_m), "train at {track} {s_m}: {found:?}");
        }
    }
}
