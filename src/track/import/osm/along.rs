//! What the tags of a way and of its nodes say along a track.

use super::data::{OsmData, OsmNode, OsmWay};
use crate::track::Direction;
use crate::track::import::{AlongElement, MapSignal, MapSpeed};
use std::collections::BTreeMap;

/// Kilometres of a statute mile.
const KM_PER_MILE: f64 = 1.609_344;

/// Along a stretch of a way: `places` are its nodes and how far along it each is.
pub(super) fn along(data: &OsmData, way: &OsmWay, places: &[(i64, f64)]) -> AlongElement {
    let length_m = places.last().map_or(0.0, |(_, m)| *m);
    let tag = |key: &str| way.tags.get(key).map(String::as_str);
    let nodes = places
        .iter()
        .filter_map(|(id, m)| Some((*id, *m, data.nodes.get(id)?)));
    let signals = nodes
        .clone()
        .filter(|(.., node)| kind(node) == Some("signal"));
    let ends = [places.first(), places.last()];
    let is_buffer = |id: &i64| data.nodes.get(id).and_then(kind) == Some("buffer_stop");
    AlongElement {
        name: tag("railway:track_ref")
            .map(|name| format!("track {name}"))
            .or(tag("name").map(str::to_owned)),
        speeds: speeds(&way.tags),
        signals: signals
            .filter_map(|(id, m, node)| signal(id, m, node))
            .collect(),
        tunnels_m: tag("tunnel")
            .filter(|v| *v != "no")
            .map(|_| [0.0, length_m])
            .into_iter()
            .collect(),
        one_way: one_way(&way.tags),
        buffers: ends.map(|end| end.is_some_and(|(id, _)| is_buffer(id))),
        line: way.line,
        ..AlongElement::default()
    }
}

/// What a node of the railway is.
pub(super) fn kind(node: &OsmNode) -> Option<&str> {
    node.tags.get("railway").map(String::as_str)
}

/// The one way in which trains run, or run as a rule.
fn one_way(tags: &BTreeMap<String, String>) -> Option<Direction> {
    let tag = |key: &str| tags.get(key).map(String::as_str);
    match (tag("railway:preferred_direction"), tag("oneway")) {
        (Some("forward"), _) | (None, Some("yes" | "1" | "true")) => Some(Direction::Up),
        (Some("backward"), _) | (None, Some("-1" | "reverse")) => Some(Direction::Down),
        _ => None,
    }
}

fn speeds(tags: &BTreeMap<String, String>) -> Vec<MapSpeed> {
    let keys = [
        ("maxspeed", None),
        ("maxspeed:forward", Some(Direction::Up)),
        ("maxspeed:backward", Some(Direction::Down)),
    ];
    let speeds = keys.into_iter().filter_map(|(key, way)| {
        let kmh = tags.get(key).and_then(|text| kmh(text))?;
        Some(MapSpeed {
            from_m: 0.0,
            kmh,
            way,
        })
    });
    speeds.collect()
}

/// As `60`, `60 km/h` or `40 mph`.
fn kmh(text: &str) -> Option<f64> {
    let text = text.trim();
    let (number, unit) = match text.find(|c: char| !c.is_ascii_digit() && c != '.') {
        Some(at) => text.split_at(at),
        None => (text, ""),
    };
    let number: f64 = number
        .parse()
        .ok()
        .filter(|kmh| (1.0..=500.0).contains(kmh))?;
    match unit.trim() {
        "" | "km/h" | "kmh" => Some(number),
        "mph" => Some(number * KM_PER_MILE),
        _ => None,
    }
}

fn signal(id: i64, along_m: f64, node: &OsmNode) -> Option<MapSignal> {
    let tag = |key: &str| node.tags.get(key).map(String::as_str);
    let way = match tag("railway:signal:direction")? {
        "forward" => Direction::Up,
        "backward" => Direction::Down,
        _ => return None,
    };
    Some(MapSignal {
        name: tag("ref").map_or_else(|| id.to_string(), str::to_owned),
        along_m,
        way,
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    #[test]
    fn speeds_have_units() {
        for (text, expected) in [
            ("60", Some(60.0)),
            ("60 km/h", Some(60.0)),
            ("25 mph", Some(40.2336)),
            ("signals", None),
            ("none", None),
            ("60;80", None),
            ("0", None),
        ] {
            let found = kmh(text);
            let same = match (found, expected) {
                (Some(a), Some(b)) => (a - b).abs() < 1e-9,
                (a, b) => a.is_none() && b.is_none(),
            };
            assert!(same, "{text}: {found:?}");
        }
    }

    #[test]
    fn preferred_directions_come_before_ways_in_traffic() {
        let tags = |pairs: &[(&str, &str)]| {
            let pairs = pairs
                .iter()
                .map(|(k, v)| ((*k).to_owned(), (*v).to_owned()));
            one_way(&pairs.collect())
        };
        assert_eq!(tags(&[("oneway", "yes")]), Some(Direction::Up));
        assert_eq!(
            tags(&[("railway:preferred_direction", "both"), ("oneway", "yes")]),
            None
        );
        assert_eq!(
            tags(&[("railway:preferred_direction", "backward")]),
            Some(Direction::Down)
        );
    }
}
