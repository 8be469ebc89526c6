//! Where the glare of a picture is summed up: a texel for every fourth pixel of a row.

use super::pipeline::SIGNAL;
use crate::twin::render::surface::GLARE_STEP_PX;

/// For pictures of one size.
pub struct GlareTarget {
    /// Of the pictures.
    pub size_px: (u32, u32),
    /// Electrons.
    pub texture: wgpu::TextureView,
}

impl GlareTarget {
    /// Empty.
    pub fn new(device: &wgpu::Device, size_px: (u32, u32)) -> Self {
        // A texel more than there are steps, so that every pixel lies between two.
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("glare"),
            size: wgpu::Extent3d {
                width: size_px.0.div_ceil(GLARE_STEP_PX as u32) + 1,
                height: size_px.1.max(1),
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: SIGNAL,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        Self {
            size_px,
            texture: texture.create_view(&wgpu::TextureViewDescriptor::default()),
        }
    }
}
