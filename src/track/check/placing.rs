//! Tracks of a network to their places in the world: each begins where it says itself, or where what it is joined
//! to ends.

use super::joints::{Joints, key_of, word_of};
use super::line::UnplacedLine;
use crate::settings::Checker;
use crate::track::file::TrackEntry;
use crate::track::network::{
    Joint, MOST_GAP_M, MOST_KINK_RAD, Switch, TrackEnd, leaving, turned_round,
};
use crate::track::{Alignment, Direction, TrackFrame, TrackId};
use nalgebra::{DMatrix, DVector, Dyn, Point3, Rotation2, SVD, Vector2};
use std::collections::{BTreeMap, VecDeque};

/// Steps of the search for the lengths that close.
const MOST_STEPS: usize = 20;
/// A length is found when a step changes it by less.
const FOUND_M: f64 = 1e-10;
/// Change of a length by which its effect is measured.
const TRIAL_M: f64 = 1e-3;

/// What a track's place follows from.
#[derive(Clone, Copy, Debug)]
enum Anchor {
    /// Its own `start`, or the world's origin.
    Start,
    /// It begins where a train goes that leaves another track at this end, or comes from beside it.
    Begin(TrackEnd, Side),
    /// It ends there.
    End(TrackEnd, Side),
}

/// How two ends that meet lie.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Side {
    /// A train runs from one to the other.
    Opposite,
    /// Both are legs of one switch.
    Same,
}

/// The order in which tracks are placed.
pub(super) struct Order(Vec<(TrackId, Anchor)>);

impl Order {
    /// From the tracks with a `start` over the joints to all others. None where some are not come to, with a problem
    /// for one of those that are joined together.
    pub(super) fn of(
        tracks: &[TrackEntry],
        joints: &Joints,
        check: &mut Checker<'_>,
    ) -> Option<Self> {
        let meet = meeting(joints);
        let mut order: Vec<(TrackId, Anchor)> = Vec::new();
        let mut anchored = vec![false; tracks.len()];
        let alone = tracks.len() == 1;
        let mut queue = VecDeque::new();
        for (k, track) in tracks.iter().enumerate() {
            if track.start.is_some() || alone {
                anchored[k] = true;
                queue.push_back((TrackId(k as u16), Anchor::Start));
            }
        }
        while let Some((track, anchor)) = queue.pop_front() {
            order.push((track, anchor));
            for way in [Direction::Down, Direction::Up] {
                let end = TrackEnd { track, way };
                for (other, side) in meet.get(&end).into_iter().flatten() {
                    let k = usize::from(other.track.0);
                    if !std::mem::replace(&mut anchored[k], true) {
                        let anchor = match other.way {
                            Direction::Down => Anchor::Begin(end, *side),
                            Direction::Up => Anchor::End(end, *side),
                        };
                        queue.push_back((other.track, anchor));
                    }
                }
            }
        }
        let are_placed = order.len() == tracks.len();
        for k in 0..tracks.len() {
            if !anchored[k] {
                check.problem(
                    &format!("track[{k}].from"),
                    "nothing says where this track is: it has no `start`, and is joined to no track that has a place",
                    "give it a `start`, or join it by `from` or `to` to a track that has a place",
                );
                mark_joined(TrackId(k as u16), &meet, &mut anchored);
            }
        }
        are_placed.then_some(Self(order))
    }

    /// The tracks at their places; those that have none lie at the world's origin.
    pub(super) fn place(&self, tracks: &[TrackEntry], courses: &[UnplacedLine]) -> Vec<Alignment> {
        let nowhere = |course: &UnplacedLine| course.from(Point3::origin(), 0.0, 0.0);
        let mut lines: Vec<Alignment> = courses.iter().map(nowhere).collect();
        for (track, anchor) in &self.0 {
            let k = usize::from(track.0);
            let course = &courses[k];
            let pose = |end: TrackEnd, side| {
                let out = leaving(&lines[usize::from(end.track.0)], end.way);
                match side {
                    Side::Opposite => out,
                    Side::Same => turned_round(&out),
                }
            };
            lines[k] = match *anchor {
                Anchor::Start => {
                    let start = tracks[k].start.clone().unwrap_or_default();
                    let origin = Point3::new(start.east_m, start.north_m, start.up_m);
                    course.from(origin, start.heading_deg.to_radians(), 0.0)
                }
                Anchor::Begin(end, side) => {
                    let pose = pose(end, side);
                    course.from(pose.origin, pose.heading_rad, pose.slope)
                }
                Anchor::End(end, side) => ending_at(course, &turned_round(&pose(end, side))),
            };
        }
        lines
    }
}

/// The line that ends at a pose.
fn ending_at(course: &UnplacedLine, pose: &TrackFrame) -> Alignment {
    let trial = course.from(Point3::origin(), 0.0, pose.slope);
    let end = trial.at(trial.length_m());
    let heading_rad = pose.heading_rad - end.heading_rad;
    let way = Rotation2::new(heading_rad) * end.origin.xy().coords;
    let begin = pose.origin.xy() - way;
    let up_m = pose.origin.z - end.origin.z;
    course.from(Point3::new(begin.x, begin.y, up_m), heading_rad, pose.slope)
}

/// All ends that meet each end.
type Meeting = BTreeMap<TrackEnd, Vec<(TrackEnd, Side)>>;

/// The tracks with a `start` that begin at a joint, and so where another track with a `start` has them.
pub(super) fn placed_twice(tracks: &[TrackEntry], joints: &Joints) -> Vec<usize> {
    let meet = meeting(joints);
    let with_start = (0..tracks.len()).filter(|k| tracks[*k].start.is_some());
    let begins_at_joint = |k: &usize| {
        let begin = TrackEnd {
            track: TrackId(*k as u16),
            way: Direction::Down,
        };
        tracks[*k].from.is_some() && meet.contains_key(&begin)
    };
    let (joined, first): (Vec<usize>, Vec<usize>) = with_start.partition(begins_at_joint);
    let mut placed = vec![false; tracks.len()];
    for k in first {
        mark_joined(TrackId(k as u16), &meet, &mut placed);
    }
    let mut twice = Vec::new();
    for k in joined {
        match placed[k] {
            true => twice.push(k),
            false => mark_joined(TrackId(k as u16), &meet, &mut placed),
        }
    }
    twice
}

/// Marks a track and all that are joined to it.
fn mark_joined(track: TrackId, meet: &Meeting, marked: &mut [bool]) {
    let mut open = vec![track];
    while let Some(track) = open.pop() {
        if !std::mem::replace(&mut marked[usize::from(track.0)], true) {
            let ends = [Direction::Down, Direction::Up].map(|way| TrackEnd { track, way });
            let others = ends.iter().filter_map(|end| meet.get(end)).flatten();
            open.extend(others.map(|(other, _)| other.track));
        }
    }
}

fn meeting(joints: &Joints) -> Meeting {
    let mut meet = Meeting::new();
    let mut add = |a: TrackEnd, b: TrackEnd, side| {
        meet.entry(a).or_default().push((b, side));
        meet.entry(b).or_default().push((a, side));
    };
    for (a, b) in joints.pairs() {
        add(a, b, Side::Opposite);
    }
    for Switch {
        through, diverging, ..
    } in &joints.switches
    {
        add(*through, *diverging, Side::Same);
    }
    meet
}

/// Solves for the lengths of elements that close, together: so that ends that meet are in one place in plan, as
/// near as may be. Gauss and Newton's method; lengths that nothing decides keep theirs.
pub(super) fn close(
    tracks: &[TrackEntry],
    joints: &Joints,
    order: &Order,
    courses: &mut [UnplacedLine],
    check: &mut Checker<'_>,
) {
    let closing: Vec<(usize, usize)> = (tracks.iter().enumerate())
        .flat_map(|(k, track)| {
            let elements = track.plan.iter().enumerate();
            let closing = elements.filter(|(_, element)| element.closes);
            closing.map(move |(j, _)| (k, j))
        })
        .collect();
    if closing.is_empty() {
        return;
    }
    let gaps = |courses: &[UnplacedLine]| {
        let lines = order.place(tracks, courses);
        let at = |end: TrackEnd| {
            leaving(&lines[usize::from(end.track.0)], end.way)
                .origin
                .xy()
        };
        let gaps = joints.pairs().map(|(a, b)| at(a) - at(b));
        let gaps: Vec<Vector2<f64>> = gaps.collect();
        // At least as many rows as lengths: so all directions of lengths come out of the decomposition.
        let rows = (2 * gaps.len()).max(closing.len());
        let mut all = DVector::zeros(rows);
        for (k, gap) in gaps.iter().enumerate() {
            all.fixed_rows_mut::<2>(2 * k).copy_from(gap);
        }
        all
    };
    for step in 0..MOST_STEPS {
        let now = gaps(courses);
        let mut effects = DMatrix::zeros(now.len(), closing.len());
        for (column, (k, j)) in closing.iter().enumerate() {
            let length_m = courses[*k].elements[*j].length_m;
            courses[*k].elements[*j].length_m = length_m + TRIAL_M;
            effects.set_column(column, &((gaps(courses) - &now) / TRIAL_M));
            courses[*k].elements[*j].length_m = length_m;
        }
        // Lengths that are no numbers have their problem already.
        if !effects.iter().chain(&now).all(|x| x.is_finite()) {
            return;
        }
        let svd = effects.svd(true, true);
        if step == 0 {
            check_decided(&svd, &closing, check);
        }
        let Ok(steps) = svd.solve(&-now, LEAST_EFFECT) else {
            return;
        };
        for ((k, j), step) in closing.iter().zip(steps.iter()) {
            courses[*k].elements[*j].length_m += step;
        }
        if steps.amax() < FOUND_M {
            break;
        }
    }
    for (k, j) in closing {
        let length_m = courses[k].elements[j].length_m;
        if length_m < TRIAL_M {
            check.problem(
                &format!("track[{k}].plan[{j}].length_m"),
                format!("to close, it would have to be {length_m:.4} m long"),
                "move the ends that it joins apart, or change the elements beside it",
            );
        }
    }
}

/// A step of a rail's head that is no more than the gap that is allowed.
const MOST_CANT_STEP_M: f64 = MOST_GAP_M;

/// A length that moves no end by more than this share of itself is decided by none.
const LEAST_EFFECT: f64 = 1e-6;

/// A problem for lengths that could change together without any end moving away from another.
fn check_decided(svd: &SVD<f64, Dyn, Dyn>, closing: &[(usize, usize)], check: &mut Checker<'_>) {
    let Some(directions) = &svd.v_t else {
        return;
    };
    let without_effect = |row: &usize| {
        let value = svd.singular_values.get(*row);
        value.is_none_or(|value| *value < LEAST_EFFECT)
    };
    for row in (0..directions.nrows()).filter(without_effect) {
        for ((k, j), share) in closing.iter().zip(directions.row(row).iter()) {
            if share.abs() > LEAST_EFFECT {
                check.problem(
                    &format!("track[{k}].plan[{j}].closes"),
                    "no joint decides this length: it could change together with others, and all would still meet",
                    "take `closes` out of it, or out of one of the others",
                );
            }
        }
    }
}

/// Problems of ends that meet in the file and not in the world.
pub(super) fn check_joints(
    tracks: &[TrackEntry],
    joints: &Joints,
    lines: &[Alignment],
    check: &mut Checker<'_>,
) {
    for (a, b) in joints.pairs() {
        let [out, back] = [a, b].map(|end| leaving(&lines[usize::from(end.track.0)], end.way));
        let joint = Joint::of(&out, &back);
        let [here, there] = [a, b].map(|end| word_of(end, tracks));
        let problem = if joint.gap_m.norm() > MOST_GAP_M {
            let [ahead_m, left_m, up_m] = joint.gap_m.into();
            Some((
                format!(
                    "`{there}` is {ahead_m:.4} m ahead of `{here}`, {left_m:.4} m to the left and {up_m:.4} m above"
                ),
                "change a length by that, or let one be solved for by `closes = true`",
            ))
        } else if joint.kink_rad() > MOST_KINK_RAD {
            Some((
                format!(
                    "the line has a kink at `{here}`: {:.4} deg in plan, {:.3} permille in the profile",
                    joint.turn_rad.to_degrees(),
                    1e3 * joint.slope_step
                ),
                "let both have one direction and one grade there",
            ))
        } else if joint.cant_step_m.abs() > MOST_CANT_STEP_M {
            let step_mm = 1e3 * joint.cant_step_m.abs();
            let what = format!("the cant jumps by {step_mm:.1} mm at `{here}`");
            Some((what, "let both have one cant there"))
        } else {
            None
        };
        if let Some((what, remedy)) = problem {
            check.problem(&key_of(a), what, remedy);
        }
    }
}
