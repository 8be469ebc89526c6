//! Where in an image something shines: a search on a coarse grid.
//!
//! Every fourth pixel of every fourth row is read. A lamp covers some dozens of such pixels, and
//! 94 % of the image is never touched. Otsu's split of the grid's histogram gives the level of
//! darkness; lit grid points are joined across the dark stripes between them.

use super::otsu::otsu;
use crate::bus::PixelBox;
use image::GrayImage;

/// Grid spacing.
const STEP: usize = 4;
/// Fewer lit grid points than this are no lamp.
const MIN_LIT: u32 = 3;
/// A frame with a larger lit share is no picture of lamps in a tunnel.
const MAX_LIT_SHARE: f64 = 0.25;
/// No more regions than this are looked at, the largest first.
pub const MAX_REGIONS: usize = 6;

/// How a region is recognised.
#[derive(Clone, Copy, Debug)]
pub struct SearchSettings {
    /// Over the darkness by this much.
    pub min_contrast_grey: f64,
    /// Dark rows that may lie between two lit ones of a lamp.
    pub gap_rows: usize,
    /// Rows and columns added around a region.
    pub margin_px: u32,
}

/// Buffers of [`find_regions`], kept from call to call.
#[derive(Debug, Default)]
pub struct SearchScratch {
    lit: Vec<bool>,
    stack: Vec<(usize, usize)>,
    found: Vec<(u32, PixelBox)>,
}

/// Bounds of the lit regions, largest first, and the grey level of darkness.
pub fn find_regions(
    image: &GrayImage,
    settings: &SearchSettings,
    scratch: &mut SearchScratch,
    regions: &mut Vec<PixelBox>,
) -> f64 {
    regions.clear();
    let (w, h) = (image.width() as usize, image.height() as usize);
    let (columns, rows) = (w.div_ceil(STEP), h.div_ceil(STEP));
    if w == 0 || h == 0 {
        return 0.0;
    }
    let grid = || {
        let rows = image.as_raw().chunks_exact(w).step_by(STEP);
        rows.flat_map(|row| row.iter().step_by(STEP))
    };
    let mut counts = [0u32; 256];
    for &grey in grid() {
        counts[usize::from(grey)] += 1;
    }
    let Some(split) = otsu(&counts) else {
        return f64::from(image.as_raw()[0]);
    };
    if split.bright_mean - split.dark_mean < settings.min_contrast_grey {
        return split.dark_mean;
    }
    // A dim lamp beside a bright one lies under the split: all that stands out of darkness counts.
    let limit = f64::from(split.threshold).min(split.dark_mean + settings.min_contrast_grey);
    scratch.lit.clear();
    scratch
        .lit
        .extend(grid().map(|&grey| f64::from(grey) > limit));
    let lit = scratch.lit.iter().filter(|&&lit| lit).count();
    if lit as f64 > MAX_LIT_SHARE * scratch.lit.len() as f64 {
        return split.dark_mean;
    }
    scratch.found.clear();
    let reach = (1, settings.gap_rows.div_ceil(STEP) + 1);
    for k in 0..scratch.lit.len() {
        if scratch.lit[k] {
            let start = (k % columns, k / columns);
            let (count, bounds) = flood(scratch, start, (columns, rows), reach);
            if count >= MIN_LIT {
                scratch.found.push((count, bounds));
            }
        }
    }
    scratch
        .found
        .sort_by_key(|&(count, _)| std::cmp::Reverse(count));
    let (right, bottom) = (image.width() - 1, image.height() - 1);
    let margin = settings.margin_px;
    regions.extend(
        scratch
            .found
            .iter()
            .take(MAX_REGIONS)
            .map(|(_, b)| PixelBox {
                u0: b.u0.saturating_sub(margin),
                v0: b.v0.saturating_sub(margin),
                u1: (b.u1 + margin).min(right),
                v1: (b.v1 + margin).min(bottom),
            }),
    );
    split.dark_mean
}

/// Takes all lit points within reach of `start`, one after the other, out of the grid.
fn flood(
    scratch: &mut SearchScratch,
    start: (usize, usize),
    (columns, rows): (usize, usize),
    (du, dv): (usize, usize),
) -> (u32, PixelBox) {
    let (mut count, mut low, mut high) = (0, start, start);
    scratch.lit[start.1 * columns + start.0] = false;
    scratch.stack.clear();
    scratch.stack.push(start);
    while let Some((u, v)) = scratch.stack.pop() {
        count += 1;
        low = (low.0.min(u), low.1.min(v));
        high = (high.0.max(u), high.1.max(v));
        for v in v.saturating_sub(dv)..(v + dv + 1).min(rows) {
            for u in u.saturating_sub(du)..(u + du + 1).min(columns) {
                if std::mem::take(&mut scratch.lit[v * columns + u]) {
                    scratch.stack.push((u, v));
                }
            }
        }
    }
    let px = |k: usize| (k * STEP) as u32;
    let bounds = PixelBox {
        u0: px(low.0),
        v0: px(low.1),
        u1: px(high.0),
        v1: px(high.1),
    };
    (count, bounds)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use image::Luma;

    const SETTINGS: SearchSettings = SearchSettings {
        min_contrast_grey: 15.0,
        gap_rows: 9,
        margin_px: 12,
    };

    fn search(image: &GrayImage) -> Vec<PixelBox> {
        let mut regions = Vec::new();
        find_regions(
            image,
            &SETTINGS,
            &mut SearchScratch::default(),
            &mut regions,
        );
        regions
    }

    /// Stripes with gaps of nine rows are one lamp, another lamp far off is a second.
    #[test]
    fn stripes_are_one_region_and_lamps_are_two() {
        let mut image =
            GrayImage::from_fn(640, 360, |u, v| Luma([4 + ((u * 7 + v * 13) % 3) as u8]));
        for v in 100..160 {
            for u in 200..240 {
                if v % 13 < 4 {
                    image.put_pixel(u, v, Luma([90]));
                }
                image.put_pixel(u + 200, v / 2, Luma([255]));
            }
        }
        let found = search(&image);
        assert_eq!(found.len(), 2, "{found:?}");
        let inside = |b: &PixelBox| b.u0 <= 200 && b.u1 >= 239 && b.v0 <= 104 && b.v1 >= 159;
        assert!(found.iter().any(inside), "{found:?}");
    }

    /// Noise, an even picture, a lit hall and an empty image have no lamps.
    #[test]
    fn nothing_bright_gives_nothing() {
        let noise = GrayImage::from_fn(320, 180, |u, v| Luma([(u * 31 + v * 17) as u8 % 9]));
        let hall = GrayImage::from_fn(320, 180, |u, _| Luma([if u > 100 { 200 } else { 3 }]));
        let even = GrayImage::from_pixel(320, 180, Luma([200]));
        for image in [noise, hall, even, GrayImage::new(0, 0)] {
            assert_eq!(search(&image), []);
        }
    }
}
