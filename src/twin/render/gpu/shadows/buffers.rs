//! The shadows of one view on the adapter, and the pass that draws them.

use super::Shadows;
use crate::twin::render::gpu::adapter::Gpu;
use crate::twin::render::gpu::layout::{
    Blocker, MAX_BLOCKERS, MAX_SLABS, MAX_SOURCES, MAX_WORDS, Slab, Source, Tile,
};
use crate::twin::render::gpu::pipeline::Pipelines;
use crate::twin::render::gpu::render_pass::{KEEP, begin, draw_rectangles};
use crate::twin::render::gpu::target::Target;
use crate::twin::render::gpu::upload::Upload;
use std::mem::size_of;

/// The shadows of one view on the adapter.
pub struct ShadowBuffers {
    tiles: Upload,
    lists: Upload,
    sources: Upload,
    blockers: Upload,
    slabs: Upload,
    /// Tiles with capsules only, and all.
    counts: [u32; 2],
}

impl ShadowBuffers {
    /// Empty.
    pub fn new(gpu: &Gpu) -> Self {
        let uniform = |size| Upload::new(gpu, wgpu::BufferUsages::UNIFORM, size);
        Self {
            tiles: Upload::new(gpu, wgpu::BufferUsages::STORAGE, size_of::<Tile>()),
            lists: uniform(MAX_WORDS * size_of::<u32>()),
            sources: uniform(MAX_SOURCES * size_of::<Source>()),
            blockers: uniform(MAX_BLOCKERS * size_of::<Blocker>()),
            slabs: uniform(MAX_SLABS * size_of::<Slab>()),
            counts: [0; 2],
        }
    }

    /// Takes the next job's view.
    pub fn write(&mut self, gpu: &Gpu, shadows: &Shadows) {
        self.counts = [shadows.capsule_tiles, shadows.tiles.len()].map(|n| n as u32);
        if self.counts[1] == 0 {
            return;
        }
        self.tiles.write(gpu, &shadows.tiles);
        self.lists.write(gpu, &shadows.lists);
        self.sources.write(gpu, &shadows.sources);
        self.blockers.write(gpu, &shadows.blockers);
        self.slabs.write(gpu, &shadows.slabs);
    }

    /// Fades the background where bodies hide its light.
    pub fn draw(
        &self,
        gpu: &Gpu,
        pipelines: &Pipelines,
        encoder: &mut wgpu::CommandEncoder,
        target: &Target,
        view: &Upload,
    ) {
        let [capsules, all] = self.counts;
        if all == 0 {
            return;
        }
        let resources = [
            view.binding(),
            wgpu::BindingResource::TextureView(&target.layers.depth),
            self.tiles.binding(),
            self.lists.binding(),
            self.sources.binding(),
            self.blockers.binding(),
            self.slabs.binding(),
        ];
        let mut pass = begin(encoder, &target.layers.signal, KEEP, None);
        for (pipeline, tiles) in pipelines.shadows.iter().zip([0..capsules, capsules..all]) {
            if !tiles.is_empty() {
                draw_rectangles(&mut pass, &gpu.device, pipeline, &resources, tiles);
            }
        }
    }
}
