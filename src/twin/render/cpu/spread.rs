//! Where the light of a pixel comes from: places spread over the pixel's square and the lens's
//! Gaussian point spread, each for an equal share of the light.

use std::f64::consts::PI;

/// Points of a Fibonacci lattice, and the Fibonacci number before that.
const POINTS: u32 = 377;
const STEP: u32 = 233;

/// Places in the image relative to a pixel's centre, pixels.
pub(super) struct BlurSamples {
    pub places: Vec<(f64, f64)>,
    /// No place is farther away, along either axis.
    pub reach_px: f64,
}

impl BlurSamples {
    pub fn new(blur_px: f64) -> Self {
        let quantiles: Vec<f64> = (0..POINTS)
            .map(|k| quantile((f64::from(k) + 0.5) / f64::from(POINTS), blur_px))
            .collect();
        let along = |k: u32| quantiles[(k * STEP % POINTS) as usize];
        Self {
            places: (0..POINTS)
                .map(|k| (quantiles[k as usize], along(k)))
                .collect(),
            reach_px: quantiles.iter().fold(0.0, |a, q| q.abs().max(a)),
        }
    }
}

/// The offset below which a share of a pixel's light comes from, along one axis: the sum of a
/// uniform number of width 1 and a Gaussian one.
fn quantile(share: f64, blur_px: f64) -> f64 {
    let end = 0.5 + 6.0 * blur_px;
    let (mut low, mut high) = (-end, end);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if below(middle, blur_px) < share {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Probability of an offset below `x`.
fn below(x: f64, blur_px: f64) -> f64 {
    integral(x + 0.5, blur_px) - integral(x - 0.5, blur_px)
}

/// Integral of the Gaussian distribution function up to `x`.
fn integral(x: f64, sigma: f64) -> f64 {
    if sigma < 1e-6 {
        return x.max(0.0);
    }
    let z = x / sigma;
    x * 0.5 * libm::erfc(-z / 2f64.sqrt()) + sigma * (-0.5 * z * z).exp() / (2.0 * PI).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Provokes: places whose mean, spread and correlation are not those of a pixel behind a lens:
    /// variance 1/12 + blur^2 along either axis.
    #[test]
    fn places_have_the_moments_of_pixel_and_blur() {
        for blur_px in [0.0, 0.3, 0.5, 2.0] {
            let spread = BlurSamples::new(blur_px);
            let n = spread.places.len() as f64;
            let mean =
                |f: &dyn Fn(&(f64, f64)) -> f64| spread.places.iter().map(f).sum::<f64>() / n;
            let variance = 1.0 / 12.0 + blur_px * blur_px;
            assert!(mean(&|p| p.0).abs() < 1e-9 && mean(&|p| p.1).abs() < 1e-9);
            assert!((mean(&|p| p.0 * p.0) / variance - 1.0).abs() < 0.01);
            assert!((mean(&|p| p.1 * p.1) / variance - 1.0).abs() < 0.01);
            let correlation = mean(&|p| p.0 * p.1) / variance;
            // 377 places of a lattice: their moments are good to one in fifty.
            assert!(correlation.abs() < 0.03, "{blur_px}: {correlation}");
        }
    }
}
