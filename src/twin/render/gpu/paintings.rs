//! The painted surfaces of a tunnel on the adapter.

use super::adapter::Gpu;
use crate::track::Tunnel;
use crate::twin::render::paint::{PERIOD_M, Painting, TEXEL_M};

/// A painting for every range of cross-sections, and how to read them.
pub struct Paintings {
    views: Vec<wgpu::TextureView>,
    heights_m: Vec<f64>,
    /// Of each range of the tunnel: its painting.
    of_range: Vec<usize>,
    /// Repeats along the line, clamps at the outline's ends.
    pub sampler: wgpu::Sampler,
}

impl Paintings {
    /// Paints every cross-section of a tunnel once, however often it occurs.
    pub fn new(gpu: &Gpu, tunnel: &Tunnel) -> Self {
        // The first one is blank, for a view in which there is no tunnel.
        let mut views = Vec::new();
        let mut heights_m = Vec::new();
        let mut add = |painting: &Painting| {
            views.push(upload(gpu, painting));
            heights_m.push(f64::from(painting.height) * TEXEL_M);
            views.len() - 1
        };
        add(&Painting::blank());
        let mut of_range: Vec<usize> = Vec::new();
        for (k, range) in tunnel.sections.iter().enumerate() {
            let same = |other: &_| *other == range.section;
            let painted = tunnel.sections[..k].iter().position(|r| same(&r.section));
            of_range.push(match painted {
                Some(earlier) => of_range[earlier],
                None => add(&Painting::of(&range.section)),
            });
        }
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("painting"),
            address_mode_u: wgpu::AddressMode::Repeat,
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            mipmap_filter: wgpu::MipmapFilterMode::Nearest,
            ..Default::default()
        });
        Self {
            views,
            heights_m,
            of_range,
            sampler,
        }
    }

    /// Shares of a painting that a metre along the line and along the outline take.
    pub fn per_m(&self, painting: usize) -> [f32; 2] {
        [PERIOD_M, self.heights_m[painting]].map(|m| (1.0 / m) as f32)
    }

    /// All of them.
    pub fn views(&self) -> &[wgpu::TextureView] {
        &self.views
    }

    /// Which painting a range of cross-sections has.
    pub fn of_range(&self, range: usize) -> usize {
        self.of_range.get(range).copied().unwrap_or(0)
    }
}

fn upload(gpu: &Gpu, painting: &Painting) -> wgpu::TextureView {
    let size = |level: u32| wgpu::Extent3d {
        width: (painting.width >> level).max(1),
        height: (painting.height >> level).max(1),
        depth_or_array_layers: 1,
    };
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("painting"),
        size: size(0),
        mip_level_count: painting.levels.len() as u32,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::R8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (texels, level) in painting.levels.iter().zip(0..) {
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
