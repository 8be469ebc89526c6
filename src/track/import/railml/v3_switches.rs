//! Switches and crossings of railML 3.x, by the relations that are their branches.
//!
//! Left and right are as seen from the toe. `branchCourse` says which of both legs diverges, `continueCourse` which one
//! goes on.

use super::RailMlError;
use super::draft::{CutEnd, Draft, DraftSwitch};
use super::v3_reading::{NetReading, Relation};
use super::xml::{Item, short};
use std::collections::BTreeSet;

/// Reads all of them; the answer has the relations that lead straight over a crossing.
pub(super) fn read<'a>(
    functional: Item<'a>,
    draft: &mut Draft<'a>,
    reading: &mut NetReading<'a>,
) -> Result<BTreeSet<&'a str>, RailMlError> {
    let mut straight = BTreeSet::new();
    let groups = functional.children().flat_map(|group| group.children());
    for item in groups {
        match (item.name(), item.attribute("type")) {
            ("crossing", _)
            | ("switchIS", Some("doubleSwitchCrossing" | "singleSwitchCrossing")) => {
                straight.extend(slip(item, reading)?);
                reading.fates.take(item);
            }
            ("switchIS", Some("switchCrossingPart")) => {
                legs(item, reading)?;
                reading.fates.take(item);
            }
            ("switchIS", _) => {
                draft.switches.push(switch(item, reading)?);
                reading.fates.take(item);
            }
            _ => {}
        }
    }
    Ok(straight)
}

/// The relation of a branch, over which trains must run.
fn branch<'r>(item: Item<'_>, reading: &'r NetReading<'_>) -> Result<&'r Relation, RailMlError> {
    let id = item.needed("netRelationRef")?;
    let found = reading.relations.get(id).and_then(Option::as_ref);
    let relation = found.ok_or_else(|| {
        item.fault(format!("`netRelationRef` is \"{}\", which no netRelation between single elements has as its `id`", short(id)))
    })?;
    match relation.is_run {
        true => Ok(relation),
        false => Err(item.fault(format!(
            "trains do not run over \"{}\": its `navigability` is None",
            short(id)
        ))),
    }
}

/// Ends of the toe, the left and the right leg.
fn legs(item: Item<'_>, reading: &NetReading<'_>) -> Result<[CutEnd; 3], RailMlError> {
    let side = |name: &str| {
        let mut branches = item.named(name);
        match (branches.next(), branches.next()) {
            (Some(only), None) => branch(only, reading),
            _ => Err(item.fault(format!(
                "needs one `{name}`: a switch has two legs, of which each is a branch"
            ))),
        }
    };
    let [left, right] = [side("leftBranch")?.ends, side("rightBranch")?.ends];
    let toe = left.into_iter().find(|end| right.contains(end));
    let toe = toe.ok_or_else(|| {
        item.fault("its branches have no end in common: the track before its toe is part of both")
    })?;
    let leg = |ends: [CutEnd; 2]| ends.into_iter().find(|end| *end != toe).unwrap_or(toe);
    let [left, right] = [leg(left), leg(right)];
    match left == right {
        true => Err(item.fault("its two branches are one: it has one leg alone")),
        false => Ok([toe, left, right]),
    }
}

fn switch(item: Item<'_>, reading: &NetReading<'_>) -> Result<DraftSwitch, RailMlError> {
    let [toe, left, right] = legs(item, reading)?;
    let diverges_left = match (
        item.attribute("branchCourse"),
        item.attribute("continueCourse"),
    ) {
        (Some("left"), _) | (None | Some("straight"), Some("right")) => true,
        (Some("right"), _) | (None | Some("straight"), Some("left")) => false,
        (course, _) => {
            return Err(item.fault(format!(
                "nothing tells which leg diverges: `branchCourse` is \"{}\", \"left\" or \"right\" is needed",
                short(course.unwrap_or_default())
            )));
        }
    };
    let (through, diverging, name) = match diverges_left {
        true => (right, left, "leftBranch"),
        false => (left, right, "rightBranch"),
    };
    let branch = item.child(name);
    let speed = branch.map_or(Ok(None), |branch| branch.speed_kmh("branchingSpeed"))?;
    let joining = branch.map_or(Ok(None), |branch| branch.speed_kmh("joiningSpeed"))?;
    Ok(DraftSwitch {
        name: item.label(),
        line: item.line(),
        toe,
        through,
        diverging,
        diverging_kmh: speed.into_iter().chain(joining).reduce(f64::min),
        diverges_left,
    })
}

/// What leads straight over a crossing; slips turn besides.
fn slip<'a>(item: Item<'a>, reading: &NetReading<'a>) -> Result<Vec<&'a str>, RailMlError> {
    let straight: Vec<Item<'a>> = item.named("straightBranch").collect();
    if straight.len() != 2 {
        return Err(item.fault(format!(
            "has {} straightBranch: the two tracks that cross are needed",
            straight.len()
        )));
    }
    for branch_item in item
        .named("straightBranch")
        .chain(item.named("turningBranch"))
    {
        branch(branch_item, reading)?;
    }
    Ok(straight
        .into_iter()
        .filter_map(|branch| branch.attribute("netRelationRef"))
        .collect())
}
