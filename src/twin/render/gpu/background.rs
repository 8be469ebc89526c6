//! The passes that draw tunnel and bodies, and what they mirror.

use super::adapter::Gpu;
use super::backdrop::{BackdropKey, Backdrops};
use super::bodies::BodyBuffers;
use super::chunks::Chunks;
use super::draw_list::{DrawCall, DrawList};
use super::pipeline::{Background, Pipelines};
use super::render_pass::{KEEP, begin, bind, draw_rectangles, grey, resume};
use super::target::{Layers, Target};
use super::textures::Textures;
use super::view_buffers::ViewBuffers;

/// Tunnel and bodies on the adapter.
pub struct Surfaces<'a> {
    /// Meshes of the tunnel.
    pub chunks: &'a Chunks,
    /// Meshes of the bodies.
    pub bodies: &'a BodyBuffers,
    /// What is painted on the tunnel.
    pub textures: &'a Textures,
}

impl Surfaces<'_> {
    /// Chooses the mesh of a draw call, if it is there.
    fn set_buffers(&self, pass: &mut wgpu::RenderPass<'_>, call: &DrawCall) -> bool {
        let (vertices, indices) = match call.chunk.map(|key| self.chunks.get(key)) {
            Some(None) => return false,
            Some(Some(chunk)) => (&chunk.vertices, &chunk.indices),
            None => (&self.bodies.vertices.buffer, &self.bodies.indices.buffer),
        };
        pass.set_vertex_buffer(0, vertices.slice(..));
        pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
        true
    }
}

/// The background's pipelines, each with its bind groups for a view.
struct Bound<'a> {
    lit: &'a wgpu::RenderPipeline,
    /// One a texture.
    paintings: Vec<wgpu::BindGroup>,
    dim: &'a wgpu::RenderPipeline,
    constants: wgpu::BindGroup,
}

impl<'a> Bound<'a> {
    fn new(
        gpu: &Gpu,
        buffers: &ViewBuffers,
        background: &'a Background,
        banded: bool,
        textures: &Textures,
    ) -> Self {
        let lit = if banded {
            &background.banded
        } else {
            &background.lit
        };
        let paintings = (textures.views.iter())
            .map(|painting| {
                let resources = [
                    buffers.view.binding(),
                    buffers.poses.binding(),
                    buffers.shares.binding(),
                    wgpu::BindingResource::TextureView(painting),
                    wgpu::BindingResource::Sampler(&textures.sampler),
                ];
                bind(&gpu.device, lit, &resources)
            })
            .collect();
        let constants = [buffers.view.binding(), buffers.poses.binding()];
        Self {
            lit,
            paintings,
            dim: &background.dim,
            constants: bind(&gpu.device, &background.dim, &constants),
        }
    }
}

impl ViewBuffers {
    /// Tunnel and bodies in the mean over the exposure; with the pipelines for what no headlight
    /// lights and for what they light. A tunnel with a key is kept for the next frame.
    pub fn draw_background(
        &self,
        gpu: &Gpu,
        (pipelines, backgrounds): (&Pipelines, &[Background; 2]),
        encoder: &mut wgpu::CommandEncoder,
        (target, backdrops): (&Target, &mut Backdrops),
        (list, key): (&DrawList, Option<BackdropKey>),
        surfaces: &Surfaces<'_>,
    ) {
        let headlit = list.calls.iter().any(|call| call.headlit);
        let used = &backgrounds[..=usize::from(headlit)];
        let bound: Vec<_> = (used.iter())
            .map(|b| Bound::new(gpu, self, b, list.banded, surfaces.textures))
            .collect();
        let (tunnel, bodies) = list.calls.split_at(list.tunnel().count());
        let empty = wgpu::LoadOp::Clear(wgpu::Color {
            r: self.beyond_e,
            ..wgpu::Color::BLACK
        });
        let mut draw = |encoder: &mut _, layers: &Layers, k| {
            let Some(key) = &key else {
                let mut pass = begin(encoder, &layers.signal, empty, Some(&layers.depth));
                list.moving.clip(&mut pass, k > 0);
                self.draw_instant(&mut pass, &bound, (list, &list.calls), surfaces, k);
                return;
            };
            if !backdrops.show(key, layers, encoder) {
                let mut pass = begin(encoder, &layers.signal, empty, Some(&layers.depth));
                self.draw_instant(&mut pass, &bound, (list, tunnel), surfaces, k);
                drop(pass);
                backdrops.keep(gpu, key.clone(), layers, encoder);
            }
            let mut pass = resume(encoder, &layers.signal, &layers.depth);
            list.moving.clip(&mut pass, k > 0);
            self.draw_instant(&mut pass, &bound, (list, bodies), surfaces, k);
        };
        draw(encoder, &target.layers, 0);
        for k in 1..list.instants {
            let instant = target.instant(&gpu.device);
            draw(encoder, instant, k);
            let resources = [
                self.view.binding(),
                wgpu::BindingResource::TextureView(&instant.signal),
            ];
            let mut pass = begin(encoder, &target.layers.signal, KEEP, None);
            list.moving.clip(&mut pass, true);
            // A running mean: rounding to half precision does not add up.
            pass.set_blend_constant(grey(1.0 / f64::from(k + 1)));
            draw_rectangles(&mut pass, &gpu.device, &pipelines.blend, &resources, 0..1);
        }
    }

    fn draw_instant(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        bound: &[Bound<'_>],
        (list, calls): (&DrawList, &[DrawCall]),
        surfaces: &Surfaces<'_>,
        instant: u32,
    ) {
        pass.set_vertex_buffer(1, self.placements.buffer.slice(..));
        for call in calls {
            if !surfaces.set_buffers(pass, call) {
                continue;
            }
            let at = instant * list.meshes + call.mesh;
            let bound = &bound[usize::from(call.headlit)];
            if !call.lit.is_empty() {
                pass.set_pipeline(bound.lit);
                pass.set_bind_group(0, &bound.paintings[call.texture], &[]);
                pass.draw_indexed(call.lit.clone(), 0, at..at + 1);
            }
            if !call.dim.is_empty() {
                pass.set_pipeline(bound.dim);
                pass.set_bind_group(0, &bound.constants, &[]);
                pass.draw_indexed(call.dim.clone(), 0, at..at + 1);
            }
        }
    }

    /// What rail heads and a wet bed mirror, at every instant of the exposure.
    pub fn draw_gloss(
        &self,
        gpu: &Gpu,
        pipeline: &wgpu::RenderPipeline,
        encoder: &mut wgpu::CommandEncoder,
        target: &Target,
        (list, surfaces): (&DrawList, &Surfaces<'_>),
    ) {
        let mut glossy = (list.calls.iter())
            .filter(|call| !call.glossy.is_empty())
            .peekable();
        if glossy.peek().is_none() {
            return;
        }
        let resources = [
            self.view.binding(),
            self.poses.binding(),
            self.shares.binding(),
            self.mirrored.binding(),
        ];
        let group = bind(&gpu.device, pipeline, &resources);
        let mut pass = resume(encoder, &target.layers.signal, &target.layers.depth);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.set_blend_constant(grey(1.0 / f64::from(list.instants)));
        pass.set_vertex_buffer(1, self.placements.buffer.slice(..));
        for call in glossy {
            if surfaces.set_buffers(&mut pass, call) {
                for instant in 0..list.instants {
                    let at = instant * list.meshes + call.mesh;
                    pass.draw_indexed(call.glossy.clone(), 0, at..at + 1);
                }
            }
        }
    }
}
