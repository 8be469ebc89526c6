//! Position from ranges, as a receiver works it out.
//!
//! Weighted least squares over east, north, up and the receiver's clock (Misra and Enge, Global Positioning System,
//! chapter 6). Ranges whose residual is too large for its standard deviation are left out one by one (receiver
//! autonomous integrity monitoring with exclusion). Positions are linear in range errors here: the second order is
//! below a micrometre for errors of a hundred metres.

use nalgebra::{Matrix2, Matrix4, Unit, Vector3, Vector4};

/// Unknowns.
const UNKNOWNS: usize = 4;
/// A range is left out if its residual has more standard deviations.
const MOST_DEVIATIONS: f64 = 4.0;

/// One satellite's range.
#[derive(Clone, Copy, Debug)]
pub struct MeasuredRange {
    /// East, north, up.
    pub direction: Unit<Vector3<f64>>,
    /// How wrong it is.
    pub error_m: f64,
    /// How wrong the receiver takes it for.
    pub sigma_m: f64,
}

/// Error and stated covariance of a position.
#[derive(Clone, Copy, Debug)]
pub struct Solution {
    /// East, north, up.
    pub error_m: Vector3<f64>,
    /// Of east and north.
    pub covariance_m2: Matrix2<f64>,
    /// Ranges that were used.
    pub satellites: usize,
}

/// From all ranges that fit together; none where these are too few, or all stand in line.
pub fn solve(mut ranges: Vec<MeasuredRange>) -> Option<Solution> {
    while ranges.len() >= UNKNOWNS {
        let cofactor = normal_matrix(&ranges).try_inverse()?;
        let sum: Vector4<f64> = ranges
            .iter()
            .map(|range| row(range) * (range.error_m / range.sigma_m.powi(2)))
            .sum();
        let found = cofactor * sum;
        let deviations = |range: &MeasuredRange| {
            let row = row(range);
            let left_m2 = range.sigma_m.powi(2) - row.dot(&(cofactor * row));
            let residual_m = range.error_m - row.dot(&found);
            residual_m.abs() / left_m2.max(f64::MIN_POSITIVE).sqrt()
        };
        let worst = (0..ranges.len())
            .map(|k| (k, deviations(&ranges[k])))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        match worst {
            // With one range more than unknowns all residuals are alike: none can be told from the others.
            Some((k, worst)) if worst > MOST_DEVIATIONS && ranges.len() > UNKNOWNS + 1 => {
                ranges.remove(k);
            }
            _ => {
                let covariance_m2 = cofactor.fixed_view::<2, 2>(0, 0).into_owned();
                return covariance_m2
                    .iter()
                    .all(|m2| m2.is_finite())
                    .then_some(Solution {
                        error_m: found.xyz(),
                        covariance_m2: 0.5 * (covariance_m2 + covariance_m2.transpose()),
                        satellites: ranges.len(),
                    });
            }
        }
    }
    None
}

/// A range changes by this as east, north, up and clock change.
fn row(range: &MeasuredRange) -> Vector4<f64> {
    let d = range.direction;
    Vector4::new(-d.x, -d.y, -d.z, 1.0)
}

fn normal_matrix(ranges: &[MeasuredRange]) -> Matrix4<f64> {
    ranges
        .iter()
        .map(|range| row(range) * row(range).transpose() / range.sigma_m.powi(2))
        .sum()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    fn range(azimuth_deg: f64, elevation_deg: f64, error_m: f64) -> MeasuredRange {
        let (sin_a, cos_a) = azimuth_deg.to_radians().sin_cos();
        let (sin_e, cos_e) = elevation_deg.to_radians().sin_cos();
        MeasuredRange {
            direction: Unit::new_normalize(Vector3::new(sin_a * cos_e, cos_a * cos_e, sin_e)),
            error_m,
            sigma_m: 2.0,
        }
    }

    /// n satellites evenly around at one elevation and one at the zenith: the sums of sines and cosines vanish, so the
    /// variance of east and of north is 2 sigma^2 / (n cos^2 elevation), and there is no covariance.
    #[test]
    fn an_even_sky_has_the_closed_form() {
        let mut ranges: Vec<_> = (0..6)
            .map(|k| range(60.0 * f64::from(k), 30.0, 0.0))
            .collect();
        ranges.push(range(0.0, 90.0, 0.0));
        let solution = solve(ranges.clone()).unwrap();
        let expected_m2 = 2.0 * 4.0 / (6.0 * 0.75);
        assert!((solution.covariance_m2 - Matrix2::identity() * expected_m2).norm() < 1e-9);
        // An error that all ranges share is the clock's.
        for range in &mut ranges {
            range.error_m = 300.0;
        }
        assert!(solve(ranges.clone()).unwrap().error_m.norm() < 1e-6);
        // Errors that a place has are that place.
        let away = Vector3::new(3.0, -4.0, 5.0);
        for range in &mut ranges {
            range.error_m = -range.direction.dot(&away);
        }
        assert!((solve(ranges).unwrap().error_m - away).norm() < 1e-9);
    }

    /// One reflection among nine satellites is left out; with five it cannot be told, and with three there is no
    /// position.
    #[test]
    fn a_long_range_is_left_out() {
        let with = |count: u32| {
            let mut ranges: Vec<_> = (0..count - 1)
                .map(|k| range(360.0 * f64::from(k) / f64::from(count - 1), 30.0, 0.0))
                .collect();
            ranges.push(range(0.0, 80.0, 0.0));
            ranges[1].error_m = 60.0;
            solve(ranges)
        };
        let nine = with(9).unwrap();
        assert_eq!(nine.satellites, 8);
        assert!(nine.error_m.norm() < 1e-9);
        let five = with(5).unwrap();
        assert_eq!(five.satellites, 5);
        assert!(five.error_m.xy().norm() > 5.0);
        assert!(with(3).is_none());
    }
}
