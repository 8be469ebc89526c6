//! How the map's error changes along a track.
//!
//! The track lies so far to the left of where it is mapped, and is turned by so much: m and h = dm/ds along the run s.
//! Both are a Gauss-Markov process of second order (Matern's covariance with smoothness 3/2), m with the standard
//! deviation of the map and correlated over a length, h with that deviation divided by the length. So what a map has wrong
//! of a heading is bounded, however far a train runs, and two tracks side by side, each with an error of its own, cannot
//! be told apart by it; and where a leg turns by more than a map can be wrong, it is told by that at once. A map whose
//! errors change over a shorter length than this has headings that are worse than believed.
//!
//! For a run of s, with a = 1 / length, the transition is exp(-a s) (1 + a s, s; -a^2 s, 1 - a s); what is new has the
//! covariance that keeps the process as it is.

use super::settings::OccupancySettings;
use nalgebra::Matrix2;

/// Covariance of m, in metres, and h, in radians, where no fix or heading has said anything of them.
pub fn stationary(settings: &OccupancySettings) -> Matrix2<f64> {
    let aside_m2 = settings.map_sigma_m.powi(2);
    Matrix2::new(
        aside_m2,
        0.0,
        0.0,
        aside_m2 / settings.map_correlation_m.powi(2),
    )
}

/// Variance of the difference between h and the same of a chord around it, (m(D/2) - m(-D/2)) / D, which is what a car on
/// bogies D apart turns by, square radians.
pub fn chord_rad2(settings: &OccupancySettings) -> f64 {
    let x = settings.bogie_distance_m / settings.map_correlation_m;
    let point_rad2 = stationary(settings)[(1, 1)];
    let chord = 2.0 * (1.0 - (1.0 + x) * (-x).exp()) / x.powi(2);
    point_rad2 * (1.0 + chord - 2.0 * (-0.5 * x).exp()).max(0.0)
}

/// What becomes of m and h over a run.
pub struct MapErrorChange {
    pub transition: Matrix2<f64>,
    /// Covariance of what is new.
    pub new: Matrix2<f64>,
}

impl MapErrorChange {
    /// Over a run, backwards below 0.
    pub fn over_run(run_m: f64, settings: &OccupancySettings) -> Self {
        let length_m = settings.map_correlation_m;
        let x = run_m.abs() / length_m;
        let transition =
            Matrix2::new(1.0 + x, run_m, -run_m / length_m.powi(2), 1.0 - x) * (-x).exp();
        let stationary = stationary(settings);
        Self {
            transition,
            new: stationary - transition * stationary * transition.transpose(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two runs are one of their sum, in what is kept and in what is new; backwards, the heading counts the other way.
    #[test]
    fn runs_add_up() {
        let settings = OccupancySettings::default();
        for (first_m, second_m) in [(3.0, 4.0), (0.02, 150.0), (-7.0, -30.0), (0.0, 5.0)] {
            let over_run = |run_m| MapErrorChange::over_run(run_m, &settings);
            let [first, second, both] = [first_m, second_m, first_m + second_m].map(over_run);
            let kept = second.transition * first.transition;
            assert!((kept - both.transition).norm() < 1e-12 * both.transition.norm().max(1.0));
            let new = second.transition * first.new * second.transition.transpose() + second.new;
            assert!((new - both.new).norm() < 1e-12);
            let mirror = Matrix2::new(1.0, 0.0, 0.0, -1.0);
            let back = over_run(-first_m);
            assert_eq!(mirror * back.transition * mirror, first.transition);
        }
    }

    /// What is new is a covariance, for long runs that of a map of which nothing is known.
    #[test]
    fn what_is_new_is_bounded() {
        let settings = OccupancySettings::default();
        for run_m in [1e-6, 1e-3, 0.1, 1.0, 10.0, 1e3, 1e6] {
            let new = MapErrorChange::over_run(run_m, &settings).new;
            let least = new.symmetric_eigenvalues().min();
            assert!(least > -1e-15, "{run_m}: {least}");
        }
        let long = MapErrorChange::over_run(1e4, &settings);
        assert!((long.new - stationary(&settings)).norm() < 1e-9);
    }
}
