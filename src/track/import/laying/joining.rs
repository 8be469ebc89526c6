//! From the elements of a map to tracks and what is at their ends.
//!
//! A track of a tunnel file ends at switches, and goes through where it crosses another one: elements that go on as one
//! another there, or anywhere if that is asked for, are one track.

use crate::track::import::{ImportedMap, LeftOut};
use crate::track::network::TrackEnd;
use crate::track::plan::ElementEnd;
use crate::track::{Direction, TrackId};
use nalgebra::Point2;
use std::collections::{BTreeMap, BTreeSet};

/// Joints that are no farther apart are in one place: there tracks cross.
const SAME_M: f64 = 0.05;

/// Elements in the order and the directions in which a track runs over them.
#[derive(Clone, Debug)]
pub(super) struct JoinedTrack {
    pub pieces: Vec<(usize, Direction)>,
    /// From its begin to its end.
    pub points: Vec<Point2<f64>>,
}

/// What is at ends of tracks.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Meeting {
    /// A switch, by its number on the map: toe, through leg, diverging leg.
    Switch(usize, [TrackEnd; 3]),
    /// One goes on as the other.
    Joint(TrackEnd, TrackEnd),
    Buffer(TrackEnd),
    Open(TrackEnd),
}

impl Meeting {
    /// Ends between which the line goes on as one.
    pub fn through(&self) -> Option<(TrackEnd, TrackEnd)> {
        match self {
            Self::Switch(_, [toe, through, _]) => Some((*toe, *through)),
            Self::Joint(a, b) => Some((*a, *b)),
            Self::Buffer(_) | Self::Open(_) => None,
        }
    }

    /// All its ends; a switch's toe is the first.
    pub fn ends(&self) -> Vec<TrackEnd> {
        match self {
            Self::Switch(_, ends) => ends.to_vec(),
            Self::Joint(a, b) => vec![*a, *b],
            Self::Buffer(end) | Self::Open(end) => vec![*end],
        }
    }
}

/// Tracks, and what is at each of their ends.
#[derive(Clone, Debug, Default)]
pub(super) struct Joined {
    pub tracks: Vec<JoinedTrack>,
    pub meetings: Vec<Meeting>,
    /// Pairs of tracks that cross, and where.
    pub crossings: Vec<([usize; 2], Point2<f64>)>,
    pub left_out: Vec<LeftOut>,
}

/// Joins elements to tracks: at crossings, or wherever nothing else meets them.
pub(super) fn joined(map: &ImportedMap, everywhere: bool, dropped: &BTreeSet<usize>) -> Joined {
    let joints = Joints::of(map, dropped);
    let crossings = joints.crossings(map);
    let through: BTreeMap<ElementEnd, ElementEnd> = joints
        .plain
        .iter()
        .filter(|pair| {
            everywhere
                || crossings
                    .iter()
                    .any(|crossing| crossing.pairs.contains(pair))
        })
        .flat_map(|(a, b)| [(*a, *b), (*b, *a)])
        .collect();
    let mut joined = Joined::default();
    let mut ends: BTreeMap<ElementEnd, TrackEnd> = BTreeMap::new();
    let mut of_element: BTreeMap<usize, usize> = BTreeMap::new();
    for element in 0..map.network.elements.len() {
        if of_element.contains_key(&element) || dropped.contains(&element) {
            continue;
        }
        let pieces = run(element, &through);
        let number = joined.tracks.len();
        of_element.extend(pieces.iter().map(|(element, _)| (*element, number)));
        let track = TrackId(u16::try_from(number).unwrap_or(u16::MAX));
        if let (Some((first, way)), Some((last, last_way))) = (pieces.first(), pieces.last()) {
            let begin = ElementEnd {
                element: *first,
                way: way.reversed(),
            };
            let end = ElementEnd {
                element: *last,
                way: *last_way,
            };
            for (element_end, way) in [(begin, Direction::Down), (end, Direction::Up)] {
                ends.insert(element_end, TrackEnd { track, way });
            }
        }
        joined.tracks.push(JoinedTrack {
            points: points(map, &pieces),
            pieces,
        });
    }
    joined.meet(map, &joints, &ends);
    for CrossedJoints { pairs, place } in crossings {
        let tracks = pairs.map(|(a, _)| of_element.get(&a.element).copied());
        if let [Some(first), Some(second)] = tracks
            && first != second
        {
            joined.crossings.push(([first, second], place));
        }
    }
    joined
}

/// Two joints in one place: there tracks cross.
struct CrossedJoints {
    pairs: [(ElementEnd, ElementEnd); 2],
    place: Point2<f64>,
}

/// Where elements meet two by two, and where they meet otherwise.
struct Joints {
    plain: Vec<(ElementEnd, ElementEnd)>,
    /// Ends at which trains run on in ways that are neither a joint nor a switch of the map.
    other: BTreeSet<ElementEnd>,
}

impl Joints {
    fn of(map: &ImportedMap, dropped: &BTreeSet<usize>) -> Self {
        let is_there = |end: &ElementEnd| !dropped.contains(&end.element);
        let parts = map.switches.iter().map(|s| [s.toe, s.through, s.diverging]);
        let switched: BTreeSet<ElementEnd> = parts
            .filter(|parts| parts.iter().all(is_there))
            .flatten()
            .collect();
        let onward = |end: ElementEnd| {
            let next = map.network.onward(end).iter().copied().filter(is_there);
            next.collect::<Vec<_>>()
        };
        let mut joints = Self {
            plain: Vec::new(),
            other: BTreeSet::new(),
        };
        for end in ends(map)
            .filter(is_there)
            .filter(|end| !switched.contains(end))
        {
            match onward(end)[..] {
                [] => {}
                [next] => {
                    let other = next.opposite();
                    let is_plain = onward(other) == [end.opposite()]
                        && !switched.contains(&other)
                        && other != end;
                    if is_plain && end < other {
                        joints.plain.push((end, other));
                    } else if !is_plain {
                        joints.other.insert(end);
                    }
                }
                _ => {
                    joints.other.insert(end);
                }
            }
        }
        joints
    }

    fn crossings(&self, map: &ImportedMap) -> Vec<CrossedJoints> {
        let at = |pair: &(ElementEnd, ElementEnd)| place(map, pair.0);
        let mut order: Vec<usize> = (0..self.plain.len()).collect();
        let x = |k: usize| at(&self.plain[k]).x;
        order.sort_by(|a, b| x(*a).total_cmp(&x(*b)));
        let mut found = Vec::new();
        for (n, k) in order.iter().enumerate() {
            let first = &self.plain[*k];
            let place = at(first);
            let rest = order[n + 1..].iter().map(|k| &self.plain[*k]);
            let mut near = rest.take_while(|pair| at(pair).x - place.x < SAME_M);
            if let Some(second) = near.find(|pair| (at(pair) - place).norm() < SAME_M) {
                found.push(CrossedJoints {
                    pairs: [*first, *second],
                    place,
                });
            }
        }
        found
    }
}

fn ends(map: &ImportedMap) -> impl Iterator<Item = ElementEnd> + '_ {
    (0..map.network.elements.len())
        .flat_map(|element| [Direction::Down, Direction::Up].map(|way| ElementEnd { element, way }))
}

fn place(map: &ImportedMap, end: ElementEnd) -> Point2<f64> {
    let element = &map.network.elements[end.element];
    element
        .at(if end.way == Direction::Up {
            element.length_m()
        } else {
            0.0
        })
        .0
}

/// All elements that go on as one with an element, from the begin to the end.
fn run(element: usize, through: &BTreeMap<ElementEnd, ElementEnd>) -> Vec<(usize, Direction)> {
    // Back to the begin, unless that comes round again.
    let mut begin = ElementEnd {
        element,
        way: Direction::Down,
    };
    while let Some(before) = through.get(&begin) {
        begin = before.opposite();
        if begin.element == element {
            begin = ElementEnd {
                element,
                way: Direction::Down,
            };
            break;
        }
    }
    let mut pieces: Vec<(usize, Direction)> = Vec::new();
    let mut entered = Some(begin);
    while let Some(begin) = entered {
        if pieces.iter().any(|(other, _)| *other == begin.element) {
            break;
        }
        let way = begin.way.reversed();
        pieces.push((begin.element, way));
        entered = through
            .get(&ElementEnd {
                element: begin.element,
                way,
            })
            .copied();
    }
    pieces
}

fn points(map: &ImportedMap, pieces: &[(usize, Direction)]) -> Vec<Point2<f64>> {
    let mut points: Vec<Point2<f64>> = Vec::new();
    for (element, way) in pieces {
        let own: Vec<_> = map.network.elements[*element]
            .points()
            .map(|(p, _)| *p)
            .collect();
        match way {
            Direction::Up => points.extend(own),
            Direction::Down => points.extend(own.into_iter().rev()),
        }
    }
    points.dedup_by(|b, a| (*a - *b).norm() < 1e-6);
    points
}

impl Joined {
    /// What is at the ends of the tracks.
    fn meet(&mut self, map: &ImportedMap, joints: &Joints, ends: &BTreeMap<ElementEnd, TrackEnd>) {
        let mut taken: BTreeSet<TrackEnd> = BTreeSet::new();
        for (number, switch) in map.switches.iter().enumerate() {
            let parts =
                [switch.toe, switch.through, switch.diverging].map(|end| ends.get(&end).copied());
            let [Some(toe), Some(through), Some(diverging)] = parts else {
                continue;
            };
            if [toe, through, diverging]
                .iter()
                .any(|end| taken.contains(end))
                || through == diverging
            {
                let why = "one of its tracks is at another switch with the same end".to_owned();
                self.left_out.push(LeftOut {
                    line: switch.line,
                    what: format!("switch {}", switch.name),
                    why,
                });
                continue;
            }
            taken.extend([toe, through, diverging]);
            self.meetings
                .push(Meeting::Switch(number, [toe, through, diverging]));
        }
        for (a, b) in &joints.plain {
            if let (Some(a), Some(b)) = (ends.get(a), ends.get(b)) {
                taken.extend([*a, *b]);
                self.meetings.push(Meeting::Joint(*a, *b));
            }
        }
        for (end, track_end) in ends.iter().filter(|(_, end)| !taken.contains(end)) {
            let is_buffer = map.along[end.element].buffers[usize::from(end.way == Direction::Up)];
            self.meetings.push(match is_buffer {
                true => Meeting::Buffer(*track_end),
                false => Meeting::Open(*track_end),
            });
            if joints.other.contains(end) {
                let id = &map.network.elements[end.element].id;
                let why = "it goes on over a slip or points with more than two legs, which a tunnel file does not have: it ends there";
                let what = format!("end of element {id}");
                self.left_out.push(LeftOut {
                    line: map.along[end.element].line,
                    what,
                    why: why.to_owned(),
                });
            }
        }
    }
}
