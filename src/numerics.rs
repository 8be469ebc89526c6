//! What rooms calculate alike, and constants of nature.

/// Speed of light, m/s.
pub(crate) const LIGHT_MPS: f64 = 299_792_458.0;
/// Boltzmann's constant, J/K.
pub(crate) const BOLTZMANN_JPK: f64 = 1.380_649e-23;

/// Halves an interval so many times about the place where `is_low` turns from true to false; returns
/// the two ends that are left.
pub(crate) fn bisected(
    (mut low, mut high): (f64, f64),
    halvings: u32,
    is_low: impl Fn(f64) -> bool,
) -> (f64, f64) {
    for _ in 0..halvings {
        let middle = 0.5 * (low + high);
        if is_low(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low, high)
}

/// A value that repeats after a span, to within half a span of 0.
pub(crate) fn wrapped(value: f64, span: f64) -> f64 {
    value - span * (value / span).round()
}
