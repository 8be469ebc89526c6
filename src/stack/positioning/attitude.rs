//! Attitude of the leading car, from the map and the gyro.
//!
//! The map gives the attitude that the leading car's body has in the track: its
//! length axis is the chord between the bogie pivots (in a curve of 300 m the tangent at the head
//! is 2 deg off that chord), its roll the cant between them. The body deviates from this by what its
//! suspension does. The deviation D, world_from_vehicle = M D with M the map's attitude, is
//! integrated from the gyro, D' = M(s')^-1 M(s) D exp(w dt), and fades with a time constant, so
//! that a gyro bias b leaves an error of b times that constant (6 deg/h and 10 s: 0.02 deg) and no
//! more. Swings slower than the constant are lost with the bias; suspended cars swing at 0.8 Hz
//! and above. D keeps unit quaternions, so large swings (the paper's -5 to +7.5 deg) are exact.

use crate::bus::{ImuSample, SimTime};
use crate::stack::history::History;
use crate::stack::led::LedSettings;
use crate::track::{Alignment, TrackPoint};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// Attitude of the leading car's body.
#[derive(Debug)]
pub struct CarAttitude {
    fade_s: f64,
    pivots_m: (f64, f64),
    deviation: History<UnitQuaternion<f64>>,
    /// Map attitude at the last inertial sample, where a position was known.
    map_attitude: Option<UnitQuaternion<f64>>,
}

impl CarAttitude {
    /// Nothing known yet.
    pub fn new(settings: &LedSettings) -> Self {
        Self {
            fade_s: settings.imu_fade_s.max(1e-3),
            pivots_m: (settings.front_pivot_m, settings.rear_pivot_m),
            deviation: History::default(),
            map_attitude: None,
        }
    }

    /// Takes an inertial sample; `chainage_m` is where the train takes itself to be.
    pub fn on_imu(&mut self, sample: &ImuSample, line: &Alignment, chainage_m: Option<f64>) {
        let turn = sample.gyro_rad_s;
        if !turn.iter().all(|w| w.is_finite()) {
            return;
        }
        let map_attitude = chainage_m.map(|s| self.map_attitude(line, s));
        let Some((last, deviation)) = self.deviation.latest() else {
            self.deviation.push(sample.time, UnitQuaternion::identity());
            self.map_attitude = map_attitude;
            return;
        };
        let dt = sample.time.since(last);
        if dt <= 0.0 {
            return;
        }
        // Without a position the track is taken as straight: the fading forgets the error.
        let track_turn = match (self.map_attitude, map_attitude) {
            (Some(before), Some(now)) => now.inverse() * before,
            _ => UnitQuaternion::identity(),
        };
        let integrated = track_turn * deviation * UnitQuaternion::from_scaled_axis(turn * dt);
        let kept = (1.0 - dt / self.fade_s).clamp(0.0, 1.0);
        let faded = UnitQuaternion::from_scaled_axis(integrated.scaled_axis() * kept);
        self.deviation.push(sample.time, faded);
        self.map_attitude = map_attitude;
    }

    /// Whether a time is longer ago than samples are kept.
    pub fn has_forgotten(&self, time: SimTime) -> bool {
        self.deviation.has_forgotten(time)
    }

    /// Attitude `world_from_vehicle` at a time with the train head at a chainage.
    pub fn at(&self, time: SimTime, line: &Alignment, chainage_m: f64) -> UnitQuaternion<f64> {
        let map = self.map_attitude(line, chainage_m);
        match self.deviation.around(time) {
            Some((a, b, share)) => map * a.nlerp(&b, share),
            None => map,
        }
    }

    /// Attitude of the leading car's body in the track.
    fn map_attitude(&self, line: &Alignment, chainage_m: f64) -> UnitQuaternion<f64> {
        let (front, rear) = (chainage_m - self.pivots_m.0, chainage_m - self.pivots_m.1);
        let at = |s_m: f64| {
            line.world_from_track(TrackPoint {
                s_m,
                l_m: 0.0,
                h_m: 0.0,
            })
        };
        let roll = 0.5 * (line.at(front).roll_rad + line.at(rear).roll_rad);
        let chord = at(front) - at(rear);
        let Some(x) = chord.try_normalize(1e-9) else {
            return UnitQuaternion::identity();
        };
        let Some(y) = Vector3::z().cross(&x).try_normalize(1e-9) else {
            return UnitQuaternion::identity();
        };
        let axes = Matrix3::from_columns(&[x, y, x.cross(&y)]);
        let level = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        level * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), roll)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::bus::TrainEnd;
    use crate::track::PlanElement;
    use nalgebra::Point3;

    fn curve(radius_m: f64) -> Alignment {
        let bend = PlanElement {
            length_m: 500.0,
            start_per_m: 1.0 / radius_m,
            end_per_m: 1.0 / radius_m,
            start_cant_m: 0.0,
            end_cant_m: 0.0,
        };
        Alignment::new(Point3::origin(), 0.0, &[bend], &[])
    }

    fn turning(rate: f64, k: i64) -> ImuSample {
        ImuSample {
            time: SimTime::from_nanos(k * 1_000_000),
            end: TrainEnd::Front,
            gyro_rad_s: Vector3::new(0.0, 0.0, rate),
            accel_m_s2: Vector3::new(0.0, 0.0, 9.81),
        }
    }

    /// The chord's heading is the tangent's half way between the pivots.
    #[test]
    fn the_body_lies_along_the_chord() {
        let car = CarAttitude::new(&LedSettings::default());
        let attitude = car.at(SimTime::ZERO, &curve(300.0), 200.0);
        let (_, _, yaw) = attitude.euler_angles();
        assert!((yaw - (200.0 - 9.8) / 300.0).abs() < 1e-9, "{yaw}");
    }

    /// Running through a curve turns the gyro but not the car against the track; a bias stays
    /// bounded; a swing of the car is followed.
    #[test]
    fn the_gyro_adds_the_deviation_only() {
        let (line, speed) = (curve(300.0), 15.0);
        let mut car = CarAttitude::new(&LedSettings::default());
        let bias = 3e-5;
        for k in 0..20_000 {
            let s = 20.0 + speed * f64::from(k) * 1e-3;
            car.on_imu(&turning(speed / 300.0 + bias, k.into()), &line, Some(s));
        }
        let s = 20.0 + speed * 20.0;
        let off = |r: &CarAttitude, ms: i64, s: f64| {
            let swung = r.at(SimTime::from_nanos(ms * 1_000_000), &line, s);
            (r.map_attitude(&line, s).inverse() * swung).scaled_axis().z
        };
        let left = off(&car, 20_000, s);
        assert!(
            left > 0.5 * bias * 10.0 && left < 1.01 * bias * 10.0,
            "{left}"
        );
        // Half a period of 1 Hz: the car has turned by 0.1 rad.
        for k in 0..500 {
            let rate = 0.1
                * std::f64::consts::PI
                * 0.5
                * (std::f64::consts::PI * f64::from(k) / 500.0).sin()
                * 2.0;
            car.on_imu(&turning(rate, 20_000 + i64::from(k)), &line, None);
        }
        assert!((off(&car, 20_499, s) - left - 0.1).abs() < 0.005);
    }
}
