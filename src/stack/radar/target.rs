//! A target that is followed: an extended Kalman filter of place and velocity.
//!
//! State: place (x, y) and velocity over ground (u, v), in the vehicle frame. Between frames it runs on with its
//! velocity, disturbed by an acceleration that is drawn anew for each, while the vehicle moves and turns under it.
//! Measured are, from the radar at m with velocity w over ground, in the direction e = (p - m) / |p - m|: the range |p - m|,
//! the azimuth, and the radial speed e (v - w), of which only the part within the speeds that alias is known.
//!
//! Source: Y. Bar-Shalom, X. R. Li and T. Kirubarajan, Estimation with Applications to Tracking and Navigation (2001),
//! chapters 6 and 10.

use super::detector::Sighting;
use super::own_motion::{Mount, OwnMotion};
use super::settings::RadarTrackingSettings;
use crate::numerics::wrapped;
use nalgebra::{Matrix2, Matrix3, Matrix3x4, Matrix4, Rotation2, Vector2, Vector3, Vector4};
use std::f64::consts::TAU;

/// Nearer than this no direction is told, metres.
const NEAREST_M: f64 = 0.1;

/// What the radar is, and how it moves, at a frame.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Where it is.
    pub mount: Mount,
    /// How it moves.
    pub own: OwnMotion,
    /// From the least to the greatest speed that does not alias, m/s.
    pub span_mps: f64,
    /// How many transmitters it has.
    pub transmitters: usize,
}

impl View {
    /// The radar's speed over ground along and across its boresight, m/s.
    pub fn along_boresight(&self) -> [f64; 2] {
        let turn = Rotation2::new(-self.mount.yaw_rad);
        (turn * self.mount.velocity(&self.own)).into()
    }
}

/// A target.
#[derive(Clone, Debug)]
pub struct Target {
    /// The same from frame to frame.
    pub id: u32,
    /// Place and velocity.
    pub state: Vector4<f64>,
    /// Of them.
    pub covariance: Matrix4<f64>,
    /// Frames since it was first seen, with that one.
    pub frames: u32,
    /// Whether it was detected, the last frame in the lowest bit.
    pub hits: u32,
    /// Frames in a row that it was missed.
    pub missed: u32,
    /// It was detected often enough once.
    pub is_confirmed: bool,
    /// Mean over the frames that it was detected in, square metres.
    pub cross_section_m2: f64,
    detected: f64,
    /// Frames that a wall explained it, less those that none did.
    pub ghost_score: u32,
    /// It is taken for a mirror image.
    pub is_ghost: bool,
}

/// What a target makes of a sighting.
#[derive(Clone, Copy, Debug)]
pub struct Innovation {
    off: Vector3<f64>,
    jacobian: Matrix3x4<f64>,
    inverse: Matrix3<f64>,
    noise: Matrix3<f64>,
    /// Squared Mahalanobis distance.
    pub distance: f64,
    /// Logarithm of the determinant of the covariance of what is measured.
    pub log_volume: f64,
}

impl Target {
    /// From its first sighting. Of the speeds that it may alias from, it has that which is slowest over ground.
    pub fn new(id: u32, seen: &Sighting, view: &View, settings: &RadarTrackingSettings) -> Self {
        let detection = &seen.detection;
        let azimuth = detection.azimuth_rad + view.mount.yaw_rad;
        let along = Vector2::new(azimuth.cos(), azimuth.sin());
        let own_mps = view.mount.velocity(&view.own).dot(&along);
        let folds = (-2..=2).map(|k| (k * view.transmitters as i64 + seen.fold as i64) as f64);
        let speeds = folds.map(|fold| detection.radial_speed_mps + fold * view.span_mps + own_mps);
        let slowest = speeds.min_by(|a, b| a.abs().total_cmp(&b.abs()));
        let place = view.mount.place_m + detection.range_m * along;
        let velocity = slowest.unwrap_or(0.0) * along;
        let [range, azimuth_sigma, speed] = variances(seen, settings);
        let turn = Rotation2::new(azimuth);
        let turned = |radial: f64, across: f64| {
            let axes = Matrix2::from_diagonal(&Vector2::new(radial, across));
            turn.matrix() * axes * turn.matrix().transpose()
        };
        let mut covariance = Matrix4::zeros();
        let across_m2 = azimuth_sigma * detection.range_m.powi(2);
        let block = turned(range, across_m2);
        covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&block);
        let block = turned(speed, settings.start_speed_sigma_mps.powi(2));
        covariance.fixed_view_mut::<2, 2>(2, 2).copy_from(&block);
        Self {
            id,
            state: Vector4::new(place.x, place.y, velocity.x, velocity.y),
            covariance,
            frames: 1,
            hits: 1,
            missed: 0,
            is_confirmed: settings.confirm_hits <= 1,
            cross_section_m2: detection.cross_section_m2,
            detected: 1.0,
            ghost_score: 0,
            is_ghost: false,
        }
    }

    /// Carries it on, as the vehicle moves.
    pub fn predict(&mut self, own: &OwnMotion, settings: &RadarTrackingSettings) {
        let time_s = own.time_s;
        let back = Rotation2::new(-own.turned_rad);
        let chord = Rotation2::new(0.5 * own.turned_rad) * Vector2::new(own.run_m, 0.0);
        let velocity = self.velocity();
        let place = back * (self.place() + velocity * time_s - chord);
        let velocity = back * velocity;
        self.state = Vector4::new(place.x, place.y, velocity.x, velocity.y);
        let mut onwards = Matrix4::zeros();
        let turn = back.matrix();
        onwards.fixed_view_mut::<2, 2>(0, 0).copy_from(turn);
        onwards.fixed_view_mut::<2, 2>(2, 2).copy_from(turn);
        onwards
            .fixed_view_mut::<2, 2>(0, 2)
            .copy_from(&(turn * time_s));
        self.covariance = onwards * self.covariance * onwards.transpose();
        self.disturb(time_s, settings);
        self.frames = self.frames.saturating_add(1);
    }

    fn disturb(&mut self, time_s: f64, settings: &RadarTrackingSettings) {
        let acceleration = settings.acceleration_sigma_mps2.powi(2);
        for axis in 0..2 {
            self.covariance[(axis, axis)] += 0.25 * acceleration * time_s.powi(4);
            self.covariance[(axis + 2, axis + 2)] += acceleration * time_s.powi(2);
            self.covariance[(axis, axis + 2)] += 0.5 * acceleration * time_s.powi(3);
            self.covariance[(axis + 2, axis)] += 0.5 * acceleration * time_s.powi(3);
        }
        let run = Vector2::new(settings.own_speed_sigma_mps * time_s, 0.0);
        let turned = settings.own_yaw_rate_sigma_radps * time_s;
        let across = turned * Vector2::new(-self.state[1], self.state[0]);
        let moved = run * run.transpose() + across * across.transpose();
        let mut block = self.covariance.fixed_view_mut::<2, 2>(0, 0);
        block += moved;
    }

    /// What it makes of a sighting; `None` where that is not to be told.
    pub fn innovation(
        &self,
        seen: &Sighting,
        view: &View,
        settings: &RadarTrackingSettings,
    ) -> Option<Innovation> {
        let (expected, jacobian) = self.measure(view)?;
        let detection = &seen.detection;
        let off = Vector3::new(
            detection.range_m - expected.x,
            wrapped(detection.azimuth_rad - expected.y, TAU),
            wrapped(detection.radial_speed_mps - expected.z, view.span_mps),
        );
        let noise = Matrix3::from_diagonal(&Vector3::from(variances(seen, settings)));
        let covariance = jacobian * self.covariance * jacobian.transpose() + noise;
        let inverse = covariance.try_inverse()?;
        let distance = (off.transpose() * inverse * off).x;
        let log_volume = covariance.determinant().ln();
        (distance.is_finite() && log_volume.is_finite()).then_some(Innovation {
            off,
            jacobian,
            inverse,
            noise,
            distance,
            log_volume,
        })
    }

    /// Takes a sighting in.
    pub fn update(&mut self, seen: &Sighting, innovation: &Innovation) {
        let Innovation {
            off,
            jacobian,
            inverse,
            noise,
            ..
        } = innovation;
        let gain = self.covariance * jacobian.transpose() * inverse;
        self.state += gain * off;
        let left = Matrix4::identity() - gain * jacobian;
        // Joseph's form, which keeps it symmetric and positive.
        self.covariance =
            left * self.covariance * left.transpose() + gain * noise * gain.transpose();
        self.detected += 1.0;
        let more = seen.detection.cross_section_m2 - self.cross_section_m2;
        self.cross_section_m2 += more / self.detected;
    }

    /// Range, azimuth in the radar frame and radial speed, and how they change with the state.
    pub fn measure(&self, view: &View) -> Option<(Vector3<f64>, Matrix3x4<f64>)> {
        let away = self.place() - view.mount.place_m;
        let range_m = away.norm();
        if range_m.is_nan() || range_m <= NEAREST_M {
            return None;
        }
        let along = away / range_m;
        let relative = self.velocity() - view.mount.velocity(&view.own);
        let radial_mps = relative.dot(&along);
        let turns = (relative - radial_mps * along) / range_m;
        let azimuth = away.y.atan2(away.x) - view.mount.yaw_rad;
        #[rustfmt::skip]
        let jacobian = Matrix3x4::new(
            along.x, along.y, 0.0, 0.0,
            -along.y / range_m, along.x / range_m, 0.0, 0.0,
            turns.x, turns.y, along.x, along.y,
        );
        Some((Vector3::new(range_m, azimuth, radial_mps), jacobian))
    }

    /// Forward and left, metres.
    pub fn place(&self) -> Vector2<f64> {
        self.state.fixed_rows::<2>(0).into()
    }

    /// Over ground, m/s.
    pub fn velocity(&self) -> Vector2<f64> {
        self.state.fixed_rows::<2>(2).into()
    }
}

/// Of range, azimuth and radial speed: by noise, by where on the body it reflects, and by what the train's speed is off.
fn variances(seen: &Sighting, settings: &RadarTrackingSettings) -> [f64; 3] {
    let [range, azimuth, speed] = seen.sigmas;
    let across = settings.body_sigma_m / seen.detection.range_m.max(NEAREST_M);
    let own = settings.own_speed_sigma_mps.powi(2);
    [
        range * range + settings.body_sigma_m.powi(2),
        azimuth * azimuth + across * across,
        speed * speed + settings.body_speed_sigma_mps.powi(2) + own,
    ]
}
