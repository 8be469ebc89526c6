//! What fixes are worth: by what was seen of the receiver's fixes of the same kind.
//!
//! Receivers state covariances that they do not keep: carried on through a tunnel, or with a wrong integer, they are
//! wrong by a hundred times as much, and flip between such a solution and a good one. Trains are on tracks, so a fix
//! is at least as wrong as it is far from the nearest one; the next of its kind is no better at once. Kinds are told
//! apart by the stated variance.

use super::Fix;
use super::settings::OccupancySettings;
use crate::bus::SimTime;
use nalgebra::Matrix2;
use std::collections::BTreeMap;

/// A fix has no more than so many standard deviations to the nearest track, or its covariance is too small.
const OFF_TRACK_SIGMAS: f64 = 2.0;
/// A kind that was wrong is believed again over this time, seconds.
const TRUST_S: f64 = 30.0;
/// Kinds whose variances differ by less than this factor are one.
const KIND_FACTOR: f64 = 4.0;

/// How far each kind of a receiver's fixes is believed.
#[derive(Clone, Debug, Default)]
pub struct FixTrust {
    kinds: BTreeMap<i32, KindTrust>,
}

/// Fixes of a kind.
#[derive(Clone, Copy, Debug)]
struct KindTrust {
    seen: SimTime,
    /// They are wrong by so much more than stated, metres.
    floor_m: f64,
}

/// A fix with a covariance that it can have.
#[derive(Clone, Copy, Debug)]
pub struct Judged {
    pub fix: Fix,
    /// Fixes of the same kind have the same error, but for what changes with time.
    pub kind: i32,
    /// Its error has nothing to do with that of fixes of its kind before.
    pub is_worse: bool,
}

impl FixTrust {
    /// Judges a fix that is so far from the nearest track.
    pub fn judge(&mut self, fix: &Fix, away_m: f64, settings: &OccupancySettings) -> Judged {
        let variance_m2 = 0.5 * fix.covariance_m2.trace();
        let number = (variance_m2.ln() / KIND_FACTOR.ln()).round() as i32;
        let sigma_m = variance_m2.sqrt().hypot(settings.map_sigma_m);
        let before = self.kinds.get(&number).copied();
        let left_m = before.map_or(0.0, |kind| {
            kind.floor_m * (-fix.time.since(kind.seen) / TRUST_S).exp()
        });
        let needed_m = away_m / OFF_TRACK_SIGMAS;
        let floor_m = if needed_m > sigma_m {
            left_m.max(needed_m)
        } else {
            left_m
        };
        let kind = KindTrust {
            seen: fix.time,
            floor_m,
        };
        self.kinds.insert(number, kind);
        Judged {
            fix: Fix {
                covariance_m2: fix.covariance_m2 + Matrix2::identity() * floor_m.powi(2),
                ..*fix
            },
            kind: number,
            is_worse: floor_m > 2.0 * left_m.max(sigma_m),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;

    fn fix(second: f64, sigma_m: f64) -> Fix {
        Fix {
            time: SimTime::from_secs(second),
            place: Point2::origin(),
            covariance_m2: Matrix2::identity() * sigma_m.powi(2),
        }
    }

    /// Fails where a fix far off any track is believed, or where another kind suffers for it.
    #[test]
    fn a_kind_that_was_far_off_is_believed_less_for_a_while() {
        let (mut trust, settings) = (FixTrust::default(), OccupancySettings::default());
        let mut sigma_m = |second, sigma_m, away_m| {
            let judged = trust.judge(&fix(second, sigma_m), away_m, &settings);
            judged.fix.covariance_m2[(0, 0)].sqrt()
        };
        assert!((sigma_m(0.0, 0.1, 0.3) - 0.1).abs() < 1e-12);
        assert!((sigma_m(1.0, 0.1, 200.0) - 100.0).abs() < 0.1);
        assert!((sigma_m(2.0, 2.5, 3.0) - 2.5).abs() < 1e-12);
        assert!((sigma_m(31.0, 0.1, 0.3) - 100.0 * (-1.0f64).exp()).abs() < 0.1);
    }
}
