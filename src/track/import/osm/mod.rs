//! Tracks from OpenStreetMap.
//!
//! A way with `railway` of a kind that trains run on is track; ways are cut where tracks meet. Few nodes say what they
//! are, so a junction is known by the directions of its tracks ([`JunctionKind`]); where four tracks meet, a node with
//! `railway = switch` has slips. Elements have the number of their way, with a dot and a count where it is cut.
//!
//! Data are of OpenStreetMap's contributors, under the Open Database License: what is made of them has to say so.

mod along;
mod data;
mod error;
#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests;

pub use error::OsmError;

use super::crs::Crs;
use super::junction::{JunctionKind, junction, turn_between_rad};
use super::map::{ImportCount, ImportReport, ImportedMap, LeftOut, MapSwitch};
use super::plane::along_m;
use crate::track::Direction;
use crate::track::geodesy::{Datum, Geodetic};
use crate::track::plan::{ElementEnd, PlanNetwork, TrackElement};
use data::{OsmData, OsmNode, OsmWay};
use nalgebra::{Point2, Vector2};
use std::collections::{BTreeMap, BTreeSet};

/// Kinds of railway that are track in use.
const TRACKS: [&str; 6] = [
    "rail",
    "light_rail",
    "subway",
    "tram",
    "narrow_gauge",
    "monorail",
];
/// A track's direction where it leaves a node is that of a chord of this length, or of all of it.
const CHORD_M: f64 = 15.0;
/// Nodes of a railway that are counted.
const COUNTED: [&str; 7] = [
    "signal",
    "switch",
    "buffer_stop",
    "railway_crossing",
    "level_crossing",
    "crossing",
    "stop",
];

/// Part of a map: what is within a circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AroundPlace {
    /// Middle of the circle.
    pub place: Geodetic,
    /// Its radius, metres.
    pub radius_m: f64,
}

/// A map, and what has become of the file.
#[derive(Clone, Debug)]
pub struct OsmImport {
    /// The tracks.
    pub map: ImportedMap,
    /// Of all tracks, metres.
    pub length_m: f64,
    /// Ways that are track.
    pub ways: usize,
    /// Ways of other kinds, by the value of `railway`.
    pub left_out: BTreeMap<String, usize>,
    /// Ways that name nodes which the file does not have; they end before these.
    pub cut: Vec<i64>,
    /// How many nodes are what.
    pub junctions: BTreeMap<JunctionKind, usize>,
    /// Nodes whose tracks make no junction.
    pub unclear: Vec<i64>,
}

/// A stretch of a way between nodes where tracks meet or end.
struct Stretch<'a> {
    way: &'a OsmWay,
    nodes: Vec<i64>,
}

/// Ends of elements at a node, each with the direction in which its track leaves the node.
type EndsAt = BTreeMap<i64, Vec<(ElementEnd, Vector2<f64>)>>;

impl OsmImport {
    /// Reads raw JSON: all of it, or what is around a place. The datum is the first node of the first track.
    pub fn from_json(text: &str, around: Option<AroundPlace>) -> Result<Self, OsmError> {
        Self::of(&OsmData::from_json(text)?, around)
    }

    /// Reads XML, likewise.
    pub fn from_xml(text: &str, around: Option<AroundPlace>) -> Result<Self, OsmError> {
        Self::of(&OsmData::from_xml(text)?, around)
    }

    fn of(data: &OsmData, around: Option<AroundPlace>) -> Result<Self, OsmError> {
        let (tracks, others): (Vec<&OsmWay>, Vec<&OsmWay>) =
            data.ways.iter().partition(|way| is_track(way));
        let mut left_out = BTreeMap::new();
        for way in &others {
            let kind = way.tags.get("railway").map_or("none", String::as_str);
            *left_out.entry(kind.to_owned()).or_default() += 1;
        }
        let mut import = Self {
            map: ImportedMap {
                network: PlanNetwork::new(None, Vec::new(), &[]),
                along: Vec::new(),
                switches: Vec::new(),
                plan_is_laid_out: false,
                plan_checks: Vec::new(),
                report: ImportReport::default(),
            },
            length_m: 0.0,
            ways: 0,
            left_out,
            cut: Vec::new(),
            junctions: BTreeMap::new(),
            unclear: Vec::new(),
        };
        let parts = import.parts(data, &tracks, around)?;
        let first = parts
            .first()
            .and_then(|part| data.nodes.get_key_value(part.nodes.first()?));
        let datum = match (first, around) {
            (Some((id, node)), _) => Datum {
                place: geodetic(*id, node)?,
                heading_deg: 0.0,
            },
            (None, Some(around)) if !tracks.is_empty() => {
                return Err(OsmError::NoneAround {
                    latitude_deg: around.place.latitude_deg,
                    longitude_deg: around.place.longitude_deg,
                    radius_m: around.radius_m,
                });
            }
            (None, _) => {
                return Err(OsmError::NoTracks {
                    ways: data.ways.len(),
                });
            }
        };
        import.ways = parts
            .iter()
            .map(|part| part.way.id)
            .collect::<BTreeSet<_>>()
            .len();
        import.join(data, datum, &stretches(parts))?;
        import.count(data, &tracks);
        Ok(import)
    }

    /// Ways as far as their nodes are there, and within the circle.
    fn parts<'a>(
        &mut self,
        data: &OsmData,
        tracks: &[&'a OsmWay],
        around: Option<AroundPlace>,
    ) -> Result<Vec<Stretch<'a>>, OsmError> {
        let circle = around.map(|around| {
            let datum = Datum {
                place: around.place,
                heading_deg: 0.0,
            };
            (datum, around.radius_m)
        });
        let mut parts = Vec::new();
        for way in tracks {
            let mut inside = BTreeSet::new();
            for id in &way.nodes {
                let Some(node) = data.nodes.get(id) else {
                    continue;
                };
                let place = geodetic(*id, node)?;
                if circle.is_none_or(|(datum, radius_m)| {
                    datum.world(&place).xy().coords.norm() <= radius_m
                }) {
                    inside.insert(*id);
                }
            }
            let missing = way
                .nodes
                .iter()
                .filter(|id| !data.nodes.contains_key(id))
                .count();
            if missing > 0 && !inside.is_empty() {
                self.cut.push(way.id);
                self.map.report.left_out.push(LeftOut {
                    line: way.line,
                    what: format!("{missing} nodes of way {}", way.id),
                    why: "the file does not have them: the track ends before them".to_owned(),
                });
            }
            let known = way
                .nodes
                .split(|id| !inside.contains(id))
                .filter(|part| part.len() > 1);
            parts.extend(known.map(|part| Stretch {
                way,
                nodes: part.to_vec(),
            }));
        }
        Ok(parts)
    }

    /// Makes the elements and joins them at their nodes.
    fn join(
        &mut self,
        data: &OsmData,
        datum: Datum,
        stretches: &[Stretch<'_>],
    ) -> Result<(), OsmError> {
        let mut elements = Vec::new();
        let mut at = EndsAt::new();
        let mut counts: BTreeMap<i64, usize> = BTreeMap::new();
        for stretch in stretches {
            let nodes = stretch
                .nodes
                .iter()
                .filter_map(|id| data.nodes.get_key_value(id));
            let points = nodes.map(|(id, node)| Ok(datum.world(&geodetic(*id, node)?).xy()));
            let points: Vec<Point2<f64>> = points.collect::<Result<_, OsmError>>()?;
            let count = counts.entry(stretch.way.id).or_default();
            *count += 1;
            let id = match *count {
                1 => stretch.way.id.to_string(),
                more => format!("{}.{more}", stretch.way.id),
            };
            let nodes = stretch.nodes.iter().copied();
            let places: Vec<(i64, f64)> = nodes.zip(along_m(&points)).collect();
            let Some(track) = TrackElement::new(&id, points) else {
                continue;
            };
            let element = elements.len();
            let ends = [
                (0, Direction::Down),
                (stretch.nodes.len() - 1, Direction::Up),
            ];
            for ((node, way), away) in ends.into_iter().zip(away(&track)) {
                let end = ElementEnd { element, way };
                at.entry(stretch.nodes[node]).or_default().push((end, away));
            }
            self.length_m += track.length_m();
            self.map
                .along
                .push(along::along(data, stretch.way, &places));
            elements.push(track);
        }
        let mut joints = Vec::new();
        for (id, ends) in &at {
            joints.extend(self.junction(data, *id, ends));
        }
        self.map.network = PlanNetwork::new(Some(datum), elements, &joints);
        Ok(())
    }

    /// Ends between which trains run at a node.
    fn junction(
        &mut self,
        data: &OsmData,
        id: i64,
        ends: &[(ElementEnd, Vector2<f64>)],
    ) -> Vec<(ElementEnd, ElementEnd)> {
        let directions: Vec<_> = ends.iter().map(|(_, away)| *away).collect();
        let node = data.nodes.get(&id);
        let slips = node.and_then(along::kind) == Some("switch");
        let (kind, pairs) = junction(&directions, slips);
        *self.junctions.entry(kind).or_default() += 1;
        let line = node.map_or(0, |node| node.line);
        match (kind, &pairs[..]) {
            (JunctionKind::Unclear, _) => {
                self.unclear.push(id);
                self.map.report.left_out.push(LeftOut {
                    line,
                    what: format!("junction of {} tracks at node {id}", ends.len()),
                    why: "their directions make no switch and no crossing: only what is almost straight on is joined".to_owned(),
                });
            }
            (JunctionKind::Switch, [(toe, a), (_, b)]) => {
                let is_straighter = turn_between_rad(&directions, (*toe, *a))
                    <= turn_between_rad(&directions, (*toe, *b));
                let (through, diverging) = if is_straighter { (*a, *b) } else { (*b, *a) };
                let name = node.and_then(|node| node.tags.get("ref"));
                let leg = ends[diverging].0;
                let speeds = &self.map.along[leg.element].speeds;
                self.map.switches.push(MapSwitch {
                    name: name.map_or_else(|| format!("W{id}"), |name| format!("W {name}")),
                    line,
                    toe: ends[*toe].0,
                    through: ends[through].0,
                    diverging: leg,
                    diverging_kmh: speeds.iter().map(|speed| speed.kmh).min_by(f64::total_cmp),
                });
            }
            _ => {}
        }
        pairs
            .into_iter()
            .map(|(a, b)| (ends[a].0, ends[b].0))
            .collect()
    }

    /// How many of each kind the file has, and how many are on the map.
    fn count(&mut self, data: &OsmData, tracks: &[&OsmWay]) {
        let counts = &mut self.map.report.counts;
        let mut add = |what: String, in_file, taken| {
            counts.insert(what, ImportCount { in_file, taken });
        };
        add("ways that are track".to_owned(), tracks.len(), self.ways);
        for (kind, count) in &self.left_out {
            add(format!("ways of railway = {kind}"), *count, 0);
        }
        let signals = self.map.along.iter().map(|along| along.signals.len()).sum();
        let buffers = self.map.along.iter().flat_map(|along| along.buffers);
        let buffers = buffers.filter(|is| *is).count();
        for kind in COUNTED {
            let of_kind = data
                .nodes
                .values()
                .filter(|node| along::kind(node) == Some(kind))
                .count();
            let taken = match kind {
                "signal" => signals,
                "buffer_stop" => buffers,
                "switch" => self.map.switches.len(),
                _ => 0,
            };
            if of_kind + taken > 0 {
                add(format!("nodes of railway = {kind}"), of_kind, taken);
            }
        }
    }
}

fn is_track(way: &OsmWay) -> bool {
    let kind = way.tags.get("railway").map(String::as_str);
    kind.is_some_and(|kind| TRACKS.contains(&kind))
}

/// Directions in which a track leaves its ends.
fn away(track: &TrackElement) -> [Vector2<f64>; 2] {
    let length_m = track.length_m();
    let chord_m = CHORD_M.min(length_m);
    let (begin, end) = (track.at(0.0).0, track.at(length_m).0);
    [
        (track.at(chord_m).0 - begin).normalize(),
        (track.at(length_m - chord_m).0 - end).normalize(),
    ]
}

fn geodetic(id: i64, node: &OsmNode) -> Result<Geodetic, OsmError> {
    let OsmNode {
        latitude_deg,
        longitude_deg,
        line,
        ..
    } = *node;
    let place = Crs::Wgs84.geodetic([latitude_deg, longitude_deg]);
    place.map_err(|_| OsmError::Nowhere {
        line,
        id,
        latitude_deg,
        longitude_deg,
    })
}

/// Ways cut where more than two tracks meet.
fn stretches(parts: Vec<Stretch<'_>>) -> Vec<Stretch<'_>> {
    let mut neighbours: BTreeMap<i64, BTreeSet<i64>> = BTreeMap::new();
    for pair in parts.iter().flat_map(|part| part.nodes.windows(2)) {
        neighbours.entry(pair[0]).or_default().insert(pair[1]);
        neighbours.entry(pair[1]).or_default().insert(pair[0]);
    }
    let meets = |id: &i64| neighbours.get(id).is_some_and(|ids| ids.len() > 2);
    let mut stretches = Vec::new();
    for Stretch { way, nodes } in parts {
        let mut begin = 0;
        for k in 1..nodes.len() {
            if k + 1 == nodes.len() || meets(&nodes[k]) {
                stretches.push(Stretch {
                    way,
                    nodes: nodes[begin..=k].to_vec(),
                });
                begin = k;
            }
        }
    }
    stretches
}
