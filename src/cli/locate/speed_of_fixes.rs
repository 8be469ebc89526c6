//! A speed for recordings without one: from the distances between fixes.
//!
//! It is no measurement of its own, so it adds nothing to what fixes say; it tells the filter how far the train
//! comes from fix to fix, and which way. It lags by half of its window.

use super::recorded::RecordedFix;
use crate::bus::SimTime;
use nalgebra::Vector2;

/// Over so long a time.
const WINDOW_S: f64 = 2.0;
/// What is run in less is taken for standing, in standard deviations of a fix and in metres.
const STANDING_SIGMAS: f64 = 1.0;
const STANDING_M: f64 = 0.3;
/// No train is faster: it is the solution that jumps.
const MOST_MPS: f64 = 100.0;
/// Who goes back has stood before, within this time, seconds.
const STOOD_S: f64 = 20.0;
/// Standard deviation of such a speed.
pub const SIGMA_MPS: f64 = 1.0;

/// A speed at each fix, forwards positive: the way that the train first moves. It turns its sign where the train
/// goes back. Distances are those between fixes of one kind; where there are none, the last speed holds.
pub fn speeds(fixes: &[RecordedFix]) -> Vec<(SimTime, f64)> {
    let mut way = Way::default();
    let mut speed_mps = 0.0;
    let mut speeds = Vec::with_capacity(fixes.len());
    for (k, now) in fixes.iter().enumerate() {
        if let Some((run, seconds)) = run(fixes, k) {
            let sigma_m = (0.5 * now.fix.covariance_m2.trace()).sqrt();
            let stands = run.norm() < STANDING_M + STANDING_SIGMAS * sigma_m;
            if stands || run.norm() < MOST_MPS * seconds {
                let sign = way.sign(now.fix.time, (!stands).then_some(run));
                speed_mps = if stands {
                    0.0
                } else {
                    sign * run.norm() / seconds
                };
            }
        }
        speeds.push((now.fix.time, speed_mps));
    }
    speeds
}

/// From the oldest fix of the same kind in the window to a fix, and in what time.
fn run(fixes: &[RecordedFix], k: usize) -> Option<(Vector2<f64>, f64)> {
    let now = &fixes[k];
    let recent = fixes[..k].iter().rev();
    let recent = recent.take_while(|r| now.fix.time.since(r.fix.time) <= WINDOW_S);
    let oldest = recent.filter(|r| r.kind == now.kind).last()?;
    let seconds = now.fix.time.since(oldest.fix.time);
    Some((now.fix.place - oldest.fix.place, seconds))
}

/// Which way the train goes.
#[derive(Default)]
struct Way {
    before: Option<Vector2<f64>>,
    back: bool,
    stood: Option<SimTime>,
}

impl Way {
    /// 1 forwards, -1 back, after so much was run; none where it stands.
    fn sign(&mut self, now: SimTime, run: Option<Vector2<f64>>) -> f64 {
        match (run, self.before) {
            (None, _) => self.stood = Some(now),
            (Some(run), Some(before)) if before.dot(&run) < 0.0 => {
                if self.stood.is_some_and(|stood| now.since(stood) <= STOOD_S) {
                    self.back = !self.back;
                    self.before = Some(run);
                    self.stood = None;
                }
            }
            (Some(run), _) => self.before = Some(run),
        }
        if self.back { -1.0 } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stack::occupancy::Fix;
    use crate::track::geodesy::Geodetic;
    use nalgebra::{Matrix2, Point2};

    fn fix(k: i32, x: f64, kind: &str) -> RecordedFix {
        RecordedFix {
            fix: Fix {
                time: SimTime::from_secs(0.4 * f64::from(k)),
                place: Point2::new(x, 3.0),
                covariance_m2: Matrix2::identity() * 0.01,
            },
            place: Geodetic {
                latitude_deg: 0.0,
                longitude_deg: 0.0,
                height_m: 0.0,
            },
            kind: kind.to_owned(),
        }
    }

    /// Out and back: the sign turns once, and a standing train has no speed.
    #[test]
    fn a_train_that_goes_back_has_a_speed_below_zero() {
        let place_m = |k: i32| match k {
            ..20 => 4.0 * f64::from(k),
            20..40 => 80.0,
            _ => 80.0 - 4.0 * f64::from(k - 40),
        };
        let fixes: Vec<_> = (0..60).map(|k| fix(k, place_m(k), "FIXED")).collect();
        let speeds = speeds(&fixes);
        assert!((speeds[15].1 - 10.0).abs() < 1e-9);
        assert!(speeds[35].1.abs() < 1e-9);
        assert!((speeds[55].1 + 10.0).abs() < 1e-9, "{:?}", speeds[55]);
    }

    /// Fails where jumps between two solutions become a speed.
    #[test]
    fn solutions_are_not_mixed() {
        let at = |k: i32| {
            let kind = if k / 2 % 2 == 0 {
                "FIXED"
            } else {
                "PROPAGATED"
            };
            let off_m = if kind == "FIXED" { 0.0 } else { -200.0 };
            fix(k, 4.0 * f64::from(k) + off_m, kind)
        };
        let fixes: Vec<_> = (0..40).map(at).collect();
        let speeds = speeds(&fixes);
        assert!(speeds[5..].iter().all(|(_, v)| (v - 10.0).abs() < 1e-9));
    }
}
