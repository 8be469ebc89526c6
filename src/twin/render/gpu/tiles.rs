//! Pieces of surfaces, and tiles of a picture with what may matter in each: light, lights, shadows.

use super::rectangle::Rectangle;
use super::surface::SurfaceCell;
use crate::twin::geometry::{Body, Solid};
use crate::twin::render::gpu::layout::NEAR_M;
use crate::twin::render::gpu::view::Framed;
use nalgebra::{Isometry3, Point2, Point3, Vector2};

/// Side of a tile: over so few pixels a lens's distortion is even.
pub const TILE_PX: u32 = 32;
/// A lens bends the edges of a body out of the rectangle around its corners by less than this share of the
/// rectangle's longer side.
const BULGE: f64 = 0.1;
/// Cells that reach behind the camera are looked at in so many points each way.
const POINTS: i32 = 8;

/// A rectangle of the picture.
#[derive(Clone, Copy)]
pub struct TileBounds {
    low_px: Point2<f64>,
    high_px: Point2<f64>,
}

/// Where the camera is while a view is exposed: `camera_from_world`, and when after the job's time.
pub struct Eyes([(Isometry3<f64>, f64); 3]);

/// The tiles of a picture, row by row.
#[derive(Clone, Copy)]
pub struct TileGrid {
    columns: u32,
    rows: u32,
}

/// Sets of numbers, one a tile.
pub struct Marks {
    grid: TileGrid,
    words: usize,
    sets: Vec<u64>,
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

impl TileGrid {
    pub fn new(size_px: [u32; 2]) -> Self {
        let [columns, rows] = size_px.map(|px| px.div_ceil(TILE_PX));
        Self { columns, rows }
    }

    pub fn count(self) -> usize {
        (self.columns * self.rows) as usize
    }

    /// The numbers of all tiles that have pixels of a part of the picture.
    pub fn tiles_of(self, part: &Rectangle) -> impl Iterator<Item = usize> {
        let counts = [self.columns, self.rows];
        let ends = part.ends();
        let [columns, rows] = [0, 1].map(|k| {
            let end = ends[k].div_ceil(TILE_PX);
            part.at[k] / TILE_PX..end.min(counts[k])
        });
        let rows = rows.filter(|_| !part.is_empty());
        rows.flat_map(move |row| {
            let columns = columns.clone();
            columns.map(move |column| (row * self.columns + column) as usize)
        })
    }
}

impl Marks {
    /// Empty sets of so many numbers for a picture.
    pub fn new(grid: TileGrid, numbers: usize) -> Self {
        let words = numbers.div_ceil(64);
        Self {
            grid,
            words,
            sets: vec![0; grid.count() * words],
        }
    }

    /// Column, row and set of each tile.
    pub fn tiles(&self) -> impl Iterator<Item = (u32, u32, &[u64])> {
        let sets = self.sets.chunks_exact(self.words.max(1));
        sets.zip(0u32..)
            .map(|(set, k)| (k % self.grid.columns, k / self.grid.columns, set))
    }

    /// Adds numbers to all tiles that have pixels of a part of the picture.
    pub fn add_part(&mut self, part: &Rectangle, numbers: &[u64]) {
        for tile in self.grid.tiles_of(part) {
            let set = &mut self.sets[tile * self.words..];
            for (word, new) in set.iter_mut().zip(numbers) {
                *word |= new;
            }
        }
    }
}
