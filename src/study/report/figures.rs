//! Which plots a study gets, and what is in them.

use super::axis::Axis;
use super::plot::{Plot, PlotLayers};
use crate::record::parquet::Kind;
use crate::scenario::sampling::{Condition, Distribution, Template};
use crate::study::stats::{Tally, quantile, rank_correlation};
use crate::study::table::unit_of;
use crate::study::{Digest, FigureDigest, Measure, Row};
use std::collections::BTreeSet;

/// More values than that of a variable are put into bins.
const MOST_GROUPS: usize = 12;
/// Bins of about as many runs each.
const BINS: usize = 8;
/// Variables that a figure is plotted against: those that drive it most.
const MOST_DRIVERS: usize = 4;

/// A variable as the x axis of plots.
struct Input<'a> {
    name: &'a str,
    axis: Axis,
}

impl<'a> Input<'a> {
    fn of(template: &'a Template, name: &'a str, rows: &[&Row]) -> Self {
        let variable = template.settings.variables.get(name);
        let label = variable.map(|v| v.label.as_str()).filter(|l| !l.is_empty());
        let unit = variable.map_or("1", |v| unit_of(name, v));
        let with_unit = if ["1", ""].contains(&unit) {
            name.to_owned()
        } else {
            format!("{name} [{unit}]")
        };
        let mut axis = Axis::new(label.map_or(with_unit, str::to_owned));
        axis.log = matches!(
            variable.map(|v| &v.from),
            Some(Distribution::LogUniform { .. } | Distribution::LogNormal { .. })
        );
        let texts = rows.iter().filter_map(|r| r.values.get(name)?.as_str());
        let texts: BTreeSet<_> = texts.map(str::to_owned).collect();
        axis.names = texts.into_iter().collect();
        Self { name, axis }
    }

    /// Of a run: a number, or which of the names.
    fn value(&self, row: &Row) -> Option<f64> {
        if self.axis.names.is_empty() {
            return row.number(self.name);
        }
        let text = row.values.get(self.name)?.as_str()?;
        Some(self.axis.names.iter().position(|n| n == text)? as f64)
    }

    /// Pairs of the value and of what `of` gives for a run.
    fn pairs<T>(&self, rows: &[&Row], of: impl Fn(&Row) -> Option<T>) -> Vec<(f64, T)> {
        let pairs = rows.iter().filter_map(|r| Some((self.value(r)?, of(r)?)));
        let mut pairs: Vec<_> = pairs.collect();
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        pairs
    }
}

/// Pairs sorted by x in groups: of one value each, or of about as many runs each.
fn groups<T>(pairs: &[(f64, T)]) -> Vec<&[(f64, T)]> {
    let same = |a: &(f64, T), b: &(f64, T)| a.0.total_cmp(&b.0).is_eq();
    if pairs.chunk_by(same).count() <= MOST_GROUPS {
        pairs.chunk_by(same).collect()
    } else {
        pairs.chunks(pairs.len().div_ceil(BINS)).collect()
    }
}

fn middle<T>(group: &[(f64, T)]) -> f64 {
    group.iter().map(|p| p.0).sum::<f64>() / group.len() as f64
}

/// All plots of a study.
pub fn all(template: &Template, digest: &Digest, rows: &[Row]) -> Vec<Plot> {
    let rows: Vec<&Row> = rows.iter().collect();
    let complete: Vec<&Row> = rows.iter().copied().filter(|r| r.is_complete()).collect();
    let names = template.settings.variables.keys();
    let inputs: Vec<_> = names.map(|n| Input::of(template, n, &rows)).collect();
    // Weighed runs lie where they were proposed, not where nature has them: only maps show that.
    let weighted = template.is_weighted();
    let mut plots = Vec::new();
    for (name, condition) in &template.events {
        let happened = || complete.iter().filter_map(|r| r.happened(condition));
        // What never happened, or always, depends on nothing.
        if happened().all(|h| h) || !happened().any(|h| h) {
            continue;
        }
        let groups = inputs.iter().filter(|_| !weighted);
        plots.extend(groups.filter_map(|i| event_plot(i, name, condition, &rows)));
        plots.extend(event_map(&inputs, name, condition, &rows));
    }
    for figure in digest
        .figures
        .iter()
        .filter(|f| is_worth_plotting(f.measure) && !weighted)
    {
        plots.extend(distribution(figure, &complete));
        plots.extend(convergence(figure, &complete));
        let strongest = strongest(figure);
        let shown = inputs
            .iter()
            .filter(|i| strongest.contains(&i.name) || !i.axis.names.is_empty());
        plots.extend(shown.filter_map(|i| figure_plot(i, figure, &complete)));
    }
    for method in ["paper", "mono"].into_iter().filter(|_| !weighted) {
        plots.extend(error_by_range(method, &complete));
    }
    plots
}

/// Figures that users ask for; the rest stand in the tables.
fn is_worth_plotting(measure: &Measure) -> bool {
    const ASKED: [&str; 11] = [
        "paper_error_mean_m",
        "paper_error_max_m",
        "paper_availability",
        "mono_error_mean_m",
        "detection_latency_s",
        "detection_distance_error_m",
        "stop_margin_m",
        "stop_error_m",
        "occupancy_identified_mean_m",
        "occupancy_identified_max_m",
        "occupancy_confident_share",
    ];
    measure.kind == Kind::Real && ASKED.contains(&measure.name)
}

fn strongest(figure: &FigureDigest) -> Vec<&str> {
    let strength = |k: usize| {
        let driver = &figure.drivers[k];
        let rank = driver.correlation.map_or(0.0, |c| c.value.abs());
        rank.max(driver.first_order.unwrap_or(0.0))
    };
    let mut order: Vec<usize> = (0..figure.drivers.len()).collect();
    order.sort_by(|a, b| strength(*b).total_cmp(&strength(*a)));
    let names = order
        .iter()
        .take(MOST_DRIVERS)
        .map(|k| figure.drivers[*k].variable.as_str());
    names.collect()
}

fn label(measure: &Measure) -> String {
    match measure.unit {
        "1" => measure.name.to_owned(),
        unit => format!("{} [{unit}]", measure.name),
    }
}

/// How many runs a plot of a figure lacks, and in how many it is censored.
fn without(figure: &FigureDigest) -> String {
    let (lacking, runs) = (figure.lacking, figure.runs + figure.lacking);
    let lacking = match lacking {
        0 => String::new(),
        _ => format!(", without {lacking} of {runs} runs that lack it"),
    };
    match figure.censored {
        0 => lacking,
        censored => format!("{lacking}, {censored} censored"),
    }
}

/// A figure of a run as a point of a plot.
fn point(row: &Row, measure: &Measure) -> Option<f64> {
    row.number(measure.name).filter(|x| x.is_finite())
}

/// How often an event happens at each value of a variable.
fn event_plot(input: &Input<'_>, name: &str, event: &Condition, rows: &[&Row]) -> Option<Plot> {
    let pairs = input.pairs(rows, |r| Some(r.outcome(event)));
    let bars = groups(&pairs).into_iter().filter_map(|group| {
        let rate = Tally::of(group.iter().map(|p| p.1)).rate()?;
        Some((middle(group), rate.wilson))
    });
    let layers = PlotLayers {
        bars: bars.collect(),
        ..PlotLayers::default()
    };
    let y = Axis::new(format!("rate of {name}, with 95 % interval"));
    let variable = input.name;
    let title = format!("{name} against {variable}");
    layers.plot(
        format!("event_{name}_{variable}"),
        &title,
        [&input.axis, &y],
    )
}

/// Where in the plane of two variables an event happened: the two that drive it most.
fn event_map(inputs: &[Input<'_>], name: &str, event: &Condition, rows: &[&Row]) -> Option<Plot> {
    let strength = |input: &&Input<'_>| {
        let pairs = input.pairs(rows, |r| r.outcome(event).map(f64::from));
        rank_correlation(&pairs).map_or(0.0, |c| c.value.abs())
    };
    let mut order: Vec<_> = inputs.iter().filter(|i| i.axis.names.is_empty()).collect();
    order.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
    let [x, y] = [order.first()?, order.get(1)?];
    let of = |wanted: bool| {
        let runs = rows.iter().filter(|r| r.outcome(event) == Some(wanted));
        runs.filter_map(|r| Some((x.value(r)?, y.value(r)?)))
            .collect::<Vec<_>>()
    };
    let layers = PlotLayers {
        points: of(false),
        marked: of(true),
        ..PlotLayers::default()
    };
    if layers.marked.is_empty() {
        return None;
    }
    let unknown = rows.iter().filter(|r| r.outcome(event).is_none()).count();
    let without = match unknown {
        0 => String::new(),
        n => format!(", without {n} runs that lack what it asks for"),
    };
    let title = format!("{name}: red where it happened{without}");
    layers.plot(format!("map_{name}"), &title, [&x.axis, &y.axis])
}

/// A figure of every run against a variable, with the mean of each group.
fn figure_plot(input: &Input<'_>, figure: &FigureDigest, rows: &[&Row]) -> Option<Plot> {
    let measure = figure.measure;
    let pairs = input.pairs(rows, |r| point(r, measure));
    let bars = groups(&pairs).into_iter().filter_map(|group| {
        let e = measure.mean(&group.iter().map(|p| p.1).collect::<Vec<_>>())?;
        Some((middle(group), e))
    });
    let layers = PlotLayers {
        bars: bars.collect(),
        points: pairs.clone(),
        ..PlotLayers::default()
    };
    let y = Axis::new(label(measure));
    let (name, variable) = (measure.name, input.name);
    let title = format!("{name} against {variable}{}", without(figure));
    layers.plot(format!("{name}_{variable}"), &title, [&input.axis, &y])
}

/// Share of runs that lie below each value.
fn distribution(figure: &FigureDigest, rows: &[&Row]) -> Option<Plot> {
    let measure = figure.measure;
    let mut sample: Vec<f64> = rows.iter().filter_map(|r| r.number(measure.name)).collect();
    sample.sort_by(f64::total_cmp);
    // Censored ones are not below any value.
    let n = sample.len() as f64;
    sample.retain(|x| x.is_finite());
    let share = |k: usize| k as f64 / n;
    let steps = sample
        .iter()
        .enumerate()
        .flat_map(|(k, x)| [(*x, share(k)), (*x, share(k + 1))]);
    // Dvoretzky, Kiefer, Wolfowitz with Massart's constant: the band holds the whole curve.
    let half = ((2f64 / 0.05).ln() / (2.0 * n)).sqrt();
    let band = sample.iter().enumerate().map(|(k, x)| {
        let middle = share(k) + 0.5 / n;
        (*x, (middle - half).max(0.0), (middle + half).min(1.0))
    });
    let layers = PlotLayers {
        line: steps.collect(),
        band: band.collect(),
        ..PlotLayers::default()
    };
    let x = Axis::new(label(measure));
    let y = Axis::new("share of runs below, with 95 % band");
    let name = measure.name;
    let title = format!("Distribution of {name}{}", without(figure));
    layers.plot(format!("{name}_cdf"), &title, [&x, &y])
}

/// The mean after each run, with its interval.
fn convergence(figure: &FigureDigest, rows: &[&Row]) -> Option<Plot> {
    let measure = figure.measure;
    let sample: Vec<f64> = rows.iter().filter_map(|r| point(r, measure)).collect();
    let looks = (4..=sample.len()).step_by((sample.len() / 200).max(1));
    let after = looks.filter_map(|n| Some((n as f64, measure.mean(&sample[..n])?)));
    let after: Vec<_> = after.collect();
    let layers = PlotLayers {
        line: after.iter().map(|(n, e)| (*n, e.value)).collect(),
        band: after.iter().map(|(n, e)| (*n, e.low, e.high)).collect(),
        ..PlotLayers::default()
    };
    let (x, y) = (
        Axis::new("runs"),
        Axis::new(format!("mean of {}", label(measure))),
    );
    let name = measure.name;
    let title = format!("Convergence of {name}{}", without(figure));
    layers.plot(format!("{name}_convergence"), &title, [&x, &y])
}

/// Errors of all positions of all runs against the distance of the lamp.
fn error_by_range(method: &str, rows: &[&Row]) -> Option<Plot> {
    let list = |row: &Row, what: &str| row.numbers(&format!("{method}_fix_{what}_m"));
    let fixes = rows
        .iter()
        .flat_map(|r| list(r, "range").into_iter().zip(list(r, "error")));
    let mut fixes: Vec<(f64, f64)> = fixes.map(|(range, error)| (range, error.abs())).collect();
    if fixes.is_empty() {
        return None;
    }
    fixes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut line = Vec::new();
    let mut band = Vec::new();
    for group in fixes.chunks(fixes.len().div_ceil(20)) {
        let mut errors: Vec<f64> = group.iter().map(|p| p.1).collect();
        errors.sort_by(f64::total_cmp);
        let at = |p| quantile(&errors, p).map_or(f64::NAN, |e| e.value);
        line.push((middle(group), at(0.5)));
        band.push((middle(group), at(0.05), at(0.95)));
    }
    let layers = PlotLayers {
        line,
        band,
        ..PlotLayers::default()
    };
    let x = Axis::new("distance of the lamp [m]");
    let y = Axis::new("error along the track [m]");
    let title = format!("{method}: median error of a position, band 5 to 95 %");
    layers.plot(format!("{method}_error_by_range"), &title, [&x, &y])
}
