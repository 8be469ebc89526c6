//! The passes over the finished background: shadows, focus, lamps, glare and sensor.

use super::layout::{MAX_BLOCKERS, MAX_SLABS, MAX_SOURCES, MAX_WORDS};
use super::recorder::{BLACK, KEEP, Recorder};
use super::texture::Texture;
use wgpu::Buffer;

impl Recorder<'_> {
    /// Fades the background where bodies hide its light.
    pub fn draw_shadows(&mut self) {
        let (gpu, target, shadows) = (self.gpu, self.target, &self.view.shadows);
        if shadows.tiles.is_empty() {
            return;
        }
        let uniform = wgpu::BufferUsages::UNIFORM;
        let tables = [
            gpu.storage(&shadows.tiles),
            gpu.upload(uniform, &shadows.lists, MAX_WORDS),
            gpu.upload(uniform, &shadows.sources, MAX_SOURCES),
            gpu.upload(uniform, &shadows.blockers, MAX_BLOCKERS),
            gpu.upload(uniform, &shadows.slabs, MAX_SLABS),
        ];
        let [tiles, lists, sources, blockers, slabs] =
            tables.each_ref().map(Buffer::as_entire_binding);
        let depth = self.depth().binding();
        let resources = [depth, tiles, lists, sources, blockers, slabs];
        let pipelines = &self.pipelines.shadows;
        let (border, end) = (shadows.capsule_tiles as u32, shadows.tiles.len() as u32);
        for (pipeline, tiles) in pipelines.iter().zip([0..border, border..end]) {
            if !tiles.is_empty() {
                self.draw_rectangles(
                    "shadows",
                    (&target.layers.signal, KEEP),
                    pipeline,
                    &resources,
                    tiles,
                );
            }
        }
    }

    /// Blurs what is out of focus, along rows and then along columns.
    pub fn blur(&mut self) {
        let (sharp, blurred) = (&self.target.layers, &self.target.instant);
        let ways = [(&sharp.signal, blurred), (blurred, &sharp.signal)];
        for (pipeline, (from, to)) in self.pipelines.focus.iter().zip(ways) {
            let resources = [from.binding(), sharp.depth.binding()];
            self.draw_rectangles("focus", (to, BLACK), pipeline, &resources, 0..1);
        }
    }

    /// Discs over the background.
    pub fn draw_lamps(&mut self) {
        let (gpu, target, table) = (self.gpu, self.target, &self.view.lamps);
        if table.lamps.is_empty() {
            return;
        }
        let tables = [
            gpu.storage(&table.lamps),
            gpu.storage(&table.rows),
            gpu.storage(&table.instants),
        ];
        let [lamps, rows, instants] = tables.each_ref().map(Buffer::as_entire_binding);
        let resources = [lamps, rows, instants, self.depth().binding()];
        let (discs, all) = (&self.pipelines.discs, 0..table.lamps.len() as u32);
        self.draw_rectangles(
            "lamps",
            (&target.layers.signal, KEEP),
            discs,
            &resources,
            all,
        );
    }

    /// Glare, in its own texture.
    pub fn draw_glare(&mut self) {
        let (gpu, table) = (self.gpu, &self.view.lamps);
        let tables = [gpu.storage(&table.glares), gpu.storage(&table.glare_rows)];
        let resources = tables.each_ref().map(Buffer::as_entire_binding);
        let (glare, all) = (&self.pipelines.glare, 0..table.glares.len() as u32);
        self.draw_rectangles("glare", (&self.target.glare, BLACK), glare, &resources, all);
    }

    /// Fixed pattern, noise and bits.
    pub fn draw_sensor(&mut self, map: &Texture, blooming: bool) {
        let target = self.target;
        let finishing = target.finishing(&self.gpu.device);
        target.copy_signal(finishing, self.passes.encoder);
        let resources = [
            target.glare.binding(),
            finishing.signal_words.as_entire_binding(),
            map.binding(),
        ];
        let pipeline = self.pipelines.sensor(&self.gpu.device, blooming);
        // Every pixel is written, so nothing needs clearing.
        self.draw_rectangles(
            "sensor",
            (&finishing.finished, KEEP),
            pipeline,
            &resources,
            0..1,
        );
    }
}
