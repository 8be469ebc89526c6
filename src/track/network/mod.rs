//! Tracks joined at their ends: lines that go on, switches, buffers, open ends; and tracks that cross.
//!
//! A track has no branches: it ends where a switch begins. A switch joins three ends of tracks in one place,
//! its toe, where all three have one pose: the track before the toe, and the two legs, of which the through one
//! goes straight on and the diverging one curves away. So every place of a network is a chainage of one track,
//! and a way over it is a list of tracks ([`Route`]), which yields one [`Alignment`] to run on.
//!
//! ```
//! use metrotwin::track::network::{Ends, Network, Switch, TrackEnd};
//! use metrotwin::track::{Alignment, Direction, Place, PlanElement, Side, Track, TrackId};
//! use nalgebra::Point3;
//! use std::sync::Arc;
//!
//! // 100 m, then a switch to the left.
//! let track = |name, x: f64, element| {
//!     let line = Alignment::new(Point3::new(x, 0.0, 0.0), 0.0, &[element], &[]);
//!     Arc::new(Track::bare(name, line))
//! };
//! let tracks = vec![
//!     track("A", 0.0, PlanElement::straight(100.0)),
//!     track("B", 100.0, PlanElement::straight(300.0)),
//!     track("C", 100.0, PlanElement::arc(60.0, 1.0 / 190.0, 0.0)),
//! ];
//! let [low, high] = [Direction::Down, Direction::Up].map(|way| move |k| TrackEnd { track: TrackId(k), way });
//! let switch = Switch {
//!     name: "W1".into(),
//!     toe: high(0),
//!     through: low(1),
//!     diverging: low(2),
//!     diverging_mps: 30.0 / 3.6,
//!     throw_s: 4.0,
//! };
//! let network = Network::new(tracks, vec![switch], vec![
//!     Ends::Open(low(0)),
//!     Ends::Buffer(high(1)),
//!     Ends::Open(high(2)),
//! ])?;
//! let place = |track, s_m| Place { track: TrackId(track), s_m };
//! let route = network.shortest((place(0, 20.0), Direction::Up), place(2, 50.0)).unwrap();
//! assert!((route.length_m() - 130.0).abs() < 1e-9);
//! assert_eq!(network.hand(&network.switches[0]), Side::Left);
//! # Ok::<(), metrotwin::track::network::NetworkError>(())
//! ```
//!
//! Tracks that cross each other at one level have a [`Crossing`] there: no train changes from one to the other.
//!
//! Not here: the blades of a switch and how they move (they are the world's), what stands along the tracks; slips,
//! crossings with points that move.

mod along;
mod clearance;
mod crossing;
mod envelope;
mod error;
mod itinerary;
mod passings;
mod route;
mod search;
mod sight;
#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests;

pub use clearance::Conflict;
pub use crossing::Crossing;
pub use envelope::RouteEnvelope;
pub use error::NetworkError;
pub use itinerary::{Itinerary, SpeedLimit, Waypoint};
pub use passings::Passing;
pub use route::{Leg, Route};

use super::{
    Alignment, CANT_BASE_M, CrossSection, Direction, Place, Side, Track, TrackFrame, TrackId,
    TrackPoint,
};
use nalgebra::{Point3, Vector3};
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Ends that meet may be this far apart: less than any survey finds.
pub(super) const MOST_GAP_M: f64 = 1e-3;
/// And have headings and slopes that differ by this much.
pub(super) const MOST_KINK_RAD: f64 = 1e-4;

/// No section is wider to one side.
const WIDEST_M: f64 = 60.0;
/// A section holds a track if it holds a point so far above its top of rail.
const JUST_ABOVE_M: f64 = 0.1;

/// An end of a track: the one that is reached by running this way along it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TrackEnd {
    /// The track.
    pub track: TrackId,
    /// Up to its last chainage, or down to 0.
    pub way: Direction,
}

impl TrackEnd {
    /// The other end of its track: a train that enters there runs towards this one.
    #[must_use]
    pub fn opposite(self) -> Self {
        Self {
            way: self.way.reversed(),
            ..self
        }
    }
}

/// A switch, with the ends of tracks that meet at its toe.
#[derive(Clone, Debug, PartialEq)]
pub struct Switch {
    /// As on the map.
    pub name: String,
    /// End of the track from which it is run facing.
    pub toe: TrackEnd,
    /// End of the leg that goes straight on.
    pub through: TrackEnd,
    /// End of the leg that curves away.
    pub diverging: TrackEnd,
    /// Permitted speed on that leg.
    pub diverging_mps: f64,
    /// Time that the blades take from one end position to the other.
    pub throw_s: f64,
}

/// A leg of a switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SwitchLeg {
    /// Straight on.
    Through,
    /// Away to a side.
    Diverging,
}

/// Ends of tracks that no switch joins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// The line goes on.
    Joined(TrackEnd, TrackEnd),
    /// A buffer stop.
    Buffer(TrackEnd),
    /// Beyond what is modelled.
    Open(TrackEnd),
}

/// What is at an end of a track.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beyond {
    /// Another track, entered at this end.
    Track(TrackEnd),
    /// A switch, by its number, run facing.
    Facing(usize),
    /// A switch run trailing, from this leg.
    Trailing(usize, SwitchLeg),
    /// A buffer stop.
    Buffer,
    /// Nothing that is modelled.
    Open,
}

/// Tracks, switches and crossings.
#[derive(Clone, Debug)]
pub struct Network {
    /// The tracks, by number.
    pub tracks: Vec<Arc<Track>>,
    /// The switches.
    pub switches: Vec<Switch>,
    /// Where tracks cross each other at one level.
    pub crossings: Vec<Crossing>,
    beyond: BTreeMap<TrackEnd, Beyond>,
}

impl Switch {
    /// The end of a leg.
    pub fn leg(&self, leg: SwitchLeg) -> TrackEnd {
        match leg {
            SwitchLeg::Through => self.through,
            SwitchLeg::Diverging => self.diverging,
        }
    }
}

impl Network {
    /// Joins tracks. Every end of every track must be named once; what meets must be in one place and go on
    /// without a kink.
    pub fn new(
        tracks: Vec<Arc<Track>>,
        switches: Vec<Switch>,
        ends: Vec<Ends>,
    ) -> Result<Self, NetworkError> {
        let mut network = Self {
            tracks,
            switches: Vec::new(),
            crossings: Vec::new(),
            beyond: BTreeMap::new(),
        };
        for (number, switch) in switches.iter().enumerate() {
            network.name(switch.toe, Beyond::Facing(number))?;
            for leg in [SwitchLeg::Through, SwitchLeg::Diverging] {
                network.name(switch.leg(leg), Beyond::Trailing(number, leg))?;
                network.check_joint(switch.toe, switch.leg(leg))?;
            }
        }
        for ends in ends {
            match ends {
                Ends::Joined(a, b) => {
                    network.name(a, Beyond::Track(b))?;
                    network.name(b, Beyond::Track(a))?;
                    network.check_joint(a, b)?;
                }
                Ends::Buffer(end) => network.name(end, Beyond::Buffer)?,
                Ends::Open(end) => network.name(end, Beyond::Open)?,
            }
        }
        network.switches = switches;
        let loose = network.ends().find(|end| !network.beyond.contains_key(end));
        match loose {
            Some(end) => Err(NetworkError::Loose(end)),
            None => Ok(network),
        }
    }

    /// A network of one track.
    pub fn of_one(track: Track) -> Self {
        Self::unjoined(vec![Arc::new(track)])
    }

    /// Tracks that all are open at both ends.
    pub fn unjoined(tracks: Vec<Arc<Track>>) -> Self {
        Self {
            tracks,
            switches: Vec::new(),
            crossings: Vec::new(),
            beyond: BTreeMap::new(),
        }
    }

    /// All ends of all tracks.
    pub fn ends(&self) -> impl Iterator<Item = TrackEnd> {
        let tracks = (0..self.tracks.len()).map(|k| TrackId(k as u16));
        tracks.flat_map(|track| [Direction::Down, Direction::Up].map(|way| TrackEnd { track, way }))
    }

    fn name(&mut self, end: TrackEnd, beyond: Beyond) -> Result<(), NetworkError> {
        if self.track(end.track).is_none() {
            return Err(NetworkError::NoTrack(end.track));
        }
        match self.beyond.insert(end, beyond) {
            Some(_) => Err(NetworkError::NamedTwice(end)),
            None => Ok(()),
        }
    }

    fn check_joint(&self, from: TrackEnd, to: TrackEnd) -> Result<(), NetworkError> {
        let (Some(out), Some(back)) = (self.leaving(from), self.leaving(to)) else {
            return Ok(());
        };
        let joint = Joint::of(&out, &back);
        let (gap_m, kink_rad) = (joint.gap_m.norm(), joint.kink_rad());
        if gap_m > MOST_GAP_M {
            return Err(NetworkError::Gap { from, to, gap_m });
        }
        if kink_rad > MOST_KINK_RAD {
            return Err(NetworkError::Kink { from, to, kink_rad });
        }
        Ok(())
    }

    /// The pose of a track's end, looking out of the track.
    pub fn leaving(&self, end: TrackEnd) -> Option<TrackFrame> {
        Some(leaving(self.alignment(end.track)?, end.way))
    }

    /// A track.
    pub fn track(&self, id: TrackId) -> Option<&Arc<Track>> {
        self.tracks.get(usize::from(id.0))
    }

    /// What the track of a place states there, if it states chainages, to 0.1 m.
    pub fn stated_chainage(&self, place: Place) -> Option<String> {
        let stated = self.track(place.track)?.stated_chainage.as_ref()?;
        Some(stated.text(place.s_m, 1))
    }

    /// The track of a name.
    pub fn named(&self, name: &str) -> Option<TrackId> {
        let found = self.tracks.iter().position(|track| track.name == name);
        found.map(|k| TrackId(k as u16))
    }

    /// The centreline of a track.
    pub fn alignment(&self, id: TrackId) -> Option<&Alignment> {
        self.track(id).map(|track| &track.alignment)
    }

    /// What is beyond an end.
    pub fn beyond(&self, end: TrackEnd) -> Beyond {
        self.beyond.get(&end).copied().unwrap_or(Beyond::Open)
    }

    /// The ends at which a train may enter the next track that leaves a track at an end: two where it runs a
    /// switch facing, none at a buffer or an open end.
    pub fn next(&self, end: TrackEnd) -> impl Iterator<Item = TrackEnd> {
        let ends = match self.beyond(end) {
            Beyond::Track(next) => [Some(next), None],
            Beyond::Facing(switch) => {
                let switch = &self.switches[switch];
                [Some(switch.through), Some(switch.diverging)]
            }
            Beyond::Trailing(switch, _) => [Some(self.switches[switch].toe), None],
            Beyond::Buffer | Beyond::Open => [None, None],
        };
        ends.into_iter().flatten()
    }

    /// The side to which a switch's diverging leg curves, looking from its toe.
    pub fn hand(&self, switch: &Switch) -> Side {
        let legs = [switch.through, switch.diverging].map(|end| self.entered(end));
        let [through, diverging] = legs.map(|leg| leg.map(|frame| frame.curvature_per_m));
        if diverging > through {
            Side::Left
        } else {
            Side::Right
        }
    }

    /// World position of a point on a track; none where there is no such track.
    pub fn world_from_track(&self, track: TrackId, point: TrackPoint) -> Option<Point3<f64>> {
        Some(self.alignment(track)?.world_from_track(point))
    }

    /// The places of all tracks within a distance of a world position, in plan, nearest first, each with the
    /// point as that track has it.
    pub fn near(&self, world: &Point3<f64>, within_m: f64) -> Vec<(TrackId, TrackPoint)> {
        let mut found: Vec<_> = (0u16..)
            .zip(&self.tracks)
            .filter_map(|(k, track)| Some((TrackId(k), track.alignment.nearest(world)?)))
            .filter(|(_, point)| point.l_m.abs() <= within_m)
            .collect();
        found.sort_by(|a, b| f64::total_cmp(&a.1.l_m.abs(), &b.1.l_m.abs()));
        found
    }

    /// The place on another track whose section a place shares; none where it has one of its own.
    pub fn host(&self, place: Place) -> Option<Place> {
        let track = self.track(place.track)?;
        track.section_at(place.s_m).filter(|own| own.is_shared())?;
        let world = track.alignment.at(place.s_m).origin;
        let others = self.near(&world, WIDEST_M).into_iter();
        let others = others.filter(|(other, _)| *other != place.track);
        let mut hosts = others.filter(|(other, point)| {
            let section = self
                .track(*other)
                .and_then(|other| other.section_at(point.s_m));
            let holds =
                |section: &CrossSection| section.covers(point.l_m, point.h_m + JUST_ABOVE_M);
            section.is_some_and(|section| !section.is_shared() && holds(section))
        });
        let (track, point) = hosts.next()?;
        Some(Place {
            track,
            s_m: point.s_m,
        })
    }

    /// Whether a place is on a track of this network.
    pub fn has(&self, place: Place) -> bool {
        self.alignment(place.track)
            .is_some_and(|track| (0.0..=track.length_m()).contains(&place.s_m))
    }
}

/// How far two ends that meet are from being one line.
pub(super) struct Joint {
    /// From the first to the second: ahead as the first looks out, to its left, up.
    pub gap_m: Vector3<f64>,
    /// Turn to the left from one to the other.
    pub turn_rad: f64,
    /// Change of the rise over run.
    pub slope_step: f64,
    /// Change of the cant, of the right rail over the left one.
    pub cant_step_m: f64,
}

impl Joint {
    /// Of the poses of two ends, each looking out of its track.
    pub(super) fn of(out: &TrackFrame, back: &TrackFrame) -> Self {
        let to = back.origin - out.origin;
        let turn_rad = (back.heading_rad + PI - out.heading_rad).rem_euclid(TAU);
        Self {
            gap_m: Vector3::new(to.dot(&out.ahead()), to.dot(&out.left()), to.z),
            turn_rad: if turn_rad > PI {
                turn_rad - TAU
            } else {
                turn_rad
            },
            slope_step: -back.slope - out.slope,
            cant_step_m: CANT_BASE_M * (back.roll_rad.sin() + out.roll_rad.sin()),
        }
    }

    /// In plan or in the profile, whichever is more.
    pub(super) fn kink_rad(&self) -> f64 {
        self.turn_rad.abs().max(self.slope_step.abs())
    }
}

/// The pose of an end of a line, looking out of it.
pub(super) fn leaving(line: &Alignment, way: Direction) -> TrackFrame {
    match way {
        Direction::Up => line.at(line.length_m()),
        Direction::Down => turned_round(&line.at(0.0)),
    }
}

/// The track as who looks the other way has it.
pub(super) fn turned_round(frame: &TrackFrame) -> TrackFrame {
    TrackFrame {
        heading_rad: frame.heading_rad + PI,
        slope: -frame.slope,
        curvature_per_m: -frame.curvature_per_m,
        roll_rad: -frame.roll_rad,
        ..*frame
    }
}
