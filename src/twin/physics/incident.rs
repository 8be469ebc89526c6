//! What goes wrong on the tracks: switches, ends, trains in each other's way.

use crate::bus::{SimTime, TrainId};
use crate::track::Place;
use crate::track::network::Network;
use schemars::JsonSchema;
use serde::{Serialize, Serializer};
use std::fmt;

/// What happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum IncidentKind {
    /// A switch was asked to move under a train, or on a route that is set for one, and stayed as it was: it is locked.
    SwitchLocked,
    /// A switch moved under a train, which derails.
    SwitchMovedUnderTrain,
    /// A train ran facing over blades between their end positions, and derails.
    SwitchNotClosed,
    /// A train ran trailing through a switch that was set for the other leg: it forced the blades over.
    RunThrough,
    /// A switch led a train onto another leg than that of its route; its driver brakes to a stop.
    AgainstRoute,
    /// A train ran over an open end, beyond what is modelled.
    OffEnd,
    /// Trains stand or run so that one is in the other's gauge at a switch or a crossing.
    Fouled,
}

impl fmt::Display for IncidentKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::SwitchLocked => "asked to move while locked by",
            Self::SwitchMovedUnderTrain => "moved under",
            Self::SwitchNotClosed => "not closed before",
            Self::RunThrough => "run through by",
            Self::AgainstRoute => "set against the route of",
            Self::OffEnd => "end of track run over by",
            Self::Fouled => "fouled by another train beside",
        })
    }
}

/// One of these.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Incident {
    /// When; seconds in files.
    #[serde(rename = "time_s", serialize_with = "seconds")]
    #[schemars(with = "f64")]
    pub time: SimTime,
    /// What.
    pub kind: IncidentKind,
    /// The train.
    pub train: TrainId,
    /// The other train.
    pub other: Option<TrainId>,
    /// The switch.
    pub switch: Option<String>,
    /// Name of the track that the switch's toe is at the end of, or else that the train's head is on.
    pub track: String,
    /// Chainage of that.
    pub chainage_m: f64,
    /// The same as the track states it, if it does: `DK12+340.0`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stated_chainage: Option<String>,
}

fn seconds<S: Serializer>(time: &SimTime, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_f64(time.secs())
}

/// As a line of a log.
impl fmt::Display for Incident {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kind, train, .. } = self;
        if let Some(switch) = &self.switch {
            write!(f, "switch {switch} ")?;
        }
        write!(f, "{kind} {train}")?;
        if let Some(other) = self.other {
            write!(f, " ({other})")?;
        }
        match &self.stated_chainage {
            Some(stated) => write!(f, ", at {stated} of track {}", self.track),
            None => write!(f, ", at {:.1} m of track {}", self.chainage_m, self.track),
        }
    }
}

/// All of a run; each kind counts once for a train and a switch until another one comes.
#[derive(Clone, Debug, Default)]
pub(super) struct Incidents {
    pub list: Vec<Incident>,
}

/// Incidents that are kept.
const MOST: usize = 1000;

impl Incidents {
    /// Adds one, unless the last one like it is of the same train and switch.
    pub(super) fn add(
        &mut self,
        network: &Network,
        (time, kind): (SimTime, IncidentKind),
        (train, place): (TrainId, Place),
        switch: Option<usize>,
        other: Option<TrainId>,
    ) {
        let switch = switch.map(|k| network.switches[k].name.clone());
        let same = |i: &&Incident| i.kind == kind && i.train == train && i.other == other;
        let last = self.list.iter().rev().find(same);
        if last.is_some_and(|last| last.switch == switch) || self.list.len() >= MOST {
            return;
        }
        let track = network.track(place.track);
        self.list.push(Incident {
            time,
            kind,
            train,
            other,
            switch,
            track: track.map_or_else(String::new, |track| track.name.clone()),
            chainage_m: place.s_m,
            stated_chainage: network.stated_chainage(place),
        });
    }
}
