//! The passes in their order, and those over the finished background: shadows, focus, lamps, glare, sensor.

use super::background::Surfaces;
use super::layout::{MAX_BLOCKERS, MAX_SLABS, MAX_SOURCES, MAX_WORDS};
use super::pipeline::Kind;
use super::recorder::{BLACK, KEEP, Recorder};
use super::texture::Texture;
use wgpu::Buffer;

impl Recorder<'_> {
    /// All that comes before the sensor, under so many headlights.
    pub fn draw_signal(&mut self, headlights: usize, surfaces: &Surfaces<'_>, blurred: bool) {
        self.draw_background(headlights, surfaces);
        self.draw_shadows();
        self.draw_gloss(headlights, surfaces);
        if blurred {
            self.blur();
        }
        self.draw_lamps();
        self.draw_glare();
    }

    /// Fades the background where bodies hide its light.
    fn draw_shadows(&mut self) {
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
        let (border, end) = (shadows.capsule_tiles as u32, shadows.tiles.len() as u32);
        for (others, tiles) in [(false, 0..border), (true, border..end)] {
            if !tiles.is_empty() {
                let onto = (&target.layers.signal, KEEP);
                self.draw_rectangles("shadows", onto, Kind::Shadows { others }, &resources, tiles);
            }
        }
    }

    /// Blurs what is out of focus, along rows and then along columns.
    fn blur(&mut self) {
        let (sharp, blurred) = (&self.target.layers, &self.target.instant);
        let ways = [(&sharp.signal, blurred), (blurred, &sharp.signal)];
        for (down, (from, to)) in [false, true].into_iter().zip(ways) {
            let resources = [from.binding(), sharp.depth.binding()];
            self.draw_rectangles("focus", (to, BLACK), Kind::Focus { down }, &resources, 0..1);
        }
    }

    /// Discs over the background.
    fn draw_lamps(&mut self) {
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
        let (onto, all) = ((&target.layers.signal, KEEP), 0..table.lamps.len() as u32);
        self.draw_rectangles("lamps", onto, Kind::Discs, &resources, all);
    }

    /// Glare, in its own texture.
    fn draw_glare(&mut self) {
        let (gpu, table) = (self.gpu, &self.view.lamps);
        let tables = [gpu.storage(&table.glares), gpu.storage(&table.glare_rows)];
        let resources = tables.each_ref().map(Buffer::as_entire_binding);
        let (onto, all) = ((&self.target.glare, BLACK), 0..table.glares.len() as u32);
        self.draw_rectangles("glare", onto, Kind::Glare, &resources, all);
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
        // Every pixel is written, so nothing needs clearing.
        let (onto, sensor) = ((&finishing.finished, KEEP), Kind::Sensor { blooming });
        self.draw_rectangles("sensor", onto, sensor, &resources, 0..1);
    }
}
