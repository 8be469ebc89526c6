//! What the rows of a study come to: no run is left out of a denominator, the worst is shown, what was
//! stopped by is marked.

use metrotwin::scenario::sampling::{Distribution, PrecisionSettings, ScenarioSample, Template};
use metrotwin::session::RendererChoice;
use metrotwin::study::{
    Digest, EarlyStop, FigureDigest, INPUTS, MANIFEST, Row, ScenarioRunner, Status, Study, compare,
    report,
};
use metrotwin::twin::sensors::RigError;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};

const SMALL: &str = "tests/studies/small.toml";

/// A folder of a test with the inputs of the small study.
pub fn folder(name: &str) -> PathBuf {
    let folder = crate::program::folder(name);
    for file in [
        SMALL,
        "tests/studies/steps.csv",
        "tunnels/chengdu_line1.toml",
    ] {
        let to = folder.join(INPUTS).join(file);
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        fs::copy(file, to).unwrap();
    }
    folder
}

/// The small study, with events about how it ends.
pub fn template(folder: &Path) -> Template {
    let path = folder.join(INPUTS).join(SMALL);
    let text = fs::read_to_string(&path).unwrap();
    let (head, _) = text.split_once("[study.events]").unwrap();
    let events = "hit = \"collision\"\nslow = \"most_slip_mps > 1\"";
    fs::write(&path, format!("{head}[study.events]\n{events}\n")).unwrap();
    Template::load(&path).unwrap()
}

pub fn row(index: u64, status: Status, figures: Value) -> Row {
    let sample = ScenarioSample {
        index,
        ..ScenarioSample::default()
    };
    let mut row = Row::without_figures(&sample, status, "why".into());
    row.figures = figures.as_object().unwrap().clone();
    row
}

/// Of 20 runs three hit, and five came to no end: one failed after it had hit at full speed, one
/// crashed, one could not be drawn, two lack the figures.
fn rows() -> Vec<Row> {
    let stopped = |k: u64| json!({"collision": false, "impact_speed_mps": 0.0, "stop_margin_m": 10.0 + k as f64});
    let hit =
        |k: u64| json!({"collision": true, "impact_speed_mps": k as f64, "stop_margin_m": -0.5});
    let complete =
        (0..15).map(|k| row(k, Status::Complete, if k < 3 { hit(k) } else { stopped(k) }));
    let rest = [
        row(15, Status::Failed, hit(16)),
        row(16, Status::Crashed, json!({})),
        row(17, Status::Invalid, json!({})),
        row(18, Status::Complete, json!({})),
        row(19, Status::Complete, json!({})),
    ];
    complete.chain(rest).collect()
}

fn figure<'a>(digest: &'a Digest, name: &str) -> &'a FigureDigest {
    digest
        .figures
        .iter()
        .find(|f| f.measure.name == name)
        .unwrap()
}

/// "16 m, of 2 runs" where two of three hit: a mean and a rate over those that came to a good end.
#[test]
fn no_run_is_left_out_of_a_denominator() {
    let base = folder("denominator");
    let digest = Digest::of(&template(&base), &rows());
    fs::remove_dir_all(base).ok();
    assert_eq!((digest.runs, digest.complete), (20, 17));
    let hit = digest.events[0].rate.unwrap();
    assert_eq!((digest.events[0].runs, hit.events, hit.unknown), (20, 3, 5));
    assert!((hit.wilson.value - 0.15).abs() < 1e-12);
    // Wilson's of 3 of 20, and of 8 of 20 (tests/studies/figures.py has the first).
    assert!(
        (hit.wilson.low - 0.0524).abs() < 1e-4 && (hit.wilson.high - 0.6134).abs() < 1e-4,
        "{hit:?}"
    );
    assert!(digest.events[1].rate.is_none(), "nothing is known of it");

    let margin = figure(&digest, "stop_margin_m");
    assert_eq!((margin.runs, margin.lacking), (15, 5));
    assert!((margin.worst.unwrap().value + 0.5).abs() < 1e-12);
    // The run that failed counts here: it is the worst of all.
    let impact = figure(&digest, "impact_speed_mps");
    let worst = impact.worst.unwrap();
    assert_eq!((worst.index, impact.runs, impact.lacking), (15, 15, 5));
    let mean = impact.mean.unwrap();
    assert!(mean.low >= 0.0 && mean.low < mean.value, "{mean:?}");
    let flag = figure(&digest, "collision").mean.unwrap();
    assert!(
        (flag.value - 0.2).abs() < 1e-12 && flag.low > 0.0 && flag.high < 1.0,
        "{flag:?}"
    );
}

/// A figure that is the same wherever it is known, and known in two runs of twenty.
#[test]
fn a_figure_that_most_runs_lack_is_shown() {
    let mut rows = rows();
    for row in &mut rows {
        row.figures.remove("stop_margin_m");
    }
    for k in [4, 5] {
        rows[k].figures.insert("stop_margin_m".into(), json!(16.0));
    }
    let base = folder("lacking");
    let digest = Digest::of(&template(&base), &rows);
    fs::remove_dir_all(base).ok();
    let margin = figure(&digest, "stop_margin_m");
    assert_eq!((margin.runs, margin.lacking), (2, 18));
}

/// A train that leaves the rails at a slab has been run to its end: it counts among the complete runs, as
/// derailed, with its reason.
#[test]
fn a_derailed_run_counts() {
    let base = crate::program::folder("derailed");
    fs::create_dir_all(&base).unwrap();
    let path = base.join("derailed.toml");
    let text = format!(
        r#"
        name = "derailed"
        tunnel = "{}/tunnels/chengdu_line1.toml"
        duration_s = 2.0
        train = {{ cars = 1, start_chainage_m = 350.0, start_speed_kmh = 160.0, cruise_speed_kmh = 160.0 }}
        [[track.defects]]
        chainage_m = 380.0
        side = "left"
        shape = {{ kind = "slab", depth_m = 0.05, length_m = 10.0, ramp_m = 0.5 }}
        [study.variables.depth_m]
        keys = ["track.defects[0].shape.depth_m"]
        from = {{ sweep = {{ values = [0.0, 0.05] }} }}
        [study.events]
        off_the_rails = "derailed"
        "#,
        env!("CARGO_MANIFEST_DIR")
    );
    fs::write(&path, text).unwrap();
    let template = Template::load(&path).unwrap();
    let mut runner = ScenarioRunner::new(RendererChoice::Cpu);
    let rows = [0, 1].map(|index| runner.run(&template, index));
    fs::remove_dir_all(base).ok();
    let [whole, derailed] = &rows;
    assert_eq!((whole.status, &whole.reason), (Status::Complete, &None));
    assert_eq!(derailed.status, Status::Complete, "{:?}", derailed.reason);
    assert!(derailed.reason.as_ref().unwrap().contains("left the rails"));
    assert_eq!(derailed.figures["derailed"], json!(true));
    let digest = Digest::of(&template, &rows);
    let rate = digest.events[0].rate.unwrap();
    assert_eq!((digest.complete, rate.events, rate.unknown), (2, 1, 0));
}

/// The errors of the rig, of the sensors' clocks and of the survey are drawn in each run; those that the stack has
/// a sigma for, half as wide again. Provokes a study of accuracy with one rig, or with what sigma is made of.
#[test]
fn the_study_of_accuracy_draws_more_than_is_believed() {
    let template = Template::load(Path::new("scenarios/studies/led_accuracy.toml")).unwrap();
    let variables = &template.settings.variables;
    let sigma_of = |key: &str| {
        let drawn = variables.values().find(|v| v.keys.iter().any(|k| k == key));
        match drawn.map(|v| &v.from) {
            Some(Distribution::Normal { sigma, .. }) => *sigma,
            other => panic!("{key}: {other:?}"),
        }
    };
    let error = |name: &str| sigma_of(&format!("rig.calibration_error.{name}"));
    let file = &template.file;
    let believed = &file.stack.led;
    let rig = file.rig.as_ref().unwrap();
    for (drawn, believed) in [
        (error("vergence_deg"), believed.vergence_sigma_deg),
        (error("yaw_deg"), believed.mount_sigma_deg),
        (error("pitch_deg"), believed.mount_sigma_deg),
        (error("baseline_mm"), believed.baseline_sigma_mm),
        (
            error("focal_length_mm"),
            believed.focal_sigma_share * rig.focal_length_mm,
        ),
        (file.survey.along_sigma_m, believed.survey_sigma_m),
    ] {
        assert!(drawn >= 1.4999 * believed, "{drawn} of {believed}");
    }
    // A middle that is too high is a pitch, and the rig's lens is straight.
    let left_out = ["principal_v_px", "k1"];
    let errors = toml::Table::try_from(RigError::default()).unwrap();
    for name in errors
        .keys()
        .filter(|name| !left_out.contains(&name.as_str()))
    {
        assert!(error(name) > 0.0, "{name}");
    }
    for clock in ["rig", "imu", "odometer"] {
        assert!(sigma_of(&format!("{clock}.clock.offset_ms")) >= 1.0);
    }
    let survey = &file.survey;
    for sigma in [
        survey.across_sigma_m,
        survey.height_sigma_m,
        survey.control_sigma_m,
        survey.cant_sigma_mm,
        survey.balise_sigma_m,
    ] {
        assert!(sigma > 0.0);
    }
}

/// Quantiles of three runs: what cannot be bounded ends where the figure does, not outside.
#[test]
fn quantiles_stay_where_the_figure_can_be() {
    let base = folder("quantiles");
    let figures = |k: u64| {
        let k = k as f64;
        json!({"paper_availability": 0.9 + 0.04 * k, "paper_error_max_m": 0.1 * (k + 1.0), "stop_error_m": k - 1.0})
    };
    let rows: Vec<Row> = (0..3)
        .map(|k| row(k, Status::Complete, figures(k)))
        .collect();
    let digest = Digest::of(&template(&base), &rows);
    fs::remove_dir_all(base).ok();
    let ends = |name: &str| {
        let median = figure(&digest, name).quantiles[0].unwrap();
        [median.low, median.high].map(|end| {
            if end.is_infinite() {
                end.signum() * 9.0
            } else {
                end
            }
        })
    };
    for (name, [low, high]) in [
        ("paper_availability", [0.0, 1.0]),
        ("paper_error_max_m", [0.0, 9.0]),
        ("stop_error_m", [0.0, 9.0]),
    ] {
        let [a, b] = ends(name);
        assert!(
            (a - low).abs() < 1e-12 && (b - high).abs() < 1e-12,
            "{name}: {a} to {b}"
        );
    }
}

/// Fails where a quantile is of the harmless side: of a margin, a speed, an error with a sign; and of a
/// distance, which has no worse side. A quantile of 0 has no sign.
#[test]
fn quantiles_are_of_the_worse_side() {
    let base = folder("worse");
    let figures = |k: u64| {
        let k = k as f64;
        json!({"stop_margin_m": k, "most_slip_mps": k, "stop_error_m": -k, "run_m": k,
            "paper_availability": (0.01 * k - 0.5).max(0.0)})
    };
    let rows: Vec<Row> = (0..=100)
        .map(|k| row(k, Status::Complete, figures(k)))
        .collect();
    let digest = Digest::of(&template(&base), &rows);
    fs::remove_dir_all(base).ok();
    for (name, expected, worst) in [
        ("stop_margin_m", 5.0, Some(0)),
        ("most_slip_mps", 95.0, Some(100)),
        ("stop_error_m", 95.0, Some(100)),
        ("run_m", 95.0, None),
        ("paper_availability", 0.0, Some(0)),
    ] {
        let figure = figure(&digest, name);
        let [.., q95] = figure.quantiles.map(Option::unwrap);
        assert!(!q95.to_string().contains("-0"), "{name}: {q95}");
        assert!((q95.value - expected).abs() < 1e-12, "{name}: {q95:?}");
        assert!(
            q95.low <= expected && expected <= q95.high,
            "{name}: {q95:?}"
        );
        assert_eq!(figure.worst.map(|w| w.index), worst, "{name}");
    }
}

/// The mark of a study that ended by the precision of a figure, and none of one that ran to its end.
#[test]
fn an_early_stop_is_marked() {
    let base = folder("early");
    let mut template = template(&base).with(None, Some(500));
    fs::remove_dir_all(base).ok();
    let of = "hit".to_owned();
    template.settings.stop.when = Some(PrecisionSettings {
        of,
        half_width: 0.2,
    });
    let hit = |k: u64| json!({"collision": k.is_multiple_of(2)});
    let rows: Vec<Row> = (0..30).map(|k| row(k, Status::Complete, hit(k))).collect();
    let early = Digest::of(&template, &rows).early.unwrap();
    assert_eq!(early.of, "hit");
    assert!(Digest::of(&template, &rows[..20]).early.is_none());
    let whole = template.with(None, Some(15));
    assert_eq!(whole.runs(), 30);
    assert!(Digest::of(&whole, &rows).early.is_none());
}

/// Makes a folder one that a study has left.
pub fn leave(folder: &Path, rows: &[Row]) {
    let lines = rows
        .iter()
        .map(|row| serde_json::to_string(row).unwrap() + "\n");
    fs::write(folder.join("rows.jsonl"), lines.collect::<String>()).unwrap();
    let manifest = json!({
        "metrotwin": "0", "program": "0", "study": SMALL, "inputs": {}, "runs": 20,
        "renderer": {"backend": "cpu", "adapter": "none"}, "shard": null
    });
    fs::write(folder.join(MANIFEST), manifest.to_string()).unwrap();
}

/// What people read says of how many, how many without, and which is the worst; and the mean of few
/// differences of a flag leaves neither -1 nor 1.
#[test]
fn the_page_says_how_many_runs_lack_a_figure() {
    let folders = [folder("page-a"), folder("page-b")];
    let all = rows();
    let mut others = all.clone();
    for row in &mut others {
        (row.figures).insert("collision".into(), json!(row.index != 3));
    }
    for (folder, rows) in folders.iter().zip([&all, &others]) {
        template(folder);
        leave(folder, rows);
    }
    let study = Study::open(&folders[0]).unwrap();
    let mut digest = Digest::of(&study.template, &all);
    digest.early = Some(EarlyStop {
        of: "hit".to_owned(),
        half_width: 0.2,
    });
    let page = fs::read_to_string(report(&study, &digest, &all).unwrap()).unwrap();
    for said in [
        "3 of 20, 5 unknown",
        "ended early",
        ") *</td>",
        ">15</td><td class=\"n\">5</td>",
        "-0.5000 (run 0)",
    ] {
        assert!(page.contains(said), "no `{said}` in the page");
    }
    let found = compare(&folders[0], &folders[1]).unwrap();
    assert_eq!((found.both, found.pairs), (20, 17));
    let mut differences = found.differences.iter();
    let collision = differences.find(|d| d.name == "collision").unwrap();
    let mean = collision.mean;
    assert!(collision.pairs == 15 && mean.high < 1.0, "{mean:?}");
    for folder in folders {
        fs::remove_dir_all(folder).ok();
    }
}
