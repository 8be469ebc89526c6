//! Scores of track occupancy: what is said after each fix, and how soon after a switch its leg is known.

use super::leg_score::{FacingLeg, LegScore, ReportedAt};
use super::occupancy_figures::{FacingFigures, LegDistances, OccupancyClass, OccupancyFigures};
use super::statistics::ErrorStatistics;
use crate::bus::{OccupancyReport, SimTime, TrainId};
use crate::scenario::OnboardSettings;
use crate::track::{Direction, Place, TrackId};
use crate::twin::physics::World;
use std::collections::BTreeMap;

/// A decision that is more probable is fairly confident.
const FAIRLY: f64 = 0.9;
/// One way is certain where the other one is less probable than this.
const DOUBT: f64 = 1e-9;

/// A report held against the truth.
#[derive(Clone, Copy, Debug)]
pub struct Judged {
    /// Where the antenna was at the time of the report.
    pub truth: Place,
    /// What the report is worth, if it follows a fix or the train has no receiver.
    pub class: Option<OccupancyClass>,
}

/// Scores track occupancy of one train.
#[derive(Debug)]
pub struct OccupancyScore {
    /// The antenna behind the head.
    antenna_behind_m: f64,
    has_receiver: bool,
    classes: BTreeMap<OccupancyClass, u32>,
    errors_m: Vec<f64>,
    nees_sum: f64,
    facing: FacingFigures,
    legs: LegScore,
}

impl OccupancyScore {
    /// Of a train. Without a receiver the place is scored where the stack takes the antenna to be.
    pub fn new(onboard: &OnboardSettings) -> Self {
        let told_m = onboard.occupancy.antenna_behind_head_m;
        Self {
            antenna_behind_m: onboard.gnss.map_or(told_m, |gnss| -gnss.antenna_m[0]),
            has_receiver: onboard.gnss.is_some(),
            classes: OccupancyClass::ALL.map(|class| (class, 0)).into(),
            errors_m: Vec::new(),
            nees_sum: 0.0,
            facing: FacingFigures::default(),
            legs: LegScore::default(),
        }
    }

    /// Where the antenna was at a time, along the route, metres.
    fn antenna_m(&self, world: &World, id: TrainId, time: SimTime) -> Option<f64> {
        Some(world.run_at(id, time)? - self.antenna_behind_m)
    }

    /// Takes a report in that was sent now; none where the world does not go back to its time.
    pub fn report(
        &mut self,
        report: &OccupancyReport,
        world: &World,
        id: TrainId,
    ) -> Option<Judged> {
        let antenna_m = self.antenna_m(world, id, report.time)?;
        let (truth, facing) = world.route(id)?.place(antenna_m);
        let class = class_of(report, truth.track);
        let is_identified = class == OccupancyClass::CorrectConfident;
        self.follow(world, id, antenna_m, is_identified);
        self.facing.add(report, (truth.track, facing));
        if self.has_receiver && !report.of_fix {
            return Some(Judged { truth, class: None });
        }
        *self.classes.entry(class).or_default() += 1;
        let best = report
            .tracks
            .first()
            .filter(|best| best.track == truth.track);
        if let Some(best) = best {
            let error_m = best.s_m - truth.s_m;
            self.errors_m.push(error_m.abs());
            self.nees_sum += (error_m / best.sigma_m).powi(2);
        }
        let class = Some(class);
        Some(Judged { truth, class })
    }

    /// Follows the train over the toes of switches. What counts for a leg is said of the place of the antenna, and the
    /// distance is that of the head, which is the first to be in another train's way, when the report is sent.
    fn follow(&mut self, world: &World, id: TrainId, antenna_m: f64, is_identified: bool) {
        let (Some(route), Some(head_m)) = (world.route(id), world.run_m(id)) else {
            return;
        };
        let legs = FacingLeg::all(world.network(), route);
        let at = ReportedAt { head_m, antenna_m };
        self.legs.report(&legs, at, is_identified);
    }

    /// The figures.
    pub fn finish(mut self) -> OccupancyFigures {
        let right = self.errors_m.len();
        let legs_m = self.legs.finish();
        let fixes_in_all = self.classes.values().sum();
        let unsaid = self.classes.get(&OccupancyClass::NothingSaid);
        OccupancyFigures {
            fixes: fixes_in_all - unsaid.unwrap_or(&0),
            fixes_in_all,
            switches: legs_m.len() as u32,
            never_identified: legs_m.iter().filter(|m| m.is_none()).count() as u32,
            identified_after_m: LegDistances::of(&legs_m),
            legs_identified_after_m: legs_m,
            classes: self.classes,
            facing: self.facing,
            nees_mean: (right > 0).then(|| self.nees_sum / right as f64),
            error_m: ErrorStatistics::of(&mut self.errors_m),
        }
    }
}

impl FacingFigures {
    /// Takes a report in, with the track that the train is on and the way that it faces there.
    fn add(&mut self, report: &OccupancyReport, (track, facing): (TrackId, Direction)) {
        let Some(best) = report.tracks.first().filter(|best| best.track == track) else {
            return;
        };
        let is_wrong = best.facing != facing;
        let doubt = 1.0 - best.facing_probability;
        self.reports += 1;
        self.wrong_over_0_9 += u32::from(is_wrong && best.facing_probability > FAIRLY);
        self.wrong_certain += u32::from(is_wrong && doubt < DOUBT);
    }
}

/// What a report is worth of a train whose antenna is on a track.
fn class_of(report: &OccupancyReport, truth: TrackId) -> OccupancyClass {
    use OccupancyClass::{
        CorrectConfident, CorrectFairlyConfident, CorrectUndecided, NothingSaid, WrongConfident,
        WrongFairlyConfident, WrongUndecided,
    };
    let Some(best) = report.tracks.first() else {
        return NothingSaid;
    };
    let fairly = best.probability > FAIRLY;
    match (best.track == truth, report.identified, fairly) {
        (false, true, _) => WrongConfident,
        (false, _, true) => WrongFairlyConfident,
        (false, _, false) => WrongUndecided,
        (true, true, _) => CorrectConfident,
        (true, _, true) => CorrectFairlyConfident,
        (true, _, false) => CorrectUndecided,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::OccupiedTrack;

    fn report(tracks: &[(u16, f64)], identified: bool) -> OccupancyReport {
        let tracks = tracks.iter().map(|(track, probability)| OccupiedTrack {
            track: TrackId(*track),
            probability: *probability,
            facing: Direction::Up,
            facing_probability: 1.0,
            s_m: 0.0,
            sigma_m: 1.0,
        });
        OccupancyReport {
            time: SimTime::ZERO,
            tracks: tracks.collect(),
            identified,
            hypotheses: 1,
            of_fix: true,
        }
    }

    /// Fails where a report without a track is no class, or one of those with a track.
    #[test]
    fn a_report_without_a_track_is_a_class_of_its_own() {
        let class =
            |tracks: &[(u16, f64)], identified| class_of(&report(tracks, identified), TrackId(3));
        assert_eq!(class(&[], false), OccupancyClass::NothingSaid);
        let classes = [
            class(&[(2, 1.0)], true),
            class(&[(2, 0.95), (3, 0.05)], false),
            class(&[(2, 0.6), (3, 0.4)], false),
            class(&[], true),
            class(&[(3, 0.6), (2, 0.4)], false),
            class(&[(3, 0.95), (2, 0.05)], false),
            class(&[(3, 1.0)], true),
        ];
        assert_eq!(classes, OccupancyClass::ALL);
    }

    /// Only the way that is said of the true track counts, and what is certain is over 0.9 too.
    #[test]
    fn wrong_facings_are_counted() {
        let report = |track: u16, facing: Direction, facing_probability: f64| {
            let mut report = report(&[(track, 1.0)], true);
            report.tracks[0].facing = facing;
            report.tracks[0].facing_probability = facing_probability;
            report
        };
        let mut figures = FacingFigures::default();
        let truth = (TrackId(3), Direction::Up);
        for (track, facing, probability, expected) in [
            (3, Direction::Up, 1.0, [1, 0, 0]),
            (3, Direction::Down, 0.9, [2, 0, 0]),
            (3, Direction::Down, 0.95, [3, 1, 0]),
            (3, Direction::Down, 1.0 - 1e-8, [4, 2, 0]),
            (3, Direction::Down, 1.0 - 1e-10, [5, 3, 1]),
            (2, Direction::Down, 1.0, [5, 3, 1]),
        ] {
            figures.add(&report(track, facing, probability), truth);
            let found = [
                figures.reports,
                figures.wrong_over_0_9,
                figures.wrong_certain,
            ];
            assert_eq!(found, expected, "{track} {facing} {probability}");
        }
    }
}
