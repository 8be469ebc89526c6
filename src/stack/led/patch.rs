//! A rectangle cut out of an image.

use crate::bus::PixelBox;
use image::GrayImage;

/// Pixels of a rectangle of an image, with its place.
#[derive(Clone, Debug, Default, PartialEq)]
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

    /// Takes the pixels of `bounds`, as far as the image has them.
    pub fn cut(&mut self, image: &GrayImage, bounds: &PixelBox) {
        let (w, h) = (image.width() as usize, image.height() as usize);
        self.u0 = (bounds.u0 as usize).min(w);
        self.v0 = (bounds.v0 as usize).min(h);
        self.width = (bounds.u1 as usize + 1).min(w).saturating_sub(self.u0);
        self.height = (bounds.v1 as usize + 1).min(h).saturating_sub(self.v0);
        self.data.clear();
        if self.width == 0 {
            return;
        }
        let rows = image.as_raw().chunks_exact(w);
        for row in rows.skip(self.v0).take(self.height) {
            self.data
                .extend_from_slice(&row[self.u0..self.u0 + self.width]);
        }
    }

    /// Takes the place and size of another, all black.
    pub fn reshape_like(&mut self, other: &Self) {
        (self.u0, self.v0) = (other.u0, other.v0);
        (self.width, self.height) = (other.width, other.height);
        self.data.clear();
        self.data.resize(other.data.len(), 0);
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
