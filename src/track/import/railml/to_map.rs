//! The map of a file's tracks: drawn or laid out, cut into elements, and with what lies along them.

use super::RailMlError;
use super::draft::{CutEnd, Draft, DraftPlan};
use super::layout::lay_out;
use super::plan::draw;
use super::report::Fates;
use super::xml::Item;
use crate::track::import::{AlongElement, ImportedMap, LeftOut, MapSwitch};
use crate::track::plan::{ElementEnd, PlanNetwork, TrackElement};
use std::collections::BTreeSet;

/// Elements that are so much longer or shorter in plan than stated are told, metres.
const OFF_M: f64 = 1.0;
/// And by this part of their length.
const OFF: f64 = 0.005;
/// At most so many.
const MOST_TOLD: usize = 100;

impl<'a> Draft<'a> {
    /// The map. Elements have the id of their track, with a dot and a count from the second on.
    pub(super) fn build(
        mut self,
        root: Item<'a>,
        fates: &mut Fates,
        usual: impl Fn(&str) -> Option<&'static str>,
    ) -> Result<ImportedMap, RailMlError> {
        if self.tracks.is_empty() {
            return Err(RailMlError::NoTracks);
        }
        for track in &mut self.tracks {
            track.along.sort();
            track.places.sort_by(|a, b| a.at_m.total_cmp(&b.at_m));
        }
        let has_places = self.tracks.iter().any(|track| !track.places.is_empty());
        let plan = match has_places {
            true => draw(&self, fates)?,
            false => lay_out(&self),
        };
        self.turn_curves(plan.turn, fates);
        let firsts = self.first_elements();
        let number = |end: CutEnd| ElementEnd {
            element: firsts.get(end.track).copied().unwrap_or(0) + end.piece,
            way: end.way,
        };
        let (elements, along) = self.elements(&plan)?;
        let mut report = fates.report(root, usual);
        report.left_out.splice(0..0, self.told(&plan));
        let joints: Vec<_> = self
            .all_joints()
            .map(|(a, b)| (number(a), number(b)))
            .collect();
        let switches = self.switches.iter().map(|switch| MapSwitch {
            name: switch.name.clone(),
            line: switch.line,
            toe: number(switch.toe),
            through: number(switch.through),
            diverging: number(switch.diverging),
            diverging_kmh: switch.diverging_kmh,
        });
        let switches = switches.collect();
        let checks = plan.checks.into_iter().map(|(track, at_m, mut check)| {
            let cuts = self.tracks.get(track).map_or(&[][..], |track| &track.cuts);
            let piece = cuts.partition_point(|cut| *cut <= at_m);
            check.element = firsts.get(track).copied().unwrap_or(0) + piece;
            check
        });
        let plan_checks = checks.collect();
        Ok(ImportedMap {
            network: PlanNetwork::new(plan.datum, elements, &joints),
            along,
            switches,
            plan_is_laid_out: plan.datum.is_none(),
            plan_checks,
            report,
        })
    }

    fn elements(
        &self,
        plan: &DraftPlan,
    ) -> Result<(Vec<TrackElement>, Vec<AlongElement>), RailMlError> {
        let (mut elements, mut along) = (Vec::new(), Vec::new());
        let mut ids = BTreeSet::new();
        for (track, shapes) in self.tracks.iter().zip(&plan.shapes) {
            for (piece, shape) in shapes.iter().enumerate() {
                let id = match piece {
                    0 => track.id.clone(),
                    more => format!("{}.{}", track.id, more + 1),
                };
                let bounds = track.bounds(piece);
                let element = TrackElement::new(&id, shape.points.clone()).ok_or_else(|| {
                    let [from_m, to_m] = bounds;
                    track.item.fault(format!("has no length in plan between {from_m} m and {to_m} m: are coordinates named twice?"))
                })?;
                if !ids.insert(id) {
                    return Err(track
                        .item
                        .fault("has the id of another track: ids must be unique"));
                }
                let is_last = piece + 1 == track.pieces();
                let mut part = track
                    .along
                    .piece(bounds, is_last, &|at_m| shape.along_m(at_m));
                let back = if track.counts_down { -1.0 } else { 1.0 };
                part.stated_m = track.along.stated_m.map(|stated| stated + back * bounds[0]);
                elements.push(element);
                along.push(part);
            }
        }
        Ok((elements, along))
    }

    /// What the plan does not keep of the file.
    fn told(&self, plan: &DraftPlan) -> Vec<LeftOut> {
        let mut told = Vec::new();
        if plan.datum.is_none() {
            told.push(LeftOut {
                line: 0,
                what: "where tracks lie".to_owned(),
                why:
                    "the file has no coordinates: the plan is laid out by lengths and joints alone"
                        .to_owned(),
            });
        }
        for (track, shapes) in self.tracks.iter().zip(&plan.shapes) {
            for (piece, shape) in shapes.iter().enumerate() {
                let [from_m, to_m] = track.bounds(piece);
                let off_m = shape.along_m(to_m) - shape.along_m(from_m) - (to_m - from_m);
                if off_m.abs() > OFF_M.max(OFF * (to_m - from_m)) && told.len() < MOST_TOLD {
                    told.push(LeftOut {
                        line: track.item.line(),
                        what: track.item.title(),
                        why: format!("from {from_m:.1} m to {to_m:.1} m it is {off_m:.1} m longer in plan than stated"),
                    });
                }
            }
        }
        told
    }

    /// Makes curvatures to the left positive, or leaves them out where nothing says which way they turn.
    fn turn_curves(&mut self, turn: Option<f64>, fates: &mut Fates) {
        for track in &mut self.tracks {
            match turn {
                Some(turn) => {
                    for step in &mut track.along.curvatures_per_m {
                        step.value *= turn;
                    }
                }
                None => {
                    track.along.curvatures_per_m.clear();
                    for curve in &track.curves {
                        fates.leave(*curve, "neither the file nor its coordinates say which way a positive radius turns");
                    }
                }
            }
        }
    }
}
