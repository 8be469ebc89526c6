//! Confirmation over frames: an obstacle counts when it was found in k of the last n frames, and
//! is gone when it was found in none of a longer time: to clear the line too early is worse than
//! to clear it late.

use super::WaysideSettings;
use super::cells::Cells;
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
#[derive(Clone, Debug)]
pub(super) struct Confirmation {
    candidates: Vec<Candidate>,
    taken: Vec<bool>,
    needed: u32,
    /// Bits of the history that count for confirmation, and for staying confirmed.
    memory: u64,
    clear_memory: u64,
}

impl Confirmation {
    pub fn new(settings: &WaysideSettings) -> Self {
        let of = settings.confirm_of.clamp(1, 64);
        Self {
            candidates: Vec::new(),
            taken: Vec::new(),
            needed: settings.confirm_frames.clamp(1, of),
            memory: u64::MAX >> (64 - of),
            clear_memory: u64::MAX >> (64 - settings.clear_frames.clamp(of, 64)),
        }
    }

    /// Takes what one frame shows. What a train hides or dazzles, if only in part, stays as it was
    /// seen whole until it passed: the part that is left says nothing of the rest.
    pub fn update(&mut self, found: &[DetectedObstacle], cells: &Cells) {
        self.taken.clear();
        self.taken.resize(found.len(), false);
        for candidate in &mut self.candidates {
            let bounds = candidate.obstacle.blob.bounds;
            if cells.touches_blind(bounds) {
                take_parts(&bounds, found, &mut self.taken);
                continue;
            }
            candidate.history <<= 1;
            if let Some(k) = best_match(&bounds, found, &self.taken) {
                self.taken[k] = true;
                candidate.history |= 1;
                candidate.obstacle = found[k].clone();
            }
            candidate.confirmed |= (candidate.history & self.memory).count_ones() >= self.needed;
        }
        let (memory, clear_memory) = (self.memory, self.clear_memory);
        let remembered = |c: &Candidate| if c.confirmed { clear_memory } else { memory };
        self.candidates.retain(|c| c.history & remembered(c) != 0);
        for (obstacle, _) in found.iter().zip(&self.taken).filter(|(_, taken)| !**taken) {
            self.candidates.push(Candidate {
                obstacle: obstacle.clone(),
                history: 1,
                confirmed: self.needed <= 1,
            });
        }
    }

    /// Confirmed obstacles, oldest first.
    pub fn confirmed(&self) -> impl Iterator<Item = &DetectedObstacle> {
        self.candidates
            .iter()
            .filter(|c| c.confirmed)
            .map(|c| &c.obstacle)
    }
}

/// The free region with the greatest overlap with `bounds`.
fn best_match(bounds: &PixelBox, found: &[DetectedObstacle], taken: &[bool]) -> Option<usize> {
    let mut best: Option<(f64, usize)> = None;
    for (k, obstacle) in found.iter().enumerate().filter(|(k, _)| !taken[*k]) {
        let share = overlap(bounds, &obstacle.blob.bounds);
        if share > best.map_or(0.0, |b| b.0) {
            best = Some((share, k));
        }
    }
    best.map(|b| b.1)
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
