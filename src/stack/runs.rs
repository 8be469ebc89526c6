//! Connected regions of a binary image, by runs and union-find, 8-connected.

use crate::bus::{Blob, PixelBox};
use std::collections::BTreeMap;
use std::ops::Range;

/// Set pixels of one row, side by side.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    /// Row.
    pub v: u32,
    /// First and last column.
    pub u: (u32, u32),
}

impl From<&Run> for Blob {
    fn from(run: &Run) -> Self {
        Self {
            bounds: PixelBox::of_row(run.v, run.u),
            area_px: run.u.1 - run.u.0 + 1,
        }
    }
}

/// The runs of a binary image from the top, and which of them belong together.
#[derive(Clone, Debug, Default)]
pub struct Runs {
    /// In order of rows and columns.
    pub all: Vec<Run>,
    parent: Vec<usize>,
}

impl Runs {
    /// Of the set pixels for whose index `keep` is true. Runs that touch, if only at a corner, belong
    /// together, and so do those with up to `gap_rows` rows between them.
    pub fn new(binary: &[u8], width: usize, gap_rows: usize, keep: impl Fn(usize) -> bool) -> Self {
        let mut runs = Self::default();
        let width = width.max(1);
        let mut first_in_reach = 0;
        for (v, row) in binary.chunks_exact(width).enumerate() {
            let too_far = |run: &Run| run.v as usize + gap_rows + 1 < v;
            while runs.all.get(first_in_reach).is_some_and(too_far) {
                first_in_reach += 1;
            }
            let above = first_in_reach..runs.all.len();
            let kept = |u: usize| row[u] != 0 && keep(v * width + u);
            let mut u = 0;
            while let Some(start) = next_set(row, u) {
                u = start + 1;
                if !kept(start) {
                    continue;
                }
                while u < width && kept(u) {
                    u += 1;
                }
                let run = Run {
                    v: v as u32,
                    u: (start as u32, (u - 1) as u32),
                };
                runs.add(run, above.clone());
            }
        }
        runs
    }

    fn add(&mut self, run: Run, above: Range<usize>) {
        let here = self.all.len();
        self.all.push(run);
        self.parent.push(here);
        for k in above {
            let other = self.all[k].u;
            if other.0 <= run.u.1 + 1 && other.1 + 1 >= run.u.0 {
                let (a, b) = (self.region(k), self.region(here));
                self.parent[a.max(b)] = a.min(b);
            }
        }
    }

    /// Number of the region of a run: that of its first run.
    pub fn region(&mut self, mut run: usize) -> usize {
        while self.parent[run] != run {
            self.parent[run] = self.parent[self.parent[run]];
            run = self.parent[run];
        }
        run
    }

    /// Bounds and area of each region, by its number.
    pub fn blobs(&mut self) -> BTreeMap<usize, Blob> {
        let mut blobs: BTreeMap<usize, Blob> = BTreeMap::new();
        for k in 0..self.all.len() {
            let piece = Blob::from(&self.all[k]);
            let blob = blobs.entry(self.region(k));
            blob.and_modify(|blob| *blob = joined(blob, &piece))
                .or_insert(piece);
        }
        blobs
    }
}

/// Two regions as one.
pub fn joined(a: &Blob, b: &Blob) -> Blob {
    Blob {
        bounds: a.bounds.joined(&b.bounds),
        area_px: a.area_px + b.area_px,
    }
}

/// First non-zero pixel from `from` on; whole words of zeros are skipped at once.
fn next_set(row: &[u8], from: usize) -> Option<usize> {
    let mut at = from;
    for word in row.get(from..)?.chunks(16) {
        if word.iter().fold(0, |any, &p| any | p) != 0 {
            return word.iter().position(|&p| p != 0).map(|k| at + k);
        }
        at += word.len();
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Flood fill, the obvious way.
    fn slow(binary: &[u8], width: usize, gap_rows: usize) -> Vec<(PixelBox, u32)> {
        let height = binary.len() / width;
        let mut seen = vec![false; binary.len()];
        let mut found = Vec::new();
        for start in 0..binary.len() {
            if binary[start] == 0 || seen[start] {
                continue;
            }
            let mut stack = vec![start];
            seen[start] = true;
            let (mut b, mut area) = (
                PixelBox {
                    u0: u32::MAX,
                    v0: u32::MAX,
                    u1: 0,
                    v1: 0,
                },
                0,
            );
            while let Some(p) = stack.pop() {
                let (u, v) = (p % width, p / width);
                area += 1;
                b.u0 = b.u0.min(u as u32);
                b.u1 = b.u1.max(u as u32);
                b.v0 = b.v0.min(v as u32);
                b.v1 = b.v1.max(v as u32);
                for y in v.saturating_sub(gap_rows + 1)..(v + gap_rows + 2).min(height) {
                    for x in u.saturating_sub(1)..(u + 2).min(width) {
                        let q = y * width + x;
                        if binary[q] != 0 && !seen[q] {
                            seen[q] = true;
                            stack.push(q);
                        }
                    }
                }
            }
            found.push((b, area));
        }
        found
    }

    /// Random images with many touching corners and U shapes provoke a wrong union of labels;
    /// widths that are no multiple of a word provoke a wrong skip of zeros; gaps, a row too few or
    /// too many.
    #[test]
    fn runs_equal_flood_fill() {
        let mut state = 1u64;
        let mut uniform = || {
            // Knuth's MMIX generator.
            state = state.wrapping_mul(6_364_136_223_846_793_005);
            state = state.wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / (1u64 << 24) as f64
        };
        for width in [1, 7, 33, 64, 101] {
            for (density, gap_rows) in [(0.03, 0), (0.1, 0), (0.4, 0), (0.01, 2), (0.03, 5)] {
                let binary: Vec<u8> = (0..width * 40)
                    .map(|_| 255 * u8::from(uniform() < density))
                    .collect();
                let blobs = Runs::new(&binary, width, gap_rows, |_| true).blobs();
                let fast: Vec<_> = blobs.values().map(|b| (b.bounds, b.area_px)).collect();
                let slow = slow(&binary, width, gap_rows);
                assert_eq!(
                    fast, slow,
                    "width {width}, density {density}, gap {gap_rows}"
                );
            }
        }
    }
}
