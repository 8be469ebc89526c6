//! Least-squares ellipse: A u^2 + B uv + C v^2 + D u + E v + 1 = 0 on edge points.
//!
//! The sum of squares of the left side is least where five linear equations hold. The constant
//! term forbids ellipses through the origin, so points are first moved to their mean and scaled
//! to unit size; that also keeps the equations well conditioned. The centre is
//! u = (B E - 2 C D)/(4 A C - B^2), v = (B D - 2 A E)/(4 A C - B^2).

use crate::bus::Ellipse;
use nalgebra::{Matrix2, Matrix5, Point2, SymmetricEigen, Vector5};

/// An ellipse with how well it fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EllipseFit {
    /// The ellipse.
    pub ellipse: Ellipse,
    /// Root mean square distance of the points from it.
    pub rms_px: f64,
    /// Standard deviation of the centre along u, from the scatter of the points: large where only
    /// an arc is seen.
    pub centre_sigma_px: f64,
}

/// Fewer edge points than this say too little about five unknowns.
const MIN_POINTS: usize = 10;

/// Fits an ellipse; points farther off than three times the rms are left out of a second fit.
/// `None` for too few points, and where they lie on no ellipse.
pub fn fit_ellipse(points: &[Point2<f64>]) -> Option<EllipseFit> {
    let first = fit(points, |_| true)?;
    let limit = (3.0 * first.fit.rms_px).max(0.05);
    let second = fit(points, |p| first.distance_px(p).abs() <= limit)?;
    Some(second.fit)
}

struct Fitted {
    fit: EllipseFit,
    mean: Point2<f64>,
    scale: f64,
    conic: [f64; 5],
}

impl Fitted {
    fn scaled(&self, p: &Point2<f64>) -> (f64, f64) {
        (
            (p.x - self.mean.x) / self.scale,
            (p.y - self.mean.y) / self.scale,
        )
    }

    /// The conic's left side.
    fn value(&self, p: &Point2<f64>) -> f64 {
        let [a, b, c, d, e] = self.conic;
        let (u, v) = self.scaled(p);
        a * u * u + b * u * v + c * v * v + d * u + e * v + 1.0
    }

    /// First-order distance from the ellipse, positive outside (Sampson's).
    fn distance_px(&self, p: &Point2<f64>) -> f64 {
        let [a, b, c, d, e] = self.conic;
        let (u, v) = self.scaled(p);
        let slope = (2.0 * a * u + b * v + d).hypot(b * u + 2.0 * c * v + e);
        self.scale * self.value(p) / slope.max(1e-12)
    }
}

fn fit(points: &[Point2<f64>], used: impl Fn(&Point2<f64>) -> bool) -> Option<Fitted> {
    let chosen = || points.iter().filter(|p| used(p));
    let n = chosen().count();
    if n < MIN_POINTS {
        return None;
    }
    let sum = chosen().fold(nalgebra::Vector2::zeros(), |s, p| s + p.coords);
    let mean = Point2::from(sum / n as f64);
    let spread: f64 = chosen().map(|p| (p - mean).norm_squared()).sum();
    let scale = (spread / n as f64).sqrt();
    if !scale.is_finite() || scale <= 1e-9 {
        return None;
    }
    let mut normal = Matrix5::zeros();
    let mut right = Vector5::zeros();
    for p in chosen() {
        let (u, v) = ((p.x - mean.x) / scale, (p.y - mean.y) / scale);
        let row = Vector5::new(u * u, u * v, v * v, u, v);
        normal += row * row.transpose();
        right -= row;
    }
    let factor = normal.cholesky()?;
    let conic: [f64; 5] = factor.solve(&right).into();
    let mut fitted = Fitted {
        fit: EllipseFit {
            ellipse: to_ellipse(conic, &mean, scale)?,
            rms_px: 0.0,
            centre_sigma_px: f64::INFINITY,
        },
        mean,
        scale,
        conic,
    };
    let squares: f64 = chosen().map(|p| fitted.distance_px(p).powi(2)).sum();
    fitted.fit.rms_px = (squares / n as f64).sqrt();
    // The algebraic residual's variance spreads over the solution by the inverse normal matrix.
    let freedom = (n - 5) as f64;
    let algebraic: f64 = chosen().map(|p| fitted.value(p).powi(2)).sum();
    let slope = centre_u_slope(conic);
    let variance = algebraic / freedom * slope.dot(&factor.solve(&slope));
    fitted.fit.centre_sigma_px = scale * variance.max(0.0).sqrt();
    Some(fitted)
}

/// Derivatives of the centre's u by the conic's five coefficients.
fn centre_u_slope([a, b, c, d, e]: [f64; 5]) -> Vector5<f64> {
    let determinant = 4.0 * a * c - b * b;
    let u = (b * e - 2.0 * c * d) / determinant;
    Vector5::new(
        -4.0 * c * u,
        e + 2.0 * b * u,
        -2.0 * d - 4.0 * a * u,
        -2.0 * c,
        b,
    ) / determinant
}

/// Centre and axes of a conic; `None` where it is no real ellipse.
fn to_ellipse([a, b, c, d, e]: [f64; 5], mean: &Point2<f64>, scale: f64) -> Option<Ellipse> {
    let determinant = 4.0 * a * c - b * b;
    if !determinant.is_finite() || determinant <= 1e-9 * (a * a + b * b + c * c) {
        return None;
    }
    let u = (b * e - 2.0 * c * d) / determinant;
    let v = (b * d - 2.0 * a * e) / determinant;
    // About its centre the conic is Q(p) = -value there.
    let value = 1.0 + 0.5 * (d * u + e * v);
    let eigen = SymmetricEigen::new(Matrix2::new(a, 0.5 * b, 0.5 * b, c));
    let [first, second] = [0, 1].map(|k| -value / eigen.eigenvalues[k]);
    if !(first > 0.0 && second > 0.0) {
        return None;
    }
    let (major, minor, k) = if first >= second {
        (first, second, 0)
    } else {
        (second, first, 1)
    };
    let axis = eigen.eigenvectors.column(k);
    Some(Ellipse {
        centre: Point2::new(mean.x + scale * u, mean.y + scale * v),
        semi_major_px: scale * major.sqrt(),
        semi_minor_px: scale * minor.sqrt(),
        angle_rad: (axis[1] / axis[0]).atan(),
    })
}

/// Roundness 4 pi S / P^2 of an ellipse, with Ramanujan's perimeter (error under 1e-4 here).
pub fn roundness(ellipse: &Ellipse) -> f64 {
    let (a, b) = (ellipse.semi_major_px, ellipse.semi_minor_px);
    let h = ((a - b) / (a + b)).powi(2);
    let perimeter =
        std::f64::consts::PI * (a + b) * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()));
    4.0 * std::f64::consts::PI.powi(2) * a * b / perimeter.powi(2)
}

/// Left and right end of an ellipse's chord along row `v`; `None` above and below it.
pub fn chord(e: &Ellipse, v: f64) -> Option<(f64, f64)> {
    let (sin, cos) = e.angle_rad.sin_cos();
    let (a2, b2) = (e.semi_major_px.powi(2), e.semi_minor_px.powi(2));
    // Variances of the outline: half height squared, half width squared and their covariance.
    let (uu, vv) = (
        a2 * cos * cos + b2 * sin * sin,
        a2 * sin * sin + b2 * cos * cos,
    );
    let uv = (a2 - b2) * sin * cos;
    let dv = v - e.centre.y;
    let left_over = 1.0 - dv * dv / vv;
    (left_over > 0.0).then(|| {
        let middle = e.centre.x + dv * uv / vv;
        let half = ((uu - uv * uv / vv).max(0.0) * left_over).sqrt();
        (middle - half, middle + half)
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// A point of an ellipse at parameter `t` (0 to 2 pi).
    fn point_at(e: &Ellipse, t: f64) -> Point2<f64> {
        let (sin, cos) = e.angle_rad.sin_cos();
        let (x, y) = (e.semi_major_px * t.cos(), e.semi_minor_px * t.sin());
        Point2::new(
            e.centre.x + x * cos - y * sin,
            e.centre.y + x * sin + y * cos,
        )
    }

    fn sample() -> Ellipse {
        Ellipse {
            centre: Point2::new(803.2, 411.7),
            semi_major_px: 61.3,
            semi_minor_px: 33.8,
            angle_rad: 0.7,
        }
    }

    /// Exact points give the exact ellipse, wherever it lies.
    #[test]
    fn exact_points_give_the_exact_ellipse() {
        let e = sample();
        let points: Vec<_> = (0..40)
            .map(|k| point_at(&e, TAU * f64::from(k) / 40.0))
            .collect();
        let f = fit_ellipse(&points).unwrap();
        assert!((f.ellipse.centre - e.centre).norm() < 1e-8);
        assert!((f.ellipse.semi_major_px - e.semi_major_px).abs() < 1e-8);
        assert!((f.ellipse.semi_minor_px - e.semi_minor_px).abs() < 1e-8);
        assert!((f.ellipse.angle_rad - e.angle_rad).abs() < 1e-8);
        assert!(f.rms_px < 1e-8);
    }

    /// One edge point on a reflection must not pull the outline.
    #[test]
    fn one_outlier_is_left_out() {
        let e = sample();
        let mut points: Vec<_> = (0..80)
            .map(|k| point_at(&e, TAU * f64::from(k) / 80.0))
            .collect();
        points[5] += nalgebra::Vector2::new(9.0, -4.0);
        let f = fit_ellipse(&points).unwrap();
        assert!((f.ellipse.centre - e.centre).norm() < 0.02, "{f:?}");
    }

    /// The stated sigma of the centre against the scatter over many noisy outlines, whole and cut.
    #[test]
    fn the_centres_sigma_is_its_scatter() {
        let e = sample();
        let mut noise = crate::stack::led::testing::SplitMix64::new(3);
        for arc in [TAU, 0.6 * TAU] {
            let (mut squares, mut stated) = (0.0, 0.0);
            for _ in 0..300 {
                let points: Vec<_> = (0..60)
                    .map(|k| point_at(&e, arc * f64::from(k) / 60.0))
                    .map(|p| p + nalgebra::Vector2::new(noise.normal(), noise.normal()) * 0.2)
                    .collect();
                let f = fit_ellipse(&points).unwrap();
                squares += (f.ellipse.centre.x - e.centre.x).powi(2) / 300.0;
                stated += f.centre_sigma_px / 300.0;
            }
            let ratio = stated / squares.sqrt();
            assert!((0.6..1.6).contains(&ratio), "{ratio} at {arc}");
        }
    }

    /// No panic and no ellipse from a line, one point, a hyperbola or nothing.
    #[test]
    fn what_is_no_ellipse_gives_none() {
        let line: Vec<_> = (0..30)
            .map(|k| Point2::new(f64::from(k), 2.0 * f64::from(k)))
            .collect();
        let same = vec![Point2::new(3.0, 4.0); 30];
        let hyperbola: Vec<_> = (1..30)
            .flat_map(|k| {
                [1.0, -1.0].map(|s| Point2::new(s * f64::from(k), s * 40.0 / f64::from(k)))
            })
            .collect();
        for points in [&line[..], &same, &hyperbola, &[]] {
            assert!(fit_ellipse(points).is_none());
        }
    }

    #[test]
    fn a_circle_is_round_and_chords_meet_the_outline() {
        let circle = Ellipse {
            semi_minor_px: 61.3,
            ..sample()
        };
        assert!((roundness(&circle) - 1.0).abs() < 1e-12);
        // Two to one: 4 pi (2 pi) / 9.68845^2, perimeter by the elliptic integral.
        let two = Ellipse {
            semi_major_px: 2.0,
            semi_minor_px: 1.0,
            ..sample()
        };
        assert!(
            (roundness(&two) - 4.0 * 2.0 * std::f64::consts::PI.powi(2) / 9.688_448_22f64.powi(2))
                .abs()
                < 1e-4
        );
        let e = sample();
        for k in 0..20 {
            let p = point_at(&e, TAU * (f64::from(k) + 0.3) / 20.0);
            let (left, right) = chord(&e, p.y).unwrap();
            assert!((left - p.x).abs().min((right - p.x).abs()) < 1e-9);
        }
        assert_eq!(chord(&e, e.centre.y + 62.0), None);
    }
}
