//! 3x3 median filter.
//!
//! The median of nine is the middle one of (largest of the columns' minima, middle of their
//! middles, smallest of their maxima), so every column is sorted once for three windows, and the
//! inner loops have no branches.

use super::patch::Patch;

/// Median of every pixel's 3x3 neighbourhood; the border is repeated outwards.
pub fn median3(source: &Patch) -> Patch {
    let (w, h) = (source.width, source.height);
    let mut out = source.clone();
    if w == 0 || h == 0 {
        return out;
    }
    // Each with the border repeated on both sides.
    let [mut low, mut mid, mut high] = [(); 3].map(|()| vec![0; w + 2]);
    for v in 0..h {
        let above = source.row(v.saturating_sub(1));
        let here = source.row(v);
        let below = source.row((v + 1).min(h - 1));
        let columns = above.iter().zip(here).zip(below);
        for (u, ((&a, &b), &c)) in columns.enumerate() {
            let (least, most) = (a.min(b), a.max(b));
            low[u + 1] = least.min(c);
            mid[u + 1] = least.max(most.min(c));
            high[u + 1] = most.max(c);
        }
        for buffer in [&mut low, &mut mid, &mut high] {
            buffer[0] = buffer[1];
            buffer[w + 1] = buffer[w];
        }
        let windows = low.windows(3).zip(mid.windows(3)).zip(high.windows(3));
        for (pixel, ((l, m), g)) in out.row_mut(v).iter_mut().zip(windows) {
            let a = l[0].max(l[1]).max(l[2]);
            let b = middle(m[0], m[1], m[2]);
            let c = g[0].min(g[1]).min(g[2]);
            *pixel = middle(a, b, c);
        }
    }
    out
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
        for (w, h) in [(1, 1), (1, 5), (5, 1), (2, 2), (17, 9), (40, 33)] {
            let data = (0..w * h)
                .map(|_| (noise.uniform() * 256.0) as u8)
                .collect();
            let source = Patch::from_data(0, 0, w, h, data);
            assert_eq!(median3(&source).data, slow(&source), "{w} x {h}");
        }
    }
}
