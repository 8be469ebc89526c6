//! What a fix and the sum of yaw rates say of a hypothesis: an extended Kalman filter with the likelihood of what it
//! finds.
//!
//! A fix is z = p(l) + b + w, with the error b that changes slowly (see `fix_error`) and white w. The likelihood is
//! that of all ways that b may have gone; the filter follows the one that explains the fix best.
//!
//! The sum of yaw rates is the heading of the chord between the bogies, less an offset that drifts.

use super::HEADING_EVERY_M;
use super::dead_reckoning::TrainRun;
use super::fix_error::{self, slow_m2};
use super::fix_trust::Judged;
use super::hypothesis::{
    ASIDE, FIX_ERROR, HEADING, Hypothesis, NEAR_M, PLACE, SCALE, STATES, State, StateCovariance,
    TURNED, YAW_OFFSET, left_of, log_sum, sum_of_parts, wrapped,
};
use super::map_error::{self, MapErrorChange};
use super::settings::OccupancySettings;
use crate::track::plan::PlanNetwork;
use nalgebra::{Matrix2, RowSVector, SMatrix, Vector2};
use std::f64::consts::TAU;

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

/// Heading of the car on the map, around the place of a hypothesis.
#[derive(Clone, Copy)]
pub struct MappedHeading {
    pub here_rad: f64,
    /// By how much it turns to the left for each metre farther on.
    slope_radpm: f64,
    /// Variance, because it does not turn evenly.
    bend_rad2: f64,
}

impl Hypothesis {
    /// Variances of a hypothesis about whose place nothing is known but the course.
    pub fn start_fused(&mut self, settings: &OccupancySettings, heading_offset_rad: f64) {
        let map = map_error::stationary(settings);
        *self.covariance = StateCovariance::zeros();
        self.covariance[(PLACE, PLACE)] = NEW_PLACE_SIGMA_M.powi(2);
        self.covariance[(SCALE, SCALE)] = settings.speed_scale_sigma.powi(2);
        self.covariance[(YAW_OFFSET, YAW_OFFSET)] = settings.yaw_offset_sigma_radps.powi(2);
        self.covariance
            .fixed_view_mut::<2, 2>(ASIDE, ASIDE)
            .copy_from(&map);
        // The offset was taken from the map's heading.
        let turned_rad2 = map[(1, 1)];
        self.covariance[(HEADING, HEADING)] =
            (2.0 * settings.heading_sigma_rad).powi(2) + turned_rad2;
        self.covariance[(HEADING, TURNED)] = -turned_rad2;
        self.covariance[(TURNED, HEADING)] = -turned_rad2;
        self.mean[HEADING] = heading_offset_rad;
    }

    /// Carries it on over a run.
    pub(super) fn advance_fused(&mut self, advance: &Advance) {
        advance.apply(&mut self.mean);
        self.mean[PLACE] += advance.run_m;
        // The covariance is symmetric: F P F' = F (F P)'.
        advance.apply(&mut *self.covariance);
        self.covariance.transpose_mut();
        advance.apply(&mut *self.covariance);
        self.covariance[(PLACE, PLACE)] += advance.new_place_m2;
        self.covariance[(HEADING, HEADING)] += advance.new_heading_rad2;
        self.covariance[(YAW_OFFSET, YAW_OFFSET)] += YAW_OFFSET_DRIFT.powi(2) * advance.seconds;
        for (part, keep) in advance.keep.iter().enumerate() {
            let new_m2 = (1.0 - keep * keep) * self.fix_variances_m2[part];
            for axis in [FIX_ERROR + 2 * part, FIX_ERROR + 2 * part + 1] {
                self.covariance[(axis, axis)] += new_m2;
            }
        }
        let mut of_map = self.covariance.fixed_view_mut::<2, 2>(ASIDE, ASIDE);
        of_map += advance.map.new;
    }

    /// Takes a fix in.
    pub fn update_fused(
        &mut self,
        network: &PlanNetwork,
        judged: &Judged,
        settings: &OccupancySettings,
    ) {
        let (fix, covariance) = (&judged.fix.place, &judged.fix.covariance_m2);
        let (mapped, forward) = self.course.at(network, self.place_m());
        let slow_m2 = slow_m2(covariance, &forward, settings);
        let ways = self.error_ways(judged, &slow_m2, settings);
        self.kind = Some(judged.kind);
        let place = mapped + self.placing.shift_m() + left_of(&forward) * self.mean[ASIDE];
        let white = covariance * (1.0 - settings.correlated_share)
            + Matrix2::identity() * LEAST_FIX_SIGMA_M.powi(2);
        let of_state = spread(&self.covariance, &forward);
        let place_m2 = spread_of_place(&self.covariance, &forward);
        let found = ways.map(|way| {
            let of_error = if way.is_own { place_m2 } else { of_state };
            let spread = white + fix_error::sum_m2(&way.more_m2) + of_error;
            let off = fix - place - sum_of_parts(&way.error_m);
            (way.probability.ln() + log_density(&off, &spread), spread)
        });
        let all = found.iter().map(|(log, _)| *log).reduce(log_sum);
        let most = (0..found.len()).max_by(|a, b| found[*a].0.total_cmp(&found[*b].0));
        let (Some(all), Some(most)) = (all.filter(|all| all.is_finite()), most) else {
            return;
        };
        self.log_probability += all;
        let (way, (_, spread)) = (&ways[most], &found[most]);
        self.has_jumped = way.is_jump;
        self.set_error(way);
        let off = fix - place - self.error_m();
        self.correct(&forward, &off, spread);
    }

    /// Kalman's update with what was found of place and error together.
    fn correct(&mut self, forward: &Vector2<f64>, off: &Vector2<f64>, spread: &Matrix2<f64>) {
        let Some(inverse) = spread.try_inverse() else {
            return;
        };
        let across = across(&self.covariance, forward);
        let gain = across * inverse;
        self.mean += gain * off;
        for i in 0..STATES {
            for j in 0..=i {
                let known = gain[(i, 0)] * across[(j, 0)] + gain[(i, 1)] * across[(j, 1)];
                let left = 0.5 * (self.covariance[(i, j)] + self.covariance[(j, i)]) - known;
                self.covariance[(i, j)] = left;
                self.covariance[(j, i)] = left;
            }
        }
    }

    /// Takes in the sum of yaw rates since the start. Gives the logarithm of the likelihood of what was found.
    pub fn update_heading(
        &mut self,
        mapped: &MappedHeading,
        turned_rad: f64,
        settings: &OccupancySettings,
    ) -> f64 {
        let off = wrapped(turned_rad - self.mean[HEADING] - self.mean[TURNED] - mapped.here_rad);
        let mut measured = RowSVector::<f64, STATES>::zeros();
        measured[PLACE] = mapped.slope_radpm;
        measured[HEADING] = 1.0;
        measured[TURNED] = 1.0;
        let across = *self.covariance * measured.transpose();
        // The heading of a chord differs from that at its middle by an error that stays the same over the chord's length.
        // Headings are compared more often: for each its variance is so many times larger.
        let chord_rad2 =
            map_error::chord_rad2(settings) * settings.bogie_distance_m / HEADING_EVERY_M;
        let variance = (measured * across)[0]
            + settings.heading_sigma_rad.powi(2)
            + mapped.bend_rad2
            + chord_rad2;
        let fits_log =
            (1.0 - WRONG_HEADING).ln() - 0.5 * (off * off / variance + (TAU * variance).ln());
        let wrong_log = (WRONG_HEADING / TAU).ln();
        let both = log_sum(fits_log, wrong_log);
        if fits_log > wrong_log {
            self.correct_by(&across, off, variance);
        }
        // What is no number is dropped with the state that it comes from.
        both.max(wrong_log)
    }

    /// Heading of the car on the map, where the antenna is at a place of its course. Its slope is taken over one standard deviation of the place to both sides. So a kink at a mapped point hardly
    /// counts as a curve, and where the heading does not turn evenly over that stretch, the difference counts as variance.
    pub fn mapped_heading(
        &self,
        network: &PlanNetwork,
        place_m: f64,
        settings: &OccupancySettings,
    ) -> MappedHeading {
        let spread_m = self.sigma_m().max(NEAR_M);
        let [behind, here, ahead] = [-spread_m, 0.0, spread_m]
            .map(|m| self.car_heading_rad(network, place_m + m, settings));
        let [to_here, to_ahead] = [here - behind, ahead - here].map(wrapped);
        MappedHeading {
            here_rad: here,
            slope_radpm: (to_here + to_ahead) / (2.0 * spread_m),
            bend_rad2: (0.5 * (to_ahead - to_here)).powi(2),
        }
    }

    /// Kalman's update with one number: by how much it is off, its variance, and the state's covariance with it.
    pub fn correct_by(&mut self, across: &State, off: f64, variance: f64) {
        self.mean += across * (off / variance);
        let left = *self.covariance - across * across.transpose() / variance;
        *self.covariance = 0.5 * (left + left.transpose());
    }
}

/// How the states of all hypotheses go on over a run. The transition is a unit matrix but for a few elements.
pub(super) struct Advance {
    /// By the measured speed.
    run_m: f64,
    seconds: f64,
    /// Of the two parts of the error of fixes.
    keep: [f64; 2],
    map: MapErrorChange,
    /// Variances of what is new.
    new_place_m2: f64,
    new_heading_rad2: f64,
}

impl Advance {
    pub fn over(run: &TrainRun, settings: &OccupancySettings) -> Self {
        let (seconds, run_m) = (run.seconds, run.length_m);
        let moves = run_m.abs() > STANDING_MPS * seconds;
        let speed_m2 = settings.speed_sigma_mps.powi(2) * seconds * SPEED_CORRELATION_S;
        Self {
            run_m,
            seconds,
            keep: fix_error::kept(seconds, settings),
            map: MapErrorChange::over_run(run_m, settings),
            new_place_m2: if moves { speed_m2 } else { 0.0 } + run.unknown_m2,
            new_heading_rad2: settings.yaw_rate_sigma_radps.powi(2) * seconds + run.unknown_rad2,
        }
    }

    /// Multiplies columns by the transition, from the left.
    fn apply<const N: usize>(&self, columns: &mut SMatrix<f64, STATES, N>) {
        for mut state in columns.column_iter_mut() {
            state[PLACE] += self.run_m * state[SCALE];
            state[HEADING] += self.seconds * state[YAW_OFFSET];
            for axis in 0..4 {
                state[FIX_ERROR + axis] *= self.keep[axis / 2];
            }
            let of_map = self.map.transition * Vector2::new(state[ASIDE], state[TURNED]);
            (state[ASIDE], state[TURNED]) = (of_map.x, of_map.y);
        }
    }
}

/// Covariance of the state with a fix: that of the place, forwards and aside, and of the error.
fn across(covariance: &StateCovariance, forward: &Vector2<f64>) -> SMatrix<f64, STATES, 2> {
    let left = left_of(forward);
    SMatrix::from_fn(|k, axis| {
        forward[axis] * covariance[(k, PLACE)]
            + left[axis] * covariance[(k, ASIDE)]
            + covariance[(k, FIX_ERROR + axis)]
            + covariance[(k, FIX_ERROR + 2 + axis)]
    })
}

/// Covariance of a fix, but for its white part.
fn spread(covariance: &StateCovariance, forward: &Vector2<f64>) -> Matrix2<f64> {
    let (across, left) = (across(covariance, forward), left_of(forward));
    Matrix2::from_fn(|i, j| {
        forward[i] * across[(PLACE, j)]
            + left[i] * across[(ASIDE, j)]
            + across[(FIX_ERROR + i, j)]
            + across[(FIX_ERROR + 2 + i, j)]
    })
}

/// Covariance of the place in the plane.
fn spread_of_place(covariance: &StateCovariance, forward: &Vector2<f64>) -> Matrix2<f64> {
    let axes = [(PLACE, *forward), (ASIDE, left_of(forward))];
    let pairs = axes.iter().flat_map(|a| axes.iter().map(move |b| (a, b)));
    pairs
        .map(|((i, a), (j, b))| a * b.transpose() * covariance[(*i, *j)])
        .sum()
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
