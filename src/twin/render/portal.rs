//! Daylight that comes into a tunnel through its portal.
//!
//! From inside, the portal is an even light of the outline's shape. The light that a polygon of luminance L
//! throws on a surface of normal n is Lambert's (Photometria, 1760): L / 2 times the sum over its sides of the
//! angle that a side subtends, times n on the normal of the plane through the side and the place. What of the
//! polygon is under the surface's horizon is cut off first. Walls do not pass the light on to each other.

use crate::track::{Direction, Track};
use nalgebra::{Point3, Vector3};

/// Daylight is cut off at this distance from the portal. With 20,000 lx outside the floor there would get about 1 lx, a
/// wall that faces the portal about 30 lx.
const REACH_M: f64 = 60.0;

/// An end of a tunnel in the open.
#[derive(Clone, Debug)]
pub struct Portal {
    corners: Vec<Point3<f64>>,
    /// Into the tunnel.
    inwards: Vector3<f64>,
}

impl Portal {
    /// All portals of a track's own tunnels: where a closed cross-section meets an open one.
    pub fn all_of(track: &Track) -> Vec<Self> {
        let mouth = |inside: usize, s_m: f64, way: Direction| {
            let frame = track.alignment.at(s_m);
            let points = track.sections[inside].section.points.iter();
            Self {
                corners: (points.map(|p| frame.world_from_section(p.l_m, p.h_m))).collect(),
                inwards: frame.ahead() * way.sign(),
            }
        };
        let borders = track.sections.windows(2).enumerate();
        let mouths = borders.filter_map(|(k, pair)| {
            let [before, after] = [&pair[0].section, &pair[1].section];
            let is_tunnel = [before.closed, after.closed];
            match (before.is_shared() || after.is_shared(), is_tunnel) {
                (false, [true, false]) => Some(mouth(k, pair[1].from_m, Direction::Down)),
                (false, [false, true]) => Some(mouth(k + 1, pair[1].from_m, Direction::Up)),
                _ => None,
            }
        });
        mouths.collect()
    }

    /// Light on a surface inside, for a luminance of 1 cd/m^2 outside.
    pub fn lux_per_cd_m2(&self, p: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        let Some(first) = self.corners.first() else {
            return 0.0;
        };
        let to_mouth = first - p;
        if to_mouth.norm() > REACH_M || self.inwards.dot(&to_mouth) > 0.0 {
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
        // Whichever way round the corners run.
        0.5 * sides.sum::<f64>().abs()
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
    use crate::track::{Alignment, CrossSection, PlanElement, SectionRange};

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
        let mut all = Portal::all_of(&track);
        assert_eq!(all.len(), 1);
        all.remove(0)
    }

    /// Against the integral over the mouth by small parts, for surfaces that see all of it, a part, or none.
    #[test]
    fn light_through_the_mouth_is_lamberts() {
        let portal = portal();
        let plan = [PlanElement::straight(100.0)];
        let line = Alignment::new(Point3::origin(), 0.4, &plan, &[]);
        let outwards = -portal.inwards;
        let (parts, mut compared) = (300, 0);
        for (s_m, l_m, h_m) in [
            (59.0, 2.9, 1.0),
            (55.0, -2.9, 3.0),
            (40.0, 0.5, -0.17),
            (20.0, 0.0, 4.6),
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
