//! Where tracks meet: the place, direction and curvature that all of them have there.
//!
//! Along the way on which a train runs straight on over switches the line is one smooth curve. It is fitted to the points
//! of the map some way to both sides of each place where tracks meet, and gives the pose there: the legs that diverge
//! begin in it.

use super::joining::{Joined, Meeting};
use crate::track::Direction;
use crate::track::import::fit::{ArcChain, EndPose, EndRule, FitTask, HeadingProfile};
use crate::track::import::plane::{along_m, length_m, turn_rad};
use crate::track::network::TrackEnd;
use nalgebra::Point2;
use std::collections::{BTreeMap, BTreeSet};

/// Of tracks that are longer than twice this, so much is looked at from each end.
const REACH_M: f64 = 200.0;
/// Shorter ways have no curve.
const LEAST_M: f64 = 1.0;
/// Distance of the smooth curve's arcs.
const APART_M: f64 = 12.0;
/// A curve of a larger radius is none.
const STRAIGHT_M: f64 = 2500.0;

/// A pose with the curvature there.
#[derive(Clone, Copy, Debug)]
pub(super) struct BentPose {
    pub pose: EndPose,
    pub per_m: f64,
}

impl BentPose {
    fn turned_round(self) -> Self {
        Self {
            pose: EndPose {
                heading_rad: self.pose.heading_rad + std::f64::consts::PI,
                ..self.pose
            },
            per_m: -self.per_m,
        }
    }
}

/// Of each end at which tracks meet, looking out of its track.
pub(super) fn poses(
    joined: &Joined,
    sigma_m: f64,
    found: &mut FoundWays,
) -> BTreeMap<TrackEnd, BentPose> {
    let mut onward: BTreeMap<TrackEnd, TrackEnd> = BTreeMap::new();
    for (a, b) in joined.meetings.iter().filter_map(Meeting::through) {
        onward.extend([(a, b), (b, a)]);
    }
    let mut poses = BTreeMap::new();
    for way in ways(joined, &onward) {
        way.add_poses(sigma_m, &mut poses, found);
    }
    for meeting in &joined.meetings {
        if let Meeting::Switch(_, [toe, _, diverging]) = meeting
            && let Some(pose) = poses.get(toe).copied()
        {
            poses.insert(*diverging, BentPose::turned_round(pose));
        }
    }
    poses
}

/// A smooth curve and where along it each point is, by the points.
pub(super) type FoundWays = BTreeMap<Vec<[u64; 2]>, Option<(ArcChain, Vec<f64>)>>;

/// Points of a way straight on, and which of them are where tracks meet.
#[derive(Default)]
struct StraightWay {
    points: Vec<Point2<f64>>,
    /// Number of a point, and the ends by which a train leaves one track there and enters the next.
    meetings: Vec<(usize, TrackEnd, TrackEnd)>,
}

/// All ways straight on, each once, cut within long tracks.
fn ways(joined: &Joined, onward: &BTreeMap<TrackEnd, TrackEnd>) -> Vec<StraightWay> {
    let mut ways = Vec::new();
    let mut seen: BTreeSet<TrackEnd> = BTreeSet::new();
    let leaving = |end: &TrackEnd| !onward.contains_key(&end.opposite());
    // From ends first; what is left are rings.
    let starts = onward
        .keys()
        .filter(|end| leaving(end))
        .chain(onward.keys());
    for start in starts {
        if seen.contains(start) {
            continue;
        }
        let mut way = StraightWay::default();
        let mut leaves = Some(*start);
        way.points = last_of(&running(joined, *start));
        while let Some(end) = leaves {
            let Some(entered) = onward.get(&end).copied() else {
                break;
            };
            if !seen.insert(end) {
                break;
            }
            seen.insert(entered);
            way.meetings.push((way.points.len() - 1, end, entered));
            let next = running(joined, entered.opposite());
            match length_m(&next) > 2.0 * REACH_M {
                true => {
                    way.points.extend(first_of(&next).into_iter().skip(1));
                    ways.push(std::mem::take(&mut way));
                    way.points = last_of(&next);
                }
                false => way.points.extend(next.into_iter().skip(1)),
            }
            leaves = Some(entered.opposite());
        }
        if !way.meetings.is_empty() {
            ways.push(way);
        }
    }
    ways
}

/// Points of a track as met by who runs towards an end.
fn running(joined: &Joined, to: TrackEnd) -> Vec<Point2<f64>> {
    let points = &joined.tracks[usize::from(to.track.0)].points;
    match to.way {
        Direction::Up => points.clone(),
        Direction::Down => points.iter().rev().copied().collect(),
    }
}

/// The first points, up to the reach.
fn first_of(points: &[Point2<f64>]) -> Vec<Point2<f64>> {
    let mut along_m = 0.0;
    let mut first = vec![points[0]];
    for pair in points.windows(2) {
        let step = pair[1] - pair[0];
        let long_m = step.norm();
        if along_m + long_m >= REACH_M {
            first.push(pair[0] + step * ((REACH_M - along_m) / long_m));
            break;
        }
        along_m += long_m;
        first.push(pair[1]);
    }
    first
}

fn last_of(points: &[Point2<f64>]) -> Vec<Point2<f64>> {
    let reversed: Vec<_> = points.iter().rev().copied().collect();
    let mut last = first_of(&reversed);
    last.reverse();
    last
}

impl StraightWay {
    fn add_poses(
        &self,
        sigma_m: f64,
        poses: &mut BTreeMap<TrackEnd, BentPose>,
        found: &mut FoundWays,
    ) {
        let task = FitTask {
            points: &self.points,
            rules: [EndRule::default(); 2],
            sigma_m,
        };
        let key = self
            .points
            .iter()
            .map(|p| [p.x, p.y].map(f64::to_bits))
            .collect();
        let is_long = length_m(&self.points) > LEAST_M;
        let smooth = || is_long.then(|| task.smooth(APART_M).ok()).flatten();
        let curve = found.entry(key).or_insert_with(smooth);
        let course = HeadingProfile::of(&self.points);
        let along_m = along_m(&self.points);
        for (point, end, entered) in &self.meetings {
            let near = curve
                .as_ref()
                .map(|(chain, feet)| chain.places(&[feet[*point]])[0].clone());
            let drawn = |at_m: f64| course.heading_rad(at_m);
            let pose = match near {
                // A curve that does not come near its points is none.
                Some(at) if (at.place - self.points[*point]).norm() < 10.0 * sigma_m => BentPose {
                    pose: EndPose {
                        place: at.place,
                        heading_rad: at.heading_rad,
                    },
                    per_m: if at.per_m.abs() * STRAIGHT_M < 1.0 {
                        0.0
                    } else {
                        at.per_m
                    },
                },
                _ => BentPose {
                    pose: EndPose {
                        place: self.points[*point],
                        heading_rad: drawn(along_m[*point]),
                    },
                    per_m: 0.0,
                },
            };
            poses.insert(*end, pose);
            poses.insert(*entered, pose.turned_round());
        }
    }
}

/// What holds at the ends of a track with these points, whose headings go on without a jump of a whole turn.
pub(super) fn rules(
    points: &[Point2<f64>],
    begin: Option<(BentPose, bool)>,
    end: Option<(BentPose, bool)>,
) -> [EndRule; 2] {
    let course = HeadingProfile::of(points);
    let near = |drawn_rad: f64, pose: EndPose| EndPose {
        heading_rad: drawn_rad + turn_rad(drawn_rad, pose.heading_rad),
        ..pose
    };
    let rule = |at_m: f64, given: Option<(BentPose, bool)>| {
        let Some((bent, goes_on)) = given else {
            return EndRule::default();
        };
        EndRule {
            pose: Some(near(course.heading_rad(at_m), bent.pose)),
            per_m: goes_on.then_some(bent.per_m),
            is_kinked: !goes_on,
        }
    };
    [
        rule(
            0.0,
            begin.map(|(pose, goes_on)| (pose.turned_round(), goes_on)),
        ),
        rule(course.length_m, end),
    ]
}
