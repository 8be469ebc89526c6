//! Deviation of the rails from their designed place.

/// Deviation of the track at one chainage, and its derivative along it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Deviation {
    /// Up.
    pub up_m: f64,
    /// To the left.
    pub left_m: f64,
    /// Left rail over right, as an angle.
    pub roll_rad: f64,
    /// Of the rails' distance.
    pub gauge_m: f64,
    /// Of `up_m`.
    pub up_per_m: f64,
    /// Of `left_m`.
    pub left_per_m: f64,
    /// Of `roll_rad`.
    pub roll_rad_per_m: f64,
    /// Of `gauge_m`.
    pub gauge_per_m: f64,
}

impl Deviation {
    /// The same place as met by who runs the other way: left is right, and what rises falls.
    pub(super) fn reversed(self) -> Self {
        Self {
            left_m: -self.left_m,
            roll_rad: -self.roll_rad,
            up_per_m: -self.up_per_m,
            gauge_per_m: -self.gauge_per_m,
            ..self
        }
    }
}
