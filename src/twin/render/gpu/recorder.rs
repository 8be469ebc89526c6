//! The passes of one view as they are recorded.

use super::adapter::Gpu;
use super::kept::KeptTunnel;
use super::pass_clock::PassClock;
use super::pipeline::{Kind, Pipelines};
use super::prepared::{Level, PreparedView};
use super::target::ViewTarget;
use super::texture::Texture;
use std::ops::Range;

/// Nothing yet.
pub const BLACK: wgpu::LoadOp<wgpu::Color> = wgpu::LoadOp::Clear(wgpu::Color::BLACK);
/// What is there already.
pub const KEEP: wgpu::LoadOp<wgpu::Color> = wgpu::LoadOp::Load;

/// What the passes of a view share.
pub struct Recorder<'a> {
    pub gpu: &'a Gpu,
    pub pipelines: &'a Pipelines,
    pub passes: Passes<'a>,
    pub view: &'a PreparedView,
    pub target: &'a ViewTarget,
    /// What the picture is drawn over.
    pub kept: Option<&'a KeptTunnel>,
}

impl<'a> Recorder<'a> {
    /// The resources of group 0, in the order of their bindings; the first is the constants.
    pub fn bind(
        &self,
        level: &Level,
        pipeline: &wgpu::RenderPipeline,
        resources: &[wgpu::BindingResource<'_>],
    ) -> wgpu::BindGroup {
        self.bind_some(level, pipeline, (1..).zip(resources.iter().cloned()))
    }

    /// The same with the bindings' numbers, where a pipeline does not use all that its shader names.
    pub fn bind_some<'r>(
        &self,
        level: &'r Level,
        pipeline: &wgpu::RenderPipeline,
        resources: impl Iterator<Item = (u32, wgpu::BindingResource<'r>)>,
    ) -> wgpu::BindGroup {
        let constants = (0, level.constants.as_entire_binding());
        let all = std::iter::once(constants).chain(resources);
        let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
        let entries: Vec<_> = all.map(entry).collect();
        self.gpu
            .device
            .create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &pipeline.get_bind_group_layout(0),
                entries: &entries,
            })
    }

    /// Depth of the picture: the kept one where no bodies were drawn over it.
    pub fn depth(&self) -> &'a Texture {
        match self.kept {
            Some(kept) if self.view.list.bodies().is_empty() => &kept.depth,
            _ => &self.target.layers.depth,
        }
    }

    /// A pass that draws rectangles of a pipeline whose vertices need no buffers.
    pub fn draw_rectangles(
        &mut self,
        name: &'static str,
        (onto, load): (&Texture, wgpu::LoadOp<wgpu::Color>),
        kind: Kind,
        resources: &[wgpu::BindingResource<'_>],
        instances: Range<u32>,
    ) {
        let pipeline = self.pipelines.get(&self.gpu.device, kind);
        let group = self.bind(&self.view.full, &pipeline, resources);
        let mut pass = self.passes.begin(name, &[(onto, load)], None);
        if !instances.is_empty() {
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.draw(0..6, instances);
        }
    }
}

/// Where the passes of a job are recorded.
pub struct Passes<'a> {
    pub encoder: &'a mut wgpu::CommandEncoder,
    /// Where they are timed.
    pub clock: Option<&'a mut PassClock>,
}

impl Passes<'_> {
    /// A pass over colour targets, with depths that are there or are cleared.
    pub fn begin(
        &mut self,
        name: &'static str,
        colours: &[(&Texture, wgpu::LoadOp<wgpu::Color>)],
        depth: Option<(&Texture, wgpu::LoadOp<f32>)>,
    ) -> wgpu::RenderPass<'_> {
        let clock = self.clock.as_deref_mut();
        let colours: Vec<_> = (colours.iter())
            .map(|(texture, load)| {
                Some(wgpu::RenderPassColorAttachment {
                    view: &texture.view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: *load,
                        store: wgpu::StoreOp::Store,
                    },
                })
            })
            .collect();
        self.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &colours,
            depth_stencil_attachment: depth.map(|(texture, load)| {
                wgpu::RenderPassDepthStencilAttachment {
                    view: &texture.view,
                    depth_ops: Some(wgpu::Operations {
                        load,
                        store: wgpu::StoreOp::Store,
                    }),
                    stencil_ops: None,
                }
            }),
            timestamp_writes: clock.and_then(|clock| clock.stamps(name)),
            ..Default::default()
        })
    }
}

/// The same in all channels, for blending.
pub fn grey(share: f64) -> wgpu::Color {
    wgpu::Color {
        r: share,
        g: share,
        b: share,
        a: share,
    }
}
