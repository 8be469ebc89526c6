//! Trains over tracks that cross each other: one waits for the other, or they meet.

use super::switches::{at, by_hand, go, kinds, train};
use super::*;

const SECOND: TrainId = TrainId(1);

/// Two trains over both crossovers of a scissors crossover, whose switches are at 120 m: where their heads start, and
/// their cruising speeds in km/h.
fn over_the_crossing(
    [first, second]: [TrainSettings; 2],
    interlocking: InterlockingSettings,
) -> World {
    let text = include_str!("../../../../tests/tunnels/scissors.toml");
    let tunnel = Arc::new(Tunnel::from_toml(text).unwrap());
    let settings = PhysicsSettings {
        interlocking,
        ..on_even_track(vec![first, second])
    };
    World::new(tunnel, &settings, 1, 0).unwrap()
}

fn over_a(start_m: f64, kmh: f64) -> TrainSettings {
    train(("u1", start_m), &["A"], ("d3", 80.0), kmh)
}

fn over_b(start: (&str, f64), kmh: f64) -> TrainSettings {
    train(start, &["B"], ("u3", 80.0), kmh)
}

/// Runs on until both have come to their stops; gives how far before the crossing the other one stood until the train
/// that has the crossing had left it.
fn runs_apart(world: &mut World, has_it: TrainId, for_s: f64) -> f64 {
    let other = [SECOND, TRAIN][has_it.index()];
    let crossing = world.network().crossings[0].clone();
    let length_m = over_a(0.0, 0.0).length_m();
    // Routes begin where u1 and d1 do.
    let left_m = 120.0 + crossing.zone(has_it.index()).to_m + length_m;
    let fouls_m = 120.0 + crossing.zone(other.index()).from_m;
    let mut waited_at_m = None;
    while world.time().secs() < for_s {
        assert!(go(world, 0.1).is_none());
        let [run_m, other_m] = [has_it, other].map(|id| world.run_m(id).unwrap());
        assert!(run_m > left_m || other_m < fouls_m, "{run_m} {other_m}");
        if run_m < left_m && world.train(other).unwrap().standing {
            waited_at_m = Some(other_m);
        }
    }
    for (id, stop) in [(TRAIN, "d3"), (SECOND, "u3")] {
        let (track, s_m) = at(world, id);
        assert!(track == stop && (s_m - 80.0).abs() < 0.3, "{track} {s_m}");
    }
    assert_eq!(kinds(world), []);
    assert!(world.impacts().is_empty());
    fouls_m - waited_at_m.unwrap()
}

/// Provokes: two trains on a crossing, one that waits in the gauge of the other, or for ever.
#[test]
fn a_train_waits_before_a_crossing_that_is_not_its_own() {
    let trains = [over_a(100.0, 15.0), over_b(("d1", 70.0), 30.0)];
    let mut world = over_the_crossing(trains, InterlockingSettings::default());
    let before_m = runs_apart(&mut world, TRAIN, 70.0);
    // Before the clearance point, and not farther than it need be.
    assert!((14.0..20.0).contains(&before_m), "{before_m}");
}

/// Provokes: a crossing under a train that is kept for another one, which has the lower number.
#[test]
fn a_train_has_the_crossing_that_it_stands_on() {
    let stands = TrainSettings {
        start_speed_kmh: 0.0,
        ..over_b(("B", 35.0), 15.0)
    };
    let mut world = over_the_crossing(
        [over_a(60.0, 30.0), stands],
        InterlockingSettings::default(),
    );
    let before_m = runs_apart(&mut world, SECOND, 70.0);
    assert!((14.0..20.0).contains(&before_m), "{before_m}");
}

/// Provokes: trains that pass through each other, or are not told to be in each other's gauge. Trains that run
/// abreast touch where the inner edges of their cars, 1.4 m from the middle, meet on the line between both: as long
/// before the crossing as half of its angle makes of that.
#[test]
fn val_trains_collide_on_a_crossing_without_interlocking() {
    let diverging = ["W1", "W2", "W3", "W4"].map(|name| (name, LegName::Diverging));
    let trains = [over_a(100.0, 30.0), over_b(("d1", 100.0), 30.0)];
    let mut world = over_the_crossing(trains, by_hand(&diverging, Vec::new()));
    let crossing = world.network().crossings[0].clone();
    // They may leave the rails.
    go(&mut world, 8.0);
    let hit = world.impacts().first().unwrap().clone();
    assert!(["train", "other train 1"].contains(&&*hit.with), "{hit:?}");
    let before_m = 1.4 / (0.5 * crossing.angle_rad).tan();
    let run_m = 20.0 + crossing.places[0].s_m - before_m;
    let at_s = hit.time.secs();
    eprintln!(
        "they hit after {at_s:.2} s, {:.2} s by the plan",
        run_m / (30.0 / 3.6)
    );
    assert!((at_s - run_m / (30.0 / 3.6)).abs() < 0.4, "{hit:?}");
    let fouled = world
        .incidents()
        .iter()
        .find(|i| i.kind == IncidentKind::Fouled)
        .unwrap();
    assert_eq!((fouled.train, fouled.other), (SECOND, Some(TRAIN)));
    assert!(fouled.time.secs() <= at_s, "{fouled}");
}
