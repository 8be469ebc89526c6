//! The buffers of one view and the passes that draw it.

use super::adapter::Gpu;
use super::backdrop::{Backdrops, Key};
use super::chunks::Chunks;
use super::lamps::LampTable;
use super::layout::{Glare, GlareRow, Instant, Lamp, LampRow, Mirrored, Pose, View};
use super::pipeline::{Background, Pipelines, bind};
use super::shadows::{ShadowBuffers, Shadows};
use super::sight::{Draw, Sight};
use super::target::{Layers, Target};
use super::textures::Textures;
use super::upload::{Table, Upload};
use std::mem::size_of;
use std::ops::Range;

const BLACK: wgpu::LoadOp<wgpu::Color> = wgpu::LoadOp::Clear(wgpu::Color::BLACK);

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
    pub(super) view: Upload,
    poses: Upload,
    shares: Table,
    placements: Upload,
    mirrored: Upload,
    lamps: Upload,
    rows: Upload,
    instants: Upload,
    lamp_count: u32,
    glares: Upload,
    glare_rows: Upload,
    glare_count: u32,
    pub(super) shadows: ShadowBuffers,
    /// Signal where nothing is drawn: of the air before what is too far away.
    beyond_e: f64,
}

/// What a view uploads, made by the caller.
pub struct ViewData<'a> {
    /// Its constants.
    pub constants: View,
    /// Its poses.
    pub poses: &'a [Pose],
    /// Tunnel and bodies.
    pub sight: &'a Sight,
    /// Its lamps.
    pub lamps: &'a LampTable,
    /// Shadows of bodies.
    pub shadows: &'a Shadows,
    /// Signal where nothing is drawn.
    pub beyond_e: f64,
}

/// The background's pipelines that a view uses, with their bind groups.
struct Brushes<'a> {
    lit: &'a wgpu::RenderPipeline,
    /// One a texture.
    paintings: Vec<wgpu::BindGroup>,
    dim: &'a wgpu::RenderPipeline,
    constants: wgpu::BindGroup,
}

/// What stands behind the draws of a view.
pub struct Stock<'a> {
    /// Meshes of the tunnel.
    pub chunks: &'a Chunks,
    /// Meshes of the bodies.
    pub bodies: &'a BodyBuffers,
    /// What is painted on the tunnel.
    pub textures: &'a Textures,
}

impl Stock<'_> {
    /// Chooses what a draw's triangles are made of, if it is there.
    fn set_buffers(&self, pass: &mut wgpu::RenderPass<'_>, draw: &Draw) -> bool {
        let (vertices, indices) = match draw.chunk.map(|key| self.chunks.get(key)) {
            Some(None) => return false,
            Some(Some(chunk)) => (&chunk.vertices, &chunk.indices),
            None => (&self.bodies.vertices.buffer, &self.bodies.indices.buffer),
        };
        pass.set_vertex_buffer(0, vertices.slice(..));
        pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
        true
    }
}

impl ViewBuffers {
    /// Empty.
    pub fn new(gpu: &Gpu) -> Self {
        let storage = wgpu::BufferUsages::STORAGE;
        Self {
            view: Upload::new(gpu, wgpu::BufferUsages::UNIFORM, size_of::<View>()),
            poses: Upload::new(gpu, storage, 2 * size_of::<Pose>()),
            shares: Table::new(gpu),
            placements: Upload::new(gpu, wgpu::BufferUsages::VERTEX, 1 << 10),
            mirrored: Upload::new(gpu, storage, size_of::<Mirrored>()),
            lamps: Upload::new(gpu, storage, size_of::<Lamp>()),
            rows: Upload::new(gpu, storage, size_of::<LampRow>()),
            instants: Upload::new(gpu, storage, size_of::<Instant>()),
            lamp_count: 0,
            glares: Upload::new(gpu, storage, size_of::<Glare>()),
            glare_rows: Upload::new(gpu, storage, size_of::<GlareRow>()),
            glare_count: 0,
            shadows: ShadowBuffers::new(gpu),
            beyond_e: 0.0,
        }
    }

    /// Takes the next job's view.
    pub fn write(&mut self, gpu: &Gpu, data: &ViewData<'_>) {
        self.view.write(gpu, &[data.constants]);
        self.poses.write(gpu, data.poses);
        let rows = data.constants.size_px[1] as u32;
        self.shares.write(gpu, &data.sight.shares, rows);
        self.placements.write(gpu, &data.sight.placements);
        self.mirrored.write(gpu, &data.sight.mirrored);
        let table = data.lamps;
        self.lamps.write(gpu, &table.lamps);
        self.rows.write(gpu, &table.rows);
        self.instants.write(gpu, &table.instants);
        self.lamp_count = table.lamps.len() as u32;
        self.glares.write(gpu, &table.glares);
        self.glare_rows.write(gpu, &table.glare_rows);
        self.glare_count = table.glares.len() as u32;
        self.shadows.write(gpu, data.shadows);
        self.beyond_e = data.beyond_e;
    }

    fn brushes<'a>(
        &self,
        gpu: &Gpu,
        background: &'a Background,
        sight: &Sight,
        stock: &Stock<'_>,
    ) -> Brushes<'a> {
        let lit = if sight.banded {
            &background.banded
        } else {
            &background.lit
        };
        let paintings = (stock.textures.views.iter())
            .map(|painting| {
                let resources = [
                    self.view.binding(),
                    self.poses.binding(),
                    self.shares.binding(),
                    wgpu::BindingResource::TextureView(painting),
                    wgpu::BindingResource::Sampler(&stock.textures.sampler),
                ];
                bind(&gpu.device, lit, &resources)
            })
            .collect();
        let constants = [self.view.binding(), self.poses.binding()];
        Brushes {
            lit,
            paintings,
            dim: &background.dim,
            constants: bind(&gpu.device, &background.dim, &constants),
        }
    }

    /// Tunnel and bodies in the mean over the exposure; with the pipelines for what no headlight
    /// lights and for what they light. A tunnel with a key is kept for the next frame.
    pub fn draw_background(
        &self,
        gpu: &Gpu,
        (pipelines, backgrounds): (&Pipelines, &[Background; 2]),
        encoder: &mut wgpu::CommandEncoder,
        (target, backdrops): (&Target, &mut Backdrops),
        (sight, key): (&Sight, Option<Key>),
        stock: &Stock<'_>,
    ) {
        let headlit = sight.draws.iter().any(|draw| draw.headlit);
        let used = &backgrounds[..=usize::from(headlit)];
        let brushes: Vec<_> = (used.iter())
            .map(|b| self.brushes(gpu, b, sight, stock))
            .collect();
        let (tunnel, bodies) = sight.draws.split_at(sight.tunnel().count());
        let empty = wgpu::LoadOp::Clear(wgpu::Color {
            r: self.beyond_e,
            ..wgpu::Color::BLACK
        });
        let mut draw = |encoder: &mut _, layers: &Layers, k| {
            let Some(key) = &key else {
                let mut pass = begin(encoder, &layers.signal, empty, Some(&layers.depth));
                sight.moving.clip(&mut pass, k > 0);
                self.draw_instant(&mut pass, &brushes, (sight, &sight.draws), stock, k);
                return;
            };
            if !backdrops.show(key, layers, encoder) {
                let mut pass = begin(encoder, &layers.signal, empty, Some(&layers.depth));
                self.draw_instant(&mut pass, &brushes, (sight, tunnel), stock, k);
                drop(pass);
                backdrops.keep(gpu, key.clone(), layers, encoder);
            }
            let mut pass = resume(encoder, &layers.signal, &layers.depth);
            sight.moving.clip(&mut pass, k > 0);
            self.draw_instant(&mut pass, &brushes, (sight, bodies), stock, k);
        };
        draw(encoder, &target.layers, 0);
        for k in 1..sight.instants {
            let instant = target.instant(&gpu.device);
            draw(encoder, instant, k);
            let resources = [
                self.view.binding(),
                wgpu::BindingResource::TextureView(&instant.signal),
            ];
            let group = bind(&gpu.device, &pipelines.blend, &resources);
            let mut pass = begin(encoder, &target.layers.signal, wgpu::LoadOp::Load, None);
            pass.set_pipeline(&pipelines.blend);
            pass.set_bind_group(0, &group, &[]);
            sight.moving.clip(&mut pass, true);
            // A running mean: rounding to half precision does not add up.
            pass.set_blend_constant(grey(1.0 / f64::from(k + 1)));
            pass.draw(0..6, 0..1);
        }
    }

    fn draw_instant(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        brushes: &[Brushes<'_>],
        (sight, draws): (&Sight, &[Draw]),
        stock: &Stock<'_>,
        instant: u32,
    ) {
        pass.set_vertex_buffer(1, self.placements.buffer.slice(..));
        for draw in draws {
            if !stock.set_buffers(pass, draw) {
                continue;
            }
            let at = instant * sight.meshes + draw.mesh;
            let brushes = &brushes[usize::from(draw.headlit)];
            if !draw.lit.is_empty() {
                pass.set_pipeline(brushes.lit);
                pass.set_bind_group(0, &brushes.paintings[draw.texture], &[]);
                pass.draw_indexed(draw.lit.clone(), 0, at..at + 1);
            }
            if !draw.dim.is_empty() {
                pass.set_pipeline(brushes.dim);
                pass.set_bind_group(0, &brushes.constants, &[]);
                pass.draw_indexed(draw.dim.clone(), 0, at..at + 1);
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
        (sight, stock): (&Sight, &Stock<'_>),
    ) {
        let mut glossy = (sight.draws.iter())
            .filter(|draw| !draw.glossy.is_empty())
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
        pass.set_blend_constant(grey(1.0 / f64::from(sight.instants)));
        pass.set_vertex_buffer(1, self.placements.buffer.slice(..));
        for draw in glossy {
            if stock.set_buffers(&mut pass, draw) {
                for instant in 0..sight.instants {
                    let at = instant * sight.meshes + draw.mesh;
                    pass.draw_indexed(draw.glossy.clone(), 0, at..at + 1);
                }
            }
        }
    }

    /// Blurs what is out of focus.
    pub fn blur(
        &self,
        gpu: &Gpu,
        pipelines: &Pipelines,
        encoder: &mut wgpu::CommandEncoder,
        target: &Target,
    ) {
        let (sharp, blurred) = (&target.layers, target.instant(&gpu.device));
        let ways = [
            (&sharp.signal, &blurred.signal),
            (&blurred.signal, &sharp.signal),
        ];
        for (pipeline, (from, to)) in pipelines.focus.iter().zip(ways) {
            let resources = [
                self.view.binding(),
                wgpu::BindingResource::TextureView(from),
                wgpu::BindingResource::TextureView(&sharp.depth),
            ];
            let group = bind(&gpu.device, pipeline, &resources);
            let mut pass = begin(encoder, to, BLACK, None);
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.draw(0..6, 0..1);
        }
    }

    /// Discs over the background.
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
            self.instants.binding(),
            wgpu::BindingResource::TextureView(&target.layers.depth),
        ];
        let group = bind(&gpu.device, &pipelines.discs, &resources);
        let mut pass = begin(encoder, &target.layers.signal, wgpu::LoadOp::Load, None);
        pass.set_pipeline(&pipelines.discs);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..6, 0..self.lamp_count);
    }

    /// Glare, in its own texture.
    pub fn draw_glare(
        &self,
        gpu: &Gpu,
        pipelines: &Pipelines,
        encoder: &mut wgpu::CommandEncoder,
        target: &Target,
    ) {
        let mut pass = begin(encoder, &target.glare, BLACK, None);
        if self.glare_count == 0 {
            return;
        }
        let resources = [
            self.view.binding(),
            self.glares.binding(),
            self.glare_rows.binding(),
        ];
        let group = bind(&gpu.device, &pipelines.glare, &resources);
        pass.set_pipeline(&pipelines.glare);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..6, 0..self.glare_count);
    }

    /// Fixed pattern, noise and bits.
    pub fn draw_sensor(
        &self,
        gpu: &Gpu,
        pipeline: &wgpu::RenderPipeline,
        encoder: &mut wgpu::CommandEncoder,
        (target, map): (&Target, &wgpu::TextureView),
        raw: bool,
    ) {
        let group = bind(
            &gpu.device,
            pipeline,
            &[
                self.view.binding(),
                wgpu::BindingResource::TextureView(&target.glare),
                target.signal_words.as_entire_binding(),
                wgpu::BindingResource::TextureView(map),
            ],
        );
        // Every pixel is written, so nothing needs clearing.
        let finished = target.finished(raw);
        let mut pass = begin(encoder, finished, wgpu::LoadOp::Load, None);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..6, 0..1);
    }
}

fn grey(share: f64) -> wgpu::Color {
    wgpu::Color {
        r: share,
        g: share,
        b: share,
        a: share,
    }
}

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
fn resume<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    colour: &wgpu::TextureView,
    depth: &wgpu::TextureView,
) -> wgpu::RenderPass<'a> {
    let load = wgpu::LoadOp::Load;
    pass(encoder, colour, wgpu::LoadOp::Load, Some((depth, load)))
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
