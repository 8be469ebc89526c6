//! Trains over switches: set for them, against them, moving, and moved under them.

use super::*;
use crate::track::Place;

/// A train on the terminus that starts on a track, is to run over others, and is left to itself.
pub(super) fn train(
    start: (&str, f64),
    via: &[&str],
    stop: (&str, f64),
    kmh: f64,
) -> TrainSettings {
    TrainSettings {
        cars: 2,
        start_track: Some(start.0.to_owned()),
        start_chainage_m: start.1,
        start_speed_kmh: kmh,
        cruise_speed_kmh: kmh,
        via: via.iter().map(|name| (*name).to_owned()).collect(),
        dwell_s: 2.0,
        stop_track: Some(stop.0.to_owned()),
        stop_at_m: Some(stop.1),
        ..TrainSettings::default()
    }
}

pub(super) fn down(train: TrainSettings) -> TrainSettings {
    TrainSettings {
        direction: Direction::Down,
        ..train
    }
}

fn terminus(trains: Vec<TrainSettings>, interlocking: InterlockingSettings) -> World {
    let text = include_str!("../../../../tunnels/terminus.toml");
    let tunnel = Arc::new(Tunnel::from_toml(text).unwrap());
    let settings = PhysicsSettings {
        interlocking,
        ..on_even_track(trains)
    };
    World::new(tunnel, &settings, 1, 0).unwrap()
}

pub(super) fn by_hand(
    positions: &[(&str, LegName)],
    moves: Vec<SwitchMove>,
) -> InterlockingSettings {
    let position = |(name, leg): &(&str, LegName)| SwitchPosition {
        switch: (*name).to_owned(),
        leg: *leg,
    };
    InterlockingSettings {
        automatic: false,
        positions: positions.iter().map(position).collect(),
        moves,
        ..InterlockingSettings::default()
    }
}

fn moved(switch: &str, leg: LegName, at_s: f64, lock_fails: bool) -> SwitchMove {
    SwitchMove {
        switch: switch.to_owned(),
        leg,
        at_s,
        lock_fails,
    }
}

/// Steps on for a time or until it fails; gives the failure.
pub(super) fn go(world: &mut World, for_s: f64) -> Option<PhysicsError> {
    let until_s = world.time().secs() + for_s;
    while world.time().secs() < until_s {
        if let Err(error) = world.step(&[]) {
            return Some(error);
        }
    }
    None
}

pub(super) fn kinds(world: &World) -> Vec<(IncidentKind, Option<&str>)> {
    let list = world.incidents().iter();
    list.map(|i| (i.kind, i.switch.as_deref())).collect()
}

pub(super) fn at(world: &World, id: TrainId) -> (String, f64) {
    let Place { track, s_m } = world.head(id).unwrap();
    let track = &world.network().tracks[usize::from(track.0)];
    (track.name.clone(), s_m)
}

/// Provokes: a route that is not set before the train, a call that is left out, a step of the head at a joint, a
/// speed over what the crossover permits, wheels that are pressed aside harder than track bears: 10 kN and a third
/// of the axle load (Prud'homme).
#[test]
fn val_a_train_runs_its_route_over_a_crossover() {
    let way = train(
        ("u1", 380.0),
        &["u3", "up platform"],
        ("siding", 100.0),
        45.0,
    );
    let mut world = terminus(vec![way], InterlockingSettings::default());
    let (mut before_m, mut called) = (world.run_m(TRAIN).unwrap(), false);
    let mut on_crossover_mps = 0.0_f64;
    while world.time().secs() < 150.0 {
        assert!(go(&mut world, 0.1).is_none());
        let state = world.train(TRAIN).unwrap();
        let run_m = state.run_m;
        let expected_m = 0.1 * state.speed_mps.abs();
        assert!(
            (run_m - before_m - expected_m).abs() < 0.02,
            "{run_m} {before_m}"
        );
        // Where the pose is, is where the place says.
        let network = world.network();
        let line = network.alignment(state.track).unwrap();
        let origin = state.world_from_vehicle.translation.vector.into();
        let exact = line.track_from_world(&origin, state.chainage_m);
        assert!((exact.s_m - state.chainage_m).abs() < 1e-3, "{exact:?}");
        before_m = run_m;
        called |= state.dwells;
        if at(&world, TRAIN).0 == "C" {
            on_crossover_mps = on_crossover_mps.max(state.speed_mps);
        }
        if state.standing && !state.dwells && world.time().secs() > 60.0 {
            break;
        }
    }
    let (track, s_m) = at(&world, TRAIN);
    assert!(
        track == "siding" && (s_m - 100.0).abs() < 0.3,
        "{track} {s_m}"
    );
    assert!(called && on_crossover_mps > 7.0 && on_crossover_mps < 31.0 / 3.6);
    assert_eq!(kinds(&world), []);
    let axle_n = 2.0 * world.wheel_load_n(TRAIN).unwrap();
    let pressed_n = world.wheel_extremes(TRAIN).unwrap().most_lateral_n;
    eprintln!(
        "pressed aside by up to {:.1} kN of an axle load of {:.1} kN",
        1e-3 * pressed_n,
        1e-3 * axle_n
    );
    assert!(pressed_n < 10e3 + axle_n / 3.0, "{pressed_n}");
}

/// Provokes: a train that follows its route though the blades lead elsewhere, or a driver who goes on there.
#[test]
fn blades_lead_where_they_are_set() {
    let way = train(("u1", 420.0), &[], ("u3", 100.0), 40.0);
    let set = by_hand(&[("W1", LegName::Diverging)], Vec::new());
    let mut world = terminus(vec![way], set);
    assert!(go(&mut world, 60.0).is_none());
    let (track, _) = at(&world, TRAIN);
    assert!(["A", "d2", "d3"].contains(&&*track), "{track}");
    assert!(world.train(TRAIN).unwrap().standing);
    // It trails W2, which is set straight on.
    let run_through = (IncidentKind::RunThrough, Some("W2"));
    let against = (IncidentKind::AgainstRoute, Some("W1"));
    assert!(kinds(&world).starts_with(&[against]), "{:?}", kinds(&world));
    assert!(kinds(&world).len() == 1 || kinds(&world)[1] == run_through);
    let first = &world.incidents()[0];
    assert!(
        first.track == "u1" && (first.chainage_m - 460.0).abs() < 3.0,
        "{first}"
    );
}

/// Provokes: a switch that moves under a train though it is locked, or does not where its lock fails.
#[test]
fn a_switch_is_locked_under_a_train() {
    let way = || train(("u1", 420.0), &["u2"], ("u3", 100.0), 40.0);
    let ask = |lock_fails| by_hand(&[], vec![moved("W1", LegName::Diverging, 5.0, lock_fails)]);
    let mut world = terminus(vec![way()], ask(false));
    assert!(go(&mut world, 30.0).is_none());
    assert_eq!(kinds(&world), [(IncidentKind::SwitchLocked, Some("W1"))]);
    assert_eq!(at(&world, TRAIN).0, "u3");
    let mut world = terminus(vec![way()], ask(true));
    let failed = go(&mut world, 30.0);
    assert!(
        matches!(failed, Some(PhysicsError::Derailed { .. })),
        "{failed:?}"
    );
    assert_eq!(
        kinds(&world),
        [(IncidentKind::SwitchMovedUnderTrain, Some("W1"))]
    );
    assert!((world.time().secs() - 5.0).abs() < 0.01);
}

/// Provokes: a call that moves a switch of a route that is set, before the train is on it.
#[test]
fn a_set_route_locks_its_switches() {
    let way = train(("u1", 420.0), &["u2"], ("u3", 100.0), 40.0);
    let calls = InterlockingSettings {
        moves: vec![moved("W1", LegName::Diverging, 1.0, false)],
        ..InterlockingSettings::default()
    };
    let mut world = terminus(vec![way], calls);
    assert!(go(&mut world, 10.0).is_none());
    assert_eq!(kinds(&world), [(IncidentKind::SwitchLocked, Some("W1"))]);
    assert!(world.switch_share(0).abs() < 1e-12);
    assert_eq!(at(&world, TRAIN).0, "u2");
}

/// Provokes: blades that are over at once, or a train that passes between two ways.
#[test]
fn blades_between_their_ends_derail_a_train() {
    let way = || train(("u1", 420.0), &["u2"], ("u3", 100.0), 40.0);
    // The tips are 3.4 s ahead; the blades take 4 s.
    let ask = |at_s| by_hand(&[], vec![moved("W1", LegName::Diverging, at_s, false)]);
    let mut world = terminus(vec![way()], ask(1.0));
    let failed = go(&mut world, 30.0);
    assert!(
        matches!(failed, Some(PhysicsError::Derailed { .. })),
        "{failed:?}"
    );
    assert_eq!(kinds(&world), [(IncidentKind::SwitchNotClosed, Some("W1"))]);
    let mut world = terminus(vec![way()], ask(0.2));
    assert!((world.switch_share(0)).abs() < 1e-12);
    assert!(go(&mut world, 2.2).is_none());
    assert!(
        (world.switch_share(0) - 0.5).abs() < 0.01,
        "{}",
        world.switch_share(0)
    );
}

/// Provokes: a train that comes from the leg that is not set and is stopped, or leaves the blades as they are.
#[test]
fn a_trailing_train_forces_the_blades() {
    let way = train(("A", 30.0), &["d3"], ("d3", 100.0), 30.0);
    let mut world = terminus(vec![way], by_hand(&[], Vec::new()));
    assert!(go(&mut world, 30.0).is_none());
    assert_eq!(kinds(&world), [(IncidentKind::RunThrough, Some("W2"))]);
    assert!((world.switch_share(1) - 1.0).abs() < 1e-12);
}

/// Provokes: a panic or silence where a train runs off an open end, or through a buffer stop.
#[test]
fn ends_are_run_over() {
    let off = down(train(("u1", 60.0), &[], ("u1", -50.0), 40.0));
    let off = TrainSettings {
        stop_at_m: None,
        ..off
    };
    let mut world = terminus(vec![off], InterlockingSettings::default());
    assert!(go(&mut world, 15.0).is_none());
    assert_eq!(kinds(&world), [(IncidentKind::OffEnd, None)]);
    let into = TrainSettings {
        stop_at_m: None,
        ..train(("siding", 120.0), &[], ("siding", 0.0), 20.0)
    };
    let mut world = terminus(vec![into], InterlockingSettings::default());
    // It may leave the rails there.
    go(&mut world, 30.0);
    let hit = world.impacts().first().unwrap();
    assert!(
        hit.with == "buffer of siding" && hit.speed_mps > 4.0,
        "{hit:?}"
    );
}

/// Provokes: trains on both legs of a switch that are taken to be clear of each other nearer to its toe than they
/// are, or farther; and a train that passes a switch that is another one's.
#[test]
fn trains_foul_each_other_at_a_switch() {
    let stands = |track, s_m| TrainSettings {
        cruise_speed_kmh: 0.0,
        ..train((track, s_m), &[], (track, s_m), 0.0)
    };
    // Their tails stand on u1; clear_from_m is 41.5 m.
    for (s_m, fouls) in [(70.0, false), (60.0, true)] {
        let ahead = stands("u2", 140.0);
        let beside = TrainSettings {
            start_track: Some("A".to_owned()),
            start_chainage_m: s_m,
            stop_track: None,
            stop_at_m: None,
            cars: 1,
            ..stands("A", s_m)
        };
        let ahead = TrainSettings {
            cars: 1,
            start_chainage_m: if fouls { 50.0 } else { 140.0 },
            stop_at_m: None,
            stop_track: None,
            ..ahead
        };
        let mut world = terminus(vec![ahead, beside], by_hand(&[], Vec::new()));
        assert!(go(&mut world, 1.0).is_none());
        let found = kinds(&world).contains(&(IncidentKind::Fouled, None));
        assert_eq!(found, fouls, "{:?}", kinds(&world));
    }
    // Both want W6; the second one waits until the first one has left it.
    let first = train(("u3", 120.0), &["C"], ("siding", 150.0), 30.0);
    let second = down(train(("d4", 10.0), &["d3"], ("d3", 100.0), 30.0));
    let second = TrainSettings {
        start_chainage_m: 100.0,
        start_track: Some("D".to_owned()),
        start_speed_kmh: 0.0,
        ..second
    };
    let second = TrainSettings {
        start_chainage_m: 60.0,
        cars: 1,
        ..second
    };
    let mut world = terminus(vec![first, second], InterlockingSettings::default());
    assert!(go(&mut world, 40.0).is_none());
    let wrong = |kind| kinds(&world).iter().any(|(k, _)| *k == kind);
    assert!(!wrong(IncidentKind::RunThrough) && !wrong(IncidentKind::AgainstRoute));
}
