//! The strips along the line that a cross-section is made of.

use super::detail::{CHUNK_M, Cutting, halve};
use crate::track::{
    CrossSection, Edge, Material, OutlinePoint, SectionRange, TrackPoint, rail_outline,
};
use crate::twin::geometry::surface_of;
use nalgebra::Vector2;

/// A strip along the line between two corners of an outline.
pub struct Facet {
    /// Where it begins and ends on the outline.
    pub ends: [OutlinePoint; 2],
    /// The same in metres along the painting's outline.
    pub q_m: [f64; 2],
    /// Of which it is.
    pub material: Material,
}

/// Where a facet is, seen from the middle of the cross-section: a camera beside a wall does not see the
/// other one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FacetSide {
    Left,
    Above,
    Right,
    Below,
}

impl FacetSide {
    /// All around.
    pub const ALL: [Self; 4] = [Self::Left, Self::Above, Self::Right, Self::Below];

    /// Of a facet.
    pub fn of(facet: &Facet, range: &SectionRange) -> Self {
        let points = &range.section.points;
        let heights = points.iter().map(|p| p.h_m);
        let middle_m = heights.sum::<f64>() / points.len().max(1) as f64;
        let [a, b] = facet.ends;
        let (l_m, h_m) = (0.5 * (a.l_m + b.l_m), 0.5 * (a.h_m + b.h_m) - middle_m);
        match (l_m.abs() > h_m.abs(), l_m > 0.0, h_m > 0.0) {
            (true, true, _) => Self::Left,
            (true, false, _) => Self::Right,
            (false, _, true) => Self::Above,
            (false, _, false) => Self::Below,
        }
    }
}

/// Of a cross-section and its rails, whose paint begins at `rail_q_m`, as fine as they must be near lamps.
pub fn facets_of(range: &SectionRange, rail_q_m: f64, cutting: Cutting<'_>) -> Vec<Facet> {
    let mut facets = Vec::new();
    let surface = surface_of(&range.section, cutting.key.track);
    add_outline(&mut facets, &surface, 0.0, cutting);
    for centre_m in range.rails_m() {
        add_outline(&mut facets, &rail_outline(centre_m), rail_q_m, cutting);
    }
    facets
}

fn add_outline(
    facets: &mut Vec<Facet>,
    section: &CrossSection,
    mut q_m: f64,
    cutting: Cutting<'_>,
) {
    for edge in section.edges() {
        if edge.length_m() > 0.0 {
            cut_edge(facets, &edge, q_m, cutting);
        }
        q_m += edge.length_m();
    }
}

/// Cuts an edge into facets where it passes lamps, or a camera with a lens that bends it.
fn cut_edge(facets: &mut Vec<Facet>, edge: &Edge, q_m: f64, cutting: Cutting<'_>) {
    let (Edge { a, b, material }, length_m) = (*edge, edge.length_m());
    let at = |t: f64| OutlinePoint {
        l_m: a.l_m + t * (b.l_m - a.l_m),
        h_m: a.h_m + t * (b.h_m - a.h_m),
    };
    let fits = |from: f64, to: f64| {
        let ends = [at(from), at(to)];
        let start_m = cutting.key.start_m();
        let stretch_m = [start_m, start_m + CHUNK_M];
        cutting.suffices((to - from) * length_m, stretch_m, |from| {
            across_m(ends, from)
        })
    };
    let mut cuts = vec![0.0];
    halve(0.0, 1.0, &fits, &mut cuts);
    for pair in cuts.windows(2) {
        facets.push(Facet {
            ends: [at(pair[0]), at(pair[1])],
            q_m: [q_m + pair[0] * length_m, q_m + pair[1] * length_m],
            material,
        });
    }
}

/// Distance of a place from the straight between two points of an outline.
fn across_m([a, b]: [OutlinePoint; 2], place: &TrackPoint) -> f64 {
    let edge = Vector2::new(b.l_m - a.l_m, b.h_m - a.h_m);
    let to_place = Vector2::new(place.l_m - a.l_m, place.h_m - a.h_m);
    let share = (edge.dot(&to_place) / edge.norm_squared().max(1e-12)).clamp(0.0, 1.0);
    (to_place - edge * share).norm()
}
