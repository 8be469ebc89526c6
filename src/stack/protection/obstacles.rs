//! What the devices along the line have said.
//!
//! The last word of each device counts, in the order of issue: by balise and by radio messages
//! come late, twice, or not at all. A warning stays in force until its own device clears it;
//! silence clears nothing.

use crate::bus::{DangerLevel, ObstacleWarning, SimTime};

/// The last word of one device.
#[derive(Clone, Debug)]
struct Notice {
    warning: ObstacleWarning,
    received: SimTime,
}

#[derive(Clone, Debug, Default)]
pub(super) struct Obstacles {
    notices: Vec<Notice>,
}

impl Obstacles {
    pub fn on_warning(&mut self, warning: &ObstacleWarning, received: SimTime) {
        let ends = [warning.from_chainage_m, warning.to_chainage_m];
        if warning.danger != DangerLevel::None && ends.iter().any(|x| !x.is_finite()) {
            return;
        }
        let notice = Notice {
            warning: warning.clone(),
            received,
        };
        let known = self
            .notices
            .iter_mut()
            .find(|n| n.warning.device == warning.device);
        match known {
            Some(old) => {
                let order = |w: &ObstacleWarning| (w.issued, w.number);
                if order(warning) > order(&old.warning) {
                    *old = notice;
                }
            }
            None => self.notices.push(notice),
        }
    }

    /// The nearest obstacle of at least `danger` that the train, head at `head_m`, has not yet
    /// passed, and when its device was last heard.
    pub fn ahead(&self, head_m: f64, danger: DangerLevel) -> Option<(&ObstacleWarning, SimTime)> {
        self.notices
            .iter()
            .filter(|n| n.warning.danger >= danger && n.warning.to_chainage_m >= head_m)
            .min_by(|a, b| {
                a.warning
                    .from_chainage_m
                    .total_cmp(&b.warning.from_chainage_m)
            })
            .map(|n| (&n.warning, n.received))
    }
}
