//! Axes of plots: where their ticks are, and what stands at them.

use std::ops::Range;

/// Ticks that an axis of numbers has at most, or one less.
const MOST_TICKS: f64 = 7.0;
/// Over more decades than that, only powers of ten are marked.
const FEW_DECADES: f64 = 2.5;

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

    /// Where a number lies on it.
    pub fn place(&self, x: f64) -> f64 {
        if self.log { x.log10() } else { x }
    }

    /// The part of it that holds all numbers, with a margin; `None` without any.
    pub fn range(&self, numbers: impl Iterator<Item = f64>) -> Option<Range<f64>> {
        let places = numbers.map(|x| self.place(x)).filter(|p| p.is_finite());
        let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| {
            (l.min(p), h.max(p))
        });
        let margin = if self.names.is_empty() {
            0.04 * (high - low).max(1e-9 * high.abs().max(1e-9))
        } else {
            0.5
        };
        (low <= high).then_some(low - margin..high + margin)
    }

    /// Places of its ticks in a range, each with its text.
    pub fn ticks(&self, range: &Range<f64>) -> Vec<(f64, String)> {
        if !self.names.is_empty() {
            return (0u32..).map(f64::from).zip(self.names.clone()).collect();
        }
        let ticks = if self.log {
            decades(range)
        } else {
            steps(range)
        };
        let seen = ticks.into_iter().filter(|(place, _)| range.contains(place));
        seen.collect()
    }
}

/// Whole numbers of a step of 1, 2 or 5 times a power of ten.
fn steps(range: &Range<f64>) -> Vec<(f64, String)> {
    let least = (range.end - range.start) / MOST_TICKS;
    let power = least.log10().floor();
    let factor = [1.0, 2.0, 5.0]
        .into_iter()
        .find(|f| f * 10f64.powf(power) >= least);
    // Ten of it are one of the next.
    let (factor, power) = factor.map_or((1.0, power + 1.0), |f| (f, power));
    let step = factor * 10f64.powf(power);
    let digits = (-power).max(0.0) as usize;
    let (first, last) = ((range.start / step).ceil(), (range.end / step).floor());
    let ticks = (0..=(last - first).max(0.0) as u32).map(|k| {
        let x = (first + f64::from(k)) * step;
        (
            x,
            format!("{:.digits$}", if x.abs() < 0.5 * step { 0.0 } else { x }),
        )
    });
    ticks.collect()
}

fn decades(range: &Range<f64>) -> Vec<(f64, String)> {
    let wide = range.end - range.start > FEW_DECADES;
    let factors: &[f64] = if wide { &[1.0] } else { &[1.0, 2.0, 5.0] };
    let (first, last) = (range.start.floor(), range.end.floor());
    let decades = (0..=(last - first) as u32).map(|k| first + f64::from(k));
    let ticks = decades.flat_map(|decade| {
        let digits = (-decade).max(0.0) as usize;
        factors.iter().map(move |factor| {
            let text = format!("{:.digits$}", factor * 10f64.powf(decade));
            (decade + factor.log10(), text)
        })
    });
    ticks.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(axis: &Axis, range: Range<f64>) -> Vec<String> {
        axis.ticks(&range).into_iter().map(|t| t.1).collect()
    }

    /// Round numbers, as many as fit, each with the digits that it needs.
    #[test]
    fn ticks_are_round() {
        let axis = Axis::new("");
        assert_eq!(
            texts(&axis, -0.04..1.04),
            ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]
        );
        assert_eq!(
            texts(&axis, 99.9..102.6),
            ["100.0", "100.5", "101.0", "101.5", "102.0", "102.5"]
        );
        assert_eq!(texts(&axis, -3.1e-7..3.1e-7).len(), 7);
        let log = Axis {
            log: true,
            ..Axis::new("")
        };
        assert_eq!(texts(&log, -1.3..-0.2), ["0.1", "0.2", "0.5"]);
        assert_eq!(texts(&log, -0.1..3.1), ["1", "10", "100", "1000"]);
        let named = Axis {
            names: vec!["dry".into(), "wet".into()],
            ..Axis::new("")
        };
        assert_eq!(texts(&named, -0.5..1.5), ["dry", "wet"]);
    }
}
