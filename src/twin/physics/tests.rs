//! The whole world against closed forms and published figures.

#![allow(
    clippy::unwrap_used,
    clippy::float_cmp,
    clippy::print_stderr,
    reason = "tests may panic, compare bytes, and say what they measured"
)]

use super::driver::Effort;
use super::history::History;
use super::*;
use crate::bus::BrakeDemand;
use crate::track::{Alignment, Grade, PlanElement};
use crate::twin::sensors::{Imu, ImuSettings};
use nalgebra::{Matrix4, Point3};
use vehicle::{GRAVITY_MPS2, Vehicle};

fn car(name: &str) -> Vehicle {
    Vehicle::new(&VehicleFile::shipped(name).unwrap())
}

fn tunnel(elements: &[PlanElement], slope: f64) -> Arc<Tunnel> {
    let grade = Grade {
        from_m: 0.0,
        slope,
        radius_m: 0.0,
    };
    Arc::new(Tunnel {
        name: "test".to_owned(),
        alignment: Alignment::new(Point3::new(1000.0, 2000.0, 5.0), 0.4, elements, &[grade]),
        sections: Vec::new(),
        lamps: Vec::new(),
        wayside: Vec::new(),
        balises: Vec::new(),
        base_stations: Vec::new(),
        line_number: 1,
        stations: Vec::new(),
        ambient_lx: 0.0,
    })
}

fn straight() -> Arc<Tunnel> {
    tunnel(&[PlanElement::straight(3000.0)], 0.0)
}

/// One train on perfect track.
fn settings(train: TrainSettings) -> PhysicsSettings {
    PhysicsSettings {
        track: TrackSettings {
            irregularity: IrregularitySettings {
                class: IrregularityClass::None,
                ..IrregularitySettings::default()
            },
            ..TrackSettings::default()
        },
        train: Some(train),
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
        world.step(command).unwrap();
    }
}

/// Preloads that do not carry the weight, or a vehicle frame off its place, show here.
#[test]
fn stands_in_equilibrium() {
    let tunnel = straight();
    let mut world = World::new(tunnel.clone(), &settings(TrainSettings::default()), 1, 0).unwrap();
    run(&mut world, 2.0, &command(BrakeDemand::None, 0.0));
    let train = world.train().unwrap();
    let want = tunnel.alignment.at(150.0).world_from_rails();
    let off = want.inverse() * train.world_from_vehicle;
    assert!(off.translation.vector.norm() < 1e-6, "{off}");
    assert!(off.rotation.angle() < 1e-8);
    assert!((train.chainage_m - 150.0).abs() < 1e-6);
    assert!(train.standing && train.secondary_travel_m.abs() < 1e-6);
    assert_eq!(train.world_from_cars.len(), 6);
}

/// Bounce of a car on two springs in series with bogie masses between, by the eigenvalues of the
/// symmetric two-mass model, for both vehicles.
#[test]
fn val_bounce_frequency() {
    for set in ["manchester", "metro_b1_empty", "metro_b1_crush"] {
        let v = car(set);
        let (ks, cs) = (
            4.0 * v.secondary.stiffness_n_m.z,
            4.0 * v.secondary.damping_n_s_m.z,
        );
        let (kp, cp) = (
            8.0 * v.primary.stiffness_n_m.z,
            8.0 * v.primary.damping_n_s_m.z,
        );
        let (mc, mb) = (v.car.kg, 2.0 * v.bogie.kg);
        #[rustfmt::skip]
        let a = Matrix4::new(
            0.0, 0.0, 1.0, 0.0,
            0.0, 0.0, 0.0, 1.0,
            -ks / mc, ks / mc, -cs / mc, cs / mc,
            ks / mb, -(ks + kp) / mb, cs / mb, -(cs + cp) / mb,
        );
        let modes = a.complex_eigenvalues();
        let wanted = modes
            .iter()
            .filter(|m| m.im > 0.0)
            .map(|m| m.im)
            .fold(f64::MAX, f64::min);
        let mut world = World::new(
            straight(),
            &settings(TrainSettings {
                vehicle: set.to_owned(),
                cars: 1,
                ..TrainSettings::default()
            }),
            1,
            0,
        )
        .unwrap();
        let body = world.train.as_ref().unwrap().consist.handles[0];
        let rest = world.rapier.bodies[body].translation();
        world.rapier.bodies[body].set_translation(rest + Vector::Z * 0.005, true);
        // The car's state is read from the bodies after each step: once before the first.
        let now = world.time;
        world
            .train
            .as_mut()
            .unwrap()
            .consist
            .read(&world.rapier, now)
            .unwrap();
        let mut crossings = Vec::new();
        let mut before = 0.005;
        for k in 0..6000 {
            world.step(&command(BrakeDemand::None, 0.0)).unwrap();
            let z = world.rapier.bodies[body].translation().z - rest.z;
            if before < 0.0 && z >= 0.0 {
                crossings.push(f64::from(k) * 0.001 + 0.001 * -before / (z - before));
            }
            before = z;
        }
        let periods = crossings.len() - 1;
        let span = crossings[periods] - crossings[0];
        let got = std::f64::consts::TAU * periods as f64 / span;
        eprintln!(
            "{set}: bounce {:.4} Hz, closed form {:.4} Hz",
            got / std::f64::consts::TAU,
            wanted / std::f64::consts::TAU
        );
        assert!(periods >= 3 && (got / wanted - 1.0).abs() < 0.02);
    }
}

/// Resistance on the wrong mass, or rotating parts forgotten, change the speed after a minute.
#[test]
fn coasts_down_as_the_equation_of_motion() {
    let train = TrainSettings {
        start_speed_kmh: 60.0,
        cars: 2,
        jerk_mps3: 10.0,
        ..TrainSettings::default()
    };
    let mut world = World::new(straight(), &settings(train.clone()), 1, 0).unwrap();
    // Coasting: the driver's lever is taken out of his hand.
    let (mut v, dt) = (60.0 / 3.6, 1e-3);
    for _ in 0..20_000 {
        coast(&mut world);
        v -= dt * (train.davis_a_mps2 + train.davis_c_per_m * v * v);
    }
    let got = world.train().unwrap().speed_mps;
    assert!((got - v).abs() < 1e-3 * v, "{got} against {v} m/s");
}

/// A step without traction and brake.
fn coast(world: &mut World) {
    let (tunnel, dt_s) = (&world.tunnel, world.step_s);
    let line = Line::new(tunnel, &world.irregularity, &world.settings.track);
    let consist = &mut world.train.as_mut().unwrap().consist;
    consist.apply_forces(&mut world.rapier, tunnel, &line, Effort::default(), dt_s);
    world.go().unwrap();
}

/// On a gradient a train without resistance gains g sin over 1 + rotating share.
#[test]
fn rolls_down_a_gradient() {
    let train = TrainSettings {
        cars: 2,
        davis_a_mps2: 0.0,
        davis_c_per_m: 0.0,
        ..TrainSettings::default()
    };
    let line = tunnel(&[PlanElement::straight(3000.0)], -0.03);
    let mut world = World::new(line, &settings(train), 1, 0).unwrap();
    for _ in 0..10_000 {
        coast(&mut world);
    }
    let v = car("metro_b1_crush");
    let share = v.total_kg() / v.effective_kg();
    let want = GRAVITY_MPS2 * f64::sin(f64::atan(0.03)) * share * 10.0;
    let got = world.train().unwrap().speed_mps;
    assert!((got / want - 1.0).abs() < 2e-3, "{got} against {want} m/s");
}

/// Emergency brake from 80 km/h: build-up, then constant deceleration, then it stands.
#[test]
fn val_emergency_braking_distance() {
    let train = TrainSettings {
        cars: 2,
        start_chainage_m: 300.0,
        start_speed_kmh: 80.0,
        cruise_speed_kmh: 80.0,
        davis_a_mps2: 0.0,
        davis_c_per_m: 0.0,
        ..TrainSettings::default()
    };
    let mut world = World::new(straight(), &settings(train), 1, 0).unwrap();
    run(&mut world, 30.0, &command(BrakeDemand::Emergency, GO));
    let (v, a, t) = (80.0 / 3.6, 1.3, 1.5);
    let after = v - a * t / 2.0;
    let want = v * t - a * t * t / 6.0 + after * after / (2.0 * a);
    let state = world.train().unwrap();
    let got = state.chainage_m - 300.0;
    eprintln!("braking distance {got:.2} m, closed form {want:.2} m");
    assert!((got / want - 1.0).abs() < 0.01);
    assert!(state.standing);
    // It stays while the demand holds, whatever the driver would like.
    run(&mut world, 5.0, &command(BrakeDemand::Emergency, GO));
    assert!((world.train().unwrap().chainage_m - 300.0 - got).abs() < 1e-3);
    run(&mut world, 10.0, &command(BrakeDemand::None, GO));
    assert!(
        world.train().unwrap().speed_mps > 1.0,
        "does not start again"
    );
}

/// A standing train does not creep down a gradient.
#[test]
fn holds_on_a_gradient() {
    let line = tunnel(&[PlanElement::straight(3000.0)], 0.03);
    let mut world = World::new(line, &settings(TrainSettings::default()), 1, 0).unwrap();
    run(&mut world, 5.0, &command(BrakeDemand::None, 0.0));
    let a = world.train().unwrap().chainage_m;
    run(&mut world, 10.0, &command(BrakeDemand::None, 0.0));
    assert!((world.train().unwrap().chainage_m - a).abs() < 1e-4);
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
        world.step(&command(BrakeDemand::None, 50.0)).unwrap();
        let train = world.train.as_ref().unwrap();
        let now = train.effort.traction_mps2 - train.effort.brake_mps2;
        hardest = hardest.max((now - lever).abs() / 0.001);
        lever = now;
        fastest = fastest.max(train.consist.speed_mps());
    }
    let state = world.train().unwrap();
    eprintln!(
        "fastest {:.2} km/h of 50, stopped at {:.3} m of 900",
        3.6 * fastest,
        state.chainage_m
    );
    assert!(fastest < 50.0 / 3.6 && fastest > 46.0 / 3.6);
    assert!(hardest < 0.7501, "{hardest} m/s^3");
    assert!(state.standing && (state.chainage_m - 900.0).abs() < 0.3);
}

/// Steady curve: the inertial unit's lateral specific force is that of the curve less cant, times
/// 1 + s because the car leans out on its springs. UIC 505-1 allows a flexibility coefficient s of
/// 0.4; a car without roll bars has no less than 0.1.
#[test]
fn curve_quasi_static() {
    let (radius, cant, speed) = (400.0, 0.06, 60.0 / 3.6);
    let line = tunnel(&[PlanElement::arc(1800.0, 1.0 / radius, cant)], 0.0);
    let train = TrainSettings {
        start_speed_kmh: 60.0,
        cars: 2,
        ..TrainSettings::default()
    };
    let mut world = World::new(line.clone(), &settings(train), 1, 0).unwrap();
    run(&mut world, 30.0, &command(BrakeDemand::None, GO));
    let mut imu = Imu::new(&ImuSettings::ideal(), 1, 0);
    let mut lateral = 0.0;
    let mut yaw = 0.0;
    for k in 0..=200 {
        run(&mut world, 0.005, &command(BrakeDemand::None, GO));
        if let Some(sample) = imu.sample(&world) {
            assert!(k > 0);
            lateral += sample.accel_m_s2.y / 200.0;
            yaw += sample.gyro_rad_s.z / 200.0;
        }
    }
    let state = world.train().unwrap();
    let frame = line.alignment.at(state.chainage_m);
    let v = state.speed_mps;
    assert!((v - speed).abs() < 0.1);
    let y = frame.world_from_rails().rotation * Vector3::y();
    let wanted = v * v / radius * y.dot(&frame.left()) + GRAVITY_MPS2 * y.z;
    eprintln!("lateral {lateral:.4} m/s^2, in the rails' plane {wanted:.4}; yaw {yaw:.5} rad/s");
    assert!((1.1..1.4).contains(&(lateral / wanted)));
    assert!((yaw * radius / v - 1.0).abs() < 0.01);
    // Every car follows the curve: its ends are inside by the versine, no more.
    for car in &state.world_from_cars {
        let centre = car.translation.vector.into();
        let l = line
            .alignment
            .track_from_world(&centre, state.chainage_m)
            .l_m;
        assert!(l.abs() < 0.25, "{l} m off the centreline");
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
        train: Some(train),
        obstacles: vec![ObstacleSettings {
            chainage_m: 300.0,
            ..ObstacleSettings::default()
        }],
        ..PhysicsSettings::default()
    };
    let fly = |seed, index| {
        let mut world = World::new(straight(), &shaken, seed, index).unwrap();
        run(&mut world, 2.0, &command(BrakeDemand::None, GO));
        (world.train().unwrap(), world.bodies())
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
        train: Some(train),
        ..PhysicsSettings::default()
    };
    let mut world = World::new(straight(), &shaken, 1, 0).unwrap();
    run(&mut world, 2.0, &command(BrakeDemand::None, GO));
    let mut coarse = History::new(300);
    let mut between = Vec::new();
    for k in 0..500 {
        world.step(&command(BrakeDemand::None, GO)).unwrap();
        let motion = *world.vehicle_motion().unwrap();
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
    assert!(world.vehicle_at(world.time().plus(-0.3)).is_some());
    assert!(world.vehicle_at(world.time().plus(0.001)).is_none());
}

/// Ride of the Manchester car at 60 km/h on German low disturbance, beside a linear six-degree
/// vertical model (0.063 m/s^2 at the car's centre, 0.090 over the bogie, 0.3 to 30 Hz): here
/// without the band limits and with all degrees of freedom, so within a factor of two.
#[test]
fn val_vertical_ride() {
    let train = TrainSettings {
        vehicle: "manchester".to_owned(),
        start_speed_kmh: 60.0,
        cars: 1,
        davis_a_mps2: 0.0,
        davis_c_per_m: 0.0,
        ..TrainSettings::default()
    };
    let shaken = PhysicsSettings {
        train: Some(train),
        ..PhysicsSettings::default()
    };
    let mut world = World::new(straight(), &shaken, 4, 0).unwrap();
    let (mut centre, mut floor, mut bounce, mut n) = (0.0, 0.0, 0.0, 0.0);
    let mut before = 0.0;
    for k in 0..60_000 {
        coast(&mut world);
        let consist = &world.train.as_ref().unwrap().consist;
        let vz = consist.states[0].velocity.z;
        if k > 5000 {
            centre += ((vz - before) / 0.001).powi(2);
            floor += consist.floor_accel_mps2(0.001).z.powi(2);
            bounce += (consist.states[0].position.z - 6.8).powi(2);
            n += 1.0;
        }
        before = vz;
    }
    let [centre, floor, bounce] = [centre, floor, bounce].map(|x: f64| (x / n).sqrt());
    eprintln!(
        "60 km/h: centre {centre:.3} m/s^2, over bogie {floor:.3}, bounce {:.2} mm",
        1e3 * bounce
    );
    assert!((0.03..0.13).contains(&centre));
    assert!((0.045..0.18).contains(&floor));
    assert!((0.9..3.5).contains(&(1e3 * bounce)));
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
        train: Some(train.clone()),
        other_trains: vec![TrainSettings {
            start_chainage_m: 600.0,
            start_speed_kmh: 0.0,
            ..train
        }],
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
    let truth = |world: &World| (world.train(), world.bodies(), world.impacts().to_vec());
    for _ in 0..4 {
        let mut saved = through.clone();
        run(&mut through, 0.6, &go);
        assert_ne!(truth(&saved).0, truth(&through).0);
        run(&mut saved, 0.6, &go);
        assert_eq!(truth(&saved), truth(&through));
    }
    assert!(!through.impacts().is_empty());
}

/// A train that runs into another one that stands takes the momentum of a plastic hit, and it is
/// told as one; its driver is not warned.
#[test]
fn trains_collide() {
    let train = TrainSettings {
        start_speed_kmh: 20.0,
        cruise_speed_kmh: 20.0,
        cars: 2,
        ..TrainSettings::default()
    };
    let settings = PhysicsSettings {
        other_trains: vec![TrainSettings {
            start_chainage_m: 220.0,
            start_speed_kmh: 0.0,
            cruise_speed_kmh: 0.0,
            ..train.clone()
        }],
        ..settings(train)
    };
    let mut world = World::new(straight(), &settings, 1, 0).unwrap();
    let (head_m, length_m) = world.other_trains_m().next().unwrap();
    assert!((head_m - 220.0).abs() < 1e-3 && (length_m - 39.34).abs() < 1e-9);
    run(&mut world, 8.0, &command(BrakeDemand::None, GO));
    let hit = &world.impacts()[0];
    eprintln!("{hit:?}");
    assert_eq!(hit.with, "other train 1");
    // 30.66 m at 20 km/h.
    assert!((hit.time.secs() - 30.66 / (20.0 / 3.6)).abs() < 0.05);
    assert!((hit.speed_mps - 20.0 / 3.6).abs() < 0.05);
    // Within the hit the leading car of one meets the last car of the other.
    let v = car("metro_b1_crush");
    let most = 1.2 * v.total_kg() * 20.0 / 3.6;
    assert!((0.4 * most..most).contains(&hit.momentum_n_s));
    assert!(world.other_trains().next().unwrap().chainage_m > 220.0);
}

/// A state that is no number ends the run with the body's name.
#[test]
fn non_finite_state_is_reported() {
    let mut world = World::new(straight(), &PhysicsSettings::default(), 1, 0).unwrap();
    let body = world.train.as_ref().unwrap().consist.handles[14];
    world.rapier.bodies[body].set_linvel(Vector::new(f64::NAN, 0.0, 0.0), true);
    let failed = (0..5).find_map(|_| world.step(&TrainCommand::default()).err());
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
        train: Some(TrainSettings {
            cars: 9,
            ..TrainSettings::default()
        }),
        obstacles: vec![ObstacleSettings {
            mass_kg: -1.0,
            ..ObstacleSettings::default()
        }],
        ..PhysicsSettings::default()
    };
    wrong.check("x", &mut problems);
    let keys: Vec<&str> = problems.iter().map(|p| p.key.as_str()).collect();
    assert_eq!(keys, ["x.step_s", "x.train.cars", "x.obstacles[0].mass_kg"]);
    assert!(World::new(straight(), &wrong, 1, 0).is_err());
}

/// What traction puts in is kinetic, potential or known to be lost, whatever the train does: a force
/// that does work on the train and is in no account, or a force whose two ends do not meet, shows.
#[test]
fn val_energy_closes() {
    use IrregularityClass::{GermanHigh, None as Even};
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
        let mut world = World::new(tunnel(&[element], slope), &settings, 1, 0).unwrap();
        run(&mut world, 15.0, &command(brake, GO));
        let book = world.energy().unwrap();
        eprintln!("{name}: gap {:.5} %, {book:?}", 100.0 * book.gap_share());
        assert!(book.gap_share() < 5e-4, "{name}: {book:?}");
        // And the account that the case is about is not empty.
        let moved_j = match name {
            "coasting" => book.resistance_j,
            "starting" => book.traction_j,
            "braking" => book.brake_j,
            "shaken" => 100.0 * book.dampers_j,
            "climbing" => book.potential_j,
            _ => book.creep_j,
        };
        assert!(moved_j > 1e5, "{name}: {moved_j}");
    }
}

/// What a curve takes from the run, by creep and flanges, against the rule of Chinese traction
/// calculations (TB/T 1407), 600/R N/kN. Wheelsets that did not run against the outer rail, or
/// creep forces of the wrong sign or size, are off by more than the rule is rough: it is an average
/// over worn and new profiles, dry and greased rails.
#[test]
fn val_curve_resistance() {
    for (radius_m, kmh) in [(250.0, 45.0), (300.0, 50.0), (400.0, 60.0), (600.0, 60.0)] {
        let line = tunnel(&[PlanElement::arc(3000.0, 1.0 / radius_m, 0.06)], 0.0);
        let train = TrainSettings {
            start_speed_kmh: kmh,
            cruise_speed_kmh: kmh,
            cars: 1,
            ..TrainSettings::default()
        };
        let mut world = World::new(line, &settings(train), 1, 0).unwrap();
        run(&mut world, 10.0, &command(BrakeDemand::None, GO));
        let weight_kn = 1e-3 * GRAVITY_MPS2 * car("metro_b1_crush").total_kg();
        let run_m = world.train().unwrap().chainage_m - 150.0;
        let got = world.energy().unwrap().creep_j / run_m / weight_kn;
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
        let across = world.tunnel.alignment.at(0.0).left();
        let across = Vector::new(across.x, across.y, across.z);
        for handle in world.train.as_ref().unwrap().consist.handles.clone() {
            let body = &mut world.rapier.bodies[handle];
            body.set_linvel(body.linvel() + across * 0.05, true);
        }
        let mut swing = |seconds: f64| {
            let mut most_m = 0.0f64;
            for _ in 0..(1000.0 * seconds) as usize {
                world.step(&command(BrakeDemand::None, GO)).unwrap();
                let axle = world.train.as_ref().unwrap().consist.states[3].position;
                let line = &world.tunnel.alignment;
                let place = line.track_from_world(&convert::point3(axle), 300.0);
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
