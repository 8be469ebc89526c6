//! What meets at the ends of tracks, as the `from` and `to` of a tunnel file name it.

use crate::settings::{Checker, name_advice};
use crate::track::file::{SwitchEntry, TrackEntry, TunnelFile};
use crate::track::network::{Ends, Switch, TrackEnd};
use crate::track::{Direction, TrackId};
use std::collections::{BTreeMap, BTreeSet};

/// What a word after `from` or `to` names.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Named {
    Open,
    Buffer,
    End(TrackEnd),
    Part(usize, Part),
}

/// A part of a switch.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    Toe,
    Through,
    Diverging,
}

/// The parts and their words.
const PARTS: [(Part, &str); 3] = [
    (Part::Toe, "toe"),
    (Part::Through, "through"),
    (Part::Diverging, "diverging"),
];

/// What meets where.
#[derive(Debug, Default)]
pub(super) struct Joints {
    /// Those of which all three ends are named.
    pub switches: Vec<Switch>,
    /// All other ends.
    pub ends: Vec<Ends>,
}

impl Joints {
    /// Pairs of ends over which a train may run.
    pub(super) fn pairs(&self) -> impl Iterator<Item = (TrackEnd, TrackEnd)> + '_ {
        let legs = (self.switches.iter())
            .flat_map(|switch| [switch.through, switch.diverging].map(|leg| (switch.toe, leg)));
        let joined = self.ends.iter().filter_map(|ends| match ends {
            Ends::Joined(a, b) => Some((*a, *b)),
            Ends::Buffer(_) | Ends::Open(_) => None,
        });
        legs.chain(joined)
    }
}

/// Key of the end of a track in the file.
pub(super) fn key_of(end: TrackEnd) -> String {
    let key = match end.way {
        Direction::Down => "from",
        Direction::Up => "to",
    };
    format!("track[{}].{key}", end.track.0)
}

/// An end of a track, as `from` and `to` name it.
pub(super) fn word_of(end: TrackEnd, tracks: &[TrackEntry]) -> String {
    end_word(end, &tracks[usize::from(end.track.0)].name)
}

/// As [`word_of`], of a track with this name.
pub(super) fn end_word(end: TrackEnd, name: &str) -> String {
    let word = match end.way {
        Direction::Down => "begin",
        Direction::Up => "end",
    };
    format!("{name}.{word}")
}

/// Joins the tracks of a file; none where names or joints are wrong: what else would be told follows from that.
pub(super) fn joints(
    file: &TunnelFile,
    tracks: &[TrackEntry],
    check: &mut Checker<'_>,
) -> Option<Joints> {
    let mut found = Vec::new();
    check_names(file, tracks, &mut Checker::new("", &mut found));
    let mut joints = Joints::default();
    if found.is_empty() {
        joints = named_joints(tracks, &file.switches, &mut Checker::new("", &mut found));
    }
    let are_right = found.is_empty();
    check.add(found);
    are_right.then_some(joints)
}

fn named_joints(
    tracks: &[TrackEntry],
    switches: &[SwitchEntry],
    check: &mut Checker<'_>,
) -> Joints {
    let words = Words::of(tracks, switches);
    let mut named = BTreeMap::new();
    for (k, track) in tracks.iter().enumerate() {
        let track_id = TrackId(k as u16);
        for (way, word) in [(Direction::Down, &track.from), (Direction::Up, &track.to)] {
            let end = TrackEnd {
                track: track_id,
                way,
            };
            if let Some(word) = word
                && let Some(what) = words.meaning(word, &key_of(end), check)
            {
                named.insert(end, what);
            }
        }
    }
    // An end with an unknown name may be that of any switch.
    let all_are_known = check.is_right("");
    let mut parts = vec![[None; 3]; switches.len()];
    let mut named_twice = BTreeSet::new();
    for (end, what) in &named {
        if let Named::Part(switch, part) = what {
            let slot = &mut parts[*switch][*part as usize];
            if let Some(first) = slot.replace(*end) {
                let what = format!("`{}` has this part already", word_of(first, tracks));
                check.problem(&key_of(*end), what, "give each end a part of its own");
                named_twice.insert(*switch);
            }
        }
    }
    let mut joints = Joints {
        switches: whole_switches(switches, &parts),
        ends: Vec::new(),
    };
    if all_are_known {
        let once = |k: &usize| !named_twice.contains(k);
        check_whole(switches, &parts, once, check);
    }
    add_ends(&mut joints, tracks, &named, check);
    joints
}

/// Names of tracks and switches, which ends are named by, and of crossings are there once each.
fn check_names(file: &TunnelFile, tracks: &[TrackEntry], check: &mut Checker<'_>) {
    let mut seen = BTreeMap::new();
    let tracks = tracks.iter().enumerate();
    let tracks = tracks.map(|(k, track)| (&track.name, format!("track[{k}]")));
    let switches = file.switches.iter().enumerate();
    let switches = switches.map(|(k, switch)| (&switch.name, format!("switches[{k}]")));
    let crossings = file.crossings.iter().enumerate();
    let crossings = crossings.map(|(k, crossing)| (&crossing.name, format!("crossings[{k}]")));
    for (name, key) in tracks.chain(switches).chain(crossings) {
        if let Some(first) = seen.insert(name, key.clone()) {
            let what = format!("\"{name}\" is the name of `{first}` too");
            let remedy = "give each track, switch and crossing a name of its own";
            check.problem(&format!("{key}.name"), what, remedy);
        }
    }
}

/// All that may stand after `from` and `to`.
struct Words(BTreeMap<String, Named>);

impl Words {
    fn of(tracks: &[TrackEntry], switches: &[SwitchEntry]) -> Self {
        let mut words = BTreeMap::from([
            ("open".to_owned(), Named::Open),
            ("buffer".to_owned(), Named::Buffer),
        ]);
        for k in 0..tracks.len() {
            for way in [Direction::Down, Direction::Up] {
                let track = TrackId(k as u16);
                let end = TrackEnd { track, way };
                words.insert(word_of(end, tracks), Named::End(end));
            }
        }
        for (k, switch) in switches.iter().enumerate() {
            for (part, word) in PARTS {
                words.insert(format!("{}.{word}", switch.name), Named::Part(k, part));
            }
        }
        Self(words)
    }

    fn meaning(&self, word: &str, key: &str, check: &mut Checker<'_>) -> Option<Named> {
        let named = self.0.get(word).copied();
        if named.is_none() {
            let known: Vec<String> = self.0.keys().cloned().collect();
            let remedy = name_advice(word, &known, "ends and parts of switches", "name an end");
            check.problem(key, format!("there is no `{word}`"), remedy);
        }
        named
    }
}

/// The switches of which all parts are named.
fn whole_switches(switches: &[SwitchEntry], parts: &[[Option<TrackEnd>; 3]]) -> Vec<Switch> {
    let mut whole = Vec::new();
    for (entry, ends) in switches.iter().zip(parts) {
        if let [Some(toe), Some(through), Some(diverging)] = *ends {
            whole.push(Switch {
                name: entry.name.clone(),
                toe,
                through,
                diverging,
                diverging_mps: entry.diverging_kmh / 3.6,
                throw_s: entry.throw_s,
            });
        }
    }
    whole
}

/// A problem for each part of some of the switches that no end has.
fn check_whole(
    switches: &[SwitchEntry],
    parts: &[[Option<TrackEnd>; 3]],
    which: impl Fn(&usize) -> bool,
    check: &mut Checker<'_>,
) {
    let switches = switches.iter().zip(parts).enumerate();
    for (k, (entry, ends)) in switches.filter(|(k, _)| which(k)) {
        for ((_, word), _) in PARTS.iter().zip(ends).filter(|(_, end)| end.is_none()) {
            let part = format!("{}.{word}", entry.name);
            check.problem(
                &format!("switches[{k}].name"),
                format!("no track begins or ends at `{part}`: the switch dangles"),
                format!("give a track `from = \"{part}\"` or `to = \"{part}\"`"),
            );
        }
    }
}

/// All ends that no switch has: joined, where either names the other; else what their own word says.
fn add_ends(
    joints: &mut Joints,
    tracks: &[TrackEntry],
    named: &BTreeMap<TrackEnd, Named>,
    check: &mut Checker<'_>,
) {
    let ends = (0..tracks.len()).map(|k| TrackId(k as u16));
    let ends =
        ends.flat_map(|track| [Direction::Down, Direction::Up].map(|way| TrackEnd { track, way }));
    // Who names an end that does not name its joint itself.
    let mut by: BTreeMap<TrackEnd, TrackEnd> = BTreeMap::new();
    for (end, what) in named {
        let Named::End(other) = *what else {
            continue;
        };
        let agrees = match named.get(&other) {
            Some(back) => *back == Named::End(*end),
            None => by.insert(other, *end).is_none(),
        };
        let itself = other == *end;
        if !agrees || itself {
            let other = word_of(other, tracks);
            let what = format!("`{other}` is joined to something else");
            check.problem(&key_of(*end), what, "join ends two by two, or by a switch");
        }
    }
    for end in ends {
        match (named.get(&end), by.get(&end)) {
            (Some(Named::Part(..)), _) => {}
            (Some(Named::Buffer), _) => joints.ends.push(Ends::Buffer(end)),
            (Some(Named::End(other)), _) => {
                // Once, where both name each other.
                if !named.contains_key(other) || end < *other {
                    joints.ends.push(Ends::Joined(end, *other));
                }
            }
            (None, Some(_)) => {}
            (Some(Named::Open) | None, _) => joints.ends.push(Ends::Open(end)),
        }
    }
}
