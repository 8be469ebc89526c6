//! The protection level: a bound on an error that holds but for a stated risk, faults included.
//!
//! An estimate rests on several sources. Without fault it has a standard deviation s0 and a bias of b0 at most. Fault mode k
//! makes one source, or several, say anything; with the probability p_k it is there. The estimate without those sources has
//! s_k and b_k, and a fault is noticed where both estimates are more than T_k apart. So the error is over L unnoticed with
//!
//! 2 Q((L - b0) / s0) + sum_k p_k Q((L - T_k - b_k) / s_k),
//!
//! and the protection level is the L for which this is the risk. Q(x) is the normal tail, and for a fault mode 1 where x is
//! below 0: a fault may be as large as its threshold lets it.
//!
//! Source: Blanch et al., Baseline advanced RAIM user algorithm, IEEE Trans. Aerospace and Electronic Systems 51 (1), 2015;
//! WG-C ARAIM Reference Airborne Algorithm Description Document v3.0, equations 7, 8, 31 and 32.

use crate::numerics::bisected;
use std::f64::consts::SQRT_2;

/// A level over this is none, metres.
const MOST_M: f64 = 1e12;
/// Of bisections: to a millionth of a millionth of where they begin.
const STEPS: u32 = 40;

/// A fault that may be there unnoticed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultMode {
    /// That it is there.
    pub probability: f64,
    /// Estimates with and without the faulty sources are noticed to differ beyond this, metres.
    pub threshold_m: f64,
    /// Of the estimate without them.
    pub without: EstimateBound,
}

/// What an estimate's error is, without fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimateBound {
    /// Standard deviation, metres.
    pub sigma_m: f64,
    /// Most that its mean is off, metres.
    pub bias_m: f64,
}

/// The normal distribution's upper tail.
pub fn normal_tail(x: f64) -> f64 {
    0.5 * libm::erfc(x / SQRT_2)
}

/// The number that a normal one is over with a probability, by bisection; 0 at one half and above.
pub fn normal_quantile(probability: f64) -> f64 {
    bisected((0.0, 40.0), STEPS, |x| normal_tail(x) > probability).1
}

impl FaultMode {
    /// Probability that an error over the level goes unnoticed.
    fn over(&self, level_m: f64) -> f64 {
        let left_m = level_m - self.threshold_m - self.without.bias_m;
        let tail = match left_m > 0.0 {
            true => normal_tail(left_m / self.without.sigma_m),
            false => 1.0,
        };
        self.probability * tail
    }
}

/// The least level, metres, that the error is over unnoticed with no more than a risk; infinite where no level is.
pub fn protection_level_m(fault_free: &EstimateBound, faults: &[FaultMode], risk: f64) -> f64 {
    let over = |level_m: f64| {
        let usual = 2.0 * normal_tail((level_m - fault_free.bias_m) / fault_free.sigma_m);
        usual + faults.iter().map(|fault| fault.over(level_m)).sum::<f64>()
    };
    let is_over = |level_m: f64| over(level_m) > risk;
    let mut most_m = fault_free.bias_m + fault_free.sigma_m;
    while most_m < MOST_M && is_over(most_m) {
        most_m *= 2.0;
    }
    match most_m < MOST_M {
        true => bisected((0.0, most_m), STEPS, is_over).1,
        false => f64::INFINITY,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// Without faults it is the two-sided normal quantile: 4.4172 at 1e-5, 5.3267 at 1e-7.
    #[test]
    fn without_faults_it_is_a_quantile() {
        for (risk, expected) in [(1e-5, 4.4172), (1e-7, 5.3267)] {
            let fault_free = EstimateBound {
                sigma_m: 2.0,
                bias_m: 0.3,
            };
            let level_m = protection_level_m(&fault_free, &[], risk);
            assert!((level_m - 0.3 - 2.0 * expected).abs() < 2e-4, "{level_m}");
            assert!((normal_quantile(0.5 * risk) - expected).abs() < 1e-4);
        }
    }

    /// A fault that is more probable than the risk is bounded by its threshold, and by the error of what is left then; where
    /// that is nothing there is no bound. One that is less probable needs none.
    #[test]
    fn thresholds_and_biases_add_up() {
        let fault_free = EstimateBound {
            sigma_m: 1e-3,
            bias_m: 0.0,
        };
        let fault = |probability, sigma_m| FaultMode {
            probability,
            threshold_m: 7.0,
            without: EstimateBound {
                sigma_m,
                bias_m: 0.5,
            },
        };
        let rare = protection_level_m(&fault_free, &[fault(5e-6, 1.0)], 1e-5);
        assert!(
            (rare - 1e-3 * normal_quantile(2.5e-6)).abs() < 1e-6,
            "{rare}"
        );
        let twice = protection_level_m(&fault_free, &[fault(2e-5, 1.0)], 1e-5);
        assert!((twice - 7.5).abs() < 1e-6, "{twice}");
        let likely = protection_level_m(&fault_free, &[fault(1e-2, 1.0)], 1e-5);
        assert!(
            (likely - 7.5 - normal_quantile(1e-3)).abs() < 1e-6,
            "{likely}"
        );
        assert!(protection_level_m(&fault_free, &[fault(1e-2, f64::INFINITY)], 1e-5).is_infinite());
    }

    /// Direction cosines of the satellites of an example to the user (east, north, up), system (0 GPS, 1 Galileo), variance of
    /// the range for integrity and for accuracy, square metres.
    const SATELLITES: [([f64; 3], usize, f64, f64); 10] = [
        ([0.0225, 0.9951, -0.0966], 0, 3.8865, 3.5740),
        ([0.6750, -0.6900, -0.2612], 0, 1.4377, 1.1252),
        ([0.0723, -0.6601, -0.7477], 0, 0.8604, 0.5479),
        ([-0.9398, 0.2553, -0.2269], 0, 1.6383, 1.3258),
        ([-0.5907, -0.7539, -0.2877], 0, 1.3229, 1.0104),
        ([-0.3236, -0.0354, -0.9455], 1, 0.8434, 0.5309),
        ([-0.6748, 0.4356, -0.5957], 1, 0.8963, 0.5838),
        ([0.0938, -0.7004, -0.7075], 1, 0.8669, 0.5544),
        ([0.5571, 0.3088, -0.7709], 1, 0.8573, 0.5448),
        ([0.6622, 0.6958, -0.2780], 1, 1.3616, 1.0491),
    ];
    const NOMINAL_BIAS_M: f64 = 0.5;

    /// What a least-squares solution without some satellites says of one axis: weights of the ranges.
    fn weights(axis: usize, without: &[usize]) -> DVector<f64> {
        let used = |k: usize| !without.contains(&k);
        let has = |system| (0..10).any(|k| used(k) && SATELLITES[k].1 == system);
        let columns: Vec<usize> = (0..2).filter(|system| has(*system)).collect();
        let geometry = DMatrix::from_fn(10, 3 + columns.len(), |k, state| match state {
            0..3 => SATELLITES[k].0[state],
            _ => f64::from(u8::from(SATELLITES[k].1 == columns[state - 3])),
        });
        let weight = DMatrix::from_diagonal(&DVector::from_fn(10, |k, _| match used(k) {
            true => 1.0 / SATELLITES[k].2,
            false => 0.0,
        }));
        let normal = geometry.transpose() * &weight * &geometry;
        let solution = normal.try_inverse().unwrap() * geometry.transpose() * weight;
        solution.row(axis).transpose()
    }

    fn bound(weights: &DVector<f64>) -> EstimateBound {
        let variances = (0..10).map(|k| weights[k].powi(2) * SATELLITES[k].2);
        EstimateBound {
            sigma_m: variances.sum::<f64>().sqrt(),
            bias_m: weights.iter().map(|w| w.abs() * NOMINAL_BIAS_M).sum(),
        }
    }

    /// Protection level of an axis: faults of each satellite (1e-5) and of each system (1e-4).
    fn of_axis(axis: usize, risk: f64, false_alert: f64) -> f64 {
        let all = weights(axis, &[]);
        let singles = (0..10).map(|k| (vec![k], 1e-5));
        let of_system = |system| (0..10).filter(|k| SATELLITES[*k].1 == system).collect();
        let systems = (0..2).map(|system| (of_system(system), 1e-4));
        let modes: Vec<(Vec<usize>, f64)> = singles.chain(systems).collect();
        let alert = normal_quantile(false_alert / (2.0 * modes.len() as f64));
        let faults = modes.iter().map(|(without, probability)| {
            let left = weights(axis, without);
            let apart = (0..10).map(|k| (left[k] - all[k]).powi(2) * SATELLITES[k].3);
            FaultMode {
                probability: *probability,
                threshold_m: alert * apart.sum::<f64>().sqrt(),
                without: bound(&left),
            }
        });
        protection_level_m(&bound(&all), &faults.collect::<Vec<_>>(), risk)
    }

    /// The numerical example of the ARAIM algorithm description v3.0, appendix D, of ten satellites of two systems: 19.2 m
    /// up, 14.5 m in the plane. Of the risk of 1e-7, two faults at once take 45 times 1e-10 of two satellites, 20 times 1e-9 of a
    /// satellite and a system, and 1e-8 of both systems; what is left is shared, 0.98 up and 0.01 for each axis of the plane.
    /// False alerts: 3.9e-6 up, 4.5e-8 for each axis. The published levels are rounded to 0.1 m, and those of an axis are
    /// found to 0.05 m, from above.
    #[test]
    fn val_araim_example() {
        let risk = 1e-7 - (45e-10 + 20e-9 + 1e-8);
        let up_m = of_axis(2, 0.98 * risk, 3.9e-6);
        assert!((19.10..19.25).contains(&up_m), "{up_m}");
        let [east_m, north_m] = [0, 1].map(|axis| of_axis(axis, 0.01 * risk, 4.5e-8));
        let plane_m = east_m.hypot(north_m);
        assert!((14.38..14.55).contains(&plane_m), "{plane_m}");
    }
}
