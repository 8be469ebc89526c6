//! Against scipy (tests/studies/figures.py makes the numbers), and against known truth.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use super::*;
use crate::twin::random::Stream;
use statrs::distribution::{ContinuousCDF, Normal};

const SAMPLE: [f64; 40] = [
    0.167106, 0.302529, 0.403527, 0.491043, 0.571163, 0.646683, 0.719183, 0.789671, 0.85885,
    0.927244, 0.995267, 1.063265, 1.131537, 1.200352, 1.269966, 1.340624, 1.412573, 1.486065,
    1.561368, 1.638766, 1.718572, 1.801133, 1.886842, 1.976149, 2.06958, 2.167753, 2.271411,
    2.381458, 2.499013, 2.625495, 2.762733, 2.913158, 3.080097, 3.268291, 3.484833, 3.741064,
    4.056863, 4.472285, 5.090075, 6.380926,
];

fn close(e: IntervalEstimate, value: f64, low: f64, high: f64) {
    for (a, b) in [(e.value, value), (e.low, low), (e.high, high)] {
        assert!(
            (a - b).abs() <= 1e-9 * b.abs().max(1e-3),
            "{e:?}: {a} is not {b}"
        );
    }
}

/// y of figures.py.
fn y(k: usize) -> f64 {
    (((k as f64).sin() + SAMPLE[k]) * 1e6).round() / 1e6
}

#[test]
fn val_means_and_quantiles_are_scipys() {
    close(
        mean(&SAMPLE).unwrap(),
        1.990612825,
        1.5464872148108673,
        2.4347384351891326,
    );
    close(
        quantile(&SAMPLE, 0.5).unwrap(),
        1.678669,
        1.200352,
        2.271411,
    );
    close(
        quantile(&SAMPLE, 0.9).unwrap(),
        3.7726439,
        2.913158,
        6.380926,
    );
    let far = quantile(&SAMPLE, 0.95).unwrap();
    assert!((far.value - 4.5031745).abs() < 1e-9 && (far.low - 3.484833).abs() < 1e-12);
    assert!(
        far.high.is_infinite(),
        "40 runs do not bound the 95th percentile from above"
    );
    let differences: Vec<_> = (0..40).map(|k| y(k) - SAMPLE[k]).collect();
    close(
        mean(&differences).unwrap(),
        0.0288275,
        -0.19932921510731455,
        0.25698421510731456,
    );
}

#[test]
fn val_rates_are_scipys() {
    let known = [
        (0, 20, [0.0, 0.16112515805281935, 0.0, 0.16843347098308548]),
        (
            3,
            20,
            [
                0.05236874589621662,
                0.3604188647407569,
                0.03207093718554477,
                0.37892682654529564,
            ],
        ),
        (
            17,
            400,
            [
                0.026701694991131113,
                0.0670020543247502,
                0.024949619202156176,
                0.06717611443870514,
            ],
        ),
        (20, 20, [0.8388748419471808, 1.0, 0.8315665290169145, 1.0]),
        (
            1,
            100_000,
            [
                1.765247730378316e-06,
                5.664709659040965e-05,
                2.5317842743932826e-07,
                5.571516034432556e-05,
            ],
        ),
    ];
    for (k, n, [wl, wh, cl, ch]) in known {
        let r = rate(k, n).unwrap();
        close(r.wilson, k as f64 / n as f64, wl, wh);
        close(r.exact, k as f64 / n as f64, cl, ch);
    }
    assert!(rate(0, 0).is_none() && rate(3, 2).is_none());
}

#[test]
fn val_rank_correlations_are_scipys() {
    let pairs: Vec<_> = (0..40).map(|k| (SAMPLE[k], y(k))).collect();
    let r = rank_correlation(&pairs).unwrap();
    assert!((r.value - 0.8249530956848031).abs() < 1e-12);
    let ties = [1., 2., 2., 3., 3., 3., 4., 5., 5., 6.];
    let other = [2., 1., 3., 3., 5., 4., 4., 6., 8., 7.];
    let pairs: Vec<_> = ties.into_iter().zip(other).collect();
    let r = rank_correlation(&pairs).unwrap();
    assert!((r.value - 0.897584786035756).abs() < 1e-12, "{}", r.value);
    assert!(rank_correlation(&[(1.0, 2.0); 9]).is_none());
}

/// Intervals hold the truth as often as they say, of skew samples whose truth is known: exponential
/// with mean 1, and coins. Bounds are four standard deviations of 2000 trials (0.02) about 95 %; for
/// what holds at least, only from below; t is known to fall short by some 2 % at n = 40 for this
/// skewness (Boos and Hughes-Oliver 2000).
#[test]
fn intervals_cover_the_truth() {
    const TRIALS: u64 = 2000;
    let mut held = [0u32; 4];
    for trial in 0..TRIALS {
        let stream = Stream::new(3, trial, "coverage");
        let mut sample: Vec<f64> = (0..40).map(|k| -stream.uniform(k).ln()).collect();
        let holds = |e: IntervalEstimate, truth: f64| u32::from((e.low..=e.high).contains(&truth));
        held[0] += holds(mean(&sample).unwrap(), 1.0);
        sample.sort_by(f64::total_cmp);
        held[1] += holds(quantile(&sample, 0.8).unwrap(), 5f64.ln());
        let events = (0..60).filter(|k| stream.uniform(100 + k) < 0.1).count();
        let r = rate(events as u64, 60).unwrap();
        held[2] += holds(r.wilson, 0.1);
        held[3] += holds(r.exact, 0.1);
    }
    let share = held.map(|n| f64::from(n) / TRIALS as f64);
    assert!((0.91..0.97).contains(&share[0]), "mean {share:?}");
    assert!((0.93..1.0).contains(&share[1]), "quantile {share:?}");
    assert!((0.93..0.99).contains(&share[2]), "Wilson {share:?}");
    assert!((0.93..1.0).contains(&share[3]), "exact {share:?}");
}

/// Ishigami's function (a = 7, b = 0.1), whose first-order indices are known in closed form: 0.3139,
/// 0.4424, 0.
#[test]
fn val_first_order_indices_of_ishigami() {
    let stream = |name| Stream::new(5, 0, name);
    let inputs = ["a", "b", "c"].map(stream);
    let x = |v: usize, k: u64| (2.0 * inputs[v].uniform(k) - 1.0) * std::f64::consts::PI;
    let y = |k| x(0, k).sin() + 7.0 * x(1, k).sin().powi(2) + 0.1 * x(2, k).powi(4) * x(0, k).sin();
    for (v, truth) in [(0, 0.3139), (1, 0.4424), (2, 0.0)] {
        let pairs: Vec<_> = (0..10_000).map(|k| (x(v, k), y(k))).collect();
        let s = first_order(&pairs).unwrap();
        assert!((s - truth).abs() < 0.04, "input {v}: {s}, not {truth}");
    }
}

/// Groups in the place of ranks: the closed form of a known effect, and Kelley's statistic by scipy's F.
#[test]
fn val_first_order_of_groups() {
    let groups: Vec<_> = (0..40)
        .map(|k| (k % 3, y(k) + [0.0, 2.0, 1.0][k % 3]))
        .collect();
    let share = first_order_of_groups(&groups).unwrap();
    assert!((share - 0.1357243424412402).abs() < 1e-9, "{share}");
    // Three equal groups at 0, 1 and 2 with uniform noise of variance 1: 2/3 of 5/3 lie between them.
    let stream = Stream::new(6, 0, "groups");
    let noise = |k| (stream.uniform(k) - 0.5) * 12f64.sqrt();
    let many: Vec<_> = (0..6000)
        .map(|k| ((k % 3) as usize, (k % 3) as f64 + noise(k)))
        .collect();
    let share = first_order_of_groups(&many).unwrap();
    assert!((share - 0.4).abs() < 0.03, "{share}");
    let nothing: Vec<_> = (0..6000).map(|k| ((k % 3) as usize, noise(k))).collect();
    assert!(first_order_of_groups(&nothing).unwrap().abs() < 0.003);
    assert!(first_order_of_groups(&[(0, 1.0); 12]).is_none());
}

/// Means under N(0, 1) of runs drawn from N(shift, 1), of numbers far from zero: those that are given hold
/// the truth nearly as often as they say, and where a few runs decide, none is given. An unweighted sample
/// has its plain mean; weights that are all 0 have none.
#[test]
fn weighted_means_are_those_of_the_distributions() {
    let normal = Normal::standard();
    let sample = |shift: f64, trial: u64| -> Vec<(f64, f64)> {
        let stream = Stream::new(7, trial, "weights");
        let x = |k| shift + normal.inverse_cdf(stream.uniform(k));
        let run = |x: f64| (shift * (0.5 * shift - x), 100.0 + x);
        (0..400).map(|k| run(x(k))).collect()
    };
    let given = |shift| (0..400).filter_map(move |trial| weighted_mean(&sample(shift, trial)));
    for (shift, least) in [(0.5, 0.92), (1.0, 0.88)] {
        let all: Vec<IntervalEstimate> = given(shift).collect();
        let held = all.iter().filter(|e| (e.low..=e.high).contains(&100.0));
        let share = held.count() as f64 / all.len() as f64;
        assert!(
            all.len() > 300 && share > least,
            "{} of {shift}: {share}",
            all.len()
        );
    }
    assert_eq!(given(3.0).count(), 0);
    let plain: Vec<(f64, f64)> = (0..400).map(|k| (0.0, f64::from(k))).collect();
    assert!((weighted_mean(&plain).unwrap().value - 199.5).abs() < 1e-9);
    let nothing = [(f64::MIN, 1.0); 200];
    assert!(weighted_mean(&nothing).is_none());
    assert!(weighted_rate(&nothing.map(|(ln, _)| (ln, true)), false).is_none());
    assert!(effective_runs(&[f64::MIN; 200]).abs() < 1e-12);
    // An event that happens always is no rarer than always.
    let always: Vec<(f64, bool)> = sample(2.0, 0).iter().map(|(ln, _)| (*ln, true)).collect();
    let rate = weighted_rate(&always, false).unwrap().rate;
    assert!(rate.value <= 1.0 && rate.high <= 1.0, "{rate:?}");
}

/// Weights that are not those of the densities, and effective numbers of runs.
#[test]
fn effective_runs_are_kishs() {
    assert!((effective_runs(&[0.3; 12]) - 12.0).abs() < 1e-12);
    // One run that outweighs all.
    assert!((effective_runs(&[700.0, -700.0, 0.0]) - 1.0).abs() < 1e-9);
    assert!(effective_runs(&[]).abs() < 1e-12);
}
