//! Plots as SVG.

use super::axis::Axis;
use crate::study::stats::IntervalEstimate;
use plotters::coord::Shift;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use std::error::Error;
use std::ops::Range;

/// Size of a plot, px.
const SIZE: (u32, u32) = (520, 360);
const BLUE: RGBColor = RGBColor(38, 84, 146);
const RED: RGBColor = RGBColor(196, 62, 50);
const GREY: RGBColor = RGBColor(120, 124, 130);

/// What is drawn, one over the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlotLayers {
    /// Small points.
    pub points: Vec<(f64, f64)>,
    /// Small red points.
    pub marked: Vec<(f64, f64)>,
    /// A line.
    pub line: Vec<(f64, f64)>,
    /// A band about it: x, low, high.
    pub band: Vec<(f64, f64, f64)>,
    /// Values with intervals.
    pub bars: Vec<(f64, IntervalEstimate)>,
}

/// A plot with its file name.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// For its file: small letters, digits, `_`.
    pub name: String,
    /// The picture.
    pub svg: String,
}

impl PlotLayers {
    /// `None` where there is nothing to draw.
    pub fn plot(&self, name: String, title: &str, axes: [&Axis; 2]) -> Option<Plot> {
        let mut svg = String::new();
        let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        let ranges = ranges(axes, self)?;
        let drawn = draw(&root, title, axes, ranges, self);
        drop(root);
        drawn.ok().map(|()| Plot { name, svg })
    }
}

fn ranges([x, y]: [&Axis; 2], layers: &PlotLayers) -> Option<[Range<f64>; 2]> {
    let points = || {
        [&layers.points, &layers.marked, &layers.line]
            .into_iter()
            .flatten()
    };
    let bars = || layers.bars.iter();
    let band = || layers.band.iter();
    let xs = points().map(|p| p.0).chain(bars().map(|b| b.0));
    // An interval from a few runs may end far out: it is cut off where points would be too small to see.
    let seen = y.range(points().map(|p| p.1));
    let (low, high) = seen.map_or((f64::NEG_INFINITY, f64::INFINITY), |r| {
        let width = r.end - r.start;
        (r.start - width, r.end + width)
    });
    let ends = bars().flat_map(|(_, e)| [e.low, e.high]);
    let ends = ends.chain(band().flat_map(|b| [b.1, b.2]));
    let ends = ends.map(|end| end.clamp(low, high));
    let values = bars().map(|(_, e)| e.value);
    Some([
        x.range(xs.chain(band().map(|b| b.0)))?,
        y.range(points().map(|p| p.1).chain(values).chain(ends))?,
    ])
}

/// A range with its ticks.
#[derive(Clone)]
struct Ticked {
    range: Range<f64>,
    ticks: Vec<(f64, String)>,
}

impl Ticked {
    fn new(axis: &Axis, range: Range<f64>) -> Self {
        let ticks = axis.ticks(&range);
        Self { range, ticks }
    }

    fn text(&self, place: f64) -> String {
        let found = self.ticks.iter().find(|t| t.0.total_cmp(&place).is_eq());
        found.map(|t| t.1.clone()).unwrap_or_default()
    }
}

impl Ranged for Ticked {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        RangedCoordf64::from(self.range.clone()).map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.iter().map(|t| t.0).collect()
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

fn draw(
    root: &DrawingArea<SVGBackend<'_>, Shift>,
    title: &str,
    [x, y]: [&Axis; 2],
    [xs, ys]: [Range<f64>; 2],
    layers: &PlotLayers,
) -> Result<(), Box<dyn Error>> {
    let fail = |e: DrawingAreaErrorKind<std::io::Error>| e.to_string();
    root.fill(&WHITE).map_err(fail)?;
    let (bottom, top) = (ys.start, ys.end);
    let (xs, ys) = (Ticked::new(x, xs), Ticked::new(y, ys));
    let mut chart = ChartBuilder::on(root)
        .caption(title, ("sans-serif", 15))
        .margin(10)
        .x_label_area_size(42)
        .y_label_area_size(58)
        .build_cartesian_2d(xs.clone(), ys.clone())
        .map_err(fail)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(GREY.mix(0.2))
        .x_desc(&x.label)
        .y_desc(&y.label)
        .x_label_formatter(&|place| xs.text(*place))
        .y_label_formatter(&|place| ys.text(*place))
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
    // Without a cap at either end: the interval may go on outside of the plot.
    let bars = layers.bars.iter().map(|(at, e)| {
        let ends = [e.low, e.high].map(|end| (x.place(*at), cut(end)));
        PathElement::new(ends, BLUE.stroke_width(2))
    });
    chart.draw_series(bars).map_err(fail)?;
    let values = layers.bars.iter().map(|(at, e)| {
        let place = (x.place(*at), y.place(e.value));
        Circle::new(place, 4, BLUE.filled())
    });
    chart.draw_series(values).map_err(fail)?;
    root.present().map_err(fail)?;
    Ok(())
}
