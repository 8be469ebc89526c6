//! Median and 99th percentile of many costs, in memory that does not grow with their number: they are
//! counted in bins, each 1 % wider than the one before.

use super::statistics::Cost;

const BINS_A_DECADE: f64 = 230.0;
const LEAST_MS: f64 = 1e-4;
const DECADES: f64 = 9.0;

#[derive(Clone, Debug)]
pub(super) struct CostTally {
    counts: Vec<u64>,
}

impl Default for CostTally {
    fn default() -> Self {
        let bins = (DECADES * BINS_A_DECADE) as usize;
        Self {
            counts: vec![0; bins],
        }
    }
}

impl CostTally {
    /// Counts a cost, milliseconds.
    pub fn add(&mut self, cost_ms: f64) {
        let bin = ((cost_ms / LEAST_MS).log10() * BINS_A_DECADE).max(0.0) as usize;
        let last = self.counts.len() - 1;
        self.counts[bin.min(last)] += 1;
    }

    /// Counts all costs of another tally.
    pub fn add_all(&mut self, other: &Self) {
        let both = self.counts.iter_mut().zip(&other.counts);
        both.for_each(|(own, other)| *own += other);
    }

    /// Within half a per cent; `None` of no costs.
    pub fn cost(&self) -> Option<Cost> {
        Some(Cost {
            p50: self.quantile_ms(0.50)?,
            p99: self.quantile_ms(0.99)?,
        })
    }

    /// The middle of the bin that holds the quantile.
    fn quantile_ms(&self, p: f64) -> Option<f64> {
        let all: u64 = self.counts.iter().sum();
        let rank = (p * all.saturating_sub(1) as f64).round() as u64;
        let mut up_to = 0;
        let bin = self.counts.iter().position(|count| {
            up_to += count;
            up_to > rank
        })?;
        Some(LEAST_MS * 10f64.powf((bin as f64 + 0.5) / BINS_A_DECADE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the order statistics themselves. Provokes a rank that is off, and bins of the wrong width.
    #[test]
    fn quantiles_are_those_of_the_costs() {
        assert_eq!(CostTally::default().cost(), None);
        let mut tally = CostTally::default();
        let mut costs_ms: Vec<f64> = (0..997).map(|k| 0.02 * 1.01f64.powi(k)).collect();
        let (low, high) = costs_ms.split_at(300);
        high.iter().for_each(|cost_ms| tally.add(*cost_ms));
        let mut other = CostTally::default();
        low.iter().for_each(|cost_ms| other.add(*cost_ms));
        tally.add_all(&other);
        let (near, exact) = (tally.cost(), Cost::of(&mut costs_ms));
        let (Some(near), Some(exact)) = (near, exact) else {
            unreachable!("there are costs");
        };
        for (near, exact) in [(near.p50, exact.p50), (near.p99, exact.p99)] {
            assert!((near / exact - 1.0).abs() < 0.015, "{near}, {exact}");
        }
        // What is no cost, and what is beyond all bins, is counted at an end.
        for cost_ms in [f64::NAN, -1.0, 0.0, f64::INFINITY] {
            tally.add(cost_ms);
        }
    }
}
