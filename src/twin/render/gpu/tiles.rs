//! Pieces of surfaces, and tiles of a picture with what may matter in each: light, lights, shadows.

use super::rectangle::Rectangle;
use super::region::Region;
use crate::track::{CrossSection, RAIL_OFFSET_M, TrackFrame, Tunnel};
use crate::twin::geometry::{Body, Solid};
use crate::twin::render::gpu::layout::NEAR_M;
use crate::twin::render::gpu::view::Framed;
use nalgebra::{Isometry3, Point2, Point3, Vector2, Vector3};
use std::ops::Range;

/// Side of a tile: over so few pixels a lens's distortion is even.
pub const TILE_PX: u32 = 32;
/// Cells of a tunnel's surface are no longer and wider than this.
const CELL_M: f64 = 1.0;
/// A border for what bends between the corners of a cell.
const BORDER_PX: f64 = 2.0;
/// A lens bends the edges of a body out of the rectangle around its corners by less than this share of the
/// rectangle's longer side.
const BULGE: f64 = 0.1;
/// Cells that reach behind the camera are looked at in so many points each way.
const POINTS: i32 = 8;

/// A parallelogram of a surface.
#[derive(Clone, Debug)]
pub struct SurfaceCell {
    pub centre: Point3<f64>,
    /// Half of its sides.
    half: [Vector3<f64>; 2],
    /// None where it stands for something that faces several ways.
    pub normal: Option<Vector3<f64>>,
    /// It is there in the middle of the exposure, and goes this way.
    velocity_mps: Vector3<f64>,
    travel_m: f64,
}

/// A rectangle of the picture.
#[derive(Clone, Copy)]
pub struct TileBounds {
    low_px: Point2<f64>,
    high_px: Point2<f64>,
}

/// Where the camera is while a view is exposed: `camera_from_world`, and when after the job's time.
pub struct Eyes([(Isometry3<f64>, f64); 3]);

/// Sets of numbers, one a tile.
pub struct Marks {
    columns: u32,
    rows: u32,
    words: usize,
    sets: Vec<u64>,
}

impl SurfaceCell {
    /// That does not move.
    pub fn still(
        centre: Point3<f64>,
        half: [Vector3<f64>; 2],
        normal: Option<Vector3<f64>>,
    ) -> Self {
        Self {
            centre,
            half,
            normal,
            velocity_mps: Vector3::zeros(),
            travel_m: 0.0,
        }
    }

    /// What it is in, wherever it goes in the exposure.
    pub fn region(&self) -> Region {
        Region {
            centre: self.centre,
            radius_m: self.half_diagonal_m() + self.travel_m,
            normal: self.normal,
        }
    }

    /// Half of its longer diagonal.
    pub fn half_diagonal_m(&self) -> f64 {
        let [a, b] = self.half;
        (a + b).norm().max((a - b).norm())
    }

    /// Whether it is seen from its back, from wherever the camera is about a place.
    pub fn turns_away(&self, (eye, travel_m): (Point3<f64>, f64)) -> bool {
        let to = eye - self.centre;
        self.normal
            .is_some_and(|n| n.dot(&to) < -self.travel_m - travel_m)
    }

    /// The same surface in four parts.
    pub fn quarters(&self) -> [Self; 4] {
        [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)].map(|(x, y)| Self {
            centre: self.point(x, y),
            half: self.half.map(|side| 0.5 * side),
            ..*self
        })
    }

    /// All of a stretch of the tunnel, rails too.
    pub fn of(tunnel: &Tunnel, from_m: f64, length_m: f64) -> Vec<Self> {
        let mut cells = Vec::new();
        let steps = (length_m / CELL_M).ceil().max(1.0);
        let half_m = 0.5 * length_m / steps;
        for k in 0..steps as u32 {
            let s_m = from_m + (2.0 * f64::from(k) + 1.0) * half_m;
            let Some(section) = tunnel.section_at(s_m) else {
                continue;
            };
            let frame = tunnel.alignment.at(s_m);
            Self::of_walls(section, &frame, half_m, &mut cells);
            for l_m in [-RAIL_OFFSET_M, RAIL_OFFSET_M] {
                let [foot, head] = [-0.2, 0.1].map(|h_m| frame.world_from_section(l_m, h_m));
                let half = [frame.ahead() * half_m, 0.5 * (head - foot)];
                cells.push(Self::still(nalgebra::center(&foot, &head), half, None));
            }
        }
        cells
    }

    fn of_walls(section: &CrossSection, frame: &TrackFrame, half_m: f64, cells: &mut Vec<Self>) {
        for edge in section.edges() {
            let [a, b] = [edge.a, edge.b].map(|p| frame.world_from_section(p.l_m, p.h_m));
            let count = (edge.length_m() / CELL_M).ceil().clamp(1.0, 64.0);
            let (l, h) = edge.normal();
            let half = 0.5 / count * (b - a);
            let normal = frame.left() * l + Vector3::z() * h;
            cells.extend((0..count as u32).map(|k| {
                let centre = a + half * (2.0 * f64::from(k) + 1.0);
                Self::still(centre, [frame.ahead() * half_m, half], Some(normal))
            }));
        }
    }

    /// The six sides of a box.
    pub fn of_box(body: &Body, half: &Vector3<f64>, [mid_s, half_s]: [f64; 2]) -> Vec<Self> {
        let mut cells = Vec::new();
        let rotation = body.world_from_body.rotation;
        let centre =
            Point3::from(body.world_from_body.translation.vector + body.velocity_mps * mid_s);
        for axis in 0..3 {
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3].map(|k| {
                let count = (2.0 * half[k] / CELL_M).ceil().clamp(1.0, 64.0);
                let side = rotation * Vector3::ith(k, half[k] / count);
                (side, count as i32)
            });
            for sign in [-1.0, 1.0] {
                let normal = rotation * Vector3::ith(axis, sign);
                for (i, j) in (0..u.1).flat_map(|i| (0..v.1).map(move |j| (i, j))) {
                    let along = |k: i32, count: i32| f64::from(2 * k + 1 - count);
                    let aside = u.0 * along(i, u.1) + v.0 * along(j, v.1);
                    cells.push(Self {
                        centre: centre + normal * half[axis] + aside,
                        half: [u.0, v.0],
                        normal: Some(normal),
                        velocity_mps: body.velocity_mps,
                        travel_m: body.velocity_mps.norm() * half_s,
                    });
                }
            }
        }
        cells
    }

    /// Its corners.
    pub fn corners(&self) -> [Point3<f64>; 4] {
        [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(x, y)| self.point(x, y))
    }

    fn point(&self, x: f64, y: f64) -> Point3<f64> {
        self.centre + self.half[0] * x + self.half[1] * y
    }
}

impl Eyes {
    /// In the first, middle and last row.
    pub fn of(framed: &Framed<'_>, job_time: crate::bus::SimTime) -> Self {
        let view = framed.view;
        let last = f64::from(view.camera.intrinsics.height_px.saturating_sub(1));
        let rows = [0.0, 0.5 * last, last];
        Self(rows.map(|v| {
            let at = view.camera.shutter.row_mid(view.start, v);
            (view.motion.pose_at(at).inverse(), at.since(job_time))
        }))
    }

    /// From the opening of the first row to the closing of the last.
    pub fn exposed(framed: &Framed<'_>, job_time: crate::bus::SimTime) -> Self {
        let view = framed.view;
        let rows = view.camera.intrinsics.height_px;
        let span_s = view.camera.shutter.frame_span_s(rows);
        Self([0.0, 0.5, 1.0].map(|share| {
            let at = view.start.plus(share * span_s);
            (view.motion.pose_at(at).inverse(), at.since(job_time))
        }))
    }

    /// How far the camera goes from a place, between these rows as it does at them.
    pub fn travel_m(&self, from: &Point3<f64>) -> f64 {
        let away = |(eye, _): &(Isometry3<f64>, f64)| (eye * from).coords.norm();
        self.0.iter().map(away).fold(0.0, f64::max)
    }
}

impl TileBounds {
    fn around(low_px: f64, high_px: f64) -> Self {
        Self {
            low_px: Point2::from([low_px; 2]),
            high_px: Point2::from([high_px; 2]),
        }
    }

    fn none() -> Self {
        Self::around(f64::INFINITY, f64::NEG_INFINITY)
    }

    /// Adds places in the camera's frame, and leaves out those behind it; whether there are none of
    /// these, or nothing else.
    fn add(&mut self, framed: &Framed<'_>, places: impl IntoIterator<Item = Point3<f64>>) -> bool {
        let (mut before, mut behind) = (0, 0);
        for place in places {
            if place.z <= NEAR_M {
                behind += 1;
                continue;
            }
            before += 1;
            if let Some(at) = framed.view.camera.intrinsics.project(&place) {
                self.low_px = self.low_px.inf(&at);
                self.high_px = self.high_px.sup(&at);
            }
        }
        before == 0 || behind == 0
    }

    /// Where a cell may be seen.
    pub fn of_cell(framed: &Framed<'_>, eyes: &Eyes, cell: &SurfaceCell) -> Self {
        let mut bounds = Self::none();
        let mid_s = eyes.0[1].1;
        for (eye, after_s) in &eyes.0 {
            let moved = cell.velocity_mps * (after_s - mid_s);
            let grid = |steps: i32| {
                let along = move |k: i32| 2.0 * f64::from(k) / f64::from(steps) - 1.0;
                let places = (0..=steps).flat_map(move |i| (0..=steps).map(move |j| (i, j)));
                places.map(move |(i, j)| eye * (cell.point(along(i), along(j)) + moved))
            };
            if !bounds.add(framed, grid(1)) {
                bounds.add(framed, grid(POINTS));
            }
        }
        bounds
    }

    /// Where the corners of a body may be seen.
    pub fn of_body(framed: &Framed<'_>, eyes: &Eyes, body: &Body) -> Self {
        let mut bounds = Self::none();
        for (eye, after_s) in &eyes.0 {
            let corners = Solid::at(body, *after_s)
                .corners()
                .map(|corner| eye * corner);
            if !bounds.add(framed, corners) {
                return Self::around(f64::NEG_INFINITY, f64::INFINITY);
            }
        }
        bounds
    }

    /// The same of all of it: a lens that bends lines lets edges bulge beyond their ends.
    pub fn of_outline(framed: &Framed<'_>, eyes: &Eyes, body: &Body) -> Self {
        let bends = !framed.view.camera.intrinsics.distortion.is_none();
        Self::of_body(framed, eyes, body).widened(if bends { BULGE } else { 0.0 })
    }

    /// The pixels of a picture in it.
    pub fn rectangle(&self, size_px: [u32; 2]) -> Rectangle {
        Rectangle::between(self.low_px, self.high_px, size_px)
    }

    /// With a share of the longer side more on every side.
    fn widened(&self, share: f64) -> Self {
        let size_px = self.high_px - self.low_px;
        // Nothing, and everything, stay what they are.
        let longer_px = Some(size_px.max()).filter(|px| px.is_finite());
        let more = Vector2::repeat(share * longer_px.unwrap_or(0.0));
        Self {
            low_px: self.low_px - more,
            high_px: self.high_px + more,
        }
    }
}

impl Marks {
    /// Empty sets of so many numbers for a picture.
    pub fn new((width_px, height_px): (u32, u32), numbers: usize) -> Self {
        let (columns, rows) = (width_px.div_ceil(TILE_PX), height_px.div_ceil(TILE_PX));
        let words = numbers.div_ceil(64);
        Self {
            columns,
            rows,
            words,
            sets: vec![0; (columns * rows) as usize * words],
        }
    }

    /// Column, row and set of each tile.
    pub fn tiles(&self) -> impl Iterator<Item = (u32, u32, &[u64])> {
        let sets = self.sets.chunks_exact(self.words.max(1));
        sets.zip(0u32..)
            .map(|(set, k)| (k % self.columns, k / self.columns, set))
    }

    /// Adds numbers to all tiles that have pixels of a part of the picture.
    pub fn add_part(&mut self, part: &Rectangle, numbers: &[u64]) {
        if part.is_empty() {
            return;
        }
        let counts = [self.columns, self.rows];
        let ends = part.ends();
        let tiles = [0, 1].map(|k| {
            let end = ends[k].div_ceil(TILE_PX);
            part.at[k] / TILE_PX..end.min(counts[k])
        });
        self.add_tiles(tiles, numbers);
    }

    /// Adds numbers to all tiles that show anything within bounds.
    pub fn add(&mut self, bounds: &TileBounds, numbers: &[u64]) {
        let counts = [self.columns, self.rows];
        let tiles = [0, 1].map(|k| {
            let tile = |px: f64| (px / f64::from(TILE_PX)).floor();
            let first = tile(bounds.low_px[k] + 0.5 - BORDER_PX).max(0.0);
            let end = tile(bounds.high_px[k] + 0.5 + BORDER_PX) + 1.0;
            // Nothing where the end comes first.
            first as u32..end.min(f64::from(counts[k])).max(0.0) as u32
        });
        self.add_tiles(tiles, numbers);
    }

    fn add_tiles(&mut self, [columns, rows]: [Range<u32>; 2], numbers: &[u64]) {
        for row in rows {
            for column in columns.clone() {
                let at = (row * self.columns + column) as usize * self.words;
                for (word, new) in self.sets[at..].iter_mut().zip(numbers) {
                    *word |= new;
                }
            }
        }
    }
}
