//! The unit as a whole: what it feels, where, and how it sits.

use super::*;
use crate::bus::SimTime;
use nalgebra::{Isometry3, Translation3};

/// A unit without errors: the truth at its place.
fn ideal() -> ImuSettings {
    ImuSettings {
        position_error_m: 0.0,
        attitude_error_deg: 0.0,
        gyro_turn_on_deg_s: 0.0,
        gyro_null_s: 0.0,
        gyro_bias_deg_h: 0.0,
        angle_random_walk_deg_sqrt_h: 0.0,
        gyro_scale_share: 0.0,
        gyro_skew_deg: 0.0,
        gyro_per_g_deg_s: 0.0,
        accel_turn_on_mg: 0.0,
        accel_bias_mg: 0.0,
        velocity_random_walk_mps_sqrt_h: 0.0,
        accel_scale_share: 0.0,
        accel_skew_deg: 0.0,
        quantise: false,
        ..ImuSettings::default()
    }
}

/// A body that turns about the world's z with rate w + a t, its origin on a straight way.
fn spinning(t: f64, w: f64, a: f64) -> VehicleMotion {
    let turned = UnitQuaternion::from_scaled_axis(Vector3::z() * (w * t + 0.5 * a * t * t));
    VehicleMotion {
        time: SimTime::from_secs(t),
        world_from_vehicle: Isometry3::from_parts(Translation3::new(5.0 * t, 0.0, 0.0), turned),
        velocity_mps: Vector3::new(5.0, 0.0, 0.0),
        angular_rad_s: Vector3::z() * (w + a * t),
    }
}

/// Off the origin of a body that spins up, the unit feels r w² inwards and r a sideways; at the
/// origin it feels its weight alone.
#[test]
fn the_lever_arm_is_felt() {
    let (w, a, r) = (0.8, 0.5, 2.0);
    for (arm, wanted) in [(0.0, [0.0, 0.0]), (r, [-r * w * w, r * a])] {
        let settings = ImuSettings {
            position_m: [arm, 0.0, 1.0],
            ..ideal()
        };
        let mut imu = Imu::new(&settings, 1, 0);
        let sample = imu
            .between(
                TrainEnd::Front,
                &spinning(-0.0005, w, a),
                &spinning(0.0005, w, a),
            )
            .unwrap();
        let wanted = Vector3::new(wanted[0], wanted[1], G_MPS2);
        assert!((sample.accel_m_s2 - wanted).norm() < 1e-5, "{wanted}");
        assert!((sample.gyro_rad_s - Vector3::z() * w).norm() < 1e-6);
    }
}

/// A unit that leans feels a part of the weight sideways, and of a turn too; the lean is of the
/// size given.
#[test]
fn a_tilted_mount_feels_the_weight_sideways() {
    let settings = ImuSettings {
        attitude_error_deg: 0.5,
        ..ideal()
    };
    let units = 1000;
    let mut square = 0.0;
    for index in 0..units {
        let mut imu = Imu::new(&settings, 2, index);
        let weight = Vector3::z() * G_MPS2;
        let (gyro, accel) = imu.measure(&Vector3::z(), &weight, 0.005);
        assert!((accel.norm() - G_MPS2).abs() < 1e-9);
        assert!((gyro * G_MPS2 - accel).norm() < 1e-9);
        square += (accel.xy() / G_MPS2).norm_squared() / 2.0;
    }
    let sigma_deg = (square / f64::from(units as u32)).sqrt().to_degrees();
    assert!((sigma_deg / 0.5 - 1.0).abs() < 0.05, "{sigma_deg} deg");
}

/// The null takes turn-on bias and what the weight makes out, down to the mean's own noise; without
/// it they stay. Scale errors are no bias and stay as well.
#[test]
fn the_null_takes_the_bias_out() {
    let weight = Vector3::z() * G_MPS2;
    let rest_deg_h = |null_s: f64| {
        let settings = ImuSettings {
            gyro_null_s: null_s,
            ..ImuSettings::default()
        };
        let units = 40;
        let mut square = 0.0;
        for index in 0..units {
            let mut imu = Imu::new(&settings, 3, index);
            let mut sum = Vector3::zeros();
            for _ in 0..2000 {
                sum += imu.measure(&Vector3::zeros(), &weight, 0.005).0;
            }
            square += (sum / 2000.0).norm_squared() / 3.0;
        }
        (square / units as f64).sqrt().to_degrees() * 3600.0
    };
    let (with, without) = (rest_deg_h(30.0), rest_deg_h(0.0));
    // White noise of 0.3 deg/sqrt(h) over 10 s and 30 s makes 6.6 deg/h, the drift 8 more.
    assert!((5.0..15.0).contains(&with), "{with} deg/h");
    assert!((500.0..900.0).contains(&without), "{without} deg/h");
}

/// A turn under acceleration: 1 g along the track shifts the gyros by the sensitivity given.
#[test]
fn acceleration_shifts_the_gyros() {
    let settings = ImuSettings {
        gyro_per_g_deg_s: 0.009,
        ..ideal()
    };
    let units = 1000;
    let mut square = 0.0;
    for index in 0..units {
        let mut imu = Imu::new(&settings, 4, index);
        let push = Vector3::x() * G_MPS2;
        let (gyro, _) = imu.measure(&Vector3::zeros(), &push, 0.005);
        square += gyro.norm_squared() / 3.0;
    }
    let deg_s = (square / f64::from(units as u32)).sqrt().to_degrees();
    assert!((deg_s / 0.009 - 1.0).abs() < 0.05, "{deg_s} deg/s");
}

/// The parts' ranges are in the right units: a spin and a shock saturate at the data sheet's.
#[test]
fn ranges_are_those_of_the_part() {
    let mut imu = Imu::new(&ImuSettings::default(), 1, 0);
    let (gyro, accel) = imu.measure(&Vector3::repeat(100.0), &Vector3::repeat(-1e4), 0.005);
    assert!((gyro.max().to_degrees() - 450.0).abs() < 1e-3);
    assert!((accel.min() / G_MPS2 + 18.0).abs() < 1e-6);
}
