//! What fixes are worth: by what was seen of the receiver's fixes of the same kind.
//!
//! Receivers state covariances that they do not keep: carried on through a tunnel, or with a wrong integer, they are
//! wrong by a hundred times as much, and flip between such a solution and a good one. Trains are on tracks, so a fix
//! is at least as wrong as it is far from the nearest one. Kinds are told apart by the stated variance.
//!
//! Fixes that leave the tracks by a jump, and are back within seconds, are reflections and say nothing. A kind that
//! stays off the tracks has an error that it keeps, and is believed again as far as it has followed a track since: a
//! solution that drifts leaves any track, but over a distance, so neither time nor a standing train proves anything.
//! One that comes back by a jump has been found anew, and is believed sooner than one that drifts across a track.

use super::Fix;
use super::settings::OccupancySettings;
use crate::bus::SimTime;
use nalgebra::Matrix2;
use std::collections::BTreeMap;

/// A fix is no more than so many standard deviations off the nearest track, or its covariance is refuted.
const REFUTED_SIGMAS: f64 = 3.0;
/// It is then taken for so many standard deviations off.
const OFF_TRACK_SIGMAS: f64 = 2.0;
/// What is believed of a kind's error falls by e while it follows a track over so long a run, metres: after a jump
/// about the length over which tracks part behind a switch, else that over which a drift of some centimetres a metre
/// crosses all tracks of a line.
const TRUST_AFTER_JUMP_M: f64 = 100.0;
const TRUST_M: f64 = 500.0;
/// Kinds whose variances differ by less than this factor are one.
const KIND_FACTOR: f64 = 4.0;
/// Between two fixes of a kind the distance to the nearest track changes by no more than so many standard deviations
/// and so many metres a second, or it is another solution: inertial units drift more slowly.
const JUMP_SIGMAS: f64 = 4.0;
const JUMP_MPS: f64 = 3.0;

/// Reflections last no longer, seconds.
const REFLECTION_S: f64 = 5.0;

/// How far each kind of a receiver's fixes is believed.
#[derive(Clone, Debug, Default)]
pub struct FixTrust {
    kinds: BTreeMap<i32, KindTrust>,
}

/// Fixes of a kind.
#[derive(Clone, Copy, Debug)]
struct KindTrust {
    seen: SimTime,
    at: Circumstances,
    /// They are wrong by so much more than stated, metres.
    floor_m: f64,
    /// Since when it has been off the tracks, and nothing is believed of it yet.
    off_since: Option<SimTime>,
    /// Run over which the floor falls by e.
    trust_m: f64,
    /// Standard deviation from which the error that the filter carries was last drawn.
    drawn_sigma_m: f64,
}

/// A fix with a covariance that it can have.
#[derive(Clone, Copy, Debug)]
pub struct Judged {
    pub fix: Fix,
    /// Fixes of the same kind have the same error, but for what changes with time.
    pub kind: i32,
    /// Its error has nothing to do with that of fixes of its kind before: it is of another size.
    pub is_new: bool,
    /// It is not so far from the tracks that its own covariance is refuted.
    pub is_near: bool,
}

/// What is known of a fix beside itself.
#[derive(Clone, Copy, Debug)]
pub struct Circumstances {
    /// Of the nearest track.
    pub away_m: f64,
    /// That the train has run since the start.
    pub run_m: f64,
}

impl FixTrust {
    /// Judges a fix; none if it is to be left out.
    pub fn judge(
        &mut self,
        fix: &Fix,
        at: Circumstances,
        settings: &OccupancySettings,
    ) -> Option<Judged> {
        let variance_m2 = 0.5 * fix.covariance_m2.trace();
        let number = (variance_m2.ln() / KIND_FACTOR.ln()).round() as i32;
        let sigma_m = variance_m2.sqrt().hypot(settings.map_sigma_m);
        let needed_m = at.away_m / OFF_TRACK_SIGMAS;
        let is_near = at.away_m <= REFUTED_SIGMAS * sigma_m;
        let seen = self.kinds.get(&number).copied();
        let before = seen.unwrap_or(KindTrust::unseen(fix, at, sigma_m));
        let left_m = before.floor_left_m(&at);
        let floor_m = if is_near {
            left_m
        } else {
            left_m.max(needed_m)
        };
        let has_jumped = seen.is_none() || before.has_jumped(fix, &at, sigma_m);
        let off_since = before.off_since.or(has_jumped.then_some(fix.time));
        let is_off = |since: &SimTime| floor_m > left_m && fix.time.since(*since) <= REFLECTION_S;
        let off_since = off_since.filter(is_off);
        if off_since.is_some() {
            let kind = KindTrust {
                off_since,
                ..before
            };
            self.kinds.insert(number, kind);
            return None;
        }
        let believed_m = sigma_m.hypot(floor_m);
        let is_new = !(0.5..=2.0).contains(&(believed_m / before.drawn_sigma_m));
        let kind = KindTrust {
            seen: fix.time,
            at,
            off_since,
            floor_m,
            trust_m: match (is_near, has_jumped) {
                (true, true) => TRUST_AFTER_JUMP_M,
                (true, false) => before.trust_m,
                (false, _) => TRUST_M,
            },
            drawn_sigma_m: if is_new {
                believed_m
            } else {
                before.drawn_sigma_m
            },
        };
        self.kinds.insert(number, kind);
        let covariance_m2 = fix.covariance_m2 + Matrix2::identity() * floor_m.powi(2);
        Some(Judged {
            fix: Fix {
                covariance_m2,
                ..*fix
            },
            kind: number,
            is_new,
            is_near,
        })
    }
}

impl KindTrust {
    fn unseen(fix: &Fix, at: Circumstances, sigma_m: f64) -> Self {
        Self {
            seen: fix.time,
            at,
            off_since: None,
            floor_m: 0.0,
            trust_m: TRUST_M,
            drawn_sigma_m: sigma_m,
        }
    }

    /// What is left of the least error that it is taken to have.
    fn floor_left_m(&self, at: &Circumstances) -> f64 {
        let gone_m = (at.run_m - self.at.run_m).abs();
        self.floor_m * (-gone_m / self.trust_m).exp()
    }

    /// Whether a fix cannot be the same solution as the last one.
    fn has_jumped(&self, fix: &Fix, at: &Circumstances, sigma_m: f64) -> bool {
        let moved_m = (at.away_m - self.at.away_m).abs();
        moved_m > JUMP_SIGMAS * sigma_m + JUMP_MPS * fix.time.since(self.seen)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use nalgebra::Point2;

    /// Standard deviations that fixes are judged to have; none for those that are left out. Each is a second, run,
    /// how far it is off its track and what it states.
    fn sigmas_m(fixes: &[[f64; 4]]) -> Vec<Option<f64>> {
        let (mut trust, settings) = (FixTrust::default(), OccupancySettings::default());
        let judged = fixes.iter().map(|[second, run_m, away_m, sigma_m]| {
            let fix = Fix {
                time: SimTime::from_secs(*second),
                place: Point2::new(*run_m, *away_m),
                covariance_m2: Matrix2::identity() * sigma_m.powi(2),
            };
            let at = Circumstances {
                away_m: away_m.abs(),
                run_m: *run_m,
            };
            let judged = trust.judge(&fix, at, &settings)?;
            Some(judged.fix.covariance_m2[(0, 0)].sqrt())
        });
        judged.collect()
    }

    fn about(sigma_m: Option<f64>, expected_m: f64) -> bool {
        (sigma_m.unwrap() - expected_m).abs() < 0.01 * expected_m
    }

    /// Fails where a kind far off any track is believed, where another kind suffers for it, or where it is believed
    /// again for standing somewhere.
    #[test]
    fn a_kind_that_stays_off_the_tracks_is_believed_again_after_a_run() {
        let told = sigmas_m(&[
            [0.0, 0.0, 0.3, 0.1],
            [1.0, 10.0, 200.0, 0.1],
            [7.0, 70.0, 200.0, 0.1],
            [8.0, 80.0, 3.0, 2.5],
            [9.0, 90.0, 0.3, 0.1],
            [300.0, 90.0, 0.3, 0.1],
            [310.0, 190.0, 0.3, 0.1],
        ]);
        assert!(about(told[0], 0.1), "{told:?}");
        assert!(told[1].is_none(), "{told:?}");
        assert!(about(told[2], 100.0), "{told:?}");
        assert!(about(told[3], 2.5), "{told:?}");
        let left_m = 100.0 * (-20.0 / TRUST_M).exp();
        assert!(about(told[4], left_m) && about(told[5], left_m), "{told:?}");
        assert!(about(told[6], left_m * (-1.0f64).exp()), "{told:?}");
    }

    /// Fails where one that only drifts across a track is believed as soon as one that was found anew.
    #[test]
    fn a_kind_that_drifts_back_is_believed_late() {
        let told = sigmas_m(&[
            [0.0, 0.0, 0.3, 0.1],
            [10.0, 100.0, 20.0, 0.1],
            [20.0, 200.0, 0.3, 0.1],
            [30.0, 700.0, 0.3, 0.1],
        ]);
        let falls = |m: f64| 10.0 * (-m / TRUST_M).exp();
        assert!(about(told[1], 10.0), "{told:?}");
        assert!(
            about(told[2], falls(100.0)) && about(told[3], falls(600.0)),
            "{told:?}"
        );
    }

    /// Fails where reflections make all fixes of their kind worse.
    #[test]
    fn fixes_that_are_off_the_tracks_for_seconds_are_left_out() {
        let told = sigmas_m(&[
            [0.0, 0.0, 0.3, 1.0],
            [0.4, 4.0, 60.0, 1.0],
            [0.8, 8.0, 0.3, 1.0],
            [1.2, 12.0, -40.0, 1.0],
            [1.6, 16.0, 30.0, 1.0],
            [2.0, 20.0, 0.3, 1.0],
        ]);
        for (k, sigma_m) in told.iter().enumerate() {
            match k {
                0 | 2 | 5 => assert!(about(*sigma_m, 1.0), "{told:?}"),
                _ => assert!(sigma_m.is_none(), "{told:?}"),
            }
        }
    }
}
