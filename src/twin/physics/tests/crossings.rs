//! Trains over tracks that cross each other: one waits for the other, or they meet.

use super::switches::{at, by_hand, go, kinds, train};
use super::*;

const SECOND: TrainId = TrainId(1);

/// Two trains over both crossovers of a scissors crossover, whose switches are at 120 m: where their heads start, and
/// their speeds in km/h.
fn over_the_crossing(
    [first, second]: [(f64, f64); 2],
    interlocking: InterlockingSettings,
) -> World {
    let text = include_str!("../../../../tests/tunnels/scissors.toml");
    let tunnel = Arc::new(Tunnel::from_toml(text).unwrap());
    let trains = vec![
        train(("u1", first.0), &["A"], ("d3", 80.0), first.1),
        train(("d1", second.0), &["B"], ("u3", 80.0), second.1),
    ];
    let settings = PhysicsSettings {
        interlocking,
        ..on_even_track(trains)
    };
    World::new(tunnel, &settings, 1, 0).unwrap()
}

/// Provokes: two trains on a crossing, one that waits in the gauge of the other, or for ever.
#[test]
fn a_train_waits_before_a_crossing_that_is_not_its_own() {
    let mut world = over_the_crossing(
        [(100.0, 15.0), (70.0, 30.0)],
        InterlockingSettings::default(),
    );
    let crossing = world.network().crossings[0].clone();
    let length_m = train(("u1", 0.0), &[], ("u1", 0.0), 0.0).length_m();
    let mut waited_at_m = None;
    while world.time().secs() < 70.0 {
        assert!(go(&mut world, 0.1).is_none());
        // Routes begin where u1 and d1 do.
        let [first_m, second_m] = [TRAIN, SECOND].map(|id| world.run_m(id).unwrap());
        let has_left = first_m - length_m > 120.0 + crossing.zone(0).to_m;
        let is_in = second_m > 120.0 + crossing.zone(1).from_m;
        assert!(has_left || !is_in, "{first_m} {second_m}");
        if !has_left && world.train(SECOND).unwrap().standing {
            waited_at_m = Some(second_m);
        }
    }
    // Before the clearance point, and not farther than it need be.
    let before_m = 120.0 + crossing.zone(1).from_m - waited_at_m.unwrap();
    assert!((14.0..20.0).contains(&before_m), "{before_m}");
    for (id, stop) in [(TRAIN, "d3"), (SECOND, "u3")] {
        let (track, s_m) = at(&world, id);
        assert!(track == stop && (s_m - 80.0).abs() < 0.3, "{track} {s_m}");
    }
    assert_eq!(kinds(&world), []);
    assert!(world.impacts().is_empty());
}

/// Provokes: trains that pass through each other, or are not told to be in each other's gauge. Trains that run
/// abreast touch where the inner edges of their cars, 1.4 m from the middle, meet on the line between both: as long
/// before the crossing as half of its angle makes of that.
#[test]
fn val_trains_collide_on_a_crossing_without_interlocking() {
    let diverging = ["W1", "W2", "W3", "W4"].map(|name| (name, LegName::Diverging));
    let mut world = over_the_crossing([(100.0, 30.0); 2], by_hand(&diverging, Vec::new()));
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
