//! How the error of fixes goes on from one to the next.
//!
//! Of the variance P of a fix one share changes with what is around the antenna, another one lasts, the rest is white.
//! Each of the slow parts is a Gauss-Markov process with its share of P; along the track the first one has what the map
//! has wrong, too. So a hundred fixes in a minute count for little more than one, and a train that stands for ten minutes
//! learns nothing of the part that lasts: a filter that takes the errors for white grows sure of a wrong track.
//!
//! Receivers have several solutions. One that is carried on without reception has the error of the last fix and
//! more; one that is found again by itself has that of its own last fix. Which of both it is, the fixes show. With a
//! small probability the error jumps, or is drawn anew: an error that has come back from a jump is as large as it is
//! stated.

use super::fix_trust::Judged;
use super::hypothesis::{FIX_ERROR, Hypothesis, KindError};
use super::settings::OccupancySettings;
use nalgebra::{Matrix2, Matrix4, Vector2, Vector4};

/// One of the ways that both parts of the error may have gone.
#[derive(Clone, Copy)]
pub struct ErrorWay {
    pub probability: f64,
    pub is_jump: bool,
    /// Whether it replaces the state's error, with which it has nothing to do.
    pub is_own: bool,
    pub error_m: Vector4<f64>,
    /// Covariance of the error if it replaces the state's, else what is added to the state's.
    pub more_m2: Matrix4<f64>,
}

/// What is left of both parts after a time.
pub fn kept(seconds: f64, settings: &OccupancySettings) -> [f64; 2] {
    [settings.correlation_s, settings.lasting_s].map(|time_s| (-seconds / time_s).exp())
}

/// Covariance of the error of a fix by that of its two parts.
pub fn sum_m2(parts_m2: &Matrix4<f64>) -> Matrix2<f64> {
    Matrix2::from_fn(|i, j| {
        parts_m2[(i, j)] + parts_m2[(i, j + 2)] + parts_m2[(i + 2, j)] + parts_m2[(i + 2, j + 2)]
    })
}

/// Covariance of both parts of a fix's error, with what the map has wrong along the track.
pub fn slow_m2(
    covariance: &Matrix2<f64>,
    forward: &Vector2<f64>,
    settings: &OccupancySettings,
) -> Matrix4<f64> {
    let slow_m2 = covariance * settings.correlated_share;
    let map_m2 = forward * forward.transpose() * settings.map_sigma_m.powi(2);
    let around_m2 = slow_m2 * (1.0 - settings.lasting_share) + map_m2;
    of_parts(&around_m2, &(slow_m2 * settings.lasting_share))
}

/// Of parts that have nothing to do with each other.
fn of_parts(around_m2: &Matrix2<f64>, lasting_m2: &Matrix2<f64>) -> Matrix4<f64> {
    let mut both = Matrix4::zeros();
    both.fixed_view_mut::<2, 2>(0, 0).copy_from(around_m2);
    both.fixed_view_mut::<2, 2>(2, 2).copy_from(lasting_m2);
    both
}

/// Mean variance on an axis of each part.
fn variances_m2(parts_m2: &Matrix4<f64>) -> [f64; 2] {
    [0, 2].map(|part| 0.5 * (parts_m2[(part, part)] + parts_m2[(part + 1, part + 1)]))
}

impl Hypothesis {
    /// What the error may be before a fix is taken in: it goes on, and grows where it is stated to; it is that of the
    /// last fix of the same kind; it jumps; it is drawn anew.
    pub fn error_ways(
        &mut self,
        judged: &Judged,
        slow_m2: &Matrix4<f64>,
        settings: &OccupancySettings,
    ) -> [ErrorWay; 4] {
        let anew = ErrorWay {
            probability: 0.5 * settings.jump_probability,
            is_jump: false,
            is_own: true,
            error_m: Vector4::zeros(),
            more_m2: *slow_m2,
        };
        let now_m2 = variances_m2(slow_m2);
        let [around_m2, lasting_m2] = [0, 1].map(|part| {
            Matrix2::identity() * (now_m2[part] - self.fix_variances_m2[part]).max(0.0)
        });
        let goes_on = ErrorWay {
            is_own: false,
            error_m: self.slow_error_m(),
            more_m2: of_parts(&around_m2, &lasting_m2),
            ..anew
        };
        let other_kind = self.kind != Some(judged.kind);
        let restored = if other_kind {
            self.restored(judged, &anew, settings)
        } else {
            anew
        };
        let is_anew = judged.is_new || self.kind.is_none();
        let usual = if is_anew { anew } else { goes_on };
        let restored_share = if other_kind && !is_anew { 0.5 } else { 0.0 };
        self.fix_variances_m2 = now_m2;
        let likely = 1.0 - settings.jump_probability;
        let jump_m2 = Matrix2::identity() * settings.jump_sigma_m.powi(2);
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
                more_m2: usual.more_m2 + of_parts(&jump_m2, &Matrix2::zeros()),
                probability: anew.probability,
                is_jump: true,
                ..usual
            },
            ErrorWay {
                is_jump: true,
                ..anew
            },
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
            let covariance_m2 = self.covariance.fixed_view::<4, 4>(FIX_ERROR, FIX_ERROR);
            self.kinds.push(KindError {
                kind,
                // The state's error has been carried on to now.
                time: judged.fix.time,
                error_m: self.slow_error_m(),
                covariance_m2: covariance_m2.into_owned(),
            });
        }
        let known = self.kinds.iter().find(|known| known.kind == judged.kind);
        known.map_or(*anew, |known| {
            let [around, lasting] = kept(judged.fix.time.since(known.time), settings);
            let keep = Matrix4::from_diagonal(&Vector4::new(around, around, lasting, lasting));
            ErrorWay {
                error_m: keep * known.error_m,
                more_m2: keep * known.covariance_m2 * keep + anew.more_m2
                    - keep * anew.more_m2 * keep,
                ..*anew
            }
        })
    }

    /// Lets the error have gone a way.
    pub fn set_error(&mut self, way: &ErrorWay) {
        if way.is_own {
            for k in FIX_ERROR..FIX_ERROR + 4 {
                self.covariance.row_mut(k).fill(0.0);
                self.covariance.column_mut(k).fill(0.0);
            }
        }
        (self.mean.fixed_rows_mut::<4>(FIX_ERROR)).copy_from(&way.error_m);
        let mut error_m2 = self.covariance.fixed_view_mut::<4, 4>(FIX_ERROR, FIX_ERROR);
        error_m2 += way.more_m2;
    }
}
