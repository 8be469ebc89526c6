//! Confirmation over frames: an obstacle counts when it was found in k of the last n frames, and
//! is gone when over a longer time every frame showed the clear bed in its place: to clear the line too
//! early is worse than to clear it late. A frame that shows neither the obstacle nor the bed, because
//! the light is another than that of the reference, says nothing.

use super::WaysideSettings;
use super::cells::GaugeCells;
use crate::bus::{DetectedObstacle, PixelBox};

/// A region followed from frame to frame.
#[derive(Clone, Debug)]
struct Candidate {
    obstacle: DetectedObstacle,
    /// Bit 0 is the newest frame.
    history: u64,
    confirmed: bool,
}

/// Follows regions by the overlap of their boxes.
#[derive(Clone, Debug, Default)]
pub(super) struct Confirmation {
    candidates: Vec<Candidate>,
}

impl Confirmation {
    /// Takes what one frame shows; `is_clear` tells whether it shows the clear bed in a place. What a
    /// train hides or dazzles, if only in part, stays as it was seen whole until it passed: the part
    /// that is left says nothing of the rest.
    pub fn update(
        &mut self,
        found: &[DetectedObstacle],
        cells: &GaugeCells,
        settings: &WaysideSettings,
        is_clear: impl Fn(&PixelBox) -> bool,
    ) {
        let of = settings.confirm_of.clamp(1, 64);
        let needed = settings.confirm_frames.clamp(1, of);
        // Bits of the history that count for confirmation, and for staying confirmed.
        let memory = u64::MAX >> (64 - of);
        let clear_memory = u64::MAX >> (64 - settings.clear_frames.clamp(of, 64));
        let mut taken = vec![false; found.len()];
        for candidate in &mut self.candidates {
            let bounds = candidate.obstacle.blob.bounds;
            if cells.touches_blind(&bounds) {
                take_parts(&bounds, found, &mut taken);
                continue;
            }
            if let Some(k) = best_match(&bounds, found, &taken) {
                taken[k] = true;
                candidate.history = candidate.history << 1 | 1;
                candidate.obstacle = found[k].clone();
            } else if !candidate.confirmed || is_clear(&bounds) {
                candidate.history <<= 1;
            }
            candidate.confirmed |= (candidate.history & memory).count_ones() >= needed;
        }
        let remembered = |c: &Candidate| if c.confirmed { clear_memory } else { memory };
        self.candidates.retain(|c| c.history & remembered(c) != 0);
        let new = found.iter().zip(&taken).filter(|(_, taken)| !**taken);
        self.candidates.extend(new.map(|(obstacle, _)| Candidate {
            obstacle: obstacle.clone(),
            history: 1,
            confirmed: needed <= 1,
        }));
    }

    /// Confirmed obstacles, oldest first.
    pub fn confirmed(&self) -> impl Iterator<Item = &DetectedObstacle> {
        self.candidates
            .iter()
            .filter(|c| c.confirmed)
            .map(|c| &c.obstacle)
    }
}

/// The free region with the greatest overlap with `bounds`, of equal ones the first.
fn best_match(bounds: &PixelBox, found: &[DetectedObstacle], taken: &[bool]) -> Option<usize> {
    let share = |k: &usize| overlap(bounds, &found[*k].blob.bounds);
    let free = (0..found.len())
        .rev()
        .filter(|k| !taken[*k] && share(k) > 0.0);
    free.max_by(|a, b| share(a).total_cmp(&share(b)))
}

/// Marks every region that overlaps `bounds`.
fn take_parts(bounds: &PixelBox, found: &[DetectedObstacle], taken: &mut [bool]) {
    for (obstacle, taken) in found.iter().zip(taken) {
        *taken |= overlap(bounds, &obstacle.blob.bounds) > 0.0;
    }
}

/// Intersection over union of two boxes.
fn overlap(a: &PixelBox, b: &PixelBox) -> f64 {
    let length = |a0: u32, a1: u32, b0: u32, b1: u32| {
        (f64::from(a1.min(b1)) - f64::from(a0.max(b0)) + 1.0).max(0.0)
    };
    let area = |p: &PixelBox| {
        (f64::from(p.u1) - f64::from(p.u0) + 1.0) * (f64::from(p.v1) - f64::from(p.v0) + 1.0)
    };
    let both = length(a.u0, a.u1, b.u0, b.u1) * length(a.v0, a.v1, b.v0, b.v1);
    both / (area(a) + area(b) - both)
}
