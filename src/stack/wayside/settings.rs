//! What a scenario may say about the detection.

use crate::bus::DangerLevel;
use crate::settings::{Checker, settings};

settings! {
    /// Settings of the obstacle detection of a wayside device.
    pub struct WaysideSettings {
        /// Frames at the start from which the reference image is learnt; the track must be clear.
        reference_frames: u32 = 10, in 1.0..=250.0;
        /// Threshold T of the difference, grey levels of 255.
        threshold_grey: f64 = 15.0, in 1.0..=254.0;
        /// Reference pixels at or over this grey level are not looked at: lamps and their halos.
        saturated_grey: f64 = 250.0, in 1.0..=256.0;
        /// Reference pixels whose range over the reference frames is at least this are not looked
        /// at.
        unstable_grey: f64 = 40.0, in 1.0..=256.0;
        /// How much the threshold rises with a change of illumination: share of the change of grey
        /// level that is not trusted.
        gain_distrust: f64 = 0.35, in 0.0..=1.0;
        /// Leave out what only dims the floor: regions in which its texture still shows.
        reject_shadows: bool = true;
        /// What differs in grey from the bed by this share of the bed's grey must be found: where the
        /// light is so little, or so different from that of the reference, that the threshold is higher,
        /// the bed counts as unseen.
        least_contrast: f64 = 0.6, in 0.05..=1.0;
        /// Standard deviation of the grey across the track (rails, sleepers, bed) in clear air, as a share
        /// of the bed's grey. What is missing of it, a veil before the bed has taken, of bodies too.
        track_contrast: f64 = 0.35, in 0.01..=1.0;
        /// Length of bed that may be unseen before the device counts as blind, m.
        unseen_bed_m: f64 = 10.0, in 0.0..=500.0;
        /// Smallest region, pixels.
        min_area_px: u32 = 24, in 1.0..=1e6;
        /// Smallest extent of an obstacle, the larger of width and height, m.
        min_size_m: f64 = 0.1, in 0.0..=5.0;
        /// How far along the line from the device obstacles are looked for, m.
        reach_m: f64 = 80.0, in 5.0..=500.0;
        /// Frames, of the last `confirm_of`, in which an obstacle must be found to be confirmed.
        confirm_frames: u32 = 3, in 1.0..=64.0;
        /// Length of the memory for confirmation, frames (64 at most).
        confirm_of: u32 = 5, in 1.0..=64.0;
        /// A confirmed obstacle is gone after this many frames in which the clear bed is seen in its
        /// place, with none between in which it is found (64 at most, and not fewer than `confirm_of`).
        /// Frames that show neither do not count.
        clear_frames: u32 = 10, in 1.0..=64.0;
        /// Half width of the structure gauge, clearance included, m from the centreline.
        gauge_half_width_m: f64 = 1.6, in 0.75..=3.0;
        /// Height of the structure gauge over top of rail, m.
        gauge_height_m: f64 = 3.9, in 1.0..=6.0;
        /// Beside and over the gauge, danger is low within this distance, m.
        near_gauge_m: f64 = 0.5, in 0.0..=3.0;
        /// Anything on the bed inside the gauge that rises to at least this height over top of rail
        /// is a high danger, m (negative: below).
        dangerous_height_m: f64 = 0.0, in -0.5..=1.0;
        /// While an obstacle is there, its warning is sent again after this time, s.
        refresh_s: f64 = 1.0, in 0.05..=60.0;
        /// A heartbeat is sent after each frame that comes this long after the last one, s. Trains take
        /// silence for an occupied track.
        heartbeat_s: f64 = 1.0, in 0.05..=60.0;
        /// When no good frame that shows the bed has come for this long, the stretch that the camera
        /// watches counts as occupied, s.
        blind_after_s: f64 = 1.0, in 0.1..=60.0;
        /// What is said to the trains then: `high` stops them before the stretch, `low` warns the
        /// driver, who then runs on sight.
        blind_danger: DangerLevel = DangerLevel::High;
        /// Take an image that repeats the one before, bit for bit, for a good one. A real sensor's
        /// noise never does; images drawn without noise do.
        allow_repeated_images: bool = false;
        /// Put difference and binary image into every report.
        keep_images: bool = true;
    }
    also check_together
}

impl WaysideSettings {
    fn check_together(&self, check: &mut Checker<'_>) {
        let memory = f64::from(self.confirm_of.max(1));
        check.within("confirm_frames", self.confirm_frames, 1.0..=memory);
        if self.blind_danger == DangerLevel::None {
            check.problem(
                "blind_danger",
                "a blind device that says nothing lets trains pass",
                "give \"high\" or \"low\"",
            );
        }
    }
}
