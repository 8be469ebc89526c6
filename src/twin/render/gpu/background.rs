//! The passes that draw tunnel and bodies, and what they mirror.

use super::backdrop::{BackdropKey, Backdrops};
use super::bodies::BodyMeshes;
use super::draw_list::DrawCall;
use super::pipeline::Background;
use super::prepared::PreparedView;
use super::recorder::{KEEP, Recorder, grey};
use super::target::SurfaceLayers;
use super::texture::Texture;
use super::textures::Textures;

/// Tunnel and bodies on the adapter.
pub struct Surfaces<'a> {
    /// Meshes of the bodies.
    pub bodies: &'a BodyMeshes,
    /// What is painted on the tunnel.
    pub textures: &'a Textures,
}

impl Surfaces<'_> {
    /// Chooses the mesh of a draw call.
    fn set_buffers(&self, pass: &mut wgpu::RenderPass<'_>, call: &DrawCall) {
        let (vertices, indices) = match &call.chunk {
            Some(chunk) => (&chunk.vertices, &chunk.indices),
            None => (&self.bodies.vertices, &self.bodies.indices),
        };
        pass.set_vertex_buffer(0, vertices.slice(..));
        pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
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

impl<'a> Recorder<'a> {
    fn bound(&self, background: &'a Background, textures: &Textures) -> Bound<'a> {
        let (view, poses) = (self.view, self.view.poses.as_entire_binding());
        let lit = if view.list.banded {
            &background.banded
        } else {
            &background.lit
        };
        let painted = (textures.all.iter()).map(|painting| {
            let resources = [
                poses.clone(),
                view.shares.binding(),
                painting.binding(),
                wgpu::BindingResource::Sampler(&textures.sampler),
            ];
            self.bind(lit, &resources)
        });
        Bound {
            lit,
            paintings: painted.collect(),
            dim: &background.dim,
            constants: self.bind(&background.dim, &[poses]),
        }
    }

    /// Tunnel and bodies in the mean over the exposure, under so many headlights; a tunnel with a key
    /// is kept for the next frame.
    pub fn draw_background(
        &mut self,
        headlights: usize,
        surfaces: &Surfaces<'_>,
        (backdrops, key): (&mut Backdrops, Option<&BackdropKey>),
    ) {
        let (device, pipelines) = (&self.gpu.device, self.pipelines);
        let (view, target, list) = (self.view, self.target, &self.view.list);
        let headlit = list.calls.iter().any(|call| call.headlit);
        let headlights = [0, headlights];
        let bound: Vec<_> = (headlights[..=usize::from(headlit)].iter())
            .map(|n| self.bound(pipelines.background(device, *n), surfaces.textures))
            .collect();
        let (tunnel, bodies) = list.calls.split_at(list.tunnel().count());
        let empty = wgpu::LoadOp::Clear(wgpu::Color {
            r: view.beyond_e,
            ..wgpu::Color::BLACK
        });
        let far = wgpu::LoadOp::Clear(0.0);
        for k in 0..list.instants {
            let layers = match k {
                0 => &target.layers,
                _ => &target.instant,
            };
            let (mut calls, mut load, mut depth_load) = (&list.calls[..], empty, far);
            if let Some(key) = key {
                let draw_tunnel = |_: &_| {
                    let kept = SurfaceLayers::new(device, target.size_px);
                    let depth = Some((&kept.depth, far));
                    let mut pass = self.passes.begin("background", &kept.signal, empty, depth);
                    view.draw_instant(&mut pass, &bound, tunnel, surfaces, k);
                    drop(pass);
                    kept
                };
                let kept = backdrops.get(key.clone(), draw_tunnel);
                kept.copy_to(layers, self.passes.encoder);
                (calls, load, depth_load) = (bodies, KEEP, wgpu::LoadOp::Load);
            }
            let depth = Some((&layers.depth, depth_load));
            let mut pass = self.passes.begin("background", &layers.signal, load, depth);
            list.moving.clip(&mut pass, k > 0);
            view.draw_instant(&mut pass, &bound, calls, surfaces, k);
            drop(pass);
            if k > 0 {
                self.mix_in(&layers.signal, k);
            }
        }
    }

    /// Mixes instant `k` into the mean of those before it. A running mean: rounding to half precision
    /// does not add up.
    fn mix_in(&mut self, instant: &Texture, k: u32) {
        let blend = &self.pipelines.blend;
        let group = self.bind(blend, &[instant.binding()]);
        let mut pass = self
            .passes
            .begin("instants", &self.target.layers.signal, KEEP, None);
        self.view.list.moving.clip(&mut pass, true);
        pass.set_blend_constant(grey(1.0 / f64::from(k + 1)));
        pass.set_pipeline(blend);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..6, 0..1);
    }

    /// What rail heads and a wet bed mirror, at every instant of the exposure.
    pub fn draw_gloss(&mut self, headlights: usize, surfaces: &Surfaces<'_>) {
        let (view, list, layers) = (self.view, &self.view.list, &self.target.layers);
        let glossy = list.calls.iter().filter(|call| !call.glossy.is_empty());
        if glossy.clone().next().is_none() {
            return;
        }
        let background = (self.pipelines).background(&self.gpu.device, headlights);
        let mirrored = self.gpu.storage(&list.mirrored);
        let resources = [
            view.poses.as_entire_binding(),
            view.shares.binding(),
            mirrored.as_entire_binding(),
        ];
        let group = self.bind(&background.gloss, &resources);
        let depth = Some((&layers.depth, wgpu::LoadOp::Load));
        let mut pass = self.passes.begin("gloss", &layers.signal, KEEP, depth);
        pass.set_pipeline(&background.gloss);
        pass.set_bind_group(0, &group, &[]);
        pass.set_blend_constant(grey(1.0 / f64::from(list.instants)));
        pass.set_vertex_buffer(1, view.placements.slice(..));
        for call in glossy {
            surfaces.set_buffers(&mut pass, call);
            for instant in 0..list.instants {
                let at = instant * list.meshes + call.mesh;
                pass.draw_indexed(call.glossy.clone(), 0, at..at + 1);
            }
        }
    }
}

impl PreparedView {
    fn draw_instant(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        bound: &[Bound<'_>],
        calls: &[DrawCall],
        surfaces: &Surfaces<'_>,
        instant: u32,
    ) {
        pass.set_vertex_buffer(1, self.placements.slice(..));
        for call in calls {
            surfaces.set_buffers(pass, call);
            let at = instant * self.list.meshes + call.mesh;
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
}
