//! Distance from the train head E to an obstacle B, seen from the device A past balise C.
//!
//! The formulas of the paper, kept as baseline, and the exact distance along the alignment. In a
//! curve the formula projects the way from the device's foot F to the obstacle on the tangent at
//! F: for an obstacle an arc `a` away from F and `y` inside the centreline it takes
//! (R1 - y) sin(a / R1) for `a`, and so finds it too far from the train by
//! a - (R1 - y) sin(a / R1), about a^3 / 6 R1^2 + y a / R1. That is on the unsafe side.
//!
//! ```text
//!   C--------n------->E             B           F          up the line ->
//!   |<------------------ m ---------------------|
//!                                   |<--- D --->|
//!                                                A
//! ```

use crate::bus::{DetectedObstacle, TrainReport, WaysideCalibration};
use crate::track::{Direction, Track};
use nalgebra::Vector2;

/// Curves flatter than this count as straight, 1/m (a radius of 20 km).
const STRAIGHT_PER_M: f64 = 5e-5;

/// S = m - n - |R cos alpha|, for an obstacle between balise and device.
///
/// `m_m` is the distance from balise to device, `n_m` what the train head has run past the
/// balise, `range_m` and `angle_rad` are R and alpha.
///
/// ```
/// use metrotwin::stack::wayside::distance::straight_m;
/// let alpha = 170f64.to_radians();
/// assert!((straight_m(300.0, 100.0, 50.0, alpha) - 150.76).abs() < 0.01);
/// ```
pub fn straight_m(m_m: f64, n_m: f64, range_m: f64, angle_rad: f64) -> f64 {
    m_m - n_m - (range_m * angle_rad.cos()).abs()
}

/// S = (2/k) asin(k L / 2) - n - |R sin(alpha - eta)| with k = 1/R1.
///
/// `radius_m` is R1, `chord_m` L from F to C, `eta_rad` the angle of AF to the running
/// direction. `None` where the chord is longer than the circle is wide.
pub fn curve_m(
    radius_m: f64,
    chord_m: f64,
    n_m: f64,
    range_m: f64,
    angle_rad: f64,
    eta_rad: f64,
) -> Option<f64> {
    let k = 1.0 / radius_m;
    let sine = k * chord_m / 2.0;
    (sine.abs() <= 1.0)
        .then(|| 2.0 / k * sine.asin() - n_m - (range_m * (angle_rad - eta_rad).sin()).abs())
}

/// Distance of the train head to the obstacle's nearer end: by the paper's formula, and exact
/// along the alignment. The formula is for trains that run up the line; of others both are exact.
///
/// The paper's device looks towards the train, so that the obstacle's farthest point is the
/// nearest to the train. For an obstacle beyond the device it is the other way round, and the
/// projection is added.
pub fn train_distance_m(
    map: &Track,
    calibration: &WaysideCalibration,
    train: &TrainReport,
    obstacle: &DetectedObstacle,
) -> (f64, f64) {
    let ahead_m = |s_m| train.direction.ahead_m(train.chainage_m, s_m);
    let exact = ahead_m(obstacle.from_chainage_m).min(ahead_m(obstacle.to_chainage_m));
    if train.direction == Direction::Down {
        // The paper's trains run up the line.
        return (exact, exact);
    }
    let m = calibration.chainage_m - calibration.balise_chainage_m;
    let n = train.chainage_m - calibration.balise_chainage_m;
    let (range, angle) = if obstacle.far_angle_rad.cos() < 0.0 {
        (obstacle.far_range_m, obstacle.far_angle_rad)
    } else {
        (obstacle.near_range_m, obstacle.near_angle_rad)
    };
    let foot = map.alignment.at(calibration.chainage_m);
    let curvature = foot.curvature_per_m.abs();
    // Angles are taken to the running direction at F, to which AF is at a right angle.
    let eta = std::f64::consts::FRAC_PI_2;
    let formula = if curvature < STRAIGHT_PER_M {
        Some(straight_m(m, n, range, angle))
    } else {
        let balise = map.alignment.at(calibration.balise_chainage_m);
        let chord = Vector2::new(
            foot.origin.x - balise.origin.x,
            foot.origin.y - balise.origin.y,
        )
        .norm();
        let chord = chord.copysign(m);
        curve_m(1.0 / curvature, chord, n, range, angle, eta)
    };
    let formula = formula.unwrap_or_else(|| straight_m(m, n, range, angle));
    // The formulas subtract the projection; an obstacle beyond the device wants it added.
    let beyond = (range * angle.cos()).max(0.0);
    (formula + 2.0 * beyond, exact)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By how much [`curve_m`] exceeds the exact distance: `arc_m` from F to the obstacle,
    /// `inside_m` its offset from the centreline towards the curve's centre.
    fn tangent_error_m(radius_m: f64, arc_m: f64, inside_m: f64) -> f64 {
        arc_m - (radius_m - inside_m) * (arc_m / radius_m).sin()
    }

    /// Coordinates worked out by hand on a circle: balise, device and obstacle placed by their
    /// arcs. A wrong term in the formula (asin, eta, sign) misses by metres.
    #[test]
    fn curve_formula_meets_the_geometry() {
        for radius in [300.0f64, 600.0, 2000.0] {
            for arc in [10.0f64, 30.0, 60.0] {
                for inside in [-2.0f64, 0.0, 1.0] {
                    // F at the origin, running direction +x, centre at (0, R1); the device 2 m
                    // outside, the obstacle `arc` before F.
                    let (device_y, m, n) = (-2.0, 250.0, 90.0);
                    let turn = arc / radius;
                    let (x, y) = (
                        -(radius - inside) * turn.sin(),
                        radius - (radius - inside) * turn.cos(),
                    );
                    let range = x.hypot(y - device_y);
                    let alpha = (y - device_y).atan2(x);
                    let chord = 2.0 * radius * (m / radius / 2.0).sin();
                    let eta = std::f64::consts::FRAC_PI_2;
                    let s = curve_m(radius, chord, n, range, alpha, eta).unwrap_or(f64::NAN);
                    let exact = m - n - arc;
                    let excess = tangent_error_m(radius, arc, inside);
                    assert!((s - exact - excess).abs() < 1e-9, "R1 {radius} a {arc}");
                    let series = arc.powi(3) / (6.0 * radius * radius) + inside * arc / radius;
                    assert!((excess - series).abs() < 0.01 * arc * turn * turn);
                }
            }
        }
    }

    /// The whole way, on maps: an obstacle put on the line by the alignment, its range and angle
    /// taken in world coordinates. On the straight both answers agree; in the curve they differ
    /// by the tangent error, device before and behind the obstacle alike.
    #[test]
    fn both_distances_on_a_map() {
        use crate::bus::{Blob, DangerLevel, PixelBox, SimTime};
        use crate::stack::wayside::test_scene::{calibration, track};
        use crate::track::TrackPoint;
        for (curvature, s) in [
            (0.0, 160.0),
            (0.0, 230.0),
            (1.0 / 300.0, 160.0),
            (-1.0 / 300.0, 230.0),
        ] {
            let map = track(curvature);
            let calibration = calibration(&map, 64, 36);
            let position = map.alignment.world_from_track(TrackPoint {
                s_m: s,
                l_m: 0.0,
                h_m: 0.0,
            });
            let foot = map.alignment.at(calibration.chainage_m);
            let (sin, cos) = foot.heading_rad.sin_cos();
            let to = position - calibration.world_from_camera.translation.vector;
            let range = to.x.hypot(to.y);
            let angle = (to.y * cos - to.x * sin).atan2(to.x * cos + to.y * sin);
            let bounds = PixelBox {
                u0: 0,
                v0: 0,
                u1: 1,
                v1: 1,
            };
            let obstacle = DetectedObstacle {
                blob: Blob { bounds, area_px: 4 },
                position,
                near_range_m: range,
                near_angle_rad: angle,
                far_range_m: range,
                far_angle_rad: angle,
                from_chainage_m: s,
                to_chainage_m: s,
                lateral_m: 0.0,
                width_m: 0.0,
                height_m: 0.0,
                danger: DangerLevel::High,
            };
            let train = TrainReport {
                chainage_m: 90.0,
                direction: Direction::Up,
                speed_mps: 0.0,
                time: SimTime::ZERO,
                ..TrainReport::default()
            };
            let (paper, exact) = train_distance_m(&map, &calibration, &train, &obstacle);
            assert!((exact - (s - 90.0)).abs() < 1e-9);
            let error = if curvature.abs() > 0.0 {
                let arc = calibration.chainage_m - s;
                tangent_error_m(300.0, arc, 0.0)
            } else {
                0.0
            };
            assert!(
                (paper - exact - error).abs() < 1e-6,
                "{paper} {exact} {error}"
            );
        }
    }

    /// The limit of a flat curve is the straight formula.
    #[test]
    fn flat_curve_is_straight() {
        let eta = std::f64::consts::FRAC_PI_2;
        let curve = curve_m(1e7, 250.0, 90.0, 45.0, 2.9, eta).unwrap_or(f64::NAN);
        assert!((curve - straight_m(250.0, 90.0, 45.0, 2.9)).abs() < 1e-6);
    }

    /// A chord that does not fit the circle must not give NaN.
    #[test]
    fn impossible_chord_is_refused() {
        assert_eq!(curve_m(100.0, 201.0, 0.0, 10.0, 3.0, 1.5), None);
    }
}
