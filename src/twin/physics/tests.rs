//! The whole world against closed forms and published figures.

#![allow(
    clippy::unwrap_used,
    clippy::float_cmp,
    clippy::print_stderr,
    reason = "tests may panic, compare bytes, and say what they measured"
)]

mod crossings;
mod directions;
mod obstacles;
mod switches;

use super::history::MotionHistory;
use super::*;
use crate::bus::{BrakeDemand, TrainEnd};
use crate::settings::Settings;
use crate::track::{Direction, PlanElement};
use testing::{TRAIN, line};
use vehicle::{GRAVITY_MPS2, Vehicle};

fn car(name: &str) -> Vehicle {
    Vehicle::new(VehicleFile::shipped(name).unwrap())
}

fn straight() -> Arc<Tunnel> {
    line(&[PlanElement::straight(3000.0)], 0.0)
}

/// One train on perfect track.
fn settings(train: TrainSettings) -> PhysicsSettings {
    on_even_track(vec![train])
}

fn on_even_track(trains: Vec<TrainSettings>) -> PhysicsSettings {
    PhysicsSettings {
        track: TrackSettings {
            irregularity: IrregularitySettings {
                class: IrregularityClass::None,
                ..IrregularitySettings::default()
            },
            ..TrackSettings::default()
        },
        trains,
        ..PhysicsSettings::default()
    }
}

fn command(brake: BrakeDemand, kmh: f64) -> TrainCommand {
    TrainCommand {
        brake,
        permitted_speed_mps: kmh / 3.6,
    }
}

const GO: f64 = 200.0;

fn run(world: &mut World, seconds: f64, command: &TrainCommand) {
    for _ in 0..(seconds * 1000.0).round() as usize {
        world.step(&[*command]).unwrap();
    }
}

/// Preloads that do not carry the weight, or a vehicle frame off its place, show here.
#[test]
fn stands_in_equilibrium() {
    let tunnel = straight();
    let mut world = World::new(tunnel.clone(), &settings(TrainSettings::default()), 1, 0).unwrap();
    run(&mut world, 2.0, &command(BrakeDemand::None, 0.0));
    let train = world.train(TRAIN).unwrap();
    let want = tunnel.first_track().alignment.at(150.0).world_from_rails();
    let off = want.inverse() * train.world_from_vehicle;
    assert!(off.translation.vector.norm() < 1e-6, "{off}");
    assert!(off.rotation.angle() < 1e-8);
    assert!((train.chainage_m - 150.0).abs() < 1e-6);
    assert!(train.standing && train.secondary_travel_m.abs() < 1e-6);
    assert_eq!(train.world_from_cars.len(), 6);
}

/// A standing train does not creep down a gradient.
#[test]
fn holds_on_a_gradient() {
    let line = line(&[PlanElement::straight(3000.0)], 0.03);
    let mut world = World::new(line, &settings(TrainSettings::default()), 1, 0).unwrap();
    run(&mut world, 5.0, &command(BrakeDemand::None, 0.0));
    let a = world.train(TRAIN).unwrap().chainage_m;
    run(&mut world, 10.0, &command(BrakeDemand::None, 0.0));
    assert!((world.train(TRAIN).unwrap().chainage_m - a).abs() < 1e-4);
}

/// The driver keeps under the permitted speed, within jerk and acceleration, and stops at the mark.
#[test]
fn driver_keeps_limits_and_stops_at_the_mark() {
    let train = TrainSettings {
        cars: 1,
        cruise_speed_kmh: 80.0,
        stop_at_m: Some(900.0),
        ..TrainSettings::default()
    };
    let mut world = World::new(straight(), &settings(train), 1, 0).unwrap();
    let (mut fastest, mut hardest) = (0.0f64, 0.0f64);
    let mut lever = -1.0;
    for _ in 0..100_000 {
        world.step(&[command(BrakeDemand::None, 50.0)]).unwrap();
        let train = &world.trains[0];
        let now = train.effort.traction_mps2 - train.effort.brake_mps2;
        hardest = hardest.max((now - lever).abs() / 0.001);
        lever = now;
        fastest = fastest.max(train.consist.speed_mps());
    }
    let state = world.train(TRAIN).unwrap();
    eprintln!(
        "fastest {:.2} km/h of 50, stopped at {:.3} m of 900",
        3.6 * fastest,
        state.chainage_m
    );
    assert!(fastest < 50.0 / 3.6 && fastest > 46.0 / 3.6);
    assert!(hardest < 0.7501, "{hardest} m/s^3");
    assert!(state.standing && (state.chainage_m - 900.0).abs() < 0.3);
}

/// On rough, jointed dry rails no wheel slides, and the protection must take none for sliding, from the start to
/// the emergency stop: it would be taken for a film of leaves over the next 500 m.
#[test]
fn no_false_slide_on_rough_rails() {
    let train = TrainSettings {
        cruise_speed_kmh: 65.0,
        ..TrainSettings::default()
    };
    let mut settings = settings(train);
    settings.track.irregularity.class = IrregularityClass::GermanHigh;
    settings.track.defects = vec![DefectSettings {
        track: None,
        shape: DefectShape::Joint {
            depth_m: 0.001,
            half_length_m: 0.5,
        },
        chainage_m: 160.0,
        side: RailSide::Both,
        every_m: Some(25.0),
        count: 50,
    }];
    let mut world = World::new(straight(), &settings, 1, 0).unwrap();
    let mut fastest_mps = 0.0f64;
    for (brake, steps) in [
        (BrakeDemand::None, 40_000),
        (BrakeDemand::Emergency, 25_000),
    ] {
        for _ in 0..steps {
            world.step(&[command(brake, GO)]).unwrap();
            fastest_mps = fastest_mps.max(world.trains[0].consist.speed_mps());
            let acts = |axle| world.wheel_protection_acts(TRAIN, axle).unwrap();
            assert!(!(0..24).any(acts), "{}", world.time());
        }
    }
    let train = world.train(TRAIN).unwrap();
    assert!(train.standing && 3.6 * fastest_mps > 60.0);
}

/// Trains that start at speed anywhere in a canted curve on level track: none is thrown off by the change of cant that
/// its first step finds.
#[test]
fn a_run_may_begin_in_a_canted_curve() {
    let text = "name = 'curve'\nplan = [\n\
        { kind = 'straight', length_m = 200.0 },\n{ kind = 'clothoid', length_m = 60.0 },\n\
        { kind = 'arc', length_m = 90.0, radius_m = 500.0, turn = 'left', cant_mm = 100.0 },\n\
        { kind = 'clothoid', length_m = 60.0 },\n{ kind = 'straight', length_m = 300.0 }]";
    let tunnel = Arc::new(Tunnel::from_toml(text).unwrap());
    for k in 0..12 {
        let train = TrainSettings {
            cars: 1,
            start_chainage_m: 280.0 + 17.0 * f64::from(k),
            start_speed_kmh: 60.0,
            ..TrainSettings::default()
        };
        let mut world = World::new(tunnel.clone(), &settings(train), 1, 0).unwrap();
        for _ in 0..100 {
            world.step(&[command(BrakeDemand::None, GO)]).unwrap();
        }
        let load = world.wheel_extremes(TRAIN).unwrap().least_normal_n;
        assert!(load > 10_000.0, "{k}: {load} N");
    }
}

/// Same seed, same bytes; another seed or run, another shake.
#[test]
fn determinism() {
    let train = TrainSettings {
        start_speed_kmh: 60.0,
        ..TrainSettings::default()
    };
    let shaken = PhysicsSettings {
        trains: vec![train],
        obstacles: vec![ObstacleSettings {
            chainage_m: 300.0,
            ..ObstacleSettings::default()
        }],
        ..PhysicsSettings::default()
    };
    let fly = |seed, index| {
        let mut world = World::new(straight(), &shaken, seed, index).unwrap();
        run(&mut world, 2.0, &command(BrakeDemand::None, GO));
        (world.train(TRAIN).unwrap(), world.bodies(Some(TRAIN)))
    };
    let a = fly(1, 0);
    assert_eq!(a, fly(1, 0));
    assert_ne!(a.0, fly(2, 0).0);
    assert_ne!(a.0, fly(1, 1).0);
}

/// Poses between the steps, against those of a run with the same shake at every other step only.
#[test]
fn pose_history_of_a_shaken_train() {
    let train = TrainSettings {
        start_speed_kmh: 80.0,
        cruise_speed_kmh: 80.0,
        cars: 1,
        ..TrainSettings::default()
    };
    let shaken = PhysicsSettings {
        trains: vec![train],
        ..PhysicsSettings::default()
    };
    let mut world = World::new(straight(), &shaken, 1, 0).unwrap();
    run(&mut world, 2.0, &command(BrakeDemand::None, GO));
    let mut coarse = MotionHistory::new(300);
    let mut between = Vec::new();
    for k in 0..500 {
        world.step(&[command(BrakeDemand::None, GO)]).unwrap();
        let motion = *world.vehicle_motion(TRAIN, TrainEnd::Front).unwrap();
        if k % 2 == 0 {
            coarse.push(motion);
        } else {
            between.push(motion);
        }
    }
    let (mut worst_m, mut worst_rad) = (0.0f64, 0.0f64);
    for want in &between[..between.len() - 1] {
        let got = coarse.at(want.time).unwrap();
        let want = want.world_from_vehicle;
        worst_m = worst_m.max((got.translation.vector - want.translation.vector).norm());
        worst_rad = worst_rad.max(got.rotation.angle_to(&want.rotation));
    }
    eprintln!(
        "at twice the step: {:.2e} m, {:.2e} rad",
        worst_m, worst_rad
    );
    assert!(worst_m < 1e-4 && worst_rad < 5e-6);
    assert!(
        world
            .vehicle_at(TRAIN, TrainEnd::Front, world.time().plus(-0.3))
            .is_some()
    );
    assert!(
        world
            .vehicle_at(TRAIN, TrainEnd::Front, world.time().plus(0.001))
            .is_none()
    );
}

/// A world that was saved in the middle of a fall and a shake goes on in every byte as the one that
/// ran through: state that a copy forgets (contacts, sleep, springs, a driver's lever) shows.
#[test]
fn a_saved_world_goes_on_exactly() {
    let train = TrainSettings {
        start_speed_kmh: 60.0,
        cars: 2,
        ..TrainSettings::default()
    };
    let falling = |chainage_m, body| ObstacleSettings {
        body,
        chainage_m,
        height_m: 0.6,
        ..ObstacleSettings::default()
    };
    let ball = ObstacleShape::Sphere { diameter_m: 0.2 };
    let settings = PhysicsSettings {
        trains: vec![
            train.clone(),
            TrainSettings {
                start_chainage_m: 600.0,
                start_speed_kmh: 0.0,
                ..train
            },
        ],
        // The first is hit by the train, the others fall meanwhile.
        obstacles: vec![
            falling(175.0, ObstacleSettings::default().body),
            falling(300.0, ball),
            falling(310.0, ObstacleShape::Rock { diameter_m: 0.4 }),
        ],
        ..PhysicsSettings::default()
    };
    let go = command(BrakeDemand::None, 50.0);
    let mut through = World::new(straight(), &settings, 1, 0).unwrap();
    let truth = |world: &World| {
        (
            world.train(TRAIN),
            world.bodies(Some(TRAIN)),
            world.impacts().to_vec(),
        )
    };
    for _ in 0..4 {
        let mut saved = through.clone();
        run(&mut through, 0.6, &go);
        assert_ne!(truth(&saved).0, truth(&through).0);
        run(&mut saved, 0.6, &go);
        assert_eq!(truth(&saved), truth(&through));
    }
    assert!(!through.impacts().is_empty());
}

/// Two trains of two cars on straight track that meet, at line speeds in km/h, and their hits: of
/// the first, then of the second. Their ends are 30 m apart at the start.
fn crash(kmh: [f64; 2]) -> (World, [Impact; 2]) {
    let train = |kmh: f64, direction: Direction, start_chainage_m: f64| TrainSettings {
        direction,
        start_chainage_m,
        start_speed_kmh: kmh.abs(),
        cruise_speed_kmh: kmh.abs(),
        cars: 2,
        ..TrainSettings::default()
    };
    let length_m = train(0.0, Direction::Up, 0.0).length_m();
    let second = match kmh[1] < 0.0 {
        true => train(kmh[1], Direction::Down, 180.0),
        false => train(kmh[1], Direction::Up, 180.0 + length_m),
    };
    let mut settings = settings(train(kmh[0], Direction::Up, 150.0));
    settings.trains.push(second);
    let mut world = World::new(straight(), &settings, 1, 0).unwrap();
    let closing_mps = (kmh[0] - kmh[1]) / 3.6;
    for _ in 0..(1000.0 * (30.0 / closing_mps + 1.0)) as usize {
        world.step(&[]).unwrap();
    }
    let hits = world.impacts();
    assert_eq!(hits.len(), 2, "{hits:?}");
    let hits = [0, 1].map(|k| {
        hits.iter()
            .find(|hit| hit.train == TrainId(k))
            .unwrap()
            .clone()
    });
    (world, hits)
}

/// A train that runs into another one, that stands, runs the same way or comes against it, takes the
/// momentum of a nearly plastic hit, and both have the hit on record with the speed at which they
/// close and no more energy than they had.
#[test]
fn trains_collide() {
    for kmh in [[30.0, 0.0], [30.0, 15.0], [15.0, -15.0]] {
        let (world, hits) = crash(kmh);
        let closing_mps = (kmh[0] - kmh[1]) / 3.6;
        // Two like trains in a plastic hit share the momentum; in an elastic one they swap it.
        let most = car("metro_b1_crush").total_kg() * 2.0 * closing_mps;
        for (hit, with) in hits.iter().zip(["other train 1", "train"]) {
            eprintln!("{hit:?}");
            assert_eq!(hit.with, with);
            assert!((hit.time.secs() - 30.0 / closing_mps).abs() < 0.05);
            assert!((hit.speed_mps - closing_mps).abs() < 0.05);
            assert!((0.3 * most..most).contains(&hit.momentum_n_s));
            assert!(hit.energy_lost_j > 0.0 && hit.energy_lost_j < 0.25 * most * closing_mps);
        }
        assert!((hits[0].momentum_n_s - hits[1].momentum_n_s).abs() < 1e-6 * most);
        let speed = |id| world.train(TrainId(id)).unwrap().speed_mps;
        assert!(speed(0) < kmh[0] / 3.6 - 0.3 * closing_mps);
        assert!(speed(1) > kmh[1] / 3.6 + 0.3 * closing_mps);
    }
}

/// A state that is no number ends the run with the body's name.
#[test]
fn non_finite_state_is_reported() {
    let mut world = World::new(straight(), &PhysicsSettings::default(), 1, 0).unwrap();
    let body = world.trains[0].consist.handles[14];
    world.rapier.bodies[body].set_linvel(Vector::new(f64::NAN, 0.0, 0.0), true);
    let failed = (0..5).find_map(|_| world.step(&[TrainCommand::default()]).err());
    assert!(
        matches!(failed, Some(PhysicsError::NonFinite { .. })),
        "{failed:?}"
    );
}

/// Every wrong number is named with its key; good settings say nothing.
#[test]
fn check_names_the_keys() {
    let mut problems = Vec::new();
    PhysicsSettings::default().check("", &mut problems);
    assert!(problems.is_empty(), "{problems:?}");
    let wrong = PhysicsSettings {
        step_s: f64::NAN,
        trains: vec![
            TrainSettings {
                cars: 9,
                ..TrainSettings::default()
            };
            2
        ],
        obstacles: vec![ObstacleSettings {
            mass_kg: -1.0,
            ..ObstacleSettings::default()
        }],
        ..PhysicsSettings::default()
    };
    wrong.check("x", &mut problems);
    let keys: Vec<&str> = problems.iter().map(|p| p.key.as_str()).collect();
    assert_eq!(
        keys,
        [
            "x.step_s",
            "x.trains[0].cars",
            "x.trains[1].cars",
            "x.obstacles[0].mass_kg"
        ]
    );
    assert!(World::new(straight(), &wrong, 1, 0).is_err());
}

/// What traction puts in is kinetic, potential or known to be lost, whatever the train does: a force
/// that does work on the train and is in no account, or a force whose two ends do not meet, shows.
#[test]
fn val_energy_closes() {
    use IrregularityClass::{Fra4, GermanHigh, None as Even};
    let straight = PlanElement::straight(3000.0);
    let curve = PlanElement::arc(3000.0, 1.0 / 300.0, 0.06);
    for (name, from_kmh, to_kmh, brake, class, slope, element, rail) in [
        (
            "coasting",
            60.0,
            0.0,
            BrakeDemand::None,
            Even,
            0.0,
            straight,
            RailState::Dry,
        ),
        (
            "starting",
            0.0,
            70.0,
            BrakeDemand::None,
            Even,
            0.0,
            straight,
            RailState::Dry,
        ),
        (
            "braking",
            70.0,
            70.0,
            BrakeDemand::Service,
            Even,
            0.0,
            straight,
            RailState::Dry,
        ),
        (
            "sliding",
            70.0,
            70.0,
            BrakeDemand::Service,
            Even,
            0.0,
            straight,
            RailState::LeafFilm,
        ),
        (
            "shaken",
            60.0,
            60.0,
            BrakeDemand::None,
            GermanHigh,
            0.0,
            straight,
            RailState::Dry,
        ),
        (
            "rough",
            60.0,
            60.0,
            BrakeDemand::None,
            Fra4,
            0.0,
            straight,
            RailState::Dry,
        ),
        (
            "climbing",
            60.0,
            60.0,
            BrakeDemand::None,
            Even,
            0.02,
            straight,
            RailState::Dry,
        ),
        (
            "curving",
            60.0,
            60.0,
            BrakeDemand::None,
            Even,
            0.0,
            curve,
            RailState::Dry,
        ),
    ] {
        let train = TrainSettings {
            start_speed_kmh: from_kmh,
            cruise_speed_kmh: to_kmh,
            cars: 2,
            ..TrainSettings::default()
        };
        let mut settings = settings(train);
        settings.track.irregularity.class = class;
        settings.track.rail = rail;
        let mut world = World::new(line(&[element], slope), &settings, 1, 0).unwrap();
        run(&mut world, 15.0, &command(brake, GO));
        let book = world.energy(TRAIN).unwrap();
        eprintln!("{name}: gap {:.5} %, {book:?}", 100.0 * book.gap_share());
        assert!(book.gap_share() < 5e-4, "{name}: {book:?}");
        // Nor is it much of the smallest accounts, where these are not small against the brakes'.
        let small_j = book.dampers_j + book.creep_j;
        if matches!(name, "shaken" | "rough" | "curving") {
            assert!(
                book.gap_j().abs() < 0.02 * small_j,
                "{name}: {} J",
                book.gap_j()
            );
        }
        // And the account that the case is about is not empty.
        let moved_j = match name {
            "coasting" => book.resistance_j,
            "starting" => book.traction_j,
            "braking" => book.brake_j,
            "shaken" | "rough" => 100.0 * book.dampers_j,
            "climbing" => book.potential_j,
            _ => book.creep_j,
        };
        assert!(moved_j > 1e5, "{name}: {moved_j}");
    }
}

/// The train goes where the track goes: on a track that is crooked in long waves (40 to 80 m), axles
/// move aside with it, and the car body leans as it twists. Signs of alignment or cross level the
/// wrong way round, or a track that is even in these, show.
#[test]
fn follows_a_crooked_track() {
    let train = TrainSettings {
        start_speed_kmh: 30.0,
        cruise_speed_kmh: 30.0,
        cars: 1,
        ..TrainSettings::default()
    };
    let mut settings = settings(train);
    settings.track.irregularity = IrregularitySettings {
        class: IrregularityClass::GermanHigh,
        shortest_m: 40.0,
        longest_m: 80.0,
    };
    let mut world = World::new(straight(), &settings, 1, 0).unwrap();
    let (mut aside, mut lean) = (Vec::new(), Vec::new());
    for _ in 0..1200 {
        run(&mut world, 0.05, &command(BrakeDemand::None, GO));
        let consist = &world.trains[0].consist;
        let place = |k: usize| {
            let p = consist.states[k].position.into();
            world
                .tunnel
                .first_track()
                .alignment
                .track_from_world(&p, 300.0)
        };
        let axle = place(3);
        aside.push((
            world.trains[0].track.deviation_at(axle.s_m).left_m,
            axle.l_m,
        ));
        let across = consist.states[0].rotation * Vector::Y;
        let at = |k| world.trains[0].track.deviation_at(place(k).s_m).roll_rad;
        lean.push((0.5 * (at(1) + at(2)), across.z));
    }
    for (what, pairs) in [("aside", aside), ("lean", lean)] {
        let (xy, xx, yy) = pairs.iter().fold((0.0, 0.0, 0.0), |(xy, xx, yy), (x, y)| {
            (xy + x * y, xx + x * x, yy + y * y)
        });
        let (together, gain) = (xy / f64::sqrt(xx * yy), xy / xx);
        eprintln!("{what}: correlation {together:.3}, gain {gain:.3}");
        assert!(together > 0.8 && (0.6..1.8).contains(&gain), "{what}");
    }
}

/// What a curve takes from the run, by creep and flanges, against the rule of Chinese traction
/// calculations (TB/T 1407), 600/R N/kN. Wheelsets that did not run against the outer rail, or
/// creep forces of the wrong sign or size, are off by more than the rule is rough: it is an average
/// over worn and new profiles, dry and greased rails.
#[test]
fn val_curve_resistance() {
    for (radius_m, kmh) in [(250.0, 45.0), (300.0, 50.0), (400.0, 60.0), (600.0, 60.0)] {
        let line = line(&[PlanElement::arc(3000.0, 1.0 / radius_m, 0.06)], 0.0);
        let train = TrainSettings {
            start_speed_kmh: kmh,
            cruise_speed_kmh: kmh,
            cars: 1,
            ..TrainSettings::default()
        };
        let mut world = World::new(line, &settings(train), 1, 0).unwrap();
        run(&mut world, 10.0, &command(BrakeDemand::None, GO));
        let weight_kn = 1e-3 * GRAVITY_MPS2 * car("metro_b1_crush").total_kg();
        let run_m = world.train(TRAIN).unwrap().chainage_m - 150.0;
        let got = world.energy(TRAIN).unwrap().creep_j / run_m / weight_kn;
        let rule = 600.0 / radius_m;
        eprintln!("R {radius_m} m: {got:.2} N/kN, by the rule {rule:.2}");
        assert!((0.3..1.5).contains(&(got / rule)), "{got} against {rule}");
    }
}

/// A wheelset that is knocked aside comes back to the middle, at the top speed of the line and over
/// it: a train that hunts does not.
#[test]
fn runs_steadily_at_design_speed() {
    for name in ["metro_b1_empty", "metro_b1_crush", "manchester"] {
        let train = TrainSettings {
            vehicle: name.to_owned(),
            start_speed_kmh: 120.0,
            cruise_speed_kmh: 120.0,
            cars: 1,
            ..TrainSettings::default()
        };
        let mut world = World::new(straight(), &settings(train), 1, 0).unwrap();
        let across = world.tunnel.first_track().alignment.at(0.0).left();
        let across = Vector::new(across.x, across.y, across.z);
        for handle in world.trains[0].consist.handles.clone() {
            let body = &mut world.rapier.bodies[handle];
            body.set_linvel(body.linvel() + across * 0.05, true);
        }
        let mut swing = |seconds: f64| {
            let mut most_m = 0.0f64;
            for _ in 0..(1000.0 * seconds) as usize {
                world.step(&[command(BrakeDemand::None, GO)]).unwrap();
                let axle = world.trains[0].consist.states[3].position;
                let line = &world.tunnel.first_track().alignment;
                let place = line.track_from_world(&axle.into(), 300.0);
                most_m = most_m.max(place.l_m.abs());
            }
            most_m
        };
        let (first_m, _, last_m) = (swing(2.0), swing(8.0), swing(2.0));
        eprintln!(
            "{name}: {:.2} mm, after 10 s {:.3} mm",
            1e3 * first_m,
            1e3 * last_m
        );
        assert!(first_m > 5e-4 && last_m < 0.1 * first_m, "{name} hunts");
    }
}
