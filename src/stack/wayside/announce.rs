//! When a device speaks: on a change of danger, when it goes blind or sees again, again and again
//! while either lasts, once when it is over; and a heartbeat, which says the same once more.

use super::WaysideSettings;
use crate::bus::{DangerLevel, ObstacleWarning, SimTime, WaysideReport};

/// What was said last.
#[derive(Clone, Debug)]
pub(super) struct Announcer {
    device: String,
    refresh_s: f64,
    number: u32,
    danger: DangerLevel,
    blind: bool,
    last: SimTime,
    /// Of the last frame that was seen, if any.
    seen: Option<SimTime>,
    extent_m: (f64, f64),
}

impl Announcer {
    pub fn new(settings: &WaysideSettings, device: &str) -> Self {
        Self {
            device: device.to_owned(),
            refresh_s: settings.refresh_s,
            number: 0,
            danger: DangerLevel::None,
            blind: false,
            last: SimTime::ZERO,
            seen: None,
            extent_m: (0.0, 0.0),
        }
    }

    /// `watched_m` is the stretch that the device looks at.
    pub fn message(
        &mut self,
        report: &WaysideReport,
        watched_m: (f64, f64),
    ) -> Option<ObstacleWarning> {
        // What is learnt anew after a fault does not end its warning.
        if report.learning && !report.blind {
            return None;
        }
        self.seen = Some(report.time);
        let changed = (report.danger, report.blind) != (self.danger, self.blind);
        let due = report.danger != DangerLevel::None
            && report.time.since(self.last) >= self.refresh_s - 1e-6;
        if !changed && !due {
            return None;
        }
        // A clear message names the stretch that it clears.
        if report.blind {
            self.extent_m = watched_m;
        } else if report.danger != DangerLevel::None {
            self.extent_m = extent(report);
        }
        self.blind = report.blind;
        self.danger = report.danger;
        self.last = report.time;
        let number = self.number;
        self.number += 1;
        Some(self.warning(number, report.time))
    }

    /// What holds since the last frame; `None` before the device has seen one.
    pub fn heartbeat(&self) -> Option<ObstacleWarning> {
        Some(self.warning(self.number.saturating_sub(1), self.seen?))
    }

    fn warning(&self, number: u32, issued: SimTime) -> ObstacleWarning {
        ObstacleWarning {
            device: self.device.clone(),
            number,
            issued,
            danger: self.danger,
            from_chainage_m: self.extent_m.0,
            to_chainage_m: self.extent_m.1,
            blind: self.blind,
        }
    }
}

/// From the first to the last chainage of the obstacles of the report's danger.
fn extent(report: &WaysideReport) -> (f64, f64) {
    report
        .obstacles
        .iter()
        .filter(|o| o.danger == report.danger)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), o| {
            (a.min(o.from_chainage_m), b.max(o.to_chainage_m))
        })
}
