//! What rooms calculate alike.

/// The ends of what is left of an interval after so many halvings: `is_low` holds below a place in
/// it, which stays between them, and not above.
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
