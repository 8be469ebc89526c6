//! Tracks from OpenStreetMap: raw JSON as the Overpass API gives it (`out body` with the nodes).
//!
//! A way with `railway` of a kind that trains run on is track; ways are cut where tracks meet. Few nodes say what they
//! are, so a junction is known by the directions of its tracks ([`JunctionKind`]); where four tracks meet, a node with
//! `railway = switch` has slips. Elements have the number of their way, with a dot and a count where it is cut.

use super::junction::{JunctionKind, junction};
use crate::track::Direction;
use crate::track::geodesy::{Datum, Geodetic};
use crate::track::plan::{ElementEnd, PlanNetwork, TrackElement};
use nalgebra::{Point2, Vector2};
use serde::Deserialize;
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

/// What is wrong with a file.
#[derive(Debug, thiserror::Error)]
pub enum OsmError {
    /// Not JSON, or not this kind.
    #[error("line {line}, column {column}: no raw JSON of OpenStreetMap: {what}")]
    NotJson {
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// By the parser.
        what: String,
    },
    /// No track in it.
    #[error("no way with `railway` = {} and at least two nodes: {ways} ways are of another kind", TRACKS.join(", "))]
    NoTracks {
        /// How many ways there are.
        ways: usize,
    },
    /// A node that can be nowhere.
    #[error("node {id}: latitude {latitude_deg}, longitude {longitude_deg} are not on any railway")]
    Nowhere {
        /// Its number.
        id: i64,
        /// As written.
        latitude_deg: f64,
        /// As written.
        longitude_deg: f64,
    },
}

/// A network, and what has become of the file.
#[derive(Clone, Debug)]
pub struct OsmImport {
    /// The tracks.
    pub network: PlanNetwork,
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

#[derive(Deserialize)]
struct File {
    elements: Vec<Element>,
}

#[derive(Deserialize)]
struct Element {
    #[serde(rename = "type")]
    kind: String,
    id: i64,
    lat: Option<f64>,
    lon: Option<f64>,
    #[serde(default)]
    nodes: Vec<i64>,
    #[serde(default)]
    tags: BTreeMap<String, String>,
}

/// A stretch of a way between nodes where tracks meet or end.
struct Stretch {
    way: i64,
    nodes: Vec<i64>,
}

impl OsmImport {
    /// Reads a file's text. The datum is the first node of the first track.
    pub fn from_json(text: &str) -> Result<Self, OsmError> {
        let file: File = serde_json::from_str(text).map_err(|e| OsmError::NotJson {
            line: e.line(),
            column: e.column(),
            what: e.to_string(),
        })?;
        Self::of(file)
    }

    fn of(file: File) -> Result<Self, OsmError> {
        let is_track = |way: &&Element| {
            let kind = way.tags.get("railway").map(String::as_str);
            way.kind == "way" && kind.is_some_and(|kind| TRACKS.contains(&kind))
        };
        let nodes: BTreeMap<i64, &Element> = file
            .elements
            .iter()
            .filter(|e| e.kind == "node")
            .map(|e| (e.id, e))
            .collect();
        let mut cut = Vec::new();
        let mut ways: Vec<(i64, Vec<i64>)> = Vec::new();
        for way in file.elements.iter().filter(is_track) {
            let known: Vec<&[i64]> = way.nodes.split(|id| !nodes.contains_key(id)).collect();
            if known.len() > 1 {
                cut.push(way.id);
            }
            let parts = known.into_iter().filter(|part| part.len() > 1);
            ways.extend(parts.map(|part| (way.id, part.to_vec())));
        }
        let all = file.elements.iter().filter(|e| e.kind == "way");
        let mut left_out = BTreeMap::new();
        for way in all.clone().filter(|way| !is_track(way)) {
            let kind = way
                .tags
                .get("railway")
                .cloned()
                .unwrap_or_else(|| "none".to_owned());
            *left_out.entry(kind).or_default() += 1;
        }
        let first = ways.first().and_then(|(_, nodes)| nodes.first());
        let Some(first) = first.and_then(|id| nodes.get(id)) else {
            return Err(OsmError::NoTracks { ways: all.count() });
        };
        let datum = Datum {
            place: geodetic(first)?,
            heading_deg: 0.0,
        };
        let mut places = BTreeMap::new();
        for id in ways.iter().flat_map(|(_, nodes)| nodes) {
            places.insert(*id, datum.world(&geodetic(nodes[id])?).xy());
        }
        let slips = |id: &i64| {
            nodes[id]
                .tags
                .get("railway")
                .is_some_and(|kind| kind == "switch")
        };
        let mut import = Self {
            network: PlanNetwork::new(Some(datum), Vec::new(), &[]),
            length_m: 0.0,
            ways: ways.iter().map(|(id, _)| id).collect::<BTreeSet<_>>().len(),
            left_out,
            cut,
            junctions: BTreeMap::new(),
            unclear: Vec::new(),
        };
        import.join(datum, &stretches(&ways), &places, slips);
        Ok(import)
    }

    /// Makes the elements and joins them at their nodes.
    fn join(
        &mut self,
        datum: Datum,
        stretches: &[Stretch],
        places: &BTreeMap<i64, Point2<f64>>,
        slips: impl Fn(&i64) -> bool,
    ) {
        let mut elements = Vec::new();
        let mut at: BTreeMap<i64, Vec<(ElementEnd, Vector2<f64>)>> = BTreeMap::new();
        let mut counts: BTreeMap<i64, usize> = BTreeMap::new();
        for stretch in stretches {
            let points: Vec<Point2<f64>> = stretch.nodes.iter().map(|id| places[id]).collect();
            let count = counts.entry(stretch.way).or_default();
            *count += 1;
            let id = match *count {
                1 => stretch.way.to_string(),
                more => format!("{}.{more}", stretch.way),
            };
            let Some(track) = TrackElement::new(&id, points) else {
                continue;
            };
            let element = elements.len();
            let chord_m = CHORD_M.min(track.length_m());
            let (begin, end) = (track.at(0.0).0, track.at(track.length_m()).0);
            let away = [
                (track.at(chord_m).0 - begin).normalize(),
                (track.at(track.length_m() - chord_m).0 - end).normalize(),
            ];
            let ends = [
                (0, Direction::Down),
                (stretch.nodes.len() - 1, Direction::Up),
            ];
            for ((node, way), away) in ends.into_iter().zip(away) {
                let end = ElementEnd { element, way };
                at.entry(stretch.nodes[node]).or_default().push((end, away));
            }
            self.length_m += track.length_m();
            elements.push(track);
        }
        let mut joints = Vec::new();
        for (node, ends) in &at {
            let directions: Vec<_> = ends.iter().map(|(_, away)| *away).collect();
            let (kind, pairs) = junction(&directions, slips(node));
            *self.junctions.entry(kind).or_default() += 1;
            if kind == JunctionKind::Unclear {
                self.unclear.push(*node);
            }
            joints.extend(pairs.into_iter().map(|(a, b)| (ends[a].0, ends[b].0)));
        }
        self.network = PlanNetwork::new(Some(datum), elements, &joints);
    }
}

fn geodetic(node: &Element) -> Result<Geodetic, OsmError> {
    let latitude_deg = node.lat.unwrap_or(f64::NAN);
    let longitude_deg = node.lon.unwrap_or(f64::NAN);
    match latitude_deg.abs() <= 85.0 && longitude_deg.abs() <= 180.0 {
        true => Ok(Geodetic {
            latitude_deg,
            longitude_deg,
            height_m: 0.0,
        }),
        false => Err(OsmError::Nowhere {
            id: node.id,
            latitude_deg,
            longitude_deg,
        }),
    }
}

/// Ways cut where more than two tracks meet.
fn stretches(ways: &[(i64, Vec<i64>)]) -> Vec<Stretch> {
    let mut neighbours: BTreeMap<i64, BTreeSet<i64>> = BTreeMap::new();
    for pair in ways.iter().flat_map(|(_, nodes)| nodes.windows(2)) {
        neighbours.entry(pair[0]).or_default().insert(pair[1]);
        neighbours.entry(pair[1]).or_default().insert(pair[0]);
    }
    let mut stretches = Vec::new();
    for (way, nodes) in ways {
        let mut begin = 0;
        for k in 1..nodes.len() {
            let is_last = k + 1 == nodes.len();
            if is_last || neighbours[&nodes[k]].len() > 2 {
                stretches.push(Stretch {
                    way: *way,
                    nodes: nodes[begin..=k].to_vec(),
                });
                begin = k;
            }
        }
    }
    stretches
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    /// A line with a siding on its left: nodes 1 - 2 - 3 - 4 - 5, and 2 - 6 - 7 - 4.
    const SIDING: &str = r#"{ "elements": [
        { "type": "node", "id": 1, "lat": 48.2, "lon": 15.600 }, { "type": "node", "id": 2, "lat": 48.2, "lon": 15.602 },
        { "type": "node", "id": 3, "lat": 48.2, "lon": 15.604 }, { "type": "node", "id": 4, "lat": 48.2, "lon": 15.606 },
        { "type": "node", "id": 5, "lat": 48.2, "lon": 15.608 },
        { "type": "node", "id": 6, "lat": 48.20005, "lon": 15.6026 }, { "type": "node", "id": 7, "lat": 48.20005, "lon": 15.6054 },
        { "type": "way", "id": 10, "nodes": [1, 2, 3], "tags": { "railway": "rail" } },
        { "type": "way", "id": 11, "nodes": [3, 4, 5, 99], "tags": { "railway": "rail" } },
        { "type": "way", "id": 12, "nodes": [2, 6, 7, 4], "tags": { "railway": "rail", "service": "siding" } },
        { "type": "way", "id": 13, "nodes": [1, 5], "tags": { "railway": "abandoned" } }
    ] }"#;

    #[test]
    fn a_siding_has_two_switches() {
        let import = OsmImport::from_json(SIDING).unwrap();
        let count = |kind| import.junctions.get(&kind).copied().unwrap_or(0);
        assert_eq!(
            [JunctionKind::Switch, JunctionKind::Joint, JunctionKind::End].map(count),
            [2, 1, 2]
        );
        assert_eq!((import.ways, import.cut.as_slice()), (3, [11].as_slice()));
        assert_eq!(import.left_out["abandoned"], 1);
        let ids: Vec<&str> = import.network.elements.iter().map(|e| &*e.id).collect();
        assert_eq!(ids, ["10", "10.2", "11", "11.2", "12"]);
        let from_west = ElementEnd {
            element: 0,
            way: Direction::Up,
        };
        let legs: Vec<usize> = import
            .network
            .onward(from_west)
            .iter()
            .map(|end| end.element)
            .collect();
        assert_eq!(legs, [1, 4]);
        // From the siding's end back onto the line's other leg no train runs.
        let from_siding = ElementEnd {
            element: 4,
            way: Direction::Down,
        };
        let next: Vec<usize> = import
            .network
            .onward(from_siding)
            .iter()
            .map(|end| end.element)
            .collect();
        assert_eq!(next, [0]);
        // 0.008 degrees of longitude at this latitude, and the siding.
        let east_m = 0.008 * 74_330.0;
        assert!(
            (import.length_m - east_m - 0.004 * 74_330.0).abs() < 2.0,
            "{}",
            import.length_m
        );
    }

    #[test]
    fn wrong_files_are_refused() {
        for (from, to, told) in [
            ("\"rail\"", "\"disused\"", "no way with `railway`"),
            (
                "\"lat\": 48.2, \"lon\": 15.600",
                "\"lat\": 148.2, \"lon\": 15.600",
                "node 1",
            ),
            ("\"elements\"", "\"features\"", "missing field `elements`"),
            ("] }", "", "line "),
        ] {
            let text = SIDING.replace(from, to);
            let error = OsmImport::from_json(&text).unwrap_err().to_string();
            assert!(error.contains(told), "{told}: {error}");
        }
    }
}
