//! From the sightings of frames to targets.
//!
//! Each frame, targets run on; confirmed ones choose among the sightings first, so that all together fit best, then the
//! others among what is left; what no target wants begins one. A target is confirmed when it was detected in M of N
//! frames in a row, and dropped when it can no longer be, or once confirmed, when it was missed for long. All is done in
//! the order of targets and of sightings: the same frames give the same targets.
//!
//! Source: S. S. Blackman and R. Popoli, Design and Analysis of Modern Tracking Systems (1999), chapters 6 and 7.

use super::assignment::{AssignedPair, assign};
use super::detector::Sighting;
use super::settings::RadarTrackingSettings;
use super::target::{Innovation, Target, View};

/// A target whose place is known no better than this is lost, metres.
const LOST_SIGMA_M: f64 = 50.0;

/// Follows targets.
#[derive(Clone, Debug)]
pub struct Tracker {
    settings: RadarTrackingSettings,
    /// In the order of their begin.
    targets: Vec<Target>,
    next_id: u32,
}

impl Tracker {
    /// Without targets.
    pub fn new(settings: RadarTrackingSettings) -> Self {
        Self {
            settings,
            targets: Vec::new(),
            next_id: 0,
        }
    }

    /// All targets, also those that are not confirmed.
    pub fn targets(&self) -> &[Target] {
        &self.targets
    }

    /// To mark ghosts among them.
    pub fn targets_mut(&mut self) -> &mut [Target] {
        &mut self.targets
    }

    /// Forgets all targets, as after a gap.
    pub fn clear(&mut self) {
        self.targets.clear();
    }

    /// Takes the sightings of a frame in.
    pub fn on_frame(&mut self, sightings: &[Sighting], view: &View) {
        for target in &mut self.targets {
            target.predict(&view.own, &self.settings);
            target.hits <<= 1;
        }
        let mut is_free = vec![true; sightings.len()];
        for is_confirmed in [true, false] {
            self.associate(sightings, view, is_confirmed, &mut is_free);
        }
        for target in &mut self.targets {
            judge(target, &self.settings);
        }
        let settings = &self.settings;
        self.targets.retain(|target| is_alive(target, settings));
        for (seen, is_free) in sightings.iter().zip(is_free) {
            let is_number = seen.sigmas.iter().all(|sigma| sigma.is_finite());
            if is_free && is_number {
                let target = Target::new(self.next_id, seen, view, settings);
                self.targets.push(target);
                self.next_id = self.next_id.wrapping_add(1);
            }
        }
    }

    fn associate(
        &mut self,
        sightings: &[Sighting],
        view: &View,
        is_confirmed: bool,
        is_free: &mut [bool],
    ) {
        let chosen = self.targets.iter().enumerate();
        let chosen = chosen.filter(|(_, target)| target.is_confirmed == is_confirmed);
        let chosen: Vec<usize> = chosen.map(|(k, _)| k).collect();
        let mut pairs = Vec::new();
        let mut innovations: Vec<Innovation> = Vec::new();
        let mut missed = vec![0.0; chosen.len()];
        for (row, k) in chosen.iter().enumerate() {
            let free = sightings.iter().enumerate().filter(|(j, _)| is_free[*j]);
            let mut largest = f64::NEG_INFINITY;
            for (detection, seen) in free {
                let innovation = self.targets[*k].innovation(seen, view, &self.settings);
                let gated = innovation.filter(|i| i.distance <= self.settings.gate);
                let Some(innovation) = gated else { continue };
                largest = largest.max(innovation.log_volume);
                let cost = innovation.distance + innovation.log_volume;
                pairs.push(AssignedPair {
                    target: row,
                    detection,
                    cost,
                });
                innovations.push(innovation);
            }
            // A detection within the gate is always better than none.
            missed[row] = self.settings.gate + largest;
        }
        let assigned = assign(chosen.len(), &pairs, &missed);
        for (pair, innovation) in pairs.iter().zip(&innovations) {
            if assigned[pair.target] == Some(pair.detection) {
                let target = &mut self.targets[chosen[pair.target]];
                target.update(&sightings[pair.detection], innovation);
                target.hits |= 1;
                is_free[pair.detection] = false;
            }
        }
    }
}

/// Counts misses, and confirms.
fn judge(target: &mut Target, settings: &RadarTrackingSettings) {
    let is_hit = target.hits & 1 == 1;
    target.missed = if is_hit {
        0
    } else {
        target.missed.saturating_add(1)
    };
    target.is_confirmed |= hits(target, settings) >= settings.confirm_hits;
}

/// Hits in the last frames that count.
fn hits(target: &Target, settings: &RadarTrackingSettings) -> u32 {
    let frames = settings.confirm_frames.clamp(1, 32);
    (target.hits & (u32::MAX >> (32 - frames))).count_ones()
}

fn is_alive(target: &Target, settings: &RadarTrackingSettings) -> bool {
    let spread_m2 = target.covariance[(0, 0)] + target.covariance[(1, 1)];
    // No number is no less than anything either.
    if !(spread_m2 < LOST_SIGMA_M.powi(2) && target.state.iter().all(|x| x.is_finite())) {
        return false;
    }
    if target.is_confirmed {
        return target.missed < settings.lost_frames;
    }
    // Before it is confirmed, its frames have to leave enough for the hits that it lacks.
    let left = settings.confirm_frames.saturating_sub(target.frames);
    hits(target, settings) + left >= settings.confirm_hits
}
