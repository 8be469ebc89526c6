//! The place of a track that a satellite fix stands for.
//!
//! A fix z has a covariance P. In the direction of a unit vector u its standard deviation is that of the pedal curve
//! of its error ellipse, sqrt(u' P u). The curve is scaled until it touches the track: where it does is the match.
//! So of all places x of the track it is the one with the least r / sigma for r = |x - z| and sigma that in the
//! direction of x - z. For a straight at distance q, with t = q x along it from the foot of the perpendicular, and
//! P in axes across (n) and along (t) the straight,
//!
//! P_tt x^3 + 3 P_nt x^2 + (2 P_nn - P_tt) x - P_nt = 0.
//!
//! Source: Guo et al., J. of Transportation Systems Engineering and IT 20 (1), 2020. The perpendicular match, after
//! Gerlach and Hoppe 2009, takes the foot of the perpendicular whatever the covariance.

use crate::track::plan::TrackElement;
use nalgebra::{Matrix2, Point2, Vector2};

/// Places nearer to a fix are it.
const HERE_M: f64 = 1e-9;

/// A way to match a fix with a covariance to a stretch of an element.
pub type Matching = fn(&TrackElement, [f64; 2], &Point2<f64>, &Matrix2<f64>) -> Option<Match>;

/// A place of an element for a fix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Along the element, metres.
    pub along_m: f64,
    /// From the fix, metres.
    pub away_m: f64,
    /// Standard deviation of the fix in that direction, metres.
    pub sigma_m: f64,
}

impl Match {
    fn of(fix: &Point2<f64>, covariance: &Matrix2<f64>, place: &Point2<f64>, along_m: f64) -> Self {
        let to = place - fix;
        let away_m = to.norm();
        let sigma_m = match away_m < HERE_M {
            // No direction: that of the least deviation counts most.
            true => covariance.symmetric_eigenvalues().min().max(0.0).sqrt(),
            false => (to.dot(&(covariance * to))).max(0.0).sqrt() / away_m,
        };
        Self {
            along_m,
            away_m,
            sigma_m: sigma_m.max(f64::MIN_POSITIVE),
        }
    }

    /// How many standard deviations away it is.
    pub fn deviations(&self) -> f64 {
        self.away_m / self.sigma_m
    }
}

/// Where the scaled pedal curve of a fix touches a stretch of an element.
pub fn by_pedal_curve(
    element: &TrackElement,
    stretch_m: [f64; 2],
    fix: &Point2<f64>,
    covariance: &Matrix2<f64>,
) -> Option<Match> {
    let touching = element
        .straights(stretch_m)
        .flat_map(|(begin, from_m, forward, length_m)| {
            let (foot_m, q_m) = foot(&begin, &forward, fix);
            let across = Vector2::new(-forward.y, forward.x);
            let [nn, nt, tt] = [
                across.dot(&(covariance * across)),
                across.dot(&(covariance * forward)),
                forward.dot(&(covariance * forward)),
            ];
            let [low_m, high_m] = [stretch_m[0] - from_m, stretch_m[1] - from_m];
            let [low_m, high_m] = [low_m.clamp(0.0, length_m), high_m.clamp(0.0, length_m)];
            let touches = cubic_roots([tt, 3.0 * nt, 2.0 * nn - tt, -nt])
                .into_iter()
                .flatten();
            // The ends count too: within the straight there may be no touching point.
            touches
                .map(move |x| foot_m + q_m * x)
                .chain([low_m, high_m])
                .map(move |m| m.clamp(low_m, high_m))
                .map(move |m| Match::of(fix, covariance, &(begin + forward * m), from_m + m))
        });
    touching.min_by(|a, b| a.deviations().total_cmp(&b.deviations()))
}

/// The nearest place of a stretch of an element, with the standard deviation of a fix that is the same in all
/// directions.
pub fn by_perpendicular(
    element: &TrackElement,
    stretch_m: [f64; 2],
    fix: &Point2<f64>,
    covariance: &Matrix2<f64>,
) -> Option<Match> {
    let even = Matrix2::identity() * (0.5 * covariance.trace());
    let feet = element
        .straights(stretch_m)
        .map(|(begin, from_m, forward, length_m)| {
            let [low_m, high_m] = [stretch_m[0] - from_m, stretch_m[1] - from_m];
            let [low_m, high_m] = [low_m.clamp(0.0, length_m), high_m.clamp(0.0, length_m)];
            let m = foot(&begin, &forward, fix).0.clamp(low_m, high_m);
            Match::of(fix, &even, &(begin + forward * m), from_m + m)
        });
    feet.min_by(|a, b| a.away_m.total_cmp(&b.away_m))
}

/// How far along a straight the foot of the perpendicular is, and how far to the right of the straight the fix.
fn foot(begin: &Point2<f64>, forward: &Vector2<f64>, fix: &Point2<f64>) -> (f64, f64) {
    let to = fix - begin;
    // Across, n points from the fix to the straight if q is positive.
    (to.dot(forward), forward.y * to.x - forward.x * to.y)
}

/// Real roots of a x^3 + b x^2 + c x + d.
fn cubic_roots([a, b, c, d]: [f64; 4]) -> [Option<f64>; 3] {
    if a.abs() < 1e-300 {
        return [(c.abs() > 0.0).then(|| -d / c), None, None];
    }
    let [b, c, d] = [b / a, c / a, d / a];
    let shift = b / 3.0;
    let p = c - b * b / 3.0;
    let q = 2.0 * b.powi(3) / 27.0 - b * c / 3.0 + d;
    let discriminant = 0.25 * q * q + p.powi(3) / 27.0;
    if discriminant > 0.0 {
        let root = discriminant.sqrt();
        // The larger of both without cancellation, the other from their product.
        let u = (-0.5 * q - root.copysign(q)).cbrt();
        let v = if u == 0.0 { 0.0 } else { -p / (3.0 * u) };
        return [Some(u + v - shift), None, None];
    }
    let radius = 2.0 * (-p / 3.0).max(0.0).sqrt();
    let cosine = match radius > 0.0 {
        true => (3.0 * q / (p * radius)).clamp(-1.0, 1.0),
        false => 0.0,
    };
    let angle = cosine.acos() / 3.0;
    [0.0, 1.0, 2.0].map(|k| Some(radius * (angle - k * std::f64::consts::TAU / 3.0).cos() - shift))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    /// Numbers between -1 and 1 that look random.
    fn numbers(seed: u64) -> impl Iterator<Item = f64> {
        let mut state = seed;
        std::iter::repeat_with(move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        })
    }

    /// Against the definition: no place of the track, of many, is fewer deviations away.
    #[test]
    fn the_pedal_curve_touches_where_the_deviations_are_least() {
        let mut number = numbers(1);
        let mut next = || number.next().unwrap();
        for _ in 0..300 {
            let points = (0..4).map(|k| Point2::new(30.0 * f64::from(k), 20.0 * next()));
            let element = TrackElement::new("e", points.collect()).unwrap();
            let fix = Point2::new(45.0 + 30.0 * next(), 15.0 * next());
            let root = Matrix2::new(next(), next(), next(), next()) * 4.0;
            let covariance = root * root.transpose() + Matrix2::identity() * 0.01;
            let all = [0.0, element.length_m()];
            let found = by_pedal_curve(&element, all, &fix, &covariance).unwrap();
            let least = (0..=40_000)
                .map(|k| {
                    let along_m = element.length_m() * f64::from(k) / 40_000.0;
                    Match::of(&fix, &covariance, &element.at(along_m).0, along_m).deviations()
                })
                .fold(f64::INFINITY, f64::min);
            let deviations = found.deviations();
            assert!(deviations <= least + 1e-9, "{deviations} {least}");
            assert!(
                deviations > least - 1e-2 * least.max(0.1),
                "{deviations} {least}"
            );
            let there = element.at(found.along_m).0;
            assert!(((there - fix).norm() - found.away_m).abs() < 1e-9);
        }
    }

    /// A circle's pedal curve is the circle: both matches are the foot of the perpendicular.
    #[test]
    fn of_an_even_error_both_matches_are_one() {
        let points = [[0.0, 0.0], [50.0, 10.0], [100.0, 10.0]].map(Point2::from);
        let element = TrackElement::new("e", points.into()).unwrap();
        let (fix, covariance) = (Point2::new(70.0, 14.0), Matrix2::identity() * 2.25);
        let all = [0.0, element.length_m()];
        let [a, b] = [by_pedal_curve, by_perpendicular]
            .map(|by| by(&element, all, &fix, &covariance).unwrap());
        assert!((a.along_m - b.along_m).abs() < 1e-9 && (a.away_m - 4.0).abs() < 1e-9);
        assert!((a.sigma_m - 1.5).abs() < 1e-12 && (b.sigma_m - 1.5).abs() < 1e-12);
    }

    /// Within a stretch only.
    #[test]
    fn matches_stay_in_their_stretch() {
        let points = [[0.0, 0.0], [50.0, 0.0], [100.0, 0.0]].map(Point2::from);
        let element = TrackElement::new("e", points.into()).unwrap();
        for by in [by_pedal_curve, by_perpendicular] {
            let found = by(
                &element,
                [60.0, 80.0],
                &Point2::new(20.0, 3.0),
                &Matrix2::identity(),
            );
            assert!((found.unwrap().along_m - 60.0).abs() < 1e-9);
        }
    }
}
