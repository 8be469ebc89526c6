//! A plan for tracks of which only lengths and joints are known.
//!
//! Tracks that are run straight on through their switches are one line, drawn in a row of its own, along x by their
//! lengths; rows lie side by side by a usual distance of tracks, a leg on the side on which it leaves. From its switch
//! to its row a leg goes straight. An element is as long as stated: one whose ends are nearer to each other than its
//! length is drawn with a corner aside. Only where its ends are farther apart than its length is it longer.
//!
//! This gives a graph with joints at one place, and right lengths. It does not tell where anything is: directions,
//! curves and distances between tracks mean nothing; tracks may cross that do not, and those of a crossing may not.
//! Drawings in the file are not used.

use super::draft::{CutEnd, Draft, DraftPlan, ElementShape};
use crate::track::Direction;
use crate::track::import::plane::length_m;
use nalgebra::{Point2, Vector2};
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// From row to row.
const ROW_M: f64 = 4.5;
/// A track that leaves a row and comes back to it does so within this, or a third of its length.
const RAMP_M: f64 = 60.0;
/// An element may be so much shorter in plan without a corner, metres.
const SHORT_M: f64 = 0.5;
/// Rows are looked through this far for a free one.
const MOST_ROWS: i64 = 200;
/// Lines in a row are apart by this, metres.
const GAP_M: f64 = 1.0;

/// Lays out all tracks.
pub(super) fn lay_out(draft: &Draft<'_>) -> DraftPlan {
    let mut sketch = Sketch::new(draft);
    sketch.draw();
    DraftPlan {
        datum: None,
        shapes: sketch.shapes(draft),
        checks: Vec::new(),
        turn: draft.turns_are_known.then_some(1.0),
    }
}

/// An element, or the end of one that is reached by running this way.
type LaidEnd = (usize, Direction);

/// A line that is still to be drawn.
struct LineEntry {
    /// By which end it is reached.
    end: LaidEnd,
    x_m: f64,
    /// Along x from that end on: 1, or against it: -1.
    along: f64,
    from_row: i64,
    /// Row above: 1, or below: -1.
    side: i64,
}

/// What is known and drawn of each element.
struct Sketch {
    lengths_m: Vec<f64>,
    /// By both ends: joined ends.
    joined: BTreeMap<LaidEnd, Vec<LaidEnd>>,
    /// The one end that is run to straight on.
    onward: BTreeMap<LaidEnd, LaidEnd>,
    /// Joints over which a train leaves a switch by its other leg: whether to the left.
    diverging: BTreeMap<(LaidEnd, LaidEnd), bool>,
    node_of: BTreeMap<LaidEnd, LaidEnd>,
    nodes: BTreeMap<LaidEnd, Point2<f64>>,
    /// Nodes that a line passes, in whose row they are.
    passed: BTreeSet<LaidEnd>,
    rows_of: Vec<Option<i64>>,
    taken: BTreeMap<i64, BTreeMap<i64, i64>>,
}

impl Sketch {
    fn new(draft: &Draft<'_>) -> Self {
        let firsts = draft.first_elements();
        let number = |end: CutEnd| {
            (
                firsts.get(end.track).copied().unwrap_or(0) + end.piece,
                end.way,
            )
        };
        let lengths = draft.tracks.iter().flat_map(|track| {
            (0..track.pieces()).map(|piece| {
                let [from_m, to_m] = track.bounds(piece);
                to_m - from_m
            })
        });
        let lengths_m: Vec<f64> = lengths.collect();
        let joints: Vec<(LaidEnd, LaidEnd)> = draft
            .all_joints()
            .map(|(a, b)| (number(a), number(b)))
            .collect();
        let mut sketch = Self {
            rows_of: vec![None; lengths_m.len()],
            lengths_m,
            joined: BTreeMap::new(),
            onward: BTreeMap::new(),
            diverging: BTreeMap::new(),
            node_of: BTreeMap::new(),
            nodes: BTreeMap::new(),
            passed: BTreeSet::new(),
            taken: BTreeMap::new(),
        };
        for switch in &draft.switches {
            let [toe, through, leg] = [switch.toe, switch.through, switch.diverging].map(number);
            sketch.run_on(toe, through);
            sketch.diverging.insert((toe, leg), switch.diverges_left);
            sketch.diverging.insert((leg, toe), switch.diverges_left);
        }
        for (a, b) in &joints {
            sketch.run_on(*a, *b);
            for (from, onto) in [(*a, *b), (*b, *a)] {
                sketch.joined.entry(from).or_default().push(onto);
            }
        }
        sketch.find_nodes();
        sketch
    }

    fn run_on(&mut self, a: LaidEnd, b: LaidEnd) {
        let is_leg = self.diverging.contains_key(&(a, b));
        if a != b && !is_leg && !self.onward.contains_key(&a) && !self.onward.contains_key(&b) {
            self.onward.insert(a, b);
            self.onward.insert(b, a);
        }
    }

    /// All ends that are joined, over others too, are one place.
    fn find_nodes(&mut self) {
        for element in 0..self.lengths_m.len() {
            for way in [Direction::Down, Direction::Up] {
                let first = (element, way);
                let mut open = vec![first];
                while let Some(end) = open.pop() {
                    if self.node_of.contains_key(&end) {
                        continue;
                    }
                    self.node_of.insert(end, first);
                    open.extend(self.joined.get(&end).into_iter().flatten());
                }
            }
        }
    }

    fn length_m(&self, element: usize) -> f64 {
        self.lengths_m.get(element).copied().unwrap_or(0.0)
    }

    fn node(&self, end: LaidEnd) -> Option<Point2<f64>> {
        self.nodes.get(self.node_of.get(&end)?).copied()
    }

    /// Puts an end where it is not put yet; the first line that passes it takes it into its row.
    fn place(&mut self, end: LaidEnd, place: Point2<f64>) -> Point2<f64> {
        let Some(node) = self.node_of.get(&end) else {
            return place;
        };
        let found = self.nodes.entry(*node).or_insert(place);
        if self.onward.contains_key(&end) && self.passed.insert(*node) {
            found.y = place.y;
        }
        *found
    }

    fn draw(&mut self) {
        for element in 0..self.lengths_m.len() {
            let mut open = VecDeque::new();
            if self.rows_of.get(element).is_some_and(Option::is_none) {
                let top = self.taken.last_key_value().map_or(-2, |(row, _)| *row);
                open.push_back(LineEntry {
                    end: (element, Direction::Down),
                    x_m: 0.0,
                    along: 1.0,
                    from_row: top + 1,
                    side: 1,
                });
            }
            while let Some(entry) = open.pop_front() {
                if self.rows_of.get(entry.end.0).is_some_and(Option::is_none) {
                    self.draw_line(&entry, &mut open);
                }
            }
        }
    }

    /// Elements that are run one after the other from an end on, each by the end by which it is entered.
    fn run(&self, from: LaidEnd) -> Vec<LaidEnd> {
        let mut run = vec![from];
        let mut end = from;
        while let Some(next) = self.onward.get(&opposite(end)) {
            if *next == from || run.len() > self.lengths_m.len() {
                break;
            }
            run.push(*next);
            end = *next;
        }
        run
    }

    fn draw_line(&mut self, entry: &LineEntry, open: &mut VecDeque<LineEntry>) {
        let ahead = self.run(entry.end);
        // A ring is run ahead alone.
        let is_ring = ahead
            .last()
            .is_some_and(|last| self.onward.get(&opposite(*last)) == Some(&entry.end));
        let before = self.onward.get(&entry.end).filter(|_| !is_ring);
        let behind = before.map(|before| self.run(*before)).unwrap_or_default();
        let sum_m = |run: &[LaidEnd]| -> f64 { run.iter().map(|end| self.length_m(end.0)).sum() };
        let [far_m, near_m] = [
            entry.x_m + entry.along * sum_m(&ahead),
            entry.x_m - entry.along * sum_m(&behind),
        ];
        let row = self.free_row(entry, [far_m.min(near_m), far_m.max(near_m)]);
        for (run, along) in [(ahead, entry.along), (behind, -entry.along)] {
            let mut x_m = entry.x_m;
            for end in run {
                if let Some(place) = self.rows_of.get_mut(end.0) {
                    *place = Some(row);
                }
                let y_m = row as f64 * ROW_M;
                let before = self.place(end, Point2::new(x_m, y_m));
                let aside_m = y_m - before.y;
                x_m = before.x
                    + along
                        * (self.length_m(end.0).powi(2) - aside_m * aside_m)
                            .max(0.0)
                            .sqrt();
                let exit = opposite(end);
                x_m = self.place(exit, Point2::new(x_m, y_m)).x;
                self.leave(exit, (x_m, along, row), open);
                self.leave(end, (before.x, -along, row), open);
            }
        }
    }

    /// Other lines that begin where this one has an end.
    fn leave(
        &self,
        end: LaidEnd,
        (x_m, along, from_row): (f64, f64, i64),
        open: &mut VecDeque<LineEntry>,
    ) {
        for next in self.joined.get(&end).into_iter().flatten() {
            if self.rows_of.get(next.0).is_none_or(Option::is_some) {
                continue;
            }
            let is_left = self.diverging.get(&(end, *next)).copied().unwrap_or(true);
            open.push_back(LineEntry {
                end: *next,
                x_m,
                along,
                from_row,
                side: if is_left == (along > 0.0) { 1 } else { -1 },
            });
        }
    }

    /// The nearest row on a side that is free for a stretch of x, which is taken.
    fn free_row(&mut self, entry: &LineEntry, [from_m, to_m]: [f64; 2]) -> i64 {
        let (from, to) = ((from_m - GAP_M) as i64, (to_m + GAP_M) as i64);
        let is_free = |row: &i64| {
            self.taken.get(row).is_none_or(|taken| {
                let before = taken.range(..to).next_back();
                before.is_none_or(|(_, end)| *end <= from)
            })
        };
        let mut rows = (1..=MOST_ROWS).map(|k| entry.from_row + k * entry.side);
        let free = rows.find(is_free);
        let row = free.unwrap_or_else(|| {
            let lowest = self.taken.first_key_value().map_or(0, |(row, _)| *row);
            let highest = self.taken.last_key_value().map_or(0, |(row, _)| *row);
            if entry.side > 0 {
                highest + 1
            } else {
                lowest - 1
            }
        });
        self.taken.entry(row).or_default().insert(from, to);
        row
    }

    fn shapes(&self, draft: &Draft<'_>) -> Vec<Vec<ElementShape>> {
        let mut element = 0;
        let mut shape = |[from_m, to_m]: [f64; 2]| {
            let points = self.points(element, to_m - from_m);
            element += 1;
            ElementShape {
                stations: vec![(from_m, 0.0), (to_m, length_m(&points))],
                points,
            }
        };
        let tracks = draft.tracks.iter();
        tracks
            .map(|track| {
                (0..track.pieces())
                    .map(|k| shape(track.bounds(k)))
                    .collect()
            })
            .collect()
    }

    fn points(&self, element: usize, length_m: f64) -> Vec<Point2<f64>> {
        let ends = [Direction::Down, Direction::Up].map(|way| self.node((element, way)));
        let [Some(a), Some(b)] = ends else {
            return Vec::new();
        };
        let row = self.rows_of.get(element).copied().flatten().unwrap_or(0);
        let y_m = row as f64 * ROW_M;
        let along = b.x - a.x;
        let ramp = along.signum() * RAMP_M.min(along.abs() / 3.0);
        let leaves_row =
            (a.y - b.y).abs() < 1.0 && (a.y - y_m).abs() > 1.0 && along.abs() > 3.0 * ROW_M;
        if leaves_row && length_m - along.abs() < ROW_M {
            return vec![
                a,
                Point2::new(a.x + ramp, y_m),
                Point2::new(b.x - ramp, y_m),
                b,
            ];
        }
        let chord = b - a;
        let chord_m = chord.norm();
        if length_m - chord_m <= SHORT_M {
            return vec![a, b];
        }
        let left = match chord_m > 0.0 {
            true => Vector2::new(-chord.y, chord.x) / chord_m,
            false => Vector2::y(),
        };
        let side = if (y_m - a.y) * left.y < 0.0 {
            -1.0
        } else {
            1.0
        };
        let aside_m = (length_m * length_m - chord_m * chord_m).max(0.0).sqrt() / 2.0;
        vec![a, a + chord / 2.0 + left * (side * aside_m), b]
    }
}

fn opposite((element, way): LaidEnd) -> LaidEnd {
    (element, way.reversed())
}
