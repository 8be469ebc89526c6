//! What the occupancy filter believes of its sensors and of the map.

/// How fixes are put on the track, and what they say of the hypotheses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
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
            Self::Pedal => "paper",
            Self::Fused => "fused",
        }
    }
}

/// Settings of the occupancy filter. All are standard deviations unless they say what else they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OccupancySettings {
    /// How fixes are matched and judged.
    pub method: Method,
    /// Hypotheses that are less probable are dropped. A control system may rely on a decision if it is wrong less
    /// often than the tolerable hazard rate of a safety function of SIL 4, 1e-9 an hour (EN 50129), asks for: with
    /// some tens of decisions an hour each may be wrong with 1e-10 at most.
    pub least_probability: f64,
    /// No more hypotheses than this are kept, the most probable.
    pub most_hypotheses: usize,
    /// Of the surveyed map across the track, metres.
    pub map_sigma_m: f64,
    /// Share of a fix's variance that changes slowly.
    pub correlated_share: f64,
    /// Time constant of that, seconds.
    pub correlation_s: f64,
    /// Probability that the error of a fix jumps from the last one (reflections, a wrong integer).
    pub jump_probability: f64,
    /// By how much, metres.
    pub jump_sigma_m: f64,
    /// Of the measured speed, metres a second.
    pub speed_sigma_mps: f64,
    /// Of the scale of the measured speed.
    pub speed_scale_sigma: f64,
    /// Of the yaw rate, in a mean over a second, radians a second.
    pub yaw_rate_sigma_radps: f64,
    /// Of its offset, radians a second.
    pub yaw_offset_sigma_radps: f64,
    /// Of the map's headings, and of the car's against the track, radians.
    pub heading_sigma_rad: f64,
    /// Between the bogies: a car has the heading of a chord of this length, metres.
    pub bogie_distance_m: f64,
    /// Under a train of this length no switch moves, metres.
    pub train_length_m: f64,
}

impl Default for OccupancySettings {
    fn default() -> Self {
        Self {
            method: Method::default(),
            least_probability: 1e-10,
            most_hypotheses: 400,
            map_sigma_m: 0.3,
            correlated_share: 0.8,
            correlation_s: 60.0,
            jump_probability: 1e-3,
            jump_sigma_m: 10.0,
            speed_sigma_mps: 0.3,
            speed_scale_sigma: 0.02,
            yaw_rate_sigma_radps: 1e-3,
            yaw_offset_sigma_radps: 1e-3,
            heading_sigma_rad: 8e-3,
            bogie_distance_m: 15.0,
            train_length_m: 20.0,
        }
    }
}
