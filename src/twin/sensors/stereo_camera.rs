//! The stereo camera on a train, at work: when it triggers, what there is to draw, what it delivers.

use super::imager::Imager;
use super::{Capture, FrameHeader, Output, RigSettings, Sensor, SensorError};
use crate::bus::{CameraModel, Content, RigCalibration, SimTime, StereoPair, TrainEnd, TrainId};
use crate::twin::faults::{CameraFaultSettings, CameraFaults, rig_cameras};
use crate::twin::physics::World;
use crate::twin::random::Stream;
use crate::twin::render::{CameraMotion, View};
use image::GrayImage;
use nalgebra::Isometry3;

/// Spacing of the poses handed to the renderer: the step of the physics.
const POSE_STEP_S: f64 = 1e-3;

/// The stereo camera as it is built: it may differ from the calibration.
#[derive(Debug)]
pub struct StereoCamera {
    train: TrainId,
    /// Where on the train it is.
    end: TrainEnd,
    /// Both eyes and the mount as they really are.
    rig: RigCalibration,
    /// What both eyes have in common.
    imager: Imager,
    /// How much later than the left eye the right one is triggered, as the sheet has it.
    sheet_later_s: f64,
    /// And as it really is.
    right_later_s: f64,
    /// How many poses, [`POSE_STEP_S`] apart, cover a frame of the longest exposure that it may have.
    poses: usize,
    /// Noise of the left and right eye.
    streams: [Stream; 2],
    /// What either eye delivers.
    outputs: [CameraFaults; 2],
}

impl StereoCamera {
    /// The rig of a train as it really is, with the noise and the faults of a run's seed.
    pub fn new(
        train: TrainId,
        rig: &RigSettings,
        faults: &[CameraFaultSettings],
        seed: u64,
    ) -> Self {
        let built = rig.as_built();
        let trigger = Stream::new(seed, 0, "stereo/trigger");
        let of = |names: &[&str]| CameraFaults::of(names, faults, seed);
        let [both, left, right] = rig_cameras(train);
        Self {
            train,
            end: rig.end,
            rig: built.calibration(),
            imager: Imager::new(rig.left_eye(), trigger, of(&[&both])),
            sheet_later_s: rig.trigger_offset_s(),
            right_later_s: built.trigger_offset_s(),
            poses: (built.longest_span_s() / POSE_STEP_S).ceil() as usize + 1,
            streams: ["stereo/left", "stereo/right"].map(|eye| Stream::new(seed, 0, eye)),
            outputs: [left, right].map(|eye| of(&[&both, &eye])),
        }
    }

    /// From the start of a pair to the last pose that drawing it needs.
    pub fn delay_s(&self) -> f64 {
        let poses_s = (self.poses - 1) as f64 * POSE_STEP_S;
        poses_s + self.right_later_s.max(0.0) + self.imager.latest_s()
    }

    /// The views of a pair, left then right, for a vehicle that moves as `vehicle_at` says.
    /// `None` where its pose is unknown at some time.
    fn views(
        &self,
        number: u32,
        start: SimTime,
        vehicle_at: impl Fn(SimTime) -> Option<Isometry3<f64>>,
    ) -> Option<[View; 2]> {
        let start = self.imager.really(number, start);
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
        let motion = CameraMotion {
            first: start,
            step_s: POSE_STEP_S,
            poses: poses.collect::<Option<_>>()?,
        };
        Some(self.imager.view(*eye, start, motion, (stream, number)))
    }

    /// Puts two images together as the camera delivers them, with the times that its sheet has.
    fn pair(&self, header: &FrameHeader, [left, right]: [GrayImage; 2]) -> StereoPair {
        let of_right = FrameHeader {
            start: header.start.plus(self.sheet_later_s),
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
        let delay_s = self.delay_s();
        let Some(header) = self.imager.next(world.time(), delay_s) else {
            return Ok(Vec::new());
        };
        let start_true = header.start_true;
        let vehicle_at = |time| world.vehicle_at(self.train, self.end, time);
        let views = (self.views(header.number, start_true, vehicle_at))
            .ok_or(SensorError::PoseForgotten(start_true.secs()))?;
        // A pair is complete with the later eye.
        let late = self.outputs.iter().map(|eye| eye.late_s(start_true));
        Ok(vec![Output::Capture(Capture {
            header,
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
        self.imager.expose(header, &left);
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
