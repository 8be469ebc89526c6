//! Normal distributions, cut off.

use statrs::distribution::{Continuous, ContinuousCDF, Normal};

/// What two limits leave of a normal distribution.
pub(super) struct TruncatedNormal {
    mean: f64,
    sigma: f64,
    /// Limits in standard deviations.
    from: f64,
    to: f64,
}

impl TruncatedNormal {
    pub(super) fn normal(mean: f64, sigma: f64, min: Option<f64>, max: Option<f64>) -> Self {
        let score = |x: f64| (x - mean) / sigma;
        Self {
            mean,
            sigma,
            from: min.map_or(f64::NEG_INFINITY, score),
            to: max.map_or(f64::INFINITY, score),
        }
    }

    /// Of the logarithm.
    pub(super) fn log_normal(
        median: f64,
        sigma_ln: f64,
        min: Option<f64>,
        max: Option<f64>,
    ) -> Self {
        Self::normal(median.ln(), sigma_ln, min.map(f64::ln), max.map(f64::ln))
    }

    /// Of the whole curve's area. In the tail that is not 1 minus almost 1.
    pub(super) fn share(&self) -> f64 {
        let curve = Normal::standard();
        if self.from > 0.0 {
            curve.sf(self.from) - curve.sf(self.to)
        } else {
            curve.cdf(self.to) - curve.cdf(self.from)
        }
    }

    /// Whether the weights of draws from it, which stand for those of another one, have a variance.
    pub(super) fn bounds_weights_of(&self, other: &Self) -> bool {
        let other_is_bounded = other.from.is_finite() && other.to.is_finite();
        other_is_bounded || 2.0 * self.sigma.powi(2) > other.sigma.powi(2)
    }

    pub(super) fn quantile(&self, u: f64) -> f64 {
        let curve = Normal::standard();
        let score = if self.from > 0.0 {
            // By symmetry, where small numbers are exact.
            -curve.inverse_cdf(curve.sf(self.from) - u * self.share())
        } else {
            curve.inverse_cdf(curve.cdf(self.from) + u * self.share())
        };
        self.mean + self.sigma * score.clamp(self.from, self.to)
    }

    pub(super) fn ln_density(&self, x: f64) -> f64 {
        let score = (x - self.mean) / self.sigma;
        if !(self.from..=self.to).contains(&score) {
            return f64::NEG_INFINITY;
        }
        Normal::standard().ln_pdf(score) - self.sigma.ln() - self.share().ln()
    }
}
