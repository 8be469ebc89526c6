//! The figures of a run that a study keeps, each with its unit and meaning.

use super::all_trains::OccupancyOfTrains;
use crate::bus::{Method, TrainId};
use crate::record::parquet::Kind;
use crate::session::{
    ErrorStatistics, Event, Observer, ObserverError, ObstacleScore, OccupancyClass, Summary,
    Wayside,
};
use Kind::{Flag, Int, Real, Reals};
use Method::{Mono, Stereo};
use nalgebra::Vector3;
use serde::Serialize;
use serde_json::{Value, json};

/// One figure.
#[derive(Debug, Serialize)]
pub struct Measure {
    /// Name of its column.
    pub name: &'static str,
    /// What its column holds.
    #[serde(skip)]
    pub kind: Kind,
    /// Its unit; 1 of ratios and counts, `wall s` and the like of what depends on the machine.
    pub unit: &'static str,
    /// What it is.
    pub meaning: &'static str,
    /// Where it comes from; null where a run has none.
    #[serde(skip)]
    pub of: fn(&Summary, &Fixes) -> Value,
}

impl Measure {
    /// Whether it is a time that the machine took: it differs from run to run.
    pub fn is_wall_time(&self) -> bool {
        self.unit.starts_with("wall")
    }
}

/// The measure of a name.
pub fn measure(name: &str) -> Option<&'static Measure> {
    MEASURES.iter().find(|m| m.name == name)
}

/// Every fix of a run: how far the lamp was ahead, and the error.
#[derive(Debug, Default)]
pub struct Fixes {
    of_method: [Vec<(f64, f64)>; 2],
}

impl Observer for Fixes {
    fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
        let Event::Pair {
            train: TrainId(0),
            report,
            true_chainages_m,
            ..
        } = event
        else {
            return Ok(());
        };
        for (fix, truth_m) in report.fixes.iter().zip(*true_chainages_m) {
            let range_m = Vector3::norm(&fix.lamp_in_camera);
            self.of_method[fix.method as usize].push((range_m, fix.chainage_m - truth_m));
        }
        Ok(())
    }
}

impl Fixes {
    fn ranges_m(&self, method: Method) -> Value {
        list(self.of_method[method as usize].iter().map(|fix| fix.0))
    }

    fn errors_m(&self, method: Method) -> Value {
        list(self.of_method[method as usize].iter().map(|fix| fix.1))
    }
}

/// To a hundredth of a millimetre.
fn list(numbers: impl Iterator<Item = f64>) -> Value {
    numbers
        .map(|x| (x * 1e5).round() / 1e5)
        .collect::<Vec<_>>()
        .into()
}

const fn measure_of(
    name: &'static str,
    kind: Kind,
    unit: &'static str,
    meaning: &'static str,
    of: fn(&Summary, &Fixes) -> Value,
) -> Measure {
    Measure {
        name,
        kind,
        unit,
        meaning,
        of,
    }
}

/// A figure of a part of the summary, where a run has that part.
fn of<P, T: Into<Value>>(part: Option<&P>, get: impl Fn(&P) -> Option<T>) -> Value {
    part.and_then(get).map_or(Value::Null, Into::into)
}

fn error(s: &Summary, method: Method, get: fn(&ErrorStatistics) -> f64) -> Value {
    of(s.positioning.get(&method), |p| p.error_m.as_ref().map(get))
}

/// A figure of track occupancy, where a train has it.
fn occupancy<T: Into<Value>>(s: &Summary, get: fn(&OccupancyOfTrains<'_>) -> Option<T>) -> Value {
    let trains = OccupancyOfTrains::of(s.occupancy.as_ref(), &s.trains);
    of(trains.as_ref(), get)
}

fn worst(w: &Wayside, get: fn(&ObstacleScore) -> Option<f64>) -> Option<f64> {
    let all = w.obstacles.iter().filter_map(get);
    all.max_by(|a, b| f64::total_cmp(&a.abs(), &b.abs()))
}

/// The figures of one method of positioning.
macro_rules! positioning {
    ($($method:ident $prefix:literal),*; $($rest:expr),* $(,)?) => {
        &[
            $(
                measure_of(concat!($prefix, "_fixes"), Int, "1",
                    "positions given", |s, _| of(s.positioning.get(&$method), |p| Some(p.fixes))),
                measure_of(concat!($prefix, "_availability"), Real, "1",
                    "positions a pair of images", |s, _| of(s.positioning.get(&$method), |p| p.availability)),
                measure_of(concat!($prefix, "_uid_decode_rate"), Real, "1",
                    "share of the lamps passed whose name was read",
                    |s, _| of(s.positioning.get(&$method), |p| p.uid_decode_rate)),
                measure_of(concat!($prefix, "_wrong_uid"), Int, "1",
                    "positions that rest on the wrong lamp",
                    |s, _| of(s.positioning.get(&$method), |p| Some(p.wrong_uid))),
                measure_of(concat!($prefix, "_error_mean_m"), Real, "m",
                    "error along the track, without sign, mean of the run's positions",
                    |s, _| error(s, $method, |e| e.mean)),
                measure_of(concat!($prefix, "_error_p95_m"), Real, "m",
                    "95 % of the run's positions are nearer", |s, _| error(s, $method, |e| e.p95)),
                measure_of(concat!($prefix, "_error_max_m"), Real, "m",
                    "largest error of the run", |s, _| error(s, $method, |e| e.max)),
                measure_of(concat!($prefix, "_nees_mean"), Real, "1",
                    "mean of (error / sigma)^2: 1 for an honest sigma",
                    |s, _| of(s.positioning.get(&$method), |p| p.nees_mean)),
                measure_of(concat!($prefix, "_fix_range_m"), Reals, "m",
                    "of every position: from the left eye to its lamp",
                    |_, f| f.ranges_m($method)),
                measure_of(concat!($prefix, "_fix_error_m"), Reals, "m",
                    "of every position: estimated less true chainage", |_, f| f.errors_m($method)),
            )*
            $($rest),*
        ]
    };
}

/// All figures, in the order of columns. What they lie between and which side is worse stands in `scale`.
pub const MEASURES: &[Measure] = positioning![
    Stereo "paper", Mono "mono";
    measure_of("dark_lamps", Int, "1", "lamps that the stack says do not shine",
        |s, _| json!(s.dark_lamps.len())),
    measure_of("obstacles", Int, "1", "obstacles that were to be found",
        |s, _| of(s.wayside.as_ref(), |w| Some(w.obstacles.len()))),
    measure_of("missed", Int, "1", "of these, how many were never reported once they lay there",
        |s, _| of(s.wayside.as_ref(), |w| {
            Some(w.obstacles.iter().filter(|o| o.latency_s.is_none()).count())
        })),
    measure_of("not_placed", Int, "1", "of these, how many were never reported at their place once they lay there",
        |s, _| of(s.wayside.as_ref(), |w| {
            Some(w.obstacles.iter().filter(|o| o.placed_latency_s.is_none()).count())
        })),
    measure_of("false_alarms", Int, "1", "dangers reported where nothing is in the picture, counted once a frame",
        |s, _| of(s.wayside.as_ref(), |w| Some(w.false_alarms))),
    measure_of("misplaced_alarms", Int, "1", "dangers reported at a place where nothing is, counted once a frame",
        |s, _| of(s.wayside.as_ref(), |w| Some(w.misplaced_alarms))),
    measure_of("detection_latency_s", Real, "s",
        "from lying in view to the report, of the obstacle with the longest",
        |s, _| of(s.wayside.as_ref(), |w| worst(w, |o| o.latency_s))),
    measure_of("detection_distance_error_m", Real, "m",
        "mean size of the error of its reported distance, of the obstacle with the largest",
        |s, _| of(s.wayside.as_ref(), |w| worst(w, |o| o.distance_error_m))),
    measure_of("occupancy_fixes", Int, "1", "fixes after which track occupancy said something, of all trains that have it, as below",
        |s, _| occupancy(s, |o| Some(o.sum(|figures| figures.fixes)))),
    measure_of("occupancy_nothing_said", Int, "1", "fixes after which it said nothing: with `occupancy_fixes` all that shares are of",
        |s, _| occupancy(s, |o| Some(o.fixes_of(|class| class == OccupancyClass::NothingSaid)))),
    measure_of("occupancy_wrong_confident", Int, "1", "fixes that are wrong with no other track left",
        |s, _| occupancy(s, |o| Some(o.fixes_of(|class| class == OccupancyClass::WrongConfident)))),
    measure_of("occupancy_wrong_share", Real, "1", "share of all fixes whose most probable track is wrong",
        |s, _| occupancy(s, |o| o.share(OccupancyClass::is_wrong))),
    measure_of("occupancy_confident_share", Real, "1", "share of all fixes that are right with no other track left",
        |s, _| occupancy(s, |o| o.share(|class| class == OccupancyClass::CorrectConfident))),
    measure_of("occupancy_facing_reports", Int, "1", "reports of track occupancy whose most probable track is right",
        |s, _| occupancy(s, |o| Some(o.sum(|figures| figures.facing.reports)))),
    measure_of("occupancy_facing_wrong_over_0_9", Int, "1", "of these, facing the wrong way with a probability over 0.9",
        |s, _| occupancy(s, |o| Some(o.sum(|figures| figures.facing.wrong_over_0_9)))),
    measure_of("occupancy_facing_wrong_certain", Int, "1", "of these, facing the wrong way with a probability over 1 - 1e-9",
        |s, _| occupancy(s, |o| Some(o.sum(|figures| figures.facing.wrong_certain)))),
    measure_of("occupancy_switches", Int, "1", "legs of switches run over from the toe",
        |s, _| occupancy(s, |o| Some(o.sum(|figures| figures.switches)))),
    measure_of("occupancy_never_identified", Int, "1", "of these, not identified for good before the antenna left them",
        |s, _| occupancy(s, |o| Some(o.sum(|figures| figures.never_identified)))),
    measure_of("occupancy_identified_mean_m", Real, "m", "from the toe to the train's head when the leg was identified for good, mean of the run's legs that were",
        |s, _| occupancy(s, |o| o.identified_mean_m())),
    measure_of("occupancy_identified_max_m", Real, "m", "the longest of all legs; null, and censored, where a leg was never identified",
        |s, _| occupancy(s, |o| o.identified_max_m())),
    measure_of("occupancy_leg_m", Reals, "m", "of every leg that was identified: from the toe to the head; those that were not are censored, `occupancy_never_identified` is their number",
        |s, _| occupancy(s, |o| Some(list(o.legs_m().into_iter().flatten())))),
    measure_of("occupancy_error_max_m", Real, "m", "largest error along the track, of fixes whose track is right",
        |s, _| occupancy(s, |o| o.error_max_m())),
    measure_of("occupancy_nees_mean", Real, "1", "mean of (error / sigma)^2: 1 for an honest sigma",
        |s, _| occupancy(s, |o| o.nees_mean())),
    measure_of("brake_commanded_s", Real, "s", "when the train first braked for an obstacle",
        |s, _| of(s.protection.as_ref(), |p| p.brake_commanded_s)),
    measure_of("stopped_s", Real, "s", "when it first stood after that",
        |s, _| of(s.protection.as_ref(), |p| p.stopped_s)),
    measure_of("stop_margin_m", Real, "m", "closest approach of its head to an obstacle or a train; below 0: the way that it still needed to stop when it hit",
        |s, _| of(s.protection.as_ref(), |p| p.stop_margin_m)),
    measure_of("collision", Flag, "1", "the train hit something",
        |s, _| of(s.protection.as_ref(), |p| Some(p.collision))),
    measure_of("impact_speed_mps", Real, "m/s", "of the first thing hit, 0 where nothing was",
        |s, _| of(s.protection.as_ref(), |p| Some(p.impacts.first().map_or(0.0, |i| i.speed_mps)))),
    measure_of("run_m", Real, "m", "distance run", |s, _| of(s.train.as_ref(), |t| Some(t.run_m))),
    measure_of("derailed", Flag, "1", "a wheelset left the rails, and the run ended there",
        |s, _| of(s.train.as_ref(), |t| Some(t.derailed))),
    measure_of("stop_error_m", Real, "m", "where the head stood at the end less the stop mark",
        |s, _| of(s.train.as_ref(), |t| t.stop_error_m)),
    measure_of("floor_accel_up_mps2", Real, "m/s^2", "RMS, vertical, of the leading car's floor",
        |s, _| of(s.train.as_ref(), |t| Some(t.floor_accel_rms_mps2[2]))),
    measure_of("floor_accel_left_mps2", Real, "m/s^2", "RMS, lateral",
        |s, _| of(s.train.as_ref(), |t| Some(t.floor_accel_rms_mps2[1]))),
    measure_of("least_wheel_load", Real, "1", "least wheel force over its load at rest",
        |s, _| of(s.train.as_ref(), |t| Some(t.least_wheel_load_share))),
    measure_of("most_slip_mps", Real, "m/s", "most that any wheel slipped or slid",
        |s, _| of(s.train.as_ref(), |t| Some(t.most_slip_mps))),
    measure_of("simulated_s", Real, "s", "simulated time", |s, _| json!(s.simulated_s)),
    measure_of("stereo_frames", Int, "1", "stereo pairs drawn", |s, _| json!(s.stereo_frames)),
    measure_of("wayside_frames", Int, "1", "wayside frames drawn", |s, _| json!(s.wayside_frames)),
    measure_of("wall_s", Real, "wall s", "time that the run took", |s, _| json!(s.wall_s)),
    measure_of("us_per_step", Real, "wall us", "physics, a step",
        |s, _| json!(s.physics.us_per_step)),
];
