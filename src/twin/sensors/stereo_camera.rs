//! The stereo camera on a train, at work: when it triggers, what there is to draw, what it delivers.

use super::{
    AutoExposure, Capture, ClockSettings, FrameHeader, Output, RigSettings, Sensor, SensorError,
    Trigger,
};
use crate::bus::{CameraModel, Content, RigCalibration, SimTime, StereoPair, Ticker, TrainId};
use crate::twin::faults::{CameraFaultSettings, CameraFaults, CameraOutput, rig_cameras};
use crate::twin::physics::World;
use crate::twin::random::Stream;
use crate::twin::render::{CameraMotion, NoiseKey, View};
use image::GrayImage;
use nalgebra::Isometry3;

/// Spacing of the poses handed to the renderer: the step of the physics.
const POSE_STEP_S: f64 = 1e-3;

/// The stereo camera as it is built: it may differ from the calibration.
#[derive(Debug)]
pub struct StereoCamera {
    train: TrainId,
    /// Both eyes and the mount as they really are.
    rig: RigCalibration,
    /// Pixels, glass and sensor of either eye, and what the sheet says of the trigger.
    settings: RigSettings,
    ticker: Ticker,
    clock: ClockSettings,
    trigger: Trigger,
    /// How much later than the left eye the right one is really triggered.
    right_later_s: f64,
    /// How many poses, [`POSE_STEP_S`] apart, cover a frame of the longest exposure that it may have.
    poses: usize,
    /// Noise of the left and right eye.
    streams: [Stream; 2],
    /// Exposure and gain of both eyes, set by what the left one sees.
    exposure: AutoExposure,
    /// Of whole pairs.
    faults: CameraFaults,
    /// What either eye delivers.
    outputs: [CameraOutput; 2],
}

impl StereoCamera {
    /// The rig of a train as it really is, with the noise and the faults of a run's seed.
    pub fn new(
        train: TrainId,
        rig: &RigSettings,
        faults: &[CameraFaultSettings],
        seed: u64,
    ) -> Self {
        let trigger = Stream::new(seed, 0, "stereo/trigger");
        let of = |names: &[&str]| CameraFaults::of(names, faults, seed);
        let [both, left, right] = rig_cameras(train);
        Self {
            train,
            rig: rig.actual(),
            ticker: Ticker::new(rig.pairs_per_s),
            clock: rig.clock,
            trigger: Trigger::new(trigger, rig.frame_jitter_us),
            right_later_s: rig.as_built().trigger_offset_s(),
            poses: (rig.as_built().longest_span_s() / POSE_STEP_S).ceil() as usize + 1,
            streams: ["stereo/left", "stereo/right"].map(|eye| Stream::new(seed, 0, eye)),
            exposure: AutoExposure::of(&rig.exposure_control, rig.exposure_us, &rig.sensor),
            faults: of(&[&both]),
            outputs: [left, right].map(|eye| CameraOutput::new(of(&[&both, &eye]))),
            settings: rig.clone(),
        }
    }

    /// From the start of a pair to the last pose that drawing it needs.
    pub fn delay_s(&self) -> f64 {
        let poses_s = (self.poses - 1) as f64 * POSE_STEP_S;
        poses_s + self.right_later_s.max(0.0) + self.trigger.latest_s()
    }

    /// The views of a pair, left then right, for a vehicle that moves as `vehicle_at` says.
    /// `None` where its pose is unknown at some time.
    fn views(
        &self,
        number: u32,
        start: SimTime,
        vehicle_at: impl Fn(SimTime) -> Option<Isometry3<f64>>,
    ) -> Option<[View; 2]> {
        let start = self.trigger.really(number, start);
        let right_start = start.plus(self.right_later_s).max(SimTime::ZERO);
        let left_at = |time| Some(vehicle_at(time)? * self.rig.vehicle_from_left);
        let right_at = |time| Some(left_at(time)? * self.rig.left_from_right);
        let left = (&self.rig.left, self.streams[0]);
        let right = (&self.rig.right, self.streams[1]);
        Some([
            self.view(left, number, start, left_at)?,
            self.view(right, number, right_start, right_at)?,
        ])
    }

    fn view(
        &self,
        (eye, stream): (&CameraModel, Stream),
        number: u32,
        start: SimTime,
        eye_at: impl Fn(SimTime) -> Option<Isometry3<f64>>,
    ) -> Option<View> {
        let poses = (0..self.poses).map(|k| eye_at(start.plus(k as f64 * POSE_STEP_S)));
        Some(View {
            camera: *eye,
            start,
            motion: CameraMotion {
                first: start,
                step_s: POSE_STEP_S,
                poses: poses.collect::<Option<_>>()?,
            },
            pixel_m: 1e-6 * self.settings.pixel_um,
            lens: self.settings.lens,
            sensor: self.settings.sensor,
            noise: NoiseKey {
                stream,
                frame: number,
            },
        })
    }

    /// Puts two images together as the camera delivers them, with the times that its sheet has.
    fn pair(&self, header: &FrameHeader, [left, right]: [GrayImage; 2]) -> StereoPair {
        let of_right = FrameHeader {
            start: header.start.plus(self.settings.trigger_offset_s()),
            ..*header
        };
        StereoPair {
            left: header.frame(left),
            right: of_right.frame(right),
        }
    }
}

impl Sensor for StereoCamera {
    /// A pair whose rows are over and that is not lost.
    fn sample(&mut self, world: &World) -> Result<Vec<Output>, SensorError> {
        let (clock, now, delay_s) = (self.clock, world.time(), self.delay_s());
        let over = |start| now >= clock.time_of(start).plus(delay_s);
        let Some((number, start)) = self.ticker.next_if(over) else {
            return Ok(Vec::new());
        };
        let start_true = self.clock.time_of(start);
        // What would have begun before time zero was not taken.
        if start_true < SimTime::ZERO || self.faults.drops(number, start_true) {
            return Ok(Vec::new());
        }
        let vehicle_at = |time| world.vehicle_at(self.train, self.settings.end, time);
        let mut views = (self.views(number, start_true, vehicle_at))
            .ok_or(SensorError::PoseForgotten(start_true.secs()))?;
        let with = self.exposure.expose(&mut views);
        // A pair is complete with the later eye.
        let late = self.outputs.iter().map(|eye| eye.late_s(start_true));
        Ok(vec![Output::Capture(Capture {
            header: FrameHeader {
                number,
                start,
                start_true,
                with,
            },
            views: views.into(),
            late_s: late.fold(0.0, f64::max),
        })])
    }

    fn read_out(
        &mut self,
        header: &FrameHeader,
        images: Vec<GrayImage>,
    ) -> Result<Option<Content>, SensorError> {
        let [left, right] = <[GrayImage; 2]>::try_from(images)
            .map_err(|images| SensorError::Images(2, images.len()))?;
        self.exposure.on_image(&header.with, &left);
        let (number, start) = (header.number, header.start_true);
        let [of_left, of_right] = &mut self.outputs;
        let delivered = [
            of_left.deliver(number, start, left),
            of_right.deliver(number, start, right),
        ];
        Ok(Some(Content::Pair(self.pair(header, delivered))))
    }
}

#[cfg(test)]
mod tests;
