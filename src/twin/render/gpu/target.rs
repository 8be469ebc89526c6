//! What the passes draw into, and the way back to memory.

use super::adapter::Gpu;
use super::pipeline::{DEPTH, RAW, SIGNAL};
use super::texture::Texture;
use super::upload::empty_buffer;
use crate::twin::render::constants::GLARE_STEP_PX;
use crate::twin::render::pixel_map::PixelMap;
use crate::twin::render::{Image, RenderError};
use image::{ImageBuffer, Primitive};
use std::cell::OnceCell;

/// Side of a texel of the small picture, pixels.
pub const COARSE_PX: u32 = 4;

/// Textures of one image size, used again for every view of that size.
pub struct ViewTarget {
    /// Width and height of the image.
    pub size_px: (u32, u32),
    /// Signal and depth.
    pub layers: SurfaceLayers,
    /// Where the glare is summed up, electrons: a texel for every fourth pixel of a row, and one more,
    /// so that every pixel lies between two.
    pub glare: Texture,
    /// Signal at one instant of an exposure that shows motion, and what is blurred on the way.
    pub instant: Texture,
    /// A tunnel that does not move, under the bodies of all instants.
    pub tunnel: Texture,
    /// The same of a small picture.
    pub coarse: SurfaceLayers,
    pub coarse_instant: Texture,
    /// Where the adapter develops the picture, if it does.
    finishing: OnceCell<Finishing>,
}

/// What the sensor's pass needs.
pub struct Finishing {
    /// The signal as it is read, two pixels a word: four fetches from a texture cost a software adapter
    /// more than the copy.
    pub signal_words: wgpu::Buffer,
    /// The finished image, four pixels a texel.
    pub finished: Texture,
}

/// A picture while it is drawn.
pub struct SurfaceLayers {
    /// Signal in electrons.
    pub signal: Texture,
    /// Reversed depth.
    pub depth: Texture,
}

impl SurfaceLayers {
    /// Of a size.
    pub fn new(device: &wgpu::Device, size_px: (u32, u32)) -> Self {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_DST;
        Self {
            signal: signal_texture(device, size_px),
            depth: Texture::new(device, size_px, DEPTH, usage),
        }
    }
}

fn signal_texture(device: &wgpu::Device, size_px: (u32, u32)) -> Texture {
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
        | wgpu::TextureUsages::TEXTURE_BINDING
        | wgpu::TextureUsages::COPY_SRC
        | wgpu::TextureUsages::COPY_DST;
    Texture::new(device, size_px, SIGNAL, usage)
}

impl ViewTarget {
    /// For images of one size.
    pub fn new(device: &wgpu::Device, size_px: (u32, u32)) -> Self {
        let glare_columns = size_px.0.div_ceil(GLARE_STEP_PX as u32) + 1;
        let glare_usage = wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC;
        let coarse_px = (size_px.0.div_ceil(COARSE_PX), size_px.1.div_ceil(COARSE_PX));
        Self {
            size_px,
            layers: SurfaceLayers::new(device, size_px),
            glare: Texture::new(device, (glare_columns, size_px.1), SIGNAL, glare_usage),
            instant: signal_texture(device, size_px),
            tunnel: signal_texture(device, size_px),
            coarse: SurfaceLayers::new(device, coarse_px),
            coarse_instant: signal_texture(device, coarse_px),
            finishing: OnceCell::new(),
        }
    }

    /// Where the adapter develops the picture.
    pub fn finishing(&self, device: &wgpu::Device) -> &Finishing {
        self.finishing.get_or_init(|| Finishing {
            signal_words: empty_buffer(
                device,
                u64::from(signal_stride(self.size_px)) * u64::from(self.size_px.1),
                wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            ),
            finished: Texture::new(
                device,
                (packed_width(self.size_px), self.size_px.1),
                RAW,
                wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            ),
        })
    }

    /// Copies the signal to where the sensor's pass reads it.
    pub fn copy_signal(&self, finishing: &Finishing, encoder: &mut wgpu::CommandEncoder) {
        let stride = signal_stride(self.size_px);
        (self.layers.signal).copy_to_buffer(&finishing.signal_words, stride, encoder);
    }

    /// Copies the finished image to a buffer.
    pub fn copy_back(
        &self,
        finishing: &Finishing,
        back: &ReadBack,
        encoder: &mut wgpu::CommandEncoder,
    ) {
        (finishing.finished).copy_to_buffer(&back.buffer, stride(self.size_px), encoder);
    }
}

/// A texture that is drawn once, then read.
pub fn kept_texture(
    device: &wgpu::Device,
    size_px: (u32, u32),
    format: wgpu::TextureFormat,
) -> Texture {
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
        | wgpu::TextureUsages::TEXTURE_BINDING
        | wgpu::TextureUsages::COPY_SRC;
    Texture::new(device, size_px, format, usage)
}

/// An image on its way back.
pub struct ReadBack {
    /// Its width and height.
    pub size_px: (u32, u32),
    buffer: wgpu::Buffer,
}

impl ReadBack {
    /// A buffer for an image.
    pub fn new(device: &wgpu::Device, size_px: (u32, u32)) -> Self {
        let size = u64::from(stride(size_px)) * u64::from(size_px.1);
        let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
        Self {
            size_px,
            buffer: empty_buffer(device, size, usage),
        }
    }

    /// Its size.
    pub fn bytes(&self) -> u64 {
        self.buffer.size()
    }

    /// Asks for access as soon as the copy is done. Whether that went well shows in `image`.
    pub fn request(&self) {
        self.buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    }

    /// The image, each digital number converted to a pixel, once the adapter is done. Frees the buffer.
    pub fn image<T: Primitive>(&self, convert: impl Fn(u32) -> T) -> Result<Image<T>, RenderError> {
        let (width, height) = self.size_px;
        let mut pixels = Vec::with_capacity(width as usize * height as usize);
        {
            let bytes = (self.buffer.get_mapped_range(..))
                .map_err(|e| RenderError::Device(e.to_string()))?;
            for row in bytes.chunks_exact(stride(self.size_px) as usize) {
                let (words, _) = row[..2 * width as usize].as_chunks();
                let numbers = words
                    .iter()
                    .map(|word| u32::from(u16::from_le_bytes(*word)));
                pixels.extend(numbers.map(&convert));
            }
        }
        self.buffer.unmap();
        ImageBuffer::from_raw(width, height, pixels)
            .ok_or_else(|| RenderError::Device("an image came back too short".into()))
    }
}

/// The words of a camera's pixels, four a texel.
pub fn map_texture(gpu: &Gpu, map: &PixelMap, size_px: (u32, u32)) -> Texture {
    let (size, words) = ((packed_width(size_px), size_px.1), map.words());
    let format = wgpu::TextureFormat::Rgba32Uint;
    Texture::filled(gpu, size, 1, format, bytemuck::cast_slice(words))
}

/// Bytes from row to row of the signal.
fn signal_stride(size_px: (u32, u32)) -> u32 {
    (2 * size_px.0).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}

fn packed_width(size_px: (u32, u32)) -> u32 {
    size_px.0.div_ceil(4)
}

/// Bytes from row to row in a buffer that a finished image is copied to.
fn stride(size_px: (u32, u32)) -> u32 {
    (8 * packed_width(size_px)).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}
