//! Tracks, connections and switches of railML 2.x.
//!
//! A switch or crossing lies on one track, which goes on through it; `connection` leads from it to the track that
//! leaves it, and back: the two name each other. `orientation="outgoing"`: the other track leaves towards growing
//! `pos`. `course` tells on which side; `straight`, that it is the track itself which turns off.

use super::draft::{Draft, DraftTrack};
use super::report::Fates;
use super::stated::{LONGEST_M, SAME_M, place_m, switch_m};
use super::v2_along::FileDefaults;
use super::v2_joints::{At, Connection, join};
use super::xml::{Item, short};
use super::{ImportedMap, RailMlError, RailMlOptions};
use crate::track::import::AlongElement;

/// Reads all of it.
pub(super) fn read(root: Item<'_>, options: &RailMlOptions) -> Result<ImportedMap, RailMlError> {
    let infrastructure = match root.name() {
        "infrastructure" => root,
        _ => root.child("infrastructure").ok_or(RailMlError::NoTracks)?,
    };
    let fates = &mut Fates::default();
    let defaults = FileDefaults::new(infrastructure, options, fates)?;
    let mut links = Vec::new();
    let mut tracks = Vec::new();
    let items = infrastructure
        .named("tracks")
        .flat_map(|tracks| tracks.named("track"));
    for (number, item) in items.enumerate() {
        let mut track = track(item, number, &mut links, fates)?;
        defaults.read_along(&mut track, fates)?;
        tracks.push(track);
    }
    infrastructure.check_ids()?;
    let mut draft = Draft {
        tracks,
        joints: Vec::new(),
        switches: Vec::new(),
        turns_are_known: false,
    };
    join(&mut draft, &links, fates)?;
    draft.build(infrastructure, fates, usual)
}

/// Why elements of a name are not taken over.
fn usual(name: &str) -> Option<&'static str> {
    Some(match name {
        "trainDetector" | "trackCircuitBorder" => "train detection is not part of a map",
        "geoCoord" => "coordinates of what it belongs to are not used",
        "platformEdge" | "platform" => "platforms are not part of a map in plan",
        "line" | "trackGroup" => "lines and groups of tracks are not read",
        _ => "not read",
    })
}

fn track<'a>(
    item: Item<'a>,
    number: usize,
    links: &mut Vec<Connection<'a>>,
    fates: &mut Fates,
) -> Result<DraftTrack<'a>, RailMlError> {
    let id = item.id().ok_or_else(|| item.fault("needs an `id`"))?;
    let topology = item
        .child("trackTopology")
        .ok_or_else(|| item.fault("needs a `trackTopology`"))?;
    let end_of = |name: &str| {
        topology
            .child(name)
            .ok_or_else(|| item.fault(format!("needs a `{name}`")))
    };
    let (begin, end) = (end_of("trackBegin")?, end_of("trackEnd")?);
    let begin_m = begin.value("pos")?.unwrap_or(0.0);
    let length_m = end.needed_value("pos")? - begin_m;
    if !(SAME_M..=LONGEST_M).contains(&length_m) {
        return Err(end.fault(format!(
            "`pos` makes its track {length_m} m long: more than {SAME_M} m and at most {LONGEST_M} m are needed"
        )));
    }
    if begin_m.abs() > 0.0 {
        return Err(begin.fault(format!("`pos` is {begin_m}: a track begins at 0")));
    }
    let mileage = [begin.value("absPos")?, end.value("absPos")?];
    let counts_down = matches!(mileage, [Some(begin), Some(end)] if end < begin);
    for (node, at) in [(begin, At::Begin), (end, At::End)] {
        fates.take(node);
        for inside in node.children() {
            match inside.name() {
                "connection" => links.push(link(inside, number, at, None)?),
                "openEnd" | "bufferStop" | "macroscopicNode" => fates.take(inside),
                _ => {}
            }
        }
    }
    let mut cuts = Vec::new();
    let connections = topology.named("connections").flat_map(Item::children);
    for node in connections.filter(|node| matches!(node.name(), "switch" | "crossing")) {
        let at_m = place_m(node, length_m, switch_m(node, mileage[0])?)?;
        cuts.push(at_m);
        let before = links.len();
        for connection in node.named("connection") {
            links.push(link(connection, number, At::Switch { at_m }, Some(node))?);
        }
        if links.len() == before {
            return Err(node
                .fault("has one leg alone: it needs a `connection` to the track that leaves it"));
        }
    }
    cuts.sort_by(f64::total_cmp);
    cuts.retain(|at_m| (SAME_M..=length_m - SAME_M).contains(at_m));
    cuts.dedup_by(|b, a| *b - *a < SAME_M);
    fates.take(item);
    let has_buffer = |end: Item<'_>| end.child("bufferStop").is_some();
    let along = AlongElement {
        buffers: [has_buffer(begin), has_buffer(end)],
        name: item.attribute("name").map(short),
        stated_m: mileage[0],
        line: item.line(),
        ..AlongElement::default()
    };
    Ok(DraftTrack {
        item,
        id: short(id),
        length_m,
        cuts,
        places: Vec::new(),
        beside: Vec::new(),
        along,
        curves: Vec::new(),
        counts_down,
    })
}

fn link<'a>(
    item: Item<'a>,
    track: usize,
    at: At,
    of: Option<Item<'a>>,
) -> Result<Connection<'a>, RailMlError> {
    item.needed("id")?;
    let to = item.needed("ref")?;
    Ok(Connection {
        item,
        to,
        track,
        at,
        of,
    })
}
