//! Track occupancy as a piece of equipment of a train.

use super::{Decision, Fix, Occupancy, OccupancySettings};
use crate::bus::{
    Content, GnssFix, Message, Node, OccupancyReport, OccupiedTrack, SimTime, TrainEnd,
};
use crate::stack::Equipment;
use crate::track::TrackId;
use crate::track::geodesy::Datum;
use crate::track::network::Network;
use crate::track::plan::{ElementPlace, PlanNetwork};
use nalgebra::{Matrix2, Rotation2};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Without a fix it says this often where the train is by speed, yaw rate and balises, seconds.
const WITHOUT_FIX_S: f64 = 1.0;

/// Takes fixes, speed, yaw rate and balises in the order of their times, and says on which track the train is.
///
/// The speed of a wheel that slides or slips is not taken for the train's. The yaw rate is that of the leading car: in a
/// curve the last car has another.
pub struct TrackOccupancy {
    node: Node,
    occupancy: Occupancy,
    /// None of a map that is nowhere on the earth: fixes are then left out.
    datum: Option<Datum>,
    hold_s: f64,
    /// By name.
    balises: BTreeMap<String, ElementPlace>,
    /// Not yet taken in, by time, kind and order of arrival.
    waiting: BTreeMap<(SimTime, u8, u64), Input>,
    arrived: u64,
    reported: Option<SimTime>,
}

/// Of one time, they are taken in in this order.
enum Input {
    Speed(f64),
    /// Of a wheel that slides or slips.
    Slide(f64),
    YawRate(f64),
    Balise(ElementPlace),
    Fix(Fix),
}

impl Input {
    fn rank(&self) -> u8 {
        match self {
            Self::Speed(_) | Self::Slide(_) => 0,
            Self::YawRate(_) => 1,
            Self::Balise(_) => 2,
            Self::Fix(_) => 3,
        }
    }
}

impl TrackOccupancy {
    /// On a node, with the tracks as surveyed: in plan, and with their balises.
    pub fn new(
        node: Node,
        plan: Arc<PlanNetwork>,
        map: &Network,
        settings: &OccupancySettings,
    ) -> Self {
        let tracks = map.tracks.iter().enumerate();
        let balises = tracks.flat_map(|(element, track)| {
            let places = track.balises.iter();
            places.map(move |balise| {
                let along_m = balise.chainage_m;
                (balise.name.clone(), ElementPlace { element, along_m })
            })
        });
        Self {
            node,
            balises: balises.collect(),
            datum: plan.datum,
            occupancy: Occupancy::new(plan, *settings),
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
            Input::Slide(speed_mps) => self.occupancy.on_slide(time, speed_mps),
            Input::YawRate(radps) => self.occupancy.on_yaw_rate(time, radps),
            Input::Balise(place) => self.occupancy.on_balise(time, place),
            Input::Fix(fix) => {
                self.occupancy.on_fix(&fix);
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

/// A fix on the plan.
fn on_plan(datum: &Datum, fix: &GnssFix) -> Fix {
    Fix {
        time: fix.time,
        place: datum.world(&fix.place).xy(),
        covariance_m2: in_world(datum, &fix.covariance_m2),
    }
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
            Content::Odometer(sample) => self.wait(
                sample.time,
                match sample.slides {
                    true => Input::Slide(sample.speed_mps),
                    false => Input::Speed(sample.speed_mps),
                },
            ),
            Content::Imu(sample) if sample.end == TrainEnd::Front => {
                self.wait(sample.time, Input::YawRate(sample.gyro_rad_s.z));
            }
            Content::Gnss(fix) => {
                if let Some(datum) = &self.datum {
                    self.wait(fix.time, Input::Fix(on_plan(datum, fix)));
                }
            }
            Content::BalisePassed(name) => {
                if let Some(place) = self.balises.get(name).copied() {
                    self.wait(message.valid_at, Input::Balise(place));
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
mod tests;
