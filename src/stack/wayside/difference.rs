//! Background difference, threshold and noise filter.
//!
//! id = f(i) - b(i0), binary where |id| >= T, then a 3x3 median, which on a binary image is a
//! vote of nine: single pixels and lines one pixel wide (edges under camera shake) lose it.
//!
//! Headlights change the light everywhere. When a train is near, or much of the picture got
//! brighter or darker together, f is compared with g b instead, g the local gain: the ratio of
//! the mean grey of tiles, median over 5 x 5 tiles, so that an obstacle does not move it. The
//! gain is only known roughly, so T rises by a share of |g b - b|. Where a train's headlights are in the
//! picture, saturated pixels do not count: they are those lamps, and no body. Anywhere else they do.

use super::WaysideSettings;
use super::cells::{CELL_PX, GaugeCells};
use super::rails::RailHeads;
use super::reference::Reference;
use crate::bus::PixelBox;

/// Side of a gain tile.
const TILE_PX: usize = 48;
/// Rows that tile means are taken from: every fourth says enough.
const TILE_ROW_STEP: usize = 4;
/// Fixed point unit of gains.
const UNIT: f64 = 256.0;
/// Keeps the ratio of dark tiles from being a ratio of noise.
const DARK_GREY: f64 = 4.0;
/// A tile has changed when its mean has, by this share of the threshold; the light has changed
/// when this share of the tiles has.
const CHANGED_SHARE_OF_THRESHOLD: f64 = 0.25;
const CHANGED_TILES: f64 = 0.25;

/// Works on images of one size, with its own buffers.
#[derive(Clone, Debug)]
pub(super) struct Difference {
    width: usize,
    height: usize,
    threshold: u8,
    /// Of 256.
    distrust: u16,
    /// Highest grey level that counts as not saturated.
    saturated: u8,
    tiles_wide: usize,
    tiles_high: usize,
    reference_sums: Vec<(u64, u32)>,
    ratio: Vec<f64>,
    gain: Vec<f64>,
    gain_row: Vec<u16>,
    /// The last frame was compared with the reference times the gain.
    compensated: bool,
    raw: Vec<u8>,
    votes: Vec<u8>,
    /// |id|.
    pub absolute: Vec<u8>,
    /// 0 or 255.
    pub binary: Vec<u8>,
}

impl Difference {
    pub fn new(settings: &WaysideSettings, width: usize, height: usize) -> Self {
        let (tiles_wide, tiles_high) = (width.div_ceil(TILE_PX), height.div_ceil(TILE_PX));
        let tiles = tiles_wide * tiles_high;
        Self {
            width,
            height,
            threshold: settings.threshold_grey.round().clamp(1.0, 255.0) as u8,
            distrust: (settings.gain_distrust.clamp(0.0, 1.0) * 256.0) as u16,
            saturated: (settings.saturated_grey - 1.0).clamp(0.0, 255.0) as u8,
            tiles_wide,
            tiles_high,
            reference_sums: Vec::new(),
            ratio: vec![1.0; tiles],
            gain: vec![1.0; tiles],
            gain_row: vec![0; width],
            compensated: false,
            raw: vec![0; width * height],
            votes: vec![0; width],
            absolute: vec![0; width * height],
            binary: vec![0; width * height],
        }
    }

    /// Prepares for a new reference.
    pub fn set_reference(&mut self, reference: &Reference) {
        self.reference_sums = (0..self.ratio.len())
            .map(|tile| self.tile_sum(tile, &reference.mean, &reference.valid))
            .collect();
    }

    /// Fills `absolute` and `binary`. `train_near` asks for the compensation at once; `headlights` is where
    /// those of trains are in the picture.
    pub fn run(
        &mut self,
        frame: &[u8],
        reference: &Reference,
        (cells, rails): (&GaugeCells, &RailHeads),
        train_near: bool,
        headlights: &[PixelBox],
    ) {
        let changed = self.measure_gain(frame, &reference.valid);
        self.compensated = train_near || changed;
        if self.compensated {
            self.smooth_gain();
            self.compare_compensated(frame, reference);
        } else {
            self.compare(frame, reference);
        }
        for lamps in headlights {
            self.forgive_saturated(frame, lamps);
        }
        cells.clear_blind(&mut self.raw, self.width);
        rails.forgive(frame, &reference.mean, &mut self.raw);
        self.vote();
    }

    /// The plain difference of the paper.
    fn compare(&mut self, frame: &[u8], reference: &Reference) {
        let inputs = frame.iter().zip(&reference.mean).zip(&reference.valid);
        let outputs = self.absolute.iter_mut().zip(&mut self.raw);
        for (((&f, &b), &ok), (absolute, raw)) in inputs.zip(outputs) {
            let d = f.abs_diff(b);
            *absolute = d;
            *raw = u8::from(d >= self.threshold) & ok;
        }
    }

    /// Sets to 0 what is saturated in a box.
    fn forgive_saturated(&mut self, frame: &[u8], lamps: &PixelBox) {
        let columns = lamps.u0 as usize..(lamps.u1 as usize + 1).min(self.width);
        let rows = lamps.v0 as usize..(lamps.v1 as usize + 1).min(self.height);
        for v in rows {
            for k in columns.clone().map(|u| v * self.width + u) {
                if frame[k] > self.saturated {
                    self.raw[k] = 0;
                }
            }
        }
    }

    fn compare_compensated(&mut self, frame: &[u8], reference: &Reference) {
        let (threshold, distrust) = (u16::from(self.threshold), self.distrust);
        for v in 0..self.height {
            if v % CELL_PX == 0 {
                self.fill_gain_row(v);
            }
            let span = v * self.width..(v + 1) * self.width;
            let inputs = frame[span.clone()]
                .iter()
                .zip(&reference.mean[span.clone()])
                .zip(&reference.valid[span.clone()])
                .zip(&self.gain_row);
            let outputs = self.absolute[span.clone()]
                .iter_mut()
                .zip(&mut self.raw[span]);
            // All in 16 bits, which the compiler turns into vector instructions.
            for ((((&f, &b), &ok), &gain), (absolute, raw)) in inputs.zip(outputs) {
                let (f16, b16) = (u16::from(f), u16::from(b));
                let expected = ((u32::from(b16 << 8) * u32::from(gain)) >> 16) as u16;
                let expected = expected.min(255);
                let limit = threshold + ((expected.abs_diff(b16) * distrust) >> 8);
                let d = f16.abs_diff(expected);
                *absolute = d as u8;
                *raw = u8::from(d >= limit) & ok;
            }
        }
    }

    /// What the light of the last frame makes of a grey level of the reference in the cell whose first
    /// pixel is given, and by how much a body must differ from that to be found.
    pub fn expected(&self, (u, v): (usize, usize), grey: f64) -> (f64, f64) {
        let threshold = f64::from(self.threshold);
        if !self.compensated {
            return (grey, threshold);
        }
        let gain = f64::from(self.gain_at(u, v)) / UNIT;
        let expected = (grey * gain).min(255.0);
        let distrust = f64::from(self.distrust) / 256.0;
        (expected, threshold + (expected - grey).abs() * distrust)
    }

    /// Gains of the pixels of the band of cells at row `v`, fixed point.
    fn fill_gain_row(&mut self, v: usize) {
        for u in (0..self.width).step_by(CELL_PX) {
            let gain = self.gain_at(u, v);
            let end = (u + CELL_PX).min(self.width);
            self.gain_row[u..end].fill(gain);
        }
    }

    /// Ratio of tile means; true when the light changed in most of the picture.
    fn measure_gain(&mut self, frame: &[u8], valid: &[u8]) -> bool {
        let limit = CHANGED_SHARE_OF_THRESHOLD * f64::from(self.threshold);
        let (mut changed, mut known) = (0u32, 0u32);
        for tile in 0..self.ratio.len() {
            let Some(&(before, pixels)) = self.reference_sums.get(tile) else {
                return false;
            };
            let enough = pixels as usize >= TILE_PX * TILE_PX / TILE_ROW_STEP / 8;
            self.ratio[tile] = if enough {
                let (now, _) = self.tile_sum(tile, frame, valid);
                let n = f64::from(pixels);
                let (now, before) = (now as f64 / n, before as f64 / n);
                known += 1;
                changed += u32::from((now - before).abs() > limit);
                (now + DARK_GREY) / (before + DARK_GREY)
            } else {
                f64::NAN
            };
        }
        f64::from(changed) > CHANGED_TILES * f64::from(known)
    }

    /// Grey sum of the valid pixels of a tile, and their number.
    fn tile_sum(&self, tile: usize, grey: &[u8], valid: &[u8]) -> (u64, u32) {
        let (i, j) = (tile % self.tiles_wide, tile / self.tiles_wide);
        let (mut sum, mut pixels) = (0u64, 0u32);
        let (u0, v0) = (i * TILE_PX, j * TILE_PX);
        let u1 = (u0 + TILE_PX).min(self.width);
        for v in (v0..(v0 + TILE_PX).min(self.height)).step_by(TILE_ROW_STEP) {
            let span = v * self.width + u0..v * self.width + u1;
            let (mut row_sum, mut row_pixels) = (0u32, 0u32);
            for (&g, &ok) in grey[span.clone()].iter().zip(&valid[span]) {
                row_sum += u32::from(g) * u32::from(ok);
                row_pixels += u32::from(ok);
            }
            sum += u64::from(row_sum);
            pixels += row_pixels;
        }
        (sum, pixels)
    }

    fn smooth_gain(&mut self) {
        let (wide, high) = (self.tiles_wide, self.tiles_high);
        for j in 0..high {
            for i in 0..wide {
                let (mut near, mut known) = ([0.0; 25], 0);
                for y in j.saturating_sub(2)..(j + 3).min(high) {
                    for x in i.saturating_sub(2)..(i + 3).min(wide) {
                        let ratio = self.ratio[y * wide + x];
                        if ratio.is_finite() {
                            near[known] = ratio;
                            known += 1;
                        }
                    }
                }
                let near = &mut near[..known];
                near.sort_unstable_by(f64::total_cmp);
                let median = near.get(known / 2).copied();
                self.gain[j * wide + i] = median.unwrap_or(1.0);
            }
        }
    }

    /// Gain in the middle of the cell at a pixel, bilinear between tile centres, fixed point.
    fn gain_at(&self, u: usize, v: usize) -> u16 {
        let place = |p: usize, tiles: usize| {
            let x = (p as f64 / TILE_PX as f64 - 0.5).clamp(0.0, tiles as f64 - 1.0);
            let k = (x as usize).min(tiles.saturating_sub(2));
            (k, (k + 1).min(tiles - 1), x - k as f64)
        };
        let (i, i1, x) = place(u + CELL_PX / 2, self.tiles_wide);
        let (j, j1, y) = place(v + CELL_PX / 2, self.tiles_high);
        let at = |i: usize, j: usize| self.gain[j * self.tiles_wide + i];
        let upper = at(i, j) + (at(i1, j) - at(i, j)) * x;
        let lower = at(i, j1) + (at(i1, j1) - at(i, j1)) * x;
        ((upper + (lower - upper) * y) * UNIT)
            .round()
            .clamp(0.0, 65535.0) as u16
    }

    /// 3x3 median of the raw binary image; the outermost pixels become 0.
    fn vote(&mut self) {
        let (w, h) = (self.width, self.height);
        self.binary.fill(0);
        if w < 3 {
            return;
        }
        for v in 1..h.saturating_sub(1) {
            let row = |k: usize| &self.raw[k * w..(k + 1) * w];
            let (above, here, below) = (row(v - 1), row(v), row(v + 1));
            let columns = above.iter().zip(here).zip(below);
            for (vote, ((&a, &b), &c)) in self.votes.iter_mut().zip(columns) {
                *vote = a + b + c;
            }
            let out = &mut self.binary[v * w + 1..(v + 1) * w - 1];
            let left = self.votes.iter();
            let (mid, right) = (&self.votes[1..], &self.votes[2..]);
            for (out, ((&a, &b), &c)) in out.iter_mut().zip(left.zip(mid).zip(right)) {
                *out = if a + b + c >= 5 { 255 } else { 0 };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::sight::Sight;
    use super::super::test_scene::{calibration, track, words};
    use super::*;

    fn random(len: usize, seed: u32, modulus: u32) -> Vec<u8> {
        (0..len)
            .map(|k| (words(seed, k as u32, 5)[0] % modulus) as u8)
            .collect()
    }

    /// Nine pixels counted one by one.
    fn slow_vote(raw: &[u8], w: usize, h: usize) -> Vec<u8> {
        let mut out = vec![0; w * h];
        for v in 1..h - 1 {
            for u in 1..w - 1 {
                let votes = (0..9).filter(|k| raw[(v + k / 3 - 1) * w + u + k % 3 - 1] != 0);
                out[v * w + u] = if votes.count() >= 5 { 255 } else { 0 };
            }
        }
        out
    }

    /// Random images against the definition, pixel by pixel, with and without compensation; odd
    /// sizes provoke a wrong stride or a lost last cell. The gains are the filter's own (what
    /// they should be is a matter of the drawn scenes).
    #[test]
    fn fast_equals_obvious() {
        let settings = WaysideSettings::default();
        for (w, h) in [(101usize, 67usize), (8, 9), (160, 96)] {
            let map = track(0.0);
            let sight = Sight::new(
                &settings,
                calibration(&map, w as u32, h as u32),
                map.clone(),
            );
            let cells = GaugeCells::new(&sight, w, h);
            let reference = random(w * h, 1, 200);
            let valid = random(w * h, 2, 2);
            let mut learnt = Reference::new(&settings, 0);
            (learnt.mean, learnt.valid) = (reference.clone(), valid.clone());
            // Mostly equal, some pixels just under, at and over the threshold.
            let frame: Vec<u8> = reference
                .iter()
                .zip(random(w * h, 3, 30))
                .map(|(&b, d)| b.saturating_add(d))
                .collect();
            let lamps = PixelBox {
                u0: 3,
                v0: 2,
                u1: w as u32 / 2,
                v1: h as u32 + 5,
            };
            for train_near in [false, true] {
                let mut fast = Difference::new(&settings, w, h);
                fast.set_reference(&learnt);
                let compensated = train_near || fast.measure_gain(&frame, &valid);
                let headlights = if train_near { &[lamps][..] } else { &[] };
                let places = (&cells, &RailHeads::default());
                fast.run(&frame, &learnt, places, train_near, headlights);
                let mut raw = vec![0u8; w * h];
                for k in 0..w * h {
                    let (u, v) = (k % w / CELL_PX * CELL_PX, k / w / CELL_PX * CELL_PX);
                    let gain = if compensated {
                        f64::from(fast.gain_at(u, v)) / UNIT
                    } else {
                        1.0
                    };
                    let (f, b) = (f64::from(frame[k]), f64::from(reference[k]));
                    let expected = (b * gain).floor().min(255.0);
                    let distrust = f64::from(fast.distrust) / 256.0;
                    let limit = 15.0 + ((expected - b).abs() * distrust).floor();
                    let in_lamps = (3..=w / 2).contains(&(k % w)) && k / w >= 2;
                    let dazzled = train_near && in_lamps && f >= settings.saturated_grey;
                    assert_eq!(fast.absolute[k], (f - expected).abs() as u8);
                    raw[k] = u8::from((f - expected).abs() >= limit && !dazzled) * valid[k];
                }
                assert_eq!(
                    fast.binary,
                    slow_vote(&raw, w, h),
                    "{w} x {h}, {train_near}"
                );
            }
        }
    }

    /// A line one pixel wide (an edge under camera shake) loses the vote, a block of 3 x 3 stays
    /// but for its corners.
    #[test]
    fn thin_lines_lose_the_vote() {
        let settings = WaysideSettings::default();
        let mut d = Difference::new(&settings, 20, 20);
        for k in 0..20 {
            d.raw[k * 20 + 5] = 1;
        }
        d.vote();
        assert!(d.binary.iter().all(|&p| p == 0));
        for v in 8..11 {
            d.raw[v * 20 + 12..v * 20 + 15].fill(1);
        }
        d.vote();
        assert_eq!(d.binary.iter().filter(|&&p| p != 0).count(), 5);
    }
}
