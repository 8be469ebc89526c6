//! A speed for recordings without one: from the distances between fixes.
//!
//! It is no measurement of its own, so it adds nothing to what fixes say; it tells the filter how far the train
//! comes from fix to fix, and which way. It lags by half of its window.

use super::recorded::RecordedFix;
use crate::bus::SimTime;
use nalgebra::Vector2;

/// Over so long a time, and so many steps.
const WINDOW_S: f64 = 2.0;
const LEAST_STEPS: usize = 5;
const LONGEST_WINDOW_S: f64 = 6.0;
/// What is slower is taken for standing, metres a second: a solution that is carried on drifts so fast. And what is
/// run in the window is not, if it is less than this share of a fix's standard deviation: most of its error stays.
const STANDING_MPS: f64 = 0.5;
const STANDING_SIGMAS: f64 = 0.3;
/// No train is faster: it is the solution that jumps.
const MOST_MPS: f64 = 100.0;
/// Nor does one gain or lose speed faster, m/s2; what differs by less than this, metres a second, is noise.
const MOST_MPS2: f64 = 1.5;
const NOISE_MPS: f64 = 1.0;
/// Unless it goes on for so long, seconds: then it was the speed before that was none.
const REFUSED_S: f64 = 5.0;
/// Who goes back has stood before, within this time, seconds.
const STOOD_S: f64 = 20.0;
/// The way is that of a speed over this one, metres a second: no solution drifts so fast for long. One that differs
/// by less than 60 degrees is the same way, by more than 120 the other; between them it is the solution that moves.
const WAY_MPS: f64 = 2.0;
const WAY_COSINE: f64 = 0.5;
/// After so long a time of another way it is that, seconds: what was before was none of the train's.
const WAY_S: f64 = 20.0;
/// Standard deviation of such a speed.
pub const SIGMA_MPS: f64 = 1.0;

/// A speed at each fix, forwards positive: the way that the train first moves. It turns its sign where the train
/// goes back. Distances are those between fixes of one kind; where there are none, the last speed holds.
pub fn speeds(fixes: &[RecordedFix]) -> Vec<(SimTime, f64)> {
    let mut way = TravelDirection::default();
    let mut taken: Option<(SimTime, f64)> = None;
    let mut speeds: Vec<(SimTime, f64)> = Vec::with_capacity(fixes.len());
    for (k, fix) in fixes.iter().enumerate() {
        let now = fix.fix.time;
        if let Some((velocity, steps)) = velocity(&fixes[..=k]) {
            let still_mps = STANDING_MPS + STANDING_SIGMAS * fix.sigma_m / WINDOW_S;
            let stands = velocity.norm() < still_mps;
            let is_possible = match taken {
                Some((taken, speed_mps)) => {
                    let seconds = now.since(taken);
                    let change_mps = (velocity.norm() - f64::abs(speed_mps)).abs();
                    seconds > REFUSED_S || change_mps < NOISE_MPS + MOST_MPS2 * seconds
                }
                None => steps >= LEAST_STEPS || now.since(fixes[0].fix.time) > LONGEST_WINDOW_S,
            };
            if velocity.norm() < MOST_MPS && is_possible {
                let sign = way.sign(now, velocity, stands);
                let speed_mps = if stands { 0.0 } else { sign * velocity.norm() };
                if taken.is_none() {
                    // A wheel would have had it from the start.
                    speeds
                        .iter_mut()
                        .for_each(|(_, before)| *before = speed_mps);
                }
                taken = Some((now, speed_mps));
            }
        }
        speeds.push((now, taken.map_or(0.0, |(_, speed_mps)| speed_mps)));
    }
    speeds
}

/// At the last fix: the median of the steps between fixes of its kind, so that single ones that are far off have no
/// part in it; and how many there are.
fn velocity(fixes: &[RecordedFix]) -> Option<(Vector2<f64>, usize)> {
    let (now, before) = fixes.split_last()?;
    let (mut to, mut steps) = (now, [Vec::new(), Vec::new()]);
    for from in before.iter().rev() {
        let back_s = now.fix.time.since(from.fix.time);
        if back_s > LONGEST_WINDOW_S || (back_s > WINDOW_S && steps[0].len() >= LEAST_STEPS) {
            break;
        }
        if from.kind == now.kind {
            let step = (to.fix.place - from.fix.place) / to.fix.time.since(from.fix.time);
            steps[0].push(step.x);
            steps[1].push(step.y);
            to = from;
        }
    }
    let count = steps[0].len();
    let [x, y] = steps.map(median);
    Some((Vector2::new(x?, y?), count))
}

fn median(mut of: Vec<f64>) -> Option<f64> {
    of.sort_by(f64::total_cmp);
    let (low, high) = (
        of.get(of.len().saturating_sub(1) / 2)?,
        of.get(of.len() / 2)?,
    );
    Some(0.5 * (low + high))
}

/// Which way the train goes.
#[derive(Default)]
struct TravelDirection {
    /// Unit vector.
    before: Option<Vector2<f64>>,
    /// Since when it has been another one.
    other: Option<SimTime>,
    back: bool,
    stood: Option<SimTime>,
}

impl TravelDirection {
    /// 1 forwards, -1 back, at a velocity.
    fn sign(&mut self, now: SimTime, velocity: Vector2<f64>, stands: bool) -> f64 {
        let speed_mps = velocity.norm();
        if stands {
            self.stood = Some(now);
        } else if speed_mps > WAY_MPS {
            let unit = velocity / speed_mps;
            let cosine = self.before.map_or(1.0, |before| before.dot(&unit));
            let has_stood = self.stood.is_some_and(|stood| now.since(stood) <= STOOD_S);
            let turns = cosine < -WAY_COSINE && has_stood;
            if turns {
                self.back = !self.back;
                self.stood = None;
            }
            let other = *self.other.get_or_insert(now);
            if turns || cosine > WAY_COSINE || now.since(other) > WAY_S {
                self.before = Some(unit);
                self.other = None;
            }
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
            sigma_m: 0.1,
            kind: kind.to_owned(),
        }
    }

    /// Out, a stop, and back, with one reflection: the sign turns once, and a standing train has no speed.
    #[test]
    fn a_train_that_goes_back_has_a_speed_below_zero() {
        // Brakes and starts with 1 m/s2.
        let place_m = |second: f64| match second {
            ..20.0 => 10.0 * second,
            20.0..30.0 => 250.0 - 0.5 * (30.0 - second).powi(2),
            30.0..60.0 => 250.0,
            60.0..70.0 => 250.0 - 0.5 * (second - 60.0).powi(2),
            _ => 200.0 - 10.0 * (second - 70.0),
        };
        let fixes: Vec<_> = (0..200)
            .map(|k| {
                let reflected_m = if k == 20 { 60.0 } else { 0.0 };
                fix(k, place_m(0.4 * f64::from(k)) + reflected_m, "FIXED")
            })
            .collect();
        let speeds = speeds(&fixes);
        let is = |second: f64, mps: f64| {
            let (_, said_mps) = speeds[(second / 0.4) as usize];
            assert!((said_mps - mps).abs() < 1e-9, "{second}: {said_mps}");
        };
        for second in [8.0, 8.4, 8.8, 15.0] {
            is(second, 10.0);
        }
        is(50.0, 0.0);
        is(75.0, -10.0);
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
