//! A line of stages: a stem, a facing switch, two tracks 4 m apart, a trailing switch.

use metrotwin::track::Direction;
use metrotwin::track::plan::{ElementEnd, PlanNetwork, TrackElement};
use metrotwin::twin::survey::SurveySettings;
use nalgebra::{Point2, Vector2};

const STEM_M: f64 = 120.0;
pub const BESIDE_M: f64 = 4.0;
/// Distance of a track's points.
const POINTS_M: f64 = 1.0;

/// Of a standard turn-out.
#[derive(Clone, Copy)]
pub struct Turnout {
    pub name: &'static str,
    /// 1 in this.
    ratio: f64,
    radius_m: f64,
}

pub const ONE_IN_9: Turnout = Turnout {
    name: "1 in 9",
    ratio: 9.0,
    radius_m: 190.0,
};
pub const ONE_IN_12: Turnout = Turnout {
    name: "1 in 12",
    ratio: 12.0,
    radius_m: 500.0,
};
pub const ONE_IN_18_5: Turnout = Turnout {
    name: "1 in 18.5",
    ratio: 18.5,
    radius_m: 1200.0,
};

impl Turnout {
    /// Lengths of the arc and of the straight behind it, on the way to a parallel track.
    fn arc_and_slant_m(&self) -> [f64; 2] {
        let angle = (1.0 / self.ratio).atan();
        let aside_m = BESIDE_M - 2.0 * self.radius_m * (1.0 - angle.cos());
        assert!(aside_m >= 0.0, "the arcs alone lead beyond the other track");
        [self.radius_m * angle, aside_m / angle.sin()]
    }

    /// From the toe to where both tracks are parallel, along the leg.
    pub fn change_m(&self) -> f64 {
        let [arc_m, slant_m] = self.arc_and_slant_m();
        2.0 * arc_m + slant_m
    }

    /// Heading of the leg that goes aside, so far behind the toe.
    fn heading(&self, m: f64) -> f64 {
        let [arc_m, slant_m] = self.arc_and_slant_m();
        let angle = arc_m / self.radius_m;
        match m {
            m if m < arc_m => m / self.radius_m,
            m if m < arc_m + slant_m => angle,
            m if m < 2.0 * arc_m + slant_m => angle - (m - arc_m - slant_m) / self.radius_m,
            _ => 0.0,
        }
    }

    /// From the toe of one switch to that of the other.
    fn legs_m(&self) -> f64 {
        (2.0 * self.change_m() + 150.0).ceil()
    }

    /// The leg that goes aside, and its mirror image, between two toes.
    fn aside(&self, from: f64) -> Vec<Point2<f64>> {
        let middle = from + 0.5 * self.legs_m();
        let mut leg = vec![Point2::new(from, 0.0)];
        let mut m = 0.5 * POINTS_M;
        while leg[leg.len() - 1].x < middle - POINTS_M {
            let (sin, cos) = self.heading(m).sin_cos();
            leg.push(leg[leg.len() - 1] + Vector2::new(cos, sin) * POINTS_M);
            m += POINTS_M;
        }
        let back: Vec<_> = leg
            .iter()
            .rev()
            .map(|p| Point2::new(2.0 * middle - p.x, p.y))
            .collect();
        leg.extend(back);
        leg
    }
}

/// Stages in a row: element 3 k is a stem, 3 k + 1 the straight leg, 3 k + 2 the other one.
pub fn line(turnout: &Turnout, stages: usize) -> PlanNetwork {
    let stage_m = STEM_M + turnout.legs_m();
    let (mut elements, mut joints) = (Vec::new(), Vec::new());
    for k in 0..stages {
        let begin = stage_m * k as f64;
        let straight = |from_m: f64, to_m: f64| {
            let pieces = ((to_m - from_m) / POINTS_M).ceil();
            let at = |n: usize| begin + from_m + (to_m - from_m) * n as f64 / pieces;
            let points = (0..=pieces as usize).map(|n| Point2::new(at(n), 0.0));
            points.collect()
        };
        for (id, points) in [
            (format!("stem {k}"), straight(0.0, STEM_M)),
            (format!("straight {k}"), straight(STEM_M, stage_m)),
            (format!("aside {k}"), turnout.aside(begin + STEM_M)),
        ] {
            elements.extend(TrackElement::new(&id, points));
        }
        let end = |element, way| ElementEnd { element, way };
        for leg in [3 * k + 1, 3 * k + 2] {
            joints.push((end(3 * k, Direction::Up), end(leg, Direction::Down)));
            if k + 1 < stages {
                joints.push((end(leg, Direction::Up), end(3 * k + 3, Direction::Down)));
            }
        }
    }
    PlanNetwork::new(None, elements, &joints)
}

/// Two straight tracks side by side that never meet.
pub fn two_tracks(length_m: f64) -> PlanNetwork {
    let track = |id: &str, y: f64| {
        let points =
            (0..=(length_m / POINTS_M) as u32).map(|k| Point2::new(POINTS_M * f64::from(k), y));
        TrackElement::new(id, points.collect())
    };
    let tracks = [track("one", 0.0), track("other", BESIDE_M)];
    PlanNetwork::new(None, tracks.into_iter().flatten().collect(), &[])
}

/// As surveyed with an error on each axis.
pub fn map_of(
    world: &PlanNetwork,
    (track_sigma_m, track_points_m): (f64, f64),
    seed: u64,
) -> PlanNetwork {
    let survey = SurveySettings {
        track_sigma_m,
        track_points_m,
        ..SurveySettings::default()
    };
    survey.surveyed(world, seed)
}
