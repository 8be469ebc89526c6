//! A network in plan: elements of joined straights, and where trains run on from one to the next.
//!
//! This is what maps of others have in common (railML's net elements and relations, OpenStreetMap's ways), and what
//! it takes to say on which track a train is. It has no cross-sections, no lamps, no gradients.
//!
//! ```
//! use metrotwin::track::Direction;
//! use metrotwin::track::plan::{ElementEnd, PlanNetwork, TrackElement};
//! use nalgebra::Point2;
//!
//! // A straight that parts into two.
//! let element = |id: &str, points: &[[f64; 2]]| {
//!     TrackElement::new(id, points.iter().map(|p| Point2::from(*p)).collect())
//! };
//! let elements = vec![
//!     element("stem", &[[0.0, 0.0], [100.0, 0.0]]).unwrap(),
//!     element("left", &[[100.0, 0.0], [150.0, 5.0]]).unwrap(),
//!     element("right", &[[100.0, 0.0], [150.0, 0.0]]).unwrap(),
//! ];
//! let end = |element, way| ElementEnd { element, way };
//! let (up, down) = (Direction::Up, Direction::Down);
//! let joints = [(end(0, up), end(1, down)), (end(0, up), end(2, down))];
//! let network = PlanNetwork::new(None, elements, &joints);
//! assert_eq!(network.onward(end(0, up)).len(), 2);
//! assert_eq!(network.onward(end(2, down)), [end(0, down)]);
//! ```

mod geojson;
mod grid;
mod of_network;

pub use geojson::GeoJsonError;

use super::Direction;
use super::geodesy::Datum;
use grid::Grid;
use nalgebra::{Point2, Vector2};

/// The nearest element is looked for within this first, metres.
const FIRST_LOOK_M: f64 = 30.0;

/// A stretch of track between two joints.
#[derive(Clone, Debug)]
pub struct TrackElement {
    /// As on the map.
    pub id: String,
    /// World x and y, metres; neighbours differ.
    points: Vec<Point2<f64>>,
    /// Of each point, along the element, metres.
    along_m: Vec<f64>,
}

/// An end of an element: the one that is reached by running this way along it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ElementEnd {
    /// By number.
    pub element: usize,
    /// Up to its last point, or down to its first.
    pub way: Direction,
}

/// A place of an element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElementPlace {
    /// By number.
    pub element: usize,
    /// From its first point, metres.
    pub along_m: f64,
}

/// Elements and their joints.
#[derive(Clone, Debug)]
pub struct PlanNetwork {
    /// Where on the earth it is, if that is known.
    pub datum: Option<Datum>,
    /// By number.
    pub elements: Vec<TrackElement>,
    /// By element: what is run after its first point, and after its last one.
    onward: Vec<[Vec<ElementEnd>; 2]>,
    grid: Grid,
}

impl TrackElement {
    /// Through points; none where these are no line.
    pub fn new(id: &str, mut points: Vec<Point2<f64>>) -> Option<Self> {
        points.dedup_by(|b, a| *a == *b);
        let finite = points.iter().all(|p| p.x.is_finite() && p.y.is_finite());
        if points.len() < 2 || !finite {
            return None;
        }
        let mut along_m = vec![0.0];
        for pair in points.windows(2) {
            along_m.push(along_m[along_m.len() - 1] + (pair[1] - pair[0]).norm());
        }
        Some(Self {
            id: id.to_owned(),
            points,
            along_m,
        })
    }

    /// From its first to its last point.
    pub fn length_m(&self) -> f64 {
        self.along_m[self.along_m.len() - 1]
    }

    /// Its points, and how far along it each is.
    pub fn points(&self) -> impl ExactSizeIterator<Item = (&Point2<f64>, f64)> {
        self.points.iter().zip(self.along_m.iter().copied())
    }

    /// Where a place along it is, and the unit vector up along it there. Beyond its ends it goes straight on.
    pub fn at(&self, along_m: f64) -> (Point2<f64>, Vector2<f64>) {
        let last = self.points.len() - 2;
        let piece = (self.along_m.partition_point(|m| *m <= along_m)).saturating_sub(1);
        let k = piece.min(last);
        let forward =
            (self.points[k + 1] - self.points[k]) / (self.along_m[k + 1] - self.along_m[k]);
        (
            self.points[k] + forward * (along_m - self.along_m[k]),
            forward,
        )
    }

    /// Its straights that touch a stretch of it: the begin, how far along that is, unit vector and length of each.
    pub fn straights(
        &self,
        [from_m, to_m]: [f64; 2],
    ) -> impl Iterator<Item = (Point2<f64>, f64, Vector2<f64>, f64)> + '_ {
        let count = self.points.len() - 1;
        let first = self
            .along_m
            .partition_point(|m| *m <= from_m)
            .saturating_sub(1);
        (first.min(count - 1)..count)
            .take_while(move |k| *k == first || self.along_m[*k] <= to_m)
            .map(|k| {
                let length_m = self.along_m[k + 1] - self.along_m[k];
                let forward = (self.points[k + 1] - self.points[k]) / length_m;
                (self.points[k], self.along_m[k], forward, length_m)
            })
    }
}

impl ElementEnd {
    /// The other end of its element: a train that enters there runs towards this one.
    #[must_use]
    pub fn opposite(self) -> Self {
        Self {
            way: self.way.reversed(),
            ..self
        }
    }
}

impl PlanNetwork {
    /// Elements, with the pairs of their ends at which trains run from one onto the other. A pair may be named twice.
    pub fn new(
        datum: Option<Datum>,
        elements: Vec<TrackElement>,
        joints: &[(ElementEnd, ElementEnd)],
    ) -> Self {
        let mut onward = vec![[Vec::new(), Vec::new()]; elements.len()];
        let both = joints.iter().flat_map(|(a, b)| [(*a, *b), (*b, *a)]);
        for (from, onto) in both {
            let next: &mut Vec<ElementEnd> = &mut onward[from.element][side(from.way)];
            let runs_to = onto.opposite();
            if !next.contains(&runs_to) {
                next.push(runs_to);
            }
        }
        Self {
            datum,
            grid: Grid::of(&elements),
            elements,
            onward,
        }
    }

    /// The same with every point moved by what a function says of its element, distance along it and place. Distances
    /// along elements stay.
    #[must_use]
    pub fn displaced(&self, by: impl Fn(usize, f64, &Point2<f64>) -> Vector2<f64>) -> Self {
        let mut elements = self.elements.clone();
        for (number, element) in elements.iter_mut().enumerate() {
            for (point, along_m) in element.points.iter_mut().zip(&element.along_m) {
                *point += by(number, *along_m, point);
            }
        }
        Self {
            datum: self.datum,
            grid: Grid::of(&elements),
            elements,
            onward: self.onward.clone(),
        }
    }

    /// What a train may run on that leaves an element at an end, each as the end towards which it then runs: more
    /// than one at a switch run facing.
    pub fn onward(&self, end: ElementEnd) -> &[ElementEnd] {
        &self.onward[end.element][side(end.way)]
    }

    /// Whether no train runs on from any element, although there are several.
    pub fn is_without_joints(&self) -> bool {
        self.elements.len() > 1 && self.onward.iter().flatten().all(Vec::is_empty)
    }

    /// Elements that come so near to a place, in the order of their numbers.
    pub fn near(&self, place: &Point2<f64>, within_m: f64) -> Vec<usize> {
        let mut near = self.grid.near(place, within_m);
        near.retain(|k| self.elements[*k].distance_m(place) <= within_m);
        near
    }

    /// From a place to the nearest element, at most so far.
    pub fn distance_m(&self, place: &Point2<f64>, most_m: f64) -> f64 {
        let mut within_m = FIRST_LOOK_M;
        loop {
            let near = self.grid.near(place, within_m).into_iter();
            let away_m = near
                .map(|k| self.elements[k].distance_m(place))
                .fold(most_m, f64::min);
            if away_m <= within_m || within_m >= most_m {
                return away_m;
            }
            within_m *= 4.0;
        }
    }
}

impl TrackElement {
    fn distance_m(&self, place: &Point2<f64>) -> f64 {
        let all = self.straights([0.0, self.length_m()]);
        let away = all.map(|(begin, _, forward, length_m)| {
            let to = place - begin;
            let nearest = forward * to.dot(&forward).clamp(0.0, length_m);
            (to - nearest).norm()
        });
        away.fold(f64::INFINITY, f64::min)
    }
}

fn side(way: Direction) -> usize {
    match way {
        Direction::Down => 0,
        Direction::Up => 1,
    }
}
