//! The shipped scenarios, run whole and held to the figures that they must reach. Published
//! figures: Zhang et al., Acta Optica Sinica 2023, doi 10.3788/AOS221912.
//!
//! A run takes long, so each is also held to its own past: no figure is worse than [`ROOM`] times what
//! was measured, which is far under the published ones. Whoever makes the world harder and has to raise
//! one says so in the change.

use metrotwin::bus::{Content, Method, SimTime};
use metrotwin::scenario::Scenario;
use metrotwin::session::{
    End, ErrorStatistics, Event, Observer, ObserverError, RunOptions, Summary, run,
};
use std::path::Path;

fn scenario(name: &str, overrides: &[&str]) -> Scenario {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenarios/{name}.toml"));
    let overrides: Vec<_> = overrides.iter().map(|o| o.parse().unwrap()).collect();
    Scenario::load(&path, &overrides).unwrap()
}

fn figures(scenario: &Scenario, observer: &mut dyn Observer) -> Summary {
    let summary = run(scenario, &RunOptions::default(), &mut [observer]).unwrap();
    println!("{}", serde_json::to_string_pretty(&summary).unwrap());
    assert_eq!(summary.end, End::Complete);
    summary
}

/// A figure may be worse than measured by this factor.
const ROOM: f64 = 1.6;

/// What was measured of a method.
struct Measured {
    mean_m: f64,
    p95_m: f64,
    nees_mean: f64,
}

/// Holds a method to its own past: no wrong lamp, mean and 95th percentile of the error, and a sigma
/// that is neither too small nor too large (an honest one has a `nees_mean` of 1). That of `mono` is
/// too small by a factor of two and more: it takes the edges of neighbouring rows for independent.
fn regress(summary: &Summary, method: Method, measured: &Measured) {
    let figures = &summary.positioning[&method];
    assert_eq!(figures.wrong_uid, 0, "{method:?}");
    let ErrorStatistics { mean, p95, .. } = figures.error_m.unwrap();
    assert!(mean < ROOM * measured.mean_m, "{method:?}: mean {mean} m");
    assert!(p95 < ROOM * measured.p95_m, "{method:?}: p95 {p95} m");
    let nees = figures.nees_mean.unwrap();
    let right = measured.nees_mean.min(1.0) / ROOM..measured.nees_mean * ROOM;
    assert!(right.contains(&nees), "{method:?}: nees_mean {nees}");
}

/// Error of every fix of the paper's method, with the distance of its lamp.
#[derive(Default)]
struct ErrorByDistance(Vec<(f64, f64)>);

impl Observer for ErrorByDistance {
    fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
        if let Event::Pair {
            report,
            true_chainages_m: truths_m,
            ..
        } = event
        {
            let fixes = report.fixes.iter().zip(*truths_m);
            self.0
                .extend(fixes.filter(|(fix, _)| fix.method == Method::Stereo).map(
                    |(fix, truth_m)| (fix.lamp_in_camera.norm(), (fix.chainage_m - truth_m).abs()),
                ));
        }
        Ok(())
    }
}

/// The paper's static test: its largest error is 0.2973 m. Provokes: lamps read wrong, biased
/// centres, a mount or map with the wrong sign, an error that does not fall as stereo gets better.
#[test]
fn val_static_bench() {
    let mut errors = ErrorByDistance::default();
    let summary = figures(&scenario("static_bench", &[]), &mut errors);
    let max_m = |method| summary.positioning[&method].error_m.unwrap().max;
    for method in [Method::Stereo, Method::Mono] {
        assert_eq!(summary.positioning[&method].fixes, 200);
    }
    assert!(max_m(Method::Stereo) <= 0.2973);
    assert!(max_m(Method::Mono) <= 0.356);
    let stereo = Measured {
        mean_m: 0.0050,
        p95_m: 0.018,
        nees_mean: 0.45,
    };
    let mono = Measured {
        mean_m: 0.044,
        p95_m: 0.167,
        nees_mean: 3.2,
    };
    regress(&summary, Method::Stereo, &stereo);
    regress(&summary, Method::Mono, &mono);
    assert!(max_m(Method::Stereo) < ROOM * 0.035);
    let rms = |near_m: f64, far_m: f64| {
        let inside = errors.0.iter().filter(|e| (near_m..far_m).contains(&e.0));
        let (n, sum) = inside.fold((0, 0.0), |(n, sum), e| (n + 1, sum + e.1 * e.1));
        assert!(n >= 30, "only {n} fixes from {near_m} to {far_m} m");
        (sum / f64::from(n)).sqrt()
    };
    let (near, middle, far) = (rms(0.0, 5.0), rms(5.0, 8.0), rms(8.0, 20.0));
    println!("rms error: {near:.4} m under 5 m, {middle:.4} m to 8 m, {far:.4} m beyond");
    assert!(near < middle && middle < far);
}

/// Half a minute of the line at 60 km/h, through the first curve. The paper's mean at 60 km/h is
/// 0.1533 m.
#[test]
fn val_line_run_at_60_kmh() {
    let scenario = scenario(
        "line_run",
        &[
            "duration_s=30",
            "train.start_speed_kmh=60",
            "train.start_chainage_m=400",
        ],
    );
    let summary = figures(&scenario, &mut ErrorByDistance::default());
    let paper = &summary.positioning[&Method::Stereo];
    assert!(paper.uid_decode_rate.unwrap() >= 0.95);
    assert!(paper.error_m.unwrap().mean < 0.1533);
    // With errors of survey and calibration. One fix of `mono` is 1.2 m off.
    let stereo = Measured {
        mean_m: 0.030,
        p95_m: 0.077,
        nees_mean: 0.56,
    };
    let mono = Measured {
        mean_m: 0.044,
        p95_m: 0.147,
        nees_mean: 4.9,
    };
    regress(&summary, Method::Stereo, &stereo);
    regress(&summary, Method::Mono, &mono);
    // Measured: 0.990.
    for method in [Method::Stereo, Method::Mono] {
        assert!(summary.positioning[&method].availability.unwrap() > 0.97);
    }
}

/// The wayside paper's case, from the worker's first step to the standing train.
#[test]
fn val_forgotten_toolbox() {
    let summary = figures(
        &scenario("forgotten_toolbox", &[]),
        &mut ErrorByDistance::default(),
    );
    let wayside = summary.wayside.unwrap();
    let toolbox = wayside
        .obstacles
        .iter()
        .find(|o| o.name == "toolbox")
        .unwrap();
    // The worker stands and walks between camera and toolbox for some seconds. Measured: 5.1.
    assert!(toolbox.latency_s.unwrap() < 6.0);
    // The camera hangs 0.05 deg off its calibration, which is 0.2 m there.
    assert!(toolbox.distance_error_m.unwrap() < ROOM * 0.186);
    // What of the worker's shadows cannot be told from bodies, for the 27 s that he is there, half of
    // it a frame; and his last images, each held until ten frames have shown the bed there. Measured: 186 by
    // the picture, 179 by place.
    assert!(wayside.false_alarms <= 210, "{}", wayside.false_alarms);
    let misplaced = wayside.misplaced_alarms;
    assert!(misplaced <= 210, "{misplaced}");
    assert_eq!(wayside.obstacles.len(), 1);
    let protection = summary.protection.unwrap();
    assert!(!protection.collision);
    assert!(protection.brake_commanded_s.unwrap() > toolbox.first_detected_s.unwrap());
    assert!(protection.stopped_s.is_some());
    // Before it, and not needlessly far: the authority ends 25 m before the obstacle. Measured: 30.7.
    let margin_m = protection.stop_margin_m.unwrap();
    assert!((25.0..40.0).contains(&margin_m), "{margin_m} m");
}

/// How far off the position is that the train runs by (lamps, and the odometer between them), ten
/// times a second, whether there is a fix or not; not before a first one can be there.
#[derive(Default)]
struct ErrorByTime {
    said: Option<(SimTime, f64)>,
    errors_m: Vec<f64>,
}

impl Observer for ErrorByTime {
    fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
        match event {
            Event::Message { message, .. } => {
                if let Content::Protection(report) = &message.content {
                    self.said = report.position.map(|place| (report.time, place.s_m));
                }
            }
            Event::Train { truth, .. } => {
                let settled = truth.time.secs() > 3.0;
                if let Some((time, said_m)) = self.said.filter(|_| settled)
                    && time == truth.time
                {
                    self.errors_m.push((said_m - truth.chainage_m).abs());
                }
            }
            _ => {}
        }
        Ok(())
    }
}

/// Lamps out at random. Published for a vehicle with one LED receiver and an inertial unit: 0.09,
/// 0.11, 0.15 and 0.18 m in the mean with 0, 5.5, 11 and 22 % of the lamps out (Transportation
/// Research Record). Provokes: names that shift by one where a lamp is missing, a position that is
/// lost from one lamp to the next but one.
///
/// Prints the table: `cargo test --release --test sessions val_lamps_out -- --nocapture`.
#[test]
fn val_lamps_out() {
    println!("lamps out   error mean    p95    max   published   availability   read");
    for (share, published_m) in [(0.0, 0.09), (0.055, 0.11), (0.11, 0.15), (0.22, 0.18)] {
        let out = format!("faults.lamps=[{{share={share:?},fault={{kind='dead'}}}}]");
        let scenario = scenario(
            "line_run",
            &[
                "duration_s=23",
                "train.start_speed_kmh=60",
                "train.start_chainage_m=400",
                "stack.protection.initial_chainage_m=401",
                &out,
            ],
        );
        let mut errors = ErrorByTime::default();
        let summary = figures(&scenario, &mut errors);
        let error = ErrorStatistics::of(&mut errors.errors_m).unwrap();
        let paper = &summary.positioning[&Method::Stereo];
        let availability = paper.availability.unwrap();
        println!(
            "{:7.1} %   {:8.3} m {:6.3} {:6.3} {:9.2} m {:12.1} % {:7.1} %",
            100.0 * share,
            error.mean,
            error.p95,
            error.max,
            published_m,
            100.0 * availability,
            100.0 * paper.uid_decode_rate.unwrap(),
        );
        assert!(errors.errors_m.len() >= 199);
        assert_eq!(paper.wrong_uid, 0, "{share}");
        assert!(error.mean < published_m, "{share}: {} m", error.mean);
        // A lamp is in view for a little more than the way to the next one.
        assert!(availability > 0.97 - 1.2 * share, "{share}: {availability}");
    }
}
