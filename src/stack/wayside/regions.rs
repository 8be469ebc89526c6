//! Connected regions of a binary image, by runs and union-find, 8-connected.

use crate::bus::{Blob, PixelBox};
use std::ops::Range;

/// Regions nearer to each other than this are one: an obstacle falls apart where a part of it
/// has the colour of what is behind.
const GAP_PX: u32 = 6;

/// Set pixels of one row, side by side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    /// Row.
    pub v: u32,
    /// First and last column.
    pub u: (u32, u32),
}

/// The runs of a binary image from the top, and which of them belong together.
#[derive(Clone, Debug, Default)]
pub(super) struct Runs {
    pub all: Vec<Run>,
    parent: Vec<usize>,
}

impl Runs {
    /// Of the set pixels for whose index `keep` is true.
    pub fn label(&mut self, binary: &[u8], width: usize, keep: impl Fn(usize) -> bool) {
        self.all.clear();
        self.parent.clear();
        let width = width.max(1);
        let mut above = 0..0;
        for (v, row) in binary.chunks_exact(width).enumerate() {
            let first = self.all.len();
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
                self.add(run, above.clone());
            }
            above = first..self.all.len();
        }
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
}

/// Finds regions, with buffers of its own.
#[derive(Clone, Debug, Default)]
pub(super) struct Regions {
    runs: Runs,
    /// One a run; what belongs together is gathered in the first.
    blobs: Vec<Blob>,
}

impl Regions {
    /// Regions of at least `min_area` pixels, in order of their first pixel.
    pub fn find(&mut self, binary: &[u8], width: usize, min_area: u32) -> Vec<Blob> {
        let mut found = self.connected(binary, width);
        // A bound on the work of joining: more pieces than this are noise, not obstacles.
        if found.len() > 500 {
            found.retain(|b| b.area_px >= min_area);
            found.truncate(500);
        }
        join_near(&mut found);
        found.retain(|b| b.area_px >= min_area);
        found
    }

    fn connected(&mut self, binary: &[u8], width: usize) -> Vec<Blob> {
        self.runs.label(binary, width, |_| true);
        self.blobs.clear();
        self.blobs.extend(self.runs.all.iter().map(Blob::from));
        for k in 0..self.blobs.len() {
            let region = self.runs.region(k);
            if region != k {
                self.blobs[region] = joined(&self.blobs[region], &self.blobs[k]);
            }
        }
        (0..self.blobs.len())
            .filter(|&k| self.runs.region(k) == k)
            .map(|k| self.blobs[k].clone())
            .collect()
    }
}

impl From<&Run> for Blob {
    fn from(run: &Run) -> Self {
        let (u0, u1) = run.u;
        let (v0, v1) = (run.v, run.v);
        Self {
            bounds: PixelBox { u0, v0, u1, v1 },
            area_px: u1 - u0 + 1,
        }
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

fn joined(a: &Blob, b: &Blob) -> Blob {
    Blob {
        bounds: PixelBox {
            u0: a.bounds.u0.min(b.bounds.u0),
            v0: a.bounds.v0.min(b.bounds.v0),
            u1: a.bounds.u1.max(b.bounds.u1),
            v1: a.bounds.v1.max(b.bounds.v1),
        },
        area_px: a.area_px + b.area_px,
    }
}

fn join_near(blobs: &mut Vec<Blob>) {
    let near = |a: &PixelBox, b: &PixelBox| {
        a.u0 <= b.u1 + GAP_PX
            && b.u0 <= a.u1 + GAP_PX
            && a.v0 <= b.v1 + GAP_PX
            && b.v0 <= a.v1 + GAP_PX
    };
    let mut k = 0;
    while k < blobs.len() {
        let other = (k + 1..blobs.len()).find(|&m| near(&blobs[k].bounds, &blobs[m].bounds));
        match other {
            // The box has grown: look again for its neighbours, earlier ones included.
            Some(m) => {
                let merged = joined(&blobs[k], &blobs[m]);
                blobs.remove(m);
                blobs[k] = merged;
                k = 0;
            }
            None => k += 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_scene::words;
    use super::*;

    /// Flood fill, the obvious way.
    fn slow(binary: &[u8], width: usize) -> Vec<(PixelBox, u32)> {
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
                for y in v.saturating_sub(1)..(v + 2).min(height) {
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
    /// widths that are no multiple of a word provoke a wrong skip of zeros.
    #[test]
    fn runs_equal_flood_fill() {
        let mut regions = Regions::default();
        for (n, width) in [(0u32, 1usize), (1, 7), (2, 33), (3, 64), (4, 101)] {
            for density in [3u32, 10, 40] {
                let binary: Vec<u8> = (0..width * 40)
                    .map(|k| 255 * u8::from(words(n, density, k as u32)[0] % 100 < density))
                    .collect();
                let mut fast: Vec<_> = (regions.connected(&binary, width).iter())
                    .map(|b| (b.bounds, b.area_px))
                    .collect();
                let mut slow = slow(&binary, width);
                let key = |x: &(PixelBox, u32)| (x.0.v0, x.0.u0, x.0.v1, x.0.u1, x.1);
                fast.sort_by_key(key);
                slow.sort_by_key(key);
                assert_eq!(fast, slow, "width {width}, density {density}");
            }
        }
    }

    /// Two halves of one obstacle, 4 px apart, must be one; 20 px apart, two. Pieces under the
    /// size limit that join to something over it must not be lost.
    #[test]
    fn near_pieces_join() {
        let mut image = vec![0u8; 100 * 20];
        let mut paint = |u0: usize, u1: usize| {
            for v in 5..15 {
                image[v * 100 + u0..v * 100 + u1].fill(255);
            }
        };
        paint(10, 20);
        paint(24, 30);
        paint(50, 55);
        let found = Regions::default().find(&image, 100, 40);
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].bounds.u0, found[0].bounds.u1), (10, 29));
        assert_eq!(found[0].area_px, 160);
        assert_eq!(found[1].area_px, 50);
    }
}
