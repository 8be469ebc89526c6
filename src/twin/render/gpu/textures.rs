//! The paintings of a tunnel on the adapter.
//!
//! A camera that looks along a tunnel sees its walls at a slant: a pixel at distance d on a wall r
//! aside spans d / r times as many metres of the line as of the outline. A mip pyramid has square
//! texels and would blur one way or alias the other. So every painting is there several times, with
//! texels that are 1, 2, 4 and 8 times as long as wide (rip maps), and a chunk of the tunnel takes
//! the one that suits its distance; within it an ordinary pyramid does.

use super::adapter::Gpu;
use crate::twin::render::paint::{PERIOD_M, Painting, Paintings, TEXELS_PER_M};

/// Every painting is there with texels of this many lengths.
const SLANTS: u32 = 4;
/// Number of the texture of what has no painting.
pub const BLANK: usize = 0;
/// Walls are about this far aside of the line of sight.
const ASIDE_M: f64 = 5.0;

/// Textures for every painting, and how to read them.
pub struct Textures {
    /// A white texel for the bodies, all slants of the first painting, then of the second, and so on.
    pub views: Vec<wgpu::TextureView>,
    /// Repeats along the line, clamps at the outline's ends.
    pub sampler: wgpu::Sampler,
}

impl Textures {
    /// Uploads the paintings.
    pub fn new(gpu: &Gpu, paintings: &Paintings) -> Self {
        let slants = |p| (0..SLANTS).map(move |slant| upload(gpu, p, slant));
        let mut views = vec![texture(gpu, (1, 1), &[vec![u8::MAX]])];
        views.extend(paintings.all.iter().flat_map(slants));
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

/// Number of the texture in which to see a painting from so far along the tunnel.
pub fn slanted(painting: usize, away_m: f64) -> usize {
    let slant = (away_m / ASIDE_M).max(1.0).log2().round() as u32;
    BLANK + 1 + painting * SLANTS as usize + slant.min(SLANTS - 1) as usize
}

/// A painting with texels `2^slant` times as long as wide, and its pyramid.
fn upload(gpu: &Gpu, painting: &Painting, slant: u32) -> wgpu::TextureView {
    if slant == 0 {
        return texture(gpu, (painting.width, painting.height), &painting.levels);
    }
    let mut levels = Vec::with_capacity(painting.levels.len());
    for (k, level) in painting.levels.iter().enumerate() {
        let width = painting.width >> k;
        if !width.is_multiple_of(1 << slant) {
            break;
        }
        let mean = |run: &[u8]| {
            let sum: u32 = run.iter().map(|t| u32::from(*t)).sum();
            ((sum + (1 << (slant - 1))) >> slant) as u8
        };
        levels.push(level.chunks_exact(1 << slant).map(mean).collect());
    }
    texture(gpu, (painting.width >> slant, painting.height), &levels)
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
