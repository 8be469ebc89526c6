//! What a study that sweeps a variable comes to for each of its values.

use crate::digest::{folder, leave, row, template};
use crate::program::{run, says, succeeds};
use metrotwin::scenario::sampling::Condition;
use metrotwin::study::{ByValue, Digest, FigureDigest, Row, Status, compare};
use serde_json::{Value, json};
use std::fs;

/// Of each kind of rail three complete runs and one that failed; on dry rails a train hits once in three runs.
fn rows() -> Vec<Row> {
    let dry = [
        json!([10.0, 20.0]),
        json!([60.0]),
        json!([]),
        json!([900.0]),
    ];
    let leaves = [json!([5.0]), json!([5.0]), json!([5.0, 5.0]), json!([])];
    let run = |rail: &str, k: u64, legs_m: &Value| {
        let figures = json!({"occupancy_leg_m": legs_m, "occupancy_switches": k + 1,
            "occupancy_wrong_confident": if rail == "dry" { 2 * k } else { 0 },
            "collision": rail == "dry" && k == 0});
        let status = if k < 3 {
            Status::Complete
        } else {
            Status::Failed
        };
        let mut row = row(2 * k + u64::from(rail != "dry"), status, figures);
        row.values.insert("rail".to_owned(), json!(rail));
        row
    };
    let pairs = (0..4).zip(dry.iter().zip(&leaves));
    pairs
        .flat_map(|(k, (dry, leaves))| [run("dry", k, dry), run("leaf_film", k, leaves)])
        .collect()
}

fn figure<'a>(figures: &'a [ByValue<FigureDigest>], name: &str) -> Option<[&'a FigureDigest; 2]> {
    let figure = figures.iter().find(|figure| figure.name == name)?;
    let [dry, leaves] = &figure.values[..] else {
        panic!("{name}: {} values", figure.values.len());
    };
    assert_eq!((&*dry.value, &*leaves.value), ("dry", "leaf_film"));
    Some([&dry.digest, &leaves.digest])
}

/// Fails where runs of two values are mixed, lists are means of means, counts of failed runs are summed up, or a value
/// is left out because its runs are all alike.
#[test]
fn figures_stand_by_swept_value() {
    let base = folder("swept");
    let rows = rows();
    let digest = Digest::of(&template(&base), &rows);
    assert!(
        digest
            .figures
            .iter()
            .all(|f| f.measure.name != "occupancy_leg_m")
    );
    let [by_rail] = &digest.swept[..] else {
        panic!("{} variables", digest.swept.len());
    };
    assert_eq!(by_rail.variable, "rail");
    let of = |name| figure(&by_rail.figures, name);

    let [dry, leaves] = of("occupancy_leg_m").unwrap();
    assert_eq!((dry.numbers, dry.runs, dry.lacking), (3, 2, 2));
    assert_eq!((leaves.numbers, leaves.runs, leaves.lacking), (4, 3, 1));
    for (figure, mean_m) in [(dry, 30.0), (leaves, 5.0)] {
        assert!((figure.mean.unwrap().value - mean_m).abs() < 1e-12);
    }
    assert_eq!(dry.worst.unwrap().index, 6, "that of the failed run");
    let [dry, leaves] = of("occupancy_wrong_confident").unwrap();
    assert_eq!([dry.sum, leaves.sum], [Some(6.0), Some(0.0)]);
    let [hit, _] = &by_rail.events[..] else {
        panic!("{} events", by_rail.events.len());
    };
    let rates = hit.values.iter().map(|v| v.digest.rate.unwrap());
    let rates: Vec<_> = rates.map(|rate| (rate.events, rate.unknown)).collect();
    assert_eq!(rates, [(1, 1), (0, 1)]);
    fs::remove_dir_all(base).ok();
}

/// The same is printed, and stands on the page.
#[test]
fn a_report_says_it_by_swept_value() {
    let base = folder("swept_report");
    template(&base);
    leave(&base, &rows());
    let report = run(&format!("study report {}", base.display()));
    succeeds(&report);
    says(&report, "by rail");
    says(&report, "; 3 numbers");
    says(&report, "; 6 in all");
    let page = fs::read_to_string(base.join("report.html")).unwrap();
    for said in ["<h2>By rail</h2>", "<td>leaf_film</td>", "30.0"] {
        assert!(page.contains(said), "no `{said}` in the page");
    }
    fs::remove_dir_all(base).ok();
}

/// Fails where a pair of runs, of which one identified its leg and the other never did, is left out of a comparison and
/// nothing says so; or where two that never did are a difference.
#[test]
fn a_comparison_says_what_is_censored_in_one_run() {
    let run_of = |k: u64, legs_m: &[Option<f64>]| {
        let figures = match legs_m[k as usize] {
            Some(leg_m) => {
                json!({"occupancy_identified_max_m": leg_m, "occupancy_never_identified": 0})
            }
            None => json!({"occupancy_never_identified": 1}),
        };
        let mut row = row(k, Status::Complete, figures);
        row.values.insert("rail".to_owned(), json!("dry"));
        row
    };
    let first = [Some(20.0), Some(30.0), None, None, Some(40.0)];
    let second = [Some(21.0), Some(32.0), Some(50.0), None, None];
    let folders = [("censored_a", first), ("censored_b", second)].map(|(name, legs_m)| {
        let base = folder(name);
        template(&base);
        leave(
            &base,
            &(0..5).map(|k| run_of(k, &legs_m)).collect::<Vec<_>>(),
        );
        base
    });
    let found = compare(&folders[0], &folders[1]).unwrap();
    let mut differences = found.differences.iter();
    let leg = differences.find(|d| d.name == "occupancy_identified_max_m");
    let leg = leg.unwrap();
    assert_eq!((found.pairs, leg.pairs, leg.censored), (5, 2, 2));
    assert!((leg.mean.value - 1.5).abs() < 1e-12);
    for folder in folders {
        fs::remove_dir_all(folder).ok();
    }
}

/// Legs that were never identified are in no mean, and in every quantile farther than any distance: of 40 legs three
/// never were, so that the 95 % lies among them and the 90 % does not. One run identified none of its legs.
#[test]
fn what_never_came_about_is_farther_than_any_number() {
    let known_m = |k: u64| 10.0 + k as f64;
    let run_of = |k: u64| {
        let (legs_m, never) = match k {
            18 => (vec![known_m(k)], 1),
            19 => (Vec::new(), 2),
            _ => (vec![known_m(k); 2], 0),
        };
        let mut figures = json!({"occupancy_leg_m": legs_m, "occupancy_never_identified": never});
        if never == 0 {
            figures["occupancy_identified_max_m"] = json!(known_m(k));
        }
        let mut row = row(k, Status::Complete, figures);
        row.values.insert("rail".to_owned(), json!("dry"));
        row
    };
    let rows: Vec<Row> = (0..20).map(run_of).collect();
    let base = folder("never");
    let digest = Digest::of(&template(&base), &rows);
    leave(&base, &rows);
    let report = run(&format!("study report {}", base.display()));
    succeeds(&report);
    says(
        &report,
        "2 of 20 censored (counted as inf, not in the mean)",
    );
    says(&report, "3 of 40 censored");
    let page = fs::read_to_string(base.join("report.html")).unwrap();
    assert!(page.contains("40, 3 censored"), "{page}");
    fs::remove_dir_all(base).ok();
    let of_name = |f: &&FigureDigest| f.measure.name == "occupancy_identified_max_m";
    let most = digest.figures.iter().find(of_name).unwrap();
    assert_eq!((most.runs, most.lacking, most.censored), (20, 0, 2));
    assert!((most.mean.unwrap().value - 18.5).abs() < 1e-9);
    let worst = most.worst.unwrap();
    assert!(worst.value.is_infinite() && worst.index == 18);
    let finite = most.quantiles.map(|q| q.unwrap().value.is_finite());
    assert_eq!(finite, [true, false, false]);

    let mut by_rail = digest.swept[0].figures.iter();
    let legs = by_rail.find(|f| f.name == "occupancy_leg_m");
    let legs = &legs.unwrap().values[0].digest;
    assert_eq!((legs.runs, legs.numbers, legs.censored), (20, 40, 3));
    let expected_m = (2.0 * (0..18).map(known_m).sum::<f64>() + known_m(18)) / 37.0;
    assert!((legs.mean.unwrap().value - expected_m).abs() < 1e-9);
    let finite = legs.quantiles.map(|q| q.unwrap().value.is_finite());
    assert_eq!(finite, [true, true, false]);
    // That it was more than a distance is known of a leg that never was.
    let over = Condition::parse("occupancy_identified_max_m > 1000").unwrap();
    let outcomes = [0, 19].map(|k: usize| rows[k].outcome(&over));
    assert_eq!(outcomes, [Some(false), Some(true)]);
}
