//! What the devices along the line have said, and whether they are heard.
//!
//! The last word of each device counts, in the order of issue: by balise and by radio messages
//! come late, twice, or not at all. A warning stays in force until its own device clears it;
//! silence clears nothing. The stretch that a device of the map watches counts as occupied from the
//! start until the device is heard by radio, and again where it has not been heard for too long.

use super::ProtectionSettings;
use crate::bus::{DangerLevel, ObstacleWarning, SimTime};
use crate::track::Tunnel;

/// The last word of one device.
#[derive(Clone, Debug)]
struct Notice {
    warning: ObstacleWarning,
    received: SimTime,
}

/// A device that the map has.
#[derive(Clone, Debug)]
struct Device {
    name: String,
    watched_m: (f64, f64),
    /// By radio.
    heard: Option<SimTime>,
}

#[derive(Clone, Debug, Default)]
pub(super) struct Obstacles {
    notices: Vec<Notice>,
    devices: Vec<Device>,
    silent_after_s: f64,
}

impl Obstacles {
    /// With the devices of a map.
    pub fn new(settings: &ProtectionSettings, map: &Tunnel) -> Self {
        let reach_m = settings.device_reach_m;
        let devices = map.wayside.iter().map(|site| Device {
            name: site.name.clone(),
            watched_m: (site.chainage_m - reach_m, site.chainage_m + reach_m),
            heard: None,
        });
        Self {
            devices: devices.collect(),
            silent_after_s: settings.radio_timeout_s,
            ..Self::default()
        }
    }

    /// A device was heard by radio; what counts is when it spoke.
    pub fn on_heard(&mut self, device: &str, sent: SimTime) {
        let known = self.devices.iter_mut().find(|d| d.name == device);
        known
            .into_iter()
            .for_each(|d| d.heard = d.heard.max(Some(sent)));
    }

    /// Time passes: the stretches of devices that are silent count as occupied.
    pub fn lapse(&mut self, now: SimTime) {
        let is_current = |heard: SimTime| now.since(heard) <= self.silent_after_s;
        for device in &self.devices {
            if device.heard.is_some_and(is_current) {
                continue;
            }
            let known = self.notices.iter_mut();
            let known = known.filter(|n| n.warning.device == device.name).last();
            let (from_m, to_m) = device.watched_m;
            let occupied = ObstacleWarning {
                device: device.name.clone(),
                number: 0,
                // Whatever the device says next is newer.
                issued: SimTime::from_nanos(i64::MIN),
                danger: DangerLevel::High,
                from_chainage_m: from_m,
                to_chainage_m: to_m,
                blind: true,
            };
            match known {
                Some(Notice { warning, .. }) => {
                    let dangerous = warning.danger != DangerLevel::None;
                    let least = |a: f64, b: f64| if dangerous { a.min(b) } else { a };
                    let most = |a: f64, b: f64| if dangerous { a.max(b) } else { a };
                    *warning = ObstacleWarning {
                        number: warning.number,
                        issued: warning.issued,
                        from_chainage_m: least(from_m, warning.from_chainage_m),
                        to_chainage_m: most(to_m, warning.to_chainage_m),
                        ..occupied
                    };
                }
                None => self.notices.push(Notice {
                    warning: occupied,
                    received: now,
                }),
            }
        }
    }

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
