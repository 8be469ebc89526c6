//! Figures over thousands of switches, on measurements without a simulated world: distance to identification,
//! classes, false certainty, calibration.
//!
//! Which leg of a switch is run is drawn. The satellite receiver has an error of 1 m on each axis, of which the greater
//! part changes slowly; speed has an error of scale and noise, the yaw rate an offset and noise. The map is off by half
//! as much again as the filter believes, each track and each toe by itself.
//! `cargo test --release --test sessions occupancy -- --nocapture` prints the tables.

mod line;
mod run;
mod tally;

use line::{ONE_IN_9, ONE_IN_12, ONE_IN_18_5, Turnout, line, map_of, two_tracks};
use metrotwin::stack::occupancy::{Method, OccupancySettings};
use metrotwin::track::plan::PlanNetwork;
use nalgebra::Matrix2;
use run::{AS_BELIEVED, FixErrors, Run, along_first, over_line};
use std::f64::consts::FRAC_1_SQRT_2;
use std::sync::Arc;
use tally::{Tally, table};

/// What is wrong with a map, and what the filter takes it for.
#[derive(Clone, Copy)]
struct MapErrors {
    sigma_m: f64,
    /// Distance of surveyed points.
    points_m: f64,
    believed_sigma_m: f64,
    believed_correlation_m: f64,
}

/// As the filter's defaults have it.
const MAP_AS_BELIEVED: MapErrors = MapErrors {
    sigma_m: 0.3,
    points_m: 120.0,
    believed_sigma_m: 0.3,
    believed_correlation_m: 40.0,
};
/// Half as far off again.
const MAP_WORSE: MapErrors = MapErrors {
    sigma_m: 0.45,
    ..MAP_AS_BELIEVED
};
const STAGES: usize = 42;
const SPEEDS_KMH: [f64; 5] = [20.0, 40.0, 60.0, 80.0, 100.0];
const WHITE: FixErrors = FixErrors {
    slow_share: 0.0,
    ..AS_BELIEVED
};

/// Runs that are alike but for their seeds and speeds.
#[derive(Clone, Copy)]
struct Runs<'a> {
    method: Method,
    errors: FixErrors,
    turnout: Turnout,
    map: MapErrors,
    speeds_kmh: &'a [f64],
    seeds: u64,
    with_gyro: bool,
    reversed: bool,
}

const FUSED: Runs<'_> = Runs {
    method: Method::Fused,
    errors: AS_BELIEVED,
    turnout: ONE_IN_9,
    map: MAP_WORSE,
    speeds_kmh: &SPEEDS_KMH,
    seeds: 4,
    with_gyro: true,
    reversed: false,
};

impl MapErrors {
    fn believed(&self) -> OccupancySettings {
        OccupancySettings {
            map_sigma_m: self.believed_sigma_m,
            map_correlation_m: self.believed_correlation_m,
            ..OccupancySettings::default()
        }
    }

    fn map_of(&self, world: &PlanNetwork, seed: u64) -> PlanNetwork {
        map_of(world, (self.sigma_m, self.points_m), seed)
    }
}

impl Runs<'_> {
    fn tally(&self) -> Tally {
        let world = line(&self.turnout, STAGES);
        let settings = OccupancySettings {
            method: self.method,
            ..self.map.believed()
        };
        let mut tally = Tally::default();
        tally.parallel_from_m = self.turnout.change_m() + 5.0;
        for seed in 0..self.seeds {
            let map = Arc::new(self.map.map_of(&world, seed));
            for speed_kmh in self.speeds_kmh {
                let run = Run {
                    errors: self.errors,
                    speed_mps: speed_kmh / 3.6,
                    seed,
                    with_gyro: self.with_gyro,
                    reversed: self.reversed,
                };
                over_line((&world, Arc::clone(&map)), &settings, &run, &mut tally);
            }
        }
        tally
    }

    /// The published method and its baseline, which take no yaw rate.
    fn published(&self, name: &str) -> [(String, Tally); 2] {
        [Method::Perpendicular, Method::Pedal].map(|method| {
            let runs = Self {
                method,
                with_gyro: false,
                ..*self
            };
            (format!("{}, {name}", method.name()), runs.tally())
        })
    }
}

/// Beside the published table (Guo et al. 2020: 40 switches, mean 37.6 m at best, most 53 m; perpendicular match 39.6
/// and 55 m), on errors that change slowly.
#[test]
fn val_legs_are_told_soon_and_never_wrong_with_certainty() {
    let by_speed = SPEEDS_KMH.map(|speed_kmh| {
        let runs = Runs {
            speeds_kmh: &[speed_kmh],
            seeds: 20,
            ..FUSED
        };
        (format!("fused, {speed_kmh} km/h"), runs.tally())
    });
    let reversed = Runs {
        reversed: true,
        ..FUSED
    };
    let no_yaw_rate = Runs {
        with_gyro: false,
        ..FUSED
    };
    let others = [
        ("fused, reversed".to_owned(), reversed.tally()),
        ("fused, no yaw rate".to_owned(), no_yaw_rate.tally()),
    ];
    table("1 in 9, errors that change slowly", &by_speed);
    table("1 in 9, other runs", &others);
    let mut all = Tally::default();
    for (_, of) in by_speed {
        all.extend(of);
    }
    let (of, never) = (all.distances(), all.never());
    all.print("fused");
    let parallel = all.parallel_right();
    assert!(all.switches.len() >= 4000 && all.fixes() >= 100_000);
    assert!(
        of.mean_of_identified < 30.0 && of.most < 60.0,
        "{} {}",
        of.mean_of_identified,
        of.most
    );
    assert!(parallel > 0.999, "{parallel}");
    assert!(
        all.right() > 0.999 && never < 0.01,
        "{} {never}",
        all.right()
    );
    assert_eq!(all.classes[0], 0, "wrong with certainty");
    for (name, of) in &others {
        assert_eq!(of.classes[0], 0, "{name}: wrong with certainty");
    }
    assert!(others[0].1.right() > 0.999);
    assert!((0.5..1.5).contains(&all.nees()), "{}", all.nees());
}

/// The published matches, on errors that change slowly, on white ones, as they take them to be, and with long ellipses.
#[test]
fn val_published_matches_tell_legs_where_errors_are_white() {
    let diagonal = Matrix2::new(1.0, -1.0, 1.0, 1.0) * FRAC_1_SQRT_2;
    let long = FixErrors {
        // 2.5 m along one diagonal, 0.6 m along the other.
        covariance_m2: diagonal * Matrix2::new(6.25, 0.0, 0.0, 0.36) * diagonal.transpose(),
        ..WHITE
    };
    let of = |errors, name| Runs { errors, ..FUSED }.published(name);
    let rows = [
        of(AS_BELIEVED, "slow"),
        of(WHITE, "white"),
        of(long, "long ellipse"),
    ];
    let rows: Vec<_> = rows.into_iter().flatten().collect();
    table("1 in 9, matches", &rows);
    for (name, of) in &rows[2..4] {
        let p95_m = of.distances().p95;
        assert!(of.right() > 0.99 && p95_m < 250.0, "{name}: {p95_m}");
    }
}

/// Turn-outs that allow the speed: the farther the legs run side by side at first, the later they are told.
#[test]
fn val_turnouts_that_fit_the_speed() {
    let (mut rows, mut published) = (Vec::new(), Vec::new());
    for (turnout, speeds_kmh) in [
        (ONE_IN_9, &SPEEDS_KMH[..2]),
        (ONE_IN_12, &SPEEDS_KMH[2..3]),
        (ONE_IN_18_5, &SPEEDS_KMH[3..]),
    ] {
        let runs = Runs {
            turnout,
            speeds_kmh,
            seeds: 10,
            ..FUSED
        };
        let good_map = Runs {
            map: MapErrors {
                sigma_m: 0.15,
                believed_sigma_m: 0.1,
                ..MAP_AS_BELIEVED
            },
            ..runs
        };
        rows.push((format!("fused, {}", turnout.name), runs.tally()));
        rows.push((format!("map of 0.1 m, {}", turnout.name), good_map.tally()));
        published.extend(Runs { seeds: 4, ..runs }.published(turnout.name));
    }
    table("turn-outs that fit the speed", &rows);
    table("the same by matches", &published);
    for (name, of) in &rows {
        assert_eq!(of.classes[0], 0, "{name}: wrong with certainty");
        assert!(of.right() > 0.99, "{name}: {}", of.right());
    }
}

/// Errors that are otherwise than believed, and jumps.
#[test]
fn val_other_errors_make_no_false_certainty() {
    let models = [
        (
            "over 20 s",
            FixErrors {
                correlation_s: 20.0,
                ..AS_BELIEVED
            },
        ),
        (
            "over 300 s",
            FixErrors {
                correlation_s: 300.0,
                ..AS_BELIEVED
            },
        ),
        (
            "nothing lasts",
            FixErrors {
                lasting_share: 0.0,
                ..AS_BELIEVED
            },
        ),
        (
            "all of it lasts",
            FixErrors {
                lasting_share: 1.0,
                ..AS_BELIEVED
            },
        ),
        (
            "all of it slow",
            FixErrors {
                slow_share: 0.99,
                ..AS_BELIEVED
            },
        ),
        (
            "jumps, 20 an hour",
            FixErrors {
                jumps_per_h: 20.0,
                ..AS_BELIEVED
            },
        ),
    ];
    let mut rows = Vec::new();
    for (name, errors) in models {
        for (with_gyro, by) in [(true, ""), (false, ", no yaw rate")] {
            let runs = Runs {
                errors,
                speeds_kmh: &[40.0, 80.0],
                with_gyro,
                ..FUSED
            };
            rows.push((format!("{name}{by}"), runs.tally()));
        }
    }
    table("other errors than believed", &rows);
    for (name, of) in &rows {
        assert_eq!(of.classes[0], 0, "{name}: wrong with certainty");
    }
}

/// Decisions are wrong no more often than they say, where errors are as believed: at switches with a yaw rate and
/// without, and beside a parallel track.
#[test]
fn val_probabilities_are_calibrated() {
    let as_believed = Runs {
        map: MAP_AS_BELIEVED,
        seeds: 10,
        ..FUSED
    };
    let no_yaw_rate = Runs {
        with_gyro: false,
        ..as_believed
    };
    for (title, of) in [
        ("switches", as_believed.tally()),
        ("switches, no yaw rate", no_yaw_rate.tally()),
        (
            "beside a parallel track",
            beside_a_parallel_track(MAP_AS_BELIEVED, 1000),
        ),
        // For ten minutes over 300 m: what lasts of a fix's error is as good as constant.
        (
            "creeping beside a parallel track",
            beside_at_speed(0.5, 340.0, MAP_AS_BELIEVED, 300),
        ),
    ] {
        of.calibration.print(title);
        let probability = of.calibration.least_probability();
        assert!(probability > 1e-3, "{title}: {probability}");
    }
}

/// Starts from nothing on one of two tracks that never meet.
fn beside_a_parallel_track(errors: MapErrors, seeds: u64) -> Tally {
    beside_at_speed(60.0 / 3.6, 3000.0, errors, seeds)
}

fn beside_at_speed(speed_mps: f64, length_m: f64, errors: MapErrors, seeds: u64) -> Tally {
    let world = two_tracks(length_m);
    let mut tally = Tally::default();
    for seed in 0..seeds {
        let run = Run {
            errors: AS_BELIEVED,
            speed_mps,
            seed,
            with_gyro: true,
            reversed: false,
        };
        let map = Arc::new(errors.map_of(&world, seed));
        along_first((&world, map), &errors.believed(), &run, &mut tally);
    }
    tally
}

/// Maps whose points are nearer to each other than the filter believes turn more than it believes. Where they are half as
/// far apart, or every 25 m and the filter is told, nothing wrong grows certain as long as the map is as good as it is said to
/// be; and behind switches not even where it is half as far off again. From nothing beside a parallel track such a map does
/// make wrong tracks certain, which is printed.
#[test]
fn val_maps_of_nearer_points() {
    let half_as_far = MapErrors {
        points_m: 60.0,
        ..MAP_AS_BELIEVED
    };
    let told = MapErrors {
        points_m: 25.0,
        believed_correlation_m: 8.0,
        ..MAP_AS_BELIEVED
    };
    let worse = |map: MapErrors| MapErrors {
        sigma_m: 0.45,
        ..map
    };
    let mut rows = Vec::new();
    for (name, map) in [("60 m, 120 m believed", half_as_far), ("25 m, told", told)] {
        for (sigma, map) in [("0.3 m", map), ("0.45 m", worse(map))] {
            let parallel = beside_a_parallel_track(map, 100);
            parallel
                .calibration
                .print(&format!("parallel, {sigma}, {name}"));
            rows.push((format!("parallel, {sigma}, {name}"), parallel));
            rows.push((format!("{sigma}, {name}"), Runs { map, ..FUSED }.tally()));
        }
    }
    table("1 in 9, distances of a map's points", &rows);
    let printed = [2, 6];
    for (k, (name, of)) in rows.iter().enumerate() {
        assert!(printed.contains(&k) || of.classes[0] == 0, "{name}");
    }
}

/// A start from nothing beside a parallel track, without a switch: fixes alone hardly tell the tracks, and nothing else
/// does; so nothing may grow certain that is wrong over 3 km.
#[test]
fn val_beside_a_parallel_track_nothing_wrong_grows_certain() {
    let tally = beside_a_parallel_track(MAP_WORSE, 300);
    let [wc, wf, wu, ns, cu, cf, cc] = tally.classes;
    println!(
        "\nfrom nothing beside a parallel track: wc {wc}, wf {wf}, wu {wu}, ns {ns}, cu {cu}, cf {cf}, cc {cc}"
    );
    (tally.calibration)
        .print("from nothing beside a parallel track, map half as far off again as believed");
    assert!(tally.fixes() > 250_000);
    assert_eq!(wc, 0, "wrong with certainty");
}
