//! Motion blur undone by a Wiener filter along the rows.
//!
//! A lamp that moves by L pixels while a row is exposed is blurred by a box of that length, with
//! frequency response H(f) = sin(pi f L)/(pi f L). The filter with the least mean square error for
//! a noise-to-signal power ratio k is H/(H^2 + k) (N. Wiener 1949). It is symmetric, so it
//! sharpens an edge without moving it.
//!
//! The filter runs along rows only. A rolling shutter exposes neighbouring rows at other times,
//! with the lamp on in one and off in the next: filtering across rows would mix the stripes, and
//! there is nothing to gain, because a row never saw the light that fell on its neighbour.
//!
//! It is linear and therefore wrong where the sensor saturates; there it does no harm, since the
//! edge is found at half of the plateau on both sides alike.

use super::patch::Patch;
use std::f64::consts::{PI, TAU};

/// Longest half of a filter. A box has zeros in its response, about which the inverse rings on for
/// many lengths: cut off at 3 of them it does more harm than the blur.
const MAX_HALF: usize = 64;
/// Frequencies over which the response is inverted.
const FREQUENCIES: usize = 256;

/// A filter.
#[derive(Debug, Default)]
pub struct Wiener {
    /// Middle and one side: the filter is symmetric.
    taps: Vec<f64>,
    length_px: f64,
    noise_to_signal: f64,
}

impl Wiener {
    /// Makes the filter for a smear; the last one is kept where it differs by less than 0.02 px.
    pub fn prepare(&mut self, length_px: f64, noise_to_signal: f64) {
        let same = (length_px - self.length_px).abs() < 0.02
            && (noise_to_signal - self.noise_to_signal).abs() < 1e-12;
        if same && !self.taps.is_empty() {
            return;
        }
        (self.length_px, self.noise_to_signal) = (length_px, noise_to_signal);
        let half = ((12.0 * length_px).ceil() as usize + 8).min(MAX_HALF);
        let response = |f: f64| {
            let x = PI * f * length_px;
            let h = if x < 1e-9 { 1.0 } else { x.sin() / x };
            h / (h * h + noise_to_signal)
        };
        self.taps.clear();
        self.taps.extend((0..=half).map(|n| {
            let sum: f64 = (0..FREQUENCIES)
                .map(|k| (k as f64 + 0.5) / (2.0 * FREQUENCIES as f64))
                .map(|f| response(f) * (TAU * f * n as f64).cos())
                .sum();
            sum / FREQUENCIES as f64
        }));
        // An even plane stays as it is.
        let total = self.taps[0] + 2.0 * self.taps[1..].iter().sum::<f64>();
        self.taps.iter_mut().for_each(|t| *t /= total);
    }

    /// Filters every row of a patch in place; rows go on beyond the border as they end.
    pub fn apply(&self, patch: &mut Patch) {
        let w = patch.width;
        if w == 0 || self.taps.is_empty() {
            return;
        }
        for v in 0..patch.height {
            let row = patch.row_mut(v);
            let line: Vec<f64> = row.iter().map(|&g| f64::from(g)).collect();
            for (u, pixel) in row.iter_mut().enumerate() {
                let mut sum = self.taps[0] * line[u];
                for (n, tap) in self.taps.iter().enumerate().skip(1) {
                    sum += tap * (line[u.saturating_sub(n)] + line[(u + n).min(w - 1)]);
                }
                *pixel = sum.round().clamp(0.0, 255.0) as u8;
            }
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    /// A lamp's row with edges at 40.3 and 71.8, blurred by a box.
    fn blurred(length: f64) -> Vec<u8> {
        let lit = |u: f64| 20.0 + 150.0 * f64::from(u8::from((40.3..71.8).contains(&u)));
        let share = |k: i32| (f64::from(k) + 0.5) / 60.0 - 0.5;
        let pixel = |u: f64| (0..60).map(|k| lit(u + share(k))).sum::<f64>() / 60.0;
        let mean = |u: f64| (0..60).map(|k| pixel(u + length * share(k))).sum::<f64>() / 60.0;
        (0..110).map(|u| mean(f64::from(u)).round() as u8).collect()
    }

    /// The filter must come near the sharp row and not move the middle.
    #[test]
    fn a_known_blur_is_undone() {
        let sharp = blurred(0.0);
        for length in [1.5, 3.0, 5.0] {
            let row = blurred(length);
            let mut patch = Patch::from_data(0, 0, row.len(), 1, row.clone());
            let mut wiener = Wiener::default();
            wiener.prepare(length, 0.003);
            wiener.apply(&mut patch);
            let middle = |row: &[u8]| {
                let weights = row.iter().map(|&g| f64::from(g) - 20.0);
                let sum: f64 = weights.clone().sum();
                weights.enumerate().map(|(u, g)| u as f64 * g).sum::<f64>() / sum
            };
            assert!((middle(&patch.data) - 56.05).abs() < 0.1);
            let squares = |row: &[u8]| -> i32 {
                let pairs = row.iter().zip(&sharp);
                pairs
                    .map(|(&a, &b)| (i32::from(a) - i32::from(b)).pow(2))
                    .sum()
            };
            let (before, after) = (squares(&row), squares(&patch.data));
            assert!(4 * after < before, "{length} px: {before} to {after}");
        }
    }

    #[test]
    fn an_even_plane_stays() {
        let mut patch = Patch::from_data(0, 0, 30, 2, vec![117; 60]);
        let mut wiener = Wiener::default();
        wiener.prepare(3.3, 0.01);
        wiener.apply(&mut patch);
        assert!(patch.data.iter().all(|&g| g == 117));
    }
}
