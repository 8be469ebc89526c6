//! One way that the train may have come and go, and where it then is.

use super::balise_group::BaliseGroup;
use super::course::Course;
use super::placing::TrackPlacing;
use super::settings::OccupancySettings;
use crate::bus::SimTime;
use crate::numerics;
use crate::track::plan::{ElementEnd, PlanNetwork};
use nalgebra::{Matrix4, SMatrix, SVector, Vector2, Vector4};
use std::f64::consts::TAU;

/// How many numbers are estimated.
pub const STATES: usize = 10;
/// Place of the antenna along the course, metres.
pub const PLACE: usize = 0;
/// Error of the speed's scale.
pub const SCALE: usize = 1;
/// Heading that the sum of the yaw rates lacks, radians.
pub const HEADING: usize = 2;
/// Offset of the yaw rate, radians a second.
pub const YAW_OFFSET: usize = 3;
/// Error of fixes that changes slowly, metres: the part that changes with what is around the antenna, along the world's
/// x and y, then the part that lasts, along x and y.
pub const FIX_ERROR: usize = 4;
/// By how much the track lies to the left of where it is mapped, metres.
pub const ASIDE: usize = 8;
/// By how much it is turned to the left there, radians.
pub const TURNED: usize = 9;

pub type State = SVector<f64, STATES>;
pub type StateCovariance = SMatrix<f64, STATES, STATES>;

/// Beyond so many standard deviations of the place nothing is looked for.
const FAR_SIGMAS: f64 = 4.0;
/// Places that are nearer to each other are not told apart, metres.
pub const NEAR_M: f64 = 1.0;

/// Logarithm of the sum of two numbers that are given by theirs.
pub fn log_sum(a: f64, b: f64) -> f64 {
    let most = a.max(b);
    most + ((a - most).exp() + (b - most).exp()).ln()
}

/// Between -pi and pi.
pub fn wrapped(angle_rad: f64) -> f64 {
    numerics::wrapped(angle_rad, TAU)
}

/// The unit vector to the left of another one.
pub fn left_of(forward: &Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-forward.y, forward.x)
}

/// Error of a fix by its two parts.
pub fn sum_of_parts(parts_m: &Vector4<f64>) -> Vector2<f64> {
    parts_m.fixed_rows::<2>(0) + parts_m.fixed_rows::<2>(2)
}

/// Number of the most probable one.
pub fn most_probable(hypotheses: &[Hypothesis]) -> Option<usize> {
    let numbered = hypotheses.iter().map(|h| h.log_probability).enumerate();
    numbered
        .max_by(|(_, a), (_, b)| a.total_cmp(b))
        .map(|(k, _)| k)
}

/// A course, its probability and the place along it.
#[derive(Clone, Debug)]
pub struct Hypothesis {
    pub course: Course,
    /// Natural logarithm.
    pub log_probability: f64,
    /// What headings say of it, against the most probable one, and is not counted yet (see `headings`).
    pub heading_log: f64,
    pub placing: TrackPlacing,
    pub mean: State,
    /// Boxed, because hypotheses are moved when they are sorted, branched and merged.
    pub covariance: Box<StateCovariance>,
    /// Of the last fix, what its error had of variance that changes with the surroundings, and that lasts.
    pub fix_variances_m2: [f64; 2],
    /// Its kind.
    pub kind: Option<i32>,
    /// Whether its error had jumped.
    pub has_jumped: bool,
    /// Of the other kinds of fixes, as it was at the last one of each.
    pub kinds: Vec<KindError>,
    /// Groups of balises that were read lately.
    pub balise_groups: Vec<BaliseGroup>,
}

/// Error of fixes of a kind.
#[derive(Clone, Debug)]
pub struct KindError {
    pub kind: i32,
    pub time: SimTime,
    pub error_m: Vector4<f64>,
    pub covariance_m2: Matrix4<f64>,
}

impl Hypothesis {
    /// Where the train is along the course, metres.
    pub fn place_m(&self) -> f64 {
        self.mean[PLACE]
    }

    /// Standard deviation of the place, metres.
    pub fn sigma_m(&self) -> f64 {
        self.covariance[(PLACE, PLACE)].max(0.0).sqrt()
    }

    /// The element there, and the end towards which the train looks.
    pub fn towards(&self) -> ElementEnd {
        self.course.leg_at(self.place_m()).towards
    }

    /// Error of the fixes, if it is right.
    pub fn error_m(&self) -> Vector2<f64> {
        sum_of_parts(&self.slow_error_m())
    }

    /// Its two parts.
    pub fn slow_error_m(&self) -> Vector4<f64> {
        self.mean.fixed_rows::<4>(FIX_ERROR).into_owned()
    }

    /// Whether all of it is numbers: what rounding has made of it otherwise is worth nothing.
    pub fn is_finite(&self) -> bool {
        let sums = self.mean + self.covariance.column_sum();
        self.covariance[(PLACE, PLACE)] >= 0.0 && sums.iter().all(|sum| sum.is_finite())
    }

    /// Heading of the leading car on the map, if the antenna is at a place.
    pub fn car_heading_rad(
        &self,
        network: &PlanNetwork,
        antenna_m: f64,
        settings: &OccupancySettings,
    ) -> f64 {
        let middle_m = antenna_m + settings.middle_ahead_of_antenna_m();
        let half_m = 0.5 * settings.bogie_distance_m;
        self.course
            .heading_rad(network, [middle_m - half_m, middle_m + half_m])
    }

    /// From where to where the course is needed: the chord between the bogies, wherever the train may be.
    pub fn needed_m(&self, settings: &OccupancySettings) -> [f64; 2] {
        let bogies_m = settings.middle_ahead_of_antenna_m().abs() + 0.5 * settings.bogie_distance_m;
        let reach_m = bogies_m + NEAR_M + FAR_SIGMAS * self.sigma_m();
        let place_m = self.place_m();
        [place_m - reach_m, place_m + reach_m]
    }

    /// Adds it to others with its course as long as it has to be, once for each way that there is; these share its
    /// probability evenly.
    pub fn grow_into(
        self,
        grown: &mut Vec<Self>,
        network: &PlanNetwork,
        settings: &OccupancySettings,
    ) {
        let most = grown.len() + settings.most_hypotheses as usize;
        let (mut next, mut left) = (Some(self), Vec::new());
        while let Some(mut hypothesis) = next {
            let longer = hypothesis.lengthened(network, settings);
            if longer.is_empty() || grown.len() + left.len() >= most {
                grown.push(hypothesis);
            } else {
                let share = (longer.len() as f64).ln();
                left.extend(longer.into_iter().map(|course| Self {
                    course,
                    log_probability: hypothesis.log_probability - share,
                    ..hypothesis.clone()
                }));
            }
            next = left.pop();
        }
    }

    /// Cuts off what is no longer needed of its course. Gives the courses with one more element, if more is needed than
    /// there is, for each way that there is; none at an end of the network.
    fn lengthened(&mut self, network: &PlanNetwork, settings: &OccupancySettings) -> Vec<Course> {
        let needed = self.needed_m(settings);
        self.course
            .trim([needed[0] - settings.train_length_m, needed[1]]);
        let [begin_m, end_m] = self.course.stretch_m();
        let mut longer = Vec::new();
        if needed[1] > end_m {
            longer = self.course.onwards(network);
        }
        if longer.is_empty() && needed[0] < begin_m {
            longer = self.course.backwards(network);
        }
        longer
    }
}
