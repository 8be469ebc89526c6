//! Textures, each with a view of all of it.

use super::adapter::Gpu;
use wgpu::util::{DeviceExt, TextureDataOrder};

/// Numbers or pictures.
pub struct Texture {
    /// All of it.
    pub view: wgpu::TextureView,
    texture: wgpu::Texture,
}

impl Texture {
    /// Empty.
    pub fn new(
        device: &wgpu::Device,
        size: (u32, u32),
        format: wgpu::TextureFormat,
        usage: wgpu::TextureUsages,
    ) -> Self {
        Self::viewed(device.create_texture(&descriptor(size, 1, format, usage)))
    }

    /// For shaders to read, with so many levels, one after the other in `data`.
    pub fn filled(
        gpu: &Gpu,
        size: (u32, u32),
        levels: usize,
        format: wgpu::TextureFormat,
        data: &[u8],
    ) -> Self {
        let usage = wgpu::TextureUsages::TEXTURE_BINDING;
        Self::viewed(gpu.device.create_texture_with_data(
            &gpu.queue,
            &descriptor(size, levels as u32, format, usage),
            TextureDataOrder::LayerMajor,
            data,
        ))
    }

    fn viewed(texture: wgpu::Texture) -> Self {
        Self {
            view: texture.create_view(&wgpu::TextureViewDescriptor::default()),
            texture,
        }
    }

    /// For a shader to read.
    pub fn binding(&self) -> wgpu::BindingResource<'_> {
        wgpu::BindingResource::TextureView(&self.view)
    }

    /// Copies it to another of the same size.
    pub fn copy_to(&self, other: &Self, encoder: &mut wgpu::CommandEncoder) {
        let [from, to] = [self, other].map(|t| t.texture.as_image_copy());
        encoder.copy_texture_to_texture(from, to, self.texture.size());
    }

    /// Copies it to a buffer that has so many bytes a row.
    pub fn copy_to_buffer(
        &self,
        buffer: &wgpu::Buffer,
        stride: u32,
        encoder: &mut wgpu::CommandEncoder,
    ) {
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(stride),
            rows_per_image: None,
        };
        encoder.copy_texture_to_buffer(
            self.texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer, layout },
            self.texture.size(),
        );
    }
}

fn descriptor(
    (width, height): (u32, u32),
    levels: u32,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::TextureDescriptor<'static> {
    wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: levels,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    }
}
