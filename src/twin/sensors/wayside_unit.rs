//! Camera and lidar of a wayside post, at work.

use super::imager::Imager;
use super::lidar::Lidar;
use super::{CameraSettings, Capture, FrameHeader, Output, Sensor, SensorError, SensorSample};
use crate::bus::{Content, Ticker, WaysideCalibration};
use crate::twin::faults::{CameraFaultSettings, CameraFaults};
use crate::twin::physics::World;
use crate::twin::random::Stream;
use crate::twin::render::CameraMotion;
use image::GrayImage;

/// The camera of a wayside device.
pub struct WaysideCamera {
    /// Where it really hangs and looks.
    actual: WaysideCalibration,
    imager: Imager,
    /// From the start of a frame to the closing of its last row, at the latest.
    delay_s: f64,
    noise: Stream,
    output: CameraFaults,
}

impl WaysideCamera {
    /// As it really hangs, with the noise and the faults of a run's seed.
    pub fn new(
        actual: &WaysideCalibration,
        settings: &CameraSettings,
        faults: &[CameraFaultSettings],
        seed: u64,
    ) -> Self {
        let name = &actual.name;
        let stream = |of: &str| Stream::new(seed, 0, &format!("wayside_camera/{name}{of}"));
        let faults = CameraFaults::of(&[name], faults, seed);
        Self {
            actual: actual.clone(),
            imager: Imager::new(*settings, stream("/trigger"), faults.clone()),
            delay_s: settings.longest_span_s() + settings.most_jitter_s(),
            noise: stream(""),
            output: faults,
        }
    }
}

impl Sensor for WaysideCamera {
    /// A frame whose last row has closed, however long it was exposed, and that is not lost.
    fn sample(&mut self, world: &World) -> Result<Vec<Output>, SensorError> {
        let Some(header) = self.imager.next(world.time(), self.delay_s) else {
            return Ok(Vec::new());
        };
        let (number, start_true) = (header.number, header.start_true);
        let start = self.imager.really(number, start_true);
        let motion = CameraMotion::still(self.actual.world_from_camera);
        let noise = (self.noise, number);
        let view = self.imager.view(self.actual.camera, start, motion, noise);
        Ok(vec![Output::Capture(Capture {
            header,
            views: vec![view],
            late_s: self.output.late_s(start_true),
        })])
    }

    fn read_out(
        &mut self,
        header: &FrameHeader,
        mut images: Vec<GrayImage>,
    ) -> Result<Option<Content>, SensorError> {
        let image = images.pop().ok_or(SensorError::Images(1, 0))?;
        self.imager.expose(header, &image);
        let image = (self.output).deliver(header.number, header.start_true, image);
        Ok(Some(Content::Frame(header.frame(image))))
    }
}

/// The lidar of a wayside device: its head turns at its own rate.
pub struct WaysideLidar {
    lidar: Lidar,
    ticker: Ticker,
    delay_s: f64,
}

impl WaysideLidar {
    /// Its sweeps reach the equipment `delay_s` after their last shot.
    pub fn new(lidar: Lidar, delay_s: f64) -> Self {
        Self {
            ticker: Ticker::new(lidar.settings.rate_hz),
            lidar,
            delay_s,
        }
    }
}

impl Sensor for WaysideLidar {
    fn sample(&mut self, world: &World) -> Result<Vec<Output>, SensorError> {
        let clock = self.lidar.settings.clock;
        let local = clock.local(world.time());
        let Some((number, start)) = self.ticker.due(local, self.lidar.sweep_s()) else {
            return Ok(Vec::new());
        };
        let bodies = world.bodies(None);
        let time = clock.time_of(start);
        let mut scan = self.lidar.scan(time, number, world.time(), &bodies);
        scan.time = start;
        Ok(vec![Output::Sample(SensorSample {
            valid_at: start,
            delay_s: self.delay_s,
            content: Content::Scan(scan),
        })])
    }
}
