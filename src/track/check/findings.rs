//! What is wrong with tracks beside each other, told once of every two of them.

use crate::settings::Checker;
use crate::track::network::Network;
use crate::track::{Place, Side, TrackId};
use std::cmp::Ordering;
use std::collections::BTreeMap;

/// Sections that reach equally far are one.
const SAME_M: f64 = 1e-6;

/// What is wrong with two tracks beside each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Wrong {
    /// Their gauges overlap.
    Gauges,
    /// A wall of the other one stands in this one's gauge.
    Wall,
    /// It lies within the other's section and has walls of its own.
    Walls,
    /// Their walls reach into each other.
    Rock,
    /// It shares a section with none.
    Nowhere,
    /// A lamp or device of it stands in the other one's gauge.
    Furniture,
}

/// Room to a side of a track that is too narrow for the track beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Room {
    /// The track whose section it is.
    pub of: TrackId,
    /// Looking up that track.
    pub side: Side,
    /// How far it reaches from the centreline, and how far the gauge of the track beside does.
    pub has_m: f64,
    pub needs_m: f64,
}

impl Room {
    /// First what lacks least.
    pub(super) fn by_lack(a: &Self, b: &Self) -> Ordering {
        let lack_m = |room: &Self| room.needs_m - room.has_m;
        lack_m(a).total_cmp(&lack_m(b))
    }

    fn words(&self, network: &Network) -> String {
        let side = match self.side {
            Side::Left => "left",
            Side::Right => "right",
        };
        // Not less than is needed.
        let needs_m = (100.0 * self.needs_m).ceil() / 100.0;
        format!(
            "that of `{}` reaches {:.2} m to its {side}, and would have to reach at least {needs_m:.2} m to hold both",
            name(network, self.of),
            self.has_m,
        )
    }
}

/// What is wrong, and the place where it was found first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Finding {
    wrong: Wrong,
    of: Place,
    other: TrackId,
    /// Where the place is, left of the other track.
    l_m: f64,
    room: Option<Room>,
}

impl Wrong {
    /// At a place, with another track.
    pub(super) fn at(self, of: Place, other: TrackId, l_m: f64) -> Finding {
        Finding {
            wrong: self,
            of,
            other,
            l_m,
            room: None,
        }
    }
}

impl Finding {
    pub(super) fn with(self, room: Option<Room>) -> Self {
        Self { room, ..self }
    }

    /// Adds a finding of the same kind: as much room is needed as at the worst place.
    fn join(&mut self, later: &Self) {
        if let (Some(room), Some(more)) = (&mut self.room, later.room)
            && self.of.track == later.of.track
            && (room.of, room.side) == (more.of, more.side)
            && (room.has_m - more.has_m).abs() < SAME_M
        {
            room.needs_m = room.needs_m.max(more.needs_m);
        }
    }

    fn words(&self, network: &Network) -> (String, &'static str) {
        let away_m = self.l_m.abs();
        let other = name(network, self.other);
        let room = self.room.map(|room| format!(": {}", room.words(network)));
        let room = room.unwrap_or_default();
        match self.wrong {
            Wrong::Gauges => (
                format!("it is {away_m:.2} m from track `{other}`: trains on both would touch"),
                "lay them farther apart, join them by a switch, or name them under `[[crossings]]` where they cross",
            ),
            Wrong::Wall => (
                format!(
                    "a wall of the section of track `{other}` stands in its structure gauge{room}"
                ),
                "make that section so wide that it holds both tracks, or so narrow that it holds one",
            ),
            Wrong::Walls => (
                format!("it lies within the section of track `{other}`, and has walls of its own"),
                "give it a section of `kind = \"shared\"` there",
            ),
            Wrong::Rock => (
                format!("its section and that of track `{other}` overlap"),
                "move the tracks apart, or let one share the section of the other",
            ),
            Wrong::Nowhere => (
                format!(
                    "its section is `shared`, and no other track's section has room for it{room}"
                ),
                "make the section of the track beside it wider, or give it one of its own",
            ),
            Wrong::Furniture => (
                format!("a lamp or device stands in the structure gauge of track `{other}`"),
                "move it, or leave it out there",
            ),
        }
    }
}

/// All that is wrong, in the order found.
#[derive(Debug, Default)]
pub(super) struct Findings {
    all: Vec<Finding>,
    by_kind: BTreeMap<(TrackId, TrackId, Wrong), usize>,
}

impl Findings {
    pub(super) fn note(&mut self, finding: Finding) {
        let [a, b] = [finding.of.track, finding.other];
        let kind = (a.min(b), a.max(b), finding.wrong);
        match self.by_kind.get(&kind) {
            Some(first) => self.all[*first].join(&finding),
            None => {
                self.by_kind.insert(kind, self.all.len());
                self.all.push(finding);
            }
        }
    }

    /// Where each was found first, and the other track.
    pub(super) fn places(&self) -> impl Iterator<Item = (Place, TrackId)> + '_ {
        self.all.iter().map(|finding| (finding.of, finding.other))
    }

    /// As problems; `key` is that of a track in the file.
    pub(super) fn tell(
        &self,
        network: &Network,
        key: impl Fn(TrackId) -> String,
        check: &mut Checker<'_>,
    ) {
        for finding in &self.all {
            let (what, remedy) = finding.words(network);
            let what = format!("at chainage {:.1} m {what}", finding.of.s_m);
            check.problem(&key(finding.of.track), what, remedy);
        }
    }
}

fn name(network: &Network, track: TrackId) -> &str {
    &network.tracks[usize::from(track.0)].name
}
