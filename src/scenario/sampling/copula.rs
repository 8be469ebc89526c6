//! Variables that go together: a Gaussian copula.
//!
//! Independent normal scores z are turned into L z, where L L^T is the matrix of correlations, and
//! each is brought back to the unit interval by the normal distribution. Correlations are those of the
//! scores; ranks have (6/pi) asin(r/2) (Spearman).

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, Normal};

/// Lower triangle L of a matrix of correlations of `n` variables; `None` where it is none.
pub fn lower(matrix: &[Vec<f64>], n: usize) -> Option<DMatrix<f64>> {
    if n < 2 || matrix.len() != n || matrix.iter().any(|row| row.len() != n) {
        return None;
    }
    let m = DMatrix::from_fn(n, n, |i, j| matrix[i][j]);
    let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
    let symmetric = (0..n).all(|i| (0..i).all(|j| close(m[(i, j)], m[(j, i)])));
    let unit = (0..n).all(|i| close(m[(i, i)], 1.0));
    if !(symmetric && unit) {
        return None;
    }
    m.cholesky().map(|c| c.l())
}

/// Correlates points of the unit interval, each uniform, in place.
pub fn correlate(lower: &DMatrix<f64>, points: &mut [f64]) {
    let curve = Normal::standard();
    let scores = DVector::from_iterator(points.len(), points.iter().map(|u| curve.inverse_cdf(*u)));
    for (u, score) in points.iter_mut().zip((lower * scores).iter()) {
        // Ends of the interval have no quantile.
        *u = curve
            .cdf(*score)
            .clamp(f64::MIN_POSITIVE, 1.0 - f64::EPSILON / 2.0);
    }
}
