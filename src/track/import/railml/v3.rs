//! Topology of railML 3.x: net elements and the relations between them.
//!
//! A net element that is a collection of others describes them on a coarser level. `intrinsicCoord` counts from 0 at
//! an element's begin to 1 at its end; a relation joins `positionOnA` to `positionOnB`, and trains run over it if its
//! `navigability` is not `None`.

use super::draft::{Draft, DraftTrack};
use super::report::Fates;
use super::stated::LONGEST_M;
use super::v3_reading::NetReading;
use super::v3_relations::{micro, parts};
use super::xml::{Item, short};
use super::{ImportedMap, RailMlError, RailMlOptions};
use super::{v3_along, v3_switches};
use crate::track::import::AlongElement;
use std::collections::{BTreeMap, BTreeSet};

/// Reads all of it.
pub(super) fn read(root: Item<'_>, options: &RailMlOptions) -> Result<ImportedMap, RailMlError> {
    let infrastructure = root.child("infrastructure").ok_or(RailMlError::NoTracks)?;
    let topology = infrastructure
        .child("topology")
        .ok_or(RailMlError::NoTracks)?;
    root.check_ids()?;
    let mut reading = NetReading {
        options: *options,
        systems: systems(root),
        numbers: BTreeMap::new(),
        collections: BTreeMap::new(),
        relations: BTreeMap::new(),
        fates: Fates::default(),
    };
    let tracks = reading.elements(topology)?;
    let mut draft = Draft {
        tracks,
        joints: Vec::new(),
        switches: Vec::new(),
        turns_are_known: true,
    };
    reading.relate(topology)?;
    let straight = match infrastructure.child("functionalInfrastructure") {
        Some(functional) => {
            v3_along::read(root, functional, &mut draft, &mut reading)?;
            v3_switches::read(functional, &mut draft, &mut reading)?
        }
        None => BTreeSet::new(),
    };
    // First what crossings lead straight on.
    let (first, then): (Vec<_>, Vec<_>) = reading
        .relations
        .iter()
        .partition(|(id, _)| straight.contains(*id));
    let run = first
        .into_iter()
        .chain(then)
        .filter_map(|(_, relation)| relation.as_ref());
    let run = run.filter(|relation| relation.is_run);
    draft
        .joints
        .extend(run.map(|relation| (relation.ends[0], relation.ends[1])));
    let mut fates = reading.fates;
    draft.build(root, &mut fates, usual)
}

/// Why elements of a name are not taken over; none for parts of other elements.
fn usual(name: &str) -> Option<&'static str> {
    if name.ends_with("Location") || name.starts_with("elementCollection") {
        return None;
    }
    if name.ends_with("IL") || name.starts_with("tvd") || name.starts_with("route") {
        return Some("interlocking is not read");
    }
    Some(match name {
        "infrastructure"
        | "common"
        | "interlocking"
        | "network"
        | "level"
        | "intrinsicCoordinate"
        | "associatedPositioningSystem" => return None,
        "trainDetectionElement" => "train detection is not part of a map",
        "border" | "bufferStop" => "ends no element",
        "geometryPoint" => "curves say what its points do",
        "superelevationCurve" => "cant of railML 3 is not read",
        "platformEdge" | "stoppingPlace" => "platforms are not part of a map in plan",
        "linearElementProjection" | "spotElementProjection" => "drawings tell no places",
        "line" | "operationalPoint" | "opOperation" => "lines and operational points are not read",
        "linearPositioningSystem" | "mileageChange" => "mileage is that of each element's begin",
        _ => "not read",
    })
}

fn systems<'a>(root: Item<'a>) -> BTreeMap<&'a str, Option<&'a str>> {
    let all = root.all().filter_map(|item| {
        let id = item.attribute("id")?;
        match item.name() {
            "geometricPositioningSystem" => {
                Some((id, item.attribute("crsDefinition").or(Some(""))))
            }
            "screenPositioningSystem" => Some((id, None)),
            _ => None,
        }
    });
    all.collect()
}

impl<'a> NetReading<'a> {
    /// The elements that are no collection, in the order of the file.
    fn elements(&mut self, topology: Item<'a>) -> Result<Vec<DraftTrack<'a>>, RailMlError> {
        let micro = micro(topology);
        let mut tracks = Vec::new();
        for item in topology
            .named("netElements")
            .flat_map(|all| all.named("netElement"))
        {
            let id = item.needed("id")?;
            if parts(item).next().is_some() {
                self.collections.insert(id, item);
                let count = parts(item).count();
                self.fates
                    .leave(item, format!("a collection of {count} other elements"));
            } else if micro.as_ref().is_some_and(|micro| !micro.contains(id)) {
                self.collections.insert(id, item);
                self.fates
                    .leave(item, "not on the level \"Micro\" of any network");
            } else {
                self.numbers.insert(id, tracks.len());
                tracks.push(self.element(item, id)?);
                self.fates.take(item);
            }
        }
        self.check_collections()?;
        Ok(tracks)
    }

    fn element(&self, item: Item<'a>, id: &str) -> Result<DraftTrack<'a>, RailMlError> {
        let mut measures: Vec<(f64, f64, &str)> = Vec::new();
        let mut coordinates = Vec::new();
        let systems = item.named("associatedPositioningSystem");
        for at in systems.flat_map(|system| system.named("intrinsicCoordinate")) {
            let place = at.needed_value("intrinsicCoord")?;
            if !(0.0..=1.0).contains(&place) {
                return Err(at.fault(format!(
                    "`intrinsicCoord` is {place}: 0 (begin) to 1 (end) is needed"
                )));
            }
            for linear in at.named("linearCoordinate") {
                let system = linear.attribute("positioningSystemRef").unwrap_or_default();
                measures.push((place, linear.needed_value("measure")?, system));
            }
            coordinates.extend(
                at.named("geometricCoordinate")
                    .map(|point| (place, at, point)),
            );
        }
        measures.sort_by(|a, b| a.0.total_cmp(&b.0));
        let begin = measures.iter().find(|measure| measure.0 <= 0.0);
        let end = measures
            .iter()
            .find(|m| m.0 >= 1.0 && begin.is_some_and(|begin| begin.2 == m.2));
        let counts_down = matches!((begin, end), (Some(begin), Some(end)) if end.1 < begin.1);
        let by_measure = begin.zip(end).map(|(begin, end)| (end.1 - begin.1).abs());
        let length_m = item.value("length")?.or(by_measure);
        let length_m =
            length_m.ok_or_else(|| item.fault("has no `length`: a number of metres is needed"))?;
        if !(0.01..=LONGEST_M).contains(&length_m) {
            return Err(item.fault(format!(
                "is {length_m} m long: 0.01 m to {LONGEST_M} m are needed"
            )));
        }
        let mut track = DraftTrack {
            item,
            id: short(id),
            length_m,
            cuts: Vec::new(),
            places: Vec::new(),
            beside: Vec::new(),
            along: AlongElement {
                stated_m: begin.map(|begin| begin.1),
                line: item.line(),
                ..AlongElement::default()
            },
            curves: Vec::new(),
            counts_down,
        };
        for (place, of, point) in coordinates {
            track
                .places
                .extend(self.known(of, point, (place * length_m, 2))?);
        }
        Ok(track)
    }
}
