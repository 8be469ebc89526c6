//! Where trains on two tracks are in each other's way.

use super::{Network, Route, Switch, SwitchLeg, TrackEnd, turned_round};
use crate::track::{Alignment, Direction, Gauge, RAIL_OFFSET_M, Stretch, TrackFrame};

/// Steps of the search for a clearance point.
const STEP_M: f64 = 0.25;
/// No clearance point is looked for farther from the toe.
const FARTHEST_M: f64 = 200.0;

/// At the heels of a switch's blades, a stock rail and the blade are so far apart: a rail's head, and the way of a
/// wheel's flange.
const HEEL_M: f64 = 0.13;

/// No more tracks are looked at behind a leg: enough for the throat of any station.
const MOST_BEHIND: usize = 64;

/// Just inside a leg.
const INSIDE_M: f64 = 1e-6;

/// Where routes are in each other's way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Conflict {
    /// At a switch, by its number.
    Switch(usize),
    /// At a crossing, by its number.
    Crossing(usize),
}

impl Network {
    /// How far behind the toe the rails of its legs cross: the point of the frog, about.
    pub fn frog_m(&self, switch: &Switch) -> Option<f64> {
        self.clearance_m(switch, 2.0 * RAIL_OFFSET_M)
    }

    /// How far behind the toe trains on both legs clear each other.
    pub fn clear_from_m(&self, switch: &Switch) -> Option<f64> {
        self.clearance_m(switch, self.clear_apart_m(switch))
    }

    /// Distance of the centrelines of legs at which trains on them clear each other: their gauges, with what cars
    /// swing out in the curve of the diverging leg.
    pub fn clear_apart_m(&self, switch: &Switch) -> f64 {
        let legs = [switch.through, switch.diverging].map(|end| self.entered(end));
        let curvatures = legs.map(|leg| leg.map_or(0.0, |frame| frame.curvature_per_m));
        curvatures.map(|k| Gauge::b1(k).widest_m()).iter().sum()
    }

    /// A track just behind an end, as a train has it that enters there.
    pub fn entered(&self, end: TrackEnd) -> Option<TrackFrame> {
        let line = self.alignment(end.track)?;
        Some(match end.way {
            Direction::Down => line.at(INSIDE_M),
            Direction::Up => turned_round(&line.at(line.length_m() - INSIDE_M)),
        })
    }

    /// How far behind its toe the legs of a switch are so far apart, in plan: a train that stands farther in on
    /// one leg clears trains on the other, if the distance is that of two trains that pass. None where they
    /// never are.
    pub fn clearance_m(&self, switch: &Switch, apart_m: f64) -> Option<f64> {
        let steps = (1..).map(|k| f64::from(k) * STEP_M);
        let mut own = Behind::of(switch.diverging);
        let mut other = Behind::of(switch.through);
        let mut near_s_m = self.chainage_behind(switch.through, 0.0)?;
        for behind_m in steps.take_while(|m| *m <= FARTHEST_M) {
            let (line, s_m) = own.at(self, behind_m)?;
            let at = line.at(s_m).origin;
            let line = self.alignment(other.entered.track)?;
            let mut across = line.track_from_world(&at, near_s_m);
            let is_beyond = match other.entered.way {
                Direction::Down => across.s_m > line.length_m(),
                Direction::Up => across.s_m < 0.0,
            };
            if is_beyond && other.goes_on(self) {
                let next = self.alignment(other.entered.track)?;
                across = next.track_from_world(&at, next.near_m(&at));
            }
            near_s_m = across.s_m;
            if across.l_m.abs() >= apart_m {
                return Some(behind_m);
            }
        }
        None
    }

    /// Chainage so far behind an end, into its track; none where the track is shorter.
    pub fn chainage_behind(&self, end: TrackEnd, behind_m: f64) -> Option<f64> {
        let length_m = self.alignment(end.track)?.length_m();
        let s_m = match end.way {
            Direction::Up => length_m - behind_m,
            Direction::Down => behind_m,
        };
        (0.0..=length_m).contains(&s_m).then_some(s_m)
    }

    /// How far behind the toe of a switch its blades end, at their heels; none where its legs part too late.
    pub fn heel_m(&self, switch: &Switch) -> Option<f64> {
        self.clearance_m(switch, HEEL_M)
    }

    /// Where two routes are in each other's way. At a switch: both run over one of its tracks nearer to the toe than
    /// where its legs are so far apart, and all along where they never are. At a crossing: each runs over one of its
    /// tracks where gauges overlap.
    pub fn conflicts(&self, a: &Route, b: &Route, apart_m: f64) -> Vec<Conflict> {
        let fouls = |route: &Route, switch: &Switch, within_m: f64| {
            let legs = [SwitchLeg::Through, SwitchLeg::Diverging].map(|side| switch.leg(side));
            let mut stretches = legs
                .into_iter()
                .flat_map(|leg| self.stretches_behind(leg, within_m));
            stretches.any(|stretch| route.covers(stretch))
        };
        let switches = self.switches.iter().enumerate().filter(|(_, switch)| {
            let within_m = self.clearance_m(switch, apart_m).unwrap_or(f64::INFINITY);
            fouls(a, switch, within_m) && fouls(b, switch, within_m)
        });
        let crossings = self.crossings.iter().enumerate().filter(|(_, crossing)| {
            let runs = |route: &Route, side| route.covers(crossing.zone(side));
            (runs(a, 0) && runs(b, 1)) || (runs(a, 1) && runs(b, 0))
        });
        let switches = switches.map(|(number, _)| Conflict::Switch(number));
        switches
            .chain(crossings.map(|(number, _)| Conflict::Crossing(number)))
            .collect()
    }

    /// The track behind an end, and those that trains come to from it, as far as they are nearer to the end than so
    /// far; of endless distances the first track alone.
    fn stretches_behind(&self, end: TrackEnd, within_m: f64) -> Vec<Stretch> {
        let mut stretches = Vec::new();
        let mut open = vec![(end, within_m)];
        while let Some((entered, left_m)) = open.pop() {
            let Some(length_m) = self.alignment(entered.track).map(Alignment::length_m) else {
                continue;
            };
            let reach_m = left_m.min(length_m);
            let (from_m, to_m) = match entered.way {
                Direction::Down => (0.0, reach_m),
                Direction::Up => (length_m - reach_m, length_m),
            };
            stretches.push(Stretch {
                track: entered.track,
                from_m,
                to_m,
            });
            if left_m.is_finite() && left_m > length_m && stretches.len() < MOST_BEHIND {
                let next = self.next(entered.opposite());
                open.extend(next.map(|next| (next, left_m - length_m)));
            }
        }
        stretches
    }
}

/// A way from an end into its track, and on over the through legs of switches.
struct Behind {
    entered: TrackEnd,
    begin_m: f64,
}

impl Behind {
    fn of(entered: TrackEnd) -> Self {
        Self {
            entered,
            begin_m: 0.0,
        }
    }

    /// Onto the next track; false where there is none.
    fn goes_on(&mut self, network: &Network) -> bool {
        let length_m = network
            .alignment(self.entered.track)
            .map(Alignment::length_m);
        let next = network.next(self.entered.opposite()).next();
        let (Some(length_m), Some(next)) = (length_m, next) else {
            return false;
        };
        self.begin_m += length_m;
        self.entered = next;
        true
    }

    /// The track and chainage so far behind the first end.
    fn at<'n>(&mut self, network: &'n Network, behind_m: f64) -> Option<(&'n Alignment, f64)> {
        loop {
            match network.chainage_behind(self.entered, behind_m - self.begin_m) {
                Some(s_m) => return Some((network.alignment(self.entered.track)?, s_m)),
                None if self.goes_on(network) => {}
                None => return None,
            }
        }
    }
}
