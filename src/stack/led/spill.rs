//! How far the edges of a saturated lamp lie outside of its own.
//!
//! Where rows are saturated, the crossing of half their plateau lies too far out by a *spill*, the
//! same on both sides. What the outermost saturated pixel and the two after it hold says by how
//! much, on average over many rows.
//!
//! # Theory
//!
//! Call F(x) the share of a lamp's light that a pixel gets whose centre lies x inside of the edge: a
//! step, spread by the lens (a Gaussian of standard deviation sigma) and by the pixel's own width.
//! With `G(x) = x P(x / sigma) + sigma p(x / sigma)`, P and p the normal distribution and its density,
//!
//! ```text
//! F(x) = G(x + 1/2) - G(x - 1/2)
//! ```
//!
//! A lamp saturates the pixels with x over some `a`, so the outermost saturated one lies anywhere
//! from a to a + 1, `a + 1/2` on average; and the next outwards holds, of the way from the pixel after
//! it (which has the glare as well) to saturation,
//!
//! ```text
//! s(x) = (F(x - 1) - F(x - 2)) / (F(a) - F(x - 2))
//! ```
//!
//! The mean of s over x from a to a + 1 grows with a, so the mean share measured gives a, and the
//! spill is the mean distance from the outermost saturated pixel to the edge found, less a + 1/2.

use std::f64::consts::TAU;

/// Over this a pixel tells no more than that it is bright.
const SATURATED_GREY: f64 = 250.0;

/// Standard deviation of the mean share, from discs of all kinds (`the_spill_of_a_saturated_lamp_is_known`).
const SHARE_SIGMA: f64 = 0.03;

/// How far the edges of a lamp lie outside of its own, along the outline's normal.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spill {
    /// Mean over all edges.
    pub px: f64,
    /// Standard deviation of it.
    pub sigma_px: f64,
}

/// The mean share, as a function of how far inside the outermost saturated pixel lies: mean shares,
/// rising, and `a + 1/2` for each.
#[derive(Clone, Debug)]
pub struct SpillTable([(f64, f64); STEPS]);

/// Entries of the table, over five pixels.
const STEPS: usize = 101;

impl SpillTable {
    /// For a lens that spreads a point with a standard deviation of `blur_px`.
    pub fn new(blur_px: f64) -> Self {
        let mut most: f64 = 0.0;
        Self(std::array::from_fn(|k| {
            // From far outside, where a lamp ten thousand times too bright still saturates.
            let from = -0.5 - 4.0 * blur_px;
            let a = from + (1.0 + 5.5 * blur_px) * k as f64 / (STEPS - 1) as f64;
            most = most.max(mean_share(a, blur_px));
            (most, a + 0.5)
        }))
    }

    /// How far inside the edge the outermost saturated pixel lies, from the mean share, and how much
    /// farther for every share more.
    fn inside_px(&self, share: f64) -> (f64, f64) {
        let k = self.0.partition_point(|e| e.0 < share).clamp(1, STEPS - 1);
        let (low, high) = (self.0[k - 1], self.0[k]);
        let slope = (high.1 - low.1) / (high.0 - low.0).max(1e-12);
        let inside = low.1 + slope * (share.clamp(low.0, high.0) - low.0);
        (inside, slope)
    }
}

/// Sums over the edges looked at.
#[derive(Clone, Copy, Debug, Default)]
pub struct SpillSums {
    looked_at: usize,
    saturated: usize,
    share: f64,
    away_px: f64,
}

impl SpillSums {
    /// Looks at an edge found in a row whose plateau is `top`. `outwards` is -1 for a left edge, 1
    /// for a right one.
    pub fn add(&mut self, row: &[u8], top: f64, edge: f64, outwards: isize) {
        self.looked_at += 1;
        if top < SATURATED_GREY {
            return;
        }
        if let Some((away_px, share)) = away_and_share(row, edge, outwards) {
            self.saturated += 1;
            self.away_px += away_px;
            self.share += share;
        }
    }

    /// Of all edges looked at.
    pub fn spill(&self, table: &SpillTable) -> Spill {
        if self.saturated == 0 {
            return Spill::default();
        }
        let n = self.saturated as f64;
        let (inside_px, px_per_share) = table.inside_px(self.share / n);
        let of_all = n / self.looked_at as f64;
        let spill_px = of_all * (self.away_px / n - inside_px);
        Spill {
            px: spill_px.max(0.0),
            sigma_px: of_all * SHARE_SIGMA * px_per_share,
        }
    }
}

/// Mean of s over a pixel, by the midpoint rule.
fn mean_share(a: f64, blur_px: f64) -> f64 {
    const PARTS: usize = 32;
    let full = lit(a, blur_px);
    let share = |k: usize| {
        let x = a + (k as f64 + 0.5) / PARTS as f64;
        let (next, after) = (lit(x - 1.0, blur_px), lit(x - 2.0, blur_px));
        (next - after) / (full - after).max(1e-12)
    };
    (0..PARTS).map(share).sum::<f64>() / PARTS as f64
}

/// F: share of a lamp's light in a pixel `x` inside of its edge.
fn lit(x: f64, blur_px: f64) -> f64 {
    if blur_px < 1e-3 {
        return (x + 0.5).clamp(0.0, 1.0);
    }
    let ramp = |x: f64| {
        let z = x / blur_px;
        let density = (-0.5 * z * z).exp() / TAU.sqrt();
        let distribution = 0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2);
        x * distribution + blur_px * density
    };
    ramp(x + 0.5) - ramp(x - 0.5)
}

/// Farther inside the edge than this no pixel is the outermost that a lamp saturates: it is the noise
/// of one that hardly does.
const MOST_AWAY: isize = 4;

/// Distance from the outermost saturated pixel to the edge, and the share of the next pixel;
/// `None` where there is none, or the patch ends too early.
fn away_and_share(row: &[u8], edge: f64, outwards: isize) -> Option<(f64, f64)> {
    let grey = |u: isize| Some(f64::from(*row.get(usize::try_from(u).ok()?)?));
    let inside = |u: isize| grey(u).is_some_and(|g| g >= SATURATED_GREY);
    let near = edge.round() as isize + outwards;
    let outermost = (0..=MOST_AWAY)
        .map(|k| near - k * outwards)
        .find(|&u| inside(u))?;
    let (next, after) = (grey(outermost + outwards)?, grey(outermost + 2 * outwards)?);
    let share = ((next - after) / (SATURATED_GREY - after)).clamp(0.0, 1.0);
    Some(((edge - outermost as f64).abs(), share))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::stack::led::ellipse::fit_ellipse;
    use crate::stack::led::otsu::otsu;
    use crate::stack::led::outline::{ClosedSpot, Outline};
    use crate::stack::led::patch::Patch;

    /// Without a lens the share is half of what saturates: a = t - 1/2, s = t / 2 in the mean where
    /// the pixel after the next is dark.
    #[test]
    fn a_sharp_edge_is_read_as_the_pixel_alone_has_it() {
        let spill = SpillTable::new(0.0);
        for t in [0.1, 0.3, 0.55, 0.9] {
            assert!((mean_share(t - 0.5, 0.0) - 0.5 * t).abs() < 1e-3, "{t}");
            assert!((spill.inside_px(0.5 * t).0 - t).abs() < 0.02, "{t}");
        }
    }

    /// The table gives back what it was made from, for any lens.
    #[test]
    fn shares_invert() {
        for blur_px in [0.2, 0.5, 1.0, 2.0] {
            let spill = SpillTable::new(blur_px);
            for k in 0..=10 {
                let a = -0.5 + (0.2 * f64::from(k) - 1.2) * blur_px;
                let found = spill.inside_px(mean_share(a, blur_px)).0;
                assert!((found - a - 0.5).abs() < 0.01, "{blur_px} {a}: {found}");
            }
        }
    }

    /// Offsets that a point spread of `blur_px` makes, with their weights: a grid of 7 x 7.
    fn spread(blur_px: f64) -> Vec<(f64, f64, f64)> {
        let z = |k: usize| (k % 7) as f64 - 3.0;
        let weight = |k: usize| (-0.5 * (z(k) * z(k) + z(k / 7) * z(k / 7))).exp();
        let sum: f64 = (0..49).map(weight).sum();
        (0..49)
            .map(|k| (blur_px * z(k), blur_px * z(k / 7), weight(k) / sum))
            .collect()
    }

    /// A disc of light in its glare, behind a lens: how far its outline is found outside of it, and
    /// the spill stated with its sigma.
    fn spill_of(bright: f64, radius: f64, halo_share: f64, off: f64, blur_px: f64) -> [f64; 3] {
        let (w, h, centre) = (120usize, 120usize, 60.0 + off);
        let spread = spread(blur_px);
        let pixel = |u: usize, v: usize| {
            let sub = |k: usize| (k as f64 + 0.5) / 8.0 - 0.5;
            let away = |x: f64, y: f64| (x - centre).hypot(y - centre - off) - radius;
            let lit = |k: usize, du: f64, dv: f64| {
                away(u as f64 + sub(k % 8) + du, v as f64 + sub(k / 8) + dv) < 0.0
            };
            let far = away(u as f64, v as f64);
            let share = if far.abs() > 1.0 + 3.5 * blur_px {
                f64::from(far < 0.0)
            } else {
                let part = |&(du, dv, weight): &(f64, f64, f64)| {
                    weight * (0..64).filter(|&k| lit(k, du, dv)).count() as f64 / 64.0
                };
                spread.iter().map(part).sum()
            };
            let glare = halo_share * bright * (-far.max(0.0) / 12.0).exp();
            (4.0 + bright * share + glare).min(255.0) as u8
        };
        let data = (0..w * h).map(|k| pixel(k % w, k / w)).collect();
        let patch = Patch::from_data(0, 0, w, h, data);
        let threshold = otsu(&patch.histogram()).map_or(0, |split| split.threshold);
        let spot = ClosedSpot::find(&patch, threshold, 9).unwrap();
        let table = SpillTable::new(blur_px);
        let outline = Outline::trace(&spot, &patch, (4.0, threshold), (1280, 720), &table);
        let found = fit_ellipse(&outline.points).map(|f| f.ellipse);
        let found_px = found.map_or(f64::NAN, |e| (e.semi_major_px * e.semi_minor_px).sqrt());
        [found_px - radius, outline.spill.px, outline.spill.sigma_px]
    }

    /// Discs of many sizes that saturate the sensor up to tenfold, in glare of up to 40 % of its
    /// range, behind sharp and soft lenses: the edges are too far out, and the spill tells by how
    /// much, to its sigma. A dim one does not spill.
    #[test]
    fn the_spill_of_a_saturated_lamp_is_known() {
        let lamps: Vec<_> = [270.0, 320.0, 400.0, 700.0, 1200.0, 2500.0]
            .into_iter()
            .flat_map(|bright| [0.0, 0.02, 0.05].map(|halo_share| (bright, halo_share)))
            .filter(|(bright, halo_share)| bright * halo_share < 105.0)
            .collect();
        for blur_px in [0.0, 0.5, 0.8] {
            let mut shares = Vec::new();
            for &(bright, halo_share) in &lamps {
                for radius in [9.4, 18.3, 39.9] {
                    for off in [0.0, 0.17, 0.3] {
                        let [is, said, sigma] = spill_of(bright, radius, halo_share, off, blur_px);
                        let share = (said - is) / sigma;
                        assert!(
                            share.abs() < 5.0,
                            "{blur_px} {bright} {halo_share} {radius} {off}: {said} for {is}, {sigma}"
                        );
                        shares.push(share);
                    }
                }
            }
            let rms = (shares.iter().map(|s| s * s).sum::<f64>() / shares.len() as f64).sqrt();
            assert!((0.8..1.2).contains(&rms), "{blur_px}: {rms}");
        }
        let [is, said, _] = spill_of(120.0, 30.7, 0.02, 0.3, 0.5);
        assert!(said < 1e-9 && is.abs() < 0.05, "{said} for {is}");
    }
}
