//! Parts of textures in a buffer, one after the other: on their way to memory, or from there.

use super::adapter::Gpu;
use super::rectangle::Rectangle;
use super::texture::Texture;
use super::upload::empty_buffer;
use std::ops::Range;

/// Pieces begin at multiples of this.
const ALIGNMENT: u64 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as u64;

/// Sizes of buffers are multiples of this, so that a picture with more parts than the last one finds room.
const ROOM: u64 = 1 << 20;

/// A part of a texture in a buffer.
#[derive(Clone, Copy)]
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
        bytes[self.bytes(v)].as_chunks().0
    }

    /// Where they lie in the buffer.
    #[inline(always)]
    fn bytes(&self, v: u32) -> Range<usize> {
        let row = u64::from(v - self.part.at[1]) * u64::from(self.stride);
        let first = (self.offset + row) as usize;
        first..first + 2 * (self.words_a_texel * self.part.size[0]) as usize
    }

    /// Whether row `v` of the texture is in it.
    pub fn has_row(&self, v: u32) -> bool {
        (self.part.at[1]..self.part.ends()[1]).contains(&v)
    }
}

/// Where pieces are to lie in a buffer.
#[derive(Default)]
pub struct Pieces<'t> {
    copies: Vec<(&'t Texture, Piece)>,
    size: u64,
}

impl<'t> Pieces<'t> {
    /// Room for one of a texture with so many 16-bit words a texel.
    pub fn add(&mut self, texture: &'t Texture, part: Rectangle, words_a_texel: u32) -> Piece {
        let piece = Piece::after(self.size, part, words_a_texel);
        self.copies.push((texture, piece));
        self.size = piece.end();
        piece
    }

    /// Bytes of all of them.
    pub fn size(&self) -> u64 {
        self.size
    }

    /// Copies all of them, into the smallest of the free buffers that are large enough. If none is, one of
    /// them is dropped and a larger one made.
    pub fn copy(
        self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        free: &mut Vec<wgpu::Buffer>,
    ) -> wgpu::Buffer {
        let enough = (free.iter().enumerate())
            .filter(|(_, buffer)| buffer.size() >= self.size)
            .min_by_key(|(_, buffer)| buffer.size());
        let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
        let buffer = match enough {
            Some((at, _)) => free.swap_remove(at),
            None => {
                free.pop();
                empty_buffer(device, self.size.max(1).next_multiple_of(ROOM), usage)
            }
        };
        for (texture, piece) in self.copies {
            let to = (piece.offset, piece.stride);
            texture.copy_part_to_buffer(piece.part, &buffer, to, encoder);
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
    pub fn new(gpu: &Gpu, parts: &[Rectangle], fill: impl Fn(u32, u32, &mut [u16])) -> Self {
        let mut end = 0;
        let pieces = parts.iter().map(|part| {
            let piece = Piece::after(end, *part, 1);
            end = piece.end();
            piece
        });
        let pieces: Vec<Piece> = pieces.collect();
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: end.max(ALIGNMENT),
            usage: wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: true,
        });
        // A device that cannot map it has failed, which is found out when the job is submitted.
        if let Ok(mut bytes) = buffer.get_mapped_range_mut(..) {
            let widest = parts.iter().map(|part| part.size[0]).max().unwrap_or(0);
            let mut row = vec![0; widest as usize];
            for piece in &pieces {
                let row = &mut row[..piece.part.size[0] as usize];
                for v in piece.part.at[1]..piece.part.ends()[1] {
                    fill(piece.part.at[0], v, row);
                    let words: &[u8] = bytemuck::cast_slice(row);
                    bytes.slice(piece.bytes(v)).copy_from_slice(words);
                }
            }
        }
        buffer.unmap();
        Self { buffer, pieces }
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
