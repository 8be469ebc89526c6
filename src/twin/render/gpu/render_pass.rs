//! Render passes as they are recorded.

/// Nothing yet.
pub const BLACK: wgpu::LoadOp<wgpu::Color> = wgpu::LoadOp::Clear(wgpu::Color::BLACK);
/// What is there already.
pub const KEEP: wgpu::LoadOp<wgpu::Color> = wgpu::LoadOp::Load;

/// A pass over one colour target, whose depths are cleared.
pub fn begin<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    colour: &wgpu::TextureView,
    load: wgpu::LoadOp<wgpu::Color>,
    depth: Option<&wgpu::TextureView>,
) -> wgpu::RenderPass<'a> {
    let depth = depth.map(|view| (view, wgpu::LoadOp::Clear(0.0)));
    pass(encoder, colour, load, depth)
}

/// A pass that adds to what is there.
pub fn resume<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    colour: &wgpu::TextureView,
    depth: &wgpu::TextureView,
) -> wgpu::RenderPass<'a> {
    pass(encoder, colour, KEEP, Some((depth, wgpu::LoadOp::Load)))
}

fn pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    colour: &wgpu::TextureView,
    load: wgpu::LoadOp<wgpu::Color>,
    depth: Option<(&wgpu::TextureView, wgpu::LoadOp<f32>)>,
) -> wgpu::RenderPass<'a> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: colour,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load,
                store: wgpu::StoreOp::Store,
            },
        })],
        depth_stencil_attachment: depth.map(|(view, load)| {
            wgpu::RenderPassDepthStencilAttachment {
                view,
                depth_ops: Some(wgpu::Operations {
                    load,
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }
        }),
        ..Default::default()
    })
}

/// Draws rectangles of a pipeline whose vertices need no buffers.
pub fn draw_rectangles(
    pass: &mut wgpu::RenderPass<'_>,
    device: &wgpu::Device,
    pipeline: &wgpu::RenderPipeline,
    resources: &[wgpu::BindingResource<'_>],
    instances: std::ops::Range<u32>,
) {
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, &bind(device, pipeline, resources), &[]);
    pass.draw(0..6, instances);
}

/// The resources of group 0, in the order of their bindings.
pub fn bind(
    device: &wgpu::Device,
    pipeline: &wgpu::RenderPipeline,
    resources: &[wgpu::BindingResource<'_>],
) -> wgpu::BindGroup {
    let entries: Vec<_> = resources
        .iter()
        .zip(0u32..)
        .map(|(resource, binding)| wgpu::BindGroupEntry {
            binding,
            resource: resource.clone(),
        })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries,
    })
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
