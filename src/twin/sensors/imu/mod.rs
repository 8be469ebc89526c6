//! Inertial unit of the ADIS16488's class, fixed to the body of a train's first or last car.
//!
//! A sample is what such a unit puts out: the mean turn rate and mean specific force since the
//! last one (it integrates inside, so vibration does not alias), in the vehicle frame as far as it
//! knows it. Specific force is that at the unit's place: the difference of that place's velocities
//! contains the lever arm's terms w' x r + w x (w x r).
//!
//! What is wrong with it: turn-on bias, drift with the data sheet's Allan deviation, white noise,
//! scale, skew of the axes, the gyros' sensitivity to acceleration, range and steps (see
//! `errors.rs`), and it sits neither quite where nor quite as it should. Before the run the gyros'
//! bias is averaged out at standstill, as the part does on its bias null command; what is left is
//! the mean's own noise, and what drifts away from it.
//!
//! Figures are from table 1 of the ADIS16488 data sheet (typical values at 25 °C). Those given
//! there as plus or minus a limit over temperature and life (scale 1 % and 0.5 %) are taken as
//! three sigma; the mounting errors are assumptions, no data.
//!
//! Not modelled: temperature, non-linearity (0.01 % and 0.1 % of the range), the sensors' own
//! bandwidth (330 Hz, above what a car body does), vibration rectification, rate random walk beyond
//! the drift's slowest part, the Earth's turn (15 deg/h, which the null takes out with the bias).

use super::ClockSettings;
use crate::bus::{ImuSample, TrainEnd, TrainId};
use crate::settings::settings;
use crate::twin::physics::{VehicleMotion, World};
use crate::twin::random::Stream;
use errors::{Errors, Triad, normals};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

mod errors;

#[cfg(test)]
mod allan;
#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests;

/// Standard gravity.
const G_MPS2: f64 = 9.806_65;
/// Least significant bits of the 32-bit outputs: 0.02 deg/s and 0.8 mg over 2^16.
const GYRO_LSB_DEG_S: f64 = 0.02 / 65536.0;
const ACCEL_LSB_MG: f64 = 0.8 / 65536.0;

settings! {
    /// The inertial unit. Defaults are typical values of the ADIS16488's data sheet; sigmas are one
    /// sigma, each axis or unit drawn for itself.
    #[derive(Copy)]
    pub struct ImuSettings {
        // The data sheet's fastest is 2460 a second; the physics steps a thousand times.
        /// Samples a second.
        rate_hz: f64 = 200.0, in 1.0..=1000.0;
        /// Where it is in the vehicle frame (forward, left, up from the head at top of rail),
        /// metres.
        position_m: [f64; 3] = [-1.0, 0.0, 1.2], in -30.0..=10.0;
        /// Sigma of its true place about that, each way, metres.
        position_error_m: f64 = 0.01, in 0.0..=1.0;
        /// Sigma of its true attitude about the vehicle's, about each axis: what is left of
        /// the part's misalignment (1 deg, axis to frame) after commissioning, degrees.
        attitude_error_deg: f64 = 0.1, in 0.0..=10.0;
        /// Sigma of the gyroscopes' bias at turn-on, degrees a second.
        gyro_turn_on_deg_s: f64 = 0.2, in 0.0..=1e3;
        /// How long the gyroscopes were averaged at standstill before the run to take their bias
        /// out, seconds; 0 for not at all.
        gyro_null_s: f64 = 30.0, in 0.0..=600.0;
        /// In-run bias stability of the gyroscopes: the floor of their Allan deviation, degrees an
        /// hour.
        gyro_bias_deg_h: f64 = 6.25, in 0.0..=1e5;
        /// Angle random walk, degrees a square root of an hour.
        angle_random_walk_deg_sqrt_h: f64 = 0.3, in 0.0..=1e3;
        /// Sigma of the gyroscopes' scale, as a share.
        gyro_scale_share: f64 = 0.01 / 3.0, in 0.0..=0.2;
        /// Sigma of the lean of one gyroscope's axis towards another's, degrees.
        gyro_skew_deg: f64 = 0.05, in 0.0..=10.0;
        /// Sigma of the bias that an acceleration along any axis makes, degrees a second a g.
        gyro_per_g_deg_s: f64 = 0.009, in 0.0..=10.0;
        /// Range of the gyroscopes, degrees a second.
        gyro_range_deg_s: f64 = 450.0, in 1.0..=1e5;
        /// Sigma of the accelerometers' bias at turn-on, thousandths of g.
        accel_turn_on_mg: f64 = 16.0, in 0.0..=1e4;
        /// In-run bias stability of the accelerometers: the floor of their Allan deviation,
        /// thousandths of g.
        accel_bias_mg: f64 = 0.1, in 0.0..=1e4;
        /// Velocity random walk, m/s a square root of an hour.
        velocity_random_walk_mps_sqrt_h: f64 = 0.029, in 0.0..=1e3;
        /// Sigma of the accelerometers' scale, as a share.
        accel_scale_share: f64 = 0.005 / 3.0, in 0.0..=0.2;
        /// Sigma of the lean of one accelerometer's axis towards another's, degrees.
        accel_skew_deg: f64 = 0.035, in 0.0..=10.0;
        /// Range of the accelerometers, g.
        accel_range_g: f64 = 18.0, in 1.5..=1e4;
        /// Round to the steps of the sensor's 32-bit outputs.
        quantise: bool = true;
        /// Its clock.
        clock: ClockSettings = ClockSettings::default(), nested;
    }
}

impl ImuSettings {
    fn gyro(&self) -> Errors {
        let step = GYRO_LSB_DEG_S * f64::from(u8::from(self.quantise));
        Errors {
            turn_on: self.gyro_turn_on_deg_s.to_radians(),
            floor: self.gyro_bias_deg_h.to_radians() / 3600.0,
            density: self.angle_random_walk_deg_sqrt_h.to_radians() / 60.0,
            scale: self.gyro_scale_share,
            skew_rad: self.gyro_skew_deg.to_radians(),
            range: self.gyro_range_deg_s.to_radians(),
            step: step.to_radians(),
        }
    }

    fn accel(&self) -> Errors {
        let mg = 1e-3 * G_MPS2;
        Errors {
            turn_on: self.accel_turn_on_mg * mg,
            floor: self.accel_bias_mg * mg,
            density: self.velocity_random_walk_mps_sqrt_h / 60.0,
            scale: self.accel_scale_share,
            skew_rad: self.accel_skew_deg.to_radians(),
            range: self.accel_range_g * G_MPS2,
            step: ACCEL_LSB_MG * mg * f64::from(u8::from(self.quantise)),
        }
    }
}

/// An inertial unit at work.
#[derive(Clone, Debug)]
pub struct Imu {
    period_s: f64,
    /// Where and how it really sits.
    place_m: Vector3<f64>,
    unit_from_vehicle: UnitQuaternion<f64>,
    gyro: Triad,
    accel: Triad,
    /// Rad/s of the gyros a m/s² along each axis.
    gyro_per_force: Matrix3<f64>,
    last: Option<VehicleMotion>,
    samples: u64,
}

impl Imu {
    /// A unit whose errors depend on seed and run index.
    pub fn new(settings: &ImuSettings, seed: u64, index: u64) -> Self {
        let s = settings;
        let period_s = 1.0 / s.rate_hz;
        let mount = Stream::new(seed, index, "imu mount");
        let turned = normals(mount, 1) * s.attitude_error_deg.to_radians();
        let per_g = Stream::new(seed, index, "imu gyro per g");
        let per_force = s.gyro_per_g_deg_s.to_radians() / G_MPS2;
        let mut imu = Self {
            period_s,
            place_m: Vector3::from(s.position_m) + normals(mount, 0) * s.position_error_m,
            unit_from_vehicle: UnitQuaternion::from_scaled_axis(turned),
            gyro: Triad::new((seed, index, "imu gyro"), s.gyro(), period_s),
            accel: Triad::new((seed, index, "imu accel"), s.accel(), period_s),
            gyro_per_force: Matrix3::from_fn(|row, column| {
                per_force * per_g.normal((3 * row + column) as u64)
            }),
            last: None,
            samples: 0,
        };
        imu.null_gyros((s.gyro_null_s * s.rate_hz).round() as u64);
        imu
    }

    /// Takes the mean of so many samples on level track from the gyros' bias.
    fn null_gyros(&mut self, samples: u64) {
        let weight = Vector3::new(0.0, 0.0, G_MPS2);
        let mut sum = Vector3::zeros();
        for _ in 0..samples {
            sum += self.measure(&Vector3::zeros(), &weight, self.period_s).0;
        }
        self.gyro.bias -= sum / samples.max(1) as f64;
    }

    /// A sample at one end of a train, of the time since the last one; `None` without its train, and on
    /// the first call, which starts the unit.
    pub fn sample(&mut self, world: &World, train: TrainId, end: TrainEnd) -> Option<ImuSample> {
        let now = *world.vehicle_motion(train, end)?;
        let before = self.last.replace(now)?;
        self.between(end, &before, &now)
    }

    /// A sample of the time between two motions; `None` if there is none.
    fn between(
        &mut self,
        end: TrainEnd,
        before: &VehicleMotion,
        now: &VehicleMotion,
    ) -> Option<ImuSample> {
        let span_s = now.time.since(before.time);
        if span_s <= 0.0 {
            return None;
        }
        let (from, to) = (
            before.world_from_vehicle.rotation,
            now.world_from_vehicle.rotation,
        );
        let turn = (from.inverse() * to).scaled_axis() / span_s;
        let middle = from.slerp(&to, 0.5);
        let change = now.velocity_at(&self.place_m) - before.velocity_at(&self.place_m);
        let force = middle.inverse() * (change / span_s + Vector3::z() * G_MPS2);
        let (gyro_rad_s, accel_m_s2) = self.measure(&turn, &force, span_s);
        Some(ImuSample {
            time: now.time,
            end,
            gyro_rad_s,
            accel_m_s2,
        })
    }

    /// What gyros and accelerometers say of a mean turn rate and specific force, vehicle frame.
    fn measure(
        &mut self,
        turn: &Vector3<f64>,
        force: &Vector3<f64>,
        span_s: f64,
    ) -> (Vector3<f64>, Vector3<f64>) {
        self.samples += 1;
        let turn = self.unit_from_vehicle * turn;
        let force = self.unit_from_vehicle * force;
        let felt = turn + self.gyro_per_force * force;
        (
            self.gyro.measure(&felt, self.samples, span_s),
            self.accel.measure(&force, self.samples, span_s),
        )
    }
}
