//! How a lens and a pixel spread a lamp's light, along either axis of the picture.

/// The spread ends this many standard deviations away.
const ENDS: f64 = 3.2;

/// A pixel's square, the Gaussian of the lens in focus and the disc of confusion together, by variance
/// and fourth cumulant (those of sums add up): 1/12 and -1/120 of the square, b^2 and 0 of the
/// Gaussian, r^2/4 and -r^4/16 of a disc of radius r. Edgeworth's series from them is right to 0.4 % of
/// full light from a blur of 0.25 px up, to 2 % with none; its errors lie evenly about an edge and do
/// not shift it.
pub struct PointSpread {
    /// Standard deviation.
    pub sigma_px: f64,
    /// A 24th of the cumulant over the square of the variance, less its sign.
    pub flat: f64,
    /// It ends this far away.
    pub ends_px: f64,
}

impl PointSpread {
    /// Of a lens's blur in focus and the diameter of its circle of confusion.
    pub fn new(blur_px: f64, confusion_px: f64) -> Self {
        let r2 = (0.5 * confusion_px).powi(2);
        let variance = 1.0 / 12.0 + blur_px * blur_px + 0.25 * r2;
        let cumulant = 1.0 / 120.0 + r2 * r2 / 16.0;
        let sigma_px = variance.sqrt();
        Self {
            sigma_px,
            flat: cumulant / (24.0 * variance * variance),
            ends_px: ENDS * sigma_px,
        }
    }
}
