//! Distortion of a lens, there and back.

use crate::numerics::bisected;
use nalgebra::{Matrix2, Vector2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// OpenCV's five coefficients, as calibrations publish them. All 0, the default, is a lens without
/// distortion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DistortionCoefficients {
    /// Radial, of r^2 with r in focal lengths. Negative: barrel. Default 0.
    pub k1: f64,
    /// Radial, of r^4. Default 0.
    pub k2: f64,
    /// Radial, of r^6. Default 0.
    pub k3: f64,
    /// Tangential, upwards and downwards. Default 0.
    pub p1: f64,
    /// Tangential, sideways. Default 0.
    pub p2: f64,
}

/// Distortion of a lens after Brown and Conrady (D. C. Brown, "Close-range camera calibration",
/// Photogrammetric Engineering 37(8), 1971) in OpenCV's form: with p = (x, y) at depth 1, r its
/// length and q = (p2, p1), it is seen at
///
/// ```text
/// p' = p (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 (q.p) p + r^2 q
/// ```
///
/// A polynomial turns back somewhere, and would show what lies beyond a second time. So it holds up
/// to [`Self::reach`]; beyond it the picture goes on in proportion to r.
///
/// ```
/// use metrotwin::bus::{Distortion, DistortionCoefficients};
/// let barrel = Distortion::new(DistortionCoefficients { k1: -0.28, k2: 0.07, ..Default::default() });
/// let [x, y] = barrel.distort([0.5, 0.0]);
/// assert!((x - 0.5 * (1.0 - 0.28 * 0.25 + 0.07 * 0.0625)).abs() < 1e-12 && y == 0.0);
/// assert!((barrel.undistort([x, y])[0] - 0.5).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "DistortionCoefficients", into = "DistortionCoefficients")]
pub struct Distortion {
    coefficients: DistortionCoefficients,
    reach: f64,
}

/// Radii beyond this are 84 deg off the axis, outside any picture of this projection.
const MAX_RADIUS: f64 = 10.0;
/// The polynomial is left where it draws the scene, in some direction, at less than this share of
/// the scale in the middle: it is about to turn back.
const LEAST_SCALE: f64 = 0.1;
/// Newton's method doubles the digits with each step: four do inside a picture. From one side of
/// the reach to the other it overshoots, and steps are halved.
const NEWTON_STEPS: usize = 60;
/// A solution is seen this near to where it should be: 1e-10 pixels.
const SOLVED: f64 = 1e-13;

impl Distortion {
    /// Of these coefficients.
    pub fn new(coefficients: DistortionCoefficients) -> Self {
        Self {
            reach: reach(&coefficients),
            coefficients,
        }
    }

    /// What it was made of.
    pub fn coefficients(&self) -> DistortionCoefficients {
        self.coefficients
    }

    /// Whether there is none.
    pub fn is_none(&self) -> bool {
        self.coefficients == DistortionCoefficients::default()
    }

    /// The radius at depth 1 up to which the polynomial holds. Within it the map's derivative is
    /// positive definite (the map is a potential's gradient), so that no two points are seen in
    /// one place.
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// Where a point (x, y) at depth 1 is seen.
    pub fn distort(&self, p: [f64; 2]) -> [f64; 2] {
        if self.is_none() {
            return p;
        }
        self.seen(&p.into()).into()
    }

    /// The point at depth 1 that is seen at (x', y'), by Newton's method.
    pub fn undistort(&self, seen: [f64; 2]) -> [f64; 2] {
        if self.is_none() {
            return seen;
        }
        let aim = Vector2::from(seen);
        let solved = SOLVED * SOLVED * (1.0 + aim.norm_squared());
        let mut p = aim;
        let mut miss = aim - self.seen(&p);
        let mut step = self.step(&p, &miss);
        for _ in 0..NEWTON_STEPS {
            if miss.norm_squared() <= solved {
                break;
            }
            let next = p + step;
            let misses = aim - self.seen(&next);
            if misses.norm_squared() < miss.norm_squared() {
                (p, miss) = (next, misses);
                step = self.step(&p, &miss);
            } else {
                step *= 0.5;
            }
        }
        p.into()
    }

    /// Newton's step from a point that misses by so much.
    fn step(&self, p: &Vector2<f64>, miss: &Vector2<f64>) -> Vector2<f64> {
        self.slope(p)
            .try_inverse()
            .map_or(*miss, |back| back * miss)
    }

    fn seen(&self, p: &Vector2<f64>) -> Vector2<f64> {
        let r2 = p.norm_squared();
        let (scale, share) = (self.radial(r2).0, self.within(r2));
        p * scale + self.tangential(p) * share
    }

    /// Derivative of where a point is seen by where it is.
    fn slope(&self, p: &Vector2<f64>) -> Matrix2<f64> {
        let r2 = p.norm_squared();
        let ((scale, growth), share) = (self.radial(r2), self.within(r2));
        let q = self.q();
        let mut tangential = 2.0 * (p * q.transpose() + q * p.transpose());
        let radial = Matrix2::identity() * (scale + 2.0 * q.dot(p) * share);
        if share < 1.0 {
            tangential -= self.tangential(p) * p.transpose() / r2;
            return radial + tangential * share;
        }
        radial + p * p.transpose() * (2.0 * growth) + tangential
    }

    /// Factor of the radius, and its derivative by r^2 within the reach.
    fn radial(&self, r2: f64) -> (f64, f64) {
        let DistortionCoefficients { k1, k2, k3, .. } = self.coefficients;
        let r2 = r2.min(self.reach * self.reach);
        (
            1.0 + r2 * (k1 + r2 * (k2 + r2 * k3)),
            k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3),
        )
    }

    /// 1 within the reach, reach / r beyond it: what makes the tangential part, which grows by the
    /// square, proportional to r.
    fn within(&self, r2: f64) -> f64 {
        if r2 <= self.reach * self.reach {
            1.0
        } else {
            self.reach / r2.sqrt()
        }
    }

    fn tangential(&self, p: &Vector2<f64>) -> Vector2<f64> {
        let q = self.q();
        p * (2.0 * q.dot(p)) + q * p.norm_squared()
    }

    fn q(&self) -> Vector2<f64> {
        Vector2::new(self.coefficients.p2, self.coefficients.p1)
    }
}

/// First radius at which the scale along r, 1 + 3 k1 r^2 + 5 k2 r^4 + 7 k3 r^6, less what the
/// tangential part can take from it, 6 |q| r, falls to [`LEAST_SCALE`].
fn reach(c: &DistortionCoefficients) -> f64 {
    let least = |r: f64| {
        let r2 = r * r;
        let along = 1.0 + r2 * (3.0 * c.k1 + r2 * (5.0 * c.k2 + r2 * 7.0 * c.k3));
        along - 6.0 * c.p1.hypot(c.p2) * r > LEAST_SCALE
    };
    let steps = 1000;
    let step = MAX_RADIUS / f64::from(steps);
    let radius = |k: i32| step * f64::from(k);
    let Some(beyond) = (1..=steps).find(|k| !least(radius(*k))) else {
        return MAX_RADIUS;
    };
    bisected((radius(beyond - 1), radius(beyond)), 50, least).0
}

impl Default for Distortion {
    fn default() -> Self {
        Self {
            coefficients: DistortionCoefficients::default(),
            reach: MAX_RADIUS,
        }
    }
}

impl From<DistortionCoefficients> for Distortion {
    fn from(coefficients: DistortionCoefficients) -> Self {
        Self::new(coefficients)
    }
}

impl From<Distortion> for DistortionCoefficients {
    fn from(distortion: Distortion) -> Self {
        distortion.coefficients
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::Intrinsics;
    use crate::bus::lenses::{EUROC, KITTI, OPENCV, lens};
    use nalgebra::Point3;

    fn camera(size_px: [u32; 2], f_px: f64, coefficients: DistortionCoefficients) -> Intrinsics {
        Intrinsics {
            distortion: coefficients.into(),
            ..Intrinsics::centred(size_px[0], size_px[1], f_px)
        }
    }

    /// Real wide lenses, their focal length in proportion to the picture's width as published, and
    /// the reference rig's and wayside camera's: from a pixel to the scene and back to the same.
    #[test]
    fn undistort_inverts_distort_all_over_the_picture() {
        for (coefficients, f_share) in [
            (EUROC[0], 458.654 / 752.0),
            (EUROC[1], 457.587 / 752.0),
            (OPENCV, 535.916 / 640.0),
            (KITTI, 984.244 / 1280.0),
        ] {
            for size_px in [[1280, 720], [1920, 1080]] {
                let camera = camera(size_px, f_share * f64::from(size_px[0]), coefficients);
                let mut worst_px: f64 = 0.0;
                for v in (0..size_px[1]).step_by(7).map(f64::from) {
                    for u in (0..size_px[0]).step_by(7).map(f64::from) {
                        let ray = camera.ray(u, v);
                        let reach = camera.distortion.reach();
                        assert!(ray.xy().norm() < reach, "{u} {v}: {ray} of {reach}");
                        let seen = camera.project(&Point3::from(ray * 7.0));
                        let miss_px = seen.map_or(f64::NAN, |p| (p.x - u).hypot(p.y - v));
                        assert!(miss_px < 1e-3, "{coefficients:?} {u} {v}: {miss_px}");
                        worst_px = worst_px.max(miss_px);
                    }
                }
                assert!(worst_px < 1e-9, "{worst_px}");
            }
        }
    }

    /// The same points through OpenCV 5.0.0, in both directions:
    ///
    /// ```python
    /// K = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
    /// q, _ = cv2.projectPoints(np.array([[[x, y, 1.0]]]), np.zeros(3), np.zeros(3), K, d)
    /// cv2.undistortPoints(q, K, d, None, None, None, (3, 200, 1e-14))  # gives (x, y) again
    /// ```
    #[test]
    fn val_opencv_sees_the_same() {
        const POINTS: [[f64; 2]; 4] = [[0.3, -0.2], [-0.7, 0.4], [0.55, 0.35], [-0.1, -0.45]];
        for (coefficients, [fx_px, fy_px, cx_px, cy_px], seen) in [
            (
                EUROC[0],
                [458.654, 457.296, 367.215, 248.375],
                [
                    [499.905_568_539, 160.188_744_690],
                    [95.232_078_697, 403.394_178_057],
                    [592.502_820_009, 391.350_941_288],
                    [323.968_500_747, 54.353_067_443],
                ],
            ),
            (
                KITTI,
                [984.2439, 980.8141, 690.0, 233.1966],
                [
                    [972.089_965_632, 46.192_515_885],
                    [123.394_357_635, 557.761_775_694],
                    [1_164.705_784_884, 534.787_363_111],
                    [599.050_424_218, -175.485_582_243],
                ],
            ),
            (
                OPENCV,
                [
                    535.915_733_961_632,
                    535.915_733_961_632,
                    342.283_154_733_083_73,
                    235.570_829_097_881_73,
                ],
                [
                    [497.308_455_443, 132.331_800_498],
                    [12.870_454_747, 424.371_846_743],
                    [607.220_525_713, 404.614_246_206],
                    [291.746_848_268, 8.504_641_115],
                ],
            ),
        ] {
            let camera = Intrinsics {
                fx_px,
                fy_px,
                cx_px,
                cy_px,
                ..camera([1392, 720], 1.0, coefficients)
            };
            for ([x, y], [u, v]) in POINTS.into_iter().zip(seen) {
                let pixel = camera.project(&Point3::new(x, y, 1.0));
                let miss_px = pixel.map_or(f64::NAN, |p| (p.x - u).hypot(p.y - v));
                assert!(miss_px < 2e-9, "{x} {y}: {miss_px} px");
                let miss = (camera.ray(u, v).xy() - Vector2::new(x, y)).norm();
                assert!(miss < 1e-11, "{u} {v}: {miss}");
            }
        }
    }

    /// A lens that turns back: what lies farther off the axis is seen farther out, all the way to
    /// the side of the camera, and the way back leads to where it came from. No fold, no NaN.
    #[test]
    fn beyond_the_reach_the_picture_goes_on() {
        for coefficients in [
            lens(-0.5, 0.0, 0.0, 0.0, 0.0),
            lens(-0.35, 0.12, 0.01, -0.02, -0.02),
            lens(0.1, 0.0, 0.05, 0.02, -0.3),
            lens(0.0, 0.0, 0.03, 0.0, 0.0),
            KITTI,
            OPENCV,
        ] {
            let bent = Distortion::new(coefficients);
            for angle in (0..24).map(|k| f64::from(k) * std::f64::consts::TAU / 24.0) {
                let (sin, cos) = angle.sin_cos();
                let mut last = 0.0;
                for k in 1..400 {
                    let r = 1e-3 * 1.06_f64.powi(k);
                    let (x, y) = (r * cos, r * sin);
                    let [u, v] = bent.distort([x, y]);
                    let out = u * cos + v * sin;
                    assert!(out > last, "{coefficients:?} at {r}, {angle} rad");
                    last = out;
                    let [bx, by] = bent.undistort([u, v]);
                    let miss = (bx - x).hypot(by - y);
                    assert!(miss < 1e-9 * (1.0 + r), "{coefficients:?} {r}: {miss}");
                }
            }
        }
    }

    /// Where 1 + 3 k1 r^2 = 0.1, and where it is cut at 84 deg.
    #[test]
    fn the_reach_is_where_the_scale_runs_out() {
        let reach = |c| Distortion::new(c).reach();
        assert!((reach(lens(-0.3, 0.0, 0.0, 0.0, 0.0)) - 1.0).abs() < 1e-9);
        assert!((reach(lens(0.0, 0.0, 0.0, 0.15, 0.0)) - 1.0).abs() < 1e-9);
        for endless in [lens(0.3, 0.0, 0.0, 0.0, 0.0), lens(0.0, 0.0, 0.0, 0.0, 0.0)] {
            assert!((reach(endless) - MAX_RADIUS).abs() < 1e-12);
        }
    }

    /// In files the reach is worked out anew, not kept.
    #[test]
    fn a_file_holds_the_coefficients() -> Result<(), toml::de::Error> {
        let bent: Distortion = toml::from_str("k1 = -0.3\np2 = 0.001\n")?;
        assert_eq!(bent, Distortion::new(lens(-0.3, 0.0, 0.0, 0.001, 0.0)));
        assert!(toml::from_str::<Distortion>("reach = 2.0\n").is_err());
        Ok(())
    }
}
