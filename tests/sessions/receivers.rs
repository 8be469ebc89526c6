//! Satellite receivers and track occupancy on trains: whole sessions.

use crate::calibration::{Calibration, TruePlace};
use metrotwin::bus::{Content, GnssFix, OccupancyReport, TrainId};
use metrotwin::scenario::{Override, Scenario};
use metrotwin::session::{
    Event, Observer, ObserverError, OccupancyClass, Opening, RendererChoice, RunOptions, Summary,
    run,
};
use metrotwin::twin::physics::TrainState;
use std::collections::BTreeMap;
use std::path::Path;

/// What a train's receiver and equipment said, with the true distance of its head.
#[derive(Default)]
struct Heard {
    run_m: f64,
    truths: Vec<TrainState>,
    fixes: Vec<(f64, GnssFix)>,
    reports: Vec<(f64, OccupancyReport)>,
}

impl Observer for Heard {
    fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
        match event {
            Event::Train {
                train: TrainId(0),
                truth,
                ..
            } => {
                self.run_m = truth.run_m;
                self.truths.push((*truth).clone());
            }
            Event::Message { message, .. } => {
                if let Content::Gnss(fix) = &message.content {
                    self.fixes.push((self.run_m, fix.clone()));
                }
            }
            Event::Occupancy {
                train: TrainId(0),
                report,
                ..
            } => self.reports.push((self.run_m, (*report).clone())),
            _ => {}
        }
        Ok(())
    }
}

fn play(scenario: &str, overrides: &[&str]) -> (Heard, Summary) {
    let mut heard = Heard::default();
    let summary = watch(scenario, overrides, &mut heard);
    (heard, summary)
}

fn watch(scenario: &str, overrides: &[&str], observer: &mut dyn Observer) -> Summary {
    let overrides: Vec<Override> = overrides.iter().map(|o| o.parse().unwrap()).collect();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenarios/{scenario}.toml"));
    let scenario = Scenario::load(&path, &overrides).unwrap();
    let options = RunOptions {
        renderer: RendererChoice::Cpu,
        ..RunOptions::default()
    };
    run(&scenario, &options, &mut [observer]).unwrap()
}

/// Out of the tunnel at 445 m, over a ladder into the third of five tracks 5 m apart: no fix comes underground, the
/// balise before the portal says where the train is, and every leg is known.
#[test]
fn a_train_finds_its_track_in_a_depot() {
    let (heard, summary) = play("depot_fan", &[]);
    // The antenna is 10 m behind the head, and a fix takes 80 ms.
    let (first_m, _) = heard.fixes[0];
    assert!(first_m > 445.0 + 10.0 - 4.0, "{first_m}");
    let known = heard.reports.iter().find(|(_, r)| !r.tracks.is_empty());
    let (known_m, report) = known.unwrap();
    assert!(
        !report.of_fix && (440.0..460.0).contains(known_m),
        "{known_m}"
    );
    let occupancy = summary.occupancy.unwrap();
    eprintln!("{occupancy:?}");
    assert_eq!(occupancy.classes[&OccupancyClass::WrongConfident], 0);
    assert_eq!(occupancy.never_identified, 0);
    // A leg with a radius of 200 m is 4 m aside after 40 m; the antenna is 10 m behind the head.
    let most_m = occupancy.identified_after_m.unwrap().max;
    assert!(most_m.is_some_and(|m| m < 50.0), "{most_m:?}");
    let (_, last) = heard.reports.last().unwrap();
    assert!(last.identified);
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("tunnels/terminus.toml");
    let tunnel = std::fs::read_to_string(scenario).unwrap();
    let tunnel = metrotwin::track::Tunnel::from_toml(&tunnel).unwrap();
    assert_eq!(tunnel.network.named("depot 3"), Some(last.tracks[0].track));
    // The train stands with its head at 200 m.
    assert!((last.tracks[0].s_m - 190.0).abs() < 4.0 * last.tracks[0].sigma_m.max(0.5));
}

/// Of all trains of many runs: classes of fixes, and whether decisions are wrong as often as they say. The map is as far
/// off as the stack believes; each receiver's errors are a quarter larger than it states.
#[derive(Default)]
struct Scores {
    /// Of the tracks.
    lengths_m: Vec<f64>,
    /// By train.
    calibrations: BTreeMap<TrainId, Calibration>,
    classes: BTreeMap<OccupancyClass, usize>,
}

impl Observer for Scores {
    fn open(&mut self, opening: &Opening<'_>) -> Result<(), ObserverError> {
        let tracks = opening.tunnel.network.tracks.iter();
        self.lengths_m = tracks.map(|track| track.alignment.length_m()).collect();
        Ok(())
    }

    fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
        if let Event::Occupancy {
            train,
            report,
            class: Some(class),
            truth: Some(truth),
        } = event
        {
            *self.classes.entry(*class).or_default() += 1;
            let Some(best) = report.tracks.first() else {
                return Ok(());
            };
            let element = usize::from(truth.track.0);
            let place = TruePlace::new(element, truth.s_m, self.lengths_m[element]);
            let calibration = self.calibrations.entry(*train).or_default();
            calibration.add(place, 1.0 - best.probability, class.is_right());
        }
        Ok(())
    }
}

#[test]
fn val_no_train_is_wrong_with_certainty() {
    let mut all = Calibration::default();
    let mut classes: BTreeMap<OccupancyClass, usize> = BTreeMap::new();
    for seed in 1..=20 {
        let mut scores = Scores::default();
        let overrides = [
            &format!("seed={seed}") as &str,
            "duration_s=60",
            "survey.track_sigma_m=0.3",
        ];
        watch("parallel_tracks", &overrides, &mut scores);
        assert_eq!(
            scores.calibrations.len(),
            2,
            "both trains say where they are"
        );
        for calibration in scores.calibrations.values() {
            all.extend(calibration);
        }
        for (class, count) in scores.classes {
            *classes.entry(class).or_default() += count;
        }
    }
    println!("\n{classes:?}");
    all.print("trains with simulated receivers");
    assert!(classes.values().sum::<usize>() > 10_000);
    assert_eq!(classes.get(&OccupancyClass::WrongConfident), None);
    assert!(
        all.least_probability() > 1e-3,
        "{}",
        all.least_probability()
    );
}

/// The published method and its baseline run as equipment too, and are slower to tell.
#[test]
fn the_published_method_takes_longer() {
    let mean_m = |method: &str| {
        let method = format!("stack.occupancy.method=\"{method}\"");
        let (_, summary) = play("parallel_tracks", &[&method, "duration_s=90"]);
        let occupancy = summary.occupancy.unwrap();
        // The curves of the other train do not count here; fixes that were not said anything about would.
        assert!(
            occupancy.fixes > 400 && occupancy.switches >= 2,
            "{occupancy:?}"
        );
        let median_m = occupancy.identified_after_m.unwrap().p50;
        (
            median_m.unwrap_or(f64::INFINITY),
            occupancy.classes[&OccupancyClass::WrongConfident],
        )
    };
    let (fused_m, wrong) = mean_m("fused");
    assert_eq!(wrong, 0);
    for method in ["pedal", "perpendicular"] {
        let (m, _) = mean_m(method);
        eprintln!("{method}: {m:.1} m, fused: {fused_m:.1} m");
        assert!(m > fused_m, "{method}: {m} {fused_m}");
    }
}

/// Fails where a train that has learned from fixes how its wheel counts is sure of its place in a tunnel with slippery
/// rails: its wheels slide for seconds while it brakes, and each slide is seen late.
#[test]
fn a_train_that_slides_in_a_tunnel_is_not_sure_where_it_is() {
    let overrides = [
        "survey.track_sigma_m=0.0",
        "train.start_track=\"r9\"",
        "train.start_chainage_m=335.0",
        "train.via=[]",
        "train.stop_track=\"r11\"",
        "train.stop_at_m=320.0",
        "track.rail_zones=[{track=\"r11\",from_m=60.0,to_m=170.0,rail=\"leaf_film\"}]",
        "other_trains=[]",
        "onboard=[]",
        "duration_s=90.0",
        "stop_after_standstill_s=1.0",
    ];
    let (heard, _) = play("parallel_tracks", &overrides);
    let (mut judged, mut most_m, mut most_deviations) = (0, 0f64, 0f64);
    let underground = heard.reports.iter().filter(|(_, report)| !report.of_fix);
    for (_, report) in underground {
        let after = heard
            .truths
            .partition_point(|truth| truth.time < report.time);
        let (Some(truth), Some(best)) = (heard.truths.get(after), report.tracks.first()) else {
            continue;
        };
        // The antenna is 10 m behind the head.
        let error_m = best.s_m - (truth.chainage_m - 10.0);
        if truth.track != best.track || truth.chainage_m < 70.0 {
            continue;
        }
        judged += 1;
        most_m = most_m.max(error_m.abs());
        most_deviations = most_deviations.max(error_m.abs() / best.sigma_m);
    }
    eprintln!("{judged} reports, {most_m:.1} m, {most_deviations:.2} sigma");
    assert!(judged > 10 && most_m > 5.0, "{judged} {most_m}");
    assert!(most_deviations < 3.0, "{most_deviations}");
}
