//! What the devices along the line have said, and whether they are heard.
//!
//! The last word of each device counts, in the order of issue: by balise and by radio messages
//! come late, twice, or not at all. A warning stays in force until its own device clears it;
//! silence clears nothing. The stretch that a device of the map watches counts as occupied from the
//! start until the device is heard by radio, and again where it has not been heard for too long.

use super::ProtectionSettings;
use crate::bus::{DangerLevel, ObstacleWarning, SimTime};
use crate::track::Tunnel;

/// Who warns: a device of the map, or another train.
#[derive(Clone, Debug)]
struct Warner {
    name: String,
    /// The stretch that a device of the map watches.
    watched_m: Option<(f64, f64)>,
    /// Last heard by radio.
    heard: Option<SimTime>,
    /// The last word, and when it was received.
    said: Option<(ObstacleWarning, SimTime)>,
}

impl Warner {
    fn new(name: &str, watched_m: Option<(f64, f64)>) -> Self {
        Self {
            name: name.to_owned(),
            watched_m,
            heard: None,
            said: None,
        }
    }

    /// Nobody vouches for the stretch that it watches. What it had warned of counts as well.
    fn occupy(&mut self, (from_m, to_m): (f64, f64), now: SimTime) {
        let nothing = || ObstacleWarning {
            device: self.name.clone(),
            number: 0,
            // Whatever the device says next is newer.
            issued: SimTime::from_nanos(i64::MIN),
            danger: DangerLevel::None,
            from_chainage_m: from_m,
            to_chainage_m: to_m,
            blind: true,
        };
        let (warning, _) = self.said.get_or_insert_with(|| (nothing(), now));
        if warning.danger == DangerLevel::None {
            (warning.from_chainage_m, warning.to_chainage_m) = (from_m, to_m);
        }
        warning.from_chainage_m = from_m.min(warning.from_chainage_m);
        warning.to_chainage_m = to_m.max(warning.to_chainage_m);
        (warning.danger, warning.blind) = (DangerLevel::High, true);
    }
}

#[derive(Clone, Debug, Default)]
pub(super) struct Obstacles {
    warners: Vec<Warner>,
    silent_after_s: f64,
}

impl Obstacles {
    /// With the devices of a map.
    pub fn new(settings: &ProtectionSettings, map: &Tunnel) -> Self {
        let reach_m = settings.device_reach_m;
        let devices = map.wayside.iter().map(|site| {
            let watched_m = (site.chainage_m - reach_m, site.chainage_m + reach_m);
            Warner::new(&site.name, Some(watched_m))
        });
        Self {
            warners: devices.collect(),
            silent_after_s: settings.radio_timeout_s,
        }
    }

    /// A device was heard by radio; what counts is when it spoke.
    pub fn on_heard(&mut self, device: &str, sent: SimTime) {
        for known in self.warners.iter_mut().filter(|w| w.name == device) {
            known.heard = known.heard.max(Some(sent));
        }
    }

    /// Time passes: the stretches of devices that are silent count as occupied.
    pub fn lapse(&mut self, now: SimTime) {
        let is_current = |heard: SimTime| now.since(heard) <= self.silent_after_s;
        for warner in &mut self.warners {
            let silent = !warner.heard.is_some_and(is_current);
            if let Some(watched_m) = warner.watched_m.filter(|_| silent) {
                warner.occupy(watched_m, now);
            }
        }
    }

    pub fn on_warning(&mut self, warning: &ObstacleWarning, received: SimTime) {
        let ends = [warning.from_chainage_m, warning.to_chainage_m];
        if warning.danger != DangerLevel::None && ends.iter().any(|x| !x.is_finite()) {
            return;
        }
        let known = self.warners.iter().position(|w| w.name == warning.device);
        let known = known.unwrap_or_else(|| {
            self.warners.push(Warner::new(&warning.device, None));
            self.warners.len() - 1
        });
        let said = &mut self.warners[known].said;
        let order = |w: &ObstacleWarning| (w.issued, w.number);
        if (said.as_ref()).is_none_or(|(last, _)| order(warning) > order(last)) {
            *said = Some((warning.clone(), received));
        }
    }

    /// The nearest obstacle of at least `danger` that the train, head at `head_m`, has not yet
    /// passed, and when its device was last heard.
    pub fn ahead(&self, head_m: f64, danger: DangerLevel) -> Option<(&ObstacleWarning, SimTime)> {
        let said = self.warners.iter().filter_map(|w| w.said.as_ref());
        said.filter(|(w, _)| w.danger >= danger && w.to_chainage_m >= head_m)
            .min_by(|(a, _), (b, _)| a.from_chainage_m.total_cmp(&b.from_chainage_m))
            .map(|(warning, received)| (warning, *received))
    }
}
