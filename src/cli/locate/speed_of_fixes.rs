//! A speed for recordings without one: from the distances between fixes.
//!
//! It is no measurement of its own, so it adds nothing to what fixes say; it tells the filter how far the train
//! comes from fix to fix, and which way. It lags by half of its window.

use crate::bus::SimTime;
use crate::stack::occupancy::Fix;
use nalgebra::Vector2;

/// Over so long a time.
const WINDOW_S: f64 = 2.0;
/// What is run in less is taken for standing, in standard deviations of a fix and in metres.
const STANDING_SIGMAS: f64 = 2.0;
const STANDING_M: f64 = 0.3;
/// Standard deviation of such a speed.
pub const SIGMA_MPS: f64 = 1.0;

/// A speed at each fix, forwards positive: the way that the train first moves. It turns its sign where the train
/// goes back.
pub fn speeds(fixes: &[(Fix, crate::track::geodesy::Geodetic)]) -> Vec<(SimTime, f64)> {
    let mut first = 0;
    let mut sign = 1.0;
    let mut before: Option<Vector2<f64>> = None;
    let mut speeds = Vec::with_capacity(fixes.len());
    for (k, (fix, _)) in fixes.iter().enumerate() {
        while first + 1 < k && fix.time.since(fixes[first].0.time) > WINDOW_S {
            first += 1;
        }
        let from = &fixes[first].0;
        let seconds = fix.time.since(from.time);
        let run = fix.place - from.place;
        let sigma_m = fix
            .covariance_m2
            .trace()
            .sqrt()
            .min(from.covariance_m2.trace().sqrt());
        let stands = run.norm() < STANDING_M + STANDING_SIGMAS * sigma_m;
        if !stands {
            if before.is_some_and(|before| before.dot(&run) < 0.0) {
                sign = -sign;
            }
            before = Some(run);
        }
        let speed_mps = if stands || seconds <= 0.0 {
            0.0
        } else {
            sign * run.norm() / seconds
        };
        speeds.push((fix.time, speed_mps));
    }
    speeds
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::geodesy::Geodetic;
    use nalgebra::{Matrix2, Point2};

    /// Out and back: the sign turns once, and a standing train has no speed.
    #[test]
    fn a_train_that_goes_back_has_a_speed_below_zero() {
        let place_m = |k: i32| match k {
            ..20 => 4.0 * f64::from(k),
            20..40 => 80.0,
            _ => 80.0 - 4.0 * f64::from(k - 40),
        };
        let place = Geodetic {
            latitude_deg: 0.0,
            longitude_deg: 0.0,
            height_m: 0.0,
        };
        let fix = |k: i32| Fix {
            time: SimTime::from_secs(0.4 * f64::from(k)),
            place: Point2::new(place_m(k), 3.0),
            covariance_m2: Matrix2::identity() * 0.01,
        };
        let fixes: Vec<_> = (0..60).map(|k| (fix(k), place)).collect();
        let speeds = speeds(&fixes);
        assert!((speeds[15].1 - 10.0).abs() < 1e-9);
        assert!(speeds[35].1.abs() < 1e-9);
        assert!((speeds[55].1 + 10.0).abs() < 1e-9, "{:?}", speeds[55]);
    }
}
