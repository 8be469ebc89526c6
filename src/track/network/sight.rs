//! What is seen from a track: a sight line is free where all of it lies inside of cross-sections.

use super::{Network, WIDEST_M};
use crate::track::{Alignment, Track, TrackPoint};
use nalgebra::Point3;

/// Sight lines are looked at in points this far apart: half of the thinnest wall.
const STEP_M: f64 = 0.1;
/// Height of an eye over top of rail: above platforms.
const EYE_M: f64 = 2.0;
/// From how far before a place it is looked at.
const BEFORE_M: [f64; 6] = [2.0, 4.0, 6.0, 8.0, 10.0, 12.0];
/// The section of a track that is farther off than this is none of a sight line's.
const NEAR_M: f64 = 2.0 * WIDEST_M;

/// A track whose section may hold a sight line, and its chainage there.
struct Near<'a> {
    track: &'a Track,
    s_m: f64,
}

impl Near<'_> {
    /// Whether a place is in its section. A track without sections has nothing around it.
    fn holds(&self, place: &Point3<f64>) -> bool {
        let point = self.track.alignment.point_near(place, self.s_m);
        point.is_some_and(|TrackPoint { s_m, l_m, h_m }| {
            (self.track.section_at(s_m)).is_none_or(|section| section.covers(l_m, h_m))
        })
    }
}

impl Network {
    /// Whether a place is seen by who runs along a line towards its chainage there.
    pub(super) fn is_seen_from(&self, line: &Alignment, s_m: f64, place: &Point3<f64>) -> bool {
        let near = self.tracks_near(place);
        BEFORE_M.iter().any(|before_m| {
            let eye = TrackPoint {
                s_m: s_m - before_m,
                l_m: 0.0,
                h_m: EYE_M,
            };
            is_open(&near, &line.world_from_track(eye), place)
        })
    }

    /// The tracks whose sections may be around a place, nearest first.
    fn tracks_near(&self, place: &Point3<f64>) -> Vec<Near<'_>> {
        let near = self.tracks.iter().map(|track| {
            let s_m = track.alignment.near_m(place);
            let away_m = (track.alignment.at(s_m).origin - place).xy().norm();
            (away_m, Near { track, s_m })
        });
        let mut near: Vec<_> = near.filter(|(away_m, _)| *away_m < NEAR_M).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.into_iter().map(|(_, near)| near).collect()
    }
}

/// Whether no wall stands between two places.
fn is_open(near: &[Near<'_>], from: &Point3<f64>, to: &Point3<f64>) -> bool {
    let steps = ((to - from).norm() / STEP_M).ceil().max(1.0);
    (0..=steps as u32).all(|k| {
        let place = from + (to - from) * (f64::from(k) / steps);
        near.iter().any(|track| track.holds(&place))
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::track::network::{Itinerary, Waypoint};
    use crate::track::{Direction, Place, Tunnel};

    fn way(network: &Network, from: (&str, f64), over: &str, to: (&str, f64)) -> Itinerary {
        let track = |name| network.named(name).unwrap();
        let place = |(name, s_m)| Place {
            track: track(name),
            s_m,
        };
        let via = [Waypoint::Track(track(over))];
        let (from, to) = ((place(from), Direction::Up), Some(place(to)));
        network.itinerary(from, &via, to, 0.0).unwrap()
    }

    /// Two tracks 5 m apart in a hall that a wall divides from 50 m on. The wall's faces are 2.4 and 2.6 m left of
    /// the first track, the other one's lamps 7.2 m: from 12 m before a lamp, the sight line is 2.6 m aside after
    /// 12 * 2.6 / 7.2 = 4.33 m. So the lamps up to 57.67 m are seen past the end of the wall, and those beyond are not.
    #[test]
    fn a_wall_hides_the_lamps_behind_it() {
        let tunnel = Tunnel::from_toml(
            r#"
            name = "divided"
            [[track]]
            name = "near"
            start = {}
            to = "buffer"
            plan = [{ kind = "straight", length_m = 100.0 }]
            sections = [
                { kind = "rectangular", from_m = 0.0, left_m = 7.9 },
                { kind = "rectangular", from_m = 50.0, left_m = 2.4 },
            ]
            [[track]]
            name = "far"
            start = { north_m = 5.0 }
            to = "buffer"
            plan = [{ kind = "straight", length_m = 100.0 }]
            sections = [
                { kind = "shared", from_m = 0.0 },
                { kind = "rectangular", from_m = 50.0, right_m = 2.4 },
            ]
            lamps = { from_m = 12.0, spacing_m = 1.0, lateral_m = 2.2 }
            "#,
        );
        let network = tunnel.unwrap().network;
        let route = way(&network, ("near", 0.0), "near", ("near", 100.0)).route;
        let lamps = &network.along(&route).lamps;
        let seen_m: Vec<f64> = lamps.iter().map(|lamp| lamp.chainage_m.round()).collect();
        let open_m: Vec<f64> = (12..=57).map(f64::from).collect();
        assert_eq!(seen_m, open_m);
    }

    /// The terminus: on the way through the station the lamps of the other platform's track are behind the wall; those
    /// of the down track stand in the same hall 10 m aside.
    #[test]
    fn a_route_has_the_lamps_of_its_hall() {
        let text = include_str!("../../../tunnels/terminus.toml");
        let network = Tunnel::from_toml(text).unwrap().network;
        let route = way(&network, ("u1", 300.0), "u3", ("siding", 100.0)).route;
        let lamps = &network.along(&route).lamps;
        let has = |numbers: std::ops::RangeInclusive<u16>| {
            lamps
                .iter()
                .filter(|lamp| numbers.contains(&lamp.uid.lamp))
                .count()
        };
        // Those of d3, and those of d1 in the hall.
        assert_eq!((has(690..=713), has(740..=765)), (0, 26));
    }
}
