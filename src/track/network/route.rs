//! The way of a train over a network.

use super::{Network, NetworkError, TrackEnd};
use crate::track::{Alignment, Direction, Place, Stretch, TrackId};

/// A stretch of one track, run in one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    /// The track.
    pub track: TrackId,
    /// Which way along it.
    pub direction: Direction,
    /// Chainage at which it begins.
    pub from_m: f64,
    /// Chainage at which it ends.
    pub to_m: f64,
}

impl Leg {
    /// Its length.
    pub fn length_m(&self) -> f64 {
        self.direction.ahead_m(self.from_m, self.to_m)
    }

    /// Its chainages, the lower one first.
    pub fn stretch_m(&self) -> (f64, f64) {
        (self.from_m.min(self.to_m), self.from_m.max(self.to_m))
    }

    /// The same stretch, run the other way.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self {
            direction: self.direction.reversed(),
            from_m: self.to_m,
            to_m: self.from_m,
            ..*self
        }
    }
}

/// An ordered run over tracks. Distance along it counts from its begin.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// Never empty.
    legs: Vec<Leg>,
    /// Distance along the route at which each leg begins, and at which the last one ends.
    at_m: Vec<f64>,
}

impl Route {
    /// Of stretches that follow each other.
    pub(super) fn of(legs: Vec<Leg>) -> Self {
        let mut at_m = vec![0.0];
        let mut sum_m = 0.0;
        at_m.extend(legs.iter().map(|leg| {
            sum_m += leg.length_m();
            sum_m
        }));
        Self { legs, at_m }
    }

    /// The stretches in order.
    pub fn legs(&self) -> &[Leg] {
        &self.legs
    }

    /// Its length.
    pub fn length_m(&self) -> f64 {
        self.at_m[self.legs.len()]
    }

    /// Distance along the route at which leg `k` begins.
    pub fn begin_m(&self, k: usize) -> f64 {
        self.at_m[k]
    }

    /// The leg at a distance along the route, by its number; beyond the ends the first or the last one.
    fn leg_at(&self, run_m: f64) -> usize {
        let begun = self.at_m[1..self.legs.len()].partition_point(|at_m| *at_m <= run_m);
        begun.min(self.legs.len() - 1)
    }

    /// The place at a distance along the route, and which way it is run there.
    pub fn place(&self, run_m: f64) -> (Place, Direction) {
        let k = self.leg_at(run_m);
        let leg = &self.legs[k];
        let s_m = leg.from_m + leg.direction.sign() * (run_m - self.at_m[k]);
        let track = leg.track;
        (Place { track, s_m }, leg.direction)
    }

    /// The chainages that leg `k` stands for: its own, and those beyond it on the track where the route begins or
    /// ends, as [`Self::place`] has them.
    fn reach_m(&self, k: usize) -> (f64, f64) {
        let leg = &self.legs[k];
        let (mut low_m, mut high_m) = leg.stretch_m();
        let begins_low = leg.direction == Direction::Up;
        if k == 0 {
            match begins_low {
                true => low_m = f64::NEG_INFINITY,
                false => high_m = f64::INFINITY,
            }
        }
        if k + 1 == self.legs.len() {
            match begins_low {
                true => high_m = f64::INFINITY,
                false => low_m = f64::NEG_INFINITY,
            }
        }
        (low_m, high_m)
    }

    /// The distances along the route at which it comes to a place: none, one, or more where it runs in a
    /// circle. Places beyond its ends on the same track count as well.
    pub fn runs_m(&self, place: Place) -> impl Iterator<Item = f64> {
        let legs = self.legs.iter().zip(&self.at_m).enumerate();
        legs.filter_map(move |(k, (leg, at_m))| {
            let (low_m, high_m) = self.reach_m(k);
            let on = leg.track == place.track && (low_m..=high_m).contains(&place.s_m);
            on.then(|| at_m + leg.direction.ahead_m(leg.from_m, place.s_m))
        })
    }

    /// Of the distances at which it comes to a place, the one nearest to another distance.
    pub fn run_near_m(&self, place: Place, near_m: f64) -> Option<f64> {
        let away = |run_m: &f64| (run_m - near_m).abs();
        self.runs_m(place)
            .min_by(|a, b| away(a).total_cmp(&away(b)))
    }

    /// The distances from which to which the route runs over a stretch of track, in order.
    pub fn runs_over(&self, stretch: Stretch) -> impl Iterator<Item = (f64, f64)> {
        let legs = self.legs.iter().zip(&self.at_m).enumerate();
        legs.filter_map(move |(k, (leg, at_m))| {
            let (low_m, high_m) = self.reach_m(k);
            let (from_m, to_m) = (stretch.from_m.max(low_m), stretch.to_m.min(high_m));
            let run_m = |s_m| at_m + leg.direction.ahead_m(leg.from_m, s_m);
            (leg.track == stretch.track && from_m <= to_m).then(|| match leg.direction {
                Direction::Up => (run_m(from_m), run_m(to_m)),
                Direction::Down => (run_m(to_m), run_m(from_m)),
            })
        })
    }

    /// Whether it runs over a place of a stretch of track, between its ends.
    pub fn covers(&self, stretch: Stretch) -> bool {
        self.legs.iter().any(|leg| {
            let (low_m, high_m) = leg.stretch_m();
            leg.track == stretch.track && low_m < stretch.to_m && stretch.from_m < high_m
        })
    }

    /// The stretches of track between two distances along the route, in order.
    pub fn stretches(&self, from_m: f64, to_m: f64) -> impl Iterator<Item = Stretch> {
        let last = self.legs.len() - 1;
        let legs = self.legs.iter().enumerate();
        legs.filter_map(move |(k, leg)| {
            let begin_m = if k == 0 {
                f64::NEG_INFINITY
            } else {
                self.at_m[k]
            };
            let end_m = if k == last {
                f64::INFINITY
            } else {
                self.at_m[k + 1]
            };
            let (from_m, to_m) = (from_m.max(begin_m), to_m.min(end_m));
            let s_m = |run_m: f64| leg.from_m + leg.direction.sign() * (run_m - self.at_m[k]);
            let [a_m, b_m] = [from_m, to_m].map(s_m);
            (from_m <= to_m).then(|| Stretch {
                track: leg.track,
                from_m: a_m.min(b_m),
                to_m: a_m.max(b_m),
            })
        })
    }

    /// The same route, run from its end.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self::of(self.legs.iter().rev().map(Leg::reversed).collect())
    }

    /// Stretches of track that it has in common with another route, each as it runs over them.
    pub fn shared_with(&self, other: &Self) -> Vec<Leg> {
        let mut shared = Vec::new();
        for leg in &self.legs {
            let (low_m, high_m) = leg.stretch_m();
            for theirs in other.legs.iter().filter(|l| l.track == leg.track) {
                let (their_low_m, their_high_m) = theirs.stretch_m();
                let (from_m, to_m) = (low_m.max(their_low_m), high_m.min(their_high_m));
                if to_m > from_m {
                    let up = Leg {
                        direction: Direction::Up,
                        from_m,
                        to_m,
                        ..*leg
                    };
                    shared.push(match leg.direction {
                        Direction::Up => up,
                        Direction::Down => up.reversed(),
                    });
                }
            }
        }
        shared
    }
}

impl Network {
    /// The route from a place in a direction over tracks that follow each other, the first of which the place
    /// is on, to a chainage of the last one.
    pub fn route_over(
        &self,
        (from, direction): (Place, Direction),
        tracks: &[TrackId],
        to_m: f64,
    ) -> Result<Route, NetworkError> {
        let mut end = TrackEnd {
            track: from.track,
            way: direction,
        };
        let mut entered = vec![end];
        for track in tracks.iter().skip(1) {
            let next = self.next(end).find(|next| next.track == *track);
            let next = next.ok_or(NetworkError::NotNext {
                from: end,
                to: *track,
            })?;
            end = next.opposite();
            entered.push(end);
        }
        let to = Place {
            track: end.track,
            s_m: to_m,
        };
        self.route_by(from, &entered, to)
    }

    /// The route from a place over tracks, each as the end that it is run towards, to a place on the last.
    pub(super) fn route_by(
        &self,
        from: Place,
        tracks: &[TrackEnd],
        to: Place,
    ) -> Result<Route, NetworkError> {
        let last = tracks.len().saturating_sub(1);
        let leg = |(k, end): (usize, &TrackEnd)| {
            let length_m = self.alignment(end.track).map_or(0.0, Alignment::length_m);
            let (begin_m, end_m) = match end.way {
                Direction::Up => (0.0, length_m),
                Direction::Down => (length_m, 0.0),
            };
            let leg = Leg {
                track: end.track,
                direction: end.way,
                from_m: if k == 0 { from.s_m } else { begin_m },
                to_m: if k == last { to.s_m } else { end_m },
            };
            let off = [leg.from_m, leg.to_m].into_iter().find(|s_m| {
                let track = end.track;
                !self.has(Place { track, s_m: *s_m })
            });
            let off = off.or((leg.length_m() < 0.0).then_some(leg.to_m));
            match off {
                Some(s_m) => Err(NetworkError::NotOnTrack {
                    track: end.track,
                    s_m,
                }),
                None => Ok(leg),
            }
        };
        let legs = tracks.iter().enumerate().map(leg);
        Ok(Route::of(legs.collect::<Result<_, _>>()?))
    }

    /// The line that a route runs on, from its begin: it stays where the tracks are in the world.
    pub fn route_alignment(&self, route: &Route) -> Option<Alignment> {
        let line = |leg: &Leg| {
            let (low_m, high_m) = leg.stretch_m();
            let stretch = self.alignment(leg.track)?.stretch(low_m, high_m);
            Some(match leg.direction {
                Direction::Up => stretch,
                Direction::Down => stretch.reversed(),
            })
        };
        let mut lines = route.legs().iter().map(line);
        let first = lines.next()??;
        lines.try_fold(first, |whole, next| Some(whole.then(&next?)))
    }
}
