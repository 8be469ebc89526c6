//! Series over time: speeds, position errors, vibration, distances.

use super::files::failed;
use super::stream::Stream;
use super::{Contents, palette, slug};
use crate::bus::{
    DopplerSample, Frame, LedReport, Method, OdometerSample, ProtectionReport, SimTime,
    WaysideReport,
};
use crate::session::ObserverError;
use crate::twin::physics::TrainState;
use rerun::external::re_sdk_types::blueprint::components::Corner2D;
use rerun::{Color, Scalars, SeriesLines};
use std::collections::BTreeMap;

const KMH: f64 = 3.6;
const MM: f64 = 1000.0;
const US: f64 = 1e6;
const KN: f64 = 1000.0;

/// Series that share a pane.
pub(super) struct Group {
    /// What the pane shows, with its unit.
    pub(super) title: &'static str,
    /// Over its series.
    pub(super) origin: &'static str,
    /// Where the legend covers least.
    pub(super) legend: Corner2D,
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

const EMERGENCY: Line = line("plots/speed/emergency", "emergency", (255, 70, 70), 1.5);
const SERVICE: Line = line("plots/speed/service", "service", (255, 170, 60), 1.5);
const PERMITTED: Line = line("plots/speed/permitted", "permitted", (235, 225, 100), 1.5);
const ODOMETER: Line = line("plots/speed/odometer", "odometer", (120, 180, 255), 1.0);
/// Of the trains that have one.
const RADAR: Line = line("plots/speed/radar", "radar", (220, 130, 255), 1.0);
const ESTIMATED: Line = line("plots/speed/estimated", "estimated", (90, 230, 120), 2.0);
const TRUE: Line = line("plots/speed/true", "true", (240, 240, 240), 2.0);

const SPEED: Group = Group {
    title: "Speed, km/h",
    origin: "plots/speed",
    legend: Corner2D::LeftBottom,
    lines: &[
        EMERGENCY, SERVICE, PERMITTED, ODOMETER, RADAR, ESTIMATED, TRUE,
    ],
};

const FLOOR_VERTICAL: Line = line("plots/vibration/vertical", "vertical", (120, 180, 255), 1.0);
const FLOOR_LATERAL: Line = line("plots/vibration/lateral", "lateral", (255, 170, 60), 1.0);

const VIBRATION: Group = Group {
    title: "Floor acceleration, m/s²",
    origin: "plots/vibration",
    legend: Corner2D::RightTop,
    lines: &[FLOOR_VERTICAL, FLOOR_LATERAL],
};

const PRIMARY: Line = line(
    "plots/suspension/primary",
    "primary, first axle",
    (90, 200, 255),
    1.0,
);
const SECONDARY: Line = line(
    "plots/suspension/secondary",
    "secondary over it",
    (170, 220, 130),
    1.5,
);

const SUSPENSION: Group = Group {
    title: "Suspension travel, mm",
    origin: "plots/suspension",
    legend: Corner2D::RightTop,
    lines: &[PRIMARY, SECONDARY],
};

const LEFT: Line = line("plots/wheels/left", "normal, left", (120, 180, 255), 1.0);
const RIGHT: Line = line("plots/wheels/right", "normal, right", (255, 170, 60), 1.0);
const LATERAL: Line = line("plots/wheels/lateral", "lateral", (170, 220, 130), 1.0);
const ALONG: Line = line("plots/wheels/along", "along", (240, 240, 240), 1.0);

const WHEELS: Group = Group {
    title: "Wheel forces, first axle, kN",
    origin: "plots/wheels",
    legend: Corner2D::RightTop,
    lines: &[LEFT, RIGHT, LATERAL, ALONG],
};

const MOST_SLIP: Line = line("plots/slip/most", "most of all axles", (255, 170, 60), 1.0);
const FIRST_SLIP: Line = line("plots/slip/first", "first axle", (120, 180, 255), 1.0);

const SLIP: Group = Group {
    title: "Slip of the wheels, m/s",
    origin: "plots/slip",
    legend: Corner2D::LeftTop,
    lines: &[MOST_SLIP, FIRST_SLIP],
};

const FIRST_COUPLER: Line = line("plots/couplers/first", "first", (120, 180, 255), 1.0);
const LAST_COUPLER: Line = line("plots/couplers/last", "last", (255, 170, 60), 1.0);

const COUPLERS: Group = Group {
    title: "Pull of the couplers, kN",
    origin: "plots/couplers",
    legend: Corner2D::RightTop,
    lines: &[FIRST_COUPLER, LAST_COUPLER],
};

const DISPLAY: Line = line(
    "plots/distance/display",
    "driver's display",
    (240, 240, 240),
    2.0,
);

const DISTANCE: Group = Group {
    title: "Distance to obstacle, m",
    origin: "plots/distance",
    legend: Corner2D::LeftBottom,
    lines: &[DISPLAY],
};

/// Of wayside devices or cameras, in turn.
const DEVICE_RGB: [(u8, u8, u8); 4] = [
    (90, 200, 255),
    (255, 170, 60),
    (170, 220, 130),
    (220, 130, 255),
];

const ERROR: Group = Group {
    title: "Position error and ±2σ, m",
    origin: "plots/position_error",
    legend: Corner2D::RightTop,
    lines: &[],
};

const EXPOSURE: Group = Group {
    title: "Exposure, µs",
    origin: "plots/exposure",
    legend: Corner2D::RightTop,
    lines: &[],
};

const GAIN: Group = Group {
    title: "Gain, dB",
    origin: "plots/gain",
    legend: Corner2D::RightTop,
    lines: &[],
};

/// What the rig is called among cameras; both eyes are exposed alike.
pub(super) const RIG_CAMERA: &str = "rig";

/// The plots of a run by panes; plots of one pane are its tabs.
pub(super) fn panes(contents: &Contents) -> Vec<Vec<Group>> {
    let mut panes = Vec::new();
    if contents.train {
        panes.push(vec![SPEED]);
    }
    if contents.rig {
        panes.push(vec![ERROR]);
    }
    if !contents.devices.is_empty() {
        panes.push(vec![DISTANCE]);
    }
    if let Some(last) = panes.last_mut().filter(|_| contents.cameras().count() > 0) {
        last.extend([EXPOSURE, GAIN]);
    }
    if contents.train {
        let cameras = contents.rig || !contents.devices.is_empty();
        match cameras {
            true => panes.push(vec![VIBRATION, SUSPENSION, WHEELS, SLIP, COUPLERS]),
            // There is room.
            false => panes.extend([
                vec![VIBRATION, SUSPENSION],
                vec![WHEELS],
                vec![SLIP, COUPLERS],
            ]),
        }
    }
    panes
}

/// Values of one series that wait to be sent.
struct Series {
    times_ns: Vec<i64>,
    values: Vec<f64>,
    /// The last value said "nothing".
    gap: bool,
}

/// The series of a recording.
pub(super) struct Plots {
    series: BTreeMap<String, Series>,
    /// Distances by the wayside devices: along the line, and by the paper's formula.
    devices: Vec<[String; 2]>,
}

impl Plots {
    /// Names and colours the series.
    pub(super) fn open(stream: &Stream, contents: &Contents) -> Result<Self, ObserverError> {
        for line in panes(contents)
            .iter()
            .flatten()
            .flat_map(|group| group.lines)
            .filter(|line| contents.radar || line.path != RADAR.path)
        {
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
            for method in Method::ALL {
                let [error, upper, lower] = error_paths(method);
                let name = error.rsplit('/').next().unwrap_or(error);
                let colour = palette::method(method);
                let [r, g, b, _] = colour.to_array();
                let faint = Color::from_rgb(r / 2, g / 2, b / 2);
                style(stream, error, name, colour, 1.5)?;
                // One entry of the legend for both.
                for bound in [upper, lower] {
                    style(stream, bound, &format!("{name} 2σ"), faint, 1.0)?;
                }
            }
        }
        let devices = contents.devices.iter();
        let devices: Vec<_> = devices.map(|name| distance_paths(name)).collect();
        for (k, ([line, formula], name)) in devices.iter().zip(&contents.devices).enumerate() {
            let (r, g, b) = DEVICE_RGB[k % DEVICE_RGB.len()];
            let faint = Color::from_rgb(r / 2, g / 2, b / 2);
            style(stream, line, name, Color::from_rgb(r, g, b), 1.5)?;
            style(stream, formula, &format!("{name}, formula"), faint, 1.5)?;
        }
        for (k, camera) in contents.cameras().enumerate() {
            let (r, g, b) = DEVICE_RGB[k % DEVICE_RGB.len()];
            for path in taken_paths(camera) {
                style(stream, &path, camera, Color::from_rgb(r, g, b), 1.5)?;
            }
        }
        Ok(Self {
            series: BTreeMap::new(),
            devices,
        })
    }

    /// True speed and shaking.
    pub(super) fn train(&mut self, truth: &TrainState) {
        let t = truth.time;
        self.push(&TRUE, t, truth.speed_mps * KMH);
        self.push(&FLOOR_VERTICAL, t, truth.floor_accel_mps2.z);
        self.push(&FLOOR_LATERAL, t, truth.floor_accel_mps2.y);
        self.push(&PRIMARY, t, truth.primary_travel_m * MM);
        self.push(&SECONDARY, t, truth.secondary_travel_m * MM);
        self.wheels(truth);
        for (line, pull) in [
            (&FIRST_COUPLER, truth.couplers_n.first()),
            (&LAST_COUPLER, truth.couplers_n.last()),
        ] {
            if let Some(pull_n) = pull {
                self.push(line, t, pull_n / KN);
            }
        }
    }

    /// What the rails do to the first axle, and how the wheels slip.
    fn wheels(&mut self, truth: &TrainState) {
        let Some(first) = truth.wheels.first() else {
            return;
        };
        let t = truth.time;
        let slips = truth.wheels.iter().map(|w| w.slip_mps);
        let most = slips.fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        let [left_n, right_n] = first.normal_n;
        self.push(&LEFT, t, left_n / KN);
        self.push(&RIGHT, t, right_n / KN);
        self.push(&LATERAL, t, first.lateral_n / KN);
        self.push(&ALONG, t, first.along_n / KN);
        self.push(&FIRST_SLIP, t, first.slip_mps);
        self.push(&MOST_SLIP, t, most);
    }

    /// Speed of the wheels.
    pub(super) fn odometer(&mut self, sample: &OdometerSample) {
        let speed_kmh = sample.speed_mps * KMH;
        self.push(&ODOMETER, sample.time, speed_kmh);
    }

    /// Speed over ground, where it is measured.
    pub(super) fn doppler(&mut self, sample: &DopplerSample) {
        let speed_kmh = sample.speed_mps.map(|v| v * KMH);
        push_or_gap(&mut self.series, RADAR.path, sample.time, speed_kmh);
    }

    /// What the protection holds the speed against.
    pub(super) fn protection(&mut self, report: &ProtectionReport) {
        let t = report.time;
        self.push(&ESTIMATED, t, report.speed_mps * KMH);
        self.push(&PERMITTED, t, report.permitted_mps * KMH);
        self.push(&SERVICE, t, report.service_mps * KMH);
        self.push(&EMERGENCY, t, report.emergency_mps * KMH);
        push_or_gap(
            &mut self.series,
            DISPLAY.path,
            t,
            report.display.distance_to_obstacle_m,
        );
    }

    /// How far each fix is from the truth at its time.
    pub(super) fn fixes(&mut self, report: &LedReport, true_chainages_m: &[f64]) {
        for (fix, true_m) in report.fixes.iter().zip(true_chainages_m) {
            let bound_m = 2.0 * fix.sigma_m;
            let values_m = [fix.chainage_m - true_m, bound_m, -bound_m];
            for (path, value_m) in error_paths(fix.method).into_iter().zip(values_m) {
                push_or_gap(&mut self.series, path, fix.time, Some(value_m));
            }
        }
    }

    /// How far a wayside device takes the train to be from the obstacle.
    pub(super) fn wayside(&mut self, device: usize, report: &WaysideReport) {
        let Some([line, formula]) = self.devices.get(device) else {
            return;
        };
        let t = report.time;
        push_or_gap(&mut self.series, line, t, report.train_distance_exact_m);
        push_or_gap(&mut self.series, formula, t, report.train_distance_m);
    }

    /// What a camera says it took a frame with.
    pub(super) fn taken(&mut self, camera: &str, frame: &Frame) {
        let values = [frame.exposure_s * US, frame.gain_db];
        for (path, value) in taken_paths(camera).into_iter().zip(values) {
            push_or_gap(&mut self.series, &path, frame.start, Some(value));
        }
    }

    /// Sends the values kept.
    pub(super) fn flush(&mut self, stream: &Stream) -> Result<(), ObserverError> {
        for (path, series) in &mut self.series {
            if series.times_ns.is_empty() {
                continue;
            }
            let columns = Scalars::new(series.values.drain(..))
                .columns_of_unit_batches()
                .map_err(failed(path.as_str()))?;
            stream.columns(path, &series.times_ns, columns)?;
            series.times_ns.clear();
        }
        Ok(())
    }

    fn push(&mut self, line: &Line, time: SimTime, value: f64) {
        push_or_gap(&mut self.series, line.path, time, Some(value));
    }
}

/// A NaN breaks the line where there is nothing to plot; one is enough, and none at its start.
fn push_or_gap(all: &mut BTreeMap<String, Series>, path: &str, time: SimTime, value: Option<f64>) {
    let Some(series) = all.get_mut(path) else {
        if let Some(value) = value {
            let series = Series {
                times_ns: vec![time.nanos()],
                values: vec![value],
                gap: false,
            };
            all.insert(path.to_owned(), series);
        }
        return;
    };
    if value.is_some() || !series.gap {
        series.times_ns.push(time.nanos());
        series.values.push(value.unwrap_or(f64::NAN));
    }
    series.gap = value.is_none();
}

fn distance_paths(device: &str) -> [String; 2] {
    ["line", "formula"].map(|what| format!("plots/distance/{}/{what}", slug(device)))
}

/// Exposure and gain of a camera.
fn taken_paths(camera: &str) -> [String; 2] {
    ["exposure", "gain"].map(|what| format!("plots/{what}/{}", slug(camera)))
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
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two values with silence before, between and after: the line must break once in each gap
    /// after a value, and not begin with one.
    #[test]
    fn a_gap_is_one_nan() {
        let mut all = BTreeMap::new();
        let said = [None, Some(1.0), None, None, Some(2.0), Some(3.0), None];
        for (k, value) in said.into_iter().enumerate() {
            push_or_gap(&mut all, "x", SimTime::from_secs(k as f64), value);
        }
        let series = &all["x"];
        let times_s: Vec<_> = series.times_ns.iter().map(|t| t / 1_000_000_000).collect();
        assert_eq!(times_s, [1, 2, 4, 5, 6]);
        let gaps: Vec<_> = series.values.iter().map(|v| v.is_nan()).collect();
        assert_eq!(gaps, [false, true, false, false, true]);
    }
}
