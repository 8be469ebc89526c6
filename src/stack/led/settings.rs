//! What a user may set about the positioning.

use crate::bus::Method;
use crate::settings::{Checker, settings};

settings! {
    /// Settings of the lamp positioning.
    pub struct LedSettings {
        /// By which methods fixes are given: `paper` by both eyes, `mono` by one.
        methods: Vec<Method> = Method::ALL.to_vec();
        /// A spot must stand out of the darkness by this many grey levels (of 255).
        min_contrast_grey: f64 = 15.0, in 2.0..=250.0;
        /// A spot must cover this many pixels after closing.
        min_area_px: f64 = 60.0, in 9.0..=1e5;
        /// Correct the stripes' tilt where it shears them by more than this many rows across the
        /// spot.
        tilt_over_rows: f64 = 0.5, in 0.05..=1e3;
        /// Motion blur is undone where the smear is longer than this many pixels.
        deblur_over_px: f64 = 0.5, in 0.05..=1e3;
        /// Noise-to-signal power ratio of the Wiener filter.
        wiener_noise_to_signal: f64 = 0.01, in 1e-6..=1.0;
        /// A lamp is taken for the predicted one within this share of the lamps' spacing (under
        /// 0.5).
        gate_share: f64 = 0.4, in 0.01..=0.49;
        /// Without a prediction, a name must be read this often before it is believed; as often it must
        /// contradict a prediction before that is given up.
        agreeing_reads: u32 = 2, in 1.0..=20.0;
        /// A lamp not seen for this many seconds is forgotten, with what was read of its code.
        forget_s: f64 = 0.5, in 0.02..=60.0;
        /// Time constant in seconds with which the gyro's deviation from the track's attitude
        /// fades.
        imu_fade_s: f64 = 10.0, in 0.1..=3600.0;
        /// Standard deviation of the car's attitude after that, degrees about any axis. 0.03: gyro
        /// bias 6.25 deg/h and random walk 0.3 deg/sqrt(h) over 10 s make 0.017 and 0.011, rails
        /// that are 1.6 mm (rms, waves of 25 to 70 m) off the map's 0.015.
        attitude_sigma_deg: f64 = 0.03, in 0.0..=10.0;
        /// Standard deviation of the rig's calibrated attitude on the car, degrees about any axis.
        mount_sigma_deg: f64 = 0.05, in 0.0..=10.0;
        /// Standard deviation of the calibrated baseline, mm.
        baseline_sigma_mm: f64 = 0.05, in 0.0..=50.0;
        /// Standard deviation of the yaw of the right eye against the left that calibration left,
        /// degrees. 0.005, a tenth of a pixel for the reference lens: a target calibration leaves
        /// 0.1 to 0.2 px at a corner, which its many views average out, except what the lens's
        /// model misses; and a difference of 0.6 K across a bar of aluminium, 120 mm long and 20 mm
        /// thick, bends it by as much.
        vergence_sigma_deg: f64 = 0.005, in 0.0..=5.0;
        /// Standard deviation of the calibrated focal length, as a share of it.
        focal_sigma_share: f64 = 0.001, in 0.0..=0.5;
        /// From the train head back to the leading car's front bogie pivot, metres.
        front_pivot_m: f64 = 3.5, in 0.0..=30.0;
        /// From the train head back to the leading car's rear bogie pivot, metres.
        rear_pivot_m: f64 = 16.1, in 1.0..=60.0;
        /// A fix with a larger standard deviation than this is not given, metres.
        max_sigma_m: f64 = 0.25, in 0.01..=100.0;
        /// Standard deviation of a surveyed lamp position along the track, metres. 0.015: total
        /// station or laser scanning from control points.
        survey_sigma_m: f64 = 0.015, in 0.0..=5.0;
        /// The rig is reported silent when no pair has come for this long, seconds.
        silent_after_s: f64 = 1.0, in 0.1..=60.0;
        /// Take an image that repeats the one before, bit for bit, for a good one. A real sensor's
        /// noise never does; images drawn without noise do.
        allow_repeated_images: bool = false;
    }
    also check_pivots
}

impl LedSettings {
    fn check_pivots(&self, check: &mut Checker<'_>) {
        if self.methods.is_empty() {
            check.problem(
                "methods",
                "without a method there are no fixes",
                "name `paper`, `mono` or both; or take `led` out of the train's equipment",
            );
        }
        check.within(
            "rear_pivot_m",
            self.rear_pivot_m,
            self.front_pivot_m + 1.0..=60.0,
        );
    }
}
