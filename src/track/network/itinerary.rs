//! The way of a train from its start over places that it is to pass to where it stops, with the tracks behind its
//! tail and beyond its stop.

use super::{Leg, Network, Route, TrackEnd};
use crate::track::{Direction, Place, TrackId};

/// A route without a stop ends after so many tracks.
const MOST_TRACKS: usize = 200;
/// Beyond a stop a route goes on for so far, where there is track: a train may run past it.
const BEYOND_M: f64 = 500.0;

/// What a train is to pass on its way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Waypoint {
    /// It runs over a track.
    Track(TrackId),
    /// It comes to a place.
    Place(Place),
}

/// A stretch of a route where a speed is permitted that is lower than elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedLimit {
    /// Distance along the route at which it begins.
    pub from_m: f64,
    /// And at which it ends.
    pub to_m: f64,
    /// The speed.
    pub mps: f64,
}

/// A route of whole tracks, with the places of a train on it.
#[derive(Clone, Debug, PartialEq)]
pub struct Itinerary {
    /// From behind the train's tail to beyond its stop.
    pub route: Route,
    /// Distance along the route of the train's head at the start.
    pub start_m: f64,
    /// Distances along the route of the places that it is to come to, in order.
    pub places_m: Vec<f64>,
    /// Distance along the route of its stop.
    pub stop_m: Option<f64>,
}

impl Network {
    /// The way of a train from a start over other tracks to a stop: the shortest from each to the next. Where nothing
    /// else is said it runs switches straight on. Behind the start there are at least `behind_m` of it, where there
    /// is track. None where there is no such way.
    pub fn itinerary(
        &self,
        (start, direction): (Place, Direction),
        via: &[Waypoint],
        stop: Option<Place>,
        behind_m: f64,
    ) -> Option<Itinerary> {
        let mut ends = vec![TrackEnd {
            track: start.track,
            way: direction,
        }];
        let mut at = (start, direction);
        // Which track of the way each place is on.
        let mut places = Vec::new();
        for waypoint in via {
            at = match *waypoint {
                Waypoint::Place(place) => self.go_on(&mut ends, at, place)?,
                Waypoint::Track(track) if at.0.track == track => at,
                Waypoint::Track(track) => {
                    let place = self.nearer_end(at, track)?;
                    self.go_on(&mut ends, at, place)?
                }
            };
            if let Waypoint::Place(place) = waypoint {
                places.push((ends.len() - 1, place.s_m));
            }
        }
        if let Some(stop) = stop {
            self.go_on(&mut ends, at, stop)?;
        }
        let stop_leg = ends.len() - 1;
        self.run_on(&mut ends, stop.is_some());
        let behind = self.behind((start, direction), behind_m);
        let (start_leg, stop_leg) = (behind.len(), behind.len() + stop_leg);
        let all = behind.into_iter().chain(ends);
        let legs: Option<Vec<Leg>> = all.map(|end| self.whole_leg(end)).collect();
        let route = Route::of(legs?);
        let run_m = |k: usize, s_m: f64| {
            let leg = &route.legs()[k];
            route.begin_m(k) + leg.direction.ahead_m(leg.from_m, s_m)
        };
        let places = places.into_iter();
        Some(Itinerary {
            start_m: run_m(start_leg, start.s_m),
            places_m: places.map(|(k, s_m)| run_m(start_leg + k, s_m)).collect(),
            stop_m: stop.map(|stop| run_m(stop_leg, stop.s_m)),
            route,
        })
    }

    /// The speeds that switches permit on their diverging legs, which count to the ends of those.
    pub fn speed_limits(&self, route: &Route) -> Vec<SpeedLimit> {
        let legs = route.legs().iter().enumerate();
        let limits = legs.flat_map(|(k, leg)| {
            let from_m = route.begin_m(k);
            let slow = self
                .switches
                .iter()
                .filter(|s| s.diverging.track == leg.track);
            slow.map(move |switch| SpeedLimit {
                from_m,
                to_m: from_m + leg.length_m(),
                mps: switch.diverging_mps,
            })
        });
        limits.collect()
    }

    /// The end of a track to which the way is shorter.
    fn nearer_end(&self, from: (Place, Direction), track: TrackId) -> Option<Place> {
        let length_m = self.alignment(track)?.length_m();
        let ends = [0.0, length_m].map(|s_m| Place { track, s_m });
        let ways = ends.map(|end| Some((self.shortest(from, end)?.length_m(), end)));
        let nearer = ways.into_iter().flatten();
        nearer
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, end)| end)
    }

    /// Adds the tracks of the shortest way to a place; gives where that comes to, and which way.
    fn go_on(
        &self,
        ends: &mut Vec<TrackEnd>,
        from: (Place, Direction),
        to: Place,
    ) -> Option<(Place, Direction)> {
        let way = self.shortest(from, to)?;
        let legs = way.legs().iter().skip(1);
        ends.extend(legs.map(|leg| TrackEnd {
            track: leg.track,
            way: leg.direction,
        }));
        Some(way.place(way.length_m()))
    }

    /// Adds the tracks beyond the last one, straight on.
    pub(super) fn run_on(&self, ends: &mut Vec<TrackEnd>, stops: bool) {
        let mut beyond_m = 0.0;
        while let Some(next) = ends.last().and_then(|end| self.next(*end).next()) {
            if ends.len() >= MOST_TRACKS || (stops && beyond_m >= BEYOND_M) {
                return;
            }
            beyond_m += self
                .alignment(next.track)
                .map_or(0.0, |line| line.length_m());
            ends.push(next.opposite());
        }
    }

    /// The tracks behind a place, straight on, as a train runs over them that comes to it.
    fn behind(&self, (place, direction): (Place, Direction), behind_m: f64) -> Vec<TrackEnd> {
        let mut back = TrackEnd {
            track: place.track,
            way: direction.reversed(),
        };
        let mut length_m = self.left_m(place, back.way).unwrap_or(0.0);
        let mut tracks = Vec::new();
        while length_m < behind_m && tracks.len() < MOST_TRACKS {
            let Some(next) = self.next(back).next() else {
                break;
            };
            // The next track is entered at this end from its other one by a train that comes.
            tracks.push(next);
            back = next.opposite();
            length_m += self
                .alignment(next.track)
                .map_or(0.0, |line| line.length_m());
        }
        tracks.reverse();
        tracks
    }

    /// The whole of a track, run towards an end.
    pub(super) fn whole_leg(&self, end: TrackEnd) -> Option<Leg> {
        let length_m = self.alignment(end.track)?.length_m();
        let (from_m, to_m) = match end.way {
            Direction::Up => (0.0, length_m),
            Direction::Down => (length_m, 0.0),
        };
        Some(Leg {
            track: end.track,
            direction: end.way,
            from_m,
            to_m,
        })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::track::Tunnel;

    /// Provokes: a way that leaves out what it is to pass, a train whose tail is on no track, a start or stop at
    /// another distance than its place, tracks that do not follow each other.
    #[test]
    fn a_train_goes_where_it_is_sent() {
        let text = include_str!("../../../tunnels/terminus.toml");
        let network = Tunnel::from_toml(text).unwrap().network;
        let track = |name| network.named(name).unwrap();
        let place = |name, s_m| Place {
            track: track(name),
            s_m,
        };
        let names = |it: &Itinerary| {
            let legs = it.route.legs().iter();
            let names = legs.map(|leg| &*network.tracks[usize::from(leg.track.0)].name);
            names.collect::<Vec<_>>().join(" ")
        };
        let start = (place("u3", 20.0), Direction::Up);
        let it = network
            .itinerary(start, &[], Some(place("siding", 170.0)), 200.0)
            .unwrap();
        // Behind its head are 20 m of u3, 154 m of u2, and u1.
        assert_eq!(names(&it), "u1 u2 u3 C d4 siding");
        assert_eq!(it.route.place(it.start_m).0, start.0);
        let (stop, way) = it.route.place(it.stop_m.unwrap());
        assert!((stop.s_m - 170.0).abs() < 1e-9 && way == Direction::Up);
        assert_eq!(stop.track, track("siding"));

        let up = (place("u1", 200.0), Direction::Up);
        let by = |via: &[Waypoint]| network.itinerary(up, via, Some(place("siding", 100.0)), 200.0);
        assert_eq!(names(&by(&[]).unwrap()), "u1 A d2 d3 d4 siding");
        assert_eq!(
            names(&by(&[Waypoint::Track(track("u3"))]).unwrap()),
            "u1 u2 u3 C d4 siding"
        );
        assert_eq!(by(&[Waypoint::Track(track("lead"))]), None);

        // With a call at the platform on the way, and slow over the crossover.
        let platform = Waypoint::Place(place("u3", 140.0));
        let it = by(&[platform]).unwrap();
        assert!((it.places_m[0] - (460.0 + 154.311 + 140.0)).abs() < 1e-2);
        let limits = network.speed_limits(&it.route);
        // Of both its switches.
        assert_eq!(limits.len(), 2);
        assert!((limits[0].mps - 30.0 / 3.6).abs() < 1e-9);
        assert!((limits[0].to_m - limits[0].from_m - 67.387).abs() < 1e-2);

        let down = (place("depot 3", 200.0), Direction::Down);
        let it = network
            .itinerary(down, &[], Some(place("d1", 50.0)), 200.0)
            .unwrap();
        assert_eq!(names(&it), "depot 3 ladder 2 ladder 1 lead D d4 d3 d2 d1");
        assert!((it.start_m - (239.13 - 200.0)).abs() < 1e-9);

        // Without a stop it runs on to the end.
        let it = network.itinerary(up, &[], None, 10.0).unwrap();
        assert_eq!(names(&it), "u1 u2 u3 u4 lead depot 1");
        let all = [up.0, down.0].map(|place| network.has(place));
        assert_eq!(all, [true, true]);
    }
}
