//! Series over time: speeds, position errors, vibration, distances.

use super::observer_error::{Result, failed};
use super::stream::RowStream;
use super::{Contents, palette, path_of, slug};
use crate::bus::{
    DopplerSample, Frame, LedReport, Method, OccupancyReport, OdometerSample, ProtectionReport,
    SimTime, TrainId, WaysideReport,
};
use crate::session::OccupancyClass;
use crate::twin::physics::TrainState;
use palette::rgb;
use re_sdk_types::archetypes::{Scalars, SeriesLines};
use re_sdk_types::blueprint::components::Corner2D;
use re_sdk_types::components::Color;
use std::collections::BTreeMap;

const KMH: f64 = 3.6;
const MM: f64 = 1000.0;
const US: f64 = 1e6;
const KN: f64 = 1000.0;

const WHITE: Color = rgb(240, 240, 240);
const RED: Color = rgb(255, 70, 70);
const ORANGE: Color = rgb(255, 170, 60);
const YELLOW: Color = rgb(235, 225, 100);
const GREEN: Color = rgb(90, 230, 120);
const OLIVE: Color = rgb(170, 220, 130);
const CYAN: Color = rgb(90, 200, 255);
const BLUE: Color = rgb(120, 180, 255);
const VIOLET: Color = rgb(220, 130, 255);

/// Series that share a pane.
#[derive(Clone, Copy)]
pub(super) struct PlotGroup {
    /// What the pane shows, with its unit.
    pub(super) title: &'static str,
    /// Over its series.
    pub(super) origin: &'static str,
    /// Where the legend covers least.
    pub(super) legend: Corner2D,
    /// The series that are the same in every run.
    curves: &'static [Curve],
}

impl PlotGroup {
    fn path_of(&self, curve: &Curve) -> String {
        format!("{}/{}", self.origin, curve.path)
    }
}

struct Curve {
    /// Below the group's origin.
    path: &'static str,
    name: &'static str,
    colour: Color,
    width: f32,
    value: ValueOf,
}

/// What a curve's values are taken from.
#[derive(Clone, Copy)]
enum ValueOf {
    Train(fn(&TrainState) -> Option<f64>),
    Odometer(fn(&OdometerSample) -> Option<f64>),
    Radar(fn(&DopplerSample) -> Option<f64>),
    Protection(fn(&ProtectionReport) -> Option<f64>),
    Occupancy(fn(&OccupancyReport) -> Option<f64>),
    Class(fn(OccupancyClass) -> Option<f64>),
}

/// Groups of curves, each with its path, name, colour, width and values.
macro_rules! groups {
    ($($group:ident: $title:literal, $origin:literal, $legend:ident {
        $($path:literal, $name:literal, $colour:ident, $width:literal, $of:ident $value:expr;)*
    })*) => {
        $(const $group: PlotGroup = PlotGroup {
            title: $title,
            origin: $origin,
            legend: Corner2D::$legend,
            curves: &[$(Curve {
                path: $path,
                name: $name,
                colour: $colour,
                width: $width,
                value: ValueOf::$of($value),
            }),*],
        };)*

        const GROUPS: &[PlotGroup] = &[$($group),*];
    };
}

groups! {
    SPEED: "Speed, km/h", "plots/speed", LeftBottom {
        "emergency", "emergency", RED, 1.5, Protection |r| Some(r.emergency_mps * KMH);
        "service", "service", ORANGE, 1.5, Protection |r| Some(r.service_mps * KMH);
        "permitted", "permitted", YELLOW, 1.5, Protection |r| Some(r.permitted_mps * KMH);
        "odometer", "odometer", BLUE, 1.0, Odometer |s| Some(s.speed_mps * KMH);
        "radar", "radar", VIOLET, 1.0, Radar |s| Some(s.speed_mps? * KMH);
        "estimated", "estimated", GREEN, 2.0, Protection |r| Some(r.speed_mps * KMH);
        "true", "true", WHITE, 2.0, Train |t| Some(t.direction.sign() * t.speed_mps * KMH);
    }
    VIBRATION: "Floor acceleration, m/s²", "plots/vibration", RightTop {
        "vertical", "vertical", BLUE, 1.0, Train |t| Some(t.floor_accel_mps2.z);
        "lateral", "lateral", ORANGE, 1.0, Train |t| Some(t.floor_accel_mps2.y);
    }
    SUSPENSION: "Suspension travel, mm", "plots/suspension", RightTop {
        "primary", "primary, first axle", CYAN, 1.0, Train |t| Some(t.primary_travel_m * MM);
        "secondary", "secondary over it", OLIVE, 1.5, Train |t| Some(t.secondary_travel_m * MM);
    }
    WHEELS: "Wheel forces, first axle, kN", "plots/wheels", RightTop {
        "left", "normal, left", BLUE, 1.0, Train |t| Some(t.wheels.first()?.normal_n[0] / KN);
        "right", "normal, right", ORANGE, 1.0, Train |t| Some(t.wheels.first()?.normal_n[1] / KN);
        "lateral", "lateral", OLIVE, 1.0, Train |t| Some(t.wheels.first()?.lateral_n / KN);
        "along", "along", WHITE, 1.0, Train |t| Some(t.wheels.first()?.along_n / KN);
    }
    SLIP: "Slip of the wheels, m/s", "plots/slip", LeftTop {
        "most", "most of all axles", ORANGE, 1.0, Train most_slip_mps;
        "first", "first axle", BLUE, 1.0, Train |t| Some(t.wheels.first()?.slip_mps);
    }
    COUPLERS: "Pull of the couplers, kN", "plots/couplers", RightTop {
        "first", "first", BLUE, 1.0, Train |t| Some(t.couplers_n.first()? / KN);
        "last", "last", ORANGE, 1.0, Train |t| Some(t.couplers_n.last()? / KN);
    }
    DISTANCE: "Distance to obstacle, m", "plots/distance", LeftBottom {
        "display", "driver's display", WHITE, 2.0, Protection |r| r.display.distance_to_obstacle_m;
    }
    TRACK: "Probability of the likeliest track", "plots/track", RightBottom {
        "probability", "probability", GREEN, 2.0, Occupancy |r| Some(r.tracks.first()?.probability);
        "identified", "no other track left", WHITE, 1.0, Occupancy |r| Some(f64::from(u8::from(r.identified)));
    }
    CLASS: "Class of fixes: -3 wrong and sure, 3 right and sure", "plots/class", RightBottom {
        "class", "class", ORANGE, 1.5, Class |class| Some(class_value(class));
    }
    HYPOTHESES: "Hypotheses alive", "plots/hypotheses", RightTop {
        "alive", "alive", CYAN, 1.5, Occupancy |r| Some(f64::from(r.hypotheses));
    }
    ERROR: "Position error and ±2σ, m", "plots/position_error", RightTop {}
    UNSEEN: "Bed not seen, m", "plots/bed_unseen", RightTop {}
    CONTRAST: "Contrast across the track", "plots/track_contrast", RightTop {}
    EXPOSURE: "Exposure, µs", "plots/exposure", RightTop {}
    GAIN: "Gain, dB", "plots/gain", RightTop {}
}

/// Of wayside devices or cameras, in turn.
const DEVICE_COLOURS: [Color; 4] = [CYAN, ORANGE, OLIVE, VIOLET];

/// What the rig is called among cameras; both eyes are exposed alike.
pub(super) const RIG_CAMERA: &str = "rig";

/// Wrong below zero, right over it, the surer the farther; nothing said is zero.
fn class_value(class: OccupancyClass) -> f64 {
    match class {
        OccupancyClass::WrongConfident => -3.0,
        OccupancyClass::WrongFairlyConfident => -2.0,
        OccupancyClass::WrongUndecided => -1.0,
        OccupancyClass::NothingSaid => 0.0,
        OccupancyClass::CorrectUndecided => 1.0,
        OccupancyClass::CorrectFairlyConfident => 2.0,
        OccupancyClass::CorrectConfident => 3.0,
    }
}

fn most_slip_mps(train: &TrainState) -> Option<f64> {
    let slips = train.wheels.iter().map(|w| w.slip_mps.abs());
    slips.reduce(f64::max)
}

/// The plots of a run by panes; plots of one pane are its tabs.
pub(super) fn panes(contents: &Contents) -> Vec<Vec<PlotGroup>> {
    let mut panes = Vec::new();
    if contents.train {
        panes.push(vec![SPEED]);
    }
    if contents.occupancy {
        panes.push(vec![TRACK, CLASS, HYPOTHESES]);
    }
    if contents.rig {
        panes.push(vec![ERROR]);
    }
    if !contents.devices.is_empty() {
        panes.push(vec![DISTANCE, UNSEEN, CONTRAST]);
    }
    if let Some(last) = panes.last_mut().filter(|_| contents.cameras().count() > 0) {
        last.extend([EXPOSURE, GAIN]);
    }
    if contents.train {
        match contents.cameras().count() > 0 {
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
#[derive(Default)]
struct Series {
    times_ns: Vec<i64>,
    values: Vec<f64>,
    /// The last value was none.
    gap: bool,
}

/// The series of a recording.
pub(super) struct Plots {
    stream: RowStream,
    id: TrainId,
    curves: Vec<(String, ValueOf)>,
    series: BTreeMap<String, Series>,
    /// Names of the wayside devices.
    devices: Vec<String>,
}

impl Plots {
    /// Names and colours the series.
    pub(super) fn open(stream: RowStream, contents: &Contents) -> Result<Self> {
        let id = contents.id;
        for group in panes(contents).iter().flatten() {
            let is_there =
                |curve: &&Curve| contents.radar || !matches!(curve.value, ValueOf::Radar(_));
            for curve in group.curves.iter().filter(is_there) {
                let path = path_of(id, &group.path_of(curve));
                style(&stream, &path, curve.name, curve.colour, curve.width)?;
            }
        }
        for method in Method::ALL.into_iter().filter(|_| contents.rig) {
            let (name, colour) = palette::method(method);
            let [error, upper, lower] = error_paths(id, method);
            style(&stream, &error, name, colour, 1.5)?;
            // One entry of the legend for both.
            for bound in [upper, lower] {
                style(&stream, &bound, &format!("{name} 2σ"), faint(colour), 1.0)?;
            }
        }
        for (name, colour) in contents.devices.iter().zip(DEVICE_COLOURS.iter().cycle()) {
            let [line, formula] = distance_paths(name);
            style(&stream, &line, name, *colour, 1.5)?;
            let formula_name = format!("{name}, formula");
            style(&stream, &formula, &formula_name, faint(*colour), 1.5)?;
            for path in bed_paths(name) {
                style(&stream, &path, name, *colour, 1.5)?;
            }
        }
        for (camera, colour) in contents.cameras().zip(DEVICE_COLOURS.iter().cycle()) {
            for path in exposure_paths(id, camera) {
                style(&stream, &path, camera, *colour, 1.5)?;
            }
        }
        let curves = GROUPS.iter().flat_map(|group| {
            let curves = group.curves.iter();
            curves.map(|curve| (path_of(id, &group.path_of(curve)), curve.value))
        });
        Ok(Self {
            stream,
            id,
            curves: curves.collect(),
            series: BTreeMap::new(),
            devices: contents.devices.clone(),
        })
    }

    /// Takes the values of all curves that `of` knows.
    fn push_curves(&mut self, time: SimTime, of: impl Fn(ValueOf) -> Option<Option<f64>>) {
        for (path, value) in &self.curves {
            if let Some(value) = of(*value) {
                push_or_gap(&mut self.series, path, time, value);
            }
        }
    }

    /// The train as it really is.
    pub(super) fn train(&mut self, truth: &TrainState) {
        self.push_curves(truth.time, |value| match value {
            ValueOf::Train(of) => Some(of(truth)),
            _ => None,
        });
    }

    /// Speed of the wheels.
    pub(super) fn odometer(&mut self, sample: &OdometerSample) {
        self.push_curves(sample.time, |value| match value {
            ValueOf::Odometer(of) => Some(of(sample)),
            _ => None,
        });
    }

    /// Speed over ground, where it is measured.
    pub(super) fn doppler(&mut self, sample: &DopplerSample) {
        self.push_curves(sample.time, |value| match value {
            ValueOf::Radar(of) => Some(of(sample)),
            _ => None,
        });
    }

    /// What the protection holds the speed against.
    pub(super) fn protection(&mut self, report: &ProtectionReport) {
        self.push_curves(report.time, |value| match value {
            ValueOf::Protection(of) => Some(of(report)),
            _ => None,
        });
    }

    /// On which track the train takes itself to be.
    pub(super) fn occupancy(&mut self, report: &OccupancyReport, class: Option<OccupancyClass>) {
        self.push_curves(report.time, |value| match value {
            ValueOf::Occupancy(of) => Some(of(report)),
            ValueOf::Class(of) => class.map(of),
            _ => None,
        });
    }

    /// How far each fix is from the truth at its time.
    pub(super) fn fixes(&mut self, report: &LedReport, true_chainages_m: &[f64]) {
        for (fix, true_m) in report.fixes.iter().zip(true_chainages_m) {
            let bound_m = 2.0 * fix.sigma_m;
            let values_m = [fix.chainage_m - true_m, bound_m, -bound_m].map(Some);
            self.push(error_paths(self.id, fix.method), fix.time, values_m);
        }
    }

    /// How far a wayside device takes the train to be from the obstacle, and what it sees of the bed.
    pub(super) fn wayside(&mut self, device: usize, report: &WaysideReport) {
        let Some(name) = self.devices.get(device) else {
            return;
        };
        let (distances, bed) = (distance_paths(name), bed_paths(name));
        let values_m = [report.train_distance_exact_m, report.train_distance_m];
        self.push(distances, report.time, values_m);
        let contrast = report.bed.and_then(|bed| bed.track_contrast);
        let values = [report.bed.map(|bed| bed.unseen_m), contrast];
        self.push(bed, report.time, values);
    }

    /// What a camera says it took a frame with.
    pub(super) fn exposure(&mut self, camera: &str, frame: &Frame) {
        let values = [frame.exposure_s * US, frame.gain_db].map(Some);
        self.push(exposure_paths(self.id, camera), frame.start, values);
    }

    fn push<const N: usize>(
        &mut self,
        paths: [String; N],
        time: SimTime,
        values: [Option<f64>; N],
    ) {
        for (path, value) in paths.iter().zip(values) {
            push_or_gap(&mut self.series, path, time, value);
        }
    }

    /// Sends the values kept.
    pub(super) fn flush(&mut self) -> Result {
        for (path, series) in &mut self.series {
            if series.times_ns.is_empty() {
                continue;
            }
            let columns = Scalars::new(series.values.drain(..))
                .columns_of_unit_batches()
                .map_err(failed(path.as_str()))?;
            self.stream.columns(path, &series.times_ns, columns)?;
            series.times_ns.clear();
        }
        Ok(())
    }
}

/// A NaN breaks the line where there is nothing to plot; one is enough, and none at its start.
fn push_or_gap(all: &mut BTreeMap<String, Series>, path: &str, time: SimTime, value: Option<f64>) {
    if !all.contains_key(path) {
        if value.is_none() {
            return;
        }
        all.insert(path.to_owned(), Series::default());
    }
    let Some(series) = all.get_mut(path) else {
        return;
    };
    if value.is_some() || !series.gap {
        series.times_ns.push(time.nanos());
        series.values.push(value.unwrap_or(f64::NAN));
    }
    series.gap = value.is_none();
}

/// Of the error and its bounds.
fn error_paths(id: TrainId, method: Method) -> [String; 3] {
    let (name, _) = palette::method(method);
    ["", "/upper", "/lower"].map(|end| path_of(id, &format!("plots/position_error/{name}{end}")))
}

/// Of the distance along the line, and by the paper's formula.
fn distance_paths(device: &str) -> [String; 2] {
    ["line", "formula"].map(|what| format!("plots/distance/{}/{what}", slug(device)))
}

/// Of the bed that is not seen, and of the contrast across the track.
fn bed_paths(device: &str) -> [String; 2] {
    ["bed_unseen", "track_contrast"].map(|what| format!("plots/{what}/{}", slug(device)))
}

/// Of exposure and gain.
fn exposure_paths(id: TrainId, camera: &str) -> [String; 2] {
    ["exposure", "gain"].map(|what| path_of(id, &format!("plots/{what}/{}", slug(camera))))
}

fn faint(colour: Color) -> Color {
    let [r, g, b, _] = colour.to_array();
    Color::from_rgb(r / 2, g / 2, b / 2)
}

fn style(stream: &RowStream, path: &str, name: &str, colour: Color, width: f32) -> Result {
    let style = SeriesLines::new()
        .with_names([name])
        .with_colors([colour])
        .with_widths([width]);
    stream.log_static(path, &style)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two values with silence before, between and after: the line must break once in each gap
    /// after a value, and not begin with one.
    #[test]
    fn a_gap_is_one_nan() {
        let mut all = BTreeMap::new();
        let values = [None, Some(1.0), None, None, Some(2.0), Some(3.0), None];
        for (k, value) in values.into_iter().enumerate() {
            push_or_gap(&mut all, "x", SimTime::from_secs(k as f64), value);
        }
        let series = &all["x"];
        let times_s: Vec<_> = series.times_ns.iter().map(|t| t / 1_000_000_000).collect();
        assert_eq!(times_s, [1, 2, 4, 5, 6]);
        let gaps: Vec<_> = series.values.iter().map(|v| v.is_nan()).collect();
        assert_eq!(gaps, [false, true, false, false, true]);
    }
}
