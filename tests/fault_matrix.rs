//! The fault matrix as a study: every case is drawn once, and breaks what it says.

#![cfg(feature = "twin")]
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test fails by panicking"
)]

use metrotwin::scenario::sampling::{Distribution, Template};
use metrotwin::scenario::{Scenario, ScenarioFile};
use std::collections::BTreeSet;
use std::path::Path;

const STUDY: &str = "scenarios/studies/faults.toml";

/// Each case once, each with a name of its own and, but for the first, something that is not as it was; none
/// is refused.
#[test]
fn every_case_is_run_once_and_breaks_something() {
    let template = Template::load(Path::new(STUDY)).unwrap();
    let Distribution::Cases(cases) = &template.settings.variables["fault"].from else {
        panic!("not cases");
    };
    assert_eq!(template.runs(), cases.len() as u64);
    let whole = Scenario::load(Path::new(STUDY), &[]).unwrap();
    let without_seed = |file: &ScenarioFile| ScenarioFile {
        seed: 0,
        study: None,
        ..file.clone()
    };
    let mut names = BTreeSet::new();
    for index in 0..template.runs() {
        let sample = template.sample(index).unwrap();
        let name = sample.values[0].1.as_str().unwrap().to_owned();
        let drawn = template.scenario(&sample).unwrap();
        let differs = without_seed(&drawn.file) != without_seed(&whole.file);
        assert_eq!(differs, index > 0, "{name}");
        assert!(names.insert(name));
    }
}

/// Two variables that set the same key, one of them in a case only, and a case with a wrong value: refused
/// with the key.
#[test]
fn cases_are_checked() {
    let root = env!("CARGO_MANIFEST_DIR");
    let text = format!(
        r#"
        name = "cases"
        tunnel = "{root}/tunnels/test_bench.toml"
        duration_s = 1.0
        [train]
        [study.variables.cars]
        keys = ["train.cars"]
        from = {{ integer = {{ min = 2, max = 5 }} }}
        "#
    );
    let path = std::env::temp_dir().join(format!("metrotwin_cases_{}.toml", std::process::id()));
    let refused = |case: &str| {
        let more = format!("\n[study.variables.fault]\nfrom = {{ cases = [{case}] }}\n");
        std::fs::write(&path, text.clone() + &more).unwrap();
        Template::load(&path)
            .map(|_| ())
            .map_err(|e| format!("{e:?}"))
    };
    assert!(refused(r#"{ name = "none" }"#).is_ok());
    let twice = refused(r#"{ name = "a" }, { name = "b", set = { "train.cars" = 3 } }"#);
    assert!(twice.unwrap_err().contains("is set by `cars` too"));
    let wrong = refused(r#"{ name = "a" }, { name = "b", set = { "radio.loss" = "much" } }"#);
    assert!(wrong.unwrap_err().contains("radio.loss"));
    std::fs::remove_file(&path).unwrap();
}
