//! The page as HTML.

use super::plot::Plot;
use crate::scenario::draw::{Template, as_written};
use crate::study::stats::Estimate;
use crate::study::{Digest, Manifest, Row};
use std::fmt::Write;
use std::path::Path;

/// Runs in the table of the worst.
const WORST: usize = 10;

const STYLE: &str = "\
body{font:15px/1.45 system-ui,sans-serif;color:#1c2126;max-width:1180px;margin:2rem auto;padding:0 1rem}\
h1{font-size:1.6rem;margin-bottom:.2rem}h2{font-size:1.15rem;margin:2rem 0 .5rem}\
p.lead{color:#555c64;margin-top:0}table{border-collapse:collapse;margin:.5rem 0;width:100%}\
table{font-size:.88rem}th,td{text-align:left;padding:.25rem .6rem;border-bottom:1px solid #dfe3e8;vertical-align:top}\
th{font-weight:600;background:#f5f7f9}td:first-child{white-space:nowrap}td code{overflow-wrap:anywhere}\
td.n{font-variant-numeric:tabular-nums;white-space:nowrap}\
code{background:#f2f4f6;padding:.1rem .3rem;border-radius:3px;font-size:.85em}\
.plots{display:grid;grid-template-columns:repeat(auto-fit,minmax(480px,1fr));gap:12px}\
.plots figure{margin:0;border:1px solid #dfe3e8;border-radius:4px}\
.plots svg{display:block;width:100%;height:auto}";

pub fn page(
    folder: &Path,
    manifest: &Manifest,
    template: &Template,
    digest: &Digest,
    plots: &[Plot],
    rows: &[Row],
) -> String {
    let title = escaped(&template.file.name);
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>\
         <style>{STYLE}</style></head><body>\n<h1>{title}</h1>\n<p class=\"lead\">{}</p>\n",
        escaped(&template.file.description)
    );
    html += &about(manifest, template, digest);
    html += &events(digest);
    html += &figures(digest);
    html += "<h2>Plots</h2>\n<div class=\"plots\">\n";
    for plot in plots {
        // An identifier would be the same in every plot.
        _ = writeln!(html, "<figure>{}</figure>", plot.svg);
    }
    html += "</div>\n";
    html += &drivers(digest);
    html += &worst(folder, digest, rows);
    html += &failures(folder, rows);
    html + "</body></html>\n"
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// A table of cells; those that begin with a number do not wrap.
fn table(head: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let head: String = head
        .iter()
        .map(|h| format!("<th>{}</th>", escaped(h)))
        .collect();
    let row = |cells: Vec<String>| {
        let is_number = |c: &String| c.starts_with(|c: char| c.is_ascii_digit() || c == '-');
        let cells: String = cells
            .iter()
            .map(|c| {
                format!(
                    "<td{}>{c}</td>",
                    if is_number(c) { " class=\"n\"" } else { "" }
                )
            })
            .collect();
        format!("<tr>{cells}</tr>\n")
    };
    format!(
        "<table><tr>{head}</tr>\n{}</table>\n",
        rows.map(row).collect::<String>()
    )
}

fn about(manifest: &Manifest, template: &Template, digest: &Digest) -> String {
    let settings = &template.settings;
    let mut rows = vec![
        (
            "runs",
            format!(
                "{} of {}, of which {} complete",
                digest.runs,
                template.runs(),
                digest.complete
            ),
        ),
        ("seed", settings.seed.to_string()),
        ("plan", escaped(&as_written(&settings.plan))),
        (
            "renderer",
            escaped(&format!(
                "{}, {}",
                manifest.renderer.backend, manifest.renderer.adapter
            )),
        ),
        (
            "version",
            format!("metrotwin {}", escaped(&manifest.metrotwin)),
        ),
    ];
    if !settings.require.is_empty() {
        let text = format!(
            "{}; {} draws did not meet them",
            settings.require.join("; "),
            digest.rejected
        );
        rows.push(("conditions", escaped(&text)));
    }
    if let Some(n) = digest.effective_runs {
        rows.push((
            "importance sampling",
            format!("the runs are worth {n:.1} unweighed ones"),
        ));
    }
    let variables = settings.variables.iter().map(|(name, v)| {
        vec![
            escaped(name),
            escaped(&v.label),
            escaped(&v.keys.join(", ")),
            format!("<code>{}</code>", escaped(&as_written(&v.from))),
        ]
    });
    table(
        &["study", ""],
        rows.into_iter().map(|(a, b)| vec![a.to_owned(), b]),
    ) + "<h2>What varies</h2>\n"
        + &table(&["variable", "what", "keys", "from"], variables)
}

fn events(digest: &Digest) -> String {
    if digest.events.is_empty() {
        return String::new();
    }
    let rows = digest.events.iter().map(|e| {
        let mut cells = vec![
            escaped(&e.name),
            format!("<code>{}</code>", escaped(&e.condition)),
        ];
        match (&e.weighted, &e.rate) {
            (Some(w), _) => {
                cells.push(w.rate.to_string());
                cells.push(format!(
                    "{} runs, worth {:.1}",
                    w.events, w.effective_events
                ));
                cells.push(String::new());
            }
            (None, Some(r)) => {
                cells.push(r.wilson.to_string());
                cells.push(format!("{} of {}", r.events, r.wilson.n));
                cells.push(r.exact.to_string());
            }
            (None, None) => cells.push("unknown: no run has what it asks for".into()),
        }
        if e.told > 0 && e.told < digest.complete {
            cells[3] += &format!("; {} lack what it asks for", digest.complete - e.told);
        }
        cells
    });
    "<h2>Events</h2>\n<p>Rates with intervals of 95 %: Wilson's, and the exact one of Clopper and \
     Pearson; of weighed runs the normal one.</p>\n"
        .to_owned()
        + &table(
            &["event", "condition", "rate", "seen", "exact interval"],
            rows,
        )
}

fn figures(digest: &Digest) -> String {
    if digest.figures.is_empty() {
        return String::new();
    }
    let rows = digest.figures.iter().map(|f| {
        let cell = |e: &Option<Estimate>| e.map_or(String::new(), |e| e.to_string());
        let mut cells = vec![format!(
            "<span title=\"{}\">{}</span>",
            escaped(f.measure.meaning),
            f.measure.name
        )];
        cells.push(f.measure.unit.to_owned());
        cells.push(f.runs.to_string());
        cells.push(cell(&f.mean));
        cells.extend(f.quantiles.iter().map(cell));
        cells
    });
    "<h2>Figures</h2>\n<p>With intervals of 95 %: of means Student's t, of quantiles order statistics, \
     which hold for any distribution; an end that is inf needs more runs. Figures that only some runs have are over those, as the number of \
     runs says.</p>\n"
        .to_owned()
        + &table(&["figure", "unit", "runs", "mean", "half below", "90 % below", "95 % below"], rows)
}

fn drivers(digest: &Digest) -> String {
    let rows = digest.figures.iter().flat_map(|f| {
        f.drivers.iter().map(|d| {
            vec![
                f.measure.name.to_owned(),
                escaped(&d.variable),
                d.correlation.map_or(String::new(), |e| e.to_string()),
                d.first_order.map_or(String::new(), |s| format!("{s:.2}")),
            ]
        })
    });
    let rows: Vec<_> = rows.collect();
    if rows.is_empty() {
        return String::new();
    }
    "<h2>What drives the figures</h2>\n<p>Spearman's rank correlation with its interval of 95 %, and the \
     share of the variance that the variable alone explains (first-order Sobol index, estimated from \
     ranks; scatters by about one over the root of the number of runs; none where conditions, correlations \
     or figures that only some runs have tie the variables together, nor of fewer than ten runs).</p>\n"
        .to_owned()
        + &table(&["figure", "variable", "rank correlation", "first-order share"], rows.into_iter())
}

/// By the first figure that is an error, a latency or a margin.
fn worst(folder: &Path, digest: &Digest, rows: &[Row]) -> String {
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
    let found = JUDGED.iter().find(|(name, _)| varies(name));
    let Some((name, sign)) = found else {
        return String::new();
    };
    let mut judged: Vec<_> = rows
        .iter()
        .filter_map(|r| Some((r.number(name)?, r)))
        .collect();
    judged.sort_by(|a, b| (sign * b.0).total_cmp(&(sign * a.0)));
    let rows = judged.iter().take(WORST).map(|(x, row)| {
        let values = row.values.iter().map(|(n, v)| format!("{n} {}", short(v)));
        vec![
            row.index.to_string(),
            format!("{x:.4}"),
            escaped(&values.collect::<Vec<_>>().join(", ")),
            replay(folder, row),
        ]
    });
    format!("<h2>Worst runs by {name}</h2>\n")
        + &table(&["run", name, "drawn", "run it again"], rows)
}

fn short(value: &serde_json::Value) -> String {
    match value.as_f64() {
        Some(x) if !value.is_i64() => format!("{x:.4}"),
        _ => value.to_string(),
    }
}

fn replay(folder: &Path, row: &Row) -> String {
    let folder = escaped(&folder.display().to_string());
    format!(
        "<code>metrotwin run --from-study {folder} --index {}</code>",
        row.index
    )
}

fn failures(folder: &Path, rows: &[Row]) -> String {
    let failed: Vec<_> = rows.iter().filter(|r| !r.is_complete()).collect();
    if failed.is_empty() {
        return String::new();
    }
    let rows = failed.iter().map(|row| {
        let reason = row.reason.as_deref().unwrap_or_default();
        vec![
            row.index.to_string(),
            row.status.name().into(),
            escaped(reason),
            replay(folder, row),
        ]
    });
    format!("<h2>{} runs that are not complete</h2>\n", failed.len())
        + &table(&["run", "how", "why", "run it again"], rows)
}
