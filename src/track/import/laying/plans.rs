//! Plans of tracks as a tunnel file has them: fitted, and rounded so that all ends still meet.

use crate::track::alignment::{Alignment, PlanElement};
use crate::track::file::{PlanEntry, PlanShape, StartEntry};
use crate::track::import::fit::{ArcChain, EndPose};
use crate::track::import::plane::turn_rad;
use crate::track::section::Side;
use nalgebra::Point3;

/// Ends may be so far from where they are to be: half of what two ends that meet may be apart.
const MOST_GAP_M: f64 = 4e-4;
const MOST_KINK_RAD: f64 = 4e-5;
/// Decimals of lengths and radii, metres, that are tried: the fewest that keep the ends.
const DECIMALS: [i32; 4] = [3, 4, 6, 9];
/// An arc with a larger radius is a straight in a tunnel file.
const WIDEST_M: f64 = 1e8;
/// The shortest element.
const SHORTEST_M: f64 = 0.002;

/// Where a track begins, and its elements.
#[derive(Clone, Debug)]
pub(super) struct WrittenPlan {
    pub start: StartEntry,
    pub plan: Vec<PlanEntry>,
}

impl WrittenPlan {
    /// A curve as it is written. None where no number of decimals keeps its end.
    pub fn of(chain: &ArcChain, end: EndPose) -> Option<Self> {
        let elements = elements(chain);
        DECIMALS.iter().find_map(|decimals| {
            let written = Self {
                start: StartEntry {
                    east_m: rounded(chain.begin.x, 4),
                    north_m: rounded(chain.begin.y, 4),
                    up_m: 0.0,
                    heading_deg: rounded(degrees(chain.heading_rad), 6.max(*decimals + 2)),
                },
                plan: elements.iter().map(|e| entry(e, *decimals)).collect(),
            };
            let line = written.line();
            let at = line.at(line.length_m());
            let gap_m = (at.origin.xy() - end.place).norm();
            let kink_rad = turn_rad(at.heading_rad, end.heading_rad).abs();
            (gap_m < MOST_GAP_M && kink_rad < MOST_KINK_RAD).then_some(written)
        })
    }

    /// Where it runs.
    pub fn line(&self) -> Alignment {
        let start = &self.start;
        let origin = Point3::new(start.east_m, start.north_m, start.up_m);
        let per_m = |k: Option<usize>| {
            let shape = k.and_then(|k| self.plan.get(k)).map(|e| &e.shape);
            match shape {
                Some(PlanShape::Arc { radius_m, turn, .. }) => turn.sign() / radius_m,
                _ => 0.0,
            }
        };
        let elements = self.plan.iter().enumerate().map(|(k, e)| {
            let own = matches!(e.shape, PlanShape::Clothoid {});
            let [from, to] = match own {
                true => [per_m(k.checked_sub(1)), per_m(Some(k + 1))],
                false => [per_m(Some(k)); 2],
            };
            PlanElement {
                start_per_m: from,
                end_per_m: to,
                ..PlanElement::straight(e.length_m)
            }
        });
        let elements: Vec<PlanElement> = elements.collect();
        Alignment::new(origin, start.heading_deg.to_radians(), &elements, &[])
    }

    /// Its tightest radius; none where it is straight.
    pub fn tightest_m(&self) -> Option<f64> {
        let radii = self.plan.iter().filter_map(|e| match e.shape {
            PlanShape::Arc { radius_m, .. } => Some(radius_m),
            _ => None,
        });
        radii.min_by(f64::total_cmp)
    }

    /// Curvature at its begin and at its end, up the track.
    pub fn end_curvatures(&self) -> [f64; 2] {
        let of = |e: Option<&PlanEntry>| match e.map(|e| &e.shape) {
            Some(PlanShape::Arc { radius_m, turn, .. }) => turn.sign() / radius_m,
            _ => 0.0,
        };
        [of(self.plan.first()), of(self.plan.last())]
    }
}

/// Straights, arcs and clothoids of a curve; what is straight all along is one.
fn elements(chain: &ArcChain) -> Vec<PlanElement> {
    let mut elements: Vec<PlanElement> = Vec::new();
    for piece in chain.pieces() {
        let [from, to] = piece.arcs.map(|k| match chain.per_m[k] {
            per_m if per_m.abs() * WIDEST_M < 1.0 => 0.0,
            per_m => per_m,
        });
        let length_m = piece.to_m - piece.from_m;
        let same = |e: &&mut PlanElement| {
            [e.start_per_m, e.end_per_m, from, to]
                .iter()
                .all(|k| (k - from).abs() < 1e-15)
        };
        match elements.last_mut().filter(same) {
            Some(before) => before.length_m += length_m,
            None => elements.push(PlanElement {
                start_per_m: from,
                end_per_m: to,
                ..PlanElement::straight(length_m)
            }),
        }
    }
    elements
}

fn entry(element: &PlanElement, decimals: i32) -> PlanEntry {
    let (from, to) = (element.start_per_m, element.end_per_m);
    let shape = match (from - to).abs() < 1e-15 {
        true if from.abs() * WIDEST_M < 1.0 => PlanShape::Straight {},
        true => PlanShape::Arc {
            radius_m: rounded(1.0 / from.abs(), decimals.min(6)).min(WIDEST_M),
            turn: if from > 0.0 { Side::Left } else { Side::Right },
            cant_mm: 0.0,
        },
        false => PlanShape::Clothoid {},
    };
    PlanEntry {
        length_m: rounded(element.length_m, decimals).max(SHORTEST_M),
        closes: false,
        shape,
    }
}

/// To so many decimals.
pub(in crate::track::import) fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10f64.powi(decimals);
    // Without a zero with a sign.
    (value * scale).round() / scale + 0.0
}

/// From 0 to 360.
fn degrees(heading_rad: f64) -> f64 {
    heading_rad.to_degrees().rem_euclid(360.0)
}
