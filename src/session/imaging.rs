//! Images on their way from the shutter to the equipment.
//!
//! A capture is handed to the renderer when its last row has closed, and its images reach the
//! equipment `latency_ms` later; the renderer draws in between, while the world goes on. So the order
//! of things does not depend on how fast anything is. A camera whose images are late holds up its own
//! later ones only.

use super::costs::Costs;
use crate::bus::SimTime;
use crate::twin::render::{Backend, Job, RenderError, Renderer};
use crate::twin::sensors::FrameHeader;
use image::GrayImage;
use std::collections::VecDeque;

/// A capture that waits for its images.
pub struct Pending {
    /// Which sensor took it: its place among the sensors of the session.
    pub sensor: usize,
    /// What the frame says of itself.
    pub header: FrameHeader,
    /// By how much more than the usual latency its images are late.
    pub late_s: f64,
}

/// The renderer and what waits for its images.
pub struct Imaging<'s> {
    renderer: &'s mut dyn Renderer,
    latency_s: f64,
    /// With the times when they reach the equipment.
    waiting: VecDeque<(SimTime, Pending)>,
    /// Drawn, but late.
    late: VecDeque<(SimTime, Pending, Vec<GrayImage>)>,
}

impl<'s> Imaging<'s> {
    /// None on the way.
    pub fn new(renderer: &'s mut dyn Renderer, latency_s: f64) -> Self {
        Self {
            renderer,
            latency_s,
            waiting: VecDeque::new(),
            late: VecDeque::new(),
        }
    }

    /// What draws.
    pub fn backend(&self) -> Backend {
        self.renderer.backend()
    }

    /// Draws a capture that was over at the time of the job.
    pub fn submit(
        &mut self,
        job: &Job,
        pending: Pending,
        cost: &mut Costs,
    ) -> Result<(), RenderError> {
        let renderer = &mut self.renderer;
        cost.submit.time(|| renderer.submit(job)).0?;
        // Results arrive in the order of submission, so none is due before the one ahead of it.
        let own = job.time.plus(self.latency_s);
        let ahead = self.waiting.back().map_or(own, |(due, _)| *due);
        self.waiting.push_back((own.max(ahead), pending));
        Ok(())
    }

    /// The next capture with its images that is due.
    pub fn due(
        &mut self,
        now: SimTime,
        cost: &mut Costs,
    ) -> Result<Option<(Pending, Vec<GrayImage>)>, RenderError> {
        while let Some((due, pending)) = self.waiting.pop_front_if(|(due, _)| *due <= now) {
            let renderer = &mut self.renderer;
            let images = cost.wait.time(|| renderer.collect()).0?;
            let own = due.plus(pending.late_s);
            let same_sensor = self.late.iter().rev();
            let mut same_sensor = same_sensor.filter(|l| l.1.sensor == pending.sensor);
            let due = same_sensor.next().map_or(own, |(due, ..)| own.max(*due));
            self.late.push_back((due, pending, images));
        }
        let due = self.late.iter().position(|(due, ..)| *due <= now);
        let late = due.and_then(|k| self.late.remove(k));
        Ok(late.map(|(_, pending, images)| (pending, images)))
    }
}
