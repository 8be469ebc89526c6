//! Whether the device sees at all: its camera's faults, and when they count.
//!
//! A device that cannot see must not be silent: to the trains, silence means a clear track. When
//! no good frame has come for `blind_after_s`, all of the stretch that it watches counts as occupied,
//! as a track circuit's does when it fails. It counts as clear again when as many good frames have
//! come as a confirmation takes, so that what fell on the track meanwhile is found first.

use super::WaysideSettings;
use crate::bus::{CameraHealth, Frame, SimTime};
use crate::stack::camera_watch::CameraWatch;

#[derive(Clone, Debug)]
pub(super) struct Vision {
    watch: CameraWatch,
    /// When the last good frame was taken.
    last_good: SimTime,
    /// Good frames in a row.
    good: u32,
    blind: bool,
}

impl Vision {
    pub fn new(settings: &WaysideSettings, size_px: (u32, u32)) -> Self {
        Self {
            watch: CameraWatch::new(size_px, settings.allow_repeated_images),
            last_good: SimTime::ZERO,
            good: 0,
            blind: false,
        }
    }

    /// A frame came.
    pub fn look(&mut self, frame: &Frame, settings: &WaysideSettings) -> CameraHealth {
        let health = self.watch.look(frame);
        if health.is_good() {
            self.good = self.good.saturating_add(1);
            self.last_good = frame.start;
        } else {
            self.good = 0;
        }
        self.judge(frame.start, settings);
        health
    }

    /// Time passes. Gives the camera's state where it has fallen silent; else its frames show it.
    pub fn wait(&mut self, now: SimTime, settings: &WaysideSettings) -> Option<CameraHealth> {
        let silent = self.watch.silence(now, settings.blind_after_s);
        silent.then(|| {
            self.good = 0;
            self.judge(now, settings);
            CameraHealth::SILENT
        })
    }

    fn judge(&mut self, now: SimTime, settings: &WaysideSettings) {
        self.blind = match self.blind {
            true => self.good < settings.confirm_of.clamp(1, 64),
            false => now.since(self.last_good) > settings.blind_after_s,
        };
    }

    /// Nothing can be said of the track.
    pub fn is_blind(&self) -> bool {
        self.blind
    }
}
