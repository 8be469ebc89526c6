//! Means and quantiles.

use super::{Bounds, IntervalEstimate, TAIL};
use crate::session::quantile as interpolated;
use statrs::distribution::{Binomial, ContinuousCDF, DiscreteCDF, StudentsT};

/// The mean of numbers that nothing bounds; `None` of fewer than two.
pub fn mean(sample: &[f64]) -> Option<IntervalEstimate> {
    bounded_mean(sample, Bounds::NONE)
}

/// The mean of numbers between bounds, which its interval does not leave; `None` of fewer than two.
pub fn bounded_mean(sample: &[f64], bounds: Bounds) -> Option<IntervalEstimate> {
    let mut moments = Moments::default();
    sample.iter().for_each(|x| moments.add(*x));
    moments.mean(bounds)
}

/// Mean and variance of numbers that come one by one (Welford, Technometrics 4 (1962)).
#[derive(Clone, Copy, Debug)]
pub struct Moments {
    n: usize,
    mean: f64,
    /// Sum of squares about the mean.
    squares: f64,
    least: f64,
    most: f64,
}

impl Default for Moments {
    fn default() -> Self {
        Self {
            n: 0,
            mean: 0.0,
            squares: 0.0,
            least: f64::INFINITY,
            most: f64::NEG_INFINITY,
        }
    }
}

impl Moments {
    /// Takes a number.
    pub fn add(&mut self, x: f64) {
        self.n += 1;
        let off = x - self.mean;
        self.mean += off / self.n as f64;
        self.squares += off * (x - self.mean);
        (self.least, self.most) = (self.least.min(x), self.most.max(x));
    }

    /// The mean by Student's t, as [`bounded_mean`] gives it. Bounds that the numbers do not keep are none.
    pub fn mean(&self, bounds: Bounds) -> Option<IntervalEstimate> {
        let n = self.n;
        if n < 2 {
            return None;
        }
        let sigma = (self.squares / (n - 1) as f64 / n as f64).sqrt();
        let t = student_t(n)?;
        let bounds = bounds.kept_by([self.least, self.most]);
        let (low, high) = bounds.interval(self.mean, t * sigma);
        Some(IntervalEstimate {
            value: self.mean,
            low,
            high,
            n,
        })
    }
}

/// The quantile p of sorted numbers, interpolated between order statistics as numpy does by default,
/// between the order statistics that hold the true one with 95 % at least. An end that the sample is
/// too small for is infinite.
pub fn quantile(sorted: &[f64], p: f64) -> Option<IntervalEstimate> {
    let n = sorted.len();
    if n == 0 {
        return None;
    }
    let (i, j) = order_statistics(n, p);
    Some(IntervalEstimate {
        value: interpolated(sorted, p),
        low: i.map_or(f64::NEG_INFINITY, |i| sorted[i - 1]),
        high: j.map_or(f64::INFINITY, |j| sorted[j - 1]),
        n,
    })
}

/// Of `n` independent numbers in order, from 1 on, those between which the quantile p of all that there could be lies
/// with 95 % at least; `None` where there are too few for an end.
pub(super) fn order_statistics(n: usize, p: f64) -> (Option<usize>, Option<usize>) {
    let Ok(below) = Binomial::new(p, n as u64) else {
        return (None, None);
    };
    // X_(i) <= q in all but P(fewer than i lie below q) = F(i - 1) of all samples (i from 1).
    let probability_of_fewer = |i: usize| below.cdf(i as u64 - 1);
    let i = least_where(n, |i| probability_of_fewer(i) > TAIL).map_or(n, |above| above - 1);
    let j = least_where(n, |i| probability_of_fewer(i) >= 1.0 - TAIL);
    ((i > 0).then_some(i), j)
}

/// Half the width of an interval of a mean of `n` numbers, in standard deviations of the mean; `None` of fewer than two.
pub(super) fn student_t(n: usize) -> Option<f64> {
    let freedom = n.checked_sub(1)? as f64;
    let t = StudentsT::new(0.0, 1.0, freedom).ok()?;
    Some(t.inverse_cdf(1.0 - TAIL))
}

/// The least of 1 to `n` for which something holds that holds from some number on.
fn least_where(n: usize, holds: impl Fn(usize) -> bool) -> Option<usize> {
    let (mut low, mut high) = (1, n + 1);
    while low < high {
        let middle = low.midpoint(high);
        if holds(middle) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    (low <= n).then_some(low)
}
