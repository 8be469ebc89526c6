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
pub(super) struct Cells {
    wide: usize,
    spans: Vec<Option<GaugeSpan>>,
    blind: Vec<bool>,
    any_blind: bool,
}

impl Cells {
    pub fn new(sight: &Sight, width: usize, height: usize) -> Self {
        let (wide, high) = (width.div_ceil(CELL_PX), height.div_ceil(CELL_PX));
        let middle = |k: usize| (k * CELL_PX) as f64 + (CELL_PX as f64 - 1.0) / 2.0;
        let spans = (0..wide * high)
            .map(|k| sight.gauge_span(middle(k % wide), middle(k / wide)))
            .collect();
        Self {
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
            let passes = |span: &GaugeSpan, (from_m, to_m): (f64, f64)| {
                span.from_m <= to_m && span.to_m >= from_m
            };
            *blind = (span.as_ref())
                .is_some_and(|span| trains.iter().any(|stretch| passes(span, *stretch)));
            self.any_blind |= *blind;
        }
    }

    pub fn any_blind(&self) -> bool {
        self.any_blind
    }

    /// Whether a region, or a neighbour of it, is blind: a region that blind cells cut off ends
    /// beside them.
    pub fn touches_blind(&self, bounds: PixelBox) -> bool {
        let cell = |px: u32| px as usize / CELL_PX;
        let columns = cell(bounds.u0.saturating_sub(CUT_PX))..=cell(bounds.u1 + CUT_PX);
        let rows = cell(bounds.v0.saturating_sub(CUT_PX))..=cell(bounds.v1 + CUT_PX);
        self.any_blind
            && rows.into_iter().any(|y| {
                let row = self.blind.get(y * self.wide..(y + 1) * self.wide);
                let last = (*columns.end()).min(self.wide.saturating_sub(1));
                row.and_then(|row| row.get(*columns.start()..=last))
                    .is_some_and(|cells| cells.contains(&true))
            })
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
