//! The curve of a hanging cable: y = a cosh(x / a), a = horizontal tension over weight per metre.

use crate::numerics::bisected;
use nalgebra::{Point3, Vector3};

/// The catenary of a given length between two points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Catenary {
    from: Point3<f64>,
    /// Horizontal direction to the other end.
    along: Vector3<f64>,
    length_m: f64,
    /// Parameter a.
    a_m: f64,
    /// Lowest point, along from the first end.
    lowest_m: f64,
}

/// Ends above one another: they are taken to be this far apart.
const LEAST_SPAN_M: f64 = 1e-3;
/// A cable is longer than the straight line between its ends by this share at least.
const LEAST_SLACK: f64 = 1e-6;

impl Catenary {
    /// Of a cable that is at least as long as the ends are apart.
    pub(super) fn new(from: Point3<f64>, to: Point3<f64>, length_m: f64) -> Self {
        let reach = to - from;
        let level = Vector3::new(reach.x, reach.y, 0.0);
        let span_m = level.norm().max(LEAST_SPAN_M);
        let length_m = length_m.max(reach.norm() * (1.0 + LEAST_SLACK));
        // sinh(u) / u = sqrt(L^2 - v^2) / d with u = d / 2a grows with u, so bisection finds u.
        let wanted = ((length_m.powi(2) - reach.z.powi(2)).sqrt() / span_m).max(1.0);
        let (low, high) = bisected((1e-6, 50.0), 100, |u| u.sinh() / u < wanted);
        let a_m = 0.5 * span_m / (0.5 * (low + high));
        Self {
            from,
            along: level.try_normalize(1e-9).unwrap_or_else(Vector3::x),
            length_m,
            a_m,
            lowest_m: 0.5 * span_m - a_m * (reach.z / length_m).atanh(),
        }
    }

    /// Point at a length along the cable from its first end.
    pub(super) fn at(&self, run_m: f64) -> Point3<f64> {
        let a = self.a_m;
        let start = -self.lowest_m / a;
        let x_m = self.lowest_m + a * (run_m / a + start.sinh()).asinh();
        let height_m = a * (((x_m - self.lowest_m) / a).cosh() - start.cosh());
        self.from + self.along * x_m + Vector3::z() * height_m
    }

    /// `n + 1` points at equal lengths along the cable, both ends included.
    pub(super) fn points(&self, n: usize) -> impl Iterator<Item = Point3<f64>> + use<> {
        let own = *self;
        (0..=n).map(move |k| own.at(own.length_m * k as f64 / n as f64))
    }

    /// Horizontal part of its tension over its weight per metre.
    #[cfg(test)]
    pub(super) fn parameter_m(&self) -> f64 {
        self.a_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fails where the ends are missed, the length is not kept, or it does not sag as y'' of a
    /// hanging cable demands; level, slanted, taut, slack, and with ends above one another.
    #[test]
    fn it_hangs_between_its_ends() {
        let from = Point3::new(1.0, 2.0, 3.0);
        for (to, length_m) in [
            (Point3::new(9.0, 2.0, 3.0), 9.0),
            (Point3::new(9.0, 5.0, 5.0), 10.0),
            (Point3::new(4.0, 2.0, 1.0), 3.607),
            (Point3::new(1.5, 2.0, 3.0), 8.0),
            (Point3::new(1.0, 2.0, 3.0), 4.0),
        ] {
            let catenary = Catenary::new(from, to, length_m);
            let points: Vec<_> = catenary.points(2000).collect();
            assert!((points[0] - from).norm() < 1e-9);
            assert!((points[2000] - to).norm() < 2e-3, "{} {to}", points[2000]);
            let length: f64 = points.windows(2).map(|p| (p[1] - p[0]).norm()).sum();
            assert!(
                (length / length_m - 1.0).abs() < 1e-3,
                "{length} {length_m}"
            );
            // Slope grows with the length run: dy/dx = (s - s0) / a.
            let slope = |k: usize| {
                let d: Vector3<f64> = points[k + 1] - points[k];
                d.z / d.xy().norm()
            };
            let grown = slope(1500) - slope(500);
            let wanted = 0.5 * length_m / catenary.parameter_m();
            assert!((grown / wanted - 1.0).abs() < 1e-2, "{grown} {wanted}");
        }
    }
}
