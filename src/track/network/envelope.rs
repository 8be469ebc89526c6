//! What is in the way of a train on a route: what stands on its tracks, and what fouls them at a switch or a crossing.

use super::{Crossing, Network, Route, SwitchLeg, TrackEnd};
use crate::track::{Direction, Stretch};

/// The room that a train on a route needs.
///
/// ```
/// use metrotwin::track::network::RouteEnvelope;
/// use metrotwin::track::{Direction, Place, Stretch, TrackId, Tunnel};
///
/// let network = Tunnel::from_toml(include_str!("../../../tunnels/terminus.toml"))?.network;
/// let place = |track, s_m| Place { track: TrackId(track), s_m };
/// // Straight on over the switch W1, at 460 m.
/// let route = network.shortest((place(0, 300.0), Direction::Up), place(1, 100.0)).unwrap();
/// let envelope = RouteEnvelope::new(&network, route);
/// // A toolbox on the crossover, 10 m behind the toe, is in the way; one 50 m behind it is not.
/// let on_a = |s_m| Stretch { track: TrackId(10), from_m: s_m, to_m: s_m };
/// let (from_m, _) = envelope.runs_over(on_a(10.0)).next().unwrap();
/// assert!((from_m - 170.0).abs() < 1e-9);
/// assert!(envelope.runs_over(on_a(50.0)).next().is_none());
/// # Ok::<(), metrotwin::settings::FileError>(())
/// ```
#[derive(Clone, Debug)]
pub struct RouteEnvelope {
    route: Route,
    fouling: Vec<Fouling>,
    crossings: Vec<Crossing>,
}

/// A switch on the route, run over one of its legs: trains on the other leg foul the route.
#[derive(Clone, Copy, Debug)]
struct Fouling {
    /// Where the other leg begins, and its length.
    other: TrackEnd,
    length_m: f64,
    /// It fouls the route up to here behind the toe.
    clear_m: f64,
    /// Distance along the route of the toe.
    toe_m: f64,
    /// The route runs the switch facing.
    facing: bool,
}

impl RouteEnvelope {
    /// Of a route over a network.
    pub fn new(network: &Network, route: Route) -> Self {
        let fouling = fouling(network, &route);
        let runs_over = |crossing: &&Crossing| {
            let mut zones = [0, 1].map(|side| crossing.zone(side)).into_iter();
            zones.any(|zone| route.runs_over(zone).next().is_some())
        };
        let crossings = network.crossings.iter().filter(runs_over);
        Self {
            crossings: crossings.cloned().collect(),
            fouling,
            route,
        }
    }

    /// The route.
    pub fn route(&self) -> &Route {
        &self.route
    }

    /// The distances from which to which a stretch of track is in the way of the route: where it is on it, and
    /// where gauges overlap.
    pub fn runs_over(&self, stretch: Stretch) -> impl Iterator<Item = (f64, f64)> {
        self.route
            .runs_over(stretch)
            .chain(self.fouls_over(stretch))
    }

    /// The distances from which to which gauges overlap with those of a stretch of another track, at a switch or a
    /// crossing.
    pub fn fouls_over(&self, stretch: Stretch) -> impl Iterator<Item = (f64, f64)> {
        let switches = self.fouling.iter();
        let at_switches = switches.filter_map(move |f| f.runs_over(stretch));
        let crossings = self.crossings.iter();
        let in_way = crossings.filter_map(move |crossing| crossing.in_way_of(stretch));
        at_switches.chain(in_way.flat_map(|own| self.route.runs_over(own)))
    }
}

impl Fouling {
    fn runs_over(&self, stretch: Stretch) -> Option<(f64, f64)> {
        if stretch.track != self.other.track {
            return None;
        }
        let behind_m = |s_m: f64| match self.other.way {
            Direction::Down => s_m,
            Direction::Up => self.length_m - s_m,
        };
        let [a_m, b_m] = [stretch.from_m, stretch.to_m].map(behind_m);
        let (near_m, far_m) = (a_m.min(b_m), a_m.max(b_m));
        let (near_m, far_m) = (near_m.max(0.0), far_m.min(self.clear_m));
        (near_m <= far_m).then_some(match self.facing {
            true => (self.toe_m + near_m, self.toe_m + far_m),
            false => (self.toe_m - far_m, self.toe_m - near_m),
        })
    }
}

/// A switch whose legs are nowhere clear of each other is fouled all along.
fn fouling(network: &Network, route: &Route) -> Vec<Fouling> {
    let mut all = Vec::new();
    for switch in &network.switches {
        let clear_m = network.clear_from_m(switch).unwrap_or(f64::INFINITY);
        for (leg, other) in [
            (SwitchLeg::Through, SwitchLeg::Diverging),
            (SwitchLeg::Diverging, SwitchLeg::Through),
        ] {
            let (own, other) = (switch.leg(leg), switch.leg(other));
            let length_m = |end: TrackEnd| network.alignment(end.track).map(|line| line.length_m());
            let (Some(own_m), Some(length_m)) = (length_m(own), length_m(other)) else {
                continue;
            };
            for (k, run) in route
                .legs()
                .iter()
                .enumerate()
                .filter(|(_, l)| l.track == own.track)
            {
                // A train that enters at this end runs away from it.
                let facing = run.direction != own.way;
                let toe_s_m = match own.way {
                    Direction::Down => 0.0,
                    Direction::Up => own_m,
                };
                all.push(Fouling {
                    other,
                    length_m,
                    clear_m,
                    toe_m: route.begin_m(k) + run.direction.ahead_m(run.from_m, toe_s_m),
                    facing,
                });
            }
        }
    }
    all
}
