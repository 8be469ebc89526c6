//! The fault matrix as a study: every case is drawn once, and breaks what it says; the worst ones are run.

use metrotwin::bus::{Content, DangerLevel, SimTime};
use metrotwin::scenario::sampling::{Distribution, Template};
use metrotwin::scenario::{Scenario, ScenarioFile};
use metrotwin::session::{Event, Observer, ObserverError, RunOptions, run};
use std::collections::BTreeSet;
use std::path::Path;

const STUDY: &str = "scenarios/studies/faults.toml";

/// What is said in a run.
#[derive(Default)]
struct Said {
    /// When the equipment of the train said first that it may not stop in time.
    may_not_stop: Option<SimTime>,
    /// When the device first reported the box.
    found: Option<SimTime>,
    /// When it first took that back.
    cleared: Option<SimTime>,
}

impl Observer for Said {
    fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
        let Event::Message { message, .. } = event else {
            return Ok(());
        };
        match &message.content {
            Content::Protection(report) if !report.stops_in_time => {
                self.may_not_stop.get_or_insert(report.time);
            }
            Content::Warning(warning) => match (warning.danger, self.found) {
                (DangerLevel::High, None) if !warning.blind => self.found = Some(warning.issued),
                (DangerLevel::None, Some(_)) => {
                    self.cleared.get_or_insert(warning.issued);
                }
                _ => {}
            },
            _ => {}
        }
        Ok(())
    }
}

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

/// The cases in which the box cannot be seen, and that without a fault, end without a collision, with the
/// camera of the run in which headlights once took the alarm back. On a film of leaves the brakes need all of
/// the way that there is, or some metres more: a train that still hits is slower than 5.5 m/s (4 when measured),
/// and its equipment has said before that it may not stop. Without the rig, and with a quarter of the pixels,
/// to be quick. Provokes an "all clear" from a camera that sees nothing.
#[test]
fn the_worst_cases_end_before_the_box_or_slowly() {
    let text = std::fs::read_to_string(STUDY).unwrap();
    let mut table: toml::Table = text.parse().unwrap();
    let study = table.remove("study").unwrap();
    table.remove("rig").unwrap();
    let camera = table["wayside"][0]["camera"].as_table_mut().unwrap();
    camera.insert("width_px".into(), 960.into());
    camera.insert("height_px".into(), 540.into());
    camera.insert("pixel_um".into(), 6.0.into());
    let tunnel = Path::new(env!("CARGO_MANIFEST_DIR")).join("tunnels/chengdu_line1.toml");
    table.insert("tunnel".into(), tunnel.to_str().unwrap().into());
    let path = std::env::temp_dir().join(format!("metrotwin_worst_{}.toml", std::process::id()));
    std::fs::write(&path, table.to_string()).unwrap();
    let worst = [
        "nothing",
        "all lamps dead",
        "mist, 60 m of sight",
        "mist, 40 m of sight",
        "no radio",
        "film of leaves everywhere",
        "film of leaves everywhere, slides not reported",
    ];
    let cases = study["variables"]["fault"]["from"]["cases"]
        .as_array()
        .unwrap();
    let name = |case: &toml::Value| case["name"].as_str().unwrap().to_owned();
    let chosen: Vec<_> = cases
        .iter()
        .filter(|case| worst.contains(&name(case).as_str()))
        .collect();
    assert_eq!(chosen.len(), worst.len());
    for case in chosen {
        let sets = case.get("set").and_then(|set| set.as_table());
        let sets = sets.into_iter().flatten();
        let sets: Vec<_> = sets
            .map(|(key, value)| format!("{key}={value}").parse().unwrap())
            .collect();
        let scenario = Scenario::load(&path, &sets).unwrap();
        let mut said = Said::default();
        let summary = run(&scenario, &RunOptions::default(), &mut [&mut said]).unwrap();
        let protection = summary.protection.unwrap();
        println!(
            "{}: {:?} m, may not stop: {:?}",
            name(case),
            protection.stop_margin_m,
            said.may_not_stop
        );
        if name(case) == "nothing" {
            assert!(said.found.unwrap().secs() < 4.0 && said.cleared.is_none());
        }
        let on_leaves = name(case).starts_with("film of leaves");
        assert!(on_leaves || !protection.collision, "{}", name(case));
        if let Some(hit) = protection.impacts.first() {
            let warned = said.may_not_stop.is_some_and(|t| t < hit.time);
            assert!(warned && hit.speed_mps < 5.5, "{}: {hit:?}", name(case));
        }
        assert!(protection.stopped_s.is_some(), "{}", name(case));
    }
    std::fs::remove_file(&path).unwrap();
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
