//! What a user may set about the positioning.

use crate::bus::Method;
use crate::track::{Checker, Problem};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of the lamp positioning.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LedSettings {
    /// By which methods fixes are given: `paper` by both eyes, `mono` by one.
    pub methods: Vec<Method>,
    /// A spot must stand out of the darkness by this many grey levels (of 255).
    pub min_contrast_grey: f64,
    /// A spot must cover this many pixels after closing.
    pub min_area_px: f64,
    /// Correct the stripes' tilt where it shears them by more than this many rows across the spot.
    pub tilt_over_rows: f64,
    /// Motion blur is undone where the smear is longer than this many pixels.
    pub deblur_over_px: f64,
    /// Noise-to-signal power ratio of the Wiener filter.
    pub wiener_noise_to_signal: f64,
    /// A lamp is taken for the predicted one within this share of the lamps' spacing (under 0.5).
    pub gate_share: f64,
    /// Without a prediction, as many frames must read the same name before it is believed; as
    /// many must contradict a prediction before it is given up.
    pub agreeing_reads: u32,
    /// A lamp not seen for this many seconds is forgotten, with what was read of its code.
    pub forget_s: f64,
    /// Time constant in seconds with which the gyro's deviation from the track's attitude fades.
    pub imu_fade_s: f64,
    /// Standard deviation of the car's attitude after that, degrees about any axis. 0.03: gyro bias
    /// 6.25 deg/h and random walk 0.3 deg/sqrt(h) over 10 s make 0.017 and 0.011, rails that are 1.6
    /// mm (rms, waves of 25 to 70 m) off the map's 0.015.
    pub attitude_sigma_deg: f64,
    /// Standard deviation of the rig's calibrated attitude on the car, degrees about any axis.
    pub mount_sigma_deg: f64,
    /// Standard deviation of the calibrated baseline, mm.
    pub baseline_sigma_mm: f64,
    /// Standard deviation of the yaw of the right eye against the left that calibration left,
    /// degrees. 0.005, a tenth of a pixel for the reference lens: a target calibration leaves 0.1
    /// to 0.2 px at a corner, which its many views average out, except what the lens's model
    /// misses; and a difference of 0.6 K across a bar of aluminium, 120 mm long and 20 mm thick,
    /// bends it by as much.
    pub vergence_sigma_deg: f64,
    /// Standard deviation of the calibrated focal length, as a share of it.
    pub focal_sigma_share: f64,
    /// From the train head back to the leading car's front bogie pivot, metres.
    pub front_pivot_m: f64,
    /// From the train head back to the leading car's rear bogie pivot, metres.
    pub rear_pivot_m: f64,
    /// A fix with a larger standard deviation than this is not given, metres.
    pub max_sigma_m: f64,
    /// Standard deviation of a surveyed lamp position along the track, metres. 0.015: total station
    /// or laser scanning from control points.
    pub survey_sigma_m: f64,
    /// The rig is reported silent when no pair has come for this long, seconds.
    pub silent_after_s: f64,
    /// Take an image that repeats the one before, bit for bit, for a good one. A real sensor's noise
    /// never does; images drawn without noise do.
    pub allow_repeated_images: bool,
}

impl Default for LedSettings {
    fn default() -> Self {
        Self {
            methods: Method::ALL.to_vec(),
            min_contrast_grey: 15.0,
            min_area_px: 60.0,
            tilt_over_rows: 0.5,
            deblur_over_px: 0.5,
            wiener_noise_to_signal: 0.01,
            gate_share: 0.4,
            agreeing_reads: 2,
            forget_s: 0.5,
            imu_fade_s: 10.0,
            attitude_sigma_deg: 0.03,
            mount_sigma_deg: 0.05,
            baseline_sigma_mm: 0.05,
            vergence_sigma_deg: 0.005,
            focal_sigma_share: 0.001,
            front_pivot_m: 3.5,
            rear_pivot_m: 16.1,
            max_sigma_m: 0.25,
            survey_sigma_m: 0.015,
            silent_after_s: 1.0,
            allow_repeated_images: false,
        }
    }
}

impl LedSettings {
    /// Appends what is wrong, with keys under `at`.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        if self.methods.is_empty() {
            problems.push(Problem::new(
                format!("{at}.methods"),
                "without a method there are no fixes",
                "name `paper`, `mono` or both; or take `led` out of the train's equipment",
            ));
        }
        let mut check = Checker::new(at, problems);
        check.within("min_contrast_grey", self.min_contrast_grey, 2.0..=250.0, "");
        check.within("min_area_px", self.min_area_px, 9.0..=1e5, "px");
        check.within("tilt_over_rows", self.tilt_over_rows, 0.05..=1e3, "rows");
        check.within("deblur_over_px", self.deblur_over_px, 0.05..=1e3, "px");
        check.within(
            "wiener_noise_to_signal",
            self.wiener_noise_to_signal,
            1e-6..=1.0,
            "",
        );
        check.within("gate_share", self.gate_share, 0.01..=0.49, "");
        check.within(
            "agreeing_reads",
            f64::from(self.agreeing_reads),
            1.0..=20.0,
            "",
        );
        check.within("forget_s", self.forget_s, 0.02..=60.0, "s");
        check.within("imu_fade_s", self.imu_fade_s, 0.1..=3600.0, "s");
        check.within(
            "attitude_sigma_deg",
            self.attitude_sigma_deg,
            0.0..=10.0,
            "deg",
        );
        check.within("mount_sigma_deg", self.mount_sigma_deg, 0.0..=10.0, "deg");
        check.within(
            "baseline_sigma_mm",
            self.baseline_sigma_mm,
            0.0..=50.0,
            "mm",
        );
        check.within(
            "vergence_sigma_deg",
            self.vergence_sigma_deg,
            0.0..=5.0,
            "deg",
        );
        check.within("focal_sigma_share", self.focal_sigma_share, 0.0..=0.5, "");
        check.within("front_pivot_m", self.front_pivot_m, 0.0..=30.0, "m");
        check.within("max_sigma_m", self.max_sigma_m, 0.01..=100.0, "m");
        check.within("silent_after_s", self.silent_after_s, 0.1..=60.0, "s");
        check.within("survey_sigma_m", self.survey_sigma_m, 0.0..=5.0, "m");
        check.within(
            "rear_pivot_m",
            self.rear_pivot_m,
            self.front_pivot_m + 1.0..=60.0,
            "m",
        );
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_in_order_and_nonsense_is_named() {
        let mut problems = Vec::new();
        LedSettings::default().check("positioning", &mut problems);
        assert!(problems.is_empty(), "{problems:?}");
        let wrong = LedSettings {
            gate_share: 0.5,
            rear_pivot_m: f64::NAN,
            ..LedSettings::default()
        };
        wrong.check("positioning", &mut problems);
        let keys: Vec<_> = problems.iter().map(|p| p.key.as_str()).collect();
        assert_eq!(keys, ["positioning.gate_share", "positioning.rear_pivot_m"]);
    }
}
