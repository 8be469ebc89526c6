//! Daylight that comes into a tunnel through its portal.
//!
//! From inside, the portal is an even light of the outline's shape. The light that a polygon of luminance L
//! throws on a surface of normal n is Lambert's (Photometria, 1760): L / 2 times the sum over its sides of the
//! angle that a side subtends, times n on the normal of the plane through the side and the place. What of the
//! polygon is under the surface's horizon is cut off first. Walls do not pass the light on to each other.

use super::corridor::Corridor;
use crate::track::{Direction, SectionRange, Track};
use crate::twin::geometry::TunnelEnd;
use nalgebra::{Point3, Vector3};

/// Daylight is followed so far into the tunnel. With 20,000 lx outside the floor there would get about 1 lx, a
/// wall that faces the portal about 30 lx.
const REACH_M: f64 = 60.0;
/// Over the last of these metres it is taken away evenly, so that no edge shows.
const FADE_M: f64 = 20.0;
/// Surfaces of the tunnel lie within its outline but for rounding, and what its bed is cut down by.
const SLACK_M: f64 = 0.01;
const CUT_M: f64 = 0.5;

/// An end of a tunnel in the open.
#[derive(Clone, Debug)]
pub struct Portal {
    corners: Vec<Point3<f64>>,
    /// The tunnel behind it, on the track that it is of.
    inside: Corridor,
}

impl Portal {
    /// All portals of a track's own tunnels: where a closed cross-section meets an open one, of this track or of
    /// those beyond its ends.
    pub fn all_of(track: &Track, [begin, end]: [TunnelEnd; 2]) -> Vec<Self> {
        let sections = || track.sections.iter().map(|range| &range.section);
        let starts = std::iter::once(begin == TunnelEnd::Open)
            .chain(sections().map(|section| section.is_open()));
        let is_open_after = sections()
            .skip(1)
            .map(|section| section.is_open())
            .chain([end == TunnelEnd::Open]);
        let ranges = track.sections.iter().zip(starts).zip(is_open_after);
        let mouths = ranges.filter(|((range, _), _)| range.section.closed);
        mouths
            .flat_map(|((range, before), after)| {
                let at_begin = before.then(|| Self::of(track, range, Direction::Up));
                let at_end = after.then(|| Self::of(track, range, Direction::Down));
                at_begin.into_iter().chain(at_end)
            })
            .collect()
    }

    /// At the end of a section, into which one looks in a direction.
    fn of(track: &Track, range: &SectionRange, inwards: Direction) -> Self {
        let (at_m, far_m) = match inwards {
            Direction::Up => (range.from_m, range.from_m + REACH_M),
            Direction::Down => (range.to_m, range.to_m - REACH_M),
        };
        let far_m = far_m.clamp(0.0, track.alignment.length_m());
        let frame = track.alignment.at(at_m);
        let points = range.section.points.iter();
        let [right_m, left_m] = range.section.lateral_m();
        let heights = points.clone().map(|p| p.h_m);
        let (low_m, high_m) = heights.fold((f64::MAX, f64::MIN), |(low, high), h_m| {
            (h_m.min(low), h_m.max(high))
        });
        Self {
            corners: (points.map(|p| frame.world_from_section(p.l_m, p.h_m))).collect(),
            inside: Corridor::along(
                track,
                [at_m.min(far_m), at_m.max(far_m)],
                right_m - SLACK_M..=left_m + SLACK_M,
                low_m - CUT_M..=high_m + SLACK_M,
            ),
        }
    }

    /// Light on a surface inside, for a luminance of 1 cd/m^2 outside.
    pub fn lux_per_cd_m2(&self, p: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        let Some(first) = self.corners.first() else {
            return 0.0;
        };
        let away_m = (first - p).norm();
        if away_m > REACH_M || !self.inside.holds(p) {
            return 0.0;
        }
        let above = self.above_horizon(p, normal);
        let next = above.iter().cycle().skip(1);
        let sides = above.iter().zip(next).map(|(a, b)| {
            let across = a.cross(b);
            let angle = across.norm().atan2(a.dot(b));
            across
                .try_normalize(1e-12)
                .map_or(0.0, |n| angle * n.dot(normal))
        });
        let left = ((REACH_M - away_m) / FADE_M).min(1.0);
        // Whichever way round the corners run.
        left * 0.5 * sides.sum::<f64>().abs()
    }

    /// Its corners from a place, without what is under the horizon of a surface there.
    fn above_horizon(&self, p: &Point3<f64>, normal: &Vector3<f64>) -> Vec<Vector3<f64>> {
        let ways: Vec<_> = self.corners.iter().map(|corner| corner - p).collect();
        let next = ways.iter().cycle().skip(1);
        let cut = ways.iter().zip(next).flat_map(|(a, b)| {
            let (over_a, over_b) = (a.dot(normal), b.dot(normal));
            let kept = (over_a >= 0.0).then_some(*a);
            let crosses = (over_a >= 0.0) != (over_b >= 0.0);
            let horizon = crosses.then(|| a + (b - a) * (over_a / (over_a - over_b)));
            kept.into_iter().chain(horizon)
        });
        cut.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::{Alignment, CrossSection, PlanElement};

    fn portal() -> Portal {
        let plan = [PlanElement::straight(100.0)];
        let mut track = Track::bare("lead", Alignment::new(Point3::origin(), 0.4, &plan, &[]));
        let sections = [
            CrossSection::rectangular(2.9, 2.9, 4.6, None, None),
            CrossSection::trough(2.9, 2.9, 5.0),
        ];
        track.sections = (sections.into_iter().zip([0.0, 60.0]))
            .map(|(section, from_m)| SectionRange {
                from_m,
                to_m: from_m + 60.0,
                missing_rail: None,
                section,
            })
            .collect();
        let mut all = Portal::all_of(&track, [TunnelEnd::Nothing; 2]);
        assert_eq!(all.len(), 1);
        all.remove(0)
    }

    /// Against the integral over the mouth by small parts, for surfaces that see all of it, a part, or none.
    #[test]
    fn light_through_the_mouth_is_lamberts() {
        let portal = portal();
        let plan = [PlanElement::straight(100.0)];
        let line = Alignment::new(Point3::origin(), 0.4, &plan, &[]);
        let outwards = line.at(60.0).ahead();
        let (parts, mut compared) = (300, 0);
        for (s_m, l_m, h_m) in [
            (59.0, 2.9, 1.0),
            (55.0, -2.9, 3.0),
            (40.0, 0.5, -0.17),
            (21.0, 0.0, 4.6),
        ] {
            let p = line.at(s_m).world_from_section(l_m, h_m);
            for normal in [
                line.at(0.0).left(),
                -line.at(0.0).left(),
                Vector3::z(),
                -Vector3::z(),
                outwards,
                -outwards,
                (outwards + Vector3::z()).normalize(),
            ] {
                let mut sum = 0.0;
                for i in 0..parts * parts {
                    let share = |k: usize| (k as f64 + 0.5) / parts as f64;
                    let (l, h) = (
                        -2.9 + 5.8 * share(i % parts),
                        -0.17 + 4.77 * share(i / parts),
                    );
                    let d = line.at(60.0).world_from_section(l, h) - p;
                    let facing = d.dot(&normal).max(0.0) * d.dot(&outwards).max(0.0);
                    sum += facing / d.norm_squared().powi(2);
                }
                let expected = sum * 5.8 * 4.77 / (parts * parts) as f64;
                let lux = portal.lux_per_cd_m2(&p, &normal);
                assert!(
                    (lux - expected).abs() < 2e-3 * expected.max(0.05),
                    "{s_m} {l_m} {h_m} {normal:?}: {lux} {expected}"
                );
                compared += usize::from(expected > 0.01);
            }
        }
        assert!(compared > 10, "{compared}");
    }
}
