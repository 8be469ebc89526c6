//! Inertial unit of the ADIS16488's class, fixed to the leading car's body.
//!
//! A sample is what such a unit puts out: the mean turn rate and mean specific force since the
//! last one (it integrates inside, so vibration does not alias), in the vehicle frame, with bias,
//! white noise, range and quantisation. The bias is a first-order Gauss-Markov process that starts
//! at a random value of its own; IEEE Std 952 describes the model.

use crate::bus::ImuSample;
use crate::track::{Checker, Problem};
use crate::twin::physics::{VehicleMotion, World};
use crate::twin::random::Stream;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Standard gravity.
const G_MPS2: f64 = 9.806_65;
/// Least significant bits of the 32-bit outputs: 0.02 deg/s and 0.8 mg over 2^16.
const GYRO_LSB_DEG_S: f64 = 0.02 / 65536.0;
const ACCEL_LSB_MG: f64 = 0.8 / 65536.0;

/// The inertial unit. Defaults are typical values of the ADIS16488's data sheet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ImuSettings {
    /// Samples a second.
    pub rate_hz: f64,
    /// Where it is in the vehicle frame (forward, left, up from the head at top of rail), metres.
    pub position_m: [f64; 3],
    /// In-run bias of the gyroscopes, one sigma, degrees an hour.
    pub gyro_bias_deg_h: f64,
    /// Angle random walk, degrees a square root of an hour.
    pub angle_random_walk_deg_sqrt_h: f64,
    /// Range of the gyroscopes, degrees a second.
    pub gyro_range_deg_s: f64,
    /// In-run bias of the accelerometers, one sigma, thousandths of g.
    pub accel_bias_mg: f64,
    /// Velocity random walk, m/s a square root of an hour.
    pub velocity_random_walk_mps_sqrt_h: f64,
    /// Range of the accelerometers, g.
    pub accel_range_g: f64,
    /// Time in which a bias forgets its value, seconds.
    pub bias_time_s: f64,
    /// Round to the steps of the sensor's 32-bit outputs.
    pub quantise: bool,
}

impl Default for ImuSettings {
    fn default() -> Self {
        Self {
            rate_hz: 200.0,
            position_m: [-1.0, 0.0, 1.2],
            gyro_bias_deg_h: 6.25,
            angle_random_walk_deg_sqrt_h: 0.3,
            gyro_range_deg_s: 450.0,
            accel_bias_mg: 0.1,
            velocity_random_walk_mps_sqrt_h: 0.029,
            accel_range_g: 18.0,
            bias_time_s: 300.0,
            quantise: true,
        }
    }
}

impl ImuSettings {
    /// Appends what is wrong with these settings; `at` is the dotted key that leads here.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        let mut check = Checker::new(at, problems);
        // The data sheet's fastest is 2460 a second; the physics steps a thousand times.
        check.within("rate_hz", self.rate_hz, 1.0..=1000.0, "Hz");
        for p in self.position_m {
            check.within("position_m", p, -30.0..=10.0, "m");
        }
        check.within("gyro_bias_deg_h", self.gyro_bias_deg_h, 0.0..=1e5, "deg/h");
        let walk = self.angle_random_walk_deg_sqrt_h;
        check.within(
            "angle_random_walk_deg_sqrt_h",
            walk,
            0.0..=1e3,
            "deg/sqrt(h)",
        );
        check.within(
            "gyro_range_deg_s",
            self.gyro_range_deg_s,
            1.0..=1e5,
            "deg/s",
        );
        check.within("accel_bias_mg", self.accel_bias_mg, 0.0..=1e4, "mg");
        let walk = self.velocity_random_walk_mps_sqrt_h;
        check.within(
            "velocity_random_walk_mps_sqrt_h",
            walk,
            0.0..=1e3,
            "m/s/sqrt(h)",
        );
        check.within("accel_range_g", self.accel_range_g, 1.5..=1e4, "g");
        check.within("bias_time_s", self.bias_time_s, 1.0..=1e9, "s");
    }
}

/// Three axes with the same kind of error, SI.
#[derive(Clone, Copy, Debug)]
struct Triad {
    stream: Stream,
    bias: Vector3<f64>,
    bias_sigma: f64,
    /// White noise, unit a square root of a hertz.
    density: f64,
    range: f64,
    lsb: f64,
}

impl Triad {
    fn new(stream: Stream, bias_sigma: f64, density: f64, range: f64, lsb: f64) -> Self {
        Self {
            stream,
            bias: normals(stream, 0) * bias_sigma,
            bias_sigma,
            density,
            range,
            lsb,
        }
    }

    /// Sample `number` (from 1) of a `truth` averaged over `span_s`; `keep` is how much of its
    /// bias is left from the last sample.
    fn measure(
        &mut self,
        truth: Vector3<f64>,
        number: u64,
        span_s: f64,
        keep: f64,
    ) -> Vector3<f64> {
        let drift = (1.0 - keep * keep).sqrt() * self.bias_sigma;
        self.bias = self.bias * keep + normals(self.stream, 2 * number) * drift;
        let noise = normals(self.stream, 2 * number + 1) * (self.density / span_s.sqrt());
        (truth + self.bias + noise).map(|x| {
            let x = x.clamp(-self.range, self.range);
            if self.lsb > 0.0 {
                (x / self.lsb).round() * self.lsb
            } else {
                x
            }
        })
    }
}

/// Three numbers of a stream.
fn normals(stream: Stream, block: u64) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| stream.normal(3 * block + axis as u64))
}

/// An inertial unit at work.
#[derive(Clone, Debug)]
pub struct Imu {
    settings: ImuSettings,
    gyro: Triad,
    accel: Triad,
    last: Option<VehicleMotion>,
    samples: u64,
}

impl Imu {
    /// A unit whose errors depend on seed and run index.
    pub fn new(settings: &ImuSettings, seed: u64, index: u64) -> Self {
        let s = settings;
        let steps = f64::from(u8::from(s.quantise));
        let mg = 1e-3 * G_MPS2;
        Self {
            settings: *s,
            gyro: Triad::new(
                Stream::new(seed, index, "imu gyro"),
                s.gyro_bias_deg_h.to_radians() / 3600.0,
                s.angle_random_walk_deg_sqrt_h.to_radians() / 60.0,
                s.gyro_range_deg_s.to_radians(),
                steps * GYRO_LSB_DEG_S.to_radians(),
            ),
            accel: Triad::new(
                Stream::new(seed, index, "imu accel"),
                s.accel_bias_mg * mg,
                s.velocity_random_walk_mps_sqrt_h / 60.0,
                s.accel_range_g * G_MPS2,
                steps * ACCEL_LSB_MG * mg,
            ),
            last: None,
            samples: 0,
        }
    }

    /// From sample to sample.
    pub fn period_s(&self) -> f64 {
        1.0 / self.settings.rate_hz
    }

    /// A sample of the time since the last one; `None` without a train, and on the first call,
    /// which starts the unit.
    pub fn sample(&mut self, world: &World) -> Option<ImuSample> {
        let now = *world.vehicle_motion()?;
        let before = self.last.replace(now)?;
        let span_s = now.time.since(before.time);
        if span_s <= 0.0 {
            return None;
        }
        self.samples += 1;
        let place = Vector3::from(self.settings.position_m);
        let (from, to) = (
            before.world_from_vehicle.rotation,
            now.world_from_vehicle.rotation,
        );
        let turn = from.inverse() * to;
        let middle = from.slerp(&to, 0.5);
        let change = now.velocity_at(&place) - before.velocity_at(&place);
        let force = middle.inverse() * (change / span_s + Vector3::z() * G_MPS2);
        let keep = (-span_s / self.settings.bias_time_s).exp();
        Some(ImuSample {
            time: now.time,
            gyro_rad_s: self
                .gyro
                .measure(turn.scaled_axis() / span_s, self.samples, span_s, keep),
            accel_m_s2: self.accel.measure(force, self.samples, span_s, keep),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise density taken per sample, or bias in the wrong unit, miss these by far.
    #[test]
    fn error_statistics() {
        let settings = ImuSettings {
            gyro_bias_deg_h: 0.0,
            ..ImuSettings::default()
        };
        let n = 20_000;
        let span_s = 0.005;
        let mut imu = Imu::new(&settings, 3, 0);
        let (mut sum, mut square) = (0.0, 0.0);
        for k in 1..=n {
            let x = imu.gyro.measure(Vector3::zeros(), k, span_s, 1.0).x;
            sum += x;
            square += x * x;
        }
        // The angle walks 0.3 deg in an hour, so in 100 s by 0.05 deg (one sigma).
        let walked = (sum * span_s).to_degrees();
        assert!(walked.abs() < 3.0 * 0.05, "{walked} deg");
        let density = (square / n as f64 * span_s).sqrt().to_degrees() * 60.0;
        assert!((density - 0.3).abs() < 0.006, "{density} deg/sqrt(h)");
    }

    /// Over many units the bias has its sigma, at power-on and after a long run alike.
    #[test]
    fn bias_is_stationary() {
        let settings = ImuSettings::default();
        let units = 2000u64;
        let (mut first, mut later) = (0.0, 0.0);
        for index in 0..units {
            let mut imu = Imu::new(&settings, 5, index);
            first += imu.accel.bias.norm_squared() / 3.0;
            for k in 1..=5 {
                imu.accel.measure(Vector3::zeros(), k, 1.0, 0.5);
            }
            later += imu.accel.bias.norm_squared() / 3.0;
        }
        for square in [first, later] {
            let mg = (square / units as f64).sqrt() / G_MPS2 * 1e3;
            assert!((mg - 0.1).abs() < 0.003, "{mg} mg");
        }
    }

    /// A turn faster than the range saturates.
    #[test]
    fn range_holds() {
        let mut imu = Imu::new(&ImuSettings::default(), 1, 0);
        let x = imu.gyro.measure(Vector3::repeat(100.0), 1, 0.005, 1.0);
        assert!((x.max().to_degrees() - 450.0).abs() < 1e-3);
    }
}
