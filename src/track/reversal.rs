//! A track as met by who runs down the line: chainage counts from its end, its left is right. What
//! stands in it stays where it is in the world.

use super::{
    Balise, BaseStation, CrossSection, LampSite, OutlinePoint, SectionRange, Side, StoppingPlace,
    Track, WaysideSite,
};

impl Track {
    /// The track in the other direction.
    ///
    /// ```
    /// # use metrotwin::track::Tunnel;
    /// let tunnel = Tunnel::from_toml(include_str!("../../tunnels/test_bench.toml"))?;
    /// let track = tunnel.first_track();
    /// let reversed = track.reversed();
    /// let (lamp, same) = (&track.lamps[0], &reversed.lamps[track.lamps.len() - 1]);
    /// assert_eq!((lamp.uid, lamp.centre), (same.uid, same.centre));
    /// # Ok::<(), metrotwin::settings::FileError>(())
    /// ```
    #[must_use]
    pub fn reversed(&self) -> Self {
        let length_m = self.alignment.length_m();
        let from_end = |s_m: f64| length_m - s_m;
        let turned_site = |site: &WaysideSite| WaysideSite {
            chainage_m: from_end(site.chainage_m),
            lateral_m: -site.lateral_m,
            yaw_deg: site.yaw_deg - 180f64.copysign(site.yaw_deg),
            ..site.clone()
        };
        let turned_balise = |balise: &Balise| Balise {
            chainage_m: from_end(balise.chainage_m),
            ..balise.clone()
        };
        let turned_base = |base: &BaseStation| BaseStation {
            chainage_m: from_end(base.chainage_m),
            ..base.clone()
        };
        let turned_station = |stop: &StoppingPlace| StoppingPlace {
            chainage_m: from_end(stop.chainage_m),
            ..stop.clone()
        };
        Self {
            name: self.name.clone(),
            alignment: self.alignment.reversed(),
            stated_chainage: (self.stated_chainage.as_ref())
                .map(|stated| stated.reversed(length_m)),
            sections: backwards(&self.sections, |range| SectionRange {
                from_m: from_end(range.to_m),
                to_m: from_end(range.from_m),
                missing_rail: range.missing_rail.map(Side::opposite),
                section: range.section.mirrored(),
            }),
            lamps: backwards(&self.lamps, |lamp| LampSite {
                chainage_m: from_end(lamp.chainage_m),
                lateral_m: -lamp.lateral_m,
                ..lamp.clone()
            }),
            wayside: sorted(&self.wayside, turned_site, |site| site.chainage_m),
            balises: sorted(&self.balises, turned_balise, |balise| balise.chainage_m),
            base_stations: sorted(&self.base_stations, turned_base, |base| base.chainage_m),
            stations: sorted(&self.stations, turned_station, |stop| stop.chainage_m),
            ambient_lx: self.ambient_lx,
            daylight_lx: self.daylight_lx,
        }
    }
}

fn backwards<T>(list: &[T], turned: impl Fn(&T) -> T) -> Vec<T> {
    list.iter().rev().map(turned).collect()
}

/// The same, of what a file may name in any order.
fn sorted<T>(list: &[T], turned: impl Fn(&T) -> T, chainage_m: impl Fn(&T) -> f64) -> Vec<T> {
    let mut list = backwards(list, turned);
    list.sort_by(|a, b| chainage_m(a).total_cmp(&chainage_m(b)));
    list
}

impl CrossSection {
    /// As seen the other way along the line.
    fn mirrored(&self) -> Self {
        let points = backwards(&self.points, |p| OutlinePoint::new(-p.l_m, p.h_m));
        // Each edge starts where it ended: the one that closes the outline stays the last.
        let mut materials = self.materials.clone();
        if let Some((_, others)) = materials.split_last_mut() {
            others.reverse();
        }
        Self {
            points,
            materials,
            closed: self.closed,
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::track::{TrackPoint, Tunnel};
    use std::sync::Arc;

    fn track() -> Arc<Track> {
        let text = include_str!("../../tunnels/chengdu_line1.toml");
        Tunnel::from_toml(text).unwrap().first_track().clone()
    }

    /// Provokes: a lamp or device that is elsewhere, or looks elsewhere, in the reversed track, or a
    /// list that does not ascend.
    #[test]
    fn all_stays_where_it_is() {
        let (track, reversed) = (track(), track().reversed());
        let line = &reversed.alignment;
        let ascending = |list: Vec<f64>| list.windows(2).all(|pair| pair[0] <= pair[1]);
        for lamp in &reversed.lamps {
            let place = line.world_from_track(TrackPoint {
                s_m: lamp.chainage_m,
                l_m: lamp.lateral_m,
                h_m: lamp.height_m,
            });
            assert!((place - lamp.centre).norm() < 1e-9, "{}", lamp.uid);
            assert_eq!(track.lamp(lamp.uid).unwrap().facing, lamp.facing);
        }
        assert_eq!(track.lamps.len(), reversed.lamps.len());
        for site in &track.wayside {
            let same = reversed.wayside.iter().find(|s| s.name == site.name);
            let axis = |line: &crate::track::Alignment, site: &WaysideSite| {
                let heading = line.at(site.chainage_m).heading_rad + site.yaw_deg.to_radians();
                let place = TrackPoint {
                    s_m: site.chainage_m,
                    l_m: site.lateral_m,
                    h_m: site.height_m,
                };
                (line.world_from_track(place), heading.cos(), heading.sin())
            };
            let (a, b) = (axis(&track.alignment, site), axis(line, same.unwrap()));
            assert!((a.0 - b.0).norm() < 1e-9 && (a.1 - b.1).hypot(a.2 - b.2) < 1e-9);
        }
        assert!(ascending(
            reversed.lamps.iter().map(|l| l.chainage_m).collect()
        ));
        assert!(ascending(
            reversed.wayside.iter().map(|w| w.chainage_m).collect()
        ));
        assert!(ascending(
            reversed.stations.iter().map(|s| s.chainage_m).collect()
        ));
        let length_m = line.length_m();
        for balise in &track.balises {
            let same = reversed.balise(&balise.name).unwrap();
            assert!((same.chainage_m + balise.chainage_m - length_m).abs() < 1e-9);
        }
        assert!(!track.balises.is_empty() && !track.base_stations.is_empty());
    }

    /// Provokes: an outline that is not mirrored, runs the wrong way round, has the material of a
    /// neighbouring edge, or stands at another chainage.
    #[test]
    fn sections_are_mirrored() {
        let (track, reversed) = (track(), track().reversed());
        let length_m = track.alignment.length_m();
        for range in &track.sections {
            let middle_m = 0.5 * (range.from_m + range.to_m);
            let mirrored = reversed.section_at(length_m - middle_m).unwrap();
            assert_eq!(mirrored.mirrored(), range.section);
            assert_eq!(mirrored.edges().count(), range.section.edges().count());
            for edge in range.section.edges() {
                let [a, b] = [edge.b, edge.a].map(|p| OutlinePoint::new(-p.l_m, p.h_m));
                let same = mirrored.edges().find(|e| e.a == a && e.b == b);
                assert_eq!(same.unwrap().material, edge.material);
            }
        }
        for pair in reversed.sections.windows(2) {
            assert!((pair[0].to_m - pair[1].from_m).abs() < 1e-9);
        }
    }
}
