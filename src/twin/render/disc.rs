//! Places spread evenly over a disc: of a light, or of a lens's pupil.

use nalgebra::{Point3, Vector3};
use std::f64::consts::PI;

/// Places on a light's disc from which shadows are counted.
pub const DISC_PLACES: usize = 16;

/// Places on a disc, each for the same share of its area: on a spiral of the golden angle (after
/// Vogel, "A better way to construct the sunflower head", Mathematical Biosciences 44, 1979).
pub fn disc_points(
    centre: &Point3<f64>,
    axis: &Vector3<f64>,
    radius_m: f64,
    count: usize,
) -> impl Iterator<Item = Point3<f64>> {
    let golden_rad = PI * (3.0 - 5f64.sqrt());
    let aside = axis.cross(&Vector3::z());
    let aside = aside.try_normalize(1e-6).unwrap_or_else(Vector3::x);
    let (centre, up) = (*centre, aside.cross(axis));
    (0..count).map(move |k| {
        let (sin, cos) = (k as f64 * golden_rad).sin_cos();
        let r = radius_m * ((k as f64 + 0.5) / count as f64).sqrt();
        centre + (aside * cos + up * sin) * r
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Fails where the places on a disc leave a part of it out: their mean and mean square
    /// distance are those of an even disc.
    #[test]
    fn places_are_even_over_the_disc() {
        let (centre, axis) = (Point3::new(3.0, -2.0, 7.0), Vector3::new(0.6, 0.0, -0.8));
        let places = disc_points(&centre, &axis, 0.5, DISC_PLACES);
        let offs: Vec<_> = places.map(|p| p - centre).collect();
        let mean = offs.iter().sum::<Vector3<f64>>() / 16.0;
        let square = offs.iter().map(Vector3::norm_squared).sum::<f64>() / 16.0;
        assert!(mean.norm() < 0.03 && (square / 0.125 - 1.0).abs() < 1e-9);
        assert!(offs.iter().all(|o| o.dot(&axis).abs() < 1e-12));
        for k in 0..32 {
            // No half of it has more than one and a half places too many.
            let (sin, cos) = (TAU * f64::from(k) / 32.0).sin_cos();
            let half = Vector3::y() * sin + Vector3::new(0.8, 0.0, 0.6) * cos;
            let over = offs.iter().filter(|o| o.dot(&half) > 0.0).count();
            assert!((7..=9).contains(&over), "{over}");
        }
    }
}
