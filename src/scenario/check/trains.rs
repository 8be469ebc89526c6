//! Trains on their line: where they start, stop, and how far they get.

use super::line::LineCheck;
use crate::bus::TrainId;
use crate::track::Stretch;
use crate::track::network::Itinerary;
use crate::twin::physics::{NoRoute, TrainSettings};

impl LineCheck<'_, '_> {
    /// Each on its way, and no two in the same place.
    pub(super) fn trains(&mut self) {
        let file = self.file;
        // Too many of them are compared with each other for too long.
        if file.other_trains.len() > TrainId::MOST {
            return;
        }
        let mut stand: Vec<(usize, Vec<Stretch>)> = Vec::new();
        for (k, train) in file.trains().enumerate() {
            let at = file.train_key(k);
            if !self.check.is_right(&at) {
                continue;
            }
            let Some(way) = self.way(&at, train) else {
                continue;
            };
            self.train(&at, train, &way);
            let tail_m = way.start_m - train.length_m();
            let own: Vec<Stretch> = way.route.stretches(tail_m, way.start_m).collect();
            let overlap = |other: &[Stretch]| {
                let pairs = own.iter().flat_map(|a| other.iter().map(move |b| (a, b)));
                let overlaps = |(a, b): &(&Stretch, &Stretch)| {
                    a.track == b.track && a.from_m < b.to_m && b.from_m < a.to_m
                };
                pairs.into_iter().find(overlaps).map(|(a, _)| *a)
            };
            let before = stand
                .iter()
                .find_map(|(k, other)| Some((*k, overlap(other)?)));
            if let Some((other, Stretch { from_m, to_m, .. })) = before {
                let other = file.train_key(other);
                self.check.problem(
                    &format!("{at}.start_chainage_m"),
                    format!(
                        "it stands from {from_m:.1} to {to_m:.1} m, where `{other}` stands too"
                    ),
                    "start them clear of each other",
                );
            }
            stand.push((k, own));
        }
    }

    /// The way of a train; a problem where there is none.
    fn way(&mut self, at: &str, train: &TrainSettings) -> Option<Itinerary> {
        let network = &self.tunnel.network;
        match train.itinerary(network) {
            Ok(way) => Some(way),
            Err(NoRoute::NoTrack { key, name }) => {
                self.no_track(&format!("{at}.{key}"), &name);
                None
            }
            Err(error @ NoRoute::NoWay { .. }) => {
                let key = match (train.stop_at_m, train.via.is_empty()) {
                    (_, false) => "via",
                    (Some(_), true) => "stop_at_m",
                    (None, true) => "start_chainage_m",
                };
                let remedy = "see the tracks by `metrotwin check` of the tunnel file: trains do not turn round, \
                              and run a switch from toe to leg or from leg to toe";
                self.check
                    .problem(&format!("{at}.{key}"), error.to_string(), remedy);
                None
            }
        }
    }

    fn train(&mut self, at: &str, train: &TrainSettings, way: &Itinerary) {
        let (head_m, length_m) = (train.start_chainage_m, train.length_m());
        let start_key = format!("{at}.start_chainage_m");
        let track =
            &self.tunnel.network.tracks[usize::from(way.route.place(way.start_m).0.track.0)];
        self.is_on_line(&start_key, track, "the train head", head_m);
        if way.start_m < length_m {
            let (first, _) = way.route.place(length_m);
            let (first_m, direction) = (first.s_m, train.direction);
            self.check.problem(
                &start_key,
                format!("with its head at {head_m} m a train of {length_m:.1} m begins outside"),
                format!("start at {first_m:.1} m or further {direction} the line"),
            );
        }
        let stop_key = format!("{at}.stop_at_m");
        if let (Some(stop_m), Some(run_m)) = (train.stop_at_m, way.stop_m) {
            let (stop, _) = way.route.place(run_m);
            let track = &self.tunnel.network.tracks[usize::from(stop.track.0)];
            self.is_on_line(&stop_key, track, "the train head", stop_m);
            return;
        }
        let duration_s = self.file.duration_s;
        let reach_m = way.start_m + farthest_run_m(train, duration_s);
        if reach_m > way.route.length_m() {
            let (reach, direction) = way.route.place(reach_m);
            let (last, _) = way.route.place(way.route.length_m());
            let (reach_m, last_m) = (reach.s_m, last.s_m);
            self.check.problem(
                &stop_key,
                format!(
                    "it is not given, and in {duration_s} s the train can get to {reach_m:.0} m, \
                     past the end of the tunnel at {last_m:.0} m"
                ),
                format!("give a stop_at_m {direction} to {last_m:.0} m, or shorten duration_s"),
            );
        }
    }
}

/// How far the driver can get: at full acceleration to the cruising speed, then at that.
fn farthest_run_m(train: &TrainSettings, duration_s: f64) -> f64 {
    let (start, cruise) = (train.start_speed_kmh / 3.6, train.cruise_speed_kmh / 3.6);
    let driven_s = (duration_s - train.start_s).max(0.0);
    let waited_m = start * (duration_s - driven_s);
    let ramp_s = ((cruise - start).max(0.0) / train.accel_mps2).min(driven_s);
    let top = start.max(cruise);
    waited_m + (start + 0.5 * train.accel_mps2 * ramp_s) * ramp_s + top * (driven_s - ramp_s)
}
