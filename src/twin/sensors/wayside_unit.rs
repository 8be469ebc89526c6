//! Camera and lidar of a wayside post, at work.

use super::lidar::Lidar;
use super::{
    AutoExposure, Capture, ClockSettings, FrameHeader, Output, Sample, Sensor, SensorError,
    Trigger, WaysideCameraSettings,
};
use crate::bus::{Content, SimTime, Ticker, WaysideCalibration};
use crate::twin::faults::{CameraFaultSettings, CameraFaults, CameraOutput};
use crate::twin::physics::World;
use crate::twin::random::Stream;
use crate::twin::render::{CameraMotion, NoiseKey, View};
use image::GrayImage;

/// The camera of a wayside device.
pub struct WaysideCamera {
    /// Where it really hangs and looks.
    actual: WaysideCalibration,
    settings: WaysideCameraSettings,
    exposure: AutoExposure,
    noise: Stream,
    trigger: Trigger,
    ticker: Ticker,
    clock: ClockSettings,
    faults: CameraFaults,
    output: CameraOutput,
}

impl WaysideCamera {
    /// As it really hangs, with the noise and the faults of a run's seed.
    pub fn new(
        actual: &WaysideCalibration,
        settings: &WaysideCameraSettings,
        faults: &[CameraFaultSettings],
        seed: u64,
    ) -> Self {
        let name = &actual.name;
        let stream = |of: &str| Stream::new(seed, 0, &format!("wayside_camera/{name}{of}"));
        let faults = CameraFaults::of(&[name], faults, seed);
        Self {
            actual: actual.clone(),
            exposure: AutoExposure::of(
                &settings.exposure_control,
                settings.exposure_us,
                &settings.sensor,
            ),
            noise: stream(""),
            trigger: Trigger::new(stream("/trigger"), settings.frame_jitter_us),
            ticker: Ticker::new(settings.frames_per_s),
            clock: settings.clock,
            output: CameraOutput::new(faults.clone()),
            faults,
            settings: settings.clone(),
        }
    }

    fn view(&self, number: u32, start: SimTime) -> View {
        View {
            camera: self.actual.camera,
            start,
            motion: CameraMotion::still(self.actual.world_from_camera),
            pixel_m: 1e-6 * self.settings.pixel_um,
            lens: self.settings.lens,
            sensor: self.settings.sensor,
            noise: NoiseKey {
                stream: self.noise,
                frame: number,
            },
        }
    }
}

impl Sensor for WaysideCamera {
    /// A frame whose last row has closed, however long it was exposed, and that is not lost.
    fn sample(&mut self, world: &World) -> Result<Vec<Output>, SensorError> {
        let delay_s = self.settings.longest_span_s() + self.trigger.latest_s();
        let (clock, now) = (self.clock, world.time());
        let over = |start| now >= clock.time_of(start).plus(delay_s);
        let Some((number, start)) = self.ticker.next_if(over) else {
            return Ok(Vec::new());
        };
        let start_true = self.clock.time_of(start);
        // What would have begun before time zero was not taken.
        if start_true < SimTime::ZERO || self.faults.drops(number, start_true) {
            return Ok(Vec::new());
        }
        let mut views = vec![self.view(number, self.trigger.really(number, start_true))];
        let header = FrameHeader {
            number,
            start,
            start_true,
            with: self.exposure.expose(&mut views),
        };
        let late_s = self.faults.late_s(start_true);
        Ok(vec![Output::Capture(Capture {
            header,
            views,
            late_s,
        })])
    }

    fn read_out(
        &mut self,
        header: &FrameHeader,
        mut images: Vec<GrayImage>,
    ) -> Result<Option<Content>, SensorError> {
        let image = images.pop().ok_or(SensorError::Images(1, 0))?;
        // Exposure is set by what the sensor saw.
        self.exposure.on_image(&header.with, &image);
        let image = (self.output).deliver(header.number, header.start_true, image);
        Ok(Some(Content::Frame(header.frame(image))))
    }
}

/// The lidar of a wayside device: its head turns at its own rate.
pub struct WaysideLidar {
    lidar: Lidar,
    ticker: Ticker,
    clock: ClockSettings,
    delay_s: f64,
}

impl WaysideLidar {
    /// Its sweeps reach the equipment `delay_s` after their last shot.
    pub fn new(lidar: Lidar, clock: ClockSettings, delay_s: f64) -> Self {
        Self {
            ticker: Ticker::new(1.0 / lidar.period_s()),
            lidar,
            clock,
            delay_s,
        }
    }
}

impl Sensor for WaysideLidar {
    fn sample(&mut self, world: &World) -> Result<Vec<Output>, SensorError> {
        let local = self.clock.local(world.time());
        let Some((number, start)) = self.ticker.due(local, self.lidar.sweep_s()) else {
            return Ok(Vec::new());
        };
        let bodies = world.bodies(None);
        let time = self.clock.time_of(start);
        let mut scan = self.lidar.scan(time, number, world.time(), &bodies);
        scan.time = start;
        Ok(vec![Output::Sample(Sample {
            valid_at: start,
            delay_s: self.delay_s,
            content: Content::Scan(scan),
        })])
    }
}
