//! Plans that are laid out.

use super::v2::{end, read};
use crate::track::Direction;
use crate::track::import::ImportedMap;
use nalgebra::Point2;

const UP: Direction = Direction::Up;
const DOWN: Direction = Direction::Down;

fn track(id: &str, begin: &str, end: &str, length_m: f64, switches: &str) -> String {
    format!(
        "<track id=\"{id}\"><trackTopology><trackBegin pos=\"0\">{begin}</trackBegin><trackEnd pos=\"{length_m}\">{end}</trackEnd>\
        <connections>{switches}</connections></trackTopology></track>"
    )
}

fn link(id: &str, to: &str) -> String {
    format!("<connection id=\"{id}\" ref=\"{to}\"/>")
}

fn switch(id: &str, to: &str, at_m: f64, orientation: &str, course: &str) -> String {
    format!(
        "<switch id=\"w{id}\" pos=\"{at_m}\"><connection id=\"{id}\" ref=\"{to}\" orientation=\"{orientation}\" course=\"{course}\"/></switch>"
    )
}

fn map(tracks: &[String]) -> ImportedMap {
    let tracks = tracks.concat();
    let text = format!(
        "<railml version=\"2.2\"><infrastructure><tracks>{tracks}</tracks></infrastructure></railml>"
    );
    read(&text).unwrap()
}

/// A track of 1000 m with a siding on its left from 200 m to 800 m.
fn siding(length_m: f64) -> ImportedMap {
    let switches =
        switch("a", "b", 200.0, "outgoing", "left") + &switch("c", "d", 800.0, "incoming", "right");
    map(&[
        track("main", "", "", 1000.0, &switches),
        track("siding", &link("b", "a"), &link("d", "c"), length_m, ""),
    ])
}

fn points(map: &ImportedMap, element: usize) -> Vec<Point2<f64>> {
    map.network.elements[element]
        .points()
        .map(|(point, _)| *point)
        .collect()
}

fn is_told(map: &ImportedMap) -> bool {
    map.report
        .left_out
        .iter()
        .any(|left| left.why.contains("longer in plan"))
}

#[test]
fn a_siding_lies_beside_its_track() {
    let map = siding(600.0);
    let (main, siding) = (points(&map, 1), points(&map, 3));
    assert_eq!(main, [Point2::new(200.0, 0.0), Point2::new(800.0, 0.0)]);
    assert_eq!((siding[0], siding[siding.len() - 1]), (main[0], main[1]));
    assert!(
        siding[1].y > 4.0 && siding[1].y < 6.0,
        "on the left, by a distance of tracks: {siding:?}"
    );
    assert!((map.network.elements[3].length_m() - 600.0).abs() < 0.5);
    let told = |map: &ImportedMap| {
        map.report.left_out[0]
            .why
            .contains("laid out by lengths and joints alone")
    };
    assert!(told(&map) && !is_told(&map));
    // One that is longer than its track has a corner aside; one that is shorter cannot be.
    let longer = siding_length(700.0);
    assert!((longer.0 - 700.0).abs() < 0.5 && !longer.1, "{longer:?}");
    let shorter = siding_length(500.0);
    assert!(shorter.0 > 599.0 && shorter.1, "{shorter:?}");
}

fn siding_length(length_m: f64) -> (f64, bool) {
    let map = siding(length_m);
    (map.network.elements[3].length_m(), is_told(&map))
}

#[test]
fn a_leg_leaves_on_its_side() {
    for (orientation, course, side) in [
        ("outgoing", "left", 1.0),
        ("outgoing", "right", -1.0),
        ("incoming", "left", -1.0),
        ("incoming", "right", 1.0),
    ] {
        let (begin, end) = match orientation {
            "outgoing" => (link("b", "a"), String::new()),
            _ => (String::new(), link("b", "a")),
        };
        let map = map(&[
            track(
                "main",
                "",
                "",
                1000.0,
                &switch("a", "b", 500.0, orientation, course),
            ),
            track("leg", &begin, &end, 300.0, ""),
        ]);
        let leg = points(&map, 2);
        let (at_switch, far) = if orientation == "outgoing" {
            (leg[0], leg[1])
        } else {
            (leg[1], leg[0])
        };
        assert_eq!(at_switch, Point2::new(500.0, 0.0));
        assert!(far.y * side > 4.0, "{orientation} {course}: {leg:?}");
        assert!((far.x > 500.0) == (orientation == "outgoing"));
        assert!((map.network.elements[2].length_m() - 300.0).abs() < 1e-6);
    }
}

/// A switch at the very begin of a track: its toe is that of the track before.
#[test]
fn a_switch_may_be_where_tracks_meet() {
    let map = map(&[
        track("first", "", &link("p", "q"), 400.0, ""),
        track(
            "second",
            &link("q", "p"),
            "",
            300.0,
            &switch("a", "b", 0.0, "outgoing", "right"),
        ),
        track("leg", &link("b", "a"), "", 200.0, ""),
    ]);
    let switch = &map.switches[0];
    assert_eq!(
        (switch.toe, switch.through, switch.diverging),
        (end(0, UP), end(1, DOWN), end(2, DOWN))
    );
    assert_eq!(map.network.onward(end(0, UP)), [end(1, UP), end(2, UP)]);
    assert_eq!(map.network.onward(end(2, DOWN)), [end(0, DOWN)]);
}

#[test]
fn rings_and_loops_are_as_long_as_stated() {
    let ring = map(&[track("ring", &link("a", "b"), &link("b", "a"), 500.0, "")]);
    assert!((ring.network.elements[0].length_m() - 500.0).abs() < 1e-6);
    assert_eq!(ring.network.onward(end(0, UP)), [end(0, UP)]);
    // A loop by which trains turn: both of its ends at one switch.
    let turn = map(&[
        track("stem", "", &link("p", "q"), 400.0, ""),
        track(
            "turn",
            &link("q", "p"),
            &link("b", "a"),
            900.0,
            &switch("a", "b", 0.0, "outgoing", "left"),
        ),
    ]);
    assert!((turn.network.elements[1].length_m() - 900.0).abs() < 1e-6);
    assert_eq!(turn.network.onward(end(0, UP)), [end(1, UP), end(1, DOWN)]);
}
