//! The Allan deviation, and what it says of the synthetic unit.
//!
//! IEEE Std 952, annex C: of means over neighbouring spans of length tau, half the mean square of
//! their differences. All starts count (overlapping).

use super::{Imu, ImuSettings};
use crate::twin::random::Stream;
use crate::twin::sensors::imu::G_MPS2;
use nalgebra::Vector3;

/// Sum of a series up to each of its samples, from 0.
fn integrated(samples: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut sums = vec![0.0];
    sums.extend(samples.iter().map(|x| {
        sum += x;
        sum
    }));
    sums
}

/// Overlapping Allan variance over spans of `m` samples, of a series given as its sums.
fn variance(sums: &[f64], m: usize) -> f64 {
    let squares = sums.windows(2 * m + 1).map(|w| {
        let difference = (w[2 * m] - 2.0 * w[m] + w[0]) / m as f64;
        difference * difference
    });
    let starts = sums.len() - 2 * m;
    0.5 * squares.sum::<f64>() / starts as f64
}

/// Allan variance of a first-order Gauss-Markov process, IEEE Std 952, annex C.
pub(super) fn gauss_markov_variance(variance: f64, time_s: f64, tau_s: f64) -> f64 {
    let x = tau_s / time_s;
    if x < 1e-3 {
        // The first term of the series: the difference below would cancel.
        return variance * 2.0 * x / 3.0;
    }
    let fade = 3.0 - 4.0 * (-x).exp() + (-2.0 * x).exp();
    variance * 2.0 / x * (1.0 - fade / (2.0 * x))
}

/// White noise falls as sigma^2/m; a ramp of slope a has a^2 m^2/2; constants vanish.
#[test]
fn the_allan_variance_has_its_closed_forms() {
    let ramp: Vec<f64> = (0..1000).map(|k| 7.0 + 0.3 * f64::from(k)).collect();
    let sums = integrated(&ramp);
    for m in [1usize, 10, 100] {
        let wanted = 0.5 * (0.3 * m as f64).powi(2);
        assert!((variance(&sums, m) / wanted - 1.0).abs() < 1e-6);
    }
    let noise = Stream::new(4, 0, "white");
    let white: Vec<f64> = (0..200_000).map(|k| 2.0 * noise.normal(k)).collect();
    let sums = integrated(&white);
    for m in [1usize, 10, 100] {
        let share = variance(&sums, m) * m as f64 / 4.0;
        // Its own uncertainty is sqrt(3 m/n): 0.4, 1.2, 3.9 %.
        assert!((share - 1.0).abs() < 0.08, "{share} at {m}");
    }
}

/// One Gauss-Markov process against its closed form: checks that form, which the floor's weights
/// are tested with.
#[test]
fn the_allan_variance_of_gauss_markov() {
    let noise = Stream::new(5, 0, "gauss-markov");
    let keep = (-1f64 / 20.0).exp();
    let mut x = noise.normal(0);
    let series: Vec<f64> = (1..400_000)
        .map(|k| {
            x = keep * x + (1.0 - keep * keep).sqrt() * noise.normal(k);
            x
        })
        .collect();
    let sums = integrated(&series);
    for m in [5usize, 20, 40, 200] {
        let share = variance(&sums, m) / gauss_markov_variance(1.0, 20.0, m as f64);
        assert!((share - 1.0).abs() < 0.1, "{share} at {m}");
    }
    // At its hump, 1.89 T, the deviation is 0.617 sigma.
    let hump = gauss_markov_variance(1.0, 20.0, 1.89 * 20.0).sqrt();
    assert!((hump - 0.617).abs() < 1e-3, "{hump}");
}

const UNITS: u64 = 6;
const STILL_S: usize = 2400;
const RATE_HZ: usize = 200;

/// Allan variances of one kind of sensor, averaged over axes and units.
#[derive(Default)]
struct AllanCurve {
    /// At 1, 2 and 4 samples.
    fast: [f64; 3],
    /// At the spans of `SLOW_S`.
    slow: [f64; 9],
}

const FAST: [usize; 3] = [1, 2, 4];
const SLOW_S: [usize; 9] = [1, 2, 5, 10, 20, 50, 100, 200, 300];

impl AllanCurve {
    /// Adds a record of samples of one axis.
    fn add(&mut self, samples: &[f64]) {
        let share = 1.0 / (3 * UNITS) as f64;
        let sums = integrated(&samples[..200 * RATE_HZ]);
        for (sum, m) in self.fast.iter_mut().zip(FAST) {
            *sum += share * variance(&sums, m);
        }
        // Means over whole seconds: spans of seconds need no more.
        let seconds = samples.chunks_exact(RATE_HZ);
        let means: Vec<f64> = seconds.map(|s| s.iter().sum::<f64>() / 200.0).collect();
        let sums = integrated(&means);
        for (sum, m) in self.slow.iter_mut().zip(SLOW_S) {
            *sum += share * variance(&sums, m);
        }
    }

    /// Random walk coefficient: the deviation on the slope of -1/2, carried on to 1 s; and the
    /// lowest deviation.
    fn walk_and_floor(&self) -> (f64, f64) {
        let at_1_s = |k: usize| self.fast[k] * FAST[k] as f64 / RATE_HZ as f64;
        let walk = ((at_1_s(0) + at_1_s(1) + at_1_s(2)) / 3.0).sqrt();
        let floor = self.slow.iter().copied().fold(f64::INFINITY, f64::min);
        (walk, floor.sqrt())
    }
}

/// A still unit with all its errors has the Allan deviation that the data sheet's figures say:
/// noise per sample for noise density, B for its floor, a bias without floor, or drift that starts
/// at zero all miss by more than that.
#[test]
fn val_allan_deviation_of_the_imu() {
    let settings = ImuSettings::default();
    let mut curves = [AllanCurve::default(), AllanCurve::default()];
    let force = Vector3::new(0.0, 0.0, G_MPS2);
    for index in 0..UNITS {
        let mut imu = Imu::new(&settings, 11, index);
        let mut records = vec![Vec::new(); 6];
        for _ in 0..STILL_S * RATE_HZ {
            let (gyro, accel) = imu.measure(&Vector3::zeros(), &force, 1.0 / RATE_HZ as f64);
            for (record, x) in records.iter_mut().zip(gyro.iter().chain(&accel)) {
                record.push(*x);
            }
        }
        for (k, record) in records.iter().enumerate() {
            curves[k / 3].add(record);
        }
    }
    let to_deg_h = 1f64.to_degrees() * 3600.0;
    let to_mg = 1e3 / G_MPS2;
    let gyro = ("gyro", to_deg_h, "deg/h", 60.0 * 1f64.to_degrees());
    let accel = ("accel", to_mg, "mg", 60.0);
    let wanted = [
        (
            settings.angle_random_walk_deg_sqrt_h,
            settings.gyro_bias_deg_h,
        ),
        (
            settings.velocity_random_walk_mps_sqrt_h,
            settings.accel_bias_mg,
        ),
    ];
    for ((curve, (name, to_unit, unit, to_walk)), wanted) in
        curves.iter().zip([gyro, accel]).zip(wanted)
    {
        let (walk, floor) = curve.walk_and_floor();
        let (walk, floor) = (walk * to_walk, floor * to_unit);
        let slow: Vec<String> = (curve.slow.iter().zip(SLOW_S))
            .map(|(v, tau)| format!("{tau} s {:.4}", v.sqrt() * to_unit))
            .collect();
        eprintln!(
            "{name}: random walk {walk:.5} (wanted {}), floor {floor:.4} {unit} (wanted {}); {}",
            wanted.0,
            wanted.1,
            slow.join(", ")
        );
        assert!((walk / wanted.0 - 1.0).abs() < 0.062, "{name} {walk}");
        assert!((floor / wanted.1 - 1.0).abs() < 0.062, "{name} {floor}");
    }
}
