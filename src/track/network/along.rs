//! What a train meets on its route: the tracks of the route one after the other, as one track.

use super::{Network, Route};
use crate::track::{Direction, LampSite, Track, TrackId, TrackPoint};
use std::sync::Arc;

/// Lamps of other tracks are on the route's map up to this far beside it, in plan: a lamp of 0.25 m has 13 pixels there
/// through a lens of 1040, which gives its place, not its name.
const BESIDE_M: f64 = 20.0;
/// And so far above or below.
const LEVEL_M: f64 = 6.0;

impl Network {
    /// The tracks of a route as one: chainages count along the route, left is left of who runs on it. Lamps of
    /// tracks beside it are among its lamps where no wall hides them from it.
    ///
    /// # Panics
    ///
    /// On a route of another network.
    pub fn along(&self, route: &Route) -> Arc<Track> {
        if let Some(track) = self.whole_track(route) {
            return track;
        }
        let parts = route.legs().iter().map(|leg| {
            let (low_m, high_m) = leg.stretch_m();
            let part = self.tracks[usize::from(leg.track.0)].stretch(low_m, high_m);
            match leg.direction {
                Direction::Up => part,
                Direction::Down => part.reversed(),
            }
        });
        let whole = parts.reduce(Track::then);
        let mut whole = whole.unwrap_or_else(|| Track::clone(&self.tracks[0]));
        self.add_lamps_beside(route, &mut whole);
        Arc::new(whole)
    }

    /// The track of a network of one, where the route is all of it.
    fn whole_track(&self, route: &Route) -> Option<Arc<Track>> {
        let ([track], [leg]) = (&self.tracks[..], route.legs()) else {
            return None;
        };
        let whole = leg.stretch_m() == (0.0, track.alignment.length_m());
        whole.then(|| match leg.direction {
            Direction::Up => track.clone(),
            Direction::Down => Arc::new(track.reversed()),
        })
    }

    fn add_lamps_beside(&self, route: &Route, whole: &mut Track) {
        let on_route = |k: usize| route.legs().iter().any(|leg| usize::from(leg.track.0) == k);
        let others = (self.tracks.iter().enumerate()).filter(|(k, _)| !on_route(*k));
        for lamp in others.flat_map(|(_, track)| &track.lamps) {
            let point = whole.alignment.nearest(&lamp.centre);
            if let Some(TrackPoint { s_m, l_m, h_m }) = point
                && l_m.abs() <= BESIDE_M
                && h_m.abs() <= LEVEL_M
                && self.is_seen_from(&whole.alignment, s_m, &lamp.centre)
            {
                whole.lamps.push(LampSite {
                    chainage_m: s_m,
                    lateral_m: l_m,
                    height_m: h_m,
                    ..lamp.clone()
                });
            }
        }
        (whole.lamps).sort_by(|a, b| a.chainage_m.total_cmp(&b.chainage_m));
    }

    /// The whole of the only track of a network, run in a direction.
    pub fn only_track(&self, direction: Direction) -> Option<Route> {
        let track = TrackId::default();
        let length_m = self.alignment(track)?.length_m();
        let end_m = [(0.0, length_m), (length_m, 0.0)];
        let (from_m, to_m) = end_m[usize::from(direction == Direction::Down)];
        Some(Route::of(vec![super::Leg {
            track,
            direction,
            from_m,
            to_m,
        }]))
    }
}

impl Track {
    /// The track between two of its chainages, the first of which becomes 0. It states no other ones.
    #[must_use]
    pub fn stretch(&self, from_m: f64, to_m: f64) -> Self {
        let is_on = |s_m: f64| (from_m..=to_m).contains(&s_m);
        let mut part = self.shifted(-from_m);
        part.alignment = self.alignment.stretch(from_m, to_m);
        part.stated_chainage = None;
        part.lamps = kept(part.lamps, |lamp| is_on(lamp.chainage_m + from_m));
        part.wayside = kept(part.wayside, |site| is_on(site.chainage_m + from_m));
        part.balises = kept(part.balises, |balise| is_on(balise.chainage_m + from_m));
        part.base_stations = kept(part.base_stations, |base| is_on(base.chainage_m + from_m));
        part.stations = kept(part.stations, |stop| is_on(stop.chainage_m + from_m));
        let length_m = to_m - from_m;
        part.sections = kept(part.sections, |r| r.to_m > 0.0 && r.from_m < length_m);
        for range in &mut part.sections {
            range.from_m = range.from_m.max(0.0);
            range.to_m = range.to_m.min(length_m);
        }
        part
    }

    /// This track and then another one, which begins where this one ends. It states no chainages but those from its
    /// begin: each of the two may have others.
    #[must_use]
    pub fn then(mut self, next: Self) -> Self {
        let length_m = self.alignment.length_m();
        let next = next.shifted(length_m);
        self.name = format!("{}, {}", self.name, next.name);
        self.alignment = self.alignment.then(&next.alignment);
        self.stated_chainage = None;
        self.sections.extend(next.sections);
        self.lamps.extend(next.lamps);
        self.wayside.extend(next.wayside);
        self.balises.extend(next.balises);
        self.base_stations.extend(next.base_stations);
        self.stations.extend(next.stations);
        self
    }

    /// All that stands along it, at chainages that are higher by so much. The alignment stays as it is.
    fn shifted(&self, by_m: f64) -> Self {
        let mut track = self.clone();
        let sections = track.sections.iter_mut();
        let places = sections.flat_map(|range| [&mut range.from_m, &mut range.to_m]);
        let places = places
            .chain(track.lamps.iter_mut().map(|lamp| &mut lamp.chainage_m))
            .chain(track.wayside.iter_mut().map(|site| &mut site.chainage_m))
            .chain(track.balises.iter_mut().map(|b| &mut b.chainage_m))
            .chain((track.base_stations.iter_mut()).map(|base| &mut base.chainage_m))
            .chain(track.stations.iter_mut().map(|stop| &mut stop.chainage_m));
        places.for_each(|s_m| *s_m += by_m);
        track
    }
}

fn kept<T>(mut list: Vec<T>, keep: impl Fn(&T) -> bool) -> Vec<T> {
    list.retain(keep);
    list
}
