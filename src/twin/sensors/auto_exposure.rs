//! Automatic exposure and gain, as the firmware of a camera has it: from delivered images alone.
//!
//! # Theory
//!
//! Above black, a grey level is proportional to light * exposure * gain. Frame k, taken with the
//! product p_k of exposure and gain, measures m_k, so `p_k * target / m_k` would have met the
//! target. Of that and the product in use now the controller takes the geometric mean, weighted by
//! [`ExposureSettings::damping`]: the error shrinks by that factor with every frame, from one side,
//! however late images come in, because each is judged by the product it was taken with. Where an
//! image is clipped, or near black, its mean tells less than there is to correct; a frame moves the
//! product by [`MAX_STEP`] at most. Errors below [`DEAD_BAND`] are left alone, so that noise moves
//! nothing.
//!
//! Exposure is lengthened first, for it adds light and gain only adds noise: gain rises when the
//! exposure is at its limit.
//!
//! What it does not do: flicker avoidance, regions of interest, apertures.
//!
//! ```
//! use metrotwin::twin::sensors::{AutoExposure, Exposed, ExposureMode, ExposureSettings};
//! let settings = ExposureSettings {
//!     mode: ExposureMode::Auto,
//!     max_exposure_us: Some(50.0),
//!     ..ExposureSettings::default()
//! };
//! let mut control = AutoExposure::new(&settings, Exposed { exposure_s: 20e-6, gain_db: 0.0 }, 4.0);
//! let first = control.now();
//! control.on_image(&first, &image::GrayImage::new(64, 48));
//! assert!(control.now().exposure_s > first.exposure_s);
//! ```

use super::CameraSettings;
use crate::settings::{Checker, settings};
use image::GrayImage;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Most that one frame changes exposure times gain by, up or down.
pub const MAX_STEP: f64 = 4.0;
/// Relative error of the measured level that is left alone.
pub const DEAD_BAND: f64 = 0.05;

/// Who sets exposure and gain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ExposureMode {
    /// Nobody: they stay as written.
    #[default]
    Fixed,
    /// The camera, from what it has seen.
    Auto,
}

settings! {
    /// Automatic exposure and gain of a camera, which start as written in its other settings.
    #[derive(Copy)]
    pub struct ExposureSettings {
        /// `fixed` or `auto`.
        mode: ExposureMode = ExposureMode::Fixed;
        /// Share of the pixels that is to be darker than the target: 0.5 for the median, 0.99 to
        /// keep lamps from clipping; 0 for the mean of all pixels instead.
        percentile: f64 = 0.0, in 0.0..=1.0;
        /// Grey level over black to reach.
        target_grey: f64 = 80.0, in 1.0..=250.0;
        /// Shortest exposure, us.
        min_exposure_us: f64 = 10.0, in 0.1..=1e7;
        /// Longest exposure, us; so exposed, all rows must close within a frame, and images are
        /// delivered when such a frame would be over. A rig that reads blinking lamps needs less
        /// than their chip time. Default: the exposure that the camera begins with.
        max_exposure_us: Option<f64> = None, in 0.1..=1e7;
        /// Least gain, dB.
        min_gain_db: f64 = 0.0, in -20.0..=60.0;
        /// Most gain, dB.
        max_gain_db: f64 = 24.0, in -20.0..=60.0;
        /// Share of an error that is left after a frame, 0 to 0.95.
        damping: f64 = 0.5, in 0.0..=0.95;
    }
}

impl ExposureSettings {
    /// The longest exposure of a camera that begins with `exposure_us`, us.
    pub fn longest_us(&self, exposure_us: f64) -> f64 {
        match self.mode {
            ExposureMode::Fixed => exposure_us,
            ExposureMode::Auto => exposure_us.max(self.max_exposure_us.unwrap_or(exposure_us)),
        }
    }

    /// Limits that an automatic control needs, of a camera that begins with `exposure_us`. Whether the
    /// longest exposure fits into a frame, the camera knows.
    pub fn check_limits(&self, exposure_us: f64, check: &mut Checker<'_>) {
        if self.mode == ExposureMode::Fixed {
            return;
        }
        let most_us = self.max_exposure_us.filter(|us| !us.is_nan());
        let most_us = most_us.unwrap_or(exposure_us);
        check.within("min_exposure_us", self.min_exposure_us, 0.1..=most_us);
        check.within("min_gain_db", self.min_gain_db, -20.0..=self.max_gain_db);
    }
}

/// What a frame is taken with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposed {
    /// How long every row collects light.
    pub exposure_s: f64,
    /// Gain before the converter.
    pub gain_db: f64,
}

impl Exposed {
    /// Exposure times gain.
    fn product_s(&self) -> f64 {
        self.exposure_s * 10f64.powf(self.gain_db / 20.0)
    }
}

/// The controller of one camera, or of the master of a pair.
#[derive(Clone, Debug)]
pub struct AutoExposure {
    settings: ExposureSettings,
    max_exposure_s: f64,
    black_grey: f64,
    now: Exposed,
}

impl AutoExposure {
    /// Begins with `start`; darkness has `black_grey`.
    pub fn new(settings: &ExposureSettings, start: Exposed, black_grey: f64) -> Self {
        Self {
            settings: *settings,
            max_exposure_s: settings
                .max_exposure_us
                .map_or(start.exposure_s, |us| 1e-6 * us),
            black_grey,
            now: start,
        }
    }

    /// Of a camera, begins as its settings say.
    pub(super) fn of(camera: &CameraSettings) -> Self {
        let start = Exposed {
            exposure_s: 1e-6 * camera.exposure_us,
            gain_db: camera.sensor.gain_db,
        };
        let black_grey = camera.sensor.black_level_grey;
        Self::new(&camera.exposure_control, start, black_grey)
    }

    /// What the next frame is taken with.
    pub fn now(&self) -> Exposed {
        self.now
    }

    /// An image is delivered that was taken with `taken`.
    pub fn on_image(&mut self, taken: &Exposed, image: &GrayImage) {
        if self.settings.mode == ExposureMode::Fixed {
            return;
        }
        let over_black = self.level(image) - self.black_grey;
        let wanted = self.settings.target_grey / over_black.max(0.5);
        if (wanted - 1.0).abs() < DEAD_BAND {
            return;
        }
        let wanted = wanted.clamp(1.0 / MAX_STEP, MAX_STEP);
        let aim = taken.product_s() * wanted;
        let left = self.settings.damping;
        self.now = self.split(self.now.product_s().powf(left) * aim.powf(1.0 - left));
    }

    /// The level that is held against the target.
    fn level(&self, image: &GrayImage) -> f64 {
        if image.is_empty() {
            return self.black_grey;
        }
        let count = image.len() as f64;
        if self.settings.percentile <= 0.0 {
            return image.iter().map(|x| f64::from(*x)).sum::<f64>() / count;
        }
        let mut histogram = [0u32; 256];
        for x in image.iter() {
            histogram[usize::from(*x)] += 1;
        }
        let mut left = self.settings.percentile * count;
        for (grey, pixels) in histogram.iter().enumerate() {
            left -= f64::from(*pixels);
            if left <= 0.0 {
                return grey as f64;
            }
        }
        255.0
    }

    /// Exposure first, then gain, within their limits.
    fn split(&self, product_s: f64) -> Exposed {
        let limits = &self.settings;
        let least = 10f64.powf(limits.min_gain_db / 20.0);
        let shortest_s = (1e-6 * limits.min_exposure_us).min(self.max_exposure_s);
        let exposure_s = (product_s / least).clamp(shortest_s, self.max_exposure_s);
        let gain_db = 20.0 * (product_s / exposure_s).log10();
        Exposed {
            exposure_s,
            gain_db: gain_db.clamp(limits.min_gain_db, limits.max_gain_db),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Settings;
    use crate::twin::random::Stream;
    use std::collections::VecDeque;

    const BLACK: f64 = 4.0;

    fn auto() -> ExposureSettings {
        ExposureSettings {
            mode: ExposureMode::Auto,
            min_exposure_us: 5.0,
            max_exposure_us: Some(50.0),
            ..ExposureSettings::default()
        }
    }

    fn start() -> Exposed {
        Exposed {
            exposure_s: 20e-6,
            gain_db: 0.0,
        }
    }

    /// A scene from half to one and a half times `light`, grey levels a microsecond, with noise.
    fn image(light: f64, with: &Exposed, number: u32) -> GrayImage {
        let stream = Stream::new(8, number.into(), "picture");
        GrayImage::from_fn(40, 30, |x, y| {
            let signal = light * (0.5 + f64::from(x) / 39.0) * 1e6 * with.product_s();
            let noise = 2.0 * stream.normal(u64::from(40 * y + x));
            [(BLACK + signal + noise).round().clamp(0.0, 255.0) as u8].into()
        })
    }

    /// Products frame by frame; images come in `latency` frames after they are taken.
    fn run(
        settings: &ExposureSettings,
        latency: usize,
        light: impl Fn(u32) -> f64,
    ) -> Vec<Exposed> {
        let mut control = AutoExposure::new(settings, start(), BLACK);
        let mut on_the_way = VecDeque::new();
        (0..80)
            .map(|number| {
                let with = control.now();
                on_the_way.push_back((with, image(light(number), &with, number)));
                if on_the_way.len() > latency
                    && let Some((taken, image)) = on_the_way.pop_front()
                {
                    control.on_image(&taken, &image);
                }
                with
            })
            .collect()
    }

    /// Fails where late images are corrected twice, which swings, or noise moves what is right:
    /// after a step of brightness, up or down, the product goes to its place from one side and
    /// stays there.
    #[test]
    fn a_step_of_brightness_is_followed_without_hunting() {
        for (before, after) in [(4.0, 1.2), (1.2, 4.0), (1.0, 12.0)] {
            for latency in [0, 1, 2, 4] {
                let light = |number| if number < 40 { before } else { after };
                let taken = run(&auto(), latency, light);
                for (range, light) in [(0..40, before), (40..80, after)] {
                    let right_s = 1e-6 * auto().target_grey / light;
                    let off: Vec<_> = taken[range]
                        .iter()
                        .map(|e| e.product_s() / right_s)
                        .collect();
                    let last = off[off.len() - 1];
                    assert!((last - 1.0).abs() < 1.5 * DEAD_BAND, "{latency}: {last}");
                    let settled = off.len() - 15;
                    assert!(
                        off[settled..].iter().all(|x| (x - last).abs() < 1e-12),
                        "{off:?}"
                    );
                    // From one side: never beyond by more than the dead band.
                    let from_below = off[0] < 1.0;
                    let beyond = |x: &f64| if from_below { x - 1.0 } else { 1.0 - x };
                    assert!(
                        off.iter().all(|x| beyond(x) < 1.5 * DEAD_BAND),
                        "{latency}: {off:?}"
                    );
                }
            }
        }
    }

    /// Fails where limits are overstepped, or gain is used before exposure is.
    #[test]
    fn limits_hold_and_exposure_goes_first() {
        let settings = auto();
        let dark = run(&settings, 1, |_| 0.01);
        let last = dark[dark.len() - 1];
        assert!((last.exposure_s - 50e-6).abs() < 1e-12 && (last.gain_db - 24.0).abs() < 1e-9);
        let bright = run(&settings, 1, |_| 1e3);
        let last = bright[bright.len() - 1];
        assert!((last.exposure_s - 5e-6).abs() < 1e-12 && last.gain_db.abs() < 1e-9);
        for with in dark.iter().chain(&bright) {
            assert!(
                with.gain_db < 1e-9 || with.exposure_s > 49.999e-6,
                "{with:?}"
            );
        }
    }

    /// Fails where a high percentile does not keep the brightest part from clipping, and where a
    /// fixed camera moves.
    #[test]
    fn percentiles_and_fixed_cameras() {
        let settings = ExposureSettings {
            percentile: 0.95,
            target_grey: 200.0,
            ..auto()
        };
        let taken = run(&settings, 1, |_| 4.0);
        // 95 % of the picture is darker than 1.45 times its mean.
        let right_s = 1e-6 * 200.0 / (4.0 * 1.45);
        let last = taken[taken.len() - 1].product_s() / right_s;
        assert!((last - 1.0).abs() < 1.5 * DEAD_BAND, "{last}");
        let fixed = run(&ExposureSettings::default(), 1, |_| 4.0);
        assert!(fixed.iter().all(|with| *with == start()));
    }

    /// Fails where limits that exclude each other get through, or bind a camera that nobody controls.
    #[test]
    fn bad_limits_are_refused() {
        let keys = |settings: ExposureSettings, exposure_us: f64| {
            let mut problems = Vec::new();
            settings.check("exposure", &mut problems);
            settings.check_limits(exposure_us, &mut Checker::new("exposure", &mut problems));
            problems.into_iter().map(|p| p.key).collect::<Vec<_>>()
        };
        assert_eq!(keys(auto(), 30.0), [""; 0]);
        assert_eq!(keys(ExposureSettings::default(), 5.0), [""; 0]);
        let crossed = ExposureSettings {
            min_exposure_us: 60.0,
            min_gain_db: 30.0,
            ..auto()
        };
        let expected = ["exposure.min_exposure_us", "exposure.min_gain_db"];
        assert_eq!(keys(crossed, 30.0), expected);
        let never = ExposureSettings {
            max_exposure_us: Some(f64::NAN),
            ..auto()
        };
        assert_eq!(keys(never, 30.0), ["exposure.max_exposure_us"]);
    }

    /// Fails where a written exposure over the limit is forgotten, which the first frames have.
    #[test]
    fn the_longest_exposure_is_the_written_one_or_the_limit() {
        assert!((auto().longest_us(30.0) - 50.0).abs() < 1e-12);
        assert!((auto().longest_us(70.0) - 70.0).abs() < 1e-12);
        let fixed = ExposureSettings {
            mode: ExposureMode::Fixed,
            ..auto()
        };
        assert!((fixed.longest_us(30.0) - 30.0).abs() < 1e-12);
    }
}
