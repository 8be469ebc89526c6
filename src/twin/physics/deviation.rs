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
    /// A share of it, which grows along the track.
    pub(super) fn shared(self, share: f64, share_per_m: f64) -> Self {
        Self {
            up_m: share * self.up_m,
            left_m: share * self.left_m,
            roll_rad: share * self.roll_rad,
            gauge_m: share * self.gauge_m,
            up_per_m: share * self.up_per_m + share_per_m * self.up_m,
            left_per_m: share * self.left_per_m + share_per_m * self.left_m,
            roll_rad_per_m: share * self.roll_rad_per_m + share_per_m * self.roll_rad,
            gauge_per_m: share * self.gauge_per_m + share_per_m * self.gauge_m,
        }
    }

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
