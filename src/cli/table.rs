//! The short table at the end of a run.

use crate::session::{
    CameraFigures, Cost, Distribution, Protection, Summary, TrainFigures, Wayside,
};
use std::path::Path;

/// Dark lamps that the table names.
const LAMPS: usize = 8;
/// Faults of a camera that the table lists.
const FAULTS: usize = 4;
/// Hits that the table lists.
const IMPACTS: usize = 10;

/// The figures that one looks at first; all of them are in summary.json.
pub(super) fn of(s: &Summary, out: &Path) -> String {
    let mut text = format!(
        "{}: {:.1} s simulated in {:.1} s ({:.2} x real time), seed {}\n",
        s.scenario, s.simulated_s, s.wall_s, s.real_time_factor, s.seed
    );
    text += &format!(
        "{} stereo pairs and {} wayside frames by {} ({}); physics {:.1} us a step\n",
        s.stereo_frames,
        s.wayside_frames,
        s.renderer.adapter,
        s.renderer.backend,
        s.physics.us_per_step
    );
    text += &positioning(s);
    text += &s.wayside.as_ref().map_or(String::new(), wayside);
    text.extend(s.cameras.iter().map(|(name, c)| camera(name, c)));
    text += &dark_lamps(&s.dark_lamps);
    text += &s.protection.as_ref().map_or(String::new(), protection);
    text += &s.train.as_ref().map_or(String::new(), train);
    text + &format!("\nresults in {}\n", out.display())
}

fn train(t: &TrainFigures) -> String {
    let [_, lateral, vertical] = t.floor_accel_rms_mps2;
    let stop = match t.stop_error_m {
        Some(error_m) => format!("; stopped {:.2} m off the mark", error_m.abs()),
        None => String::new(),
    };
    format!(
        "train ran {:.1} m; floor {vertical:.3} m/s^2 vertical, {lateral:.3} lateral (RMS); \
         wheel load down to {:.0} %; slip up to {:.2} m/s{stop}\n",
        t.run_m,
        100.0 * t.least_wheel_load_share,
        t.most_slip_mps,
    )
}

fn positioning(s: &Summary) -> String {
    if s.positioning.is_empty() {
        return String::new();
    }
    let mut text = format!(
        "\n{:10} {:>7} {:>7} {:>7}   {:>6} {:>6} {:>6} {:>6}   {:>10}\n",
        "position", "fixes", "avail.", "decoded", "mean", "p75", "p95", "max", "cost p50"
    );
    for (method, p) in &s.positioning {
        let percent = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{:.1} %", x * 100.0));
        let cm = |pick: fn(&Distribution) -> f64| {
            p.error_m
                .map_or("-".to_owned(), |d| format!("{:.1}", pick(&d) * 100.0))
        };
        text += &format!(
            "{:10} {:>7} {:>7} {:>7}   {:>6} {:>6} {:>6} {:>6} cm {:>7}\n",
            method.to_string(),
            p.fixes,
            percent(p.availability),
            percent(p.uid_decode_rate),
            cm(|d| d.mean),
            cm(|d| d.p75),
            cm(|d| d.p95),
            cm(|d| d.max),
            cost(p.ms_per_frame),
        );
    }
    text
}

fn cost(cost: Option<Cost>) -> String {
    cost.map_or("-".to_owned(), |c| format!("{:.2} ms", c.p50))
}

fn wayside(w: &Wayside) -> String {
    let heading = match w.obstacles.is_empty() {
        true => "no obstacle",
        false => "obstacle, size      first seen   after   distance error",
    };
    let value = |x: Option<f64>, unit: &str| match x {
        Some(x) => format!("{x:.2} {unit}"),
        None => "-".to_owned(),
    };
    let obstacles = w.obstacles.iter().map(|o| {
        format!(
            "{:12} {:.2} m {:>11} {:>8} {:>12}\n",
            o.name,
            o.size_m,
            value(o.first_detected_s, "s"),
            value(o.latency_s, "s"),
            value(o.distance_error_m, "m"),
        )
    });
    format!(
        "\n{heading}\n{}{} false alarms, {} a frame\n",
        obstacles.collect::<String>(),
        w.false_alarms,
        cost(w.ms_per_frame)
    )
}

/// Only of a camera that had something.
fn camera(name: &str, camera: &CameraFigures) -> String {
    let mut parts = Vec::new();
    if camera.lost_frames > 0 {
        parts.push(format!("{} frames lost", camera.lost_frames));
    }
    let shown = camera.faults.iter().take(FAULTS);
    parts.extend(shown.map(|span| match span.to_s {
        Some(to_s) => format!("{} from {:.2} to {to_s:.2} s", span.fault, span.from_s),
        None => format!("{} from {:.2} s to the end", span.fault, span.from_s),
    }));
    if camera.faults.len() > FAULTS {
        parts.push(format!("{} faults in all", camera.faults.len()));
    }
    match parts.is_empty() {
        true => String::new(),
        false => format!("\ncamera {name}: {}\n", parts.join(", ")),
    }
}

/// How many lamps are out, with the first ones' names.
fn dark_lamps(names: &[String]) -> String {
    match names.len() {
        0 => String::new(),
        n if n <= LAMPS => format!("dark lamps: {}\n", names.join(", ")),
        n => format!("{n} dark lamps: {}, ...\n", names[..LAMPS].join(", ")),
    }
}

fn protection(p: &Protection) -> String {
    let mut text = match p.brake_commanded_s {
        Some(t) => format!("\nprotection braked at {t:.2} s"),
        None => "\nprotection did not brake".to_owned(),
    };
    if let Some(t) = p.stopped_s {
        text += &format!(", the train stood at {t:.2} s");
    }
    if let Some(margin) = p.stop_margin_m {
        text += &format!(", {margin:.1} m before the obstacle");
    }
    text += match p.collision {
        true => "; COLLISION\n",
        false => "; no collision\n",
    };
    text.extend(p.impacts.iter().take(IMPACTS).map(|hit| {
        format!(
            "  hit {} at {:.2} s with {:.1} km/h: {:.0} N s, {:.2} kJ of {:.2} kJ lost, {} damage\n",
            hit.with,
            hit.time.secs(),
            3.6 * hit.speed_mps,
            hit.momentum_n_s,
            1e-3 * hit.energy_lost_j,
            1e-3 * hit.energy_j,
            hit.damage,
        )
    }));
    match p.impacts.len().saturating_sub(IMPACTS) {
        0 => text,
        more => text + &format!("  and {more} more hits: see summary.json\n"),
    }
}
