//! A map of others as it was read: network, what lies along its tracks, and what has become of the file.

use crate::track::Direction;
use crate::track::plan::{ElementEnd, PlanNetwork};
use std::collections::BTreeMap;

/// A map, whatever format it came in.
#[derive(Clone, Debug)]
pub struct ImportedMap {
    /// Its tracks in plan.
    pub network: PlanNetwork,
    /// What lies along each of its elements, in their order.
    pub along: Vec<AlongElement>,
    /// Its switches of three tracks. Slips are joints of the network alone.
    pub switches: Vec<MapSwitch>,
    /// The map states lengths, but no coordinates: only the graph and the lengths of elements are the map's. Where they
    /// lie, and every angle and curve, was made up. There is no datum then.
    pub plan_is_laid_out: bool,
    /// Places with coordinates that the plan was not drawn through, held against it.
    pub plan_checks: Vec<PlanCheck>,
    /// What the file says, and what of it was taken over.
    pub report: ImportReport,
}

/// What a map says along an element, by the distance from its first point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AlongElement {
    /// Name for people, if it has one.
    pub name: Option<String>,
    /// Curvature, to the left positive; empty where the map says nothing.
    pub curvatures_per_m: Vec<MapStep>,
    /// Cant.
    pub cants_mm: Vec<MapStep>,
    /// Grade, rising towards the last point positive.
    pub grades_permille: Vec<MapStep>,
    /// Permitted speeds.
    pub speeds: Vec<MapSpeed>,
    /// Balises.
    pub balises: Vec<MapBalise>,
    /// Signals.
    pub signals: Vec<MapSignal>,
    /// Stretches in a tunnel.
    pub tunnels_m: Vec<[f64; 2]>,
    /// Chainage as the map states it, of the first point.
    pub stated_m: Option<f64>,
    /// The only way in which trains run as a rule.
    pub one_way: Option<Direction>,
    /// Whether its first and its last point are at a buffer stop.
    pub buffers: [bool; 2],
    /// Line of the file that it stands on, from 1; 0 where lines mean nothing.
    pub line: usize,
}

/// A value that holds from a place on, up to the next one of its list. The unit is in the name of the list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapStep {
    /// Where it begins.
    pub from_m: f64,
    /// What it is from there on.
    pub value: f64,
}

/// A balise.
#[derive(Clone, Debug, PartialEq)]
pub struct MapBalise {
    /// Its name.
    pub name: String,
    /// Where it lies.
    pub along_m: f64,
}

/// A permitted speed, from a place on.
#[derive(Clone, Debug, PartialEq)]
pub struct MapSpeed {
    /// Where it begins.
    pub from_m: f64,
    /// What is permitted.
    pub kmh: f64,
    /// For trains that run this way; none: both.
    pub way: Option<Direction>,
}

/// A signal.
#[derive(Clone, Debug, PartialEq)]
pub struct MapSignal {
    /// Its name.
    pub name: String,
    /// Where it stands.
    pub along_m: f64,
    /// For trains that run this way.
    pub way: Direction,
}

/// A switch, by the ends of the three elements that meet at it.
#[derive(Clone, Debug, PartialEq)]
pub struct MapSwitch {
    /// Its name, or its id where it has none.
    pub name: String,
    /// Line of the file that it stands on, from 1; 0 where lines mean nothing.
    pub line: usize,
    /// Of the track before its toe.
    pub toe: ElementEnd,
    /// Of the leg that the map says is run straight on, or else of the one that turns less.
    pub through: ElementEnd,
    /// Of the other leg.
    pub diverging: ElementEnd,
    /// Permitted over the other leg.
    pub diverging_kmh: Option<f64>,
}

/// A place with coordinates beside an element, as seen from where the map says that it is along it.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanCheck {
    /// Line of the file that it stands on, from 1; 0 where lines mean nothing.
    pub line: usize,
    /// What it is, with its id.
    pub what: String,
    /// Element, by number.
    pub element: usize,
    /// Farther up along the element than the map says, metres.
    pub along_m: f64,
    /// To the left of the element, metres: signals stand beside their track.
    pub left_m: f64,
}

/// What has become of a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImportReport {
    /// By what the format calls it: how many the file has, and how many were taken over.
    pub counts: BTreeMap<String, ImportCount>,
    /// What was not taken over, and why.
    pub left_out: Vec<LeftOut>,
}

/// How many of a kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ImportCount {
    /// The file has.
    pub in_file: usize,
    /// Were taken over.
    pub taken: usize,
}

/// Something in the file that was not taken over.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeftOut {
    /// Line of the file, from 1; 0 where lines mean nothing.
    pub line: usize,
    /// What it is, with its id.
    pub what: String,
    /// Why.
    pub why: String,
}
