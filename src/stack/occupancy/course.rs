//! The stretch of a network that a hypothesis says the train is on.

use crate::track::Direction;
use crate::track::plan::{ElementEnd, PlanNetwork};
use nalgebra::{Point2, Vector2};

/// Places of courses are one that are nearer.
const SAME_M: f64 = 1e-6;

/// A run over one element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CourseLeg {
    /// The element, and the end towards which a train runs that runs forwards.
    pub towards: ElementEnd,
    /// Where it begins along the course, metres.
    pub begin_m: f64,
    /// Of the element, metres.
    pub length_m: f64,
}

/// Elements in the order in which a train that runs forwards has them. Distances along it grow forwards.
#[derive(Clone, Debug, PartialEq)]
pub struct Course(Vec<CourseLeg>);

impl CourseLeg {
    fn end_m(&self) -> f64 {
        self.begin_m + self.length_m
    }

    /// How far along its element a place of the course is.
    pub fn along_m(&self, course_m: f64) -> f64 {
        match self.towards.way {
            Direction::Up => course_m - self.begin_m,
            Direction::Down => self.end_m() - course_m,
        }
    }

    /// Where on the course a place of its element is.
    pub fn course_m(&self, along_m: f64) -> f64 {
        match self.towards.way {
            Direction::Up => self.begin_m + along_m,
            Direction::Down => self.end_m() - along_m,
        }
    }
}

impl Course {
    /// Of one element, run towards an end, so that a place along the element is at 0.
    pub fn at_place(network: &PlanNetwork, towards: ElementEnd, along_m: f64) -> Self {
        let length_m = network.elements[towards.element].length_m();
        let run_m = match towards.way {
            Direction::Up => along_m,
            Direction::Down => length_m - along_m,
        };
        Self(vec![CourseLeg {
            towards,
            begin_m: -run_m,
            length_m,
        }])
    }

    /// Its legs.
    pub fn legs(&self) -> &[CourseLeg] {
        &self.0
    }

    /// From its begin to its end, metres.
    pub fn stretch_m(&self) -> [f64; 2] {
        let last = &self.0[self.0.len() - 1];
        [self.0[0].begin_m, last.end_m()]
    }

    /// The leg at a place, or the nearest.
    pub fn leg_at(&self, course_m: f64) -> &CourseLeg {
        let after = self.0.partition_point(|leg| leg.begin_m <= course_m);
        &self.0[after.saturating_sub(1)]
    }

    /// Where a place of it is, and the unit vector forwards. Beyond its ends it goes straight on.
    pub fn at(&self, network: &PlanNetwork, course_m: f64) -> (Point2<f64>, Vector2<f64>) {
        let leg = self.leg_at(course_m);
        let (place, up) = network.elements[leg.towards.element].at(leg.along_m(course_m));
        (place, up * leg.towards.way.sign())
    }

    /// Direction of the chord between two places, from east towards north.
    pub fn heading_rad(&self, network: &PlanNetwork, [from_m, to_m]: [f64; 2]) -> f64 {
        let chord = self.at(network, to_m).0 - self.at(network, from_m).0;
        chord.y.atan2(chord.x)
    }

    /// With one more element ahead, in each way that there is; none at an end of the network.
    pub fn onwards(&self, network: &PlanNetwork) -> Vec<Self> {
        let last = self.0[self.0.len() - 1];
        let next = network.onward(last.towards).iter();
        next.map(|towards| {
            let mut longer = self.clone();
            longer.0.push(CourseLeg {
                towards: *towards,
                begin_m: last.end_m(),
                length_m: network.elements[towards.element].length_m(),
            });
            longer
        })
        .collect()
    }

    /// With one more element behind, in each way that there is.
    pub fn backwards(&self, network: &PlanNetwork) -> Vec<Self> {
        let first = self.0[0];
        let before = network.onward(first.towards.opposite()).iter();
        before
            .map(|away| {
                let length_m = network.elements[away.element].length_m();
                let mut longer = self.clone();
                longer.0.insert(
                    0,
                    CourseLeg {
                        towards: away.opposite(),
                        begin_m: first.begin_m - length_m,
                        length_m,
                    },
                );
                longer
            })
            .collect()
    }

    /// Whether another one has the same legs, each so much farther along.
    pub fn is_shifted(&self, other: &Self, by_m: f64) -> bool {
        let pairs = || self.0.iter().zip(&other.0);
        let same = |(a, b): (&CourseLeg, &CourseLeg)| {
            a.towards == b.towards && (b.begin_m - a.begin_m - by_m).abs() < SAME_M
        };
        self.0.len() == other.0.len() && pairs().all(same)
    }

    /// From the leg at a place on.
    pub fn from(&self, course_m: f64) -> Self {
        let after = self.0.partition_point(|leg| leg.begin_m <= course_m);
        Self(self.0[after.saturating_sub(1)..].to_vec())
    }

    /// Without the elements that do not touch a stretch: what a train has left behind, or not reached yet, may be
    /// set another way when it comes there again.
    pub fn trim(&mut self, [from_m, to_m]: [f64; 2]) {
        let touches = |leg: &CourseLeg| leg.end_m() >= from_m && leg.begin_m <= to_m;
        if self.0.iter().any(touches) {
            self.0.retain(touches);
        }
    }
}
