//! Distributions by their quantile functions: a number of the unit interval in, a value out, so
//! that any plan of points serves any distribution.

mod check;
mod truncated;

use super::settings::Distribution;
use toml::Value;
use truncated::TruncatedNormal;

impl Distribution {
    /// Whether it is swept, not drawn.
    pub fn is_swept(&self) -> bool {
        matches!(
            self,
            Self::Sweep { .. } | Self::Grid { .. } | Self::Cases(_)
        )
    }

    /// Whether it has a density, and so can be weighted against another one.
    pub fn has_density(&self) -> bool {
        self.ends().is_some()
    }

    /// Whether it reaches wherever another one does.
    pub fn covers(&self, other: &Self) -> bool {
        let (own, others) = (self.ends(), other.ends());
        matches!((own, others), (Some([a, b]), Some([c, d])) if a <= c && d <= b)
    }

    /// Whether the weights of draws from it, which stand for those of another one, have a variance: the
    /// integral of other^2 / own is finite. Of what covers the other one, only tails without an end and
    /// corners of triangles can fall off too fast; the latter are turned down as a whole.
    pub fn bounds_weights_of(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Normal { .. }, Self::Normal { .. })
            | (Self::LogNormal { .. }, Self::LogNormal { .. }) => {
                let both = self.truncated_normal().zip(other.truncated_normal());
                both.is_some_and(|(own, other)| own.bounds_weights_of(&other))
            }
            // Its tail to the right is thicker than any normal one, and a normal one thinner.
            (Self::Normal { .. }, Self::LogNormal { max, .. }) => max.is_some(),
            (Self::Triangular { .. }, _) => self == other,
            _ => true,
        }
    }

    fn ends(&self) -> Option<[f64; 2]> {
        Some(match *self {
            Self::Uniform { min, max }
            | Self::LogUniform { min, max }
            | Self::Triangular { min, max, .. } => [min, max],
            Self::Normal { min, max, .. } => [
                min.unwrap_or(f64::NEG_INFINITY),
                max.unwrap_or(f64::INFINITY),
            ],
            Self::LogNormal { min, max, .. } => [min.unwrap_or(0.0), max.unwrap_or(f64::INFINITY)],
            _ => return None,
        })
    }

    /// Whether all its values are numbers (a table's are looked at when it is read).
    pub fn is_of_numbers(&self) -> bool {
        match self {
            Self::Choice { values, .. } | Self::Sweep { values } => {
                values.iter().all(|v| v.is_integer() || v.is_float())
            }
            Self::Cases(_) => false,
            _ => true,
        }
    }

    /// The values of a swept one, in order; none of others.
    pub fn swept(&self) -> Vec<Value> {
        match self {
            Self::Sweep { values } => values.clone(),
            Self::Cases(cases) => {
                let names = cases.iter().map(|case| Value::String(case.name.clone()));
                names.collect()
            }
            Self::Grid { min, max, count } => (0..*count)
                .map(|k| {
                    let share = f64::from(k) / f64::from(count - 1);
                    Value::Float(min + share * (max - min))
                })
                .collect(),
            _ => Vec::new(),
        }
    }

    /// Where a share `u` of all values lies below, 0 < u < 1. `None` of those that are swept or
    /// stand in a table.
    pub fn quantile(&self, u: f64) -> Option<Value> {
        Some(match self {
            Self::Integer { min, max } => {
                let count = (max - min) as f64 + 1.0;
                Value::Integer((min + (u * count) as i64).min(*max))
            }
            Self::Choice { values, weights } => values.get(pick(u, values.len(), weights))?.clone(),
            _ => Value::Float(self.real_quantile(u)?),
        })
    }

    /// What is left of a normal distribution, or of that of a logarithm.
    fn truncated_normal(&self) -> Option<TruncatedNormal> {
        match *self {
            Self::Normal {
                mean,
                sigma,
                min,
                max,
            } => Some(TruncatedNormal::normal(mean, sigma, min, max)),
            Self::LogNormal {
                median,
                sigma_ln,
                min,
                max,
            } => Some(TruncatedNormal::log_normal(median, sigma_ln, min, max)),
            _ => None,
        }
    }

    fn real_quantile(&self, u: f64) -> Option<f64> {
        Some(match *self {
            Self::Uniform { min, max } => min + u * (max - min),
            Self::LogUniform { min, max } => min * (u * (max / min).ln()).exp(),
            Self::Normal { .. } => self.truncated_normal()?.quantile(u),
            Self::LogNormal { .. } => self.truncated_normal()?.quantile(u).exp(),
            Self::Triangular { min, mode, max } => {
                let rising = (mode - min) / (max - min);
                if u < rising {
                    min + ((max - min) * (mode - min) * u).sqrt()
                } else {
                    max - ((max - min) * (max - mode) * (1.0 - u)).sqrt()
                }
            }
            _ => return None,
        })
    }

    /// Natural logarithm of the density at `x`: minus infinity where it has none.
    pub fn ln_density(&self, x: f64) -> f64 {
        let within = |min: f64, max: f64, density: f64| {
            if (min..=max).contains(&x) {
                density.ln()
            } else {
                f64::NEG_INFINITY
            }
        };
        let normal = self.truncated_normal();
        match *self {
            Self::Uniform { min, max } => within(min, max, 1.0 / (max - min)),
            Self::LogUniform { min, max } => within(min, max, 1.0 / (x * (max / min).ln())),
            Self::Normal { .. } => normal.map_or(f64::NEG_INFINITY, |n| n.ln_density(x)),
            Self::LogNormal { .. } if x > 0.0 => {
                normal.map_or(f64::NEG_INFINITY, |n| n.ln_density(x.ln()) - x.ln())
            }
            Self::Triangular { min, mode, max } => {
                let height = 2.0 / (max - min);
                let share = if x < mode {
                    (x - min) / (mode - min)
                } else {
                    (max - x) / (max - mode)
                };
                // At a mode that is an end, the line is upright.
                within(min, max, height * if share.is_nan() { 1.0 } else { share })
            }
            _ => f64::NEG_INFINITY,
        }
    }
}

/// Which of `len` entries a share `u` of all weight falls on.
fn pick(u: f64, len: usize, weights: &[f64]) -> usize {
    if weights.is_empty() {
        return ((u * len as f64) as usize).min(len.saturating_sub(1));
    }
    let total: f64 = weights.iter().sum();
    let mut left = u * total;
    let found = weights.iter().position(|w| {
        left -= w;
        left < 0.0
    });
    let last = weights.iter().rposition(|w| *w > 0.0).unwrap_or(0);
    found.unwrap_or(last)
}

#[cfg(test)]
mod tests;
