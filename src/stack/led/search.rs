//! Where in an image something shines: a search on a coarse grid.
//!
//! Every fourth pixel of every fourth row is read. A lamp covers some dozens of such pixels, and
//! 94 % of the image is never touched. Otsu's split of the grid's histogram gives the level of
//! darkness; lit grid points are joined across the dark stripes between them.

use super::otsu::otsu;
use crate::bus::{Blob, PixelBox};
use crate::stack::runs::Runs;
use image::GrayImage;

/// Grid spacing.
const STEP: u32 = 4;
/// Fewer lit grid points than this are no lamp.
const MIN_LIT: u32 = 3;
/// A frame with a larger lit share is no picture of lamps in a tunnel.
const MAX_LIT_SHARE: f64 = 0.25;
/// No more regions than this are looked at, the largest first.
const MAX_REGIONS: usize = 6;

/// Where it shines in an image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Search {
    /// Bounds of the lit regions, to a grid point, largest first.
    pub regions: Vec<PixelBox>,
    /// Grey level of darkness.
    pub black: f64,
}

impl Search {
    /// What stands out of darkness by `min_contrast_grey`, joined across up to `gap_rows` dark rows.
    pub fn of(image: &GrayImage, min_contrast_grey: f64, gap_rows: usize) -> Self {
        let step = STEP as usize;
        let rows = image.as_raw().chunks_exact(image.width().max(1) as usize);
        let grid: Vec<u8> = rows
            .step_by(step)
            .flat_map(|row| row.iter().step_by(step).copied())
            .collect();
        let mut counts = [0u32; 256];
        for &grey in &grid {
            counts[usize::from(grey)] += 1;
        }
        let Some(split) = otsu(&counts) else {
            return Self {
                regions: Vec::new(),
                black: grid.first().map_or(0.0, |&grey| f64::from(grey)),
            };
        };
        let mut found = Self {
            regions: Vec::new(),
            black: split.dark_mean,
        };
        if split.bright_mean - split.dark_mean < min_contrast_grey {
            return found;
        }
        // A dim lamp beside a bright one lies under the split: all that stands out of darkness
        // counts.
        let limit = f64::from(split.threshold).min(split.dark_mean + min_contrast_grey);
        let lit: Vec<u8> = (grid.iter().map(|&grey| u8::from(f64::from(grey) > limit))).collect();
        let lit_points = lit.iter().filter(|&&lit| lit != 0).count();
        if lit_points as f64 > MAX_LIT_SHARE * lit.len() as f64 {
            return found;
        }
        let columns = image.width().div_ceil(STEP) as usize;
        let blobs = Runs::new(&lit, columns, gap_rows.div_ceil(step), |_| true).blobs();
        let mut blobs: Vec<Blob> = blobs.into_values().collect();
        blobs.retain(|blob| blob.area_px >= MIN_LIT);
        blobs.sort_by_key(|blob| std::cmp::Reverse(blob.area_px));
        let largest = blobs.iter().take(MAX_REGIONS);
        found.regions = largest.map(|blob| in_pixels(&blob.bounds)).collect();
        found
    }
}

/// Bounds given in grid points.
fn in_pixels(grid: &PixelBox) -> PixelBox {
    PixelBox {
        u0: grid.u0 * STEP,
        v0: grid.v0 * STEP,
        u1: grid.u1 * STEP,
        v1: grid.v1 * STEP,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use image::Luma;

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
        let found = Search::of(&image, 15.0, 9).regions;
        assert_eq!(found.len(), 2, "{found:?}");
        let inside = |b: &PixelBox| b.u0 <= 200 && b.u1 >= 236 && b.v0 <= 104 && b.v1 >= 156;
        assert!(found.iter().any(inside), "{found:?}");
    }

    /// Noise, an even picture, a lit hall and an empty image have no lamps.
    #[test]
    fn nothing_bright_gives_nothing() {
        let noise = GrayImage::from_fn(320, 180, |u, v| Luma([(u * 31 + v * 17) as u8 % 9]));
        let hall = GrayImage::from_fn(320, 180, |u, _| Luma([if u > 100 { 200 } else { 3 }]));
        let even = GrayImage::from_pixel(320, 180, Luma([200]));
        for image in [noise, hall, even, GrayImage::new(0, 0)] {
            assert_eq!(Search::of(&image, 15.0, 9).regions, []);
        }
    }
}
