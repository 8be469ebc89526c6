//! What the hypotheses come to.

use super::hypothesis::Hypothesis;
use crate::track::Direction;

/// The train is on this element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackDecision {
    /// By its number in the network.
    pub element: usize,
    /// How probable that is.
    pub probability: f64,
    /// Up if the train's front looks towards the element's last point.
    pub facing: Direction,
    /// How probable that is, if it is on this element.
    pub facing_probability: f64,
    /// Place of the antenna along the element, metres.
    pub along_m: f64,
    /// Its standard deviation.
    pub sigma_m: f64,
}

/// Every element that the train may be on, the most probable first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Decision {
    /// None before the first fix near the network.
    pub tracks: Vec<TrackDecision>,
}

impl Decision {
    /// Whether only one is left.
    pub fn is_identified(&self) -> bool {
        self.tracks.len() == 1
    }

    pub(super) fn of(hypotheses: &[Hypothesis]) -> Self {
        let mut on: Vec<Shared> = hypotheses.iter().map(Shared::of).collect();
        on.sort_by_key(|shared| shared.element);
        let of_each = on.chunk_by(|a, b| a.element == b.element);
        let mut tracks: Vec<TrackDecision> = of_each.map(track).collect();
        let sum: f64 = tracks.iter().map(|track| track.probability).sum();
        for track in &mut tracks {
            track.probability /= sum.max(f64::MIN_POSITIVE);
        }
        tracks.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        Self { tracks }
    }
}

/// What a hypothesis says of the element that it is on.
struct Shared {
    element: usize,
    facing: Direction,
    along_m: f64,
    sigma_m: f64,
    probability: f64,
}

impl Shared {
    fn of(hypothesis: &Hypothesis) -> Self {
        let (element, facing, along_m) = hypothesis.on();
        Self {
            element,
            facing,
            along_m,
            sigma_m: hypothesis.sigma_m(),
            probability: hypothesis.log_probability.exp(),
        }
    }
}

/// Hypotheses on one element in one: mean and deviation of the mixture.
fn track(on: &[Shared]) -> TrackDecision {
    let probability: f64 = on.iter().map(|h| h.probability).sum();
    let mean = |of: &dyn Fn(&Shared) -> f64| {
        on.iter().map(|h| h.probability * of(h)).sum::<f64>() / probability.max(f64::MIN_POSITIVE)
    };
    let up = mean(&|h| f64::from(u8::from(h.facing == Direction::Up)));
    let along_m = mean(&|h| h.along_m);
    let variance_m2 = mean(&|h| h.sigma_m.powi(2) + (h.along_m - along_m).powi(2));
    TrackDecision {
        element: on[0].element,
        probability,
        facing: if up >= 0.5 {
            Direction::Up
        } else {
            Direction::Down
        },
        facing_probability: up.max(1.0 - up),
        along_m,
        sigma_m: variance_m2.sqrt(),
    }
}
