//! The passes over the finished background: shadows, focus, lamps, glare and sensor.

use super::recorder::{BLACK, KEEP, Recorder};
use super::texture::Texture;

impl Recorder<'_> {
    /// Fades the background where bodies hide its light.
    pub fn draw_shadows(&mut self) {
        let (target, shadows) = (self.target, &self.view.shadows);
        let resources = [
            target.layers.depth.binding(),
            shadows.tiles.binding(),
            shadows.lists.binding(),
            shadows.sources.binding(),
            shadows.blockers.binding(),
            shadows.slabs.binding(),
        ];
        let (all, pipelines) = (shadows.tiles.instances(), &self.pipelines.shadows);
        let border = shadows.capsule_tiles as u32;
        for (pipeline, tiles) in pipelines.iter().zip([0..border, border..all.end]) {
            if !tiles.is_empty() {
                self.draw_rectangles((&target.layers.signal, KEEP), pipeline, &resources, tiles);
            }
        }
    }

    /// Blurs what is out of focus, along rows and then along columns.
    pub fn blur(&mut self) {
        let (sharp, blurred) = (&self.target.layers, &self.target.instant);
        let ways = [
            (&sharp.signal, &blurred.signal),
            (&blurred.signal, &sharp.signal),
        ];
        for (pipeline, (from, to)) in self.pipelines.focus.iter().zip(ways) {
            let resources = [from.binding(), sharp.depth.binding()];
            self.draw_rectangles((to, BLACK), pipeline, &resources, 0..1);
        }
    }

    /// Discs over the background.
    pub fn draw_lamps(&mut self) {
        let (target, table) = (self.target, &self.view.lamps);
        if table.lamps.items.is_empty() {
            return;
        }
        let resources = [
            table.lamps.binding(),
            table.rows.binding(),
            table.instants.binding(),
            target.layers.depth.binding(),
        ];
        let (discs, all) = (&self.pipelines.discs, table.lamps.instances());
        self.draw_rectangles((&target.layers.signal, KEEP), discs, &resources, all);
    }

    /// Glare, in its own texture.
    pub fn draw_glare(&mut self) {
        let table = &self.view.lamps;
        let resources = [table.glares.binding(), table.glare_rows.binding()];
        let (glare, all) = (&self.pipelines.glare, table.glares.instances());
        self.draw_rectangles((&self.target.glare, BLACK), glare, &resources, all);
    }

    /// Fixed pattern, noise and bits.
    pub fn draw_sensor(&mut self, map: &Texture, blooming: bool) {
        let target = self.target;
        target.copy_signal(self.encoder);
        let resources = [
            target.glare.binding(),
            target.signal_words.as_entire_binding(),
            map.binding(),
        ];
        let pipeline = self.pipelines.sensor(&self.gpu.device, blooming);
        // Every pixel is written, so nothing needs clearing.
        self.draw_rectangles((&target.finished, KEEP), pipeline, &resources, 0..1);
    }
}
