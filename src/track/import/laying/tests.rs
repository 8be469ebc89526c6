use super::*;
use crate::track::file::SectionShape;
use crate::track::import::map::{ImportReport, MapBalise, MapStep, MapSwitch};
use crate::track::plan::{ElementEnd, PlanNetwork, TrackElement};
use crate::track::{Alignment, Tunnel};
use nalgebra::Point2;

const TERMINUS: &str = include_str!("../../../../tunnels/terminus.toml");
const SCISSORS: &str = include_str!("../../../../tests/tunnels/scissors.toml");

fn options(sigma_m: f64) -> LayingOptions {
    LayingOptions {
        name: "laid".to_owned(),
        sigma_m,
        join: false,
    }
}

fn map(
    elements: Vec<TrackElement>,
    switches: Vec<[ElementEnd; 3]>,
    joints: &[(ElementEnd, ElementEnd)],
) -> ImportedMap {
    let legs = switches
        .iter()
        .flat_map(|[toe, a, b]| [(*toe, *a), (*toe, *b)]);
    let joints: Vec<_> = joints.iter().copied().chain(legs).collect();
    let along = vec![AlongElement::default(); elements.len()];
    let switches = switches
        .iter()
        .enumerate()
        .map(|(k, [toe, through, diverging])| MapSwitch {
            name: format!("W{k}"),
            line: 0,
            toe: *toe,
            through: *through,
            diverging: *diverging,
            diverging_kmh: None,
        });
    ImportedMap {
        switches: switches.collect(),
        network: PlanNetwork::new(None, elements, &joints),
        along,
        plan_is_laid_out: false,
        plan_checks: Vec::new(),
        report: ImportReport::default(),
    }
}

/// Points of a line every so many metres, to both sides by up to so much, but for its ends.
fn sampled(line: &Alignment, apart_m: f64, noise_m: f64) -> Vec<Point2<f64>> {
    let count = (line.length_m() / apart_m).ceil().max(1.0) as u32;
    let points = (0..=count).map(|k| {
        let frame = line.at(line.length_m() * f64::from(k) / f64::from(count));
        let noise = 2.0 * (f64::from(k) * 0.618_033_988_75).fract() - 1.0;
        let inside = f64::from(u8::from(k > 0 && k < count));
        frame.world_from_section(noise_m * noise * inside, 0.0).xy()
    });
    points.collect()
}

/// A network of which only points are known.
fn drawn(text: &str, apart_m: f64, noise_m: f64) -> (Tunnel, ImportedMap) {
    let tunnel = Tunnel::from_toml(text).unwrap();
    let network = &tunnel.network;
    let elements = network.tracks.iter().map(|track| {
        TrackElement::new(&track.name, sampled(&track.alignment, apart_m, noise_m)).unwrap()
    });
    let end = |end: TrackEnd| ElementEnd {
        element: end.track.0.into(),
        way: end.way,
    };
    let switches = network.switches.iter();
    let switches = switches
        .map(|s| [s.toe, s.through, s.diverging].map(end))
        .collect();
    let map = map(elements.collect(), switches, &[]);
    (tunnel, map)
}

/// The farthest that a laid track is beside the one it is of.
fn away_m(laid: &Tunnel, of: &Tunnel) -> f64 {
    let mut most_m = 0.0f64;
    for track in &laid.network.tracks {
        let there = of
            .network
            .alignment(of.network.named(&track.name).unwrap())
            .unwrap();
        for k in 0..=40 {
            let at = track
                .alignment
                .at(track.alignment.length_m() * f64::from(k) / 40.0)
                .origin;
            most_m = most_m.max(there.track_from_world(&at, there.near_m(&at)).l_m.abs());
        }
    }
    most_m
}

/// Provokes: tracks, switches or crossings that are lost or joined otherwise, and tracks beside those they are of. Points
/// every 5 m are on the tracks, those every 12 m up to 0.15 m beside them.
#[test]
fn drawn_networks_are_laid_again() {
    for text in [TERMINUS, SCISSORS] {
        for (apart_m, noise_m, sigma_m) in [(5.0, 0.0, 0.05), (12.0, 0.15, 0.15)] {
            let (tunnel, map) = drawn(text, apart_m, noise_m);
            let laid = map.lay(&options(sigma_m)).unwrap();
            let written = laid.file.to_text(&[]).unwrap();
            let again = Tunnel::from_toml(&written).unwrap();
            let elements: usize = laid.file.track.iter().map(|track| track.plan.len()).sum();
            let away_m = away_m(&again, &tunnel);
            println!(
                "{} tracks, points every {apart_m} m, {noise_m} m beside: {away_m:.3} m, {elements} elements, left out {:?}",
                laid.file.track.len(),
                laid.left_out
            );
            assert!(away_m < 4.0 * sigma_m, "{away_m}");
            // The crossing of the scissors is no joint of the map's elements, which go through it.
            let crossing = tunnel.network.crossings.len();
            assert!(laid.left_out.len() <= 2 * crossing, "{:?}", laid.left_out);
            if crossing == 0 {
                assert_eq!(again.network.switches.len(), tunnel.network.switches.len());
            }
        }
    }
}

/// A triangle on which trains turn round: three legs between three switches, each an arc of 260 m.
fn triangle(is_reversed: bool) -> ImportedMap {
    let far_m = 150.0;
    let radius_m = far_m / 30f64.to_radians().tan();
    let unit = |degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        nalgebra::Vector2::new(cos, sin)
    };
    let mut elements = Vec::new();
    let mut add = |id: String, mut points: Vec<Point2<f64>>| {
        if is_reversed {
            points.reverse();
        }
        elements.push(TrackElement::new(&id, points).unwrap());
    };
    for corner in 0..3 {
        let way = unit(120.0 * f64::from(corner));
        let stem = (0..=10)
            .rev()
            .map(|k| Point2::from(way * (far_m + 20.0 * f64::from(k))));
        add(format!("stem {corner}"), stem.collect());
    }
    for corner in 0..3 {
        let first = 120.0 * f64::from(corner);
        // The middle of its circle is square to the stem where the leg begins, between both stems.
        let middle = unit(first) * far_m + unit(first + 90.0) * radius_m;
        let turn = |k: u32| first + 270.0 - 60.0 * f64::from(k) / 20.0;
        let arc = (0..=20).map(|k| Point2::from(middle + unit(turn(k)) * radius_m));
        add(format!("leg {corner}"), arc.collect());
    }
    let (begin, end) = match is_reversed {
        false => (Direction::Down, Direction::Up),
        true => (Direction::Up, Direction::Down),
    };
    let switches = (0..3).map(|corner| {
        [
            ElementEnd {
                element: corner,
                way: end,
            },
            ElementEnd {
                element: 3 + corner,
                way: begin,
            },
            ElementEnd {
                element: 3 + (corner + 2) % 3,
                way: end,
            },
        ]
    });
    map(elements, switches.collect(), &[])
}

/// Provokes: a ring that does not close, and tracks that depend on the direction in which they are drawn.
#[test]
fn a_triangle_closes() {
    let lengths = [false, true].map(|is_reversed| {
        let laid = triangle(is_reversed).lay(&options(0.1)).unwrap();
        assert!(laid.left_out.is_empty(), "{:?}", laid.left_out);
        let again = Tunnel::from_toml(&laid.file.to_text(&[]).unwrap()).unwrap();
        assert_eq!(again.network.switches.len(), 3);
        assert!(
            laid.tracks.iter().all(|track| track.most_m < 0.3),
            "{:?}",
            laid.tracks
        );
        laid.tracks
            .iter()
            .map(|track| track.length_m)
            .collect::<Vec<_>>()
    });
    let arc_m = 150.0 / 30f64.to_radians().tan() * 60f64.to_radians();
    for (there, back) in lengths[0].iter().zip(&lengths[1]) {
        assert!((there - back).abs() < 0.05, "{there} {back}");
    }
    for leg in &lengths[0][3..] {
        assert!((leg - arc_m).abs() < 0.5, "{leg} {arc_m}");
    }
}

/// Grades of 5, -3 and 1 permille round a triangle do not come back to where they began: each leg takes a third of what
/// is wrong. Provokes: heights or slopes that differ where tracks meet, which the file is checked for.
#[test]
fn grades_that_do_not_close_are_evened_out() {
    let mut map = triangle(false);
    for (along, permille) in map.along.iter_mut().zip([0.0, 0.0, 0.0, 5.0, -3.0, 1.0]) {
        along.grades_permille = vec![MapStep {
            from_m: 0.0,
            value: permille,
        }];
    }
    let laid = map.lay(&options(0.1)).unwrap();
    assert!(laid.left_out.is_empty(), "{:?}", laid.left_out);
    let again = Tunnel::from_toml(&laid.file.to_text(&[]).unwrap()).unwrap();
    for (name, permille) in [("leg 0", 4.0), ("leg 1", -4.0), ("leg 2", 0.0)] {
        let line = again
            .network
            .alignment(again.network.named(name).unwrap())
            .unwrap();
        let found =
            1e3 * (line.at(line.length_m()).origin.z - line.at(0.0).origin.z) / line.length_m();
        assert!((found - permille).abs() < 0.02, "{name}: {found}");
    }
}

/// Elements that cross in one point are two tracks, with a crossing.
#[test]
fn tracks_that_cross_go_through() {
    let line = |id: &str, from: [f64; 2], to: [f64; 2]| {
        TrackElement::new(id, vec![from.into(), to.into()]).unwrap()
    };
    let elements = vec![
        line("a", [-200.0, 0.0], [0.0, 0.0]),
        line("b", [0.0, 0.0], [200.0, 0.0]),
        line("c", [-190.0, -60.0], [0.0, 0.0]),
        line("d", [0.0, 0.0], [190.0, 60.0]),
    ];
    let end = |element, way| ElementEnd { element, way };
    let joints = [0, 2].map(|k| (end(k, Direction::Up), end(k + 1, Direction::Down)));
    let laid = map(elements, Vec::new(), &joints)
        .lay(&options(0.1))
        .unwrap();
    assert_eq!(
        (laid.file.track.len(), laid.file.crossings.len()),
        (2, 1),
        "{laid:?}"
    );
}

/// Ways that a map cuts where a tunnel begins are one track, with its tunnel and its balises where the map has them.
#[test]
fn tunnels_and_balises_lie_where_the_map_has_them() {
    let line = |id: &str, from: f64, to: f64| {
        TrackElement::new(id, vec![[from, 0.0].into(), [to, 0.0].into()]).unwrap()
    };
    // The middle one is drawn the other way round.
    let elements = vec![
        line("a", 0.0, 100.0),
        line("b", 250.0, 100.0),
        line("c", 250.0, 400.0),
    ];
    let end = |element, way| ElementEnd { element, way };
    let joints = [
        (end(0, Direction::Up), end(1, Direction::Up)),
        (end(1, Direction::Down), end(2, Direction::Down)),
    ];
    let mut map = map(elements, Vec::new(), &joints);
    map.along[1].tunnels_m = vec![[0.0, 150.0]];
    map.along[2].tunnels_m = vec![[0.0, 20.0]];
    for along in &mut map.along[1..=2] {
        along.balises = vec![MapBalise {
            name: "B".to_owned(),
            along_m: 30.0,
        }];
    }
    let options = LayingOptions {
        join: true,
        ..options(0.1)
    };
    let laid = map.lay(&options).unwrap();
    let [track] = &laid.file.track[..] else {
        unreachable!("{:?}", laid.file.track);
    };
    let sections: Vec<_> = track
        .sections
        .iter()
        .map(|s| (s.from_m, s.shape.clone()))
        .collect();
    let open = SectionShape::Open { width_m: None };
    let bore = SectionShape::Circular {
        radius_m: None,
        centre_m: None,
        walkway: None,
    };
    assert_eq!(
        sections,
        [(0.0, open.clone()), (100.0, bore), (270.0, open)]
    );
    let balises: Vec<_> = track
        .balises
        .iter()
        .map(|b| (&*b.name, b.chainage_m))
        .collect();
    assert_eq!(balises, [("B", 220.0), ("B 2", 280.0)]);
}

/// Provokes: a file with tracks in each other's way, or a way out of that which nobody is told of.
#[test]
fn what_is_in_the_way_is_left_out_and_told() {
    let line = |id: &str, y: f64, long_m: f64| {
        TrackElement::new(id, vec![[0.0, y].into(), [long_m, y].into()]).unwrap()
    };
    let elements = vec![
        line("a", 0.0, 300.0),
        line("b", 1.5, 200.0),
        line("c", 5.0, 250.0),
    ];
    let laid = map(elements, Vec::new(), &[]).lay(&options(0.1)).unwrap();
    let names: Vec<&str> = laid.file.track.iter().map(|track| &*track.name).collect();
    assert_eq!(names, ["a", "c"]);
    assert_eq!(laid.left_out.len(), 1);
    assert!(
        laid.left_out[0].what.contains('b') && laid.left_out[0].why.contains("1.50 m"),
        "{:?}",
        laid.left_out
    );
}

/// A map of nothing.
#[test]
fn nothing_is_refused() {
    let error = map(Vec::new(), Vec::new(), &[])
        .lay(&options(0.1))
        .unwrap_err();
    assert!(error.to_string().contains("no track"), "{error}");
}
