//! The paintings of a tunnel on the adapter.
//!
//! A camera that looks along a tunnel sees its walls at a slant: a pixel at distance d on a wall r
//! aside spans d / r times as many metres of the line as of the outline. A mip pyramid has square
//! texels and would blur one way or alias the other. So every painting is there several times, with
//! texels that are 1, 2, 4 and 8 times as long as wide (rip maps), and a chunk of the tunnel takes
//! the one that suits its distance; within it an ordinary pyramid does.

use super::adapter::Gpu;
use super::texture::Texture;
use crate::twin::render::paint::{PERIOD_M, Painting, Paintings, TEXELS_PER_M};

/// Every painting is there with texels of this many lengths.
const SLANTS: u32 = 4;
/// Number of the texture of what has no painting.
pub const BLANK: usize = 0;
/// Walls are about this far aside of the line of sight.
const ASIDE_M: f64 = 5.0;
const GREY: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// Textures for every painting, and how to read them.
pub struct Textures {
    /// A white texel for the bodies, all slants of the first painting, then of the second, and so on.
    pub all: Vec<Texture>,
    /// Repeats along the line, clamps at the outline's ends.
    pub sampler: wgpu::Sampler,
}

impl Textures {
    /// Uploads the paintings.
    pub fn new(gpu: &Gpu, paintings: &Paintings) -> Self {
        let slants = |p| (0..SLANTS).map(move |slant| upload(gpu, p, slant));
        let mut all = vec![Texture::filled(gpu, (1, 1), 1, GREY, &[u8::MAX])];
        all.extend(paintings.all.iter().flat_map(slants));
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("painting"),
            address_mode_u: wgpu::AddressMode::Repeat,
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            mipmap_filter: wgpu::MipmapFilterMode::Nearest,
            ..Default::default()
        });
        Self { all, sampler }
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

/// A painting with texels `2^slant` times as long as wide, and its pyramid as far as these divide
/// its levels.
fn upload(gpu: &Gpu, painting: &Painting, slant: u32) -> Texture {
    let length = 1usize << slant;
    let divides = |k: &usize| (painting.width as usize >> k).is_multiple_of(length);
    let levels = (0..painting.levels.len()).take_while(divides).count();
    let mean = |run: &[u8]| {
        let sum: usize = run.iter().map(|t| usize::from(*t)).sum();
        ((sum + length / 2) >> slant) as u8
    };
    let texels = (painting.levels[..levels].iter()).flat_map(|l| l.chunks_exact(length).map(mean));
    let size = (painting.width >> slant, painting.height);
    Texture::filled(gpu, size, levels, GREY, &texels.collect::<Vec<u8>>())
}
