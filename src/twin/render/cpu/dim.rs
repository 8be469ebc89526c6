//! Where a picture is dark, a few rays do.
//!
//! Rays are followed through the corners of cells of 8 x 8 pixels, each with the pose of its own
//! row. Where none of a cell's four corners gives a tenth of a grey level, no pixel between them
//! can be told from another, whatever is painted on the wall: paint changes its light by two times
//! at most, and light itself changes little over 8 pixels but close to a lamp, where it is bright. Such
//! cells are filled linearly. Bed and rails are never dark: they may mirror a lamp in any place.

use super::blinking::Blinking;
use super::{Behind, RowRays, Scenery, World};
use crate::twin::render::View;
use crate::twin::render::cpu::lamps::RowExposure;
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
    pub fn new(world: &World, scenery: &Scenery<'_>, view: &View) -> Self {
        let camera = &view.camera.intrinsics;
        let columns = camera.width_px as usize / CELL_PX + 2;
        let rows = camera.height_px as usize / CELL_PX + 2;
        let mut corners = vec![0.0; columns * rows];
        corners
            .par_chunks_mut(columns)
            .enumerate()
            .for_each(|(i, corners)| {
                let row = RowExposure::new(view, i * CELL_PX);
                let mut rays = RowRays::new(world, scenery, view, &row, Behind::Unknown);
                rays.side_px = CELL_PX as f64;
                // A lamp that is off in this row may be on in the next.
                rays.blinking = Blinking::steady(world.lamps.lamps());
                for (j, corner) in corners.iter_mut().enumerate() {
                    *corner = if rays.may_mirror(j * CELL_PX) {
                        f64::INFINITY
                    } else {
                        rays.tunnel(j * CELL_PX).0
                    };
                }
            });
        let grey_per_luminance = view.grey_per_cd_m2();
        Self {
            corners,
            columns,
            dark: DARK_GREY / grey_per_luminance,
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
