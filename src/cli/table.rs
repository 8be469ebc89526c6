//! The short table at the end of a run.

use crate::session::{Cost, Summary};
use std::fmt::Write;
use std::path::Path;

/// The figures that one looks at first; all of them are in summary.json.
pub(super) fn of(summary: &Summary, out: &Path) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_all(&mut text, summary, out);
    text
}

fn write_all(text: &mut String, s: &Summary, out: &Path) -> std::fmt::Result {
    writeln!(
        text,
        "{}: {:.1} s simulated in {:.1} s ({:.2} x real time), seed {}",
        s.scenario, s.simulated_s, s.wall_s, s.real_time_factor, s.seed
    )?;
    writeln!(
        text,
        "{} stereo pairs and {} wayside frames by {} ({}); physics {:.1} us a step",
        s.stereo_frames,
        s.wayside_frames,
        s.renderer.adapter,
        s.renderer.backend,
        s.physics.us_per_step
    )?;
    positioning(text, s)?;
    wayside(text, s)?;
    cameras(text, s)?;
    dark_lamps(text, s)?;
    protection(text, s)?;
    train(text, s)?;
    writeln!(text, "\nresults in {}", out.display())
}

fn train(text: &mut String, s: &Summary) -> std::fmt::Result {
    let Some(t) = &s.train else {
        return Ok(());
    };
    let [_, lateral, vertical] = t.floor_accel_rms_mps2;
    write!(
        text,
        "train ran {:.1} m; floor {vertical:.3} m/s^2 vertical, {lateral:.3} lateral (RMS); \
         wheel load down to {:.0} %; slip up to {:.2} m/s",
        t.run_m,
        100.0 * t.least_wheel_load_share,
        t.most_slip_mps,
    )?;
    if let Some(error_m) = t.stop_error_m {
        write!(text, "; stopped {:.2} m off the mark", error_m.abs())?;
    }
    writeln!(text)
}

fn positioning(text: &mut String, s: &Summary) -> std::fmt::Result {
    if s.positioning.is_empty() {
        return Ok(());
    }
    writeln!(
        text,
        "\n{:10} {:>7} {:>7} {:>7}   {:>6} {:>6} {:>6} {:>6}   {:>10}",
        "position", "fixes", "avail.", "decoded", "mean", "p75", "p95", "max", "cost p50"
    )?;
    for (method, p) in &s.positioning {
        let percent = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{:.1} %", x * 100.0));
        let cm = |pick: fn(&crate::session::Distribution) -> f64| {
            p.error_m
                .map_or("-".to_owned(), |d| format!("{:.1}", pick(&d) * 100.0))
        };
        writeln!(
            text,
            "{:10} {:>7} {:>7} {:>7}   {:>6} {:>6} {:>6} {:>6} cm {:>7}",
            format!("{method:?}").to_lowercase(),
            p.fixes,
            percent(p.availability),
            percent(p.uid_decode_rate),
            cm(|d| d.mean),
            cm(|d| d.p75),
            cm(|d| d.p95),
            cm(|d| d.max),
            cost(p.ms_per_frame),
        )?;
    }
    Ok(())
}

fn cost(cost: Option<Cost>) -> String {
    cost.map_or("-".to_owned(), |c| format!("{:.2} ms", c.p50))
}

fn wayside(text: &mut String, s: &Summary) -> std::fmt::Result {
    let Some(w) = &s.wayside else {
        return Ok(());
    };
    let heading = match w.obstacles.is_empty() {
        true => "no obstacle",
        false => "obstacle, size      first seen   after   distance error",
    };
    writeln!(text, "\n{heading}")?;
    for o in &w.obstacles {
        let value = |x: Option<f64>, unit: &str| match x {
            Some(x) => format!("{x:.2} {unit}"),
            None => "-".to_owned(),
        };
        writeln!(
            text,
            "{:12} {:.2} m {:>11} {:>8} {:>12}",
            o.name,
            o.size_m,
            value(o.first_detected_s, "s"),
            value(o.latency_s, "s"),
            value(o.distance_error_m, "m"),
        )?;
    }
    writeln!(
        text,
        "{} false alarms, {} a frame",
        w.false_alarms,
        cost(w.ms_per_frame)
    )
}

/// Only those that had something.
fn cameras(text: &mut String, s: &Summary) -> std::fmt::Result {
    for (name, camera) in &s.cameras {
        if camera.lost_frames == 0 && camera.faults.is_empty() {
            continue;
        }
        let mut said = Vec::new();
        if camera.lost_frames > 0 {
            said.push(format!("{} frames lost", camera.lost_frames));
        }
        let shown = camera.faults.iter().take(FAULTS);
        said.extend(shown.map(|span| match span.to_s {
            Some(to_s) => format!("{} from {:.2} to {to_s:.2} s", span.fault, span.from_s),
            None => format!("{} from {:.2} s to the end", span.fault, span.from_s),
        }));
        if camera.faults.len() > FAULTS {
            said.push(format!("{} faults in all", camera.faults.len()));
        }
        writeln!(text, "\ncamera {name}: {}", said.join(", "))?;
    }
    Ok(())
}

/// How many lamps are out, with the first ones' names.
fn dark_lamps(text: &mut String, s: &Summary) -> std::fmt::Result {
    let names: Vec<_> = s
        .dark_lamps
        .iter()
        .take(LAMPS)
        .map(String::as_str)
        .collect();
    match s.dark_lamps.len() {
        0 => Ok(()),
        n if n <= LAMPS => writeln!(text, "dark lamps: {}", names.join(", ")),
        n => writeln!(text, "{n} dark lamps: {}, ...", names.join(", ")),
    }
}

/// Dark lamps that the table names.
const LAMPS: usize = 8;

/// Faults of a camera that the table lists.
const FAULTS: usize = 4;

fn protection(text: &mut String, s: &Summary) -> std::fmt::Result {
    let Some(p) = &s.protection else {
        return Ok(());
    };
    match p.brake_commanded_s {
        Some(t) => write!(text, "\nprotection braked at {t:.2} s")?,
        None => write!(text, "\nprotection did not brake")?,
    }
    if let Some(t) = p.stopped_s {
        write!(text, ", the train stood at {t:.2} s")?;
    }
    if let Some(margin) = p.stop_margin_m {
        write!(text, ", {margin:.1} m before the obstacle")?;
    }
    writeln!(
        text,
        "{}",
        if p.collision {
            "; COLLISION"
        } else {
            "; no collision"
        }
    )?;
    for hit in p.impacts.iter().take(IMPACTS) {
        writeln!(
            text,
            "  hit {} at {:.2} s with {:.1} km/h: {:.0} N s, {:.2} kJ of {:.2} kJ lost, {} damage",
            hit.with,
            hit.time.secs(),
            3.6 * hit.speed_mps,
            hit.momentum_n_s,
            1e-3 * hit.energy_lost_j,
            1e-3 * hit.energy_j,
            hit.damage,
        )?;
    }
    match p.impacts.len().saturating_sub(IMPACTS) {
        0 => Ok(()),
        more => writeln!(text, "  and {more} more hits: see summary.json"),
    }
}

/// Hits that the table lists.
const IMPACTS: usize = 10;
