//! Whether the device sees at all: its camera's faults, too little light, and when they count.
//!
//! A device that cannot see must say so. When no frame that shows the bed has come for `blind_after_s`,
//! all of the stretch that it watches counts as occupied, as a track circuit's does when it fails. It counts
//! as clear again when as many good frames have come as a confirmation takes, so that what fell on the track
//! meanwhile is found first.

use super::WaysideSettings;
use crate::bus::{CameraHealth, Frame, SimTime};
use crate::stack::camera_watch::CameraWatch;

#[derive(Clone, Debug)]
pub(super) struct Vision {
    watch: CameraWatch,
    /// When the last frame was taken that showed the bed.
    last_seen: SimTime,
    /// Such frames in a row.
    seen: u32,
    blind: bool,
}

impl Vision {
    pub fn new(settings: &WaysideSettings, size_px: (u32, u32)) -> Self {
        Self {
            watch: CameraWatch::new(size_px, settings.allow_repeated_images),
            last_seen: SimTime::ZERO,
            seen: 0,
            blind: false,
        }
    }

    /// A frame came: how the camera is.
    pub fn look(&mut self, frame: &Frame) -> CameraHealth {
        self.watch.look(frame)
    }

    /// A frame taken at a time showed the bed, or did not.
    pub fn note(&mut self, shows_bed: bool, time: SimTime, settings: &WaysideSettings) {
        if shows_bed {
            self.seen = self.seen.saturating_add(1);
            self.last_seen = time;
        } else {
            self.seen = 0;
        }
        self.judge(time, settings);
    }

    /// Time passes. Gives the camera's state where it has fallen silent; else its frames show it.
    pub fn wait(&mut self, now: SimTime, settings: &WaysideSettings) -> Option<CameraHealth> {
        let silent = self.watch.silence(now, settings.blind_after_s);
        silent.then(|| {
            self.note(false, now, settings);
            CameraHealth::SILENT
        })
    }

    fn judge(&mut self, now: SimTime, settings: &WaysideSettings) {
        self.blind = match self.blind {
            true => self.seen < settings.confirm_of.clamp(1, 64),
            false => now.since(self.last_seen) > settings.blind_after_s,
        };
    }

    /// Nothing can be said of the track.
    pub fn is_blind(&self) -> bool {
        self.blind
    }
}
