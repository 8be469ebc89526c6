//! A rectangle cut out of an image.

use crate::bus::PixelBox;
use image::GrayImage;

/// Pixels of a rectangle of an image, with its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    /// Image column of the patch's left one.
    pub u0: usize,
    /// Image row of the patch's top one.
    pub v0: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Grey, row by row.
    pub data: Vec<u8>,
}

impl Patch {
    /// From its parts; `data` must hold `width * height` values.
    #[cfg(test)]
    pub fn from_data(u0: usize, v0: usize, width: usize, height: usize, data: Vec<u8>) -> Self {
        assert_eq!(data.len(), width * height);
        Self {
            u0,
            v0,
            width,
            height,
            data,
        }
    }

    /// The pixels of `bounds`, as far as the image has them.
    pub fn cut(image: &GrayImage, bounds: &PixelBox) -> Self {
        let (w, h) = (image.width() as usize, image.height() as usize);
        let u0 = (bounds.u0 as usize).min(w);
        let v0 = (bounds.v0 as usize).min(h);
        let width = (bounds.u1 as usize + 1).min(w).saturating_sub(u0);
        let height = (bounds.v1 as usize + 1).min(h).saturating_sub(v0);
        let rows = image.as_raw().chunks_exact(w.max(1)).skip(v0).take(height);
        Self {
            u0,
            v0,
            width,
            height,
            data: rows.flat_map(|row| &row[u0..u0 + width]).copied().collect(),
        }
    }

    /// Pixels of row `v` of the patch.
    pub fn row(&self, v: usize) -> &[u8] {
        &self.data[v * self.width..(v + 1) * self.width]
    }

    /// The same, to write.
    pub fn row_mut(&mut self, v: usize) -> &mut [u8] {
        &mut self.data[v * self.width..(v + 1) * self.width]
    }

    /// How often each grey level occurs.
    pub fn histogram(&self) -> [u32; 256] {
        let mut counts = [0; 256];
        for &grey in &self.data {
            counts[usize::from(grey)] += 1;
        }
        counts
    }
}
