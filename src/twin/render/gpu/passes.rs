//! The passes over the finished background: focus, lamps, glare and sensor.

use super::adapter::Gpu;
use super::pipeline::Pipelines;
use super::render_pass::{BLACK, KEEP, begin, draw_rectangles};
use super::target::Target;
use super::view_buffers::ViewBuffers;
use wgpu::BindingResource::TextureView;

impl ViewBuffers {
    /// Blurs what is out of focus, along rows and then along columns.
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
                TextureView(from),
                TextureView(&sharp.depth),
            ];
            let mut pass = begin(encoder, to, BLACK, None);
            draw_rectangles(&mut pass, &gpu.device, pipeline, &resources, 0..1);
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
        if self.lamps.count == 0 {
            return;
        }
        let resources = [
            self.view.binding(),
            self.lamps.binding(),
            self.rows.binding(),
            self.instants.binding(),
            TextureView(&target.layers.depth),
        ];
        let mut pass = begin(encoder, &target.layers.signal, KEEP, None);
        let all = 0..self.lamps.count;
        draw_rectangles(&mut pass, &gpu.device, &pipelines.discs, &resources, all);
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
        if self.glares.count == 0 {
            return;
        }
        let resources = [
            self.view.binding(),
            self.glares.binding(),
            self.glare_rows.binding(),
        ];
        let all = 0..self.glares.count;
        draw_rectangles(&mut pass, &gpu.device, &pipelines.glare, &resources, all);
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
        let resources = [
            self.view.binding(),
            TextureView(&target.glare),
            target.signal_words.as_entire_binding(),
            TextureView(map),
        ];
        // Every pixel is written, so nothing needs clearing.
        let mut pass = begin(encoder, target.finished(raw), KEEP, None);
        draw_rectangles(&mut pass, &gpu.device, pipeline, &resources, 0..1);
    }
}
