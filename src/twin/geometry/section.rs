//! A ray against the outline of a tunnel, in the plane across the line.
//!
//! Any polygon will do, open or closed, convex or not, with rails inside it. A grid over the
//! outline lists the edges of each cell; a ray visits the cells on its way (Amanatides and Woo,
//! "A fast voxel traversal algorithm for ray tracing", Eurographics 1987).

use crate::track::{BED_M, CrossSection, Material, OutlinePoint, SectionRange, rail_outline};
use nalgebra::Vector2;
use std::borrow::Cow;

/// A straight piece of outline, seen from its free side only.
#[derive(Clone, Debug)]
pub(super) struct OutlineEdge {
    /// First corner: left of the centreline, above top of rail.
    pub start: Vector2<f64>,
    /// Unit vector to the second.
    pub along: Vector2<f64>,
    /// Unit normal towards free space.
    pub normal: Vector2<f64>,
    length_m: f64,
    /// Metres along the outline from its first point to this edge.
    pub q_m: f64,
    /// What it is made of.
    pub material: Material,
}

/// A cross-section with the rails in it, ready for rays.
#[derive(Clone, Debug)]
pub(super) struct SectionCaster {
    pub edges: Vec<OutlineEdge>,
    /// Without the rails.
    pub section: CrossSection,
    low: Vector2<f64>,
    high: Vector2<f64>,
    columns: usize,
    rows: usize,
    /// Edges of cell k: `listed[begins[k]..begins[k + 1]]`.
    begins: Vec<u32>,
    listed: Vec<u16>,
}

const CELL_M: f64 = 0.4;
/// Edges reach this far over their ends, so that no ray slips through a corner.
const OVERHANG_M: f64 = 1e-9;

/// Half the width of the strip of bed that a track brings into the section of another one.
const STRIP_HALF_M: f64 = 1.35;
/// The lowest strip lies so far over the bed, each further one by [`STRIP_STEP_M`] more: where they cross, one
/// is seen.
const STRIP_M: f64 = 0.015;
const STRIP_STEP_M: f64 = 0.001;
const STRIPS: usize = 16;

/// What is seen of a cross-section, but for the rails: its outline. A track that lies in the section of another
/// one brings a strip of bed with its sleepers.
pub fn surface_of(section: &CrossSection, track: usize) -> Cow<'_, CrossSection> {
    if !section.is_shared() {
        return Cow::Borrowed(section);
    }
    let h_m = BED_M + STRIP_M + STRIP_STEP_M * (track % STRIPS) as f64;
    let ends = [STRIP_HALF_M, -STRIP_HALF_M].map(|l_m| OutlinePoint::new(l_m, h_m));
    Cow::Owned(CrossSection {
        points: ends.into(),
        materials: vec![Material::Bed; 2],
        closed: false,
    })
}

impl SectionCaster {
    /// Of a range of a track by number.
    pub fn new(range: &SectionRange, track: usize) -> Self {
        let section = &range.section;
        let mut edges = edges_of(&surface_of(section, track));
        for centre_m in range.rails_m() {
            edges.extend(edges_of(&rail_outline(centre_m)));
        }
        let corners = || {
            edges
                .iter()
                .flat_map(|e| [e.start, e.start + e.along * e.length_m])
        };
        let margin = Vector2::repeat(1e-3);
        let low = corners().fold(Vector2::repeat(f64::INFINITY), |a, b| a.inf(&b)) - margin;
        let high = corners().fold(Vector2::repeat(f64::NEG_INFINITY), |a, b| a.sup(&b)) + margin;
        let cells = (high - low) / CELL_M;
        let (columns, rows) = (cells.x.ceil() as usize, cells.y.ceil() as usize);
        let (mut begins, mut listed) = (vec![0], Vec::new());
        for cell in 0..columns * rows {
            let place = Vector2::new((cell % columns) as f64, (cell / columns) as f64);
            let centre = low + (place + Vector2::repeat(0.5)) * CELL_M;
            listed.extend(
                (0..edges.len())
                    .filter(|&k| edges[k].touches(&centre))
                    .map(|k| k as u16),
            );
            begins.push(listed.len() as u32);
        }
        Self {
            edges,
            section: section.clone(),
            low,
            high,
            columns,
            rows,
            begins,
            listed,
        }
    }

    /// The first edge that the ray o + t d meets from its free side for t in `from..=to`.
    pub fn first_hit(
        &self,
        o: &Vector2<f64>,
        d: &Vector2<f64>,
        from: f64,
        to: f64,
    ) -> Option<(f64, u16)> {
        // No division by nothing: a ray across an axis leaves its cells after 1e300.
        let slow = d.map(|x| 1.0 / x.abs().max(1e-300).copysign(x));
        let near = (self.low - o).component_mul(&slow);
        let far = (self.high - o).component_mul(&slow);
        let begin = from.max(near.inf(&far).max());
        let end = to.min(near.sup(&far).min());
        if begin > end {
            return None;
        }
        let cell = ((o + d * begin - self.low) / CELL_M).map(|x| x.max(0.0) as usize);
        let mut column = cell.x.min(self.columns - 1);
        let mut row = cell.y.min(self.rows - 1);
        // When the ray leaves the cell to the side and upwards (or downwards).
        let sides = Vector2::new(
            column + usize::from(d.x > 0.0),
            row + usize::from(d.y > 0.0),
        );
        let mut leaves = (self.low + sides.map(|n| n as f64) * CELL_M - o).component_mul(&slow);
        let across = slow.abs() * CELL_M;
        let mut best: Option<(f64, u16)> = None;
        loop {
            let cell = row * self.columns + column;
            for &k in &self.listed[self.begins[cell] as usize..self.begins[cell + 1] as usize] {
                if let Some(t) = self.edges[k as usize].hit(o, d)
                    && (from..=to).contains(&t)
                    && best.is_none_or(|(first, _)| t < first)
                {
                    best = Some((t, k));
                }
            }
            let leave = leaves.min();
            if best.is_some_and(|(t, _)| t <= leave) || leave >= end {
                return best;
            }
            // Off the grid, the index wraps below zero or runs over: no more edges.
            if leaves.x < leaves.y {
                column = neighbour(column, d.x);
                leaves.x += across.x;
            } else {
                row = neighbour(row, d.y);
                leaves.y += across.y;
            }
            if column >= self.columns || row >= self.rows {
                return best;
            }
        }
    }

    /// Whether it lies in the section of another track, with only rails and a strip of bed.
    pub fn is_shared(&self) -> bool {
        self.section.is_shared()
    }

    /// Whether a point is inside, or over an open section's bed.
    pub fn covers(&self, p: &Vector2<f64>) -> bool {
        !self.section.is_shared() && self.section.covers(p.x, p.y)
    }

    /// Whether a point is in free space, for closed outlines; open ones say yes.
    pub fn contains(&self, p: &Vector2<f64>) -> bool {
        !self.section.closed || self.section.contains(p.x, p.y)
    }
}

impl OutlineEdge {
    fn touches(&self, centre: &Vector2<f64>) -> bool {
        let half = Vector2::repeat(0.5 * CELL_M + 1e-6);
        let end = self.start + self.along * self.length_m;
        let away = self.normal.dot(&(centre - self.start)).abs();
        let beside =
            (self.start.inf(&end) - half) <= *centre && *centre <= (self.start.sup(&end) + half);
        beside && away <= half.x * (self.normal.x.abs() + self.normal.y.abs())
    }

    fn hit(&self, o: &Vector2<f64>, d: &Vector2<f64>) -> Option<f64> {
        let towards = self.normal.dot(d);
        if towards >= 0.0 {
            return None;
        }
        let t = self.normal.dot(&(self.start - o)) / towards;
        let along = self.along.dot(&(o + d * t - self.start));
        (along >= -OVERHANG_M && along <= self.length_m + OVERHANG_M).then_some(t)
    }
}

/// The edges of an outline; corners that coincide make none.
fn edges_of(section: &CrossSection) -> Vec<OutlineEdge> {
    let mut q_m = 0.0;
    let mut edges = Vec::new();
    for edge in section.edges() {
        let [start, end] = [edge.a, edge.b].map(|p| Vector2::new(p.l_m, p.h_m));
        let step = end - start;
        let length_m = step.norm();
        if length_m > 1e-9 {
            let along = step / length_m;
            edges.push(OutlineEdge {
                start,
                along,
                normal: Vector2::new(along.y, -along.x),
                length_m,
                q_m,
                material: edge.material,
            });
        }
        q_m += length_m;
    }
    edges
}

fn neighbour(index: usize, towards: f64) -> usize {
    if towards > 0.0 {
        index + 1
    } else {
        index.wrapping_sub(1)
    }
}
