//! Ways from place to place.

use super::{Network, Route, TrackEnd};
use crate::track::{Alignment, Direction, Place};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

/// A distance that can be ordered.
#[derive(Clone, Copy, PartialEq)]
struct Metres(f64);

impl Eq for Metres {}

impl PartialOrd for Metres {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Metres {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl Network {
    /// The shortest route from a place in a direction to another place, which it may come to from either
    /// side. A train never turns round on it.
    pub fn shortest(&self, (from, direction): (Place, Direction), to: Place) -> Option<Route> {
        let start = TrackEnd {
            track: from.track,
            way: direction,
        };
        if let Some(route) = self.along_one(from, start, to) {
            return Some(route);
        }
        // Distance at which the end of each track is reached, and the track before it. The end of the first
        // may be come to a second time, from its own begin, so it is not taken as done.
        let mut before = BTreeMap::<TrackEnd, TrackEnd>::new();
        let mut queue = BinaryHeap::new();
        let left_m = self.left_m(from, direction)?;
        self.enter_next(start, left_m, &mut queue);
        let mut best: Option<(f64, TrackEnd)> = None;
        while let Some(Reverse((Metres(at_m), end, came_from))) = queue.pop() {
            if best.is_some_and(|(best_m, _)| at_m >= best_m) {
                break;
            }
            if before.contains_key(&end) {
                continue;
            }
            before.insert(end, came_from);
            if end.track == to.track {
                let way_m = at_m + self.entered_m(end, to)?;
                if best.is_none_or(|(best_m, _)| way_m < best_m) {
                    best = Some((way_m, end));
                }
            }
            let length_m = self.alignment(end.track).map_or(0.0, Alignment::length_m);
            self.enter_next(end, at_m + length_m, &mut queue);
        }
        let (_, last) = best?;
        let mut tracks = vec![last];
        let mut end = last;
        while let Some(came_from) = before.get(&end) {
            tracks.push(*came_from);
            // The first track is where the search began, unless it came round to it.
            if *came_from == start {
                break;
            }
            end = *came_from;
        }
        tracks.reverse();
        self.route_by(from, &tracks, to).ok()
    }

    /// All routes from a place in a direction to another place that are no longer than `most_m` and run over
    /// no track twice in the same direction, the shortest first.
    pub fn routes(
        &self,
        (from, direction): (Place, Direction),
        to: Place,
        most_m: f64,
    ) -> Vec<Route> {
        let start = TrackEnd {
            track: from.track,
            way: direction,
        };
        let mut found: Vec<Route> = self.along_one(from, start, to).into_iter().collect();
        found.retain(|route| route.length_m() <= most_m);
        let Some(left_m) = self.left_m(from, direction) else {
            return found;
        };
        // Ways that are still followed: the tracks so far, and the distance at the last one's end.
        let mut open = vec![(vec![start], left_m)];
        while let Some((tracks, at_m)) = open.pop() {
            let Some(end) = tracks.last().filter(|_| at_m <= most_m) else {
                continue;
            };
            for next in self.next(*end) {
                let end = next.opposite();
                if tracks.contains(&end) {
                    continue;
                }
                let mut tracks = tracks.clone();
                tracks.push(end);
                if end.track == to.track {
                    let route = self.route_by(from, &tracks, to).ok();
                    found.extend(route.filter(|route| route.length_m() <= most_m));
                }
                let length_m = self.alignment(end.track).map_or(0.0, Alignment::length_m);
                open.push((tracks, at_m + length_m));
            }
        }
        found.sort_by(|a, b| f64::total_cmp(&a.length_m(), &b.length_m()));
        found
    }

    /// The route within one track, where the place lies ahead.
    fn along_one(&self, from: Place, start: TrackEnd, to: Place) -> Option<Route> {
        let ahead = from.track == to.track && start.way.ahead_m(from.s_m, to.s_m) >= 0.0;
        ahead.then(|| self.route_by(from, &[start], to).ok())?
    }

    /// From a place to the end of its track.
    pub(super) fn left_m(&self, from: Place, direction: Direction) -> Option<f64> {
        let length_m = self
            .alignment(from.track)
            .filter(|_| self.has(from))?
            .length_m();
        Some(match direction {
            Direction::Up => length_m - from.s_m,
            Direction::Down => from.s_m,
        })
    }

    /// From where a track is entered that is run towards an end, to a place on it.
    fn entered_m(&self, end: TrackEnd, to: Place) -> Option<f64> {
        self.left_m(to, end.way.reversed())
    }

    fn enter_next(
        &self,
        end: TrackEnd,
        at_m: f64,
        queue: &mut BinaryHeap<Reverse<(Metres, TrackEnd, TrackEnd)>>,
    ) {
        let entered = self.next(end).map(TrackEnd::opposite);
        queue.extend(entered.map(|next| Reverse((Metres(at_m), next, end))));
    }
}
