//! The page as HTML: what the template `page.html` shows.

use super::plot::Plot;
use crate::record::render;
use crate::scenario::sampling::{StudySettings, as_written};
use crate::study::{Digest, Manifest, Row, Study};
use minijinja::Error;
use serde::Serialize;
use serde_json::Value;

/// Runs in the table of the worst.
const WORST: usize = 10;

#[derive(Serialize)]
struct Page<'a> {
    title: &'a str,
    description: &'a str,
    folder: String,
    manifest: &'a Manifest,
    settings: &'a StudySettings,
    planned_runs: u64,
    plan: String,
    variables: Vec<Variable<'a>>,
    digest: &'a Digest,
    has_drivers: bool,
    plots: Vec<&'a str>,
    worst: Option<Worst>,
    incomplete: Vec<&'a Row>,
}

#[derive(Serialize)]
struct Variable<'a> {
    name: &'a str,
    label: &'a str,
    keys: &'a [String],
    from: String,
}

/// The worst runs by one figure.
#[derive(Serialize)]
struct Worst {
    figure: &'static str,
    runs: Vec<WorstRun>,
}

#[derive(Serialize)]
struct WorstRun {
    index: u64,
    value: f64,
    drawn: String,
}

/// The page of a study, with its plots.
pub fn page(study: &Study, digest: &Digest, plots: &[Plot], rows: &[Row]) -> Result<String, Error> {
    let settings = &study.template.settings;
    let variables = settings.variables.iter().map(|(name, v)| Variable {
        name,
        label: &v.label,
        keys: &v.keys,
        from: v.from.in_a_line(),
    });
    let page = Page {
        title: &study.template.file.name,
        description: &study.template.file.description,
        folder: study.folder.display().to_string(),
        manifest: &study.manifest,
        settings,
        planned_runs: study.template.runs(),
        plan: as_written(&settings.plan),
        variables: variables.collect(),
        digest,
        has_drivers: digest.figures.iter().any(|f| !f.drivers.is_empty()),
        plots: plots.iter().map(|p| p.svg.as_str()).collect(),
        worst: worst(digest, rows),
        incomplete: rows.iter().filter(|r| !r.is_complete()).collect(),
    };
    render("page.html", include_str!("page.html"), page)
}

/// By the first figure that is an error, a latency or a margin.
fn worst(digest: &Digest, rows: &[Row]) -> Option<Worst> {
    const JUDGED: [&str; 8] = [
        "impact_speed_mps",
        "stop_margin_m",
        "paper_error_max_m",
        "missed",
        "detection_latency_s",
        "occupancy_identified_max_m",
        "stop_error_m",
        "most_slip_mps",
    ];
    let shown = |name| digest.figures.iter().find(|f| f.measure.name == name);
    let measure = JUDGED.into_iter().find_map(shown)?.measure;
    let figure = measure.name;
    let runs = rows.iter().filter_map(|row| {
        let values = row.values.iter().map(|(n, v)| format!("{n} {}", short(v)));
        let value = row.number(figure)?;
        let run = WorstRun {
            index: row.index,
            value,
            drawn: values.collect::<Vec<_>>().join(", "),
        };
        Some((measure.badness(value)?, run))
    });
    let mut runs: Vec<_> = runs.collect();
    runs.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    runs.truncate(WORST);
    let runs = runs.into_iter().map(|(_, run)| run).collect();
    Some(Worst { figure, runs })
}

fn short(value: &Value) -> String {
    match value.as_f64() {
        Some(x) if !value.is_i64() => format!("{x:.4}"),
        _ => value.to_string(),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::scenario::sampling::ScenarioSample;
    use crate::study::{FigureDigest, QUANTILES, Status, WorseSide, measure};
    use serde_json::json;

    /// Fails where a train that stops far too early is no worse than one that stops in place.
    #[test]
    fn the_worst_run_is_that_of_the_digest() {
        let row = |(index, error_m): (u64, f64)| {
            let sample = ScenarioSample {
                index,
                ..ScenarioSample::default()
            };
            let mut row = Row::without_figures(&sample, Status::Complete, String::new());
            row.figures.insert("stop_error_m".into(), json!(error_m));
            row
        };
        let rows: Vec<Row> = [(0, 0.2), (1, -9.0), (2, 3.0)].map(row).into();
        let figure = FigureDigest {
            measure: measure("stop_error_m").unwrap(),
            runs: 3,
            numbers: 3,
            censored: 0,
            sum: None,
            lacking: 0,
            worse_side: WorseSide::Farther,
            worst: None,
            mean: None,
            quantiles: [None; QUANTILES.len()],
            drivers: Vec::new(),
        };
        let digest = Digest {
            runs: 3,
            complete: 3,
            early: None,
            rejected: 0,
            effective_runs: None,
            events: Vec::new(),
            figures: vec![figure],
            unvarying: Vec::new(),
            swept: Vec::new(),
        };
        let worst = worst(&digest, &rows).unwrap();
        let order: Vec<u64> = worst.runs.iter().map(|run| run.index).collect();
        assert_eq!(order, [1, 2, 0]);
    }
}
