//! What the hypotheses come to.

use super::hypothesis::Hypothesis;
use crate::track::Direction;
use std::f64::consts::SQRT_2;

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
    /// Whether only one is left: neither another course, nor the next element of the same one.
    pub fn is_identified(&self) -> bool {
        self.tracks.len() == 1
    }

    pub(super) fn of(hypotheses: &[Hypothesis], least: f64) -> Self {
        let mut on: Vec<Shared> = hypotheses.iter().flat_map(shares).collect();
        on.retain(|share| share.probability >= least);
        on.sort_by_key(|share| share.element);
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

/// What a hypothesis says of an element of its course.
struct Shared {
    element: usize,
    facing: Direction,
    along_m: f64,
    sigma_m: f64,
    probability: f64,
}

/// A hypothesis, divided over the elements of its course by the normal density of its place.
fn shares(hypothesis: &Hypothesis) -> impl Iterator<Item = Shared> + '_ {
    let (place_m, sigma_m) = (hypothesis.place_m(), hypothesis.sigma_m());
    let probability = hypothesis.log_probability.exp();
    let legs = hypothesis.course.legs();
    let below = move |m: f64| match sigma_m > 0.0 {
        // Of the normal distribution, without loss in its lower tail.
        true => 0.5 * libm::erfc((place_m - m) / (sigma_m * SQRT_2)),
        false => f64::from(u8::from(m > place_m)),
    };
    legs.iter().enumerate().map(move |(k, leg)| {
        // Beyond the ends of the course it is on the last of its elements.
        let end_m = leg.begin_m + leg.length_m;
        let from = if k == 0 { 0.0 } else { below(leg.begin_m) };
        let over = if k + 1 == legs.len() {
            0.0
        } else {
            below(2.0 * place_m - end_m)
        };
        Shared {
            element: leg.towards.element,
            facing: leg.towards.way,
            along_m: leg.along_m(place_m).clamp(0.0, leg.length_m),
            sigma_m,
            probability: probability * (1.0 - from - over).max(0.0),
        }
    })
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
