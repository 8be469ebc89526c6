//! What the passes draw into, and the way back to memory.

use super::adapter::Gpu;
use super::pipeline::{DEPTH, PACKED, RAW, SIGNAL};
use crate::twin::render::constants::GLARE_STEP_PX;
use crate::twin::render::pixel_map::PixelMap;
use crate::twin::render::{RawImage, RenderError, upper_bits};
use image::GrayImage;
use std::cell::OnceCell;

/// Textures of one image size, used again for every view of that size.
pub struct Target {
    /// Size of the image.
    pub size_px: (u32, u32),
    /// Signal and depth.
    pub layers: Layers,
    /// Where the glare is summed up, electrons: a texel for every fourth pixel of a row, and one more,
    /// so that every pixel lies between two.
    pub glare: wgpu::TextureView,
    /// The signal as the sensor's pass reads it, two pixels a word: four fetches from a texture
    /// cost a software adapter more than the copy.
    pub signal_words: wgpu::Buffer,
    instant: OnceCell<Layers>,
    /// The finished image, of eight bits and raw.
    finished: [Finished; 2],
}

/// A picture while it is drawn.
pub struct Layers {
    /// Signal in electrons.
    pub signal: wgpu::TextureView,
    signal_texture: wgpu::Texture,
    /// Reversed depth.
    pub depth: wgpu::TextureView,
    depth_texture: wgpu::Texture,
}

impl Layers {
    /// Of a size.
    pub fn new(device: &wgpu::Device, size_px: (u32, u32)) -> Self {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC
            | wgpu::TextureUsages::COPY_DST;
        let [signal_texture, depth_texture] =
            [SIGNAL, DEPTH].map(|format| texture(device, size_px, format, usage));
        let [signal, depth] = [&signal_texture, &depth_texture]
            .map(|t| t.create_view(&wgpu::TextureViewDescriptor::default()));
        Self {
            signal,
            signal_texture,
            depth,
            depth_texture,
        }
    }

    /// Width and height.
    pub fn size_px(&self) -> (u32, u32) {
        (self.signal_texture.width(), self.signal_texture.height())
    }

    /// Copies both to others of the same size.
    pub fn copy_to(&self, other: &Self, encoder: &mut wgpu::CommandEncoder) {
        for (from, to) in [
            (&self.signal_texture, &other.signal_texture),
            (&self.depth_texture, &other.depth_texture),
        ] {
            encoder.copy_texture_to_texture(from.as_image_copy(), to.as_image_copy(), from.size());
        }
    }
}

/// A finished image, four pixels a texel.
struct Finished {
    view: wgpu::TextureView,
    texture: wgpu::Texture,
}

impl Target {
    /// For images of one size.
    pub fn new(device: &wgpu::Device, size_px: (u32, u32)) -> Self {
        let texture = |width, format, extra| {
            let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | extra;
            texture(device, (width, size_px.1), format, usage)
        };
        let view = |t: &wgpu::Texture| t.create_view(&wgpu::TextureViewDescriptor::default());
        let finished = |format| {
            let texture = texture(packed_width(size_px), format, wgpu::TextureUsages::COPY_SRC);
            Finished {
                view: view(&texture),
                texture,
            }
        };
        let glare = texture(
            size_px.0.div_ceil(GLARE_STEP_PX as u32) + 1,
            SIGNAL,
            wgpu::TextureUsages::TEXTURE_BINDING,
        );
        let signal_words = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("signal"),
            size: u64::from(signal_stride(size_px)) * u64::from(size_px.1),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self {
            size_px,
            layers: Layers::new(device, size_px),
            glare: view(&glare),
            signal_words,
            instant: OnceCell::new(),
            finished: [finished(PACKED), finished(RAW)],
        }
    }

    /// One instant of an exposure that shows motion; made when first needed.
    pub fn instant(&self, device: &wgpu::Device) -> &Layers {
        self.instant
            .get_or_init(|| Layers::new(device, self.size_px))
    }

    /// The finished image, raw or not.
    pub fn finished(&self, raw: bool) -> &wgpu::TextureView {
        &self.finished[usize::from(raw)].view
    }

    /// Copies the signal to where the sensor's pass reads it.
    pub fn copy_signal(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.copy_texture_to_buffer(
            self.layers.signal_texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &self.signal_words,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(signal_stride(self.size_px)),
                    rows_per_image: None,
                },
            },
            self.layers.signal_texture.size(),
        );
    }

    /// Copies the finished image to a buffer.
    pub fn copy_to(&self, encoder: &mut wgpu::CommandEncoder, back: &ReadBack) {
        let texture = &self.finished[usize::from(back.raw)].texture;
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &back.buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(stride(self.size_px, back.raw)),
                    rows_per_image: None,
                },
            },
            texture.size(),
        );
    }
}

/// Empty, for numbers and pictures.
pub fn texture(
    device: &wgpu::Device,
    (width, height): (u32, u32),
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

/// An image on its way back.
pub struct ReadBack {
    size_px: (u32, u32),
    raw: bool,
    buffer: wgpu::Buffer,
}

impl ReadBack {
    /// A buffer for an image.
    pub fn new(device: &wgpu::Device, size_px: (u32, u32), raw: bool) -> Self {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read-back"),
            size: u64::from(stride(size_px, raw)) * u64::from(size_px.1),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        Self {
            size_px,
            raw,
            buffer,
        }
    }

    /// Whether it can take an image of that size, raw or not.
    pub fn fits(&self, size_px: (u32, u32), raw: bool) -> bool {
        self.size_px == size_px && self.raw == raw
    }

    /// Asks for access as soon as the copy is done. Whether that went well shows in `image`.
    pub fn request(&self) {
        self.buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    }

    /// The image of eight bits, once the adapter is done; gives the buffer free. Of a raw image
    /// that has `spare_bits` more, the upper ones.
    pub fn image(&self, spare_bits: u32) -> Result<GrayImage, RenderError> {
        if self.raw {
            return Ok(upper_bits(&self.raw_image()?, spare_bits));
        }
        let (width, height) = self.size_px;
        let mut pixels = Vec::with_capacity(width as usize * height as usize);
        self.rows(|row| pixels.extend_from_slice(&row[..width as usize]))?;
        GrayImage::from_raw(width, height, pixels).ok_or_else(too_short)
    }

    /// The raw image, for which the buffer was made, once the adapter is done; gives it free.
    pub fn raw_image(&self) -> Result<RawImage, RenderError> {
        let (width, height) = self.size_px;
        let mut pixels = Vec::with_capacity(width as usize * height as usize);
        self.rows(|row| {
            let words = row[..2 * width as usize].chunks_exact(2);
            pixels.extend(words.map(|w| u16::from_le_bytes([w[0], w[1]])));
        })?;
        RawImage::from_raw(width, height, pixels).ok_or_else(too_short)
    }

    fn rows(&self, take: impl FnMut(&[u8])) -> Result<(), RenderError> {
        {
            let bytes = self
                .buffer
                .get_mapped_range(..)
                .map_err(|e| RenderError::Device(e.to_string()))?;
            bytes
                .chunks_exact(stride(self.size_px, self.raw) as usize)
                .for_each(take);
        }
        self.buffer.unmap();
        Ok(())
    }
}

fn too_short() -> RenderError {
    RenderError::Device("an image came back too short".into())
}

/// The words of a camera's pixels, four a texel.
pub fn map_texture(gpu: &Gpu, map: &PixelMap, size_px: (u32, u32)) -> wgpu::TextureView {
    let width = packed_width(size_px);
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    let format = wgpu::TextureFormat::Rgba32Uint;
    let texture = texture(&gpu.device, (width, size_px.1), format, usage);
    gpu.queue.write_texture(
        texture.as_image_copy(),
        bytemuck::cast_slice(map.words()),
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(16 * width),
            rows_per_image: None,
        },
        texture.size(),
    );
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// Bytes from row to row of the signal.
fn signal_stride(size_px: (u32, u32)) -> u32 {
    (2 * size_px.0).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}

fn packed_width(size_px: (u32, u32)) -> u32 {
    size_px.0.div_ceil(4)
}

/// Bytes from row to row in a buffer that a texture is copied to.
fn stride(size_px: (u32, u32), raw: bool) -> u32 {
    let texel = if raw { 8 } else { 4 };
    (texel * packed_width(size_px)).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}
