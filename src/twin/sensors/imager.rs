//! What all cameras do alike: when a frame is taken, how it is exposed, whether it is lost.

use super::camera::MOST_SIGMAS;
use super::{AutoExposure, CameraSettings, FrameHeader};
use crate::bus::{CameraModel, SimTime, Ticker};
use crate::twin::faults::CameraFaults;
use crate::twin::random::Stream;
use crate::twin::render::{CameraMotion, NoiseKey, SensorSettings, View};
use image::GrayImage;

/// A camera at work, or two that are triggered and exposed as one.
#[derive(Debug)]
pub(super) struct Imager {
    settings: CameraSettings,
    ticker: Ticker,
    /// Jitter of its trigger.
    jitter: Stream,
    exposure: AutoExposure,
    faults: CameraFaults,
}

impl Imager {
    /// With the jitter of its trigger drawn from a stream.
    pub fn new(settings: CameraSettings, jitter: Stream, faults: CameraFaults) -> Self {
        Self {
            ticker: Ticker::new(settings.frames_per_s),
            jitter,
            exposure: AutoExposure::of(&settings),
            faults,
            settings,
        }
    }

    /// The next frame that is over, `delay_s` after its start, and not lost.
    pub fn next(&mut self, now: SimTime, delay_s: f64) -> Option<FrameHeader> {
        let clock = self.settings.clock;
        let over = |start| now >= clock.time_of(start).plus(delay_s);
        let (number, start) = self.ticker.next_if(over)?;
        let start_true = clock.time_of(start);
        // What would have begun before time zero was not taken.
        let taken = start_true >= SimTime::ZERO && !self.faults.drops(number, start_true);
        taken.then_some(FrameHeader {
            number,
            start,
            start_true,
            with: self.exposure.now(),
        })
    }

    /// When frame `number`, triggered at `start` as it says, really starts. Nothing is seen before
    /// time zero.
    pub fn really(&self, number: u32, start: SimTime) -> SimTime {
        let sigmas = self.jitter.normal(u64::from(number));
        let sigmas = sigmas.clamp(-MOST_SIGMAS, MOST_SIGMAS);
        let late_us = self.settings.frame_jitter_us * sigmas;
        start.plus(1e-6 * late_us).max(SimTime::ZERO)
    }

    /// The latest that a frame can start after the time that it says.
    pub fn latest_s(&self) -> f64 {
        self.settings.most_jitter_s()
    }

    /// What there is to draw of its next frame, through one lens, with noise of a stream by the
    /// frame's number.
    pub fn view(
        &self,
        mut camera: CameraModel,
        start: SimTime,
        motion: CameraMotion,
        (stream, frame): (Stream, u32),
    ) -> View {
        let with = self.exposure.now();
        camera.shutter.exposure_s = with.exposure_s;
        View {
            camera,
            start,
            motion,
            pixel_m: 1e-6 * self.settings.pixel_um,
            lens: self.settings.lens,
            sensor: SensorSettings {
                gain_db: with.gain_db,
                ..self.settings.sensor
            },
            noise: NoiseKey { stream, frame },
        }
    }

    /// Sets the exposure by what its sensor saw.
    pub fn expose(&mut self, header: &FrameHeader, seen: &GrayImage) {
        self.exposure.on_image(&header.with, seen);
    }
}
