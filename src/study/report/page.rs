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
    /// Large is bad, or small.
    const JUDGED: [(&str, f64); 7] = [
        ("impact_speed_mps", 1.0),
        ("stop_margin_m", -1.0),
        ("paper_error_max_m", 1.0),
        ("missed", 1.0),
        ("detection_latency_s", 1.0),
        ("stop_error_m", 1.0),
        ("most_slip_mps", 1.0),
    ];
    let varies = |name: &str| digest.figures.iter().any(|f| f.measure.name == name);
    let (figure, sign) = JUDGED.into_iter().find(|(name, _)| varies(name))?;
    let runs = rows.iter().filter_map(|row| {
        let values = row.values.iter().map(|(n, v)| format!("{n} {}", short(v)));
        Some(WorstRun {
            index: row.index,
            value: row.number(figure)?,
            drawn: values.collect::<Vec<_>>().join(", "),
        })
    });
    let mut runs: Vec<_> = runs.collect();
    runs.sort_by(|a, b| (sign * b.value).total_cmp(&(sign * a.value)));
    runs.truncate(WORST);
    Some(Worst { figure, runs })
}

fn short(value: &Value) -> String {
    match value.as_f64() {
        Some(x) if !value.is_i64() => format!("{x:.4}"),
        _ => value.to_string(),
    }
}
