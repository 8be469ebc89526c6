//! What the occupancy filter believes of its sensors and of the map.

use crate::settings::settings;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How fixes are put on the track, and what they say of the hypotheses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "OccupancyMethod")]
pub enum Method {
    /// The nearest place of each track (Gerlach and Hoppe 2009).
    Perpendicular,
    /// The scaled pedal curve of the error ellipse, and speed (Guo et al. 2020).
    Pedal,
    /// A filter for each hypothesis, with correlated errors of fixes, jumps of them, and the yaw rate against the
    /// map's headings.
    #[default]
    Fused,
}

impl Method {
    /// As in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Perpendicular => "perpendicular",
            Self::Pedal => "pedal curve",
            Self::Fused => "fused",
        }
    }
}

settings! {
    /// Settings of track occupancy. All are standard deviations unless they say what else they are.
    #[derive(Copy)]
    pub struct OccupancySettings {
        /// How fixes are matched and judged.
        method: Method = Method::default();
        /// Hypotheses that are less probable are dropped. A control system may rely on a decision if it is wrong less
        /// often than the tolerable hazard rate of a safety function of SIL 4, 1e-9 an hour (EN 50129), asks for: with
        /// some tens of decisions an hour each may be wrong with 1e-10 at most.
        least_probability: f64 = 1e-10, in 1e-300..=0.1;
        /// No more hypotheses than this are kept, the most probable.
        most_hypotheses: u32 = 400, in 2.0..=1e5;
        /// Of the surveyed map across the track, metres.
        map_sigma_m: f64 = 0.3, in 1e-3..=100.0;
        /// Along the track, correlation length of that, metres: errors of places 1.7 times as far apart have a correlation
        /// of one half. A third of the distance between the map's surveyed or drawn points.
        map_correlation_m: f64 = 40.0, in 1.0..=1e4;
        /// Share of a fix's variance that changes slowly.
        correlated_share: f64 = 0.8, in 0.0..=1.0;
        /// Time constant of what of that changes with the surroundings of the antenna (multipath), seconds.
        correlation_s: f64 = 60.0, in 1e-3..=1e6;
        /// Share of the slow variance that lasts (orbits, clocks, the air).
        lasting_share: f64 = 0.5, in 0.0..=1.0;
        /// Time constant of that, seconds.
        lasting_s: f64 = 1800.0, in 1e-3..=1e6;
        /// Probability that the error of a fix jumps from the last one (reflections, a wrong integer).
        jump_probability: f64 = 1e-3, in 1e-12..=0.5;
        /// By how much, metres.
        jump_sigma_m: f64 = 10.0, in 1e-3..=1e4;
        /// Of the measured speed, metres a second.
        speed_sigma_mps: f64 = 0.3, in 1e-3..=100.0;
        /// Of the scale of the measured speed.
        speed_scale_sigma: f64 = 0.02, in 0.0..=1.0;
        /// Of the yaw rate, in a mean over a second, radians a second.
        yaw_rate_sigma_radps: f64 = 1e-3, in 1e-9..=1.0;
        /// Of its offset, radians a second.
        yaw_offset_sigma_radps: f64 = 1e-3, in 0.0..=1.0;
        /// Of the car's heading against that of the mapped track, beside what `map_sigma_m` makes of that: by play, and by
        /// kinks at mapped points, radians.
        heading_sigma_rad: f64 = 8e-3, in 1e-6..=3.0;
        /// Between the bogies: a car has the heading of a chord of this length, metres.
        bogie_distance_m: f64 = 15.0, in 0.1..=50.0;
        /// Under a train of this length no switch moves, metres.
        train_length_m: f64 = 20.0, in 1.0..=1000.0;
        /// The antenna of the receiver behind the head, metres.
        antenna_behind_head_m: f64 = 10.0, in -10.0..=200.0;
        /// The middle of the leading car behind the head, metres.
        car_middle_behind_head_m: f64 = 10.0, in 0.0..=50.0;
        /// One sigma of the position given by a balise, metres.
        balise_sigma_m: f64 = 0.5, in 1e-3..=50.0;
        /// Inputs wait for this long for such as are older and come later, ms.
        hold_ms: f64 = 200.0, in 0.0..=10_000.0;
    }
}

impl OccupancySettings {
    /// The middle of the leading car ahead of the antenna, below 0 behind it.
    pub(super) fn middle_ahead_of_antenna_m(&self) -> f64 {
        self.antenna_behind_head_m - self.car_middle_behind_head_m
    }
}
