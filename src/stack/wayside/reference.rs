//! The reference image b(i0): learnt while the track is known to be clear, and held.
//!
//! Held, because an adaptive background swallows an obstacle that stays. The mean over some
//! frames takes the noise out of it; pixels that are saturated or unstable meanwhile (lamps) can
//! tell nothing later and are left out.

use super::WaysideSettings;

/// Learns the reference, then keeps it.
#[derive(Clone, Debug)]
pub(super) struct Reference {
    frames: u32,
    wanted: u32,
    sum: Vec<u16>,
    least: Vec<u8>,
    most: Vec<u8>,
    /// The reference image.
    pub mean: Vec<u8>,
    /// 1 where a pixel can be compared, 0 where it is left out.
    pub valid: Vec<u8>,
}

impl Reference {
    pub fn new(settings: &WaysideSettings, pixels: usize) -> Self {
        Self {
            frames: 0,
            // 257 frames of 255 would overflow the sums.
            wanted: settings.reference_frames.clamp(1, 250),
            sum: vec![0; pixels],
            least: vec![u8::MAX; pixels],
            most: vec![0; pixels],
            mean: vec![0; pixels],
            valid: vec![0; pixels],
        }
    }

    pub fn ready(&self) -> bool {
        self.frames >= self.wanted
    }

    /// Adds a frame; with the last one the reference is made.
    pub fn learn(&mut self, grey: &[u8], settings: &WaysideSettings) {
        let stats = self.sum.iter_mut().zip(&mut self.least).zip(&mut self.most);
        for (((sum, least), most), &g) in stats.zip(grey) {
            *sum += u16::from(g);
            *least = g.min(*least);
            *most = g.max(*most);
        }
        self.frames += 1;
        if self.ready() {
            self.finish(settings);
        }
    }

    fn finish(&mut self, settings: &WaysideSettings) {
        let n = self.wanted;
        for k in 0..self.sum.len() {
            self.mean[k] = ((u32::from(self.sum[k]) + n / 2) / n) as u8;
            let stable = f64::from(self.most[k] - self.least[k]) < settings.unstable_grey;
            let clear = f64::from(self.most[k]) < settings.saturated_grey;
            self.valid[k] = u8::from(stable && clear);
        }
        self.sum = Vec::new();
        self.least = Vec::new();
        self.most = Vec::new();
    }

    /// Leaves out every pixel for which `keep` (given column and row) is false.
    pub fn restrict(&mut self, width: usize, keep: impl Fn(usize, usize) -> bool) {
        for (v, row) in self.valid.chunks_exact_mut(width.max(1)).enumerate() {
            for (u, valid) in row.iter_mut().enumerate() {
                *valid &= u8::from(keep(u, v));
            }
        }
    }
}
