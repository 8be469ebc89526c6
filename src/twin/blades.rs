//! The blades of switches: the two rails that move.
//!
//! From the toe on, the outer rails of both legs, the stock rails, lie fixed. Of the two others the blade of the
//! leg that is set lies close to its stock rail, and the other one 16 cm away from it at the tip; both turn
//! about their heels, where the rails are far enough apart to go on by themselves.

use crate::track::network::{Network, Switch, SwitchLeg, TrackEnd};
use crate::track::{BED_M, Direction, Material, RAIL_OFFSET_M, SectionRange, Side, Track};
use crate::twin::geometry::{Body, Shape};
use crate::twin::reflectance::mean_albedo;
use nalgebra::{Isometry3, Point3, Rotation3, UnitQuaternion, Vector3, center};
use std::sync::Arc;

/// Opening at the tip, as usual for point machines (their stroke is 140 to 220 mm).
const OPEN_M: f64 = 0.16;
/// A blade is planed to this width, and is lower than its stock rail.
const HALF_WIDTH_M: f64 = 0.02;
const LOWER_M: f64 = 0.004;
/// A curved blade is drawn in straight parts no longer than this.
const PART_M: f64 = 2.5;

/// One blade.
struct Blade {
    /// The end of the leg that it is a rail of.
    leg: TrackEnd,
    /// The rail that it is, on the leg's track.
    side: Side,
}

/// The blades of the through and of the diverging leg.
fn blades(network: &Network, switch: &Switch) -> [Blade; 2] {
    let hand = network.hand(switch);
    // The rail on the side of the other leg.
    let of = |leg: TrackEnd, from_toe: Side| Blade {
        leg,
        side: match leg.way {
            Direction::Down => from_toe,
            Direction::Up => from_toe.opposite(),
        },
    };
    [
        of(switch.through, hand),
        of(switch.diverging, hand.opposite()),
    ]
}

/// The tracks of a network with fixed rails only.
pub fn tracks_without_blades(network: &Network) -> Vec<Arc<Track>> {
    let mut tracks = network.tracks.clone();
    for switch in &network.switches {
        let Some(length_m) = network.heel_m(switch) else {
            continue;
        };
        for blade in blades(network, switch) {
            let track = &mut tracks[usize::from(blade.leg.track.0)];
            let end_m = track.alignment.length_m();
            let [from_m, to_m] = match blade.leg.way {
                Direction::Down => [0.0, length_m.min(end_m)],
                Direction::Up => [(end_m - length_m).max(0.0), end_m],
            };
            let track = Arc::make_mut(track);
            let ranges = std::mem::take(&mut track.sections).into_iter();
            let split = ranges.flat_map(|range| split(range, [from_m, to_m], blade.side));
            track.sections = split.collect();
        }
    }
    tracks
}

/// A range in up to three, of which what lies in a stretch lacks a rail.
fn split(range: SectionRange, [from_m, to_m]: [f64; 2], side: Side) -> Vec<SectionRange> {
    let cuts = [from_m, to_m].map(|m| m.clamp(range.from_m, range.to_m));
    let parts = [
        ([range.from_m, cuts[0]], range.missing_rail),
        (cuts, Some(side)),
        ([cuts[1], range.to_m], range.missing_rail),
    ];
    let parts = parts
        .into_iter()
        .filter(|([from_m, to_m], _)| from_m < to_m);
    let part = |([from_m, to_m], missing_rail): ([f64; 2], Option<Side>)| SectionRange {
        from_m,
        to_m,
        missing_rail,
        section: range.section.clone(),
    };
    parts.map(part).collect()
}

/// Both blades of a switch in straight parts.
#[derive(Clone, Debug)]
pub struct SwitchBlades {
    /// The tip of one of them.
    pub tip: Point3<f64>,
    parts: Vec<Part>,
}

/// A straight part of a blade.
#[derive(Clone, Copy, Debug)]
struct Part {
    leg: SwitchLeg,
    /// Its ends where it is closed, and where it is open.
    closed: [Point3<f64>; 2],
    open: [Point3<f64>; 2],
}

impl SwitchBlades {
    /// Of a switch; `None` where its legs part too late for blades.
    pub fn of(network: &Network, switch: &Switch) -> Option<Self> {
        let length_m = network.heel_m(switch)?;
        let legs = [SwitchLeg::Through, SwitchLeg::Diverging];
        let count = (length_m / PART_M).ceil().max(1.0);
        let of_blade = |(blade, leg): (Blade, SwitchLeg)| {
            (0..count as u32).filter_map(move |k| {
                let behind_m = [k, k + 1].map(|k| length_m * f64::from(k) / count);
                let place = |open_m: f64, behind_m: f64| {
                    blade.place(network, behind_m, open_m * (1.0 - behind_m / length_m))
                };
                let ends =
                    |open_m| Some([place(open_m, behind_m[0])?, place(open_m, behind_m[1])?]);
                Some(Part {
                    leg,
                    closed: ends(0.0)?,
                    open: ends(OPEN_M)?,
                })
            })
        };
        let blades = blades(network, switch).into_iter().zip(legs);
        let parts: Vec<Part> = blades.flat_map(of_blade).collect();
        let tip = parts.first()?.closed[0];
        Some(Self { tip, parts })
    }

    /// Both, where they are `share` (0 to 1) of the way from the through to the diverging leg.
    pub fn bodies(&self, share: f64) -> impl Iterator<Item = Body> + '_ {
        self.parts.iter().map(move |part| {
            let open = match part.leg {
                SwitchLeg::Through => share,
                SwitchLeg::Diverging => 1.0 - share,
            };
            part.body(open)
        })
    }
}

impl Part {
    /// A share of the way open.
    fn body(&self, open: f64) -> Body {
        let [a, b] = [0, 1].map(|k| self.closed[k] + (self.open[k] - self.closed[k]) * open);
        let along = b - a;
        let rise = along.z.atan2(along.xy().norm());
        let turn = Rotation3::from_euler_angles(0.0, -rise, along.y.atan2(along.x));
        let half = Vector3::new(0.5 * along.norm(), HALF_WIDTH_M, -0.5 * (BED_M + LOWER_M));
        Body {
            shape: Shape::Box(half),
            world_from_body: Isometry3::from_parts(
                center(&a, &b).into(),
                UnitQuaternion::from_rotation_matrix(&turn),
            ),
            velocity_mps: Vector3::zeros(),
            albedo: mean_albedo(Material::Rail),
            luminance_cd_m2: 0.0,
        }
    }
}

impl Blade {
    /// The middle of its web so far behind the toe and so far from where it is closed.
    fn place(&self, network: &Network, behind_m: f64, open_m: f64) -> Option<Point3<f64>> {
        let track = network.track(self.leg.track)?;
        let s_m = network.chainage_behind(self.leg, behind_m)?;
        let (l_m, h_m) = (RAIL_OFFSET_M - open_m, 0.5 * (BED_M - LOWER_M));
        Some((track.alignment.at(s_m)).world_from_section(self.side.sign() * l_m, h_m))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::track::{Alignment, CrossSection, PlanElement, TrackId};

    /// 100 m, then a switch to the left of a radius of 200 m.
    fn network() -> Network {
        let track = |name, x: f64, element: PlanElement| {
            let line = Alignment::new(Point3::new(x, 0.0, 0.0), 0.0, &[element], &[]);
            let to_m = line.length_m();
            let mut track = Track::bare(name, line);
            track.sections.push(SectionRange {
                from_m: 0.0,
                to_m,
                missing_rail: None,
                section: CrossSection::open(10.0),
            });
            Arc::new(track)
        };
        let tracks = vec![
            track("A", 0.0, PlanElement::straight(100.0)),
            track("B", 100.0, PlanElement::straight(80.0)),
            track("C", 100.0, PlanElement::arc(60.0, 1.0 / 200.0, 0.0)),
        ];
        let end = |k: u16, way| TrackEnd {
            track: TrackId(k),
            way,
        };
        let switch = Switch {
            name: "W1".into(),
            toe: end(0, Direction::Up),
            through: end(1, Direction::Down),
            diverging: end(2, Direction::Down),
            diverging_mps: 8.0,
            throw_s: 4.0,
        };
        let open = [
            end(0, Direction::Down),
            end(1, Direction::Up),
            end(2, Direction::Up),
        ];
        let open = open.map(crate::track::network::Ends::Open);
        Network::new(tracks, vec![switch], open.into()).unwrap()
    }

    /// Of a body: the end at its tip, on the rails' own axis.
    fn tip(body: &Body) -> Point3<f64> {
        let half = body.shape.half_extents_m();
        body.world_from_body * Point3::new(-half.x, 0.0, 0.0)
    }

    /// Fails where the wrong blade opens, or to the wrong side: a wheel needs the blade of its leg closed.
    #[test]
    fn the_blade_of_the_leg_that_is_set_is_closed() {
        let network = network();
        let switch = &network.switches[0];
        // By the circle: 130 mm aside of the straight at 7.2 m.
        assert!((network.heel_m(switch).unwrap() - (2.0 * 200.0 * 0.13_f64).sqrt()).abs() < 0.3);
        for (share, through_m, diverging_m) in [
            (0.0, RAIL_OFFSET_M, -RAIL_OFFSET_M + OPEN_M),
            (1.0, RAIL_OFFSET_M - OPEN_M, -RAIL_OFFSET_M),
            (
                0.5,
                RAIL_OFFSET_M - 0.5 * OPEN_M,
                -RAIL_OFFSET_M + 0.5 * OPEN_M,
            ),
        ] {
            let blades = SwitchBlades::of(&network, switch).unwrap();
            let bodies: Vec<Body> = blades.bodies(share).collect();
            let first = |k: usize| tip(&bodies[k * bodies.len() / 2]);
            for (tip, l_m) in [(first(0), through_m), (first(1), diverging_m)] {
                assert!(
                    (tip.x - 100.0).abs() < 0.01 && (tip.y - l_m).abs() < 1e-3,
                    "{share}: {tip}"
                );
            }
        }
    }

    /// Fails where a rail is missing that stands still, or is there twice.
    #[test]
    fn the_rails_of_blades_are_missing_along_them_only() {
        let network = network();
        let length_m = network.heel_m(&network.switches[0]).unwrap();
        let tracks = tracks_without_blades(&network);
        let missing = |track: usize| -> Vec<_> {
            let sections = tracks[track].sections.iter();
            sections
                .map(|r| ([r.from_m, r.to_m], r.missing_rail))
                .collect()
        };
        assert_eq!(missing(0), [([0.0, 100.0], None)]);
        assert_eq!(
            missing(1),
            [
                ([0.0, length_m], Some(Side::Left)),
                ([length_m, 80.0], None)
            ]
        );
        assert_eq!(
            missing(2),
            [
                ([0.0, length_m], Some(Side::Right)),
                ([length_m, 60.0], None)
            ]
        );
    }
}
