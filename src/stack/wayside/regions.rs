//! Connected regions of a binary image, by runs and union-find, 8-connected.

use crate::bus::{Blob, PixelBox};

/// Regions nearer to each other than this are one: an obstacle falls apart where a part of it
/// has the colour of what is behind.
const GAP_PX: u32 = 6;

#[derive(Clone, Copy, Debug)]
struct Run {
    u0: u32,
    u1: u32,
    region: usize,
}

/// Finds regions, with buffers of its own.
#[derive(Clone, Debug, Default)]
pub(super) struct Regions {
    parent: Vec<usize>,
    blobs: Vec<Blob>,
    above: Vec<Run>,
    here: Vec<Run>,
}

impl Regions {
    /// Regions of at least `min_area` pixels, in order of their first pixel.
    pub fn find(&mut self, binary: &[u8], width: usize, min_area: u32) -> Vec<Blob> {
        self.label(binary, width);
        let mut found: Vec<Blob> = Vec::new();
        for k in 0..self.blobs.len() {
            if self.parent[k] == k {
                found.push(self.blobs[k].clone());
            }
        }
        // A bound on the work of joining: more pieces than this are noise, not obstacles.
        if found.len() > 500 {
            found.retain(|b| b.area_px >= min_area);
            found.truncate(500);
        }
        join_near(&mut found);
        found.retain(|b| b.area_px >= min_area);
        found
    }

    fn label(&mut self, binary: &[u8], width: usize) {
        self.parent.clear();
        self.blobs.clear();
        self.above.clear();
        for (v, row) in binary.chunks_exact(width.max(1)).enumerate() {
            self.here.clear();
            let mut u = 0;
            while let Some(start) = next_set(row, u) {
                let len = row[start..].iter().take_while(|&&p| p != 0).count();
                u = start + len;
                self.add_run(v as u32, start as u32, (u - 1) as u32);
            }
            std::mem::swap(&mut self.above, &mut self.here);
        }
    }

    fn add_run(&mut self, v: u32, u0: u32, u1: u32) {
        let region = self.parent.len();
        self.parent.push(region);
        self.blobs.push(Blob {
            bounds: PixelBox {
                u0,
                v0: v,
                u1,
                v1: v,
            },
            area_px: u1 - u0 + 1,
        });
        for k in 0..self.above.len() {
            let other = self.above[k];
            if other.u0 <= u1 + 1 && other.u1 + 1 >= u0 {
                self.unite(other.region, region);
            }
        }
        self.here.push(Run { u0, u1, region });
    }

    fn root(&mut self, mut k: usize) -> usize {
        while self.parent[k] != k {
            self.parent[k] = self.parent[self.parent[k]];
            k = self.parent[k];
        }
        k
    }

    fn unite(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        let (kept, gone) = (a.min(b), a.max(b));
        if kept != gone {
            self.parent[gone] = kept;
            self.blobs[kept] = joined(&self.blobs[kept], &self.blobs[gone]);
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
                regions.label(&binary, width);
                let mut fast: Vec<_> = (0..regions.blobs.len())
                    .filter(|&k| regions.parent[k] == k)
                    .map(|k| (regions.blobs[k].bounds, regions.blobs[k].area_px))
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
