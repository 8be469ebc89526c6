//! The switches that a route runs over.

use super::{Leg, Network, Route, SwitchLeg, TrackEnd};
use crate::track::Direction;

/// A route runs over a switch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passing {
    /// Which switch, by number.
    pub switch: usize,
    /// From the toe to a leg.
    pub facing: bool,
    /// The leg that the route runs over.
    pub leg: SwitchLeg,
    /// Distance along the route of the toe.
    pub toe_m: f64,
}

impl Passing {
    /// From where to where along the route a train is on the switch, or in the way of one on its other leg, which is
    /// clear of it so far behind the toe.
    pub fn zone_m(&self, clear_m: f64) -> (f64, f64) {
        match self.facing {
            true => (self.toe_m - TOE_M, self.toe_m + clear_m),
            false => (self.toe_m - clear_m, self.toe_m + TOE_M),
        }
    }
}

/// Trains keep so far from the tips of blades, on the side of the toe.
const TOE_M: f64 = 2.0;

impl Network {
    /// The switches that a route runs over, in order.
    pub fn passings(&self, route: &Route) -> Vec<Passing> {
        let legs = route.legs();
        let joints = legs.windows(2).enumerate();
        joints
            .filter_map(|(k, pair)| {
                let (left, entered) = (end_of(&pair[0]), begin_of(&pair[1]));
                let toe_m = route.begin_m(k + 1);
                self.switches.iter().enumerate().find_map(|(switch, s)| {
                    let leg = |end: TrackEnd| match end {
                        end if end == s.through => Some(SwitchLeg::Through),
                        end if end == s.diverging => Some(SwitchLeg::Diverging),
                        _ => None,
                    };
                    let (facing, leg) = match (left == s.toe, entered == s.toe) {
                        (true, _) => (true, leg(entered)?),
                        (_, true) => (false, leg(left)?),
                        _ => return None,
                    };
                    Some(Passing {
                        switch,
                        facing,
                        leg,
                        toe_m,
                    })
                })
            })
            .collect()
    }

    /// The way of a train that a switch leads onto its other leg than that of the route, and then straight on.
    pub fn diverted(&self, route: &Route, passing: &Passing) -> Option<Route> {
        let switch = self.switches.get(passing.switch)?;
        let other = match passing.leg {
            SwitchLeg::Through => switch.diverging,
            SwitchLeg::Diverging => switch.through,
        };
        let legs = route.legs().iter().enumerate();
        let kept = legs.take_while(|(k, _)| route.begin_m(*k) < passing.toe_m - 1e-9);
        let mut legs: Vec<Leg> = kept.map(|(_, leg)| *leg).collect();
        let mut ends = vec![other.opposite()];
        self.run_on(&mut ends, false);
        for end in ends {
            legs.push(self.whole_leg(end)?);
        }
        Some(Route::of(legs))
    }
}

/// The end of its track that a leg begins at, and ends at.
fn begin_of(leg: &Leg) -> TrackEnd {
    TrackEnd {
        track: leg.track,
        way: leg.direction.reversed(),
    }
}

fn end_of(leg: &Leg) -> TrackEnd {
    let way: Direction = leg.direction;
    TrackEnd {
        track: leg.track,
        way,
    }
}
