//! The eyes of a train: its stereo camera, the stack that reads it, and how well it does.

use super::SessionError;
use super::cameras::{Clock, StereoCamera, Taken};
use super::score::PositioningScore;
use super::watch::Stopwatch;
use crate::bus::{LedReport, Method, SimTime, StereoPair};
use crate::scenario::Scenario;
use crate::stack::positioning::LedPositioner;
use crate::track::Tunnel;
use crate::twin::faults::{CameraTrouble, Grabber};
use crate::twin::render::View;
use crate::twin::sensors::{AutoExposure, Exposed, RigSettings};
use image::GrayImage;
use nalgebra::Isometry3;
use std::sync::Arc;

/// One rig and what belongs to it.
pub struct Eyes {
    /// The rig as it really is.
    pub camera: StereoCamera,
    /// What sets exposure and gain of both eyes, by what the left one sees.
    exposure: AutoExposure,
    /// When it takes pairs.
    pub clock: Clock,
    /// What reads them.
    pub positioner: LedPositioner,
    /// The positions given, held against the truth.
    pub score: PositioningScore,
    /// Lamps that the stack says do not shine.
    pub dark_lamps: Vec<String>,
    /// What befalls whole pairs.
    pub trouble: CameraTrouble,
    /// What befalls the images of either eye.
    grabbers: [Grabber; 2],
}

/// A pair that the stack has read.
pub struct Reading {
    /// The pair.
    pub images: StereoPair,
    /// What the stack says of it.
    pub report: LedReport,
    /// Chainage of the head at the time of each fix.
    pub truths_m: Vec<f64>,
}

impl Eyes {
    /// Before the first pair.
    pub fn new(scenario: &Scenario, rig: &RigSettings, map: &Arc<Tunnel>) -> Self {
        let trouble =
            |names: &[&str]| CameraTrouble::of(names, &scenario.faults.cameras, scenario.seed);
        Self {
            dark_lamps: Vec::new(),
            trouble: trouble(&["rig"]),
            grabbers: ["left", "right"].map(|eye| Grabber::new(trouble(&["rig", eye]))),
            camera: StereoCamera::new(rig, scenario.seed),
            exposure: AutoExposure::of(&rig.exposure_control, rig.exposure_us, &rig.sensor),
            clock: Clock::new(rig.pairs_per_s),
            positioner: positioner(scenario, rig, map),
            score: PositioningScore::new(scenario.tunnel.clone(), &Method::ALL),
        }
    }

    /// A pair whose rows are over by `now` and that is not lost: its number and start.
    pub fn due(&mut self, now: SimTime) -> Option<(u32, SimTime)> {
        let (number, start) = self.clock.due(now, self.camera.delay_s())?;
        (!self.trouble.drops(number, start)).then_some((number, start))
    }

    /// By how much the images of a pair come late: it is complete with the later eye.
    pub fn late_s(&self, start: SimTime) -> f64 {
        let late = self.grabbers.iter().map(|g| g.late_s(start));
        late.fold(0.0, f64::max)
    }

    /// Sets exposure and gain of a pair's views, and gives them.
    pub fn expose(&self, views: &mut [View]) -> Exposed {
        self.exposure.expose(views)
    }

    /// The stack reads a pair and is scored against where vehicle and head really were.
    pub fn read(
        &mut self,
        taken: &Taken,
        images: Vec<GrayImage>,
        watch: &mut Stopwatch,
        vehicle_at: impl Fn(SimTime) -> Option<Isometry3<f64>>,
        head_at: impl Fn(SimTime) -> Option<f64>,
    ) -> Result<Reading, SessionError> {
        if let Some(left) = images.first() {
            self.exposure.on_image(&taken.with, left);
        }
        let [left, right] = <[GrayImage; 2]>::try_from(images)
            .map_err(|images| SessionError::Images(2, images.len()))?;
        let (number, start) = (taken.number, taken.start);
        let [of_left, of_right] = &mut self.grabbers;
        let delivered = [
            of_left.grab(number, start, left),
            of_right.grab(number, start, right),
        ];
        let images = self.camera.pair(taken, delivered);
        let positioner = &mut self.positioner;
        let (report, seconds) = watch.time(|| positioner.on_pair(&images));
        let rig = &self.camera.rig;
        let left_at = |t| Some(vehicle_at(t)? * rig.vehicle_from_left);
        let intrinsics = rig.left.intrinsics;
        (self.dark_lamps).extend(report.dark.iter().map(|uid| uid.to_string()));
        self.score
            .report(&report, 1e3 * seconds, &intrinsics, left_at);
        let mut truths_m = Vec::with_capacity(report.fixes.len());
        for fix in &report.fixes {
            let truth_m = head_at(fix.time).ok_or(SessionError::PoseForgotten(fix.time.secs()))?;
            self.score.fix(fix, truth_m);
            truths_m.push(truth_m);
        }
        Ok(Reading {
            images,
            report,
            truths_m,
        })
    }
}

/// The stack as it is switched on, with the rig's calibration sheet and the surveyed map.
pub fn positioner(scenario: &Scenario, rig: &RigSettings, map: &Arc<Tunnel>) -> LedPositioner {
    LedPositioner::new(&scenario.stack.led, rig.calibration(), map.clone())
}
