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
        let mut on: Vec<_> = hypotheses
            .iter()
            .map(|h| (h.on(), h.log_probability.exp(), h.sigma_m()))
            .collect();
        on.sort_by_key(|((element, _, _), _, _)| *element);
        let of_each = on.chunk_by(|a, b| a.0.0 == b.0.0);
        let mut tracks: Vec<TrackDecision> = of_each.map(track).collect();
        let sum: f64 = tracks.iter().map(|track| track.probability).sum();
        for track in &mut tracks {
            track.probability /= sum.max(f64::MIN_POSITIVE);
        }
        tracks.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        Self { tracks }
    }
}

/// Hypotheses on one element in one: mean and deviation of the mixture.
fn track(on: &[((usize, Direction, f64), f64, f64)]) -> TrackDecision {
    let probability: f64 = on.iter().map(|(_, p, _)| p).sum();
    let mean = |of: &dyn Fn(&((usize, Direction, f64), f64, f64)) -> f64| {
        on.iter().map(|h| h.1 * of(h)).sum::<f64>() / probability.max(f64::MIN_POSITIVE)
    };
    let up = mean(&|((_, way, _), _, _)| f64::from(u8::from(*way == Direction::Up)));
    let along_m = mean(&|((_, _, along_m), _, _)| *along_m);
    let variance_m2 = mean(&|((_, _, m), _, sigma_m)| sigma_m.powi(2) + (m - along_m).powi(2));
    TrackDecision {
        element: on[0].0.0,
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
