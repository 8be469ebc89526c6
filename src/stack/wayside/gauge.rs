//! How dangerous a place is: the structure gauge as a box around the train's swept envelope.

use super::WaysideSettings;
use crate::bus::DangerLevel;

/// What an obstacle takes up across the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CrossExtent {
    /// Rightmost point (smallest l).
    pub right_m: f64,
    /// Leftmost point.
    pub left_m: f64,
    /// Where its foot stands.
    pub foot_m: f64,
    /// Highest point over top of rail.
    pub top_m: f64,
}

/// High: the train would hit it, or could ride over it. Low: near the gauge, or in it but too
/// low to be hit. None: clear of it, or seen to begin on the wall, where nothing stands: light
/// that moves over the lining does.
pub(super) fn danger(settings: &WaysideSettings, extent: CrossExtent) -> DangerLevel {
    let within = |half_width: f64| extent.right_m <= half_width && extent.left_m >= -half_width;
    if extent.foot_m.abs() > settings.gauge_half_width_m + settings.near_gauge_m {
        return DangerLevel::None;
    }
    if within(settings.gauge_half_width_m) && extent.top_m >= settings.dangerous_height_m {
        DangerLevel::High
    } else if within(settings.gauge_half_width_m + settings.near_gauge_m) {
        DangerLevel::Low
    } else {
        DangerLevel::None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One obstacle either side of each limit: a swapped sign or comparison changes a level.
    #[test]
    fn levels_follow_the_box() {
        let settings = WaysideSettings::default();
        let level = |right_m, left_m, top_m| {
            danger(
                &settings,
                CrossExtent {
                    right_m,
                    left_m,
                    foot_m: 0.5 * (right_m + left_m),
                    top_m,
                },
            )
        };
        let (w, near) = (settings.gauge_half_width_m, settings.near_gauge_m);
        let h = settings.dangerous_height_m;
        assert_eq!(level(-0.2, 0.2, h + 0.01), DangerLevel::High);
        assert_eq!(level(-0.2, 0.2, h - 0.01), DangerLevel::Low);
        assert_eq!(level(w - 0.01, w + 0.5, 1.0), DangerLevel::High);
        assert_eq!(level(-w - 0.5, -w + 0.01, 1.0), DangerLevel::High);
        assert_eq!(level(w + 0.01, w + 0.5, 1.0), DangerLevel::Low);
        assert_eq!(level(-w - 0.5, -w - 0.01, 1.0), DangerLevel::Low);
        assert_eq!(level(w + near + 0.01, w + 1.0, 1.0), DangerLevel::None);
        // A patch of light 5 m wide that begins on the wall reaches into the gauge, but stands on
        // nothing.
        let patch = CrossExtent {
            right_m: 0.0,
            left_m: 5.0,
            foot_m: w + near + 0.01,
            top_m: 2.0,
        };
        assert_eq!(danger(&settings, patch), DangerLevel::None);
    }
}
