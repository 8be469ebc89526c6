//! Warnings of wayside devices and of other trains, and whether the devices are heard.
//!
//! The warning of each source that was issued last counts: by balise and by radio messages come late,
//! twice, or not at all. A warning stays in force until its own device clears it;
//! silence clears nothing. The stretch that a device of the map watches counts as occupied until the
//! device is heard by radio, and again where it has not been heard for too long.

use super::ProtectionSettings;
use crate::bus::{DangerLevel, ObstacleWarning, SimTime};
use crate::track::{Track, TrackId};

/// A device of the map, or another train.
#[derive(Clone, Debug)]
struct WarningSource {
    name: String,
    /// The stretch that a device of the map watches.
    watched_m: Option<(f64, f64)>,
    /// Last heard by radio.
    last_heard: Option<SimTime>,
    /// Its last warning, and when it was received.
    last_warning: Option<(ObstacleWarning, SimTime)>,
}

impl WarningSource {
    fn new(name: &str, watched_m: Option<(f64, f64)>) -> Self {
        Self {
            name: name.to_owned(),
            watched_m,
            last_heard: None,
            last_warning: None,
        }
    }

    /// Marks the stretch that it watches as occupied. An earlier warning of it stays in force.
    fn occupy(&mut self, (from_m, to_m): (f64, f64), now: SimTime) {
        let nothing = || ObstacleWarning {
            device: self.name.clone(),
            number: 0,
            // Whatever the device says next is newer.
            issued: SimTime::from_nanos(i64::MIN),
            danger: DangerLevel::None,
            track: TrackId::default(),
            from_chainage_m: from_m,
            to_chainage_m: to_m,
            blind: true,
        };
        let (warning, _) = self.last_warning.get_or_insert_with(|| (nothing(), now));
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
    sources: Vec<WarningSource>,
    silent_after_s: f64,
    /// The devices were heard up to the first cycle, which is still to come.
    heard_before: bool,
}

impl Obstacles {
    /// With the devices of a map.
    pub fn new(settings: &ProtectionSettings, map: &Track) -> Self {
        let reach_m = settings.device_reach_m;
        let devices = map.wayside.iter().map(|site| {
            let watched_m = (site.chainage_m - reach_m, site.chainage_m + reach_m);
            WarningSource::new(&site.name, Some(watched_m))
        });
        Self {
            sources: devices.collect(),
            silent_after_s: settings.radio_timeout_s,
            heard_before: settings.starts_under_way == Some(true),
        }
    }

    /// A device was heard by radio; what counts is when it spoke.
    pub fn on_heard(&mut self, device: &str, sent: SimTime) {
        for known in self.sources.iter_mut().filter(|w| w.name == device) {
            known.last_heard = known.last_heard.max(Some(sent));
        }
    }

    /// Time passes: the stretches of devices that are silent count as occupied.
    pub fn lapse(&mut self, now: SimTime) {
        if std::mem::take(&mut self.heard_before) {
            for source in &mut self.sources {
                source.last_heard.get_or_insert(now);
            }
        }
        let is_current = |heard: SimTime| now.since(heard) <= self.silent_after_s;
        for source in &mut self.sources {
            let silent = !source.last_heard.is_some_and(is_current);
            if let Some(watched_m) = source.watched_m.filter(|_| silent) {
                source.occupy(watched_m, now);
            }
        }
    }

    pub fn on_warning(&mut self, warning: &ObstacleWarning, received: SimTime) {
        let ends = [warning.from_chainage_m, warning.to_chainage_m];
        if warning.danger != DangerLevel::None && ends.iter().any(|x| !x.is_finite()) {
            return;
        }
        let known = self.sources.iter().position(|w| w.name == warning.device);
        let known = known.unwrap_or_else(|| {
            self.sources.push(WarningSource::new(&warning.device, None));
            self.sources.len() - 1
        });
        let last_warning = &mut self.sources[known].last_warning;
        let order = |w: &ObstacleWarning| (w.issued, w.number);
        if (last_warning.as_ref()).is_none_or(|(last, _)| order(warning) > order(last)) {
            *last_warning = Some((warning.clone(), received));
        }
    }

    /// The nearest obstacle of at least `danger` that the train, head at `head_m`, has not yet
    /// passed, and when its device was last heard.
    pub fn ahead(&self, head_m: f64, danger: DangerLevel) -> Option<(&ObstacleWarning, SimTime)> {
        let last_warning = self.sources.iter().filter_map(|w| w.last_warning.as_ref());
        last_warning
            .filter(|(w, _)| w.danger >= danger && w.to_chainage_m >= head_m)
            .min_by(|(a, _), (b, _)| a.from_chainage_m.total_cmp(&b.from_chainage_m))
            .map(|(warning, received)| (warning, *received))
    }
}
