//! What blinking lamps give a slice of a row's exposure.

use super::lamps::RowExposure;
use crate::twin::render::View;
use crate::twin::render::photometry::BlinkingLamp;

/// Light that changes by less than a level of 255 shows no bands.
const BAND: f64 = 0.004;

/// Every lamp of the scene.
pub(super) struct Blinking {
    /// Its light in the slice over its mean, less 1; 0 for those not asked for.
    pub flicker: Vec<f64>,
    /// Whether any of it can be seen.
    pub shows: bool,
}

impl Blinking {
    /// All lamps give their mean.
    pub fn steady(lamps: &[BlinkingLamp]) -> Self {
        Self {
            flicker: vec![0.0; lamps.len()],
            shows: false,
        }
    }

    pub fn new(lamps: &[BlinkingLamp], asked: &[usize], view: &View, row: &RowExposure) -> Self {
        let Self { mut flicker, .. } = Self::steady(lamps);
        for k in asked {
            let lamp = &lamps[*k];
            if lamp.duty() > 0.0 {
                flicker[*k] = row.light(view, lamp, 0.0, 1.0) / lamp.duty() - 1.0;
            }
        }
        Self {
            shows: flicker.iter().any(|f| f.abs() > BAND),
            flicker,
        }
    }
}
