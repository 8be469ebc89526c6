//! The train's run against its equation of motion, integrated apart from it (RK4):
//!
//! ```text
//! v' = traction - brake - (a + b v + c k v^2) - m/m' g mean of sin of the slope
//! ```
//!
//! with the mean over the bogies, m' the mass with rotating parts and k the tunnel's factor. What
//! curves take is creep, and not in it. Then adhesion, the mark and the energy book.

use super::*;
use crate::track::{Track, Tunnel};

const G_MPS2: f64 = model::G_MPS2;

/// Numbers of the equation of motion.
struct Motion<'a> {
    tunnel: &'a Tunnel,
    train: &'a TrainSettings,
    file: VehicleFile,
}

impl<'a> Motion<'a> {
    fn new(tunnel: &'a Tunnel, train: &'a TrainSettings) -> Self {
        Self {
            tunnel,
            train,
            file: train.vehicle_file.clone().unwrap(),
        }
    }

    /// Deceleration by gradient, and by what hinders either way: air and bearings.
    fn resistance_mps2(&self, head_m: f64, v: f64) -> (f64, f64) {
        let (t, b, g) = (self.train, &self.file.body, &self.file.bogie);
        let confined = match self.tunnel.first_track().sections.is_empty() {
            true => 1.0,
            false => t.tunnel_factor,
        };
        let mut rise = 0.0;
        for car in 0..t.cars {
            let middle_m = head_m - (f64::from(car) + 0.5) * b.length_m;
            for end in [0.5, -0.5] {
                let frame = self
                    .tunnel
                    .first_track()
                    .alignment
                    .at(middle_m + end * g.distance_m);
                rise += frame.slope.atan().sin() / f64::from(2 * t.cars);
            }
        }
        let share = G_MPS2 / (1.0 + self.file.wheelset.rotating_mass_share);
        let davis = t.davis_a_mps2 + t.davis_b_per_s * v + confined * t.davis_c_per_m * v * v;
        (share * rise, davis)
    }

    /// Chainage and speed after `until_s`, or where it stands after 5 s, with an effort (traction,
    /// brake) of the time.
    fn run(&self, until_s: f64, effort: impl Fn(f64) -> (f64, f64)) -> (f64, f64) {
        let dt = 0.002;
        // Slower than this, friction fades: the train stands.
        let standing = 0.005;
        let (mut s, mut v) = (
            self.train.start_chainage_m,
            self.train.start_speed_kmh / 3.6,
        );
        let rate = |t: f64, s: f64, v: f64| {
            let slope = self.tunnel.first_track().alignment.at(s).slope;
            let (traction, brake) = effort(t);
            let (gradient, friction) = self.resistance_mps2(s, v);
            let friction = (friction + brake) * (v / standing).clamp(-1.0, 1.0);
            (
                v / (1.0 + slope * slope).sqrt(),
                traction - gradient - friction,
            )
        };
        for k in 0..(until_s / dt).round() as usize {
            let t = dt * k as f64;
            let a = rate(t, s, v);
            let b = rate(t + 0.5 * dt, s + 0.5 * dt * a.0, v + 0.5 * dt * a.1);
            let c = rate(t + 0.5 * dt, s + 0.5 * dt * b.0, v + 0.5 * dt * b.1);
            let d = rate(t + dt, s + dt * c.0, v + dt * c.1);
            let sum = |a, b, c, d| dt / 6.0 * (a + 2.0 * (b + c) + d);
            s += sum(a.0, b.0, c.0, d.0);
            v += sum(a.1, b.1, c.1, d.1);
            if t > 5.0 && v < standing {
                break;
            }
        }
        (s, v)
    }
}

/// A line with tunnel walls: the real one's first cross-section all along.
fn in_tunnel(plain: Arc<Tunnel>) -> Arc<Tunnel> {
    let mut sections = chengdu().first_track().sections.clone();
    sections.truncate(1);
    Arc::new(Tunnel::of_one(Track {
        sections,
        ..Track::clone(plain.first_track())
    }))
}

fn chengdu() -> Arc<Tunnel> {
    let text = include_str!("../../../../tunnels/chengdu_line1.toml");
    Arc::new(Tunnel::from_toml(text).unwrap())
}

fn train(cars: u32, speed_kmh: f64) -> TrainSettings {
    let file = shipped("metro_b1_crush");
    TrainSettings {
        cars,
        start_chainage_m: 300.0,
        davis_a_mps2: 0.02,
        davis_c_per_m: 1.25e-5,
        ..free_car(file, speed_kmh)
    }
}

fn smooth(train: &TrainSettings) -> PhysicsSettings {
    on_track(train.clone(), IrregularityClass::None)
}

fn compare(what: &str, got: f64, want: f64, share: f64) {
    eprintln!(
        "{what}: {got:.3}, equation of motion {want:.3} ({:+.3} %)",
        100.0 * (got / want - 1.0)
    );
    assert!((got / want - 1.0).abs() < share, "{what}");
}

/// Grades that a long train covers two of.
fn hills() -> Arc<Tunnel> {
    let grade = |from_m, permille: f64, radius_m| Grade {
        from_m,
        slope: 1e-3 * permille,
        radius_m,
    };
    let grades = [
        grade(0.0, 2.0, 0.0),
        grade(500.0, -24.0, 5000.0),
        grade(1000.0, -5.0, 3000.0),
        grade(1500.0, 20.0, 5000.0),
    ];
    let plan = [PlanElement::straight(4000.0)];
    let alignment = Alignment::new(Point3::origin(), 0.4, &plan, &grades);
    Arc::new(Tunnel::of_one(Track::bare("hills", alignment)))
}

/// Fails where running resistance, the tunnel's air, gradients or rotating parts are wrong
/// or forgotten: a train coasts in the open, in a tunnel, on a gradient, over hills.
#[test]
fn val_coasting() {
    let lines = [
        ("in the open", straight(4000.0), 2, 60.0, 90.0),
        ("in a tunnel", in_tunnel(straight(4000.0)), 2, 80.0, 90.0),
        (
            "down 30 permille",
            line(&[PlanElement::straight(4000.0)], -0.03),
            2,
            10.0,
            40.0,
        ),
        (
            "up 30 permille",
            line(&[PlanElement::straight(4000.0)], 0.03),
            2,
            90.0,
            60.0,
        ),
        ("over hills", hills(), 6, 60.0, 90.0),
    ];
    for (what, tunnel, cars, kmh, seconds) in lines {
        let train = train(cars, kmh);
        let mut world = World::new(tunnel.clone(), &smooth(&train), 1, 0).unwrap();
        for _ in 0..(1000.0 * seconds) as usize {
            coast(&mut world);
        }
        let state = world.train(TRAIN).unwrap();
        let (s, v) = Motion::new(&tunnel, &train).run(seconds, |_| (0.0, 0.0));
        compare(&format!("{what}, speed m/s"), state.speed_mps, v, 0.0025);
        compare(
            &format!("{what}, way m"),
            state.chainage_m - 300.0,
            s - 300.0,
            0.0025,
        );
        // The speed that is lost or won, apart from what the train had.
        let start = kmh / 3.6;
        compare(
            &format!("{what}, change m/s"),
            state.speed_mps - start,
            v - start,
            0.01,
        );
    }
}

/// Fails where traction does not come with the driver's jerk, or on the wrong mass: from standstill
/// on a gradient, in a tunnel.
#[test]
fn val_starting() {
    for slope in [0.0, -0.02, 0.028] {
        let tunnel = in_tunnel(line(&[PlanElement::straight(3000.0)], slope));
        let train = TrainSettings {
            cruise_speed_kmh: 80.0,
            ..train(2, 0.0)
        };
        let mut world = World::new(tunnel.clone(), &smooth(&train), 1, 0).unwrap();
        run(&mut world, 14.0, &go());
        let state = world.train(TRAIN).unwrap();
        let motion = Motion::new(&tunnel, &train);
        // From the full service brake over zero to the full traction, at the driver's jerk.
        let lever = |t: f64| (0.75 * t - 1.0).min(1.0);
        let effort = |t: f64| (lever(t).max(0.0), (-lever(t)).max(0.0));
        let (s, v) = motion.run(14.0, effort);
        compare(
            &format!("starting at {slope}, speed m/s"),
            state.speed_mps,
            v,
            0.0025,
        );
        compare(
            &format!("starting at {slope}, way m"),
            state.chainage_m - 300.0,
            s - 300.0,
            0.0025,
        );
    }
}

/// Fails where a brake builds up too fast or too slowly, is too strong or too weak, or a stopped
/// train does not stay: service and emergency brake, level, down and up.
#[test]
fn val_braking_distance() {
    for (brake, full, build_up_s) in [
        (BrakeDemand::Service, 1.0, 1.0),
        (BrakeDemand::Emergency, 1.3, 1.5),
    ] {
        for slope in [0.0, -0.03, 0.03] {
            let tunnel = in_tunnel(line(&[PlanElement::straight(3000.0)], slope));
            let train = TrainSettings {
                restart_after_s: 0.0,
                ..train(2, 80.0)
            };
            let mut world = World::new(tunnel.clone(), &smooth(&train), 1, 0).unwrap();
            run(&mut world, 40.0, &command(brake, 200.0));
            let state = world.train(TRAIN).unwrap();
            let ramp = |t: f64| (0.0, full * (t / build_up_s).min(1.0));
            let (s, _) = Motion::new(&tunnel, &train).run(100.0, ramp);
            compare(
                &format!("{brake:?} at {slope}, m"),
                state.chainage_m - 300.0,
                s - 300.0,
                0.0025,
            );
            assert!(state.standing);
            let stood = state.chainage_m;
            run(&mut world, 5.0, &command(brake, 200.0));
            assert!((world.train(TRAIN).unwrap().chainage_m - stood).abs() < 1e-3);
            run(&mut world, 10.0, &go());
            assert!(
                world.train(TRAIN).unwrap().speed_mps > 1.0,
                "does not start again"
            );
        }
    }
}

/// Fails where the driver stops off the mark: speeds, gradients, wet rails.
#[test]
fn val_stop_mark() {
    let mut worst = (0.0f64, String::new());
    for rail in [RailState::Dry, RailState::Wet] {
        for slope in [-0.028, 0.0, 0.028] {
            for (kmh, cars) in [(25.0, 1), (60.0, 2), (80.0, 1)] {
                let train = TrainSettings {
                    stop_at_m: Some(850.0),
                    ..train(cars, kmh)
                };
                let mut settings = smooth(&train);
                settings.track.rail = rail;
                let tunnel = line(&[PlanElement::straight(3000.0)], slope);
                let mut world = World::new(tunnel, &settings, 1, 0).unwrap();
                while !world.train(TRAIN).unwrap().standing && world.time().secs() < 120.0 {
                    run(&mut world, 0.1, &go());
                }
                // Stopped short, the driver draws up.
                run(&mut world, 6.0, &go());
                let state = world.train(TRAIN).unwrap();
                let off = state.chainage_m - 850.0;
                let what = format!(
                    "{rail:?} rails, {:+.0} permille, {kmh} km/h: {off:+.3} m",
                    1e3 * slope
                );
                eprintln!("{what}");
                assert!(state.standing, "{what}");
                if off.abs() > worst.0.abs() {
                    worst = (off, what);
                }
            }
        }
    }
    eprintln!("worst: {}", worst.1);
    assert!(worst.0.abs() < 0.02);
}

/// Fails where a train that cannot stop at the mark any more takes power behind it.
#[test]
fn regress_past_the_mark_it_stops() {
    let train = TrainSettings {
        stop_at_m: Some(400.0),
        ..train(1, 80.0)
    };
    let mut world = World::new(straight(3000.0), &smooth(&train), 1, 0).unwrap();
    run(&mut world, 60.0, &go());
    let state = world.train(TRAIN).unwrap();
    eprintln!(
        "marked 100 m ahead at 80 km/h, stands {:.1} m past",
        state.chainage_m - 400.0
    );
    // Full service brake from 80 km/h takes 247 m, and its lever 1.3 s.
    assert!(state.standing && (120.0..200.0).contains(&(state.chainage_m - 400.0)));
}

/// Largest share of its load that a wheel passes on at a speed, by Polach's law, over creepage.
fn peak(rail: RailState, v: f64, load_n: f64) -> f64 {
    let (mu0, fall, adhering, slipping) = match rail {
        RailState::Dry => (0.55, 0.6, 1.0, 0.4),
        RailState::Wet => (0.30, 0.2, 0.3, 0.1),
        RailState::LeafFilm => (0.05, 0.2, 0.3, 0.1),
    };
    let share = |creepage: f64| {
        let mu = mu0 * (0.6 * f64::exp(-fall * creepage * v) + 0.4);
        let e = std::f64::consts::FRAC_PI_4 * 8.24e6 * creepage / (mu * load_n);
        let a = adhering * e;
        2.0 * mu / std::f64::consts::PI * (a / (1.0 + a * a) + (slipping * e).atan())
    };
    (1..2000)
        .map(|k| share(2.5e-4 * f64::from(k)))
        .fold(0.0, f64::max)
}

/// Fails where wheels brake harder than friction lets them, lock in spite of slide protection, or
/// do not use what there is: emergency brake from 60 km/h on dry, wet and leaf-filmed rails.
#[test]
fn val_braking_on_slippery_rails() {
    let file = shipped("metro_b1_crush");
    let total_kg = file.body.mass_kg + 2.0 * file.bogie.mass_kg + 4.0 * file.wheelset.mass_kg;
    let start = 60.0 / 3.6;
    let mut distances = Vec::new();
    for rail in [RailState::Dry, RailState::Wet, RailState::LeafFilm] {
        let train = TrainSettings {
            davis_a_mps2: 0.0,
            davis_c_per_m: 0.0,
            ..train(2, 60.0)
        };
        let mut settings = smooth(&train);
        settings.track.rail = rail;
        let mut world = World::new(straight(3000.0), &settings, 1, 0).unwrap();
        let (mut sliding, mut looks, mut deepest, mut over) = (0.0, 0.0, 0.0f64, 0.0f64);
        for _ in 0..1500 {
            run(&mut world, 0.1, &command(BrakeDemand::Emergency, 200.0));
            let v = consist(&world).speed_mps();
            for wheel in consist(&world)
                .wheelsets
                .iter()
                .map(|w| w.forces)
                .filter(|_| v > 3.0)
            {
                looks += 1.0;
                sliding += f64::from(u8::from(wheel.slip_mps > 0.02 * v));
                deepest = deepest.max(wheel.slip_mps / v);
                let load_n: f64 = wheel.normal_n.iter().sum();
                over = over.max(-wheel.along_n / load_n / peak(rail, v, 0.5 * load_n));
            }
            if world.train(TRAIN).unwrap().standing {
                break;
            }
        }
        let distance = world.train(TRAIN).unwrap().chainage_m - 300.0;
        let most =
            (1..=100).map(|k| peak(rail, start * 0.01 * f64::from(k), total_kg * G_MPS2 / 8.0));
        let most = most.fold(0.0, f64::max) * G_MPS2;
        let least_m = start * start / (2.0 * most.min(1.3));
        eprintln!(
            "{rail:?}: {distance:.1} m, friction lets {least_m:.1} m; peak {:.3}; slides {:.0} % of the way, at most by {:.0} % of the speed; largest force {:.2} of the law's peak",
            most / G_MPS2,
            100.0 * sliding / looks,
            100.0 * deepest,
            over
        );
        assert!(world.train(TRAIN).unwrap().standing);
        assert!(over < 1.02 && distance > least_m && deepest < 0.95);
        // Protection hunts about the peak: it must use most of what there is.
        assert!(distance < 1.3 * least_m + start * 0.75);
        distances.push((distance, sliding / looks));
    }
    assert!(distances[0].1 < 0.01 && distances[2].1 > 0.5);
    assert!(distances[2].0 > 2.0 * distances[0].0);
}

/// Fails where a train starts harder than friction lets it: on a film of leaves it slips.
#[test]
fn val_starting_on_leaves() {
    let train = train(2, 0.0);
    let mut settings = smooth(&TrainSettings {
        cruise_speed_kmh: 60.0,
        ..train
    });
    settings.track.rail = RailState::LeafFilm;
    let mut world = World::new(straight(3000.0), &settings, 1, 0).unwrap();
    let mut slips = 0.0f64;
    for _ in 0..200 {
        run(&mut world, 0.1, &go());
        let least = consist(&world)
            .wheelsets
            .iter()
            .map(|w| w.forces)
            .map(|w| w.slip_mps);
        slips = slips.min(least.fold(0.0, f64::min));
    }
    let v = world.train(TRAIN).unwrap().speed_mps;
    eprintln!(
        "20 s on leaves: {v:.2} m/s, slips by up to {:.2} m/s",
        -slips
    );
    assert!(v < 0.05 * G_MPS2 * 20.0 && v > 0.2 * 0.05 * G_MPS2 * 20.0);
    assert!(slips < -0.1);
}

/// Fails where a force does work that no one books: the whole line, shaken, six cars, from station
/// to station.
#[test]
fn val_energy_over_the_line() {
    let train = TrainSettings {
        start_chainage_m: 195.0,
        cruise_speed_kmh: 60.0,
        stop_at_m: Some(2875.0),
        ..TrainSettings::default()
    };
    let settings = on_track(train, IrregularityClass::GermanLow);
    let mut world = World::new(chengdu(), &settings, 1, 0).unwrap();
    while world.time().secs() < 195.0 {
        run(&mut world, 1.0, &go());
    }
    let (state, book) = (world.train(TRAIN).unwrap(), world.energy(TRAIN).unwrap());
    eprintln!("stands at {:.3} m; {book:#?}", state.chainage_m);
    eprintln!(
        "gap {:.0} J, {:.3} % of what was turned over, {:.1} % of what dampers took",
        book.gap_j(),
        100.0 * book.gap_share(),
        100.0 * book.gap_j() / book.dampers_j
    );
    assert!(state.standing && (state.chainage_m - 2875.0).abs() < 0.02);
    assert!(book.gap_share() < 0.000_12);
    assert!(book.gap_j().abs() < 0.006 * (book.dampers_j + book.creep_j));
}
