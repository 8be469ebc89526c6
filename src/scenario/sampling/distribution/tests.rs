//! Against scipy, and of one function against the other.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use super::*;
use crate::scenario::sampling::{PlanSettings, as_written};
use crate::settings::Settings;

const SHARES: [f64; 4] = [1e-6, 0.1, 0.5, 0.999];

fn normal(mean: f64, sigma: f64, min: Option<f64>, max: Option<f64>) -> Distribution {
    Distribution::Normal {
        mean,
        sigma,
        min,
        max,
    }
}

fn log_normal() -> Distribution {
    Distribution::LogNormal {
        median: 2.0,
        sigma_ln: 0.5,
        min: None,
        max: None,
    }
}

const TRIANGLE: Distribution = Distribution::Triangular {
    min: 1.0,
    mode: 2.0,
    max: 5.0,
};

/// scipy's norm, truncnorm, lognorm and triang (tests/studies/figures.py).
#[test]
fn val_quantiles_and_densities_are_scipys() {
    let known = [
        (
            normal(3.0, 2.0, None, None),
            [
                -6.506848617645797,
                0.43689686891079926,
                3.0,
                9.180464612335626,
            ],
        ),
        (
            normal(0.0, 1.0, Some(-1.0), Some(2.0)),
            [
                -0.9999966169740943,
                -0.704647821094745,
                0.17116391801782482,
                1.985063085944169,
            ],
        ),
        // Far out in the tail, where 1 - 1e-9 would be all that is left.
        (
            normal(0.0, 1.0, Some(6.0), None),
            [
                6.000000162377741,
                6.017085062660678,
                6.111565061813439,
                7.036366493709704,
            ],
        ),
        (
            log_normal(),
            [
                0.18571074059915316,
                1.053767036592073,
                2.0,
                9.377032362017918,
            ],
        ),
        (
            TRIANGLE,
            [
                1.002,
                1.632455532033676,
                2.550510257216822,
                4.890455488498967,
            ],
        ),
    ];
    for (distribution, quantiles) in known {
        for (u, expected) in SHARES.into_iter().zip(quantiles) {
            let x = distribution.quantile(u).unwrap().as_float().unwrap();
            assert!(
                (x - expected).abs() < 1e-8,
                "{distribution:?} at {u}: {x}, not {expected}"
            );
        }
    }
    let densities = [
        (
            normal(0.0, 1.0, Some(-1.0), Some(2.0)),
            0.5,
            -0.84377223888021,
        ),
        (log_normal(), 3.0, -1.653207549099168),
        (TRIANGLE, 3.0, -1.0986122886681098),
    ];
    for (distribution, x, expected) in densities {
        assert!(
            (distribution.ln_density(x) - expected).abs() < 1e-9,
            "{distribution:?}"
        );
    }
}

/// Densities are those of the quantiles: the slope of one is the inverse of the other; and none
/// outside.
#[test]
fn densities_are_slopes_of_quantiles() {
    let uniform = Distribution::Uniform { min: 2.0, max: 6.0 };
    let log_uniform = Distribution::LogUniform {
        min: 0.1,
        max: 10.0,
    };
    let cut = Distribution::LogNormal {
        median: 2.0,
        sigma_ln: 0.5,
        min: Some(1.0),
        max: Some(3.0),
    };
    for distribution in [
        uniform,
        log_uniform,
        cut,
        TRIANGLE,
        normal(1.0, 0.1, Some(1.05), None),
    ] {
        let at = |u: f64| distribution.quantile(u).unwrap().as_float().unwrap();
        for u in [0.05, 0.3, 0.62, 0.9] {
            let slope = (at(u + 1e-5) - at(u - 1e-5)) / 2e-5;
            let product = slope * distribution.ln_density(at(u)).exp();
            assert!(
                (product - 1.0).abs() < 1e-3,
                "{distribution:?} at {u}: {product}"
            );
        }
        for x in [-1.0, 0.0, 11.0] {
            assert!(distribution.ln_density(x) < -1e3, "{distribution:?} at {x}");
        }
    }
}

/// Both ends of whole numbers, weights of nothing, all of a list.
#[test]
fn whole_numbers_and_choices_take_their_shares() {
    let whole = Distribution::Integer { min: -1, max: 2 };
    let choice = Distribution::Choice {
        values: vec!["a".into(), "b".into(), "c".into()],
        weights: vec![3.0, 0.0, 1.0],
    };
    let count = |distribution: &Distribution, value: Value| {
        let draws = (0..1000).map(|k| distribution.quantile((f64::from(k) + 0.5) / 1000.0));
        draws.filter(|v| v.as_ref() == Some(&value)).count()
    };
    for value in -1..=2 {
        assert_eq!(count(&whole, value.into()), 250);
    }
    let counts = ["a", "b", "c"].map(|v| count(&choice, v.into()));
    assert_eq!(counts, [750, 0, 250]);
}

/// Each wrong distribution is refused, with the key.
#[test]
fn wrong_distributions_say_why() {
    let wrong = [
        ("uniform = { min = 2.0, max = 1.0 }", "not below"),
        ("uniform = { min = 1.0, max = inf }", "not below"),
        ("log_uniform = { min = 0.0, max = 1.0 }", "no logarithm"),
        ("normal = { mean = 0.0, sigma = 0.0 }", "sigma"),
        (
            "normal = { mean = 0.0, sigma = 1.0, min = 40.0 }",
            "leave nothing",
        ),
        ("log_normal = { median = -1.0, sigma_ln = 1.0 }", "median"),
        ("triangular = { min = 0.0, mode = 3.0, max = 2.0 }", "mode"),
        ("integer = { min = 3, max = 3 }", "not below"),
        ("choice = { values = [] }", "nothing"),
        ("choice = { values = [1, 2], weights = [1.0] }", "weights"),
        ("sweep = { values = [] }", "nothing"),
        ("grid = { min = 0.0, max = 1.0, count = 1 }", "steps"),
        ("cases = []", "no cases"),
        (
            r#"cases = [{ name = "a" }, { name = "a" }]"#,
            "name of its own",
        ),
    ];
    for (text, why) in wrong {
        let distribution: Distribution = toml::from_str(text).unwrap();
        let mut problems = Vec::new();
        distribution.check("study.variables.x.from", &mut problems);
        assert!(
            problems.len() == 1 && problems[0].what.contains(why),
            "{text}: {problems:?}"
        );
    }
}

/// Proposals whose weights have no variance: a normal one with less than 0.707 of sigma (the integral of
/// f^2 / g has exp(x^2 (1/(2 s^2) - 1))), tails that are thinner, corners.
#[test]
fn proposals_fall_off_slowly_enough() {
    let nature = normal(0.0, 1.0, None, None);
    let cut = normal(0.0, 1.0, Some(-2.0), Some(2.0));
    assert!(normal(3.0, 1.0, None, None).bounds_weights_of(&nature));
    assert!(normal(0.0, 0.72, None, None).bounds_weights_of(&nature));
    assert!(!normal(0.0, 0.7, None, None).bounds_weights_of(&nature));
    assert!(normal(0.0, 0.4, None, None).bounds_weights_of(&cut));
    assert!(!normal(0.0, 9.0, None, None).bounds_weights_of(&log_normal()));
    let uniform = Distribution::Uniform { min: 1.0, max: 5.0 };
    assert!(!TRIANGLE.bounds_weights_of(&uniform));
    assert!(uniform.bounds_weights_of(&TRIANGLE));
    assert!(nature.covers(&TRIANGLE) && !TRIANGLE.covers(&nature));
}

/// What users are shown is what they would write: keys in the order of the documentation, defaults left
/// out.
#[test]
fn settings_are_shown_as_written() {
    let shown = as_written(&Distribution::Uniform { min: 1.0, max: 5.0 });
    assert_eq!(shown, "{ uniform = { min = 1.0, max = 5.0 } }");
    assert_eq!(
        as_written(&normal(0.0, 1.0, None, Some(2.0))),
        "{ normal = { mean = 0.0, sigma = 1.0, max = 2.0 } }"
    );
    assert_eq!(as_written(&PlanSettings::Sobol), "sobol");
}
