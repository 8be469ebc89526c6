//! Plots as SVG.

use plotters::coord::Shift;
use plotters::prelude::*;
use std::error::Error;
use std::ops::Range;

/// Size of a plot, px.
const SIZE: (u32, u32) = (520, 360);
const BLUE: RGBColor = RGBColor(38, 84, 146);
const RED: RGBColor = RGBColor(196, 62, 50);
const GREY: RGBColor = RGBColor(120, 124, 130);

/// One axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// What it shows, with its unit.
    pub label: String,
    /// In powers of ten.
    pub log: bool,
    /// Names of whole numbers 0, 1, ... in place of numbers.
    pub names: Vec<String>,
}

impl Axis {
    /// Of numbers.
    pub fn new(label: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            log: false,
            names: Vec::new(),
        }
    }

    fn place(&self, x: f64) -> f64 {
        if self.log { x.log10() } else { x }
    }

    fn tick(&self, place: f64) -> String {
        if !self.names.is_empty() {
            let near = (place - place.round()).abs() < 1e-6 && place > -0.5;
            let name = near
                .then(|| self.names.get(place.round() as usize))
                .flatten();
            return name.cloned().unwrap_or_default();
        }
        let x = if self.log { 10f64.powf(place) } else { place };
        let digits = if x.abs() < 1e-12 || x.abs() >= 100.0 {
            0
        } else {
            (2.0 - x.abs().log10().floor()).clamp(0.0, 6.0) as usize
        };
        let text = format!("{x:.digits$}");
        if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        }
    }
}

/// A value with its interval at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bar {
    /// Where.
    pub x: f64,
    /// The value.
    pub y: f64,
    /// The interval.
    pub low: f64,
    /// The interval.
    pub high: f64,
}

/// What is drawn, one over the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layers {
    /// Small points.
    pub points: Vec<(f64, f64)>,
    /// Small red points.
    pub marked: Vec<(f64, f64)>,
    /// A line.
    pub line: Vec<(f64, f64)>,
    /// A band about it: x, low, high.
    pub band: Vec<(f64, f64, f64)>,
    /// Values with intervals.
    pub bars: Vec<Bar>,
}

/// A plot as the text of an SVG file; `None` where there is nothing to draw.
pub fn plot(title: &str, axes: [&Axis; 2], layers: &Layers) -> Option<String> {
    let mut svg = String::new();
    let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
    let ranges = ranges(axes, layers)?;
    let drawn = draw(&root, title, axes, ranges, layers);
    drop(root);
    drawn.ok().map(|()| svg)
}

fn ranges(axes: [&Axis; 2], layers: &Layers) -> Option<[Range<f64>; 2]> {
    let of = |axis: &Axis, values: &mut dyn Iterator<Item = f64>| {
        let values = values.map(|v| axis.place(v)).filter(|v| v.is_finite());
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
            (l.min(v), h.max(v))
        });
        if low > high {
            return None;
        }
        let margin = if axis.names.is_empty() {
            0.04 * (high - low).max(1e-9 * high.abs().max(1e-9))
        } else {
            0.5
        };
        Some(low - margin..high + margin)
    };
    let points = || {
        layers
            .points
            .iter()
            .chain(&layers.marked)
            .chain(&layers.line)
    };
    let bars = || layers.bars.iter();
    let x = points()
        .map(|p| p.0)
        .chain(bars().map(|b| b.x))
        .chain(layers.band.iter().map(|b| b.0));
    let ends = bars()
        .flat_map(|b| [b.y, b.low, b.high])
        .chain(layers.band.iter().flat_map(|b| [b.1, b.2]));
    let y = points().map(|p| p.1).chain(ends);
    Some([
        of(axes[0], &mut x.into_iter())?,
        of(axes[1], &mut y.into_iter())?,
    ])
}

fn draw(
    root: &DrawingArea<SVGBackend<'_>, Shift>,
    title: &str,
    [x, y]: [&Axis; 2],
    [xs, ys]: [Range<f64>; 2],
    layers: &Layers,
) -> Result<(), Box<dyn Error>> {
    let fail = |e: DrawingAreaErrorKind<std::io::Error>| e.to_string();
    root.fill(&WHITE).map_err(fail)?;
    let (bottom, top) = (ys.start, ys.end);
    let mut chart = ChartBuilder::on(root)
        .caption(title, ("sans-serif", 15))
        .margin(10)
        .x_label_area_size(42)
        .y_label_area_size(58)
        .build_cartesian_2d(xs, ys)
        .map_err(fail)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(GREY.mix(0.2))
        .x_desc(&x.label)
        .y_desc(&y.label)
        .x_labels(if x.names.is_empty() {
            7
        } else {
            2 * x.names.len() + 1
        })
        .y_labels(6)
        .x_label_formatter(&|v| x.tick(*v))
        .y_label_formatter(&|v| y.tick(*v))
        .label_style(("sans-serif", 12))
        .draw()
        .map_err(fail)?;
    let at = |p: &(f64, f64)| (x.place(p.0), y.place(p.1));
    let cut = |v: f64| y.place(v).clamp(bottom, top);
    let high = layers.band.iter().map(|b| (x.place(b.0), cut(b.2)));
    let low = layers.band.iter().rev().map(|b| (x.place(b.0), cut(b.1)));
    let band: Vec<_> = high.chain(low).collect();
    if !band.is_empty() {
        chart
            .draw_series([Polygon::new(band, BLUE.mix(0.15))])
            .map_err(fail)?;
    }
    for (points, colour, size) in [
        (&layers.points, GREY.mix(0.45), 2),
        (&layers.marked, RED.mix(0.9), 3),
    ] {
        let dots = points
            .iter()
            .map(|p| Circle::new(at(p), size, colour.filled()));
        chart.draw_series(dots).map_err(fail)?;
    }
    let line = layers.line.iter().map(at);
    chart
        .draw_series(LineSeries::new(line, BLUE.stroke_width(2)))
        .map_err(fail)?;
    let bars = layers.bars.iter().map(|b| {
        let style = BLUE.stroke_width(2).filled();
        ErrorBar::new_vertical(
            x.place(b.x),
            cut(b.low),
            y.place(b.y),
            cut(b.high),
            style,
            9,
        )
    });
    chart.draw_series(bars).map_err(fail)?;
    root.present().map_err(fail)?;
    Ok(())
}
