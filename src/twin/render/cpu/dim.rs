//! Where a picture is dark, a few rays do.
//!
//! Rays are followed through the corners of cells of 8 x 8 pixels, each with the pose of its own
//! row. Where none of a cell's four corners gives a tenth of a grey level, no pixel between them
//! can be seen apart from another, whatever is painted on the wall: paint changes its light by two times
//! at most, and light itself changes little over 8 pixels but close to a lamp, where it is bright. Such
//! cells are filled linearly. Bed and rails are never dark: they may mirror a lamp in any place.

use super::lamps::RowExposure;
use crate::twin::render::View;
use rayon::prelude::*;

/// Side of a cell, pixels.
pub(super) const CELL_PX: usize = 8;
/// Grey levels below which a corner is dark.
const DARK_GREY: f64 = 0.1;

/// Luminances at the corners of a picture's cells.
pub(super) struct DimView {
    corners: Vec<f64>,
    columns: usize,
    dark: f64,
}

impl DimView {
    /// Of a view; `luminances` finds them along a row of corners.
    pub fn new(view: &View, luminances: impl Fn(&RowExposure, &mut [f64]) + Sync) -> Self {
        let camera = &view.camera.intrinsics;
        let columns = camera.width_px as usize / CELL_PX + 2;
        let rows = camera.height_px as usize / CELL_PX + 2;
        let mut corners = vec![0.0; columns * rows];
        let lines = corners.par_chunks_mut(columns).enumerate();
        lines.for_each(|(i, corners)| luminances(&RowExposure::new(view, i * CELL_PX), corners));
        Self {
            corners,
            columns,
            dark: DARK_GREY / view.grey_per_cd_m2(),
        }
    }

    /// Luminances on row `v` at the left and right side of cell `j`, if the cell is dark.
    pub fn sides(&self, j: usize, v: usize) -> Option<[f64; 2]> {
        let above = &self.corners[v / CELL_PX * self.columns + j..][..2];
        let below = &self.corners[(v / CELL_PX + 1) * self.columns + j..][..2];
        let dark = above.iter().chain(below).all(|l| *l < self.dark);
        let down = (v % CELL_PX) as f64 / CELL_PX as f64;
        dark.then(|| [0, 1].map(|k| above[k] + (below[k] - above[k]) * down))
    }
}
