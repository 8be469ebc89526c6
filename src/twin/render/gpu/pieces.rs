//! Parts of textures in a buffer, one after the other: on their way to memory, or from there.

use super::adapter::Gpu;
use super::rectangle::Rectangle;
use super::texture::Texture;
use super::upload::empty_buffer;
use rayon::prelude::*;

/// Pieces begin at multiples of this.
const ALIGNMENT: u64 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as u64;

/// A part of a texture in a buffer.
pub struct Piece {
    pub part: Rectangle,
    offset: u64,
    stride: u32,
    words_a_texel: u32,
}

impl Piece {
    /// One that begins so far from the buffer's begin.
    fn after(offset: u64, part: Rectangle, words_a_texel: u32) -> Self {
        Self {
            part,
            offset,
            stride: (2 * words_a_texel * part.size[0]).next_multiple_of(ALIGNMENT as u32),
            words_a_texel,
        }
    }

    /// Where the next one begins.
    fn end(&self) -> u64 {
        self.offset + u64::from(self.stride) * u64::from(self.part.size[1])
    }

    /// The 16-bit words of row `v` of the texture.
    #[inline(always)]
    pub fn row<'b>(&self, bytes: &'b [u8], v: u32) -> &'b [[u8; 2]] {
        let row = u64::from(v - self.part.at[1]) * u64::from(self.stride);
        let length = 2 * (self.words_a_texel * self.part.size[0]) as usize;
        let bytes = &bytes[(self.offset + row) as usize..][..length];
        bytes.as_chunks().0
    }

    /// Whether row `v` of the texture is in it.
    pub fn has_row(&self, v: u32) -> bool {
        (self.part.at[1]..self.part.ends()[1]).contains(&v)
    }
}

/// Where pieces are to lie in a buffer.
#[derive(Default)]
pub struct Pieces<'t> {
    copies: Vec<(&'t Texture, Rectangle, u64, u32)>,
    size: u64,
}

impl<'t> Pieces<'t> {
    /// Room for one of a texture with so many 16-bit words a texel.
    pub fn add(&mut self, texture: &'t Texture, part: Rectangle, words_a_texel: u32) -> Piece {
        let piece = Piece::after(self.size, part, words_a_texel);
        self.copies
            .push((texture, part, piece.offset, piece.stride));
        self.size = piece.end();
        piece
    }

    /// Copies all of them, into one of the buffers that are free if it is large enough.
    pub fn copy(
        self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        free: &mut Vec<wgpu::Buffer>,
    ) -> wgpu::Buffer {
        let enough = free.iter().position(|buffer| buffer.size() >= self.size);
        let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
        let buffer = enough.map_or_else(
            || empty_buffer(device, self.size.max(ALIGNMENT), usage),
            |at| free.swap_remove(at),
        );
        for (texture, part, offset, stride) in self.copies {
            texture.copy_part_to_buffer(part, &buffer, (offset, stride), encoder);
        }
        buffer
    }
}

/// Parts of a picture of half-precision numbers on their way to textures.
pub struct Uploaded {
    buffer: wgpu::Buffer,
    pieces: Vec<Piece>,
}

impl Uploaded {
    /// With `fill` to write a row's numbers, from a column on.
    pub fn new(gpu: &Gpu, parts: &[Rectangle], fill: impl Fn(u32, u32, &mut [u16]) + Sync) -> Self {
        let mut end = 0;
        let pieces = parts.iter().map(|part| {
            let piece = Piece::after(end, *part, 1);
            end = piece.end();
            piece
        });
        let pieces: Vec<Piece> = pieces.collect();
        let mut words = vec![0; end as usize / 2];
        let (mut rows, mut rest) = (Vec::new(), &mut words[..]);
        for piece in &pieces {
            for v in piece.part.at[1]..piece.part.ends()[1] {
                let row;
                (row, rest) = rest.split_at_mut(piece.stride as usize / 2);
                rows.push((piece.part.at[0], v, &mut row[..piece.part.size[0] as usize]));
            }
        }
        rows.into_par_iter().for_each(|(u, v, row)| fill(u, v, row));
        Self {
            buffer: gpu.upload(wgpu::BufferUsages::COPY_SRC, &words, ALIGNMENT as usize),
            pieces,
        }
    }

    /// Copies them into a texture.
    pub fn copy_to(&self, texture: &Texture, encoder: &mut wgpu::CommandEncoder) {
        for piece in &self.pieces {
            let from = (piece.offset, piece.stride);
            texture.copy_part_from_buffer(piece.part, &self.buffer, from, encoder);
        }
    }
}

/// A non-negative number below 65520 in half precision, rounded to the nearest. What is smaller than 2^-14, where
/// half precision has fewer bits, is 0.
#[inline(always)]
pub fn narrow(number: f32) -> u16 {
    let bits = number.to_bits();
    let even = bits >> 13 & 1;
    let half = ((bits + 0xfff + even) >> 13).saturating_sub(112 << 10);
    if half < 1 << 10 { 0 } else { half as u16 }
}

/// A non-negative number in half precision. What is infinite there is 65536.
#[inline(always)]
pub fn widen(half: u16) -> f32 {
    // The exponent counts from 15 there, from 127 here: times 2^112.
    f32::from_bits(u32::from(half & 0x7fff) << 13) * f32::from_bits((112 + 127) << 23)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wrong exponent, or small numbers lost.
    #[test]
    fn halves_keep_their_value() {
        for (half, value) in [
            (0, 0.0),
            (1, 5.960_464_5e-8),
            (0x03ff, 6.097_555e-5),
            (0x3c00, 1.0),
            (0x3555, 0.333_251_95),
            (0x7bff, 65_504.0),
            (0x7c00, 65_536.0),
        ] {
            assert!((widen(half) / f32::max(value, 1e-30) - 1.0).abs() < 1e-6 || value <= 0.0);
        }
        assert!(widen(0).abs() < 1e-30);
    }

    /// Rounding down, or away from the even one; an exponent that is one off.
    #[test]
    fn numbers_go_to_the_nearest_half() {
        for half in 0x0400..0x7bff_u16 {
            assert_eq!(narrow(widen(half)), half);
            let (here, next) = (widen(half), widen(half + 1));
            let even = half + half % 2;
            assert_eq!(narrow(0.5 * (here + next)), even);
            assert_eq!(narrow(here + 0.49 * (next - here)), half);
            assert_eq!(narrow(here + 0.51 * (next - here)), half + 1);
        }
        assert_eq!([0.0, 1e-9, 65_504.0].map(narrow), [0, 0, 0x7bff]);
    }
}
