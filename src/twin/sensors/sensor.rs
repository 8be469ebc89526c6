//! What all sensors have in common.

use super::Exposed;
use crate::bus::{Content, Frame, SimTime, Ticker};
use crate::settings::settings;
use crate::twin::physics::World;
use crate::twin::render::View;
use image::GrayImage;

/// A sensor at its mount on a train or a wayside post.
pub trait Sensor {
    /// What has become due by the world's time; called after every step of the world.
    fn sample(&mut self, world: &World) -> Result<Vec<Output>, SensorError>;

    /// Reads out the images of a capture, in the order of its views. Only cameras have any.
    fn read_out(
        &mut self,
        header: &FrameHeader,
        images: Vec<GrayImage>,
    ) -> Result<Option<Content>, SensorError> {
        let _ = (header, images);
        Ok(None)
    }
}

/// What a sensor gives.
#[allow(
    clippy::large_enum_variant,
    reason = "it is taken apart at once; boxes would cost an allocation a sample"
)]
pub enum Output {
    /// A sample.
    Sample(SensorSample),
    /// Images that are over, and have yet to be drawn.
    Capture(Capture),
}

impl Output {
    /// A sample that reaches the equipment at once.
    pub(super) fn at_once(valid_at: SimTime, content: Content) -> Self {
        Self::Sample(SensorSample {
            valid_at,
            delay_s: 0.0,
            content,
        })
    }
}

/// A sample of a sensor without images.
pub struct SensorSample {
    /// When it was true, by the sensor's clock.
    pub valid_at: SimTime,
    /// From now until it reaches the equipment, seconds.
    pub delay_s: f64,
    /// What it says.
    pub content: Content,
}

/// The images of one or more cameras that are read out together.
pub struct Capture {
    /// What the frame says of itself.
    pub header: FrameHeader,
    /// What there is to draw.
    pub views: Vec<View>,
    /// By how much its images come later than usual.
    pub late_s: f64,
}

/// What a camera says of a frame: all of it but the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameHeader {
    /// Number of the frame.
    pub number: u32,
    /// When it started, by the camera's clock.
    pub start: SimTime,
    /// When it really started, but for jitter.
    pub start_true: SimTime,
    /// What it was taken with.
    pub with: Exposed,
}

impl FrameHeader {
    /// With its image.
    pub fn frame(&self, image: GrayImage) -> Frame {
        Frame {
            number: self.number,
            start: self.start,
            exposure_s: self.with.exposure_s,
            gain_db: self.with.gain_db,
            image,
        }
    }
}

/// Why a sensor could not work.
#[derive(Debug, thiserror::Error)]
pub enum SensorError {
    /// A frame is longer than the poses that the world keeps.
    #[error(
        "the pose of the train at {0:.4} s is no longer known: a frame is longer than the world's memory"
    )]
    PoseForgotten(f64),
    /// The renderer gave another number of images than it was asked for.
    #[error("{1} images were drawn in place of {0}")]
    Images(usize, usize),
}

settings! {
    /// How far a sensor's clock is off.
    #[derive(Copy)]
    pub struct ClockSettings {
        /// By how much it is fast at the start, ms.
        offset_ms: f64 = 0.0, in -100.0..=100.0;
        /// By how much it gains, millionths. A quartz without compensation has 20 to 50.
        drift_ppm: f64 = 0.0, in -1000.0..=1000.0;
    }
}

impl ClockSettings {
    /// What the clock shows at a time.
    pub fn local(&self, time: SimTime) -> SimTime {
        if self.is_exact() {
            return time;
        }
        time.plus(1e-3 * self.offset_ms + 1e-6 * self.drift_ppm * time.secs())
    }

    /// When the clock shows a time.
    pub fn time_of(&self, local: SimTime) -> SimTime {
        if self.is_exact() {
            return local;
        }
        let drift = 1e-6 * self.drift_ppm;
        SimTime::from_secs((local.secs() - 1e-3 * self.offset_ms) / (1.0 + drift))
    }

    fn is_exact(&self) -> bool {
        self.offset_ms == 0.0 && self.drift_ppm == 0.0
    }
}

/// A sensor that is read at a fixed rate of its own clock: `read` gives what it says at the world's
/// time, which its clock shows as the second argument.
pub struct Periodic<F> {
    ticker: Ticker,
    clock: ClockSettings,
    read: F,
}

impl<F: FnMut(&World, SimTime) -> Option<Content>> Periodic<F> {
    /// Read so many times a second.
    pub fn new(rate_hz: f64, clock: ClockSettings, read: F) -> Self {
        Self {
            ticker: Ticker::new(rate_hz),
            clock,
            read,
        }
    }
}

impl<F: FnMut(&World, SimTime) -> Option<Content>> Sensor for Periodic<F> {
    fn sample(&mut self, world: &World) -> Result<Vec<Output>, SensorError> {
        let local = self.clock.local(world.time());
        if self.ticker.due(local, 0.0).is_none() {
            return Ok(Vec::new());
        }
        let content = (self.read)(world, local);
        let sample = content.map(|content| Output::at_once(local, content));
        Ok(sample.into_iter().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fails where the two directions do not undo each other, a clock without error changes a time, or
    /// the drift has the wrong sign.
    #[test]
    fn clocks_are_off_and_back() {
        let exact = ClockSettings::default();
        let time = SimTime::from_nanos(123_456_789_123);
        assert_eq!(exact.local(time), time);
        assert_eq!(exact.time_of(time), time);
        let clock = ClockSettings {
            offset_ms: 2.0,
            drift_ppm: 50.0,
        };
        assert!((clock.local(SimTime::from_secs(100.0)).secs() - 100.007).abs() < 1e-9);
        assert!(clock.time_of(clock.local(time)).since(time).abs() < 2e-9);
    }
}
