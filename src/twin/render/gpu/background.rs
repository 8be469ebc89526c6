//! The passes that draw tunnel and bodies, and what they mirror.

use super::bodies::BodyMeshes;
use super::chunks::InSight;
use super::draw_list::DrawCall;
use super::kept::{KeptLayers, KeptTunnel};
use super::layout::Part;
use super::pipeline::Kind;
use super::prepared::{Level, PreparedView};
use super::recorder::{BLACK, KEEP, Passes, Recorder, grey};
use super::rectangle::Rectangle;
use super::texture::Texture;
use super::textures::Textures;
use crate::twin::render::RenderError;

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

/// A pipeline, with a bind group for each texture.
struct BoundPipeline {
    pipeline: wgpu::RenderPipeline,
    paintings: Vec<wgpu::BindGroup>,
}

/// What draws surfaces that headlights do not light, and those that they do.
struct LitPipelines {
    dark: BoundPipeline,
    headlit: Option<BoundPipeline>,
}

impl LitPipelines {
    fn of(&self, call: &DrawCall) -> &BoundPipeline {
        let headlit = self.headlit.as_ref().filter(|_| call.headlit);
        headlit.unwrap_or(&self.dark)
    }
}

impl Recorder<'_> {
    fn bound(&self, level: &Level, kind: Kind, textures: &Textures) -> BoundPipeline {
        let pipeline = self.pipelines.get(&self.gpu.device, kind);
        let blinks = kind != Kind::Split;
        let painted = (textures.all.iter()).map(|painting| {
            let shares = blinks.then(|| (2, level.shares.binding()));
            let resources = [
                (1, self.view.poses.as_entire_binding()),
                (3, painting.binding()),
                (4, wgpu::BindingResource::Sampler(&textures.sampler)),
            ];
            self.bind_some(level, &pipeline, resources.into_iter().chain(shares))
        });
        let paintings = painted.collect();
        BoundPipeline {
            pipeline,
            paintings,
        }
    }

    /// The pipelines that draw surfaces under so many headlights.
    fn lit_pipelines(&self, level: &Level, headlights: usize, textures: &Textures) -> LitPipelines {
        let list = &self.view.list;
        let (banded, smeared) = (list.banded, list.smeared);
        self.pipelines_of(level, headlights, textures, |headlights| Kind::Lit {
            headlights,
            banded,
            smeared,
        })
    }

    fn pipelines_of(
        &self,
        level: &Level,
        headlights: usize,
        textures: &Textures,
        kind: impl Fn(usize) -> Kind,
    ) -> LitPipelines {
        let any = self.view.list.calls.iter().any(|call| call.headlit);
        LitPipelines {
            dark: self.bound(level, kind(0), textures),
            headlit: any.then(|| self.bound(level, kind(headlights), textures)),
        }
    }

    /// What nothing has been drawn over.
    fn empty(&self) -> wgpu::LoadOp<wgpu::Color> {
        wgpu::LoadOp::Clear(wgpu::Color {
            r: self.view.beyond_e,
            ..wgpu::Color::BLACK
        })
    }

    /// The tunnel in a small picture, under so many headlights.
    fn draw_coarse(&mut self, level: &Level, headlights: usize, surfaces: &Surfaces<'_>) {
        let layers = &self.target.coarse;
        let signals = [&layers.signal, &self.target.coarse_instant];
        let all = [layers.signal.whole()];
        let bound = self.lit_pipelines(level, headlights, surfaces.textures);
        let (view, empty) = (self.view, self.empty());
        for (k, instant) in view.list.tunnel_instants.clone().enumerate() {
            let onto = signals[usize::from(k > 0)];
            let depth = Some((&layers.depth, wgpu::LoadOp::Clear(0.0)));
            let mut pass = (self.passes).begin("coarse", &[(onto, empty)], depth);
            view.draw_instant(&mut pass, instant, &bound, view.list.tunnel(), surfaces);
            drop(pass);
            if k > 0 {
                self.mix_in(level, signals, k, &all);
            }
        }
    }

    /// Tunnel and bodies in the mean over the exposure, under so many headlights; over a tunnel that is kept,
    /// or else over a small picture.
    pub fn draw_background(&mut self, headlights: usize, surfaces: &Surfaces<'_>) {
        if let Some(kept) = self.kept {
            self.draw_changed(kept, headlights, surfaces);
            return;
        }
        if let Some(coarse) = &self.view.coarse {
            self.draw_coarse(coarse, headlights, surfaces);
        }
        self.draw_afresh(headlights, surfaces);
    }

    /// What is drawn in full of a picture of which nothing is kept.
    fn draw_afresh(&mut self, headlights: usize, surfaces: &Surfaces<'_>) {
        let (view, target) = (self.view, self.target);
        if view.areas.is_empty() {
            return;
        }
        let level = &view.full;
        let bound = self.lit_pipelines(level, headlights, surfaces.textures);
        let all: Vec<_> = view.areas.iter().map(|a| (a.part, &a.calls[..])).collect();
        let moving = all
            .iter()
            .map(|(part, calls)| (part.overlap(&view.list.moving), *calls));
        let moving: Vec<_> = moving.filter(|(part, _)| !part.is_empty()).collect();
        let signals = [&target.layers.signal, &target.instant];
        if moving != all {
            self.draw_areas(signals[0], &all, 0, &bound, surfaces);
        }
        if moving.is_empty() {
            return;
        }
        let parts: Vec<_> = moving.iter().map(|(part, _)| *part).collect();
        for (k, instant) in view.list.instants.clone().enumerate() {
            self.draw_areas(
                signals[usize::from(k > 0)],
                &moving,
                instant,
                &bound,
                surfaces,
            );
            if k > 0 {
                self.mix_in(level, signals, k, &parts);
            }
        }
    }

    /// Draws parts of the picture at an instant, each with those draw calls that may show there.
    fn draw_areas(
        &mut self,
        onto: &Texture,
        areas: &[(Rectangle, &[usize])],
        instant: u32,
        bound: &LitPipelines,
        surfaces: &Surfaces<'_>,
    ) {
        let view = self.view;
        let parts: Vec<_> = areas.iter().map(|(part, _)| *part).collect();
        self.clear(onto, &parts);
        let depth = Some((&self.target.layers.depth, wgpu::LoadOp::Load));
        let mut pass = (self.passes).begin("background", &[(onto, KEEP)], depth);
        for (part, calls) in areas {
            part.clip(&mut pass);
            let calls = calls.iter().map(|call| &view.list.calls[*call]);
            view.draw_instant(&mut pass, instant, bound, calls, surfaces);
        }
    }

    /// Leaves nothing in parts of the picture.
    fn clear(&mut self, onto: &Texture, parts: &[Rectangle]) {
        let part = |part: &Rectangle| Part {
            low: part.at.map(|x| x as f32 - 0.5),
            high: part.ends().map(|x| x as f32 - 0.5),
        };
        let parts: Vec<_> = parts.iter().map(part).collect();
        let clear = self.pipelines.get(&self.gpu.device, Kind::Clear);
        let table = self.gpu.storage(&parts);
        let group = self.bind(&self.view.full, &clear, &[table.as_entire_binding()]);
        let depth = Some((&self.target.layers.depth, wgpu::LoadOp::Load));
        let mut pass = self.passes.begin("clear", &[(onto, KEEP)], depth);
        pass.set_pipeline(&clear);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..6, 0..parts.len() as u32);
    }

    /// Draws what a camera at rest sees of the tunnel, to be kept.
    pub fn draw_kept(
        &self,
        size_px: (u32, u32),
        in_sight: &InSight,
        surfaces: &Surfaces<'_>,
    ) -> Result<KeptTunnel, RenderError> {
        let (view, empty) = (self.view, self.empty());
        let bound = LitPipelines {
            dark: self.bound(&view.full, Kind::Split, surfaces.textures),
            headlit: None,
        };
        let layers = KeptLayers::new(self.gpu, size_px);
        let mut encoder = (self.gpu.device).create_command_encoder(&Default::default());
        let depth = Some((&layers.depth, wgpu::LoadOp::Clear(0.0)));
        let targets = [(&layers.light, empty), (&layers.lamp, BLACK)];
        let mut passes = Passes {
            encoder: &mut encoder,
            clock: None,
        };
        let mut pass = passes.begin("kept", &targets, depth);
        view.draw_instant(&mut pass, 0, &bound, view.list.tunnel(), surfaces);
        drop(pass);
        layers.keep(self.gpu, encoder, in_sight, &view.list)
    }

    /// The parts of a picture that differ from a tunnel that is kept, in the mean over the exposure.
    fn draw_changed(&mut self, kept: &KeptTunnel, headlights: usize, surfaces: &Surfaces<'_>) {
        let (view, target, level) = (self.view, self.target, &self.view.full);
        let (signal, depth) = (&target.layers.signal, &target.layers.depth);
        let share_rows = kept.share_rows(&view.list);
        let shares = (&view.list.shares[..], &share_rows[..]);
        let restored = kept.planes.upload(self.gpu, &view.parts, shares);
        restored.copy_to(signal, self.passes.encoder);
        let bodies = view.list.bodies();
        self.draw_headlit(kept, headlights, surfaces);
        if bodies.is_empty() {
            return;
        }
        let bound = self.lit_pipelines(level, headlights, surfaces.textures);
        depth.copy_from(&kept.depth, self.passes.encoder);
        let (moving, signals) = (view.list.moving, [signal, &target.instant]);
        if view.list.instants.len() > 1 {
            (target.tunnel).copy_part_from(signal, moving, self.passes.encoder);
        }
        for (k, instant) in view.list.instants.clone().enumerate() {
            let onto = signals[usize::from(k > 0)];
            if k > 0 {
                onto.copy_part_from(&target.tunnel, moving, self.passes.encoder);
                depth.copy_from(&kept.depth, self.passes.encoder);
            }
            let depth = Some((depth, wgpu::LoadOp::Load));
            let mut pass = (self.passes).begin("background", &[(onto, KEEP)], depth);
            view.draw_instant(&mut pass, instant, &bound, bodies.iter(), surfaces);
            drop(pass);
            if k > 0 {
                self.mix_in(level, signals, k, &[moving]);
            }
        }
    }

    /// Draws what headlights light of a kept tunnel: once more, but only what nothing hides.
    fn draw_headlit(&mut self, kept: &KeptTunnel, headlights: usize, surfaces: &Surfaces<'_>) {
        let (view, signal) = (self.view, &self.target.layers.signal);
        if view.areas.is_empty() {
            return;
        }
        let banded = view.list.banded;
        let relit = |headlights| Kind::Relit { headlights, banded };
        let bound = self.pipelines_of(&view.full, headlights, surfaces.textures, relit);
        let depth = Some((&kept.depth, wgpu::LoadOp::Load));
        let mut pass = (self.passes).begin("headlights", &[(signal, KEEP)], depth);
        let tunnel = view.list.tunnel().count();
        for area in &view.areas {
            area.part.clip(&mut pass);
            let calls = area.calls.iter().filter(|call| **call < tunnel);
            let calls = calls.map(|call| &view.list.calls[*call]);
            view.draw_instant(&mut pass, 0, &bound, calls, surfaces);
        }
    }

    /// Mixes instant `k` into the mean of those before it, in parts of the picture. A running mean:
    /// rounding to half precision does not add up.
    fn mix_in(
        &mut self,
        level: &Level,
        [mean, instant]: [&Texture; 2],
        k: usize,
        parts: &[Rectangle],
    ) {
        let blend = self.pipelines.get(&self.gpu.device, Kind::Blend);
        let group = self.bind(level, &blend, &[instant.binding()]);
        let mut pass = (self.passes).begin("instants", &[(mean, KEEP)], None);
        pass.set_blend_constant(grey(1.0 / (k + 1) as f64));
        pass.set_pipeline(&blend);
        pass.set_bind_group(0, &group, &[]);
        for part in parts {
            part.clip(&mut pass);
            pass.draw(0..6, 0..1);
        }
    }

    /// What rail heads and a wet bed mirror, at every instant of the exposure.
    pub fn draw_gloss(&mut self, headlights: usize, surfaces: &Surfaces<'_>) {
        let (view, list, signal) = (self.view, &self.view.list, &self.target.layers.signal);
        let glossy = list.calls.iter().filter(|call| !call.glossy.is_empty());
        if glossy.clone().next().is_none() {
            return;
        }
        let gloss = (self.pipelines).get(&self.gpu.device, Kind::Gloss { headlights });
        let mirrored = self.gpu.storage(&list.mirrored);
        let resources = [
            view.poses.as_entire_binding(),
            view.full.shares.binding(),
            mirrored.as_entire_binding(),
        ];
        let group = self.bind(&view.full, &gloss, &resources);
        let depth = Some((self.depth(), wgpu::LoadOp::Load));
        let mut pass = self.passes.begin("gloss", &[(signal, KEEP)], depth);
        pass.set_pipeline(&gloss);
        pass.set_bind_group(0, &group, &[]);
        pass.set_blend_constant(grey(1.0 / list.mirrored_instants.len() as f64));
        pass.set_vertex_buffer(1, view.placements.slice(..));
        for call in glossy {
            surfaces.set_buffers(&mut pass, call);
            for instant in list.mirrored_instants.clone() {
                let at = list.placed(call, instant);
                pass.draw_indexed(call.glossy.clone(), 0, at..at + 1);
            }
        }
    }
}

impl PreparedView {
    fn draw_instant<'c>(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        instant: u32,
        bound: &LitPipelines,
        calls: impl Iterator<Item = &'c DrawCall>,
        surfaces: &Surfaces<'_>,
    ) {
        pass.set_vertex_buffer(1, self.placements.slice(..));
        for call in calls {
            surfaces.set_buffers(pass, call);
            let at = self.list.placed(call, instant);
            let bound = bound.of(call);
            pass.set_pipeline(&bound.pipeline);
            pass.set_bind_group(0, &bound.paintings[call.texture], &[]);
            pass.draw_indexed(call.indices.clone(), 0, at..at + 1);
        }
    }
}
