//! Trains that run down the line, and several of them, against those that run up, and closed forms.

use super::*;
use crate::bus::TrainEnd;

fn run(world: &mut World, seconds: f64) {
    for _ in 0..(seconds * 1000.0).round() as usize {
        world.step(&[]).unwrap();
    }
}

/// A train that runs down a line has the speeds and the stop of one that runs up the reversed line: a
/// curve, grade, mark or speed that is taken the wrong way round shows.
#[test]
fn down_the_line_is_up_the_reversed_line() {
    let transition = |from: f64, to: f64| PlanElement {
        length_m: 60.0,
        start_per_m: from / 300.0,
        end_per_m: to / 300.0,
        start_cant_m: 0.06 * from,
        end_cant_m: 0.06 * to,
    };
    let bends = [
        PlanElement::straight(300.0),
        transition(0.0, 1.0),
        PlanElement::arc(80.0, 1.0 / 300.0, 0.06),
        transition(1.0, 0.0),
        PlanElement::straight(300.0),
    ];
    let tunnel = line(&bends, 0.01);
    let length_m = tunnel.first_track().alignment.length_m();
    let down = TrainSettings {
        direction: Direction::Down,
        start_chainage_m: 650.0,
        start_speed_kmh: 36.0,
        cruise_speed_kmh: 45.0,
        stop_at_m: Some(250.0),
        cars: 2,
        ..TrainSettings::default()
    };
    let up = TrainSettings {
        direction: Direction::Up,
        start_chainage_m: length_m - 650.0,
        stop_at_m: Some(length_m - 250.0),
        ..down.clone()
    };
    let reversed = Arc::new(Tunnel::of_one(tunnel.first_track().reversed()));
    let mut a = World::new(tunnel, &on_even_track(vec![down]), 1, 0).unwrap();
    let mut b = World::new(reversed, &on_even_track(vec![up]), 1, 0).unwrap();
    for _ in 0..90 {
        run(&mut a, 1.0);
        run(&mut b, 1.0);
        let (a, b) = (a.train(TRAIN).unwrap(), b.train(TRAIN).unwrap());
        assert_eq!((a.direction, b.direction), (Direction::Down, Direction::Up));
        assert!((a.speed_mps + b.speed_mps).abs() < 1e-9, "{}", a.speed_mps);
        assert!((a.accel_mps2 + b.accel_mps2).abs() < 1e-6);
        assert!((a.chainage_m + b.chainage_m - length_m).abs() < 1e-6);
        if a.standing {
            break;
        }
    }
    let (train, wheels) = (a.train(TRAIN).unwrap(), a.wheel_run_m(TRAIN, 0).unwrap());
    eprintln!("stopped at {:.3} m of 250", train.chainage_m);
    assert!(train.standing && (train.chainage_m - 250.0).abs() < 0.3);
    assert!((wheels - 400.0).abs() < 2.0, "{wheels}");
    assert_eq!(a.head(TRAIN).unwrap().s_m, train.chainage_m);
    assert_eq!(a.place_at(TRAIN, a.time()), a.head(TRAIN));
    let run_m = length_m - train.chainage_m;
    assert!((a.run_m(TRAIN).unwrap() - run_m).abs() < 1e-9);
}

/// A train that coasts down a grade gains what gravity gives, and loses it uphill, whichever way along
/// the line that is.
#[test]
fn a_grade_is_felt_by_the_way_of_the_run() {
    let coasting = |direction, start_chainage_m| TrainSettings {
        direction,
        start_chainage_m,
        start_speed_kmh: 50.0,
        davis_a_mps2: 0.0,
        davis_c_per_m: 0.0,
        cars: 1,
        ..TrainSettings::default()
    };
    let tunnel = line(&[PlanElement::straight(3000.0)], 0.02);
    let trains = vec![
        coasting(Direction::Up, 1000.0),
        coasting(Direction::Down, 2000.0),
    ];
    let mut world = World::new(tunnel, &on_even_track(trains), 1, 0).unwrap();
    for _ in 0..5000 {
        for train in &mut world.trains {
            let (track, effort) = (&train.track, driver::Effort::default());
            train
                .consist
                .apply_forces(&mut world.rapier, track, effort, world.step_s);
        }
        world.go().unwrap();
    }
    let vehicle = &world.trains[0].consist.vehicle;
    let share = vehicle.total_kg() / vehicle.effective_kg();
    let pull_mps2 = share * GRAVITY_MPS2 * 0.02 / 1.0004f64.sqrt();
    for (id, sign) in [(TrainId(0), -1.0), (TrainId(1), 1.0)] {
        let train = world.train(id).unwrap();
        let gained = train.speed_mps.abs() - 50.0 / 3.6;
        assert_eq!(train.speed_mps < 0.0, id == TrainId(1));
        assert!(
            (gained - sign * 5.0 * pull_mps2).abs() < 0.01,
            "{id}: {gained}"
        );
    }
}

/// Every train has its own command, motion and account, and none is there beyond the last.
#[test]
fn trains_are_asked_by_number() {
    let train = |k: u32| TrainSettings {
        start_chainage_m: 1500.0 - 100.0 * f64::from(k),
        start_speed_kmh: 36.0,
        cruise_speed_kmh: 36.0,
        cars: 1,
        ..TrainSettings::default()
    };
    let settings = on_even_track((0..8).map(train).collect());
    let mut world = World::new(straight(), &settings, 1, 0).unwrap();
    let brake = TrainCommand {
        brake: BrakeDemand::Emergency,
        permitted_speed_mps: 0.0,
    };
    for _ in 0..3000 {
        world.step(&[TrainCommand::UNSUPERVISED, brake]).unwrap();
    }
    assert_eq!(world.train_ids().count(), 8);
    for id in world.train_ids() {
        let braked = id == TrainId(1);
        assert_eq!(world.train(id).unwrap().speed_mps < 9.0, braked, "{id}");
        assert_eq!(world.energy(id).unwrap().brake_j > 1e5, braked);
        assert!(world.wheel_extremes(id).unwrap().most_slip_mps > 0.0);
        assert!(
            world
                .vehicle_at(id, TrainEnd::Front, world.time().plus(-0.3))
                .is_some()
        );
        assert_eq!(world.get(id).unwrap().bodies().len(), 3);
    }
    assert_eq!(world.headlights().len(), 16);
    assert_eq!(world.bodies(None).len(), 24);
    assert_eq!(world.bodies(Some(TrainId(3))).len(), 21);
    assert!(world.train(TrainId(8)).is_none() && world.run_m(TrainId(8)).is_none());
    assert!(world.impacts().is_empty());
}
