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
