//! What the passes draw into, and the way back to memory.

use super::pipeline::{DEPTH, PACKED, SIGNAL};
use crate::twin::render::RenderError;
use image::GrayImage;
use std::cell::OnceCell;

/// Textures of one image size, used again for every view of that size.
pub struct Target {
    /// Size of the image.
    pub size_px: (u32, u32),
    /// Signal in electrons.
    pub signal: wgpu::TextureView,
    /// Reversed depth.
    pub depth: wgpu::TextureView,
    /// The finished image.
    pub packed: wgpu::TextureView,
    packed_texture: wgpu::Texture,
    instant: OnceCell<wgpu::TextureView>,
}

impl Target {
    /// For images of one size.
    pub fn new(device: &wgpu::Device, size_px: (u32, u32)) -> Self {
        let texture = |width, format, extra| {
            let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | extra;
            texture(device, (width, size_px.1), format, usage)
        };
        let view = |t: &wgpu::Texture| t.create_view(&wgpu::TextureViewDescriptor::default());
        let read = wgpu::TextureUsages::TEXTURE_BINDING;
        let packed_texture = texture(packed_width(size_px), PACKED, wgpu::TextureUsages::COPY_SRC);
        Self {
            size_px,
            signal: view(&texture(size_px.0, SIGNAL, read)),
            depth: view(&texture(size_px.0, DEPTH, read)),
            packed: view(&packed_texture),
            packed_texture,
            instant: OnceCell::new(),
        }
    }

    /// The signal at one instant of an exposure that shows motion; made when first needed.
    pub fn instant(&self, device: &wgpu::Device) -> &wgpu::TextureView {
        self.instant.get_or_init(|| {
            let usage =
                wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
            texture(device, self.size_px, SIGNAL, usage)
                .create_view(&wgpu::TextureViewDescriptor::default())
        })
    }

    /// Copies the finished image to a buffer.
    pub fn copy_to(&self, encoder: &mut wgpu::CommandEncoder, back: &ReadBack) {
        encoder.copy_texture_to_buffer(
            self.packed_texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &back.buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(stride(self.size_px)),
                    rows_per_image: None,
                },
            },
            self.packed_texture.size(),
        );
    }
}

fn texture(
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
    buffer: wgpu::Buffer,
}

impl ReadBack {
    /// A buffer for an image.
    pub fn new(device: &wgpu::Device, size_px: (u32, u32)) -> Self {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read-back"),
            size: u64::from(stride(size_px)) * u64::from(size_px.1),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        Self { size_px, buffer }
    }

    /// Whether it can take an image of that size.
    pub fn fits(&self, size_px: (u32, u32)) -> bool {
        self.size_px == size_px
    }

    /// Asks for access as soon as the copy is done. Whether that went well shows in `image`.
    pub fn request(&self) {
        self.buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    }

    /// The image, once the adapter is done; gives the buffer free.
    pub fn image(&self) -> Result<GrayImage, RenderError> {
        let (width, height) = self.size_px;
        let mut pixels = Vec::with_capacity(width as usize * height as usize);
        {
            let bytes = self
                .buffer
                .get_mapped_range(..)
                .map_err(|e| RenderError::Device(e.to_string()))?;
            for row in bytes.chunks_exact(stride(self.size_px) as usize) {
                pixels.extend_from_slice(&row[..width as usize]);
            }
        }
        self.buffer.unmap();
        GrayImage::from_raw(width, height, pixels)
            .ok_or_else(|| RenderError::Device("an image came back too short".into()))
    }
}

fn packed_width(size_px: (u32, u32)) -> u32 {
    size_px.0.div_ceil(4)
}

/// Bytes from row to row in a buffer that a texture is copied to.
fn stride(size_px: (u32, u32)) -> u32 {
    (4 * packed_width(size_px)).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}
