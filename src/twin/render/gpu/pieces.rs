//! Parts of textures on their way back to memory, one after the other in a buffer.

use super::rectangle::Rectangle;
use super::texture::Texture;
use super::upload::empty_buffer;

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
        let stride = (2 * words_a_texel * part.size[0]).next_multiple_of(ALIGNMENT as u32);
        let offset = self.size;
        self.copies.push((texture, part, offset, stride));
        self.size += u64::from(stride) * u64::from(part.size[1]);
        Piece {
            part,
            offset,
            stride,
            words_a_texel,
        }
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
}
