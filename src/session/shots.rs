//! Images on their way from the shutter to the stack.
//!
//! An image is handed to the renderer when its last row has closed, and reaches the stack
//! `latency_ms` later; the renderer draws in between, while the world goes on. So the order of
//! things does not depend on how fast anything is. A camera whose images are late holds up its own
//! later ones only.

use super::cameras::Taken;
use super::devices::Look;
use super::watch::Costs;
use crate::bus::SimTime;
use crate::twin::render::{Backend, Job, RenderError, Renderer};
use image::GrayImage;
use std::collections::VecDeque;

/// One exposure.
pub struct Shot {
    /// The frame.
    pub taken: Taken,
    /// Whose.
    pub what: What,
    /// By how much more than the usual latency its images are late.
    pub late_s: f64,
}

/// Whose images they are.
pub enum What {
    /// The rig's pair.
    Pair,
    /// A wayside device's, with what there was to be seen.
    Wayside(usize, Look),
}

impl What {
    fn same_camera(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Pair, Self::Pair) => true,
            (Self::Wayside(a, _), Self::Wayside(b, _)) => a == b,
            _ => false,
        }
    }
}

/// The renderer and what waits for its images.
pub struct Shots<'s> {
    renderer: &'s mut dyn Renderer,
    latency_s: f64,
    /// With the times when they reach the stack.
    waiting: VecDeque<(SimTime, Shot)>,
    /// Drawn, but late.
    late: VecDeque<(SimTime, Shot, Vec<GrayImage>)>,
}

impl<'s> Shots<'s> {
    /// None on the way.
    pub fn new(renderer: &'s mut dyn Renderer, latency_ms: f64) -> Self {
        Self {
            renderer,
            latency_s: 1e-3 * latency_ms,
            waiting: VecDeque::new(),
            late: VecDeque::new(),
        }
    }

    /// What draws.
    pub fn backend(&self) -> Backend {
        self.renderer.backend()
    }

    /// The images of a shot that was over at the time of the job.
    pub fn submit(&mut self, job: &Job, shot: Shot, cost: &mut Costs) -> Result<(), RenderError> {
        let renderer = &mut self.renderer;
        cost.submit.time(|| renderer.submit(job)).0?;
        // Results arrive in the order of submission, so none is due before the one ahead of it.
        let own = job.time.plus(self.latency_s);
        let ahead = self.waiting.back().map_or(own, |(due, _)| *due);
        self.waiting.push_back((own.max(ahead), shot));
        Ok(())
    }

    /// The next shot with its images that is due.
    pub fn due(
        &mut self,
        now: SimTime,
        cost: &mut Costs,
    ) -> Result<Option<(Shot, Vec<GrayImage>)>, RenderError> {
        while let Some((due, shot)) = self.waiting.pop_front_if(|(due, _)| *due <= now) {
            let renderer = &mut self.renderer;
            let images = cost.wait.time(|| renderer.collect()).0?;
            let own = due.plus(shot.late_s);
            let mut ahead = self
                .late
                .iter()
                .filter(|l| l.1.what.same_camera(&shot.what));
            let due = ahead.next_back().map_or(own, |(due, ..)| own.max(*due));
            if due <= now {
                return Ok(Some((shot, images)));
            }
            self.late.push_back((due, shot, images));
        }
        let due = self.late.iter().position(|(due, ..)| *due <= now);
        let late = due.and_then(|k| self.late.remove(k));
        Ok(late.map(|(_, shot, images)| (shot, images)))
    }
}
