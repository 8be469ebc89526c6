//! Tracks as read from a file of either version, before they are drawn and cut into elements.

use super::place::KnownPlace;
use super::xml::Item;
use crate::track::Direction;
use crate::track::geodesy::Datum;
use crate::track::import::{AlongElement, MapStep, PlanCheck};
use nalgebra::Point2;

/// A file's tracks.
pub(super) struct Draft<'a> {
    pub(super) tracks: Vec<DraftTrack<'a>>,
    /// Ends between which trains run; the cuts of a track need not be named.
    pub(super) joints: Vec<(CutEnd, CutEnd)>,
    pub(super) switches: Vec<DraftSwitch>,
    /// Whether the file says which way a positive curvature turns: to the left, then.
    pub(super) turns_are_known: bool,
}

/// A track, and where it is cut into elements.
pub(super) struct DraftTrack<'a> {
    pub(super) item: Item<'a>,
    pub(super) id: String,
    pub(super) length_m: f64,
    /// In their order, between 0 and its length, metres.
    pub(super) cuts: Vec<f64>,
    /// Known places that it runs through.
    pub(super) places: Vec<KnownPlace<'a>>,
    /// Known places beside it, as those of signals.
    pub(super) beside: Vec<KnownPlace<'a>>,
    /// By the distance along it as stated.
    pub(super) along: AlongElement,
    /// What states its curvatures in the file.
    pub(super) curves: Vec<Item<'a>>,
    /// Whether stated places along it count towards smaller mileage.
    pub(super) counts_down: bool,
}

/// An end of a piece of a track between cuts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct CutEnd {
    pub(super) track: usize,
    /// From 0.
    pub(super) piece: usize,
    pub(super) way: Direction,
}

/// A switch, by pieces of tracks.
pub(super) struct DraftSwitch {
    pub(super) name: String,
    pub(super) line: usize,
    pub(super) toe: CutEnd,
    pub(super) through: CutEnd,
    pub(super) diverging: CutEnd,
    pub(super) diverging_kmh: Option<f64>,
    /// Whether the other leg leaves to the left, seen from the toe.
    pub(super) diverges_left: bool,
}

/// An element in plan.
pub(super) struct ElementShape {
    pub(super) points: Vec<Point2<f64>>,
    /// Places as stated along the track, and along the points.
    pub(super) stations: Vec<(f64, f64)>,
}

/// Where all elements are, by track.
pub(super) struct DraftPlan {
    /// None: laid out.
    pub(super) datum: Option<Datum>,
    pub(super) shapes: Vec<Vec<ElementShape>>,
    /// By track and stated place; the element is found later.
    pub(super) checks: Vec<(usize, f64, PlanCheck)>,
    /// By what stated curvatures are multiplied, so that those to the left are positive; none where nothing tells.
    pub(super) turn: Option<f64>,
}

impl DraftTrack<'_> {
    /// From cut to cut.
    pub(super) fn bounds(&self, piece: usize) -> [f64; 2] {
        let from = piece.checked_sub(1).and_then(|k| self.cuts.get(k));
        let to = self.cuts.get(piece);
        [
            from.copied().unwrap_or(0.0),
            to.copied().unwrap_or(self.length_m),
        ]
    }

    /// Steps of its curvature, none where none are stated.
    pub(super) fn curvatures(&self) -> Option<&[MapStep]> {
        let steps = self.along.curvatures_per_m.as_slice();
        (!steps.is_empty()).then_some(steps)
    }

    pub(super) fn pieces(&self) -> usize {
        self.cuts.len() + 1
    }
}

impl CutEnd {
    /// Along its track as stated, metres.
    pub(super) fn at_m(self, tracks: &[DraftTrack<'_>]) -> f64 {
        let bounds = tracks.get(self.track).map(|track| track.bounds(self.piece));
        let [from_m, to_m] = bounds.unwrap_or([0.0; 2]);
        match self.way {
            Direction::Down => from_m,
            Direction::Up => to_m,
        }
    }
}

impl ElementShape {
    /// How far along its points a stated place is.
    pub(super) fn along_m(&self, at_m: f64) -> f64 {
        let after = self.stations.partition_point(|station| station.0 <= at_m);
        let before = after.checked_sub(1).and_then(|k| self.stations.get(k));
        match (before, self.stations.get(after)) {
            (Some((a, along_a)), Some((b, along_b))) => {
                along_a + (along_b - along_a) * (at_m - a) / (b - a)
            }
            (Some((_, along)), None) | (None, Some((_, along))) => *along,
            (None, None) => 0.0,
        }
    }
}

impl Draft<'_> {
    /// Number of each track's first element: pieces of tracks are elements, in the order of the file.
    pub(super) fn first_elements(&self) -> Vec<usize> {
        let mut next = 0;
        let first = |track: &DraftTrack<'_>| {
            let first = next;
            next += track.pieces();
            first
        };
        self.tracks.iter().map(first).collect()
    }

    /// All joints: those of the file, and each track's own at its cuts.
    pub(super) fn all_joints(&self) -> impl Iterator<Item = (CutEnd, CutEnd)> {
        let own = self.tracks.iter().enumerate().flat_map(|(track, drawn)| {
            let end = move |piece, way| CutEnd { track, piece, way };
            (1..drawn.pieces()).map(move |k| (end(k - 1, Direction::Up), end(k, Direction::Down)))
        });
        own.chain(self.joints.iter().copied())
    }
}
