//! Stand-in.
use crate::track::CrossSection;
use crate::twin::random::pcg4d;

/// Metres of line after which a painting repeats.
pub const PERIOD_M: f64 = 60.0;
/// Side of a texel.
pub const TEXEL_M: f64 = 1.0 / 64.0;

/// Albedo over (s, q), with mip levels.
#[derive(Clone, Debug)]
pub struct Painting {
    /// Texels along the line.
    pub width: u32,
    /// Texels along the outline.
    pub height: u32,
    /// Full size first.
    pub levels: Vec<Vec<u8>>,
}

impl Painting {
    /// One texel, black.
    pub fn blank() -> Self {
        Self {
            width: 1,
            height: 1,
            levels: vec![vec![0]],
        }
    }

    /// Paints.
    pub fn of(section: &CrossSection) -> Self {
        let q: f64 = section.edges().map(|e| e.length_m()).sum();
        let (width, height) = (3840u32, (q / TEXEL_M).ceil() as u32);
        let mut levels = vec![
            (0..width * height)
                .map(|k| 60 + (pcg4d([k / width / 8, k % width / 8, 0, 0])[0] >> 27) as u8)
                .collect::<Vec<u8>>(),
        ];
        let (mut w, mut h) = (width, height);
        while w > 1 && h > 1 {
            let last = &levels[levels.len() - 1];
            let (nw, nh) = (w / 2, h / 2);
            let mut next = Vec::new();
            for j in 0..nh {
                for i in 0..nw {
                    let at =
                        |a: u32, b: u32| u32::from(last[((2 * j + b) * w + 2 * i + a) as usize]);
                    next.push(((at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1) + 2) / 4) as u8);
                }
            }
            levels.push(next);
            (w, h) = (nw, nh);
        }
        Self {
            width,
            height,
            levels,
        }
    }
}
