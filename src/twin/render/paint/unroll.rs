//! A cross-section laid flat: where things of the (l, h) plane come to lie along its outline.

use super::brush::Anchor;
use crate::track::{CrossSection, Edge, Material, OutlinePoint, Side};
use nalgebra::{Matrix2, Vector2};

/// The edges of an outline with their place along it.
pub(super) struct Unrolled {
    edges: Vec<(f64, Edge)>,
    /// Length of the outline.
    pub length_m: f64,
    /// The circle that the lining follows, if it does: a shield-driven tunnel.
    pub circle: Option<Circle>,
}

/// Inner face of a ring of segments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Circle {
    pub centre: OutlinePoint,
    pub radius_m: f64,
}

/// A place on an outline.
#[derive(Clone, Copy, Debug)]
pub(super) struct OutlinePlace {
    pub at: OutlinePoint,
    pub material: Material,
    /// Steepness of the surface: 0 for floors and ceilings, 1 for upright walls.
    pub upright: f64,
}

/// Corners of a lining lie on a circle where none is off it by more.
const ROUND_M: f64 = 0.01;

impl Unrolled {
    pub fn of(section: &CrossSection) -> Self {
        let mut length_m = 0.0;
        let mut edges = Vec::new();
        for edge in section.edges() {
            edges.push((length_m, edge));
            length_m += edge.length_m();
        }
        let circle = circle_of(&edges);
        Self {
            edges,
            length_m,
            circle,
        }
    }

    /// What is `q_m` along the outline; its end beyond it.
    pub fn at(&self, q_m: f64) -> Option<OutlinePlace> {
        let k = self.edges.partition_point(|(begin, _)| *begin <= q_m);
        let (begin_m, edge) = self.edges.get(k.saturating_sub(1))?;
        let length_m = edge.length_m();
        let t = if length_m > 0.0 {
            ((q_m - begin_m) / length_m).clamp(0.0, 1.0)
        } else {
            0.0
        };
        Some(OutlinePlace {
            at: between(edge, t),
            material: edge.material,
            upright: edge.normal().0.abs(),
        })
    }

    /// Stretches of one material in a row, as ranges of q.
    pub fn stretches(&self, material: Material) -> Vec<[f64; 2]> {
        let mut all: Vec<[f64; 2]> = Vec::new();
        for (begin, edge) in self.edges.iter().filter(|(_, e)| e.material == material) {
            let end = begin + edge.length_m();
            match all.last_mut() {
                Some(last) if (last[1] - begin).abs() < 1e-9 => last[1] = end,
                _ => all.push([*begin, end]),
            }
        }
        all
    }

    /// Where the wall of one side is at a height, counted upwards.
    pub fn wall(&self, side: Side, height_m: f64) -> Option<Anchor> {
        let sign = match side {
            Side::Left => 1.0,
            Side::Right => -1.0,
        };
        self.crossing(
            Material::Lining,
            |p| p.h_m - height_m,
            |p| sign * p.l_m > 0.0,
        )
    }

    /// Where a floor of some material is at a distance left of the centreline.
    pub fn floor(&self, material: Material, l_m: f64) -> Option<f64> {
        self.crossing(material, |p| p.l_m - l_m, |_| true)
            .map(|at| at.q)
    }

    /// A place of a wall, counted upwards; nothing where it is level.
    pub fn up_at(&self, q_m: f64) -> Option<Anchor> {
        let [below, above] = [-0.05, 0.05].map(|d| self.at(q_m + d).map(|p| p.at.h_m));
        let rise = above? - below?;
        (rise.abs() > 1e-3).then(|| Anchor {
            q: q_m,
            sense: rise.signum(),
        })
    }

    /// The first place where `measure` passes through zero on a material, and its sense.
    fn crossing(
        &self,
        material: Material,
        measure: impl Fn(&OutlinePoint) -> f64,
        wanted: impl Fn(&OutlinePoint) -> bool,
    ) -> Option<Anchor> {
        let of_material = self.edges.iter().filter(|(_, e)| e.material == material);
        of_material.into_iter().find_map(|(begin_m, edge)| {
            let (from, to) = (measure(&edge.a), measure(&edge.b));
            if (from > 0.0) == (to > 0.0) {
                return None;
            }
            let t = from / (from - to);
            wanted(&between(edge, t)).then(|| Anchor {
                q: begin_m + t * edge.length_m(),
                sense: if to > from { 1.0 } else { -1.0 },
            })
        })
    }

    /// Where the lining is in a direction from the circle's centre, counted from the crown
    /// towards the left.
    pub fn at_angle(&self, circle: &Circle, angle_rad: f64) -> Option<f64> {
        let (sin, cos) = angle_rad.sin_cos();
        let across = |p: &OutlinePoint| {
            (p.l_m - circle.centre.l_m) * cos - (p.h_m - circle.centre.h_m) * sin
        };
        let ahead = |p: &OutlinePoint| {
            (p.l_m - circle.centre.l_m) * sin + (p.h_m - circle.centre.h_m) * cos > 0.0
        };
        self.crossing(Material::Lining, across, ahead)
            .map(|at| at.q)
    }

    /// Corners where two edges of a ledge's material meet, counted over its floor.
    pub fn ledges(&self, material: Material) -> Vec<Anchor> {
        let pairs = self.edges.windows(2);
        pairs
            .filter(|pair| pair.iter().all(|(_, e)| e.material == material))
            .filter_map(|pair| {
                let flat = |k: usize| pair[k].1.normal().1 > 0.9;
                let sense = match (flat(0), flat(1)) {
                    (true, false) => -1.0,
                    (false, true) => 1.0,
                    _ => return None,
                };
                let q = pair[1].0;
                Some(Anchor { q, sense })
            })
            .collect()
    }

    /// The side on which there is a material.
    pub fn side_of(&self, material: Material) -> Option<Side> {
        let (_, edge) = self.edges.iter().find(|(_, e)| e.material == material)?;
        Some(if edge.a.l_m + edge.b.l_m > 0.0 {
            Side::Left
        } else {
            Side::Right
        })
    }
}

fn between(edge: &Edge, t: f64) -> OutlinePoint {
    OutlinePoint::new(
        edge.a.l_m + t * (edge.b.l_m - edge.a.l_m),
        edge.a.h_m + t * (edge.b.h_m - edge.a.h_m),
    )
}

/// The circle through the first, middle and last corner of the lining, if all others are on it.
fn circle_of(edges: &[(f64, Edge)]) -> Option<Circle> {
    let lining = edges.iter().filter(|(_, e)| e.material == Material::Lining);
    let corners: Vec<OutlinePoint> = lining.map(|(_, e)| e.a).collect();
    // Fewer corners are a box.
    if corners.len() < 8 {
        return None;
    }
    let [a, b, c] = [0, corners.len() / 2, corners.len() - 1].map(|k| corners[k]);
    let [to_b, to_c] = [b, c].map(|p| Vector2::new(p.l_m - a.l_m, p.h_m - a.h_m));
    // The centre is as far from either as from a.
    let sides = Matrix2::new(to_b.x, to_b.y, to_c.x, to_c.y).try_inverse()?;
    let to_centre = sides * Vector2::new(to_b.norm_squared(), to_c.norm_squared()) * 0.5;
    let radius_m = to_centre.norm();
    let centre = OutlinePoint::new(a.l_m + to_centre.x, a.h_m + to_centre.y);
    let off = |p: &OutlinePoint| {
        ((p.l_m - centre.l_m).hypot(p.h_m - centre.h_m) - radius_m).abs() < ROUND_M
    };
    corners
        .iter()
        .all(off)
        .then_some(Circle { centre, radius_m })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    fn bored() -> Unrolled {
        Unrolled::of(&CrossSection::circular(3.0, 2.26, Some(Side::Left)))
    }

    /// Fails where q runs the other way, or a wall is looked for on the wrong side.
    #[test]
    fn places_lie_where_the_outline_has_them() {
        let u = bored();
        for (side, sign) in [(Side::Left, 1.0), (Side::Right, -1.0)] {
            let up = u.wall(side, 2.0).unwrap();
            let place = u.at(up.q).unwrap();
            assert!((place.at.h_m - 2.0).abs() < 1e-9 && sign * place.at.l_m > 2.9);
            assert!(place.upright > 0.95);
            assert!(u.at(up.at(0.1)).unwrap().at.h_m > 2.05);
        }
        let q = u.floor(Material::Bed, -0.75).unwrap();
        assert!((u.at(q).unwrap().at.l_m + 0.75).abs() < 1e-9);
        let ledges = u.ledges(Material::Walkway);
        assert_eq!(ledges.len(), 1);
        let top = u.at(ledges[0].at(0.1)).unwrap().at;
        assert!((top.h_m - 0.9).abs() < 1e-9 && (top.l_m - 1.7).abs() < 1e-9);
        assert_eq!(u.side_of(Material::Walkway), Some(Side::Left));
    }

    /// Fails where a box or a horseshoe is taken for a ring of segments, or a circle is not.
    #[test]
    fn circles_are_known() {
        let circle = bored().circle.unwrap();
        assert!((circle.radius_m - 3.0).abs() < 0.01 && (circle.centre.h_m - 2.26).abs() < 0.01);
        let crown = bored().at_angle(&circle, 0.0).unwrap();
        assert!((bored().at(crown).unwrap().at.h_m - 5.26).abs() < 0.01);
        let horseshoe = CrossSection::horseshoe(5.2, 2.4, 4.8, None);
        assert!(Unrolled::of(&horseshoe).circle.is_none());
        let cut = CrossSection::rectangular(2.9, 2.9, 4.6, None, None);
        assert!(Unrolled::of(&cut).circle.is_none());
    }
}
