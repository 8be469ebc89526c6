//! Track occupancy as a piece of equipment of a train.

use super::{Decision, Fix, Occupancy, OccupancySettings};
use crate::bus::{Content, GnssFix, Message, Node, OccupancyReport, OccupiedTrack, SimTime};
use crate::stack::Equipment;
use crate::track::TrackId;
use crate::track::geodesy::Datum;
use crate::track::network::Network;
use crate::track::plan::PlanNetwork;
use nalgebra::{Matrix2, Rotation2};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Without a fix it says this often where the train is by speed, yaw rate and balises, seconds.
const WITHOUT_FIX_S: f64 = 1.0;

/// Takes fixes, speed, yaw rate and balises in the order of their times, and says on which track the train is.
pub struct TrackOccupancy {
    node: Node,
    occupancy: Occupancy,
    datum: Datum,
    hold_s: f64,
    /// By element and place along it.
    balises: BTreeMap<String, (usize, f64)>,
    /// Not yet taken in, by time, kind and order of arrival.
    waiting: BTreeMap<(SimTime, u8, u64), Input>,
    arrived: u64,
    reported: Option<SimTime>,
}

/// Of one time, they are taken in in this order.
enum Input {
    Speed(f64),
    YawRate(f64),
    Balise(usize, f64),
    Fix(GnssFix),
}

impl Input {
    fn rank(&self) -> u8 {
        match self {
            Self::Speed(_) => 0,
            Self::YawRate(_) => 1,
            Self::Balise(..) => 2,
            Self::Fix(_) => 3,
        }
    }
}

impl TrackOccupancy {
    /// On a node, with the tracks as surveyed: in plan, where the datum says on the earth, and with their balises.
    pub fn new(
        node: Node,
        (plan, datum): (Arc<PlanNetwork>, Datum),
        map: &Network,
        settings: &OccupancySettings,
    ) -> Self {
        let tracks = map.tracks.iter().enumerate();
        let balises = tracks.flat_map(|(element, track)| {
            let places = track.balises.iter();
            places.map(move |balise| (balise.name.clone(), (element, balise.chainage_m)))
        });
        Self {
            node,
            balises: balises.collect(),
            occupancy: Occupancy::new(plan, *settings),
            datum,
            hold_s: 1e-3 * settings.hold_ms,
            waiting: BTreeMap::new(),
            arrived: 0,
            reported: None,
        }
    }

    fn wait(&mut self, time: SimTime, input: Input) {
        self.waiting
            .insert((time, input.rank(), self.arrived), input);
        self.arrived += 1;
    }

    /// Takes one input in; whether it was a fix.
    fn take(&mut self, time: SimTime, input: Input) -> bool {
        match input {
            Input::Speed(speed_mps) => self.occupancy.on_speed(time, speed_mps),
            Input::YawRate(radps) => self.occupancy.on_yaw_rate(time, radps),
            Input::Balise(element, along_m) => self.occupancy.on_balise(time, (element, along_m)),
            Input::Fix(fix) => {
                self.occupancy.on_fix(&Fix {
                    time,
                    place: self.datum.world(&fix.place).xy(),
                    covariance_m2: in_world(&self.datum, &fix.covariance_m2),
                });
                return true;
            }
        }
        false
    }

    fn report(&mut self, time: SimTime, of_fix: bool) -> OccupancyReport {
        self.reported = Some(time);
        let decision = self.occupancy.decision();
        OccupancyReport {
            time,
            identified: decision.is_identified(),
            tracks: occupied(&decision),
            hypotheses: self.occupancy.alive() as u32,
            of_fix,
        }
    }
}

fn occupied(decision: &Decision) -> Vec<OccupiedTrack> {
    let tracks = decision.tracks.iter().map(|track| OccupiedTrack {
        track: TrackId(track.element as u16),
        probability: track.probability,
        facing: track.facing,
        facing_probability: track.facing_probability,
        s_m: track.along_m,
        sigma_m: track.sigma_m,
    });
    tracks.collect()
}

/// A covariance of east and north as one of the world's x and y.
fn in_world(datum: &Datum, east_north_m2: &Matrix2<f64>) -> Matrix2<f64> {
    let world_from_earth = Rotation2::new(-datum.heading_deg.to_radians());
    let turned = world_from_earth.matrix() * east_north_m2 * world_from_earth.matrix().transpose();
    0.5 * (turned + turned.transpose())
}

impl Equipment for TrackOccupancy {
    fn on(&mut self, message: &Message) {
        match &message.content {
            Content::Odometer(sample) => {
                self.wait(sample.time, Input::Speed(sample.speed_mps));
            }
            Content::Imu(sample) => self.wait(sample.time, Input::YawRate(sample.gyro_rad_s.z)),
            Content::Gnss(fix) => self.wait(fix.time, Input::Fix(fix.clone())),
            Content::BalisePassed(name) => {
                if let Some((element, along_m)) = self.balises.get(name).copied() {
                    self.wait(message.valid_at, Input::Balise(element, along_m));
                }
            }
            _ => {}
        }
    }

    fn cycle(&mut self, now: SimTime) -> Vec<Message> {
        let until = now.plus(-self.hold_s);
        let mut reports = Vec::new();
        while let Some(entry) = self.waiting.first_entry() {
            let time = entry.key().0;
            if time > until {
                break;
            }
            let input = entry.remove();
            let of_fix = self.take(time, input);
            let is_due = self
                .reported
                .is_none_or(|last| time.since(last) >= WITHOUT_FIX_S);
            if !of_fix && is_due {
                self.occupancy.carry_on(time);
            }
            if of_fix || is_due {
                reports.push(self.report(time, of_fix));
            }
        }
        let message = |report| Message::own(self.node.clone(), now, Content::Occupancy(report));
        reports.into_iter().map(message).collect()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::bus::{GnssSolution, OdometerSample, TrainId};
    use crate::track::Tunnel;
    use nalgebra::Point3;

    /// Two tracks 4 m apart, the right one with two balises; x is north-east.
    const LINE: &str = "name = 'line'\n\
        datum = { latitude_deg = 48.2, longitude_deg = 15.6, heading_deg = 45.0 }\n\
        [[track]]\nname = 'right'\nstart = { north_m = 0.0 }\nplan = [{ kind = 'straight', length_m = 900.0 }]\n\
        balises = [{ name = 'B1', chainage_m = 300.0 }, { name = 'B2', chainage_m = 303.0 }]\n\
        sections = [{ kind = 'open', from_m = 0.0, width_m = 20.0 }]\n\
        [[track]]\nname = 'left'\nstart = { north_m = 4.0 }\nplan = [{ kind = 'straight', length_m = 900.0 }]\n\
        sections = [{ kind = 'shared', from_m = 0.0 }]\n";

    const NODE: Node = Node::Train(TrainId(0));

    fn message(time: SimTime, content: Content) -> Message {
        Message::own(NODE, time, content)
    }

    /// A run at 20 m/s from 100 m on, with fixes once a second between both tracks, and balises.
    fn inputs(balises: bool) -> Vec<Message> {
        let datum = Tunnel::from_toml(LINE).unwrap().datum.unwrap();
        let mut all = Vec::new();
        for k in 0..150u32 {
            let seconds = 0.1 * f64::from(k);
            let (time, along_m) = (SimTime::from_secs(seconds), 100.0 + 20.0 * seconds);
            all.push(message(
                time,
                Content::Odometer(OdometerSample {
                    time,
                    distance_m: along_m,
                    speed_mps: 20.0,
                    slides: false,
                }),
            ));
            if k % 10 == 0 {
                all.push(message(
                    time,
                    Content::Gnss(GnssFix {
                        time,
                        place: datum.geodetic(&Point3::new(along_m, 2.0, 0.0)),
                        covariance_m2: Matrix2::identity() * 4.0,
                        solution: GnssSolution::Single,
                        satellites: 9,
                    }),
                ));
            }
        }
        // The head is 10 m ahead of the antenna.
        for (name, head_m) in [("B1", 300.0), ("B2", 303.0)] {
            if balises {
                let time = SimTime::from_secs((head_m - 10.0 - 100.0) / 20.0);
                all.push(message(time, Content::BalisePassed(name.to_owned())));
            }
        }
        all.sort_by_key(|message| message.valid_at);
        all
    }

    fn reports(inputs: &[Message], late_s: impl Fn(usize) -> f64) -> Vec<OccupancyReport> {
        let tunnel = Tunnel::from_toml(LINE).unwrap();
        let plan = PlanNetwork::of_network(&tunnel.network, tunnel.datum).into();
        let (plan, map) = ((plan, tunnel.datum.unwrap()), &tunnel.network);
        let mut equipment = TrackOccupancy::new(NODE, plan, map, &OccupancySettings::default());
        let mut arrivals: Vec<(SimTime, &Message)> = (inputs.iter().enumerate())
            .map(|(k, message)| (message.valid_at.plus(late_s(k)), message))
            .collect();
        arrivals.sort_by_key(|(time, _)| *time);
        let mut reports = Vec::new();
        let mut arrivals = arrivals.into_iter().peekable();
        for k in 0..2000 {
            let now = SimTime::from_secs(0.01 * f64::from(k));
            while let Some((_, message)) = arrivals.next_if(|(time, _)| *time <= now) {
                equipment.on(message);
            }
            for message in equipment.cycle(now) {
                if let Content::Occupancy(report) = message.content {
                    reports.push(report);
                }
            }
        }
        reports
    }

    /// A covariance that is turned by any heading is still one: no fix is lost for rounding.
    #[test]
    fn turned_covariances_are_symmetric() {
        let covariance = Matrix2::new(1.3, 0.4, 0.4, 0.7);
        for k in 0..1000 {
            let datum = Datum {
                heading_deg: 0.37 * f64::from(k),
                ..Tunnel::from_toml(LINE).unwrap().datum.unwrap()
            };
            let turned = in_world(&datum, &covariance);
            assert_eq!(turned, turned.transpose());
            let fix = Fix {
                time: SimTime::ZERO,
                place: Point3::origin().xy(),
                covariance_m2: turned,
            };
            assert!(fix.is_possible());
        }
    }

    /// Fails where what comes late is lost, or taken in after what is younger.
    #[test]
    fn the_order_of_arrival_does_not_matter() {
        let inputs = inputs(true);
        let at_once = reports(&inputs, |_| 0.0);
        let late = reports(&inputs, |k| 0.03 * (k * 7 % 6) as f64);
        assert_eq!(at_once, late);
        assert_eq!(at_once.iter().filter(|report| report.of_fix).count(), 15);
    }

    /// Fixes between two tracks cannot tell them apart; a balise of one of them does, to within the chance of
    /// cross-talk, and two leave no other.
    #[test]
    fn balises_tell_the_track() {
        let last = |balises| reports(&inputs(balises), |_| 0.0).pop().unwrap();
        let without = last(false);
        assert!(without.tracks[0].probability < 0.9 && !without.identified);
        let with = last(true);
        assert!(with.identified && with.tracks[0].track == TrackId(0));
        // 14 s at 20 m/s.
        assert!(
            (with.tracks[0].s_m - 380.0).abs() < 3.0,
            "{}",
            with.tracks[0].s_m
        );
        assert_eq!(with.tracks[0].facing, crate::track::Direction::Up);
        let inputs = inputs(true);
        let one: Vec<_> = inputs
            .iter()
            .filter(|m| m.content != Content::BalisePassed("B2".to_owned()))
            .cloned()
            .collect();
        let one = reports(&one, |_| 0.0).pop().unwrap();
        assert!(one.tracks[0].track == TrackId(0) && one.tracks[0].probability > 1.0 - 1e-6);
    }

    /// Before the first fix a balise says where the train is.
    #[test]
    fn a_balise_is_a_start() {
        let only: Vec<_> = inputs(true)
            .into_iter()
            .filter(|message| !matches!(message.content, Content::Gnss(_)))
            .collect();
        let reports = reports(&only, |_| 0.0);
        assert!(reports.iter().all(|report| !report.of_fix));
        let known = reports.last().unwrap();
        assert_eq!(known.tracks[0].track, TrackId(0));
        assert!(known.identified);
    }
}
