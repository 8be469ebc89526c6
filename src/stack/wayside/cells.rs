//! The image in cells of 8 x 8 pixels: which of them look through the structure gauge at all,
//! and which are blind while a train is there.

use super::sight::{GaugeSpan, Sight};
use crate::bus::PixelBox;

/// Side of a cell.
pub(super) const CELL_PX: usize = 8;
/// The noise filter takes so much off a region along a cut.
const CUT_PX: u32 = 2;

/// One span and one flag a cell.
#[derive(Clone, Debug)]
pub(super) struct GaugeCells {
    /// Of the image, pixels.
    width: usize,
    wide: usize,
    spans: Vec<Option<GaugeSpan>>,
    blind: Vec<bool>,
    any_blind: bool,
}

impl GaugeCells {
    pub fn new(sight: &Sight, width: usize, height: usize) -> Self {
        let (wide, high) = (width.div_ceil(CELL_PX), height.div_ceil(CELL_PX));
        let middle = |k: usize| (k * CELL_PX) as f64 + (CELL_PX as f64 - 1.0) / 2.0;
        let spans = (0..wide * high)
            .map(|k| sight.gauge_span(middle(k % wide), middle(k / wide)))
            .collect();
        Self {
            width: width.max(1),
            wide,
            spans,
            blind: vec![false; wide * high],
            any_blind: false,
        }
    }

    /// Whether a pixel looks through the gauge.
    pub fn in_gauge(&self, u: usize, v: usize) -> bool {
        self.spans[v / CELL_PX * self.wide + u / CELL_PX].is_some()
    }

    /// Blinds the cells whose line of sight passes a stretch that a train occupies.
    pub fn occupy(&mut self, trains: &[(f64, f64)]) {
        self.any_blind = false;
        for (blind, span) in self.blind.iter_mut().zip(&self.spans) {
            let passes = |span: &GaugeSpan| {
                let meets = |train: &(f64, f64)| span.from_m <= train.1 && span.to_m >= train.0;
                trains.iter().any(meets)
            };
            *blind = span.as_ref().is_some_and(passes);
            self.any_blind |= *blind;
        }
    }

    /// Whether the cell of a pixel is blind.
    pub fn is_blind(&self, (u, v): (usize, usize)) -> bool {
        self.blind.get(v / CELL_PX * self.wide + u / CELL_PX) == Some(&true)
    }

    /// Whether the cell of the pixel at an index into the image is blind.
    pub fn hides(&self, pixel: usize) -> bool {
        self.any_blind && self.is_blind((pixel % self.width, pixel / self.width))
    }

    pub fn any_blind(&self) -> bool {
        self.any_blind
    }

    /// Whether a region, or a neighbour of it, is blind: a region that blind cells cut off ends
    /// beside them.
    pub fn touches_blind(&self, bounds: &PixelBox) -> bool {
        let around = bounds.widened(CUT_PX, CUT_PX);
        let cell = |px: u32| px as usize / CELL_PX;
        let last = cell(around.u1).min(self.wide.saturating_sub(1));
        let is_blind = |x: usize, y: usize| self.blind.get(y * self.wide + x) == Some(&true);
        self.any_blind
            && (cell(around.v0)..=cell(around.v1))
                .any(|y| (cell(around.u0)..=last).any(|x| is_blind(x, y)))
    }

    /// Sets the pixels of blind cells to 0.
    pub fn clear_blind(&self, image: &mut [u8], width: usize) {
        if !self.any_blind {
            return;
        }
        for (v, row) in image.chunks_exact_mut(width.max(1)).enumerate() {
            let blind = &self.blind[v / CELL_PX * self.wide..];
            for (cell, &blind) in row.chunks_mut(CELL_PX).zip(blind) {
                if blind {
                    cell.fill(0);
                }
            }
        }
    }
}
