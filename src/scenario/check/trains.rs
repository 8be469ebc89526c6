//! Trains on their line: where they start, stop, and how far they get.

use super::line::LineCheck;
use crate::bus::TrainId;
use crate::track::Direction;
use crate::twin::physics::TrainSettings;

impl LineCheck<'_, '_> {
    /// Each on the line, and no two in the same place.
    pub(super) fn trains(&mut self) {
        let file = self.file;
        // Too many of them are compared with each other for too long.
        if file.other_trains.len() > TrainId::MOST {
            return;
        }
        for (k, train) in file.trains().enumerate() {
            let at = file.train_key(k);
            if !self.check.is_right(&at) {
                continue;
            }
            self.train(&at, train);
            let [from_m, to_m] = train.stands_m();
            let before = file.trains().take(k).position(|other| {
                let [other_from_m, other_to_m] = other.stands_m();
                from_m < other_to_m && other_from_m < to_m
            });
            if let Some(other) = before.map(|other| file.train_key(other)) {
                self.check.problem(
                    &format!("{at}.start_chainage_m"),
                    format!(
                        "it stands from {from_m:.1} to {to_m:.1} m, where `{other}` stands too"
                    ),
                    "start them clear of each other",
                );
            }
        }
    }

    fn train(&mut self, at: &str, train: &TrainSettings) {
        let end_m = self.track.alignment.length_m();
        let (head_m, length_m) = (train.start_chainage_m, train.length_m());
        let start_key = format!("{at}.start_chainage_m");
        self.is_on_line(&start_key, "the train head", head_m);
        let way = train.direction;
        let (begins_outside, first_m) = match way {
            Direction::Up => (head_m < length_m, length_m),
            Direction::Down => (head_m > end_m - length_m, end_m - length_m),
        };
        if begins_outside {
            self.check.problem(
                &start_key,
                format!("with its head at {head_m} m a train of {length_m:.1} m begins outside"),
                format!("start at {first_m:.1} m or further {way} the line"),
            );
        }
        let stop_key = format!("{at}.stop_at_m");
        if let Some(stop_m) = train.stop_at_m {
            self.is_on_line(&stop_key, "the train head", stop_m);
            return;
        }
        let duration_s = self.file.duration_s;
        let reach_m = head_m + train.direction.sign() * farthest_run_m(train, duration_s);
        if !(0.0..=end_m).contains(&reach_m) {
            let last_m = reach_m.clamp(0.0, end_m);
            self.check.problem(
                &stop_key,
                format!(
                    "it is not given, and in {duration_s} s the train can get to {reach_m:.0} m, \
                     past the end of the tunnel at {last_m:.0} m"
                ),
                format!("give a stop_at_m {way} to {last_m:.0} m, or shorten duration_s"),
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
