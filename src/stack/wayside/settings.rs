//! What a scenario may say about the detection.

use crate::bus::DangerLevel;
use crate::track::{Checker, Problem};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of the obstacle detection of a wayside device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct WaysideSettings {
    /// Frames at the start from which the reference image is learnt; the track must be clear.
    pub reference_frames: u32,
    /// Threshold T of the difference, grey levels of 255.
    pub threshold_grey: f64,
    /// Reference pixels at or over this grey level are not looked at: lamps and their halos.
    pub saturated_grey: f64,
    /// Reference pixels whose range over the reference frames is at least this are not looked at.
    pub unstable_grey: f64,
    /// How much the threshold rises with a change of illumination: share of the change of grey
    /// level that is not trusted.
    pub gain_distrust: f64,
    /// Leave out what only dims the floor: regions in which its texture still shows.
    pub dismiss_shadows: bool,
    /// Smallest region, pixels.
    pub min_area_px: u32,
    /// Smallest extent of an obstacle, the larger of width and height, m.
    pub min_size_m: f64,
    /// How far along the line from the device obstacles are looked for, m.
    pub reach_m: f64,
    /// Frames, of the last `confirm_of`, in which an obstacle must be found to be confirmed.
    pub confirm_frames: u32,
    /// Length of the memory for confirmation, frames (64 at most).
    pub confirm_of: u32,
    /// A confirmed obstacle is gone when it was not found in this many frames in a row (64 at most).
    pub clear_frames: u32,
    /// Half width of the structure gauge, clearance included, m from the centreline.
    pub gauge_half_width_m: f64,
    /// Height of the structure gauge over top of rail, m.
    pub gauge_height_m: f64,
    /// Beside and over the gauge, danger is low within this distance, m.
    pub near_gauge_m: f64,
    /// Anything on the bed inside the gauge that rises to at least this height over top of rail
    /// is a high danger, m (negative: below).
    pub dangerous_height_m: f64,
    /// Length of the trains of the line, m.
    pub train_length_m: f64,
    /// While an obstacle is there, its warning is sent again after this time, s.
    pub refresh_s: f64,
    /// When no good frame has come for this long, the stretch that the camera watches counts as
    /// occupied, s.
    pub blind_after_s: f64,
    /// What the trains are told then: `high` stops them before the stretch, `low` warns the driver,
    /// who then runs on sight.
    pub blind_danger: DangerLevel,
    /// Take an image that repeats the one before, bit for bit, for a good one. A real sensor's noise
    /// never does; images drawn without noise do.
    pub allow_repeated_images: bool,
    /// Put difference and binary image into every report.
    pub keep_images: bool,
}

impl Default for WaysideSettings {
    fn default() -> Self {
        Self {
            reference_frames: 10,
            threshold_grey: 15.0,
            saturated_grey: 250.0,
            unstable_grey: 40.0,
            gain_distrust: 0.35,
            dismiss_shadows: true,
            min_area_px: 24,
            min_size_m: 0.1,
            reach_m: 80.0,
            confirm_frames: 3,
            confirm_of: 5,
            clear_frames: 10,
            gauge_half_width_m: 1.6,
            gauge_height_m: 3.9,
            near_gauge_m: 0.5,
            dangerous_height_m: 0.0,
            train_length_m: 118.0,
            refresh_s: 1.0,
            blind_after_s: 1.0,
            blind_danger: DangerLevel::High,
            allow_repeated_images: false,
            keep_images: true,
        }
    }
}

impl WaysideSettings {
    /// Appends what is wrong, with keys under `at`.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        let mut check = Checker::new(at, problems);
        check.within(
            "reference_frames",
            f64::from(self.reference_frames),
            1.0..=250.0,
            "",
        );
        check.within("threshold_grey", self.threshold_grey, 1.0..=254.0, "");
        check.within("saturated_grey", self.saturated_grey, 1.0..=256.0, "");
        check.within("unstable_grey", self.unstable_grey, 1.0..=256.0, "");
        check.within("gain_distrust", self.gain_distrust, 0.0..=1.0, "");
        check.within("min_area_px", f64::from(self.min_area_px), 1.0..=1e6, "px");
        check.within("min_size_m", self.min_size_m, 0.0..=5.0, "m");
        check.within("reach_m", self.reach_m, 5.0..=500.0, "m");
        check.within("confirm_of", f64::from(self.confirm_of), 1.0..=64.0, "");
        check.within("clear_frames", f64::from(self.clear_frames), 1.0..=64.0, "");
        if self.blind_danger == DangerLevel::None {
            problems.push(Problem::new(
                format!("{at}.blind_danger"),
                "a blind device that says nothing lets trains pass",
                "give \"high\" or \"low\"",
            ));
        }
        let mut check = Checker::new(at, problems);
        check.within(
            "confirm_frames",
            f64::from(self.confirm_frames),
            1.0..=f64::from(self.confirm_of.clamp(1, 64)),
            "",
        );
        check.within(
            "gauge_half_width_m",
            self.gauge_half_width_m,
            0.75..=3.0,
            "m",
        );
        check.within("gauge_height_m", self.gauge_height_m, 1.0..=6.0, "m");
        check.within("near_gauge_m", self.near_gauge_m, 0.0..=3.0, "m");
        check.within(
            "dangerous_height_m",
            self.dangerous_height_m,
            -0.5..=1.0,
            "m",
        );
        check.within("train_length_m", self.train_length_m, 5.0..=500.0, "m");
        check.within("refresh_s", self.refresh_s, 0.05..=60.0, "s");
        check.within("blind_after_s", self.blind_after_s, 0.1..=60.0, "s");
    }
}
