//! Intervals of the means of quantities that cannot lie everywhere.

/// What a quantity lies between. The ends may be infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Half an interval over the mean's distance from its bound, above which the interval has no upper end: it
/// would be more than e^3 = 20 times that distance. Only means of two to four numbers exceed it.
const MOST_RELATIVE: f64 = 3.0;

impl Bounds {
    /// Any number.
    pub const NONE: Self = Self::new(f64::NEG_INFINITY, f64::INFINITY);
    /// Errors, times, counts.
    pub const NOT_NEGATIVE: Self = Self::new(0.0, f64::INFINITY);
    /// Rates, availabilities, flags.
    pub const SHARE: Self = Self::new(0.0, 1.0);
    /// The difference of two shares.
    pub const SHARE_DIFFERENCE: Self = Self::new(-1.0, 1.0);

    const fn new(low: f64, high: f64) -> Self {
        Self { low, high }
    }

    /// These, or none where a number does not lie between them.
    pub fn kept_by(self, numbers: impl IntoIterator<Item = f64>) -> Self {
        let mut numbers = numbers.into_iter();
        let are_kept = numbers.all(|x| (self.low..=self.high).contains(&x));
        if are_kept { self } else { Self::NONE }
    }

    /// The interval about a mean that would be `half` wide to either side if nothing bounded it: with one
    /// bound even in the logarithm of the distance from it, with two even in the logit between them
    /// (delta method), so that it never leaves them. With one bound, and `half` more than three
    /// times the distance from it, the upper end is infinite.
    pub fn interval(self, mean: f64, half: f64) -> (f64, f64) {
        let is_inside = self.low < mean && mean < self.high;
        if !is_inside || !self.low.is_finite() || half <= 0.0 {
            return (mean - half, mean + half);
        }
        let above = mean - self.low;
        let width = self.high - self.low;
        if width.is_finite() {
            let share = above / width;
            let odds = share / (1.0 - share);
            let factor = (half / width / (share * (1.0 - share))).exp();
            let end = |odds: f64| self.low + width / (1.0 + 1.0 / odds);
            return (end(odds / factor), end(odds * factor));
        }
        let factor = (half / above).exp();
        let high = if half / above > MOST_RELATIVE {
            f64::INFINITY
        } else {
            self.low + above * factor
        };
        (self.low + above / factor, high)
    }
}
