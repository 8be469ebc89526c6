//! What a fix and the sum of yaw rates say of a hypothesis: an extended Kalman filter with the likelihood of what it
//! finds.
//!
//! A fix is z = p(l) + b + w. Of its variance P a share c changes slowly: b is a Gauss-Markov process with variance
//! c P and the map's, w is white with (1 - c) P. So a hundred fixes in a minute count for little more than one, as
//! they have to: a filter that takes them for white grows sure of a wrong track. With a small probability b jumps
//! by more; the likelihood is that of the mixture, and the filter follows the part that explains the fix better.
//!
//! The sum of yaw rates is the heading of the chord between the bogies, less an offset that drifts.

use super::fix_trust::Judged;
use super::hypothesis::{
    EAST, HEADING, Hypothesis, KindError, NORTH, PLACE, SCALE, STATES, StateCovariance, YAW_OFFSET,
    log_sum,
};
use super::settings::OccupancySettings;
use crate::track::plan::PlanNetwork;
use nalgebra::{Matrix2, RowSVector, SMatrix, Vector2};
use std::f64::consts::{PI, TAU};

/// Of the place of a new hypothesis, before its first fix is taken in.
const NEW_PLACE_SIGMA_M: f64 = 100.0;
/// A fix has an error that is not white, even if it is said to be exact.
const LEAST_FIX_SIGMA_M: f64 = 0.05;
/// Over so long a time errors of the measured speed stay the same, seconds.
const SPEED_CORRELATION_S: f64 = 1.0;
/// Slower is standing, metres a second.
const STANDING_MPS: f64 = 0.05;
/// Share of headings on which the map or the gyro is altogether wrong.
const WRONG_HEADING: f64 = 1e-3;
/// Drift of the yaw rate's offset, rad/s in the root of a second.
const YAW_OFFSET_DRIFT: f64 = 1e-5;

/// Part of a fix's error that changes slowly.
fn slow_m2(covariance: &Matrix2<f64>, settings: &OccupancySettings) -> Matrix2<f64> {
    let map_m2 = settings.map_sigma_m.powi(2);
    covariance * settings.correlated_share + Matrix2::identity() * map_m2
}

impl Hypothesis {
    /// Variances of a hypothesis about whose place nothing is known but the course.
    pub fn start_fused(&mut self, settings: &OccupancySettings, heading_offset_rad: f64) {
        self.covariance = StateCovariance::zeros();
        self.covariance[(PLACE, PLACE)] = NEW_PLACE_SIGMA_M.powi(2);
        self.covariance[(SCALE, SCALE)] = settings.speed_scale_sigma.powi(2);
        self.covariance[(HEADING, HEADING)] = (2.0 * settings.heading_sigma_rad).powi(2);
        self.covariance[(YAW_OFFSET, YAW_OFFSET)] = settings.yaw_offset_sigma_radps.powi(2);
        self.mean[HEADING] = heading_offset_rad;
    }

    /// Carries it on over a time in which so much was run, by the measured speed.
    pub fn advance_fused(&mut self, (seconds, run_m): (f64, f64), settings: &OccupancySettings) {
        let keep = (-seconds / settings.correlation_s).exp();
        let mut transition = StateCovariance::identity();
        transition[(PLACE, SCALE)] = run_m;
        transition[(HEADING, YAW_OFFSET)] = seconds;
        for k in [EAST, NORTH] {
            transition[(k, k)] = keep;
        }
        self.mean = transition * self.mean;
        self.mean[PLACE] += run_m;
        self.covariance = transition * self.covariance * transition.transpose();
        let moves = run_m.abs() > STANDING_MPS * seconds;
        let speed_m2 = settings.speed_sigma_mps.powi(2) * seconds * SPEED_CORRELATION_S;
        self.covariance[(PLACE, PLACE)] += if moves { speed_m2 } else { 0.0 };
        self.covariance[(HEADING, HEADING)] += settings.yaw_rate_sigma_radps.powi(2) * seconds;
        self.covariance[(YAW_OFFSET, YAW_OFFSET)] += YAW_OFFSET_DRIFT.powi(2) * seconds;
        for k in [EAST, NORTH] {
            self.covariance[(k, k)] += (1.0 - keep * keep) * self.fix_variance_m2;
        }
    }

    /// Takes a fix in.
    pub fn update_fused(
        &mut self,
        network: &PlanNetwork,
        judged: &Judged,
        settings: &OccupancySettings,
    ) {
        let (fix, covariance) = (&judged.fix.place, &judged.fix.covariance_m2);
        if judged.is_worse || self.kind != Some(judged.kind) {
            self.change_kind(judged, settings);
        }
        self.fix_variance_m2 = 0.5 * slow_m2(covariance, settings).trace();
        self.fix_time = judged.fix.time;
        let (place, forward) = self.course.at(network, self.place_m());
        let mut measured = SMatrix::<f64, 2, STATES>::zeros();
        measured.set_column(PLACE, &forward);
        measured.set_column(EAST, &Vector2::x());
        measured.set_column(NORTH, &Vector2::y());
        let white = covariance * (1.0 - settings.correlated_share)
            + Matrix2::identity() * LEAST_FIX_SIGMA_M.powi(2);
        let off = fix - place - Vector2::new(self.mean[EAST], self.mean[NORTH]);
        let mut jumped = self.covariance;
        for k in [EAST, NORTH] {
            jumped[(k, k)] += settings.jump_sigma_m.powi(2);
        }
        let spread = |state: &StateCovariance| measured * state * measured.transpose() + white;
        let [stays, jumps] = [&self.covariance, &jumped].map(spread);
        let stays_log = (1.0 - settings.jump_probability).ln() + log_density(&off, &stays);
        let jumps_log = settings.jump_probability.ln() + log_density(&off, &jumps);
        let (prior, spread) = match stays_log >= jumps_log {
            true => (self.covariance, stays),
            false => (jumped, jumps),
        };
        let both = log_sum(stays_log, jumps_log);
        let Some(inverse) = spread.try_inverse().filter(|_| both.is_finite()) else {
            return;
        };
        self.log_probability += both;
        let gain = prior * measured.transpose() * inverse;
        self.mean += gain * off;
        let left = prior - gain * spread * gain.transpose();
        self.covariance = 0.5 * (left + left.transpose());
    }

    /// Takes in the sum of yaw rates since the start.
    pub fn update_heading(
        &mut self,
        network: &PlanNetwork,
        turned_rad: f64,
        settings: &OccupancySettings,
    ) {
        let half_m = 0.5 * settings.bogie_distance_m;
        let chord = |m: f64| self.course.heading_rad(network, [m - half_m, m + half_m]);
        let place_m = self.place_m();
        let off = wrapped(turned_rad - self.mean[HEADING] - chord(place_m));
        let mut measured = RowSVector::<f64, STATES>::zeros();
        measured[PLACE] = wrapped(chord(place_m + 1.0) - chord(place_m - 1.0)) / 2.0;
        measured[HEADING] = 1.0;
        let across = self.covariance * measured.transpose();
        let variance = (measured * across)[0] + settings.heading_sigma_rad.powi(2);
        let fits_log =
            (1.0 - WRONG_HEADING).ln() - 0.5 * (off * off / variance + (TAU * variance).ln());
        let wrong_log = (WRONG_HEADING / TAU).ln();
        let both = log_sum(fits_log, wrong_log);
        if !both.is_finite() {
            return;
        }
        self.log_probability += both;
        if fits_log > wrong_log {
            self.mean += across * (off / variance);
            let left = self.covariance - across * across.transpose() / variance;
            self.covariance = 0.5 * (left + left.transpose());
        }
    }

    /// The error of the fixes to come is that of fixes of their kind before, as far as it lasts. Without this a
    /// receiver that flips between two solutions would give news of one old error each time.
    fn change_kind(&mut self, judged: &Judged, settings: &OccupancySettings) {
        let now = judged.fix.time;
        if let Some(kind) = self.kind {
            let error_m = self.mean.fixed_rows::<2>(EAST).into_owned();
            let covariance_m2 = self.covariance.fixed_view::<2, 2>(EAST, EAST).into_owned();
            self.kinds.retain(|known| known.kind != kind);
            self.kinds.push(KindError {
                kind,
                time: self.fix_time,
                error_m,
                covariance_m2,
            });
        }
        let fresh_m2 = slow_m2(&judged.fix.covariance_m2, settings);
        let known = self.kinds.iter().find(|known| known.kind == judged.kind);
        let (error_m, covariance_m2) = match known.filter(|_| !judged.is_worse) {
            Some(known) => {
                let keep = (-now.since(known.time) / settings.correlation_s).exp();
                let kept_m2 = known.covariance_m2 * keep.powi(2);
                (
                    known.error_m * keep,
                    kept_m2 + fresh_m2 * (1.0 - keep.powi(2)),
                )
            }
            None => (Vector2::zeros(), fresh_m2),
        };
        for k in [EAST, NORTH] {
            self.covariance.row_mut(k).fill(0.0);
            self.covariance.column_mut(k).fill(0.0);
        }
        self.mean.fixed_rows_mut::<2>(EAST).copy_from(&error_m);
        self.covariance
            .fixed_view_mut::<2, 2>(EAST, EAST)
            .copy_from(&covariance_m2);
        self.kind = Some(judged.kind);
    }
}

fn log_density(off: &Vector2<f64>, spread: &Matrix2<f64>) -> f64 {
    let determinant = spread.determinant();
    match spread.try_inverse() {
        Some(inverse) if determinant > 0.0 => {
            -0.5 * ((off.transpose() * inverse * off)[0] + determinant.ln()) - TAU.ln()
        }
        _ => f64::NEG_INFINITY,
    }
}

/// Between -pi and pi.
fn wrapped(angle_rad: f64) -> f64 {
    (angle_rad + PI).rem_euclid(TAU) - PI
}
