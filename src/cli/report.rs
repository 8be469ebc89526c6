//! What a vehicle, scenario or study says, in a few lines.

use super::tunnel::indented;
use crate::bus::{CameraModel, RigCalibration, TrainId};
use crate::scenario::sampling::Template;
use crate::scenario::{OnboardSettings, Scenario};
use crate::track::{Direction, Track};
use crate::twin::physics::VehicleFile;
use crate::twin::sensors::visible_interval;

/// Dimensions and masses.
pub(super) fn vehicle(vehicle: &VehicleFile) -> String {
    let (body, bogie, wheelset) = (&vehicle.body, &vehicle.bogie, &vehicle.wheelset);
    let mass_kg = vehicle.mass_kg();
    let lines = [
        format!("vehicle `{}`: {}", vehicle.name, vehicle.source),
        format!(
            "{} x {} x {} m, {:.1} t with {:.1} t of body, {:.1} t an axle",
            body.length_m,
            body.width_m,
            body.height_m,
            1e-3 * mass_kg,
            1e-3 * body.mass_kg,
            0.25e-3 * mass_kg
        ),
        format!(
            "bogies {} m apart, wheelbase {} m, wheels of {} m radius",
            bogie.distance_m, bogie.wheelbase_m, wheelset.radius_m
        ),
    ];
    indented(&lines)
}

/// What it runs, what the rig sees, how many images to expect.
pub(super) fn scenario(scenario: &Scenario) -> String {
    let mut lines = vec![
        format!(
            "scenario `{}`: {}",
            scenario.file.name, scenario.file.description
        ),
        format!(
            "{:.1} s on `{}`, seed {}",
            scenario.file.duration_s, scenario.tunnel.name, scenario.file.seed
        ),
    ];
    for (k, train) in scenario.physics.trains.iter().enumerate() {
        let what = train_name(scenario, TrainId::from_index(k));
        let stop = train
            .stop_at_m
            .map_or(String::new(), |m| format!(", stops at {m} m"));
        lines.push(format!(
            "{what}: {} x `{}`, {:.1} m, {:.1} t, head at {} m, cruises{} at {} km/h{stop}",
            train.cars,
            train.vehicle,
            train.length_m(),
            1e-3 * train.mass_kg(),
            train.start_chainage_m,
            match train.direction {
                Direction::Up => "",
                Direction::Down => " down the line",
            },
            (10.0 * train.cruise_speed_kmh).round() / 10.0
        ));
    }
    if let Some(bench) = &scenario.file.bench {
        lines.push(format!(
            "bench: {} points {} m apart from {} m, {} fixes each",
            bench.points, bench.step_m, bench.first_m, bench.fixes_per_point
        ));
    }
    for onboard in &scenario.onboard {
        lines.extend(rig(onboard, scenario));
    }
    for post in &scenario.wayside {
        let name = &post.calibration.name;
        let rate = post.camera.frames_per_s;
        let rows = frames(&post.calibration.camera, rate);
        let count = images(scenario.file.duration_s, rate);
        let lidar = post.lidar.as_ref().map_or("", |_| ", with lidar");
        lines.push(format!("{name}: {rows}"));
        lines.push(format!("{name}: about {count:.0} images{lidar}"));
    }
    let world = &scenario.physics;
    let obstacles: u32 = world.obstacles.iter().map(|o| o.count).sum();
    let (cables, workers) = (world.cables.len(), world.workers.len());
    if obstacles > 0 || cables > 0 || workers > 0 {
        lines.push(format!(
            "obstacles: {obstacles}, cables: {cables}, workers: {workers}"
        ));
    }
    indented(&lines)
}

/// A train in a sentence.
pub(super) fn train_name(scenario: &Scenario, id: TrainId) -> String {
    match scenario.physics.trains.len() {
        1 => "the train".to_owned(),
        _ => id.to_string(),
    }
}

/// The rig of a train, if it has one.
fn rig(onboard: &OnboardSettings, scenario: &Scenario) -> Vec<String> {
    let Some(rig) = &onboard.rig else {
        return Vec::new();
    };
    let name = format!("rig of {}", train_name(scenario, onboard.id()));
    let calibration = rig.calibration();
    let pairs = images(scenario.file.duration_s, rig.pairs_per_s);
    vec![
        format!("{name}: {}", frames(&calibration.left, rig.pairs_per_s)),
        format!("{name}: {}", view(&calibration, onboard, scenario)),
        format!(
            "{name}: {}",
            stripes(&calibration.left, scenario.tunnel.first_track())
        ),
        format!("{name}: about {pairs:.0} pairs of images"),
    ]
}

fn images(duration_s: f64, per_s: f64) -> f64 {
    (duration_s * per_s).ceil()
}

fn frames(camera: &CameraModel, per_s: f64) -> String {
    let image = &camera.intrinsics;
    format!(
        "{} x {} px, {per_s} a second; {} rows take {:.1} of {:.1} ms",
        image.width_px,
        image.height_px,
        image.height_px,
        camera.shutter.frame_span_s(image.height_px) * 1e3,
        1e3 / per_s
    )
}

/// Visible interval of the lamp in the middle, and how it changes along the line.
fn view(rig: &RigCalibration, onboard: &OnboardSettings, scenario: &Scenario) -> String {
    let Some(track) = scenario.seen_from_rig(onboard) else {
        return "a lamp is seen nowhere".to_owned();
    };
    let track = &*track;
    let seen = track
        .lamps
        .iter()
        .filter_map(|lamp| visible_interval(rig, track, lamp));
    let (mut near, mut far): (Vec<f64>, Vec<f64>) = seen.unzip();
    near.sort_by(f64::total_cmp);
    far.sort_by(f64::total_cmp);
    let text = |v: &[f64]| match (v.first(), v.get(v.len() / 2), v.last()) {
        (Some(least), Some(middle), Some(most)) if most - least > 0.06 => {
            format!("{middle:.1} m ({least:.1} to {most:.1} along the line)")
        }
        (_, Some(middle), _) => format!("{middle:.1} m"),
        _ => "nowhere".to_owned(),
    };
    let unseen = match track.lamps.len() - near.len() {
        0 => String::new(),
        n => format!("; {n} lamps never"),
    };
    // A rig that looks back past its own end sees lamps that it has passed.
    if far.iter().all(|m| *m < 0.0) && !far.is_empty() {
        let behind = |v: &[f64]| v.iter().rev().map(|m| -m).collect::<Vec<f64>>();
        let (near, far) = (behind(&far), behind(&near));
        return format!(
            "a lamp is seen whole by both eyes from {} to {} behind its end of the train{unseen}",
            text(&near),
            text(&far),
        );
    }
    format!(
        "a lamp is seen whole by both eyes from {} to {} ahead of its end of the train{unseen}",
        text(&near),
        text(&far),
    )
}

/// How the lamps' code meets the shutter.
fn stripes(camera: &CameraModel, track: &Track) -> String {
    let shutter = camera.shutter;
    match track.lamps.first() {
        Some(lamp) if shutter.line_time_s > 0.0 => format!(
            "a chip of {:.1} us makes a stripe of {:.2} rows; a row is exposed for {:.2} of a chip",
            lamp.chip_s * 1e6,
            lamp.chip_s / shutter.line_time_s,
            shutter.exposure_s / lamp.chip_s
        ),
        Some(_) => "a global shutter: lamps show no stripes, and cannot be named".to_owned(),
        None => "no lamps".to_owned(),
    }
}

/// What a study varies.
pub(super) fn study(template: &Template) -> String {
    let settings = &template.settings;
    let (cells, runs) = (template.cells(), template.runs());
    let of_cells = if cells > 1 {
        format!(", {} for each of {cells} combinations", settings.runs)
    } else {
        String::new()
    };
    let mut text = format!("\n  study: {runs} runs{of_cells}, seed {}", settings.seed);
    for (name, variable) in &settings.variables {
        text += &format!("\n    {name}: {}", variable.from.in_a_line());
        if !variable.keys.is_empty() {
            text += &format!(" -> {}", variable.keys.join(", "));
        }
    }
    for condition in &settings.require {
        text += &format!("\n    only if {condition}");
    }
    for (name, event) in &settings.events {
        text += &format!("\n    event {name}: {event}");
    }
    text
}
