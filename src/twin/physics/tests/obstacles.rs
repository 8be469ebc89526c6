//! Obstacles, cables, workers and what the train does to them, against closed forms.

use super::*;
use crate::track::BED_M;
use nalgebra::{Point3, Vector3};

fn without_train() -> PhysicsSettings {
    PhysicsSettings {
        trains: Vec::new(),
        ..PhysicsSettings::default()
    }
}

/// A car at 36 km/h on perfect track with its head at 150 m, which nothing brakes but what it hits.
fn with_car() -> PhysicsSettings {
    let train = TrainSettings {
        start_speed_kmh: 36.0,
        cruise_speed_kmh: 36.0,
        cars: 1,
        davis_a_mps2: 0.0,
        davis_c_per_m: 0.0,
        ..TrainSettings::default()
    };
    settings(train)
}

fn run(world: &mut World, seconds: f64) {
    let go = TrainCommand {
        brake: BrakeDemand::None,
        permitted_speed_mps: 30.0,
    };
    for _ in 0..(seconds * 1000.0).round() as usize {
        world.step(&[go]).unwrap();
    }
}

/// Runs until the train has hit something, and its hit is over.
fn run_into(world: &mut World) -> Impact {
    for _ in 0..3000 {
        run(world, 0.001);
        if !world.impacts().is_empty() {
            break;
        }
    }
    run(world, 0.06);
    world.impacts().first().unwrap().clone()
}

/// Boxes, balls and cylinders fall on the bed and come to rest there, not in it.
#[test]
fn obstacles_come_to_rest_on_the_bed() {
    let bodies = [
        ObstacleShape::Box {
            size_m: [0.4, 0.25, 0.25],
        },
        ObstacleShape::Cylinder {
            diameter_m: 0.2,
            height_m: 0.3,
        },
        ObstacleShape::Sphere { diameter_m: 0.22 },
    ];
    let obstacles = bodies.iter().enumerate().map(|(k, body)| ObstacleSettings {
        name: format!("{k}"),
        body: body.clone(),
        chainage_m: 100.0 + 5.0 * k as f64,
        lateral_m: 0.2,
        height_m: 1.0,
        appears_s: 0.5 * k as f64,
        ..ObstacleSettings::default()
    });
    let settings = PhysicsSettings {
        trains: Vec::new(),
        obstacles: obstacles.collect(),
        ..PhysicsSettings::default()
    };
    let line = straight();
    let mut world = World::new(line.clone(), &settings, 1, 0).unwrap();
    assert_eq!(world.obstacles().count(), 1);
    run(&mut world, 0.2);
    // Free fall from 1 m over top of rail.
    let fallen = world.obstacles().next().unwrap();
    let height = fallen.world_from_body.translation.z - 5.0;
    assert!((height - (1.125 - 0.5 * GRAVITY_MPS2 * 0.04)).abs() < 2e-3);
    run(&mut world, 6.0);
    assert_eq!(world.obstacles().count(), 3);
    for (truth, half) in world.obstacles().zip([0.125, 0.15, 0.11]) {
        assert!(truth.resting_since.is_some(), "{} still moves", truth.name);
        let height = truth.world_from_body.translation.z - 5.0;
        assert!(
            (height - (BED_M + half)).abs() < 5e-3,
            "{} at {height} m",
            truth.name
        );
    }
}

/// A worker walks in with a toolbox, puts it down, walks out; it stays.
#[test]
fn worker_leaves_his_toolbox() {
    let at = |time_s, lateral_m| Waypoint {
        time_s,
        chainage_m: 200.0,
        lateral_m,
    };
    let toolbox = ObstacleSettings {
        name: "toolbox".to_owned(),
        ..ObstacleSettings::default()
    };
    let settings = PhysicsSettings {
        trains: Vec::new(),
        workers: vec![WorkerSettings {
            path: vec![at(1.0, 1.5), at(3.0, 0.0), at(5.0, 0.0), at(7.0, 1.5)],
            carries: Some(toolbox),
            puts_down_s: Some(4.0),
            ..WorkerSettings::default()
        }],
        ..PhysicsSettings::default()
    };
    let mut world = World::new(straight(), &settings, 1, 0).unwrap();
    assert!(world.bodies(Some(TRAIN)).is_empty());
    run(&mut world, 3.5);
    // Torso, head, two legs, and the box in his hand.
    assert_eq!(
        (world.bodies(Some(TRAIN)).len(), world.obstacles().count()),
        (5, 0)
    );
    run(&mut world, 1.0);
    assert_eq!(
        (world.bodies(Some(TRAIN)).len(), world.obstacles().count()),
        (5, 1)
    );
    run(&mut world, 3.0);
    assert_eq!(world.bodies(Some(TRAIN)).len(), 1);
    let left = world.obstacles().next().unwrap();
    assert!(left.resting_since.is_some() && (left.chainage_m - 200.0).abs() < 0.6);
}

/// What two bodies do that hit centrally: J = mu (1 + e) v, energy lost mu v^2 (1 - e^2) / 2. The
/// car counts with the mass that it has at the point of contact, 1 / (1/M + h^2/I).
#[test]
fn val_two_body_collision() {
    let file = VehicleFile::shipped(&TrainSettings::default().vehicle).unwrap();
    let v = Vehicle::new(file);
    for (mass_kg, restitution) in [(20.0, 0.9), (200.0, 0.1), (2000.0, 0.5)] {
        let ball = ObstacleSettings {
            name: "ball".to_owned(),
            body: ObstacleShape::Sphere { diameter_m: 1.0 },
            mass_kg,
            friction: 0.0,
            restitution,
            chainage_m: 160.5,
            // Falling, at the car's centre of gravity when it is hit after 1 s.
            height_m: v.car_cg_m - 0.5 + 0.5 * GRAVITY_MPS2,
            ..ObstacleSettings::default()
        };
        let settings = PhysicsSettings {
            obstacles: vec![ball],
            ..with_car()
        };
        let line = straight();
        let mut world = World::new(line.clone(), &settings, 1, 0).unwrap();
        let hit = run_into(&mut world);
        eprintln!("{hit:?}");
        let lever_m = world.obstacles().next().unwrap().height_m - v.car_cg_m;
        let inertia = v.car.kg_m2.y;
        let car_kg = 1.0 / (1.0 / v.car.kg + lever_m.powi(2) / inertia);
        let reduced_kg = 1.0 / (1.0 / mass_kg + 1.0 / car_kg);
        // The train has 0.1; of a contact the mean counts.
        let e = 0.5 * (restitution + 0.1);
        let closing: f64 = 10.0;
        let falling = GRAVITY_MPS2;
        assert!((hit.time.secs() - 1.0).abs() < 0.01);
        let whole = closing.hypot(falling);
        assert!(
            (hit.speed_mps / whole - 1.0).abs() < 0.01,
            "{}",
            hit.speed_mps
        );
        assert!((hit.energy_j / (0.5 * mass_kg * whole * whole) - 1.0).abs() < 0.02);
        let momentum = reduced_kg * (1.0 + e) * closing;
        assert!(
            (hit.momentum_n_s / momentum - 1.0).abs() < 0.02,
            "{momentum}"
        );
        let lost = 0.5 * reduced_kg * closing * closing * (1.0 - e * e);
        assert!((hit.energy_lost_j / lost - 1.0).abs() < 0.03, "{lost}");
        // The ball has what the train gave.
        let along = line.first_track().alignment.at(160.0).ahead();
        let ball = world.obstacles().next().unwrap();
        let gained = mass_kg * ball.velocity_mps.dot(&along);
        assert!((gained / hit.momentum_n_s - 1.0).abs() < 0.02, "{gained}");
    }
}

/// A train that hits a crate throws it and loses as much momentum as it gains, less what the bed's
/// friction takes meanwhile; and it does not run through it.
#[test]
fn the_train_loses_what_the_crate_gains() {
    let crate_of = ObstacleSettings {
        name: "crate".to_owned(),
        body: ObstacleShape::Box { size_m: [0.8; 3] },
        mass_kg: 500.0,
        // Well before the next seam of the ground, at which things stumble.
        chainage_m: 164.4,
        height_m: 0.0,
        ..ObstacleSettings::default()
    };
    let settings = PhysicsSettings {
        obstacles: vec![crate_of],
        ..with_car()
    };
    let line = straight();
    let mut world = World::new(line.clone(), &settings, 1, 0).unwrap();
    let hit = run_into(&mut world);
    eprintln!("{hit:?}");
    // The head runs from 150 m to the crate's near side at 164.0 m with 10 m/s.
    assert!((hit.time.secs() - 1.40).abs() < 0.01);
    assert!((hit.speed_mps - 10.0).abs() < 0.05);
    assert!((hit.energy_j - 25_000.0).abs() < 300.0);
    assert!((0.5 * hit.energy_j..hit.energy_j).contains(&hit.energy_lost_j));
    assert_eq!(
        (hit.with.as_str(), hit.damage),
        ("crate", Damage::Repairable)
    );
    let along = line.first_track().alignment.at(160.0).ahead();
    let gained = 500.0 * world.obstacles().next().unwrap().velocity_mps.dot(&along);
    // 0.6 m g for 60 ms are 177 N s.
    assert!((hit.momentum_n_s - gained - 90.0).abs() < 150.0, "{gained}");
    run(&mut world, 1.0);
    let head_m = world.train(TRAIN).unwrap().chainage_m;
    let crate_m = world.obstacles().next().unwrap().chainage_m;
    assert!(crate_m > head_m, "the train ran through it");
}

/// A barrel that rolls: v' = -c g / (1 + k), k = 1/2 of a full cylinder; it stops, and stays.
#[test]
fn a_barrel_rolls_to_a_stop() {
    let (speed, resistance) = (1.5, 0.05);
    let barrel = ObstacleSettings {
        body: ObstacleShape::Cylinder {
            diameter_m: 0.6,
            height_m: 0.9,
        },
        mass_kg: 180.0,
        rolling_resistance: resistance,
        restitution: 0.0,
        roll_deg: 90.0,
        chainage_m: 100.0,
        height_m: BED_M + 0.001,
        velocity_mps: [speed, 0.0, 0.0],
        // Up the line, a wheel turns forwards about the axis to the left.
        spin_rad_s: [0.0, speed / 0.3, 0.0],
        ..ObstacleSettings::default()
    };
    let settings = PhysicsSettings {
        obstacles: vec![barrel],
        ..without_train()
    };
    let mut world = World::new(straight(), &settings, 1, 0).unwrap();
    let slowing = resistance * GRAVITY_MPS2 / 1.5;
    run(&mut world, 2.0);
    let v = world.obstacles().next().unwrap().velocity_mps.norm();
    eprintln!(
        "after 2 s {v:.4} m/s, closed form {:.4}",
        speed - 2.0 * slowing
    );
    assert!((v - (speed - 2.0 * slowing)).abs() < 0.03);
    run(&mut world, 6.0);
    let barrel = world.obstacles().next().unwrap();
    let run_m = barrel.chainage_m - 100.0;
    let wanted_m = speed * speed / (2.0 * slowing);
    eprintln!("it ran {run_m:.3} m, closed form {wanted_m:.3} m");
    assert!((run_m / wanted_m - 1.0).abs() < 0.03);
    assert!(barrel.resting_since.is_some() && barrel.lateral_m.abs() < 0.05);
}

/// A panel on the wall is no obstacle until it comes loose; then it falls freely. Hinged at its
/// lower edge it topples about it first, with the acceleration of a leaning plate.
#[test]
fn a_panel_comes_loose() {
    let panel = ObstacleSettings {
        name: "panel".to_owned(),
        body: ObstacleShape::Box {
            size_m: [1.0, 0.03, 0.8],
        },
        mass_kg: 25.0,
        chainage_m: 100.0,
        lateral_m: 2.0,
        height_m: 2.0,
        // Its upper edge leans towards the track.
        roll_deg: 20.0,
        held_until_s: Some(1.0),
        ..ObstacleSettings::default()
    };
    let hinged = ObstacleSettings {
        name: "hinged".to_owned(),
        chainage_m: 110.0,
        hinge: Some(HingeSettings {
            edge: HingeEdge::Bottom,
            until_s: Some(1.5),
        }),
        ..panel.clone()
    };
    let settings = PhysicsSettings {
        obstacles: vec![panel, hinged],
        ..without_train()
    };
    let mut world = World::new(straight(), &settings, 1, 0).unwrap();
    assert_eq!(
        (world.bodies(Some(TRAIN)).len(), world.obstacles().count()),
        (2, 0)
    );
    let held = world.bodies(Some(TRAIN));
    run(&mut world, 0.999);
    assert_eq!(held, world.bodies(Some(TRAIN)));
    run(&mut world, 0.201);
    let heights: Vec<f64> = world.obstacles().map(|o| o.height_m).collect();
    let start = held[0].world_from_body.translation.z - 5.0;
    let fallen = start - heights[0];
    let t: f64 = 0.2;
    assert!(
        (fallen - 0.5 * GRAVITY_MPS2 * t * t).abs() < 3e-3,
        "{fallen}"
    );
    // About its edge: I = m (l^2 / 3 + d^2 / 12), moment m g (l / 2) sin(lean).
    let (length, lean) = (0.8f64, 20f64.to_radians());
    let k = GRAVITY_MPS2 * 0.5 * length / (length * length / 3.0 + 0.03f64.powi(2) / 12.0);
    let (mut angle, mut rate) = (lean, 0.0);
    for _ in 0..200 {
        rate += 1e-3 * k * f64::sin(angle);
        angle += 1e-3 * rate;
    }
    let hinged = world.obstacles().nth(1).unwrap();
    let up = hinged.world_from_body * Vector3::z();
    let got = up.z.acos();
    eprintln!("leans {got:.4} rad, closed form {angle:.4} rad");
    assert!((got - angle).abs() < 0.01);
    run(&mut world, 4.0);
    for panel in world.obstacles() {
        assert!(
            panel.resting_since.is_some() && panel.height_m < BED_M + 0.1,
            "{panel:?}"
        );
    }
}

/// The train tears off what is fixed within its gauge; it does not stop at it.
#[test]
fn the_train_tears_off_what_is_fixed() {
    let lamp = ObstacleSettings {
        name: "luminaire".to_owned(),
        body: ObstacleShape::Box {
            size_m: [0.6, 0.2, 0.1],
        },
        mass_kg: 8.0,
        chainage_m: 165.0,
        height_m: 3.0,
        held_until_s: Some(100.0),
        ..ObstacleSettings::default()
    };
    let settings = PhysicsSettings {
        obstacles: vec![lamp],
        ..with_car()
    };
    let mut world = World::new(straight(), &settings, 1, 0).unwrap();
    let hit = run_into(&mut world);
    eprintln!("{hit:?}");
    assert_eq!(hit.damage, Damage::Superficial);
    assert!((hit.time.secs() - 1.47).abs() < 0.01 && (hit.speed_mps - 10.0).abs() < 0.1);
    assert!(world.train(TRAIN).unwrap().speed_mps > 9.9);
    let lamp = world.obstacles().next().unwrap();
    assert!(lamp.velocity_mps.norm() > 9.0, "{lamp:?}");
}

/// A worker walks in with a toolbox, puts it down, picks it up again, and walks out with it.
#[test]
fn worker_picks_up_his_toolbox() {
    let at = |time_s, lateral_m| Waypoint {
        time_s,
        chainage_m: 200.0,
        lateral_m,
    };
    let settings = PhysicsSettings {
        workers: vec![WorkerSettings {
            path: vec![at(1.0, 1.5), at(3.0, 0.0), at(6.0, 0.0), at(8.0, 1.5)],
            carries: Some(ObstacleSettings::default()),
            puts_down_s: Some(3.5),
            picks_up_s: Some(5.5),
            ..WorkerSettings::default()
        }],
        ..without_train()
    };
    let mut world = World::new(straight(), &settings, 1, 0).unwrap();
    run(&mut world, 5.0);
    assert_eq!(
        (world.bodies(Some(TRAIN)).len(), world.obstacles().count()),
        (5, 1)
    );
    run(&mut world, 1.0);
    assert_eq!(
        (world.bodies(Some(TRAIN)).len(), world.obstacles().count()),
        (5, 0)
    );
    run(&mut world, 2.5);
    assert!(world.bodies(Some(TRAIN)).is_empty());
}

/// The train hits a worker with the mass of a man, not of a wall, and throws him.
#[test]
fn the_train_runs_a_worker_down() {
    let at = |time_s, lateral_m| Waypoint {
        time_s,
        chainage_m: 165.0,
        lateral_m,
    };
    let settings = PhysicsSettings {
        workers: vec![WorkerSettings {
            path: vec![at(0.0, 2.0), at(1.5, 0.0), at(9.0, 0.5)],
            ..WorkerSettings::default()
        }],
        ..with_car()
    };
    let mut world = World::new(straight(), &settings, 1, 0).unwrap();
    let hit = run_into(&mut world);
    eprintln!("{hit:?}");
    assert_eq!(hit.with, "worker");
    assert!((hit.time.secs() - 1.48).abs() < 0.02);
    // mu (1 + e) v with e = 0.05; hit off its centre, a tall body takes less at first, and its
    // other end the rest.
    let blow = 80.0 * 1.05 * 10.0;
    assert!((0.6 * blow..1.1 * blow).contains(&hit.momentum_n_s));
    assert!(world.train(TRAIN).unwrap().speed_mps > 9.9);
    run(&mut world, 2.0);
    let worker = world.workers().next().unwrap();
    assert!(worker.chainage_m > 170.0, "{worker:?}");
    assert_eq!(world.bodies(Some(TRAIN)).len(), 4);
}

fn hung(span_m: f64, length_m: f64) -> CableSettings {
    let end = |chainage_m| CableEnd {
        chainage_m,
        lateral_m: 2.0,
        height_m: 4.0,
        lets_go_s: None,
    };
    CableSettings {
        from: end(100.0),
        to: end(100.0 + span_m),
        length_m,
        ..CableSettings::default()
    }
}

fn with_cable(cable: CableSettings) -> PhysicsSettings {
    PhysicsSettings {
        cables: vec![cable],
        ..without_train()
    }
}

/// Lowest point of all that is drawn, over top of rail.
fn lowest_m(world: &World) -> f64 {
    let bodies = world.bodies(Some(TRAIN));
    let ends = bodies.iter().flat_map(|body| {
        let half = body.shape.half_extents_m().z;
        [half, -half].map(|z| (body.world_from_body * Point3::new(0.0, 0.0, z)).z)
    });
    ends.fold(f64::MAX, f64::min) - 5.0
}

/// A cable that was pushed aside comes back to rest on the catenary.
#[test]
fn val_a_cable_hangs_on_the_catenary() {
    let (span_m, length_m) = (6.0, 6.5);
    let mut world = World::new(straight(), &with_cable(hung(span_m, length_m)), 1, 0).unwrap();
    for link in &world.surroundings.cables[0].links {
        let body = world.rapier.bodies.get_mut(link.body).unwrap();
        body.set_linvel(Vector::new(0.6, 0.8, 0.5), true);
    }
    let hanging = world.bodies(Some(TRAIN));
    run(&mut world, 0.3);
    let moved = world
        .bodies(None)
        .iter()
        .zip(&hanging)
        .fold(0.0, |far: f64, (a, b)| {
            let [a, b] = [a, b].map(|body| body.world_from_body.translation.vector);
            far.max((a - b).norm())
        });
    run(&mut world, 60.0);
    // L = 2 a sinh(d / 2a), sag = a (cosh(d / 2a) - 1).
    let mut a = 3.0;
    for _ in 0..60 {
        let u = 0.5 * span_m / a;
        let f = 2.0 * a * f64::sinh(u) - length_m;
        a -= f / (2.0 * f64::sinh(u) - 2.0 * u * f64::cosh(u));
    }
    let sag = a * (f64::cosh(0.5 * span_m / a) - 1.0);
    let got = 4.0 - lowest_m(&world);
    eprintln!("sag {got:.4} m, catenary {sag:.4} m");
    // The pull at a length s from the lowest point is the weight of hypot(a, s).
    let cable = &world.surroundings.cables[0];
    let (weight, links) = (
        cable.settings.mass_kg_per_m * GRAVITY_MPS2,
        cable.links.len(),
    );
    for k in [1, links / 4, links / 2] {
        let s = length_m * (k as f64 / links as f64 - 0.5);
        let (pull, pulls) = (weight * a.hypot(s), cable.tension_n(&world.rapier, k));
        eprintln!("joint {k}: {pulls:.2} N, catenary {pull:.2} N");
        assert!((pulls / pull - 1.0).abs() < 0.05);
    }
    assert!(moved > 0.1, "was not pushed: {moved} m");
    assert!((got / sag - 1.0).abs() < 0.02);
    let awake = world.rapier.active_bodies().count();
    assert_eq!(awake, 0, "does not come to rest");
}

/// An end that lets go: the cable swings and hangs straight down from the other, with its whole
/// length.
#[test]
fn a_loose_end_hangs_straight() {
    let mut cable = hung(2.0, 3.0);
    cable.to.lets_go_s = Some(0.5);
    let mut world = World::new(straight(), &with_cable(cable), 1, 0).unwrap();
    run(&mut world, 0.4);
    assert_eq!(world.obstacles().count(), 0);
    run(&mut world, 60.0);
    let got = world.obstacles().next().unwrap();
    eprintln!("{got:?} {}", lowest_m(&world));
    assert!(((4.0 - lowest_m(&world)) / 3.0 - 1.0).abs() < 0.01);
    assert!(got.half_extents_m.xy().norm() < 0.05);
    assert!((got.chainage_m - 100.0).abs() < 0.02 && got.resting_since.is_some());
}

/// A train that runs into a hanging cable tears it and goes on.
#[test]
fn the_train_tears_a_cable() {
    let mut cable = hung(3.0, 5.0);
    for (end, chainage_m, lateral_m) in
        [(&mut cable.from, 165.0, 2.0), (&mut cable.to, 165.0, -2.0)]
    {
        end.chainage_m = chainage_m;
        end.lateral_m = lateral_m;
        end.height_m = 2.5;
    }
    let settings = PhysicsSettings {
        cables: vec![cable],
        ..with_car()
    };
    let mut world = World::new(straight(), &settings, 1, 0).unwrap();
    let hit = run_into(&mut world);
    eprintln!("{hit:?}");
    assert_eq!(hit.with, "cable");
    run(&mut world, 2.0);
    assert!(world.train(TRAIN).unwrap().speed_mps > 9.8);
    assert_eq!(world.obstacles().count(), 1, "it does not tear");
    for hit in world.impacts() {
        eprintln!("{hit:?}");
    }
    assert!(world.impacts().iter().all(|hit| hit.energy_j < 1000.0));
}

/// What lies still costs nothing to watch, and the same run gives the same bytes: a rock fall.
#[test]
fn a_rock_fall_comes_to_rest_the_same_way_twice() {
    let rocks = ObstacleSettings {
        name: "rock".to_owned(),
        body: ObstacleShape::Rock { diameter_m: 0.35 },
        mass_kg: 45.0,
        rolling_resistance: 0.1,
        chainage_m: 100.0,
        height_m: 2.0,
        count: 12,
        spread_m: [1.5, 0.6, 0.6],
        size_spread: 0.4,
        ..ObstacleSettings::default()
    };
    let settings = PhysicsSettings {
        obstacles: vec![rocks],
        ..without_train()
    };
    let fall = |seed| {
        let mut world = World::new(straight(), &settings, seed, 0).unwrap();
        run(&mut world, 8.0);
        assert_eq!(world.obstacles().count(), 12);
        assert!(world.obstacles().all(|o| o.resting_since.is_some()));
        assert!(world.obstacles().all(|o| o.height_m > BED_M));
        assert_eq!(world.rapier.active_bodies().count(), 0);
        world.bodies(Some(TRAIN))
    };
    let once = fall(1);
    assert_eq!(once, fall(1));
    assert_ne!(once, fall(2));
}
