//! Crossings against closed forms and points.

use super::*;
use crate::track::network::{Conflict, Route, RouteEnvelope};
use crate::track::{Direction, Grade, PlanElement, Track, Tunnel};
use nalgebra::Point3;
use std::sync::Arc;

const TRACKS: [TrackId; 2] = [TrackId(0), TrackId(1)];

fn line(x: f64, y: f64, heading_rad: f64, element: PlanElement) -> Alignment {
    Alignment::new(Point3::new(x, y, 0.0), heading_rad, &[element], &[])
}

fn network(lines: [Alignment; 2]) -> Network {
    let tracks = lines.map(|line| Arc::new(Track::bare("", line)));
    Network::unjoined(tracks.into())
}

/// Eastwards along the x axis for 400 m.
fn eastwards() -> Alignment {
    line(0.0, 0.0, 0.0, PlanElement::straight(400.0))
}

/// A straight that crosses that one 200 m from its begin, 150 m from its own.
fn across(angle_rad: f64) -> Network {
    let (sin, cos) = angle_rad.sin_cos();
    let straight = PlanElement::straight(320.0);
    let other = line(200.0 - 150.0 * cos, -150.0 * sin, angle_rad, straight);
    network([eastwards(), other])
}

/// Provokes: a place, an angle or a clearance of straights that is not that of their closed form, for tracks
/// that run the same way or against each other, flat or square.
#[test]
fn val_straights_cross_where_their_closed_form_has_it() {
    let half_m = Gauge::b1(0.0).widest_m();
    for degrees in [6.34_f64, 12.7, 45.0, 90.0, 135.0, 171.0, -30.0] {
        let angle = degrees.to_radians();
        let network = across(angle);
        let found = network.crossed_at_m(TRACKS);
        let [at_m] = found[..] else {
            unreachable!("{degrees}: {found:?}");
        };
        assert!((at_m[0] - 200.0).abs() < 1e-9 && (at_m[1] - 150.0).abs() < 1e-9);
        let crossing = network.crossing("X", TRACKS, at_m).unwrap();
        let acute = angle.sin().abs().asin();
        assert!((crossing.angle_rad - acute).abs() < 1e-12, "{degrees}");
        for (side, at_m) in at_m.into_iter().enumerate() {
            for (stretch, half_m) in [
                (crossing.zone(side), half_m),
                (crossing.rails(side), RAIL_OFFSET_M),
            ] {
                let reach_m = half_m * (1.0 + acute.cos()) / acute.sin();
                assert!((at_m - stretch.from_m - reach_m).abs() < 1e-8, "{degrees}");
                assert!((stretch.to_m - at_m - reach_m).abs() < 1e-8, "{degrees}");
            }
        }
        assert!(crossing.rail_step_m < 1e-12);
    }
}

/// Provokes: a crossing of a straight and an arc that is missed, or taken for another one; the gauge of a curve
/// that is not wider.
#[test]
fn val_a_straight_crosses_an_arc_where_their_closed_form_has_it() {
    // It turns to the left, down through the straight and up again.
    let (radius_m, heading, from_y_m) = (200.0, -0.5_f64, 10.0);
    let middle = Point3::new(
        50.0 - radius_m * heading.sin(),
        from_y_m + radius_m * heading.cos(),
        0.0,
    );
    let arc = line(
        50.0,
        from_y_m,
        heading,
        PlanElement::arc(200.0, 1.0 / radius_m, 0.0),
    );
    let network = network([eastwards(), arc]);
    let found = network.crossed_at_m(TRACKS);
    let turn = (middle.y / radius_m).acos();
    assert_eq!(found.len(), 2, "{found:?}");
    for (at_m, turn) in found.iter().zip([-turn, turn]) {
        assert!((at_m[0] - (middle.x + radius_m * turn.sin())).abs() < 1e-9);
        assert!((at_m[1] - radius_m * (turn - heading)).abs() < 1e-9);
        let crossing = network.crossing("X", TRACKS, *at_m).unwrap();
        assert!((crossing.angle_rad - turn.abs()).abs() < 1e-9);
        // Corners are at the gauges' edges: so far from the arc's middle, so far beside the straight.
        let half_m = [0.0, 1.0 / radius_m].map(|k| Gauge::b1(k).widest_m());
        for (corner, sides) in crossing.gauges.iter().zip(AROUND) {
            let edge = Point3::new(corner[0], sides[0] * half_m[0], 0.0);
            let from_middle_m = radius_m - sides[1] * half_m[1];
            assert!(((edge - middle).norm() - from_middle_m).abs() < 1e-8);
        }
    }
}

/// Provokes: tracks that pass over each other at an end, run beside each other or part, and are taken to cross.
#[test]
fn tracks_that_do_not_cross() {
    let beside = line(0.0, 3.0, 0.0, PlanElement::straight(400.0));
    assert!(
        network([eastwards(), beside])
            .crossed_at_m(TRACKS)
            .is_empty()
    );
    let parts = line(0.0, 0.0, 0.0, PlanElement::arc(60.0, 1.0 / 200.0, 0.0));
    assert!(
        network([eastwards(), parts])
            .crossed_at_m(TRACKS)
            .is_empty()
    );
    let ends_there = line(
        100.0,
        -50.0,
        1.0,
        PlanElement::straight(50.0 / 1.0_f64.sin()),
    );
    assert!(
        network([eastwards(), ends_there])
            .crossed_at_m(TRACKS)
            .is_empty()
    );
    let short = line(100.0, -50.0, 1.0, PlanElement::straight(50.0));
    assert!(
        network([eastwards(), short])
            .crossed_at_m(TRACKS)
            .is_empty()
    );
}

/// Provokes: a search that compares all of a long line with all of another, for minutes.
#[test]
#[allow(clippy::disallowed_methods, reason = "it bounds the time of a search")]
fn long_lines_are_searched_in_little_time() {
    let long = line(-5e5, 0.0, 0.0, PlanElement::straight(1e6));
    let other = line(-5e5, 50.0, -2e-4, PlanElement::straight(1e6));
    let network = network([long, other]);
    let began = std::time::Instant::now();
    let found = network.crossed_at_m(TRACKS);
    assert!(began.elapsed().as_secs_f64() < 20.0);
    assert!(
        (found[0][0] - 50.0 / 2e-4_f64.tan()).abs() < 1e-3,
        "{found:?}"
    );
}

/// Provokes: a step of rails that is not seen: of a track that climbs, one that leans, one that lies higher.
#[test]
fn val_rails_that_cross_at_different_heights() {
    let step_m = |height_m: f64, slope: f64, cant_m: f64| {
        let grade = Grade {
            from_m: 0.0,
            slope,
            radius_m: 0.0,
        };
        let begin = Point3::new(200.0, -100.0, height_m - 100.0 * slope);
        let element = PlanElement::arc(200.0, 0.0, cant_m);
        let square = Alignment::new(begin, std::f64::consts::FRAC_PI_2, &[element], &[grade]);
        let network = network([eastwards(), square]);
        network
            .crossing("X", TRACKS, [200.0, 100.0])
            .unwrap()
            .rail_step_m
    };
    assert!(step_m(0.0, 0.0, 0.0) < 1e-12);
    assert!((step_m(0.004, 0.0, 0.0) - 0.004).abs() < 1e-12);
    // Square to a level track: as much as it climbs from one rail to the middle.
    assert!((step_m(0.0, 0.01, 0.0) - 0.01 * RAIL_OFFSET_M).abs() < 1e-12);
    let leaning_m = 0.06 * RAIL_OFFSET_M / crate::track::CANT_BASE_M;
    assert!((step_m(0.0, 0.0, 0.06) - leaning_m).abs() < 1e-12);
}

/// Provokes: what stands on one track and is not in the way on the other, or farther along than it is. Held
/// against points all over the ground that it takes up.
#[test]
fn gauges_overlap_where_points_lie_in_both() {
    let half_m = Gauge::b1(0.0).widest_m();
    for degrees in [12.7_f64, 70.0, 90.0, 150.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let crossing = across(degrees.to_radians())
            .crossing("X", TRACKS, [200.0, 150.0])
            .unwrap();
        let reach_m = crossing.zone(1).to_m - 150.0;
        for [from, to] in [
            [-3.0, -0.8],
            [-1.2, -0.7],
            [-0.3, 0.1],
            [0.2, 0.2],
            [0.6, 4.0],
            [1.1, 2.0],
        ] {
            let [from_m, to_m] = [from, to].map(|share| 150.0 + share * reach_m);
            let fine = |k: i32, n: i32, low: f64, high: f64| {
                low + (high - low) * f64::from(k) / f64::from(n)
            };
            let (low_m, high_m) = (from_m.max(150.0 - reach_m), to_m.min(150.0 + reach_m));
            let points = (0..=400).flat_map(|k| (0..=200).map(move |j| (k, j)));
            let along = points.filter_map(|(k, j)| {
                let along_m = fine(k, 400, low_m, high_m.max(low_m)) - 150.0;
                let left_m = fine(j, 200, -half_m, half_m);
                let beside_m = along_m * sin + left_m * cos;
                (beside_m.abs() <= half_m).then_some(200.0 + along_m * cos - left_m * sin)
            });
            let points = range_of(along.filter(|_| low_m <= high_m));
            let stretch = Stretch {
                track: TrackId(1),
                from_m,
                to_m,
            };
            let Some(found) = crossing.in_way_of(stretch) else {
                assert!(points.0 > points.1, "{degrees} {from} {to}: {points:?}");
                continue;
            };
            assert!(
                points.0 - found.from_m > -1e-9 && points.0 - found.from_m < 0.2,
                "{degrees} {from} {to}"
            );
            assert!(
                found.to_m - points.1 > -1e-9 && found.to_m - points.1 < 0.2,
                "{degrees} {from} {to}"
            );
            assert_eq!(found.track, TrackId(0));
        }
        let elsewhere = Stretch {
            track: TrackId(2),
            from_m: 0.0,
            to_m: 400.0,
        };
        assert_eq!(crossing.in_way_of(elsewhere), None);
    }
}

const SCISSORS: &str = include_str!("../../../../tests/tunnels/scissors.toml");

/// A way over the scissors crossover, from 20 m before its switches to 30 m behind them.
fn over(network: &Network, from: &str, to: &str) -> Route {
    let place = |name, s_m| Place {
        track: network.named(name).unwrap(),
        s_m,
    };
    let from = (place(from, 100.0), Direction::Up);
    network.shortest(from, place(to, 30.0)).unwrap()
}

/// Provokes: crossovers that cross elsewhere than half way, at another angle than that of both turn-outs together.
#[test]
fn val_crossovers_of_a_scissors_cross_half_way() {
    let network = Tunnel::from_toml(SCISSORS).unwrap().network;
    let [crossing] = &network.crossings[..] else {
        unreachable!();
    };
    assert!((crossing.angle_rad - 2.0 * 22.13 / 200.0).abs() < 1e-6);
    for place in crossing.places {
        let length_m = network.alignment(place.track).unwrap().length_m();
        assert!((place.s_m - 0.5 * length_m).abs() < 1e-6, "{place:?}");
    }
}

/// Provokes: routes over both crossovers that are taken to be clear of each other, or those that do not meet to be
/// in each other's way.
#[test]
fn routes_conflict_where_they_cross() {
    let network = Tunnel::from_toml(SCISSORS).unwrap().network;
    let [a, b, up, down] = [("u1", "d3"), ("d1", "u3"), ("u1", "u3"), ("d1", "d3")]
        .map(|(from, to)| over(&network, from, to));
    let conflicts = |one: &Route, other: &Route| {
        let found = network.conflicts(one, other, 3.6);
        assert_eq!(found, network.conflicts(other, one, 3.6));
        found
    };
    assert_eq!(conflicts(&a, &b), [Conflict::Crossing(0)]);
    assert_eq!(conflicts(&up, &down), []);
    // W1 and W2 are on the way over A; its conflict with a train straight on is at those alone.
    assert_eq!(conflicts(&a, &up), [Conflict::Switch(0)]);
    assert_eq!(conflicts(&a, &down), [Conflict::Switch(1)]);
    // One that ends before the crossing is clear of it.
    let place = |name, s_m| Place {
        track: network.named(name).unwrap(),
        s_m,
    };
    let short = network.shortest((place("u1", 100.0), Direction::Up), place("A", 15.0));
    assert_eq!(conflicts(&short.unwrap(), &b), []);
}

/// Provokes: a train on one crossover that a train on the other does not hear of, or as being elsewhere; one that runs
/// down and has the distances of one that runs up.
#[test]
fn what_stands_on_a_crossing_is_in_the_way_of_both_tracks() {
    let network = Tunnel::from_toml(SCISSORS).unwrap().network;
    let crossing = &network.crossings[0];
    let on_b = |from_m, to_m| Stretch {
        track: crossing.places[1].track,
        from_m,
        to_m,
    };
    let zone = crossing.zone(0);
    let route = over(&network, "u1", "d3");
    let length_m = route.length_m();
    let up = RouteEnvelope::new(&network, route.clone());
    let down = RouteEnvelope::new(&network, route.reversed());
    let all = |envelope: &RouteEnvelope, stretch| envelope.runs_over(stretch).collect::<Vec<_>>();
    // 20 m of u1 are before A.
    let whole = all(&up, on_b(0.0, 60.0));
    assert_eq!(whole.len(), 1, "{whole:?}");
    let (from_m, to_m) = whole[0];
    assert!((from_m - 20.0 - zone.from_m).abs() < 1e-9 && (to_m - 20.0 - zone.to_m).abs() < 1e-9);
    let (down_from_m, down_to_m) = all(&down, on_b(0.0, 60.0))[0];
    assert!((down_from_m - (length_m - to_m)).abs() < 1e-9);
    assert!((down_to_m - (length_m - from_m)).abs() < 1e-9);
    // Of who comes to it from the same side it stands in the way where he comes to it.
    let (near_m, far_m) = all(&up, on_b(crossing.zone(1).from_m, 25.0))[0];
    assert!(
        (near_m - from_m).abs() < 1.0 && far_m < 20.0 + crossing.places[0].s_m,
        "{near_m} {far_m}"
    );
    assert!(all(&up, on_b(0.0, crossing.zone(1).from_m - 0.1)).is_empty());
    // It comes near u2 at W4 only, 67 m from its begin.
    let straight_on = RouteEnvelope::new(&network, over(&network, "u1", "u3"));
    assert!(all(&straight_on, on_b(5.0, 20.0)).is_empty());
}
