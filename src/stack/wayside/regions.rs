//! Regions of a binary image that may be obstacles.

use crate::bus::Blob;
use crate::stack::runs::{Runs, joined};

/// Regions nearer to each other than this are one: an obstacle falls apart where a part of it
/// has the colour of what is behind.
const GAP_PX: u32 = 6;

/// Regions of at least `min_area` pixels, in order of their first pixel.
pub(super) fn regions(binary: &[u8], width: usize, min_area: u32) -> Vec<Blob> {
    let blobs = Runs::new(binary, width, 0, |_| true).blobs();
    let mut found: Vec<Blob> = blobs.into_values().collect();
    // A bound on the work of joining: more pieces than this are noise, not obstacles.
    if found.len() > 500 {
        found.retain(|b| b.area_px >= min_area);
        found.truncate(500);
    }
    join_near(&mut found);
    found.retain(|b| b.area_px >= min_area);
    found
}

fn join_near(blobs: &mut Vec<Blob>) {
    let mut k = 0;
    while k < blobs.len() {
        let other =
            (k + 1..blobs.len()).find(|&m| blobs[k].bounds.is_near(&blobs[m].bounds, GAP_PX));
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
    use super::*;

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
        let found = regions(&image, 100, 40);
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].bounds.u0, found[0].bounds.u1), (10, 29));
        assert_eq!(found[0].area_px, 160);
        assert_eq!(found[1].area_px, 50);
    }
}
