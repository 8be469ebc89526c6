//! Where trains on two tracks are in each other's way.

use super::{Leg, Network, Route, Switch, SwitchLeg, TrackEnd, turned_round};
use crate::track::{Direction, Gauge, RAIL_OFFSET_M, TrackFrame};

/// Steps of the search for a clearance point.
const STEP_M: f64 = 0.25;
/// No clearance point is looked for farther from the toe.
const FARTHEST_M: f64 = 200.0;

/// At the heels of a switch's blades, a stock rail and the blade are so far apart: a rail's head, and the way of a
/// wheel's flange.
const HEEL_M: f64 = 0.13;

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
        let other = self.alignment(switch.through.track)?;
        let steps = (1..).map(|k| f64::from(k) * STEP_M);
        let mut near_s_m = self.chainage_behind(switch.through, 0.0)?;
        for behind_m in steps.take_while(|m| *m <= FARTHEST_M) {
            let place = self.chainage_behind(switch.diverging, behind_m)?;
            let track = self.alignment(switch.diverging.track)?;
            let across = other.track_from_world(&track.at(place).origin, near_s_m);
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
            let mut legs = route.legs().iter();
            legs.any(|leg| self.is_near(leg, switch, within_m))
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

    /// Whether a leg of a route comes nearer to a switch's toe than so far, on one of the switch's legs.
    fn is_near(&self, leg: &Leg, switch: &Switch, within_m: f64) -> bool {
        let ends = [SwitchLeg::Through, SwitchLeg::Diverging].map(|side| switch.leg(side));
        ends.into_iter()
            .filter(|end| end.track == leg.track)
            .any(|end| {
                let (low_m, high_m) = leg.stretch_m();
                let length_m = self
                    .alignment(end.track)
                    .map_or(0.0, |track| track.length_m());
                match end.way {
                    Direction::Up => length_m - high_m < within_m,
                    Direction::Down => low_m < within_m,
                }
            })
    }
}
