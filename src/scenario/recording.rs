//! What a recording holds, and how finely.

use crate::track::{Checker, Problem};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How much of a run goes into its recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RecordSettings {
    /// Pairs of the train's cameras that are kept as images, a second. 0 keeps none.
    pub stereo_image_hz: f64,
    /// Frames of each wayside camera that are kept as images, a second. 0 keeps none.
    pub wayside_image_hz: f64,
    /// Quality of the JPEG images, 1 to 100.
    pub jpeg_quality: u8,
    /// Draw lamps, ellipses and obstacles into the images at every frame, also at those whose
    /// image is not kept. They then run ahead of the image shown.
    pub overlay_every_frame: bool,
    /// Difference images are shown this many times brighter than they are.
    pub difference_gain: f64,
    /// Distance between the rings of the drawn tunnel, m.
    pub ring_step_m: f64,
}

impl Default for RecordSettings {
    fn default() -> Self {
        Self {
            stereo_image_hz: 5.0,
            wayside_image_hz: 5.0,
            jpeg_quality: 75,
            overlay_every_frame: false,
            difference_gain: 4.0,
            ring_step_m: 5.0,
        }
    }
}

impl RecordSettings {
    /// Appends what is wrong, with keys under `at`.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        let mut check = Checker::new(at, problems);
        check.within("stereo_image_hz", self.stereo_image_hz, 0.0..=1e3, "Hz");
        check.within("wayside_image_hz", self.wayside_image_hz, 0.0..=1e3, "Hz");
        let quality = f64::from(self.jpeg_quality);
        check.within("jpeg_quality", quality, 1.0..=100.0, "");
        check.within("difference_gain", self.difference_gain, 1.0..=255.0, "");
        check.within("ring_step_m", self.ring_step_m, 0.1..=1e3, "m");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reference_values_are_right() {
        let mut problems = Vec::new();
        RecordSettings::default().check("record", &mut problems);
        assert!(problems.is_empty(), "{problems:?}");
    }

    /// Every key that can be wrong is reported under its own name; a NaN passes no comparison.
    #[test]
    fn each_wrong_value_is_named() {
        let mut problems = Vec::new();
        let wrong = RecordSettings {
            stereo_image_hz: -1.0,
            wayside_image_hz: f64::NAN,
            jpeg_quality: 0,
            overlay_every_frame: true,
            difference_gain: 0.0,
            ring_step_m: 0.0,
        };
        wrong.check("record", &mut problems);
        let keys: Vec<_> = problems.iter().map(|p| p.key.as_str()).collect();
        assert_eq!(
            keys,
            [
                "record.stereo_image_hz",
                "record.wayside_image_hz",
                "record.jpeg_quality",
                "record.difference_gain",
                "record.ring_step_m",
            ]
        );
    }
}
