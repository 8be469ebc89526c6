//! The paintings of a tunnel on the adapter.

use super::adapter::Gpu;
use crate::twin::render::paint::{PERIOD_M, Painting, Paintings, TEXELS_PER_M};

/// A texture for every painting, and how to read them.
pub struct Textures {
    /// In the order of the paintings; where there are none, one blank texel for the bodies to bind.
    pub views: Vec<wgpu::TextureView>,
    /// Repeats along the line, clamps at the outline's ends.
    pub sampler: wgpu::Sampler,
}

impl Textures {
    /// Uploads the paintings.
    pub fn new(gpu: &Gpu, paintings: &Paintings) -> Self {
        let mut views: Vec<_> = paintings.all.iter().map(|p| upload(gpu, p)).collect();
        if views.is_empty() {
            views.push(texture(gpu, (1, 1), &[vec![0]]));
        }
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("painting"),
            address_mode_u: wgpu::AddressMode::Repeat,
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            mipmap_filter: wgpu::MipmapFilterMode::Nearest,
            ..Default::default()
        });
        Self { views, sampler }
    }
}

/// Shares of a painting that a metre along the line and along the outline take.
pub fn per_m(painting: &Painting) -> [f32; 2] {
    let height_m = f64::from(painting.height) / f64::from(TEXELS_PER_M);
    [PERIOD_M, height_m].map(|m| (1.0 / m) as f32)
}

fn upload(gpu: &Gpu, painting: &Painting) -> wgpu::TextureView {
    texture(gpu, (painting.width, painting.height), &painting.levels)
}

fn texture(gpu: &Gpu, (width, height): (u32, u32), levels: &[Vec<u8>]) -> wgpu::TextureView {
    let size = |level: u32| wgpu::Extent3d {
        width: (width >> level).max(1),
        height: (height >> level).max(1),
        depth_or_array_layers: 1,
    };
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("painting"),
        size: size(0),
        mip_level_count: levels.len() as u32,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::R8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (texels, level) in levels.iter().zip(0..) {
        let size = size(level);
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                mip_level: level,
                ..texture.as_image_copy()
            },
            texels,
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(size.width),
                rows_per_image: None,
            },
            size,
        );
    }
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
