//! How the signal of a radar is worked up, and what its tracker believes of targets and of the train.

use super::window::Window;
use crate::settings::settings;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a cell is compared with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "RadarCfar")]
pub enum CfarKind {
    /// The mean of its reference cells: the least loss in even noise (Finn and Johnson 1968).
    Ca,
    /// One of them in order of power: a second target or the edge of clutter among them raises it little (Rohling
    /// 1983).
    #[default]
    Os,
}

settings! {
    /// Settings of the onboard radar.
    #[derive(Copy)]
    pub struct RadarTrackingSettings {
        /// Of the samples of a chirp. Its side lobes have to hide below the noise: a train of 100 square metres has a
        /// million times the power of what can just be detected at its range.
        range_window: Window = Window::Chebyshev;
        /// Of the chirps of a frame. Echoes of the standing tunnel beside a target have another speed than it.
        speed_window: Window = Window::Chebyshev;
        /// Highest side lobe of a Chebyshev window below its main lobe, dB: see `range_window`.
        chebyshev_db: f64 = 60.0, in 30.0..=120.0;
        /// What a cell is compared with.
        cfar: CfarKind = CfarKind::default();
        /// Cells that it is compared with, half of them nearer, half farther. 16 cost 2 dB or so (Rohling 1983); more
        /// would reach over the edges of clutter.
        reference_cells: u32 = 16, in 4.0..=128.0;
        /// Which of them, in order of power, as a share of all: 12 of 16 (Rohling 1983).
        ordered_share: f64 = 0.75, in 0.25..=1.0;
        /// Cells left out on either side, which a target's own main lobe reaches into: with a Chebyshev window of 60 dB
        /// its half width is 2 cells.
        guard_cells: u32 = 2, in 0.0..=32.0;
        /// A cell of noise is taken for a detection so often. A frame has some hundred thousand cells: one in several
        /// frames has a false detection, and one alone never becomes a target.
        false_alarm_probability: f64 = 1e-6, in 1e-12..=0.1;
        /// No more detections of a frame than this are kept, the strongest.
        most_detections: u32 = 256, in 1.0..=4096.0;
        /// Something that stands out less over a side lobe of a stronger echo than this is taken for the side lobe, dB:
        /// noise and a window's rounding raise side lobes by a little.
        side_lobe_margin_db: f64 = 3.0, in 0.0..=30.0;
        /// Nothing moves faster over ground, m/s: 160 km/h.
        most_speed_mps: f64 = 45.0, in 1.0..=200.0;
        /// Detections so many resolutions apart in speed and azimuth, or less, are of one body, and in range with half a
        /// body's length more: what is told apart is just farther than one resolution.
        cluster_resolutions: f64 = 1.0, in 0.0..=20.0;
        /// Length of a body, metres: a car.
        body_length_m: f64 = 4.5, in 0.0..=50.0;
        /// Where on a body it reflects: one sigma along and across, metres. Anywhere on a car 1.8 m wide is 1.8 m / sqrt
        /// 12.
        body_sigma_m: f64 = 0.5, in 0.0..=10.0;
        /// Of speeds of parts of a body against its middle, one sigma, m/s: limbs of a person.
        body_speed_sigma_mps: f64 = 0.3, in 0.0..=10.0;
        /// A target's acceleration between frames, one sigma each way, m/s^2: a walker that starts, a train that brakes.
        acceleration_sigma_mps2: f64 = 1.5, in 1e-3..=50.0;
        /// What a new target's speed across the line of sight may be, one sigma, m/s: a car at a level crossing.
        start_speed_sigma_mps: f64 = 8.0, in 0.1..=100.0;
        /// Of the train's measured speed, one sigma, m/s.
        own_speed_sigma_mps: f64 = 0.3, in 1e-3..=10.0;
        /// Of its yaw rate, one sigma, radians a second.
        own_yaw_rate_sigma_radps: f64 = 2e-3, in 1e-6..=1.0;
        /// Squared Mahalanobis distance of a detection that still is a target's: chi-squared with 3 degrees of freedom
        /// is above 16.27 once in a thousand.
        gate: f64 = 16.27, in 1.0..=100.0;
        /// A target is confirmed when it was detected in so many ...
        confirm_hits: u32 = 3, in 1.0..=32.0;
        /// ... of so many frames in a row. False detections, one in several frames, do not come three times within one
        /// gate.
        confirm_frames: u32 = 5, in 1.0..=32.0;
        /// A confirmed target that was missed so many frames in a row is dropped: one that is detected with 0.5 is
        /// missed ten times once in a thousand.
        lost_frames: u32 = 10, in 1.0..=1000.0;
        /// Walls are looked for so far from the middle of the track or farther, metres: half a train, and air.
        wall_least_m: f64 = 1.6, in 0.1..=50.0;
        /// And no farther than this, metres: a tunnel of two tracks and a platform.
        wall_most_m: f64 = 12.0, in 0.1..=100.0;
        /// Of a wall about a plane, one sigma, metres: cables, niches, segments.
        wall_sigma_m: f64 = 0.3, in 1e-2..=5.0;
        /// A target is a ghost when a wall explained it so many frames oftener than not.
        ghost_frames: u32 = 5, in 1.0..=1000.0;
    }
    also check_pairs
}

impl RadarTrackingSettings {
    fn check_pairs(&self, check: &mut crate::settings::Checker<'_>) {
        if self.confirm_hits > self.confirm_frames {
            let what = "has more detections than `confirm_frames` has frames";
            check.problem("confirm_hits", what, "lower it, or raise `confirm_frames`");
        }
        if self.wall_least_m > self.wall_most_m {
            let what = "is farther than `wall_most_m`";
            check.problem("wall_least_m", what, "lower it, or raise `wall_most_m`");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Settings;

    /// What is wrong together is named by its key.
    #[test]
    fn pairs_that_contradict_are_named() {
        let settings = RadarTrackingSettings {
            confirm_hits: 6,
            wall_least_m: 13.0,
            ..RadarTrackingSettings::default()
        };
        let mut problems = Vec::new();
        settings.check("radar", &mut problems);
        let said = format!("{problems:?}");
        assert_eq!(problems.len(), 2);
        assert!(said.contains("radar.confirm_hits") && said.contains("radar.wall_least_m"));
        problems.clear();
        RadarTrackingSettings::default().check("radar", &mut problems);
        assert!(problems.is_empty(), "{problems:?}");
    }
}
