//! When a device speaks: on a change of danger, when it goes blind or sees again, again and again
//! while either lasts, once when it is over; and a heartbeat, which says the same once more.

use super::sight::ends;
use crate::bus::{DangerLevel, ObstacleWarning, SimTime, WaysideCalibration, WaysideReport};

#[derive(Clone, Debug)]
pub(super) struct Announcer {
    /// The last message; before the first one, that there is nothing.
    last: ObstacleWarning,
    messages: u32,
    /// When the last frame that was seen was taken, if any.
    seen: Option<SimTime>,
}

impl Announcer {
    pub fn new(device: &WaysideCalibration) -> Self {
        Self {
            last: ObstacleWarning {
                device: device.name.clone(),
                number: 0,
                issued: SimTime::ZERO,
                danger: DangerLevel::None,
                track: device.track,
                from_chainage_m: 0.0,
                to_chainage_m: 0.0,
                blind: false,
            },
            messages: 0,
            seen: None,
        }
    }

    /// `watched_m` is the stretch that the device looks at; what lasts is said again every
    /// `refresh_s`.
    pub fn message(
        &mut self,
        report: &WaysideReport,
        watched_m: (f64, f64),
        refresh_s: f64,
    ) -> Option<ObstacleWarning> {
        // What is learnt anew after a fault does not end its warning.
        if report.learning && !report.blind {
            return None;
        }
        self.seen = Some(report.time);
        let changed = (report.danger, report.blind) != (self.last.danger, self.last.blind);
        let due = report.danger != DangerLevel::None
            && report.time.since(self.last.issued) >= refresh_s - 1e-6;
        if !changed && !due {
            return None;
        }
        if report.blind {
            (self.last.from_chainage_m, self.last.to_chainage_m) = watched_m;
        } else if report.danger != DangerLevel::None {
            (self.last.from_chainage_m, self.last.to_chainage_m) = extent_m(report);
        }
        // A clear message names the stretch that it clears.
        self.last = ObstacleWarning {
            number: self.messages,
            issued: report.time,
            danger: report.danger,
            blind: report.blind,
            ..self.last.clone()
        };
        self.messages += 1;
        Some(self.last.clone())
    }

    /// What holds since the last frame; `None` before the device has seen one.
    pub fn heartbeat(&self) -> Option<ObstacleWarning> {
        Some(ObstacleWarning {
            issued: self.seen?,
            ..self.last.clone()
        })
    }
}

/// From the first to the last chainage of the obstacles of the report's danger.
fn extent_m(report: &WaysideReport) -> (f64, f64) {
    let dangerous = report
        .obstacles
        .iter()
        .filter(|o| o.danger == report.danger);
    ends(dangerous.flat_map(|o| [o.from_chainage_m, o.to_chainage_m]))
}
