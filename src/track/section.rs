//! Cross-sections: the outline of a tunnel as seen along the line.

use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// What a stretch of the outline is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Material {
    /// Tunnel lining (concrete rings).
    Lining,
    /// Track bed.
    Bed,
    /// Walkway along the wall.
    Walkway,
    /// Rail.
    Rail,
    /// Station platform.
    Platform,
}

/// A side of the track, looking up the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// l > 0.
    Left,
    /// l < 0.
    Right,
}

impl Side {
    /// The other one.
    #[must_use]
    pub fn opposite(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }

    /// Of l: 1 on the left, -1 on the right.
    pub fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }
}

/// One corner of the outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutlinePoint {
    /// Left of the centreline.
    pub l_m: f64,
    /// Above top of rail.
    pub h_m: f64,
}

impl OutlinePoint {
    /// A corner at (l, h).
    pub const fn new(l_m: f64, h_m: f64) -> Self {
        Self { l_m, h_m }
    }
}

/// A polygonal outline. Points run so that the inside of the tunnel is on the left of each edge
/// when looked at up the line (s away from the viewer, l to the left, h up).
#[derive(Clone, Debug, PartialEq)]
pub struct CrossSection {
    /// Corners in order; an edge joins each to the next, and the last to the first when `closed`.
    pub points: Vec<OutlinePoint>,
    /// Material of the edge that starts at each point.
    pub materials: Vec<Material>,
    /// Closed all around (an open cutting is not).
    pub closed: bool,
}

/// A cross-section over a range of chainage.
#[derive(Clone, Debug, PartialEq)]
pub struct SectionRange {
    /// From this chainage.
    pub from_m: f64,
    /// To this chainage.
    pub to_m: f64,
    /// On this side there is no fixed rail, but a switch's blade.
    pub missing_rail: Option<Side>,
    /// The outline.
    pub section: CrossSection,
}

/// One straight piece of an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Where it starts.
    pub a: OutlinePoint,
    /// Where it ends.
    pub b: OutlinePoint,
    /// What it is made of.
    pub material: Material,
}

impl Edge {
    /// From its start to its end (l, h).
    fn along(&self) -> (f64, f64) {
        (self.b.l_m - self.a.l_m, self.b.h_m - self.a.h_m)
    }

    /// Its length.
    pub fn length_m(&self) -> f64 {
        let (l, h) = self.along();
        l.hypot(h)
    }

    /// Unit normal (l, h) into the tunnel; zero for an edge without length.
    pub fn normal(&self) -> (f64, f64) {
        let length = self.length_m();
        if length > 0.0 {
            (
                (self.b.h_m - self.a.h_m) / length,
                (self.a.l_m - self.b.l_m) / length,
            )
        } else {
            (0.0, 0.0)
        }
    }
}

/// Height of the track bed's surface, over top of rail: rails of 60 kg/m, 176 mm high, stand on it
/// (rounded; fastenings are not modelled).
pub const BED_M: f64 = -0.17;
/// What is no lower than this under the bed of an open section is on a level with it.
const LEVEL_M: f64 = 0.5;
/// Largest distance between an arc of the outline and its chords.
pub const CHORD_ERROR_M: f64 = 0.005;

/// Height of an evacuation walkway over top of rail, as built in Chinese metros (0.85 to 0.95 m).
pub const WALKWAY_HEIGHT_M: f64 = 0.90;
/// Distance of its edge from the centreline: outside the structure gauge, see [`Gauge`](super::Gauge).
pub const WALKWAY_EDGE_M: f64 = 1.60;

/// A platform beside the track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlatformShape {
    /// On which side.
    pub side: Side,
    /// Distance of its edge from the centreline.
    pub edge_m: f64,
    /// Height of its surface over top of rail.
    pub height_m: f64,
}

impl CrossSection {
    /// Shield-driven tunnel: a circle of `radius_m` around (0, `centre_m`), cut off by the bed,
    /// with a walkway along one wall where one is wanted.
    pub fn circular(radius_m: f64, centre_m: f64, walkway: Option<Side>) -> Self {
        // Angles from the downward vertical, counted towards the right (l < 0).
        let bed = ((centre_m - BED_M) / radius_m).clamp(-1.0, 1.0).acos();
        let outline = arc(OutlinePoint::new(0.0, centre_m), radius_m, bed, TAU - bed);
        Self::on_bed(outline, walkway)
    }

    /// Mined tunnel: upright walls `width_m` apart up to `springing_m`, then an arc through
    /// `crown_m`.
    pub fn horseshoe(width_m: f64, springing_m: f64, crown_m: f64, walkway: Option<Side>) -> Self {
        let half = 0.5 * width_m;
        let rise = (crown_m - springing_m).clamp(1e-3, half);
        let radius = (half * half + rise * rise) / (2.0 * rise);
        let spring = (half / radius).clamp(-1.0, 1.0).asin();
        let mut outline = vec![OutlinePoint::new(-half, BED_M)];
        outline.extend(arc(
            OutlinePoint::new(0.0, springing_m + rise - radius),
            radius,
            PI - spring,
            PI + spring,
        ));
        outline.push(OutlinePoint::new(half, BED_M));
        Self::on_bed(outline, walkway)
    }

    /// Cut-and-cover tunnel or station: walls at `left_m` and `right_m` from the centreline, a
    /// ceiling at `ceiling_m`, and a platform or a walkway where one is wanted.
    pub fn rectangular(
        left_m: f64,
        right_m: f64,
        ceiling_m: f64,
        platform: Option<PlatformShape>,
        walkway: Option<Side>,
    ) -> Self {
        let outline = vec![
            OutlinePoint::new(-right_m, BED_M),
            OutlinePoint::new(-right_m, ceiling_m),
            OutlinePoint::new(left_m, ceiling_m),
            OutlinePoint::new(left_m, BED_M),
        ];
        match platform {
            Some(p) => Self::on_bed(outline, walkway).with_ledge(
                p.side,
                p.edge_m,
                p.height_m,
                Material::Platform,
            ),
            None => Self::on_bed(outline, walkway),
        }
    }

    /// Track in the open: the bed alone, to `half_width_m` on both sides.
    pub fn open(half_width_m: f64) -> Self {
        Self {
            points: vec![
                OutlinePoint::new(half_width_m, BED_M),
                OutlinePoint::new(-half_width_m, BED_M),
            ],
            materials: vec![Material::Bed; 2],
            closed: false,
        }
    }

    /// A trough without a roof: walls of a height at `left_m` and `right_m` from the centreline.
    pub fn trough(left_m: f64, right_m: f64, wall_m: f64) -> Self {
        Self {
            points: vec![
                OutlinePoint::new(left_m, wall_m),
                OutlinePoint::new(left_m, BED_M),
                OutlinePoint::new(-right_m, BED_M),
                OutlinePoint::new(-right_m, wall_m),
            ],
            materials: vec![
                Material::Lining,
                Material::Bed,
                Material::Lining,
                Material::Lining,
            ],
            closed: false,
        }
    }

    /// Of a track that lies in the section of another one.
    pub fn shared() -> Self {
        Self {
            points: Vec::new(),
            materials: Vec::new(),
            closed: false,
        }
    }

    /// Whether it is that of another track.
    pub fn is_shared(&self) -> bool {
        self.points.is_empty()
    }

    /// Whether it is open to the sky.
    pub fn is_open(&self) -> bool {
        !self.closed && !self.is_shared()
    }

    /// How far it reaches to the right, below zero, and to the left; of a shared one nowhere.
    pub fn lateral_m(&self) -> [f64; 2] {
        let sides = self.points.iter().map(|p| p.l_m);
        sides
            .fold(None, |reach, l_m| {
                let [right_m, left_m] = reach.unwrap_or([l_m; 2]);
                Some([l_m.min(right_m), l_m.max(left_m)])
            })
            .unwrap_or_default()
    }

    /// Whether (l, h) is inside the tunnel or, for an open section, over its bed or on a level with it.
    pub fn covers(&self, l_m: f64, h_m: f64) -> bool {
        match self.closed {
            true => self.contains(l_m, h_m),
            false => {
                let [right_m, left_m] = self.lateral_m();
                (right_m..=left_m).contains(&l_m) && h_m >= BED_M - LEVEL_M
            }
        }
    }

    /// Closes walls that run from the right foot over the crown to the left foot by the bed.
    fn on_bed(walls: Vec<OutlinePoint>, walkway: Option<Side>) -> Self {
        let mut materials = vec![Material::Lining; walls.len()];
        if let Some(last) = materials.last_mut() {
            *last = Material::Bed;
        }
        let section = Self {
            points: walls,
            materials,
            closed: true,
        };
        match walkway {
            Some(side) => {
                section.with_ledge(side, WALKWAY_EDGE_M, WALKWAY_HEIGHT_M, Material::Walkway)
            }
            None => section,
        }
    }

    /// Builds a ledge of `material` against the wall of one side: everything under `height_m`
    /// and beyond `edge_m` is filled. Leaves the outline as it is where there is no room.
    fn with_ledge(self, side: Side, edge_m: f64, height_m: f64, material: Material) -> Self {
        let sign = side.sign();
        let (Some(to_wall), Some(to_bed)) = (
            self.ray((0.0, height_m), (sign, 0.0)),
            self.ray((sign * edge_m, height_m), (0.0, -1.0)),
        ) else {
            return self;
        };
        if to_wall <= edge_m {
            return self;
        }
        let filled = |p: &OutlinePoint| sign * p.l_m >= edge_m - 1e-9 && p.h_m <= height_m + 1e-9;
        // From the right foot over the crown to the left foot: the corners that a ledge replaces
        // stand at the beginning for the right side and at the end for the left one.
        let kept = self.edges().filter(|e| !filled(&e.a));
        let kept: Vec<(OutlinePoint, Material)> = kept.map(|e| (e.a, e.material)).collect();
        let wall = OutlinePoint::new(sign * to_wall, height_m);
        let edge = OutlinePoint::new(sign * edge_m, height_m);
        let foot = OutlinePoint::new(sign * edge_m, height_m - to_bed);
        let right = [(foot, material), (edge, material), (wall, Material::Lining)];
        let left = [(wall, material), (edge, material), (foot, Material::Bed)];
        let outline = match side {
            Side::Right => [&right, kept.as_slice()].concat(),
            Side::Left => [kept.as_slice(), &left].concat(),
        };
        let (points, materials) = outline.into_iter().unzip();
        Self {
            points,
            materials,
            closed: true,
        }
    }

    /// Its edges in order.
    pub fn edges(&self) -> impl Iterator<Item = Edge> + '_ {
        let n = self.points.len();
        let count = if self.closed { n } else { n.saturating_sub(1) };
        (0..count).map(move |k| Edge {
            a: self.points[k],
            b: self.points[(k + 1) % n],
            material: self.materials.get(k).copied().unwrap_or(Material::Lining),
        })
    }

    /// Whether (l, h) is inside the tunnel; over the bed, for an open section.
    pub fn contains(&self, l_m: f64, h_m: f64) -> bool {
        if self.closed {
            self.edges().fold(false, |inside, e| {
                let straddles = (e.a.h_m > h_m) != (e.b.h_m > h_m);
                let crosses = straddles
                    && l_m < e.a.l_m + (e.b.l_m - e.a.l_m) * (h_m - e.a.h_m) / (e.b.h_m - e.a.h_m);
                inside != crosses
            })
        } else {
            self.ray((l_m, h_m), (0.0, 1.0)).is_none()
        }
    }

    /// Distance from (l, h) to the outline along a direction, in units of its length; `None`
    /// where it meets nothing.
    pub fn ray(&self, from: (f64, f64), direction: (f64, f64)) -> Option<f64> {
        self.edges()
            .filter_map(|e| {
                let along = e.along();
                let to_a = (e.a.l_m - from.0, e.a.h_m - from.1);
                let det = cross(direction, along);
                if det.abs() < 1e-12 {
                    return None;
                }
                let t = cross(to_a, along) / det;
                let on_edge = cross(to_a, direction) / det;
                (t >= 0.0 && (-1e-12..=1.0 + 1e-12).contains(&on_edge)).then_some(t)
            })
            .min_by(f64::total_cmp)
    }

    /// Distance from (l, h) to the nearest point of the outline, whichever side it is on.
    pub fn distance_m(&self, l_m: f64, h_m: f64) -> f64 {
        self.edges()
            .map(|e| {
                let along = e.along();
                let to = (l_m - e.a.l_m, h_m - e.a.h_m);
                let square = along.0 * along.0 + along.1 * along.1;
                let t = if square > 0.0 {
                    ((to.0 * along.0 + to.1 * along.1) / square).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                (to.0 - t * along.0).hypot(to.1 - t * along.1)
            })
            .fold(f64::INFINITY, f64::min)
    }
}

fn cross(a: (f64, f64), b: (f64, f64)) -> f64 {
    a.0 * b.1 - a.1 * b.0
}

/// Corners on an arc, both ends included. Angles count from the downward vertical through the
/// right (l < 0).
fn arc(centre: OutlinePoint, radius_m: f64, from: f64, to: f64) -> Vec<OutlinePoint> {
    let largest_step = 2.0 * (1.0 - CHORD_ERROR_M / radius_m).clamp(0.0, 1.0).acos();
    let steps = ((to - from) / largest_step).ceil().clamp(1.0, 1000.0);
    (0..=steps as usize)
        .map(|k| {
            let a = from + (to - from) * k as f64 / steps;
            OutlinePoint::new(
                centre.l_m - radius_m * a.sin(),
                centre.h_m - radius_m * a.cos(),
            )
        })
        .collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    fn all() -> Vec<CrossSection> {
        let platform = PlatformShape {
            side: Side::Right,
            edge_m: 1.5,
            height_m: 1.05,
        };
        vec![
            CrossSection::circular(3.0, 2.26, None),
            CrossSection::circular(3.0, 2.26, Some(Side::Left)),
            CrossSection::circular(3.0, 2.26, Some(Side::Right)),
            CrossSection::horseshoe(5.2, 2.4, 4.8, Some(Side::Left)),
            CrossSection::rectangular(2.9, 6.0, 4.6, Some(platform), None),
            CrossSection::rectangular(2.9, 2.9, 4.6, None, Some(Side::Right)),
        ]
    }

    /// Shoelace in the viewer's axes (right = -l, up = h); positive when the inside is left.
    fn area(section: &CrossSection) -> f64 {
        section
            .edges()
            .map(|e| 0.5 * (e.b.l_m * e.a.h_m - e.a.l_m * e.b.h_m))
            .sum()
    }

    /// Provokes: a builder that runs the wrong way round, or a ledge spliced in at the wrong end.
    #[test]
    fn the_inside_is_on_the_left_of_every_edge() {
        for section in all() {
            assert!(area(&section) > 10.0);
            assert_eq!(section.points.len(), section.materials.len());
            for e in section.edges() {
                assert!(e.length_m() > 1e-6, "{e:?}");
                let (nl, nh) = e.normal();
                let (l, h) = (0.5 * (e.a.l_m + e.b.l_m), 0.5 * (e.a.h_m + e.b.h_m));
                assert!(section.contains(l + 1e-3 * nl, h + 1e-3 * nh), "{e:?}");
                assert!(!section.contains(l - 1e-3 * nl, h - 1e-3 * nh), "{e:?}");
            }
        }
    }

    /// Provokes: too few facets, or facets outside of the circle.
    #[test]
    fn val_circle_keeps_its_radius_and_area() {
        let section = CrossSection::circular(3.0, 2.26, None);
        for e in section.edges().filter(|e| e.material == Material::Lining) {
            let middle = (0.5 * (e.a.l_m + e.b.l_m)).hypot(0.5 * (e.a.h_m + e.b.h_m) - 2.26);
            assert!((e.a.l_m.hypot(e.a.h_m - 2.26) - 3.0).abs() < 1e-12);
            assert!(middle > 3.0 - CHORD_ERROR_M);
        }
        // Circle less the segment under the bed.
        let d: f64 = 2.26 - BED_M;
        let segment = 9.0 * (d / 3.0).acos() - d * (9.0 - d * d).sqrt();
        assert!((area(&section) - (PI * 9.0 - segment)).abs() < 0.1);
        assert!(area(&section) < PI * 9.0 - segment);
    }

    /// Provokes: a wall that moved, a ledge on the wrong side or at the wrong height.
    #[test]
    fn rays_and_distances_have_closed_forms() {
        let s = CrossSection::circular(3.0, 2.26, Some(Side::Left));
        assert!((s.ray((0.0, 2.26), (-1.0, 0.0)).unwrap() - 3.0).abs() < CHORD_ERROR_M);
        assert!((s.ray((0.0, 0.0), (1.0, 0.0)).unwrap() - WALKWAY_EDGE_M).abs() < 1e-12);
        assert!((s.ray((2.0, 2.0), (0.0, -1.0)).unwrap() - 1.1).abs() < 1e-12);
        assert!((s.distance_m(0.0, BED_M + 0.4) - 0.4).abs() < 1e-12);
        assert!(s.contains(1.5, 0.5) && !s.contains(1.7, 0.5) && s.contains(1.7, 1.0));
        let open = CrossSection::open(3.0);
        assert!(open.contains(2.9, 5.0) && !open.contains(0.0, -1.0));
        assert!(open.ray((0.0, 1.0), (1.0, 0.0)).is_none());
    }

    /// Provokes: a mined section that does not reach its crown or its width.
    #[test]
    fn horseshoe_has_its_width_and_crown() {
        let s = CrossSection::horseshoe(5.2, 2.4, 4.8, None);
        assert!((s.ray((0.0, 1.0), (-1.0, 0.0)).unwrap() - 2.6).abs() < 1e-12);
        assert!((s.ray((0.0, 1.0), (0.0, 1.0)).unwrap() - 3.8).abs() < CHORD_ERROR_M);
    }
}
