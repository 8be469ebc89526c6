//! The buffers of one view and the passes that draw it.

use super::adapter::Gpu;
use super::chunks::Chunks;
use super::layout::{Lamp, LampRow, Placement, Pose, View};
use super::pipeline::{Pipelines, bind};
use super::target::Target;
use super::tunnel::ChunkKey;
use std::mem::size_of;
use std::ops::Range;

/// A buffer that grows with what is written to it.
struct Upload {
    buffer: wgpu::Buffer,
    usage: wgpu::BufferUsages,
}

impl Upload {
    fn new(gpu: &Gpu, usage: wgpu::BufferUsages, size: usize) -> Self {
        let usage = usage | wgpu::BufferUsages::COPY_DST;
        Self {
            buffer: allocate(gpu, usage, size as u64),
            usage,
        }
    }

    /// Takes effect before anything submitted later, and after anything submitted before.
    fn write<T: bytemuck::Pod>(&mut self, gpu: &Gpu, items: &[T]) {
        let bytes: &[u8] = bytemuck::cast_slice(items);
        if bytes.is_empty() {
            return;
        }
        if (bytes.len() as u64) > self.buffer.size() {
            self.buffer = allocate(gpu, self.usage, (bytes.len() as u64).next_power_of_two());
        }
        gpu.queue.write_buffer(&self.buffer, 0, bytes);
    }

    fn binding(&self) -> wgpu::BindingResource<'_> {
        self.buffer.as_entire_binding()
    }
}

fn allocate(gpu: &Gpu, usage: wgpu::BufferUsages, size: u64) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size,
        usage,
        mapped_at_creation: false,
    })
}

/// The triangles of all bodies of a job.
pub struct BodyBuffers {
    vertices: Upload,
    indices: Upload,
    /// Range of indices of each body.
    pub ranges: Vec<Range<u32>>,
}

impl BodyBuffers {
    /// Empty.
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            vertices: Upload::new(gpu, wgpu::BufferUsages::VERTEX, 1 << 16),
            indices: Upload::new(gpu, wgpu::BufferUsages::INDEX, 1 << 16),
            ranges: Vec::new(),
        }
    }

    /// Takes the bodies of the next job.
    pub fn write(&mut self, gpu: &Gpu, mesh: &super::mesh::Mesh) {
        self.vertices.write(gpu, &mesh.vertices);
        self.indices.write(gpu, &mesh.indices);
    }
}

/// What one view of a job uploads.
pub struct ViewBuffers {
    view: Upload,
    poses: Upload,
    placements: Upload,
    lamps: Upload,
    rows: Upload,
    lamp_count: u32,
}

/// What a view uploads, made by the caller.
pub struct ViewData<'a> {
    /// Its constants.
    pub constants: View,
    /// Its poses.
    pub poses: &'a [Pose],
    /// Of the chunks, then of the bodies.
    pub placements: &'a [Placement],
    /// Its lamps.
    pub lamps: &'a [Lamp],
    /// Their rows.
    pub rows: &'a [LampRow],
}

impl ViewBuffers {
    /// Empty.
    pub fn new(gpu: &Gpu) -> Self {
        let storage = wgpu::BufferUsages::STORAGE;
        Self {
            view: Upload::new(gpu, wgpu::BufferUsages::UNIFORM, size_of::<View>()),
            poses: Upload::new(gpu, storage, 2 * size_of::<Pose>()),
            placements: Upload::new(gpu, wgpu::BufferUsages::VERTEX, 1 << 10),
            lamps: Upload::new(gpu, storage, size_of::<Lamp>()),
            rows: Upload::new(gpu, storage, size_of::<LampRow>()),
            lamp_count: 0,
        }
    }

    /// Takes the next job's view.
    pub fn write(&mut self, gpu: &Gpu, data: &ViewData<'_>) {
        self.view.write(gpu, &[data.constants]);
        self.poses.write(gpu, data.poses);
        self.placements.write(gpu, data.placements);
        self.lamps.write(gpu, data.lamps);
        self.rows.write(gpu, data.rows);
        self.lamp_count = data.lamps.len() as u32;
    }

    /// Tunnel and bodies.
    pub fn draw_background(
        &self,
        gpu: &Gpu,
        pipeline: &wgpu::RenderPipeline,
        encoder: &mut wgpu::CommandEncoder,
        target: &Target,
        (chunks, keys): (&Chunks, &[ChunkKey]),
        bodies: &BodyBuffers,
    ) {
        let group = bind(
            &gpu.device,
            pipeline,
            &[self.view.binding(), self.poses.binding()],
        );
        let mut pass = begin(
            encoder,
            &target.signal,
            wgpu::LoadOp::Clear(wgpu::Color::BLACK),
            Some(&target.depth),
        );
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.set_vertex_buffer(1, self.placements.buffer.slice(..));
        let mut instance = 0;
        for chunk in keys.iter().filter_map(|key| chunks.get(*key)) {
            pass.set_vertex_buffer(0, chunk.vertices.slice(..));
            pass.set_index_buffer(chunk.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..chunk.count, 0, instance..instance + 1);
            instance += 1;
        }
        pass.set_vertex_buffer(0, bodies.vertices.buffer.slice(..));
        pass.set_index_buffer(bodies.indices.buffer.slice(..), wgpu::IndexFormat::Uint32);
        for range in &bodies.ranges {
            pass.draw_indexed(range.clone(), 0, instance..instance + 1);
            instance += 1;
        }
    }

    /// Discs, then glare.
    pub fn draw_lamps(
        &self,
        gpu: &Gpu,
        pipelines: &Pipelines,
        encoder: &mut wgpu::CommandEncoder,
        target: &Target,
    ) {
        if self.lamp_count == 0 {
            return;
        }
        let resources = [
            self.view.binding(),
            self.lamps.binding(),
            self.rows.binding(),
            wgpu::BindingResource::TextureView(&target.depth),
        ];
        let discs = bind(&gpu.device, &pipelines.discs, &resources);
        let halos = bind(&gpu.device, &pipelines.halos, &resources[..3]);
        let mut pass = begin(encoder, &target.signal, wgpu::LoadOp::Load, None);
        for (pipeline, group) in [(&pipelines.discs, &discs), (&pipelines.halos, &halos)] {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.draw(0..6, 0..self.lamp_count);
        }
    }

    /// Noise and eight bits.
    pub fn draw_sensor(
        &self,
        gpu: &Gpu,
        pipelines: &Pipelines,
        encoder: &mut wgpu::CommandEncoder,
        target: &Target,
    ) {
        let group = bind(
            &gpu.device,
            &pipelines.sensor,
            &[
                self.view.binding(),
                wgpu::BindingResource::TextureView(&target.signal),
            ],
        );
        let load = wgpu::LoadOp::Clear(wgpu::Color::BLACK);
        let mut pass = begin(encoder, &target.packed, load, None);
        pass.set_pipeline(&pipelines.sensor);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..6, 0..1);
    }
}

fn begin<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    colour: &wgpu::TextureView,
    load: wgpu::LoadOp<wgpu::Color>,
    depth: Option<&wgpu::TextureView>,
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
        depth_stencil_attachment: depth.map(|view| wgpu::RenderPassDepthStencilAttachment {
            view,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(0.0),
                store: wgpu::StoreOp::Store,
            }),
            stencil_ops: None,
        }),
        ..Default::default()
    })
}
