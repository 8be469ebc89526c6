//! 3x3 median filter.
//!
//! The median of nine is the middle one of (largest of the columns' minima, middle of their
//! middles, smallest of their maxima), so every column is sorted once for three windows, and the
//! inner loops have no branches.

use super::patch::Patch;

/// Buffers of [`median3`], kept from call to call.
#[derive(Debug, Default)]
pub struct MedianScratch {
    low: Vec<u8>,
    mid: Vec<u8>,
    high: Vec<u8>,
}

/// Median of every pixel's 3x3 neighbourhood; the border is repeated outwards.
pub fn median3(source: &Patch, out: &mut Patch, scratch: &mut MedianScratch) {
    let (w, h) = (source.width, source.height);
    out.reshape_like(source);
    if w == 0 || h == 0 {
        return;
    }
    for buffer in [&mut scratch.low, &mut scratch.mid, &mut scratch.high] {
        buffer.clear();
        buffer.resize(w + 2, 0);
    }
    for v in 0..h {
        let above = source.row(v.saturating_sub(1));
        let here = source.row(v);
        let below = source.row((v + 1).min(h - 1));
        let columns = above.iter().zip(here).zip(below);
        for (u, ((&a, &b), &c)) in columns.enumerate() {
            let (low, high) = (a.min(b), a.max(b));
            scratch.low[u + 1] = low.min(c);
            scratch.mid[u + 1] = low.max(high.min(c));
            scratch.high[u + 1] = high.max(c);
        }
        for buffer in [&mut scratch.low, &mut scratch.mid, &mut scratch.high] {
            buffer[0] = buffer[1];
            buffer[w + 1] = buffer[w];
        }
        let windows = scratch
            .low
            .windows(3)
            .zip(scratch.mid.windows(3))
            .zip(scratch.high.windows(3));
        for (pixel, ((l, m), g)) in out.row_mut(v).iter_mut().zip(windows) {
            let a = l[0].max(l[1]).max(l[2]);
            let b = middle(m[0], m[1], m[2]);
            let c = g[0].min(g[1]).min(g[2]);
            *pixel = middle(a, b, c);
        }
    }
}

fn middle(a: u8, b: u8, c: u8) -> u8 {
    a.min(b).max(a.max(b).min(c))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::stack::led::testing::SplitMix64;

    /// Sorts every neighbourhood.
    fn slow(source: &Patch) -> Vec<u8> {
        let (w, h) = (source.width as i64, source.height as i64);
        let mut out = Vec::new();
        for v in 0..h {
            for u in 0..w {
                let mut nine = Vec::new();
                for dv in -1..=1 {
                    for du in -1..=1 {
                        let row = source.row((v + dv).clamp(0, h - 1) as usize);
                        nine.push(row[(u + du).clamp(0, w - 1) as usize]);
                    }
                }
                nine.sort_unstable();
                out.push(nine[4]);
            }
        }
        out
    }

    /// Fails on a wrong sorting step or a wrong border.
    #[test]
    fn equals_sorting_on_random_images() {
        let mut noise = SplitMix64::new(7);
        let mut scratch = MedianScratch::default();
        let mut out = Patch::default();
        for (w, h) in [(1, 1), (1, 5), (5, 1), (2, 2), (17, 9), (40, 33)] {
            let data = (0..w * h)
                .map(|_| (noise.uniform() * 256.0) as u8)
                .collect();
            let source = Patch::from_data(0, 0, w, h, data);
            median3(&source, &mut out, &mut scratch);
            assert_eq!(out.data, slow(&source), "{w} x {h}");
        }
    }
}
