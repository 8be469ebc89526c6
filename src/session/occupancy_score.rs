//! Scores of track occupancy: what is said after each fix, and how soon after a switch its leg is known.

use super::occupancy_figures::{
    FacingFigures, LegDistances, OccupancyClass, OccupancyFigures, mean_of_identified_m,
};
use super::summary::ErrorStatistics;
use crate::bus::{OccupancyReport, SimTime, TrainId};
use crate::scenario::OnboardSettings;
use crate::track::network::Route;
use crate::track::{Direction, Place, TrackId};
use crate::twin::physics::World;

/// A decision that is more probable is fairly confident.
const FAIRLY: f64 = 0.9;
/// One way is certain where the other one is less probable than this.
const DOUBT: f64 = 1e-9;
/// So near before the end of a leg the next track may be probable too.
const BEFORE_END_M: f64 = 10.0;

/// Scores track occupancy of one train.
#[derive(Debug)]
pub struct OccupancyScore {
    /// The antenna behind the head.
    antenna_behind_m: f64,
    has_receiver: bool,
    classes: [u32; 6],
    errors_m: Vec<f64>,
    nees_sum: f64,
    facing: FacingFigures,
    /// Legs that were left.
    switches: Vec<Option<f64>>,
    /// The leg that the antenna is on, if it came there over a toe.
    leg: Option<EnteredLeg>,
    /// The track that the antenna was on last, and its distance along the route.
    last: Option<(TrackId, f64)>,
}

/// A leg of a switch that was run facing.
#[derive(Clone, Copy, Debug)]
struct EnteredLeg {
    toe_m: f64,
    end_m: f64,
    /// Beyond the toe, from where on it has been identified.
    identified_m: Option<f64>,
}

impl OccupancyScore {
    /// Of a train. Without a receiver the place is scored where the stack takes the antenna to be.
    pub fn new(onboard: &OnboardSettings) -> Self {
        let told_m = onboard.occupancy.antenna_behind_head_m;
        Self {
            antenna_behind_m: onboard.gnss.map_or(told_m, |gnss| -gnss.antenna_m[0]),
            has_receiver: onboard.gnss.is_some(),
            classes: [0; 6],
            errors_m: Vec::new(),
            nees_sum: 0.0,
            facing: FacingFigures::default(),
            switches: Vec::new(),
            leg: None,
            last: None,
        }
    }

    /// Where the antenna was at a time, and which way along the track the front looked.
    fn true_place(&self, world: &World, id: TrainId, time: SimTime) -> Option<(Place, Direction)> {
        let run_m = world.run_at(id, time)? - self.antenna_behind_m;
        Some(world.route(id)?.place(run_m))
    }

    /// Takes a report in that was sent now; gives its class, if it follows a fix or the train has no receiver.
    pub fn report(
        &mut self,
        report: &OccupancyReport,
        world: &World,
        id: TrainId,
    ) -> Option<OccupancyClass> {
        let (truth, facing) = self.true_place(world, id, report.time)?;
        let class = class_of(report, truth.track);
        self.follow(world, id, class);
        self.facing.add(report, (truth.track, facing));
        let class = class.filter(|_| report.of_fix || !self.has_receiver)?;
        self.classes[class as usize] += 1;
        let best = report
            .tracks
            .first()
            .filter(|best| best.track == truth.track);
        if let Some(best) = best {
            let error_m = best.s_m - truth.s_m;
            self.errors_m.push(error_m.abs());
            self.nees_sum += (error_m / best.sigma_m).powi(2);
        }
        Some(class)
    }

    /// Follows the antenna over the toes of switches.
    fn follow(&mut self, world: &World, id: TrainId, class: Option<OccupancyClass>) {
        let (Some(route), Some(head_m)) = (world.route(id), world.run_m(id)) else {
            return;
        };
        let run_m = head_m - self.antenna_behind_m;
        let (place, _) = route.place(run_m);
        if let Some((_, before_m)) = self.last.filter(|(track, _)| *track != place.track) {
            self.switches
                .extend(self.leg.take().map(|leg| leg.identified_m));
            self.leg = leg_entered(world, route, (before_m, run_m), place.track);
        }
        self.last = Some((place.track, run_m));
        let Some(leg) = &mut self.leg else {
            return;
        };
        let near_end = run_m > leg.end_m - BEFORE_END_M;
        let is_told = class == Some(OccupancyClass::CorrectConfident);
        leg.identified_m = match leg.identified_m {
            Some(m) if is_told || near_end => Some(m),
            _ => is_told.then_some(run_m - leg.toe_m),
        };
    }

    /// The figures.
    pub fn finish(mut self) -> OccupancyFigures {
        // The run ended on a leg: that it was not identified by then counts, too.
        self.switches
            .extend(self.leg.take().map(|leg| leg.identified_m));
        let fixes = self.errors_m.len();
        let [wc, wf, wu, cu, cf, cc] = self.classes;
        OccupancyFigures {
            fixes: self.classes.iter().sum(),
            switches: self.switches.len() as u32,
            never_identified: self.switches.iter().filter(|m| m.is_none()).count() as u32,
            identified_mean_m: mean_of_identified_m(&self.switches),
            known_after_m: LegDistances::of(&self.switches),
            legs_known_after_m: self.switches,
            classes: [
                (OccupancyClass::WrongConfident, wc),
                (OccupancyClass::WrongFairlyConfident, wf),
                (OccupancyClass::WrongUndecided, wu),
                (OccupancyClass::CorrectUndecided, cu),
                (OccupancyClass::CorrectFairlyConfident, cf),
                (OccupancyClass::CorrectConfident, cc),
            ]
            .into(),
            facing: self.facing,
            nees_mean: (fixes > 0).then(|| self.nees_sum / fixes as f64),
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

/// None while nothing is said.
fn class_of(report: &OccupancyReport, truth: TrackId) -> Option<OccupancyClass> {
    use OccupancyClass::{
        CorrectConfident, CorrectFairlyConfident, CorrectUndecided, WrongConfident,
        WrongFairlyConfident, WrongUndecided,
    };
    let best = report.tracks.first()?;
    let fairly = best.probability > FAIRLY;
    Some(match (best.track == truth, report.identified, fairly) {
        (false, true, _) => WrongConfident,
        (false, _, true) => WrongFairlyConfident,
        (false, _, false) => WrongUndecided,
        (true, true, _) => CorrectConfident,
        (true, _, true) => CorrectFairlyConfident,
        (true, _, false) => CorrectUndecided,
    })
}

/// The leg onto which the antenna came over a toe between two places of the route; none where it came over a joint, or
/// over a switch run trailing.
fn leg_entered(
    world: &World,
    route: &Route,
    (from_m, to_m): (f64, f64),
    track: TrackId,
) -> Option<EnteredLeg> {
    let passings = world.network().passings(route);
    let between = from_m.min(to_m)..=from_m.max(to_m);
    let passing = passings
        .iter()
        .find(|passing| passing.facing && between.contains(&passing.toe_m))?;
    let legs = route.legs().iter().enumerate();
    let mut begins = legs.map(|(k, leg)| (route.begin_m(k), leg));
    let (begin_m, leg) = begins.find(|(begin_m, _)| (begin_m - passing.toe_m).abs() < 1e-6)?;
    (leg.track == track).then(|| EnteredLeg {
        toe_m: passing.toe_m,
        end_m: begin_m + leg.length_m(),
        identified_m: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::OccupiedTrack;

    /// Only the way that is said of the true track counts, and what is certain is over 0.9 too.
    #[test]
    fn wrong_facings_are_counted() {
        let report = |track: u16, facing: Direction, facing_probability: f64| OccupancyReport {
            time: SimTime::ZERO,
            tracks: vec![OccupiedTrack {
                track: TrackId(track),
                probability: 1.0,
                facing,
                facing_probability,
                s_m: 0.0,
                sigma_m: 1.0,
            }],
            identified: true,
            hypotheses: 1,
            of_fix: false,
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
