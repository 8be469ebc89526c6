//! How the map's error changes along a track.
//!
//! The track lies so far to the left of where it is mapped, and is turned by so much: m and h = dm/ds along the run s.
//! Both are a Gauss-Markov process of second order (Matern's covariance with smoothness 3/2), m with the standard
//! deviation of the map and correlated over a length, h with that over the length. So what a map has wrong of a heading
//! is bounded, however far a train runs, and two tracks side by side, each with an error of its own, cannot be told
//! apart by it; and where a leg turns by more than a map can be wrong, it is told by that at once.
//!
//! For a run of s, with a = 1 / length, the transition is exp(-a s) (1 + a s, s; -a^2 s, 1 - a s); what is new has the
//! covariance that keeps the process as it is.

use super::settings::OccupancySettings;
use nalgebra::Matrix2;

/// Correlation length, metres: places of a map that are 67 m apart have half of their error in common, as between points
/// surveyed every 120 m.
const LENGTH_M: f64 = 40.0;

/// Covariance of both where nothing is known of them.
pub fn unknown(settings: &OccupancySettings) -> Matrix2<f64> {
    let aside_m2 = settings.map_sigma_m.powi(2);
    Matrix2::new(aside_m2, 0.0, 0.0, aside_m2 / LENGTH_M.powi(2))
}

/// Transition over a run, backwards below 0, and the covariance of what is new.
pub fn over_run(run_m: f64, settings: &OccupancySettings) -> (Matrix2<f64>, Matrix2<f64>) {
    let x = run_m.abs() / LENGTH_M;
    let transition = Matrix2::new(1.0 + x, run_m, -run_m / LENGTH_M.powi(2), 1.0 - x) * (-x).exp();
    let unknown = unknown(settings);
    (
        transition,
        unknown - transition * unknown * transition.transpose(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two runs are one of their sum, in what is kept and in what is new; backwards, the heading counts the other way.
    #[test]
    fn runs_add_up() {
        let settings = OccupancySettings::default();
        for (first_m, second_m) in [(3.0, 4.0), (0.02, 150.0), (-7.0, -30.0), (0.0, 5.0)] {
            let [first, second, both] =
                [first_m, second_m, first_m + second_m].map(|run_m| over_run(run_m, &settings));
            assert!((second.0 * first.0 - both.0).norm() < 1e-12 * both.0.norm().max(1.0));
            let new = second.0 * first.1 * second.0.transpose() + second.1;
            assert!((new - both.1).norm() < 1e-12);
            let mirror = Matrix2::new(1.0, 0.0, 0.0, -1.0);
            let back = over_run(-first_m, &settings);
            assert_eq!(mirror * back.0 * mirror, first.0);
        }
    }

    /// What is new is a covariance, for long runs that of a map of which nothing is known.
    #[test]
    fn what_is_new_is_bounded() {
        let settings = OccupancySettings::default();
        for run_m in [1e-6, 1e-3, 0.1, 1.0, 10.0, 1e3, 1e6] {
            let (_, new) = over_run(run_m, &settings);
            let least = new.symmetric_eigenvalues().min();
            assert!(least > -1e-15, "{run_m}: {least}");
        }
        assert!((over_run(1e4, &settings).1 - unknown(&settings)).norm() < 1e-9);
    }
}
