//! How the error of fixes goes on from one to the next.
//!
//! Of the variance P of a fix a share c changes slowly, the rest is white. The slow error b is a Gauss-Markov process
//! with variance c P and, along the track, that of the map. So a hundred fixes in a minute count for little more than
//! one, as they have to: a filter that takes them for white grows sure of a wrong track.
//!
//! Receivers have several solutions. One that is carried on without reception has the error of the last fix and
//! more; one that is found again by itself has that of its own last fix. Which of both it is, the fixes show. With a
//! small probability b jumps, or is drawn anew: an error that has come back from a jump is as large as it is stated.

use super::fix_trust::Judged;
use super::hypothesis::{EAST, Hypothesis, KindError, NORTH};
use super::settings::OccupancySettings;
use nalgebra::{Matrix2, Vector2};

/// Ways from this one on are jumps.
pub const JUMPS: usize = 2;

/// One of the ways that the error may have gone.
#[derive(Clone, Copy)]
pub struct ErrorWay {
    pub probability: f64,
    /// Whether it has nothing to do with the state's error.
    pub is_own: bool,
    pub error_m: Vector2<f64>,
    /// Covariance of its own, or what comes to the state's.
    pub more_m2: Matrix2<f64>,
}

/// Covariance of the part of a fix's error that changes slowly, with what the map has wrong along the track.
pub fn slow_m2(
    covariance: &Matrix2<f64>,
    forward: &Vector2<f64>,
    settings: &OccupancySettings,
) -> Matrix2<f64> {
    let map_m2 = settings.map_sigma_m.powi(2);
    covariance * settings.correlated_share + forward * forward.transpose() * map_m2
}

impl Hypothesis {
    /// What the error may be before a fix is taken in: it goes on, and grows where it is stated to; it is that of the
    /// last fix of the same kind; it jumps; it is drawn anew.
    pub fn error_ways(
        &mut self,
        judged: &Judged,
        slow_m2: &Matrix2<f64>,
        settings: &OccupancySettings,
    ) -> [ErrorWay; 4] {
        let anew = ErrorWay {
            probability: 0.5 * settings.jump_probability,
            is_own: true,
            error_m: Vector2::zeros(),
            more_m2: *slow_m2,
        };
        let grown_m2 = (0.5 * slow_m2.trace() - self.fix_variance_m2).max(0.0);
        let goes_on = ErrorWay {
            is_own: false,
            error_m: self.error_m(),
            more_m2: Matrix2::identity() * grown_m2,
            ..anew
        };
        let other_kind = self.kind != Some(judged.kind);
        let restored = if other_kind {
            self.restored(judged, &anew, settings)
        } else {
            anew
        };
        let (usual, restored_share) = match (judged.is_new || self.kind.is_none(), other_kind) {
            (true, _) => (anew, 0.0),
            (false, true) => (goes_on, 0.5),
            (false, false) => (goes_on, 0.0),
        };
        let likely = 1.0 - settings.jump_probability;
        [
            ErrorWay {
                probability: likely * (1.0 - restored_share),
                ..usual
            },
            ErrorWay {
                probability: likely * restored_share,
                ..restored
            },
            ErrorWay {
                more_m2: usual.more_m2 + Matrix2::identity() * settings.jump_sigma_m.powi(2),
                probability: anew.probability,
                ..usual
            },
            anew,
        ]
    }

    /// The error of the last fix of a kind that is not that of the last fix, as far as it lasts. Keeps that of the
    /// last fix. Without it a receiver that flips between two solutions would give news of one old error each time.
    fn restored(
        &mut self,
        judged: &Judged,
        anew: &ErrorWay,
        settings: &OccupancySettings,
    ) -> ErrorWay {
        if let Some(kind) = self.kind {
            self.kinds.retain(|known| known.kind != kind);
            self.kinds.push(KindError {
                kind,
                time: self.fix_time,
                error_m: self.error_m(),
                covariance_m2: self.covariance.fixed_view::<2, 2>(EAST, EAST).into_owned(),
            });
        }
        let known = self.kinds.iter().find(|known| known.kind == judged.kind);
        known.map_or(*anew, |known| {
            let keep = (-judged.fix.time.since(known.time) / settings.correlation_s).exp();
            let kept_m2 = known.covariance_m2 * keep.powi(2);
            ErrorWay {
                error_m: known.error_m * keep,
                more_m2: kept_m2 + anew.more_m2 * (1.0 - keep.powi(2)),
                ..*anew
            }
        })
    }

    /// Lets the error have gone a way.
    pub fn set_error(&mut self, way: &ErrorWay) {
        if way.is_own {
            for k in [EAST, NORTH] {
                self.covariance.row_mut(k).fill(0.0);
                self.covariance.column_mut(k).fill(0.0);
            }
        }
        self.mean.fixed_rows_mut::<2>(EAST).copy_from(&way.error_m);
        let mut error_m2 = self.covariance.fixed_view_mut::<2, 2>(EAST, EAST);
        error_m2 += way.more_m2;
    }
}
