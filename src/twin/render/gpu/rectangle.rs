//! Parts of a picture.

use nalgebra::Point2;

/// Added to the bounds of what is in it.
const MARGIN_PX: f64 = 2.0;

/// Part of a picture: upper left corner, width and height, pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rectangle {
    pub at: [u32; 2],
    pub size: [u32; 2],
}

impl Rectangle {
    /// All of a picture.
    pub fn whole(size_px: [u32; 2]) -> Self {
        Self {
            at: [0, 0],
            size: size_px,
        }
    }

    /// The pixels of a picture between two corners.
    pub fn between(low: Point2<f64>, high: Point2<f64>, size_px: [u32; 2]) -> Self {
        let ends = [0, 1].map(|k| {
            let size = f64::from(size_px[k]);
            let low = (low[k] - MARGIN_PX).floor().clamp(0.0, size);
            let high = (high[k] + MARGIN_PX).ceil().clamp(0.0, size);
            (low as u32, (high.max(low) - low) as u32)
        });
        Self {
            at: ends.map(|(at, _)| at),
            size: ends.map(|(_, size)| size),
        }
    }

    /// Whether nothing is in it.
    pub fn is_empty(&self) -> bool {
        self.size.contains(&0)
    }

    /// Pixels.
    pub fn area(&self) -> u32 {
        self.size[0] * self.size[1]
    }

    /// After the last column and row.
    pub fn ends(&self) -> [u32; 2] {
        [0, 1].map(|k| self.at[k] + self.size[k])
    }

    /// The least that holds both.
    pub fn around(&self, other: &Self) -> Self {
        let at = [0, 1].map(|k| self.at[k].min(other.at[k]));
        let (ends, others) = (self.ends(), other.ends());
        Self {
            at,
            size: [0, 1].map(|k| ends[k].max(others[k]) - at[k]),
        }
    }

    /// What is in both.
    pub fn overlap(&self, other: &Self) -> Self {
        let (ends, others) = (self.ends(), other.ends());
        let at = [0, 1].map(|k| self.at[k].max(other.at[k]));
        Self {
            at,
            size: [0, 1].map(|k| ends[k].min(others[k]).saturating_sub(at[k])),
        }
    }

    /// Lets a pass draw nothing else.
    pub fn clip(&self, pass: &mut wgpu::RenderPass<'_>) {
        let ([x, y], [width, height]) = (self.at, self.size);
        pass.set_scissor_rect(x, y, width, height);
    }
}
