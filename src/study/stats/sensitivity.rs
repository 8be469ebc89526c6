//! Which input drives a figure.

use super::{IntervalEstimate, z};
use crate::twin::random::Stream;
use statrs::statistics::{Data, OrderStatistics, RankTieBreaker};
use std::collections::BTreeMap;

/// Spearman's rank correlation; equal values share their mean rank. `None` where one of both does not
/// vary, or of fewer than five pairs.
pub fn rank_correlation(pairs: &[(f64, f64)]) -> Option<IntervalEstimate> {
    let n = pairs.len();
    if n < 5 {
        return None;
    }
    let x = ranks(pairs.iter().map(|p| p.0));
    let y = ranks(pairs.iter().map(|p| p.1));
    let mean = (n as f64 + 1.0) / 2.0;
    let sum = |a: &[f64], b: &[f64]| -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - mean) * (b - mean)).sum()
    };
    let scatter = (sum(&x, &x) * sum(&y, &y)).sqrt();
    if scatter <= 0.0 {
        return None;
    }
    let r = (sum(&x, &y) / scatter).clamp(-1.0, 1.0);
    let z = z();
    let half = z * ((1.0 + 0.5 * r * r) / (n as f64 - 3.0)).sqrt();
    // Of a perfect order, atanh is infinite, and so the ends stay there.
    let end = |shift: f64| (r.atanh() + shift).tanh();
    Some(IntervalEstimate {
        value: r,
        low: end(-half),
        high: end(half),
        n,
    })
}

fn ranks(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    Data::new(values.as_mut_slice()).ranks(RankTieBreaker::Average)
}

/// First-order Sobol index: the share of the variance of y that x alone explains. The estimator
/// of Gamboa, Gremaud, Klein and Lagnoux puts the runs in the order of x and looks how alike the y of
/// neighbours are. By chance that is below 0 where x explains little: 0 is given then. `None` where y does not
/// vary, or of fewer than ten pairs.
pub fn first_order(pairs: &[(f64, f64)]) -> Option<f64> {
    let n = pairs.len();
    if n < 10 {
        return None;
    }
    // Runs of equal x in an order that has nothing to do with how they were drawn.
    let shuffle = Stream::new(0, 0, "ties");
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by_key(|k| shuffle.words(*k as u32, 0));
    order.sort_by(|a, b| pairs[*a].0.total_cmp(&pairs[*b].0));
    let sorted: Vec<(f64, f64)> = order.iter().map(|k| pairs[*k]).collect();
    let mean = sorted.iter().map(|p| p.1).sum::<f64>() / n as f64;
    let y = |k: usize| sorted[k % n].1 - mean;
    let variance: f64 = (0..n).map(|k| y(k) * y(k)).sum();
    let alike: f64 = (0..n).map(|k| y(k) * y(k + 1)).sum();
    (variance > 0.0).then(|| (alike / variance).max(0.0))
}

/// The same of an input that has names, not numbers, or that was tried at a few values: the share of the
/// variance of y that lies between the groups, less what chance alone puts there (Kelley's epsilon
/// squared, Proc. Natl. Acad. Sci. 21 (1935)), and 0 where it is less. `None` of fewer than ten runs, of one group, where every
/// run is a group, or where y does not vary.
pub fn first_order_of_groups<G: Ord>(pairs: &[(G, f64)]) -> Option<f64> {
    let n = pairs.len();
    let mut groups = BTreeMap::<&G, Vec<f64>>::new();
    for (group, y) in pairs {
        groups.entry(group).or_default().push(*y);
    }
    if n < 10 || groups.len() < 2 || groups.len() == n {
        return None;
    }
    let squares = |sample: &[f64]| {
        let mean = sample.iter().sum::<f64>() / sample.len() as f64;
        sample.iter().map(|y| (y - mean).powi(2)).sum::<f64>()
    };
    let all: Vec<f64> = pairs.iter().map(|p| p.1).collect();
    let total = squares(&all) / (n - 1) as f64;
    let within: f64 = groups.values().map(|g| squares(g)).sum();
    let within = within / (n - groups.len()) as f64;
    (total > 0.0).then(|| (1.0 - within / total).max(0.0))
}
