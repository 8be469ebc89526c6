//! Series over time: speeds, position errors, vibration, distances.

use super::stream::{Stream, failed};
use super::{Contents, palette};
use crate::bus::{LedReport, Method, ProtectionReport, SimTime, WaysideReport};
use crate::session::{ObserverError, TrainTruth};
use rerun::{Color, Scalars, SeriesLines};
use std::collections::BTreeMap;

const KMH: f64 = 3.6;
const MM: f64 = 1000.0;

/// Series that share a pane.
pub(super) struct Group {
    /// What the pane shows, with its unit.
    pub(super) title: &'static str,
    /// Over its series.
    pub(super) origin: &'static str,
    lines: &'static [Line],
}

struct Line {
    path: &'static str,
    name: &'static str,
    rgb: (u8, u8, u8),
    width: f32,
}

const fn line(path: &'static str, name: &'static str, rgb: (u8, u8, u8), width: f32) -> Line {
    Line {
        path,
        name,
        rgb,
        width,
    }
}

const SPEED: Group = Group {
    title: "Speed, km/h",
    origin: "plots/speed",
    lines: &[
        line(
            "plots/speed/emergency",
            "emergency brake",
            (255, 70, 70),
            1.5,
        ),
        line("plots/speed/service", "service brake", (255, 170, 60), 1.5),
        line("plots/speed/permitted", "permitted", (235, 225, 100), 1.5),
        line("plots/speed/estimated", "estimated", (90, 230, 120), 2.0),
        line("plots/speed/true", "true", (240, 240, 240), 2.0),
    ],
};

const VIBRATION: Group = Group {
    title: "Floor acceleration, m/s²",
    origin: "plots/vibration",
    lines: &[
        line("plots/vibration/vertical", "vertical", (120, 180, 255), 1.0),
        line("plots/vibration/lateral", "lateral", (255, 170, 60), 1.0),
    ],
};

const SUSPENSION: Group = Group {
    title: "Suspension travel, mm",
    origin: "plots/suspension",
    lines: &[line(
        "plots/suspension/travel",
        "secondary, front bogie",
        (170, 220, 130),
        1.5,
    )],
};

const DISTANCE: Group = Group {
    title: "Distance to obstacle, m",
    origin: "plots/distance",
    lines: &[
        line(
            "plots/distance/formula",
            "wayside, formula",
            (255, 170, 60),
            1.5,
        ),
        line(
            "plots/distance/alignment",
            "wayside, along the line",
            (90, 200, 255),
            1.5,
        ),
        line(
            "plots/distance/display",
            "driver's display",
            (240, 240, 240),
            2.0,
        ),
    ],
};

const ERROR: Group = Group {
    title: "Position error and 2σ bounds, m",
    origin: "plots/position_error",
    lines: &[],
};

/// The plots of a run, in the order of their panes.
pub(super) fn groups(contents: &Contents) -> Vec<Group> {
    let mut groups = Vec::new();
    if contents.train {
        groups.push(SPEED);
    }
    if contents.rig {
        groups.push(ERROR);
    }
    if !contents.devices.is_empty() {
        groups.push(DISTANCE);
    }
    if contents.train {
        groups.push(VIBRATION);
        groups.push(SUSPENSION);
    }
    groups
}

/// Values of one series that wait to be sent.
#[derive(Default)]
struct Series {
    times_ns: Vec<i64>,
    values: Vec<f64>,
    /// The last value said "nothing".
    gap: bool,
}

/// The series of a recording.
pub(super) struct Plots {
    series: BTreeMap<&'static str, Series>,
}

impl Plots {
    /// Names and colours the series.
    pub(super) fn open(stream: &Stream, contents: &Contents) -> Result<Self, ObserverError> {
        for line in groups(contents).iter().flat_map(|group| group.lines) {
            let (r, g, b) = line.rgb;
            style(
                stream,
                line.path,
                line.name,
                Color::from_rgb(r, g, b),
                line.width,
            )?;
        }
        if contents.rig {
            for method in [Method::Paper, Method::Mono, Method::Fused] {
                let [error, upper, lower] = error_paths(method);
                let name = error.rsplit('/').next().unwrap_or(error);
                let colour = palette::method(method);
                let [r, g, b, _] = colour.to_array();
                let faint = Color::from_rgb(r / 2, g / 2, b / 2);
                style(stream, error, name, colour, 1.5)?;
                style(stream, upper, &format!("{name} +2σ"), faint, 1.0)?;
                style(stream, lower, &format!("{name} -2σ"), faint, 1.0)?;
            }
        }
        Ok(Self {
            series: BTreeMap::new(),
        })
    }

    /// True speed and shaking.
    pub(super) fn train(&mut self, truth: &TrainTruth) {
        let t = truth.time;
        self.push("plots/speed/true", t, truth.speed_mps * KMH);
        self.push("plots/vibration/vertical", t, truth.floor_accel_mps2.z);
        self.push("plots/vibration/lateral", t, truth.floor_accel_mps2.y);
        self.push("plots/suspension/travel", t, truth.secondary_travel_m * MM);
    }

    /// What the protection holds the speed against.
    pub(super) fn protection(&mut self, report: &ProtectionReport) {
        let t = report.time;
        self.push("plots/speed/estimated", t, report.speed_mps * KMH);
        self.push("plots/speed/permitted", t, report.permitted_mps * KMH);
        self.push("plots/speed/service", t, report.service_mps * KMH);
        self.push("plots/speed/emergency", t, report.emergency_mps * KMH);
        self.push_or_gap(
            "plots/distance/display",
            t,
            report.display.distance_to_obstacle_m,
        );
    }

    /// How far each fix is from the truth at its time.
    pub(super) fn fixes(&mut self, report: &LedReport, true_chainages_m: &[f64]) {
        for (fix, true_m) in report.fixes.iter().zip(true_chainages_m) {
            let [error, upper, lower] = error_paths(fix.method);
            self.push(error, fix.time, fix.chainage_m - true_m);
            self.push(upper, fix.time, 2.0 * fix.sigma_m);
            self.push(lower, fix.time, -2.0 * fix.sigma_m);
        }
    }

    /// How far a wayside device takes the train to be from the obstacle.
    pub(super) fn wayside(&mut self, report: &WaysideReport) {
        self.push_or_gap(
            "plots/distance/formula",
            report.time,
            report.train_distance_m,
        );
        self.push_or_gap(
            "plots/distance/alignment",
            report.time,
            report.train_distance_exact_m,
        );
    }

    /// Sends the values kept.
    pub(super) fn flush(&mut self, stream: &Stream) -> Result<(), ObserverError> {
        for (path, series) in &mut self.series {
            if series.times_ns.is_empty() {
                continue;
            }
            let columns = Scalars::new(series.values.drain(..))
                .columns_of_unit_batches()
                .map_err(failed(*path))?;
            stream.columns(path, &series.times_ns, columns)?;
            series.times_ns.clear();
        }
        Ok(())
    }

    fn push(&mut self, path: &'static str, time: SimTime, value: f64) {
        let series = self.series.entry(path).or_default();
        series.times_ns.push(time.nanos());
        series.values.push(value);
        series.gap = value.is_nan();
    }

    /// A NaN breaks the line where there is nothing to plot; one is enough.
    fn push_or_gap(&mut self, path: &'static str, time: SimTime, value: Option<f64>) {
        let in_gap = self.series.get(path).is_none_or(|series| series.gap);
        match value {
            Some(value) => self.push(path, time, value),
            None if !in_gap => self.push(path, time, f64::NAN),
            None => {}
        }
    }
}

fn style(
    stream: &Stream,
    path: &str,
    name: &str,
    colour: Color,
    width: f32,
) -> Result<(), ObserverError> {
    let style = SeriesLines::new()
        .with_names([name])
        .with_colors([colour])
        .with_widths([width]);
    stream.log_static(path, &style)
}

/// Paths of the error and its bounds.
fn error_paths(method: Method) -> [&'static str; 3] {
    match method {
        Method::Paper => [
            "plots/position_error/paper",
            "plots/position_error/paper/upper",
            "plots/position_error/paper/lower",
        ],
        Method::Mono => [
            "plots/position_error/mono",
            "plots/position_error/mono/upper",
            "plots/position_error/mono/lower",
        ],
        Method::Fused => [
            "plots/position_error/fused",
            "plots/position_error/fused/upper",
            "plots/position_error/fused/lower",
        ],
    }
}
