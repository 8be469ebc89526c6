//! What a recording holds, and how finely.

use crate::settings::settings;

settings! {
    /// How much of a run goes into its recording.
    pub struct RecordSettings {
        /// Pairs of the train's cameras that are kept as images, a second. 0 keeps none.
        stereo_image_hz: f64 = 5.0, in 0.0..=1e3;
        /// Frames of each wayside camera that are kept as images, a second. 0 keeps none.
        wayside_image_hz: f64 = 5.0, in 0.0..=1e3;
        /// Quality of the JPEG images, 1 to 100.
        jpeg_quality: u8 = 75, in 1.0..=100.0;
        /// Draw lamps, ellipses and obstacles into the images at every frame, also at those whose
        /// image is not kept. They then run ahead of the image shown.
        overlay_every_frame: bool = false;
        /// Difference images are shown this many times brighter than they are.
        difference_gain: f64 = 4.0, in 1.0..=255.0;
        /// Distance between the rings of the drawn tunnel, m.
        ring_step_m: f64 = 5.0, in 0.1..=1e3;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Settings;

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
