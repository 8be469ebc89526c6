//! Several trains, both ways, with clocks of their own: whole sessions.

use metrotwin::bus::{Content, Method, Node, TrainId};
use metrotwin::scenario::{Override, Scenario, ScenarioFile};
use metrotwin::session::{
    Event, Observer, ObserverError, RendererChoice, RunOptions, Summary, run,
};
use metrotwin::settings::read_toml;
use metrotwin::track::Tunnel;
use std::path::Path;

fn figures(scenario: &Scenario, renderer: RendererChoice) -> Summary {
    let options = RunOptions {
        renderer,
        ..RunOptions::default()
    };
    run(scenario, &options, &mut []).unwrap()
}

/// The shipped scenario, without its rigs: trains that go by their odometers.
fn two_trains(radio: bool) -> Summary {
    let text = include_str!("../../scenarios/two_trains.toml");
    let mut file: ScenarioFile = read_toml(text).unwrap();
    file.rig = None;
    file.onboard[0].rig = None;
    if !radio {
        file.radio.loss = 1.0;
    }
    let tunnel = Tunnel::from_toml(include_str!("../../tunnels/chengdu_line1.toml")).unwrap();
    let scenario = Scenario::new(file, tunnel).unwrap();
    figures(&scenario, RendererChoice::Cpu)
}

/// The second train hears where the first one is and stops behind it, by as much as its equipment leaves
/// room: 25 m, and what the odometers of both may be off. Without radio it runs into it, and the hit is
/// in the figures of both.
#[test]
fn the_second_train_stops_behind_the_first() {
    let summary = two_trains(true);
    let [first, second] = &summary.trains[..] else {
        panic!("{} trains", summary.trains.len());
    };
    let of = |train: &metrotwin::session::TrainSummary| train.protection.clone().unwrap();
    assert!(!of(first).collision && !of(second).collision);
    assert_eq!(of(first).brake_commanded_s, None);
    let margin_m = of(second).stop_margin_m.unwrap();
    eprintln!("stands {margin_m:.1} m behind the first");
    // Measured: 55 m.
    assert!((30.0..90.0).contains(&margin_m), "{margin_m} m");
    assert!(first.train.unwrap().stop_error_m.unwrap().abs() < 0.1);

    let hit = two_trains(false);
    for train in &hit.trains {
        let protection = of(train);
        assert!(protection.collision, "train {}", train.id);
        assert!(
            protection.stop_margin_m.unwrap() < 0.0,
            "train {}",
            train.id
        );
        let speed_kmh = 3.6 * protection.impacts[0].speed_mps;
        assert!((40.0..50.0).contains(&speed_kmh), "{speed_kmh} km/h");
    }
}

/// What the equipment of a train takes its place to be, held against the truth.
#[derive(Default)]
struct Placed {
    true_m: Option<f64>,
    /// Largest error, in sigmas.
    worst_sigmas: f64,
    slid: bool,
    may_not_stop: bool,
}

impl Observer for Placed {
    fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
        match event {
            Event::Train { train, truth, .. } if train.0 == 1 => {
                self.true_m = Some(truth.chainage_m);
            }
            Event::Message {
                node: Node::Train(TrainId(1)),
                message,
            } => {
                if let Content::Protection(report) = &message.content
                    && let (Some(true_m), Some(m), Some(sigma_m)) = (
                        self.true_m,
                        report.position.map(|place| place.s_m),
                        report.sigma_m,
                    )
                {
                    let off_m = (true_m - m).abs();
                    self.worst_sigmas = self.worst_sigmas.max(off_m / sigma_m);
                    self.slid |= report.wheels_slide;
                    self.may_not_stop |= !report.stops_in_time;
                }
            }
            _ => {}
        }
        Ok(())
    }
}

/// A train comes at 60 km/h towards the tail of one that stands, `gap_m` ahead of it.
fn on_slippery_rails(rails: &str, gap_m: f64, more: &str) -> (Summary, Placed) {
    let text = format!(
        r#"
        name = "slippery"
        tunnel = "chengdu_line1.toml"
        duration_s = 80.0
        stop_after_standstill_s = 2.0
        track = {rails}
        train = {{ start_chainage_m = 1650.0, cruise_speed_kmh = 0.0, stop_at_m = 1650.0 }}
        stack = {{ protection = {{ initial_chainage_m = 1650.0, initial_sigma_m = 1.0 }} }}
        [[other_trains]]
        start_chainage_m = {start_m}
        start_speed_kmh = 60.0
        cruise_speed_kmh = 60.0
        [[onboard]]
        train = 1
        protection = {{ initial_chainage_m = {start_m}, initial_sigma_m = 1.0 }}
        {more}
        "#,
        start_m = 1532.0 - gap_m
    );
    let tunnel = Tunnel::from_toml(include_str!("../../tunnels/chengdu_line1.toml")).unwrap();
    let scenario = Scenario::new(read_toml(&text).unwrap(), tunnel).unwrap();
    let mut placed = Placed::default();
    let options = RunOptions::default();
    let summary = run(&scenario, &options, &mut [&mut placed]).unwrap();
    (summary, placed)
}

/// Warned 410 m ahead, a train must stop on a film of leaves, everywhere or on its way, although it learns
/// of the film by its wheels only; and its place must be within what it says, although they slide. Where
/// no brake can do it any more, it must say so.
#[test]
fn a_train_stops_on_leaves_or_says_that_it_cannot() {
    let film = r#"{ rail = "leaf_film" }"#;
    let stretch = r#"{ rail_zones = [{ from_m = 1200.0, to_m = 1560.0, rail = "leaf_film" }] }"#;
    for (rails, slides) in [(film, true), (stretch, false)] {
        let (summary, placed) = on_slippery_rails(rails, 410.0, "");
        let protection = summary.trains[1].protection.clone().unwrap();
        eprintln!(
            "{rails}: stands {:?} m before, position off by at most {:.1} sigma",
            protection.stop_margin_m, placed.worst_sigmas
        );
        assert!(!protection.collision, "{rails}");
        // On the stretch it is slow by then, and brakes by what the film bears.
        assert_eq!(placed.slid, slides, "{rails}");
        assert!(
            placed.worst_sigmas < 3.0,
            "{rails}: {}",
            placed.worst_sigmas
        );
    }
    // Nothing else tells the equipment of the slide.
    let silent = "odometer = { reports_slides = false }";
    let (_, placed) = on_slippery_rails(film, 410.0, silent);
    assert!(!placed.slid);
    let (summary, placed) = on_slippery_rails(film, 250.0, "");
    assert!(summary.trains[1].protection.clone().unwrap().collision);
    assert!(placed.may_not_stop);
    let (summary, placed) = on_slippery_rails(r#"{ rail = "dry" }"#, 250.0, "");
    assert!(!summary.trains[1].protection.clone().unwrap().collision);
    assert!(!placed.slid && !placed.may_not_stop);
}

/// A stretch of `line_run` at 60 km/h.
fn stretch(overrides: &[&str]) -> Summary {
    let fixed = ["duration_s=3.0", "train.start_speed_kmh=60.0"];
    let overrides: Vec<Override> = (fixed.iter().chain(overrides))
        .map(|text| text.parse().unwrap())
        .collect();
    let scenario = Scenario::load(Path::new("scenarios/line_run.toml"), &overrides).unwrap();
    figures(&scenario, RendererChoice::Auto)
}

/// A camera whose clock is fast by 10 ms puts a train that runs at 60 km/h 17 cm back.
#[test]
fn a_clock_that_is_off_shifts_the_position() {
    let up = [
        "train.start_chainage_m=400.0",
        "stack.protection.initial_chainage_m=400.0",
    ];
    let exact = stretch(&up).positioning[&Method::Stereo].error_m.unwrap();
    let [start, set] = up;
    let fast = stretch(&[start, set, "rig.clock.offset_ms=10.0"]);
    let fast = fast.positioning[&Method::Stereo].error_m.unwrap();
    eprintln!(
        "p95 {:.3} m, with a fast clock p50 {:.3} m",
        exact.p95, fast.p50
    );
    assert!(exact.p95 < 0.1, "{}", exact.p95);
    assert!((fast.p50 - 0.167).abs() < 0.06, "{}", fast.p50);
}

/// A train that runs down the line positions itself as well, with its rig on the other side and looking
/// back: the lamps of the line shine towards trains that run up. With the rig on the wrong side the
/// scenario is refused.
#[test]
fn a_train_that_runs_down_positions_itself() {
    let down = [
        "train.direction=\"down\"",
        "train.start_chainage_m=2400.0",
        "train.stop_at_m=300.0",
        "stack.protection.initial_chainage_m=2400.0",
    ];
    let [a, b, c, d] = down;
    let summary = stretch(&[a, b, c, d, "rig.side=\"right\"", "rig.yaw_deg=141.0"]);
    let paper = &summary.positioning[&Method::Stereo];
    assert_eq!(paper.wrong_uid, 0);
    assert!(paper.fixes > 60, "{}", paper.fixes);
    let error_m = paper.error_m.unwrap();
    eprintln!("down the line: p95 {:.3} m", error_m.p95);
    assert!(error_m.p95 < 0.1, "{}", error_m.p95);
    let run_m = summary.train.unwrap().run_m;
    assert!((run_m - 50.0).abs() < 2.0, "{run_m}");

    let overrides: Vec<Override> = down.iter().map(|text| text.parse().unwrap()).collect();
    let wrong = Scenario::load(Path::new("scenarios/line_run.toml"), &overrides);
    let wrong = wrong.unwrap_err().to_string();
    assert!(wrong.contains("rig.side"), "{wrong}");
}

/// A rig in the rear cab looks back and runs backwards; what it gives is the chainage of the head, on a
/// train that runs up and on one that runs down.
#[test]
fn a_rig_in_the_rear_cab_gives_the_head() {
    let up = [
        "train.direction=\"up\"",
        "rig.side=\"right\"",
        "rig.yaw_deg=141.0",
    ];
    let down = [
        "train.direction=\"down\"",
        "train.stop_at_m=100.0",
        "rig.yaw_deg=39.0",
    ];
    for of_direction in [up, down] {
        let fixed = [
            "train.start_chainage_m=500.0",
            "stack.protection.initial_chainage_m=500.0",
            "rig.end=\"rear\"",
        ];
        let summary = stretch(&[&fixed[..], &of_direction[..]].concat());
        let paper = &summary.positioning[&Method::Stereo];
        assert_eq!(paper.wrong_uid, 0, "{of_direction:?}");
        assert!(paper.fixes > 60, "{}", paper.fixes);
        let error_m = paper.error_m.unwrap();
        eprintln!("rear cab: p95 {:.3} m", error_m.p95);
        // Couplers give, and cars are chords: the stack takes 5 cm for one sigma of it. Measured: 0.05
        // and 0.11 m.
        assert!(error_m.p95 < 0.15, "{of_direction:?}: {}", error_m.p95);
    }
}
