//! The eyes of a train: its stereo camera, the stack that reads it, and how well it does.

use super::SessionError;
use super::cameras::{Clock, StereoCamera};
use super::score::PositioningScore;
use super::watch::Stopwatch;
use crate::bus::{LedReport, Method, SimTime, StereoPair};
use crate::scenario::Scenario;
use crate::stack::positioning::LedPositioner;
use crate::track::Tunnel;
use crate::twin::render::View;
use crate::twin::sensors::{AutoExposure, RigSettings};
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
        Self {
            camera: StereoCamera::new(rig, scenario.seed),
            exposure: AutoExposure::of(&rig.exposure_control, rig.exposure_us, &rig.sensor),
            clock: Clock::new(rig.pairs_per_s),
            positioner: positioner(scenario, rig, map),
            score: PositioningScore::new(scenario.tunnel.clone(), &Method::ALL),
        }
    }

    /// Sets exposure and gain of a pair's views.
    pub fn expose(&mut self, number: u32, views: &mut [View]) {
        self.exposure.expose(number, views);
    }

    /// The stack reads a pair and is scored against where vehicle and head really were.
    pub fn read(
        &mut self,
        (number, start): (u32, SimTime),
        images: Vec<GrayImage>,
        watch: &mut Stopwatch,
        vehicle_at: impl Fn(SimTime) -> Option<Isometry3<f64>>,
        head_at: impl Fn(SimTime) -> Option<f64>,
    ) -> Result<Reading, SessionError> {
        if let Some(left) = images.first() {
            self.exposure.on_image(number, left);
        }
        let images = images
            .try_into()
            .map_err(|images: Vec<_>| SessionError::Images(2, images.len()))?;
        let images = self.camera.pair(number, start, images);
        let positioner = &mut self.positioner;
        let (report, seconds) = watch.time(|| positioner.on_pair(&images));
        let rig = &self.camera.rig;
        let left_at = |t| Some(vehicle_at(t)? * rig.vehicle_from_left);
        let intrinsics = rig.left.intrinsics;
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
