//! Textures, each with a view of all of it.

use super::adapter::Gpu;
use super::rectangle::Rectangle;
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

    /// All of it.
    pub fn whole(&self) -> Rectangle {
        let size = self.texture.size();
        Rectangle::whole([size.width, size.height])
    }

    /// For a shader to read.
    pub fn binding(&self) -> wgpu::BindingResource<'_> {
        wgpu::BindingResource::TextureView(&self.view)
    }

    /// Copies a part of it to a buffer, from an offset on with so many bytes a row.
    pub fn copy_part_to_buffer(
        &self,
        part: Rectangle,
        buffer: &wgpu::Buffer,
        to: (u64, u32),
        encoder: &mut wgpu::CommandEncoder,
    ) {
        let (from, size, layout) = self.part(part, to);
        encoder.copy_texture_to_buffer(from, wgpu::TexelCopyBufferInfo { buffer, layout }, size);
    }

    /// Copies a part of it from a buffer, from an offset on with so many bytes a row.
    pub fn copy_part_from_buffer(
        &self,
        part: Rectangle,
        buffer: &wgpu::Buffer,
        from: (u64, u32),
        encoder: &mut wgpu::CommandEncoder,
    ) {
        let (to, size, layout) = self.part(part, from);
        encoder.copy_buffer_to_texture(wgpu::TexelCopyBufferInfo { buffer, layout }, to, size);
    }

    /// Copies a part of another of its size and format.
    pub fn copy_part_from(
        &self,
        other: &Self,
        part: Rectangle,
        encoder: &mut wgpu::CommandEncoder,
    ) {
        let (from, size, _) = other.part(part, (0, 0));
        let (to, ..) = self.part(part, (0, 0));
        encoder.copy_texture_to_texture(from, to, size);
    }

    /// Copies all of another of its size and format.
    pub fn copy_from(&self, other: &Self, encoder: &mut wgpu::CommandEncoder) {
        let (from, to) = (other.texture.as_image_copy(), self.texture.as_image_copy());
        encoder.copy_texture_to_texture(from, to, self.texture.size());
    }

    /// A part of it, and where it lies in a buffer.
    fn part(
        &self,
        part: Rectangle,
        (offset, stride): (u64, u32),
    ) -> (
        wgpu::TexelCopyTextureInfo<'_>,
        wgpu::Extent3d,
        wgpu::TexelCopyBufferLayout,
    ) {
        let [x, y] = part.at;
        let at = wgpu::TexelCopyTextureInfo {
            origin: wgpu::Origin3d { x, y, z: 0 },
            ..self.texture.as_image_copy()
        };
        let size = wgpu::Extent3d {
            width: part.size[0],
            height: part.size[1],
            depth_or_array_layers: 1,
        };
        let layout = wgpu::TexelCopyBufferLayout {
            offset,
            bytes_per_row: Some(stride),
            rows_per_image: None,
        };
        (at, size, layout)
    }

    /// Copies it to a buffer that has so many bytes a row.
    pub fn copy_to_buffer(
        &self,
        buffer: &wgpu::Buffer,
        stride: u32,
        encoder: &mut wgpu::CommandEncoder,
    ) {
        self.copy_part_to_buffer(self.whole(), buffer, (0, stride), encoder);
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
