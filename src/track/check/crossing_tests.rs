//! Faults of crossings in tunnel files.

use super::*;

const SCISSORS: &str = include_str!("../../../tests/tunnels/scissors.toml");

fn problems(text: &str) -> Vec<Problem> {
    match Tunnel::from_toml(text) {
        Err(FileError::Problems(problems)) => problems,
        Err(other) => panic!("{other}"),
        Ok(_) => Vec::new(),
    }
}

/// Whether any problem has a key and says something, its remedy included.
fn told(found: &[Problem], key: &str, said: &str) -> bool {
    let is = |p: &Problem| p.key == key && p.to_string().contains(said);
    found.iter().any(is)
}

/// Two tracks in the open of which the second crosses the first, which runs eastwards; and crossings of these.
fn two_tracks(start: &str, plan: &str, crossings: &str) -> Vec<Problem> {
    problems(&format!(
        "name = \"two\"
{crossings}
[[track]]
name = \"a\"
start = {{}}
plan = [{{ kind = \"straight\", length_m = 400.0 }}]
sections = [{{ kind = \"open\", from_m = 0.0, width_m = 20.0 }}]
[[track]]
name = \"b\"
start = {{ {start} }}
plan = [{{ {plan} }}]
sections = [{{ kind = \"open\", from_m = 0.0, width_m = 20.0 }}]
"
    ))
}

const X: &str = "[[crossings]]\nname = \"X\"\ntracks = [\"a\", \"b\"]\n";
const STRAIGHT: &str = "kind = \"straight\", length_m = 200.0";
/// It crosses the x axis twice.
const ARC: &str = "kind = \"arc\", length_m = 200.0, radius_m = 200.0, turn = \"left\"";

/// Straight through (200 m, 0) at an angle, 100 m from its begin.
fn through(angle_deg: f64) -> String {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    let (east_m, north_m) = (200.0 - 100.0 * cos, -100.0 * sin);
    format!("east_m = {east_m:?}, north_m = {north_m:?}, heading_deg = {angle_deg:?}")
}

/// Provokes: tracks that cross at any angle and are let pass without a crossing, or refused with one.
#[test]
fn tracks_that_cross_need_a_crossing() {
    for angle_deg in [7.0, 12.7, 33.0, 60.0, 90.0, 91.3, 150.0, -20.0] {
        let right = two_tracks(&through(angle_deg), STRAIGHT, X);
        assert!(right.is_empty(), "{angle_deg}: {right:#?}");
        let found = two_tracks(&through(angle_deg), STRAIGHT, "");
        assert!(
            told(&found, "track[0]", "trains on both would touch"),
            "{angle_deg}: {found:#?}"
        );
        assert!(told(&found, "track[0]", "`[[crossings]]`"), "{found:#?}");
    }
    // Square to each other, wherever the places lie that are looked at.
    for k in 0..16 {
        let start = format!(
            "east_m = {:?}, north_m = -100.0, heading_deg = 90.0",
            200.0 + 0.25 * f64::from(k)
        );
        assert!(!two_tracks(&start, STRAIGHT, "").is_empty(), "{k}");
    }
}

/// Provokes: one of two places where tracks cross that is taken for the other, or lets both pass.
#[test]
fn tracks_that_cross_twice_say_where() {
    let start = "east_m = 50.0, north_m = 10.0, heading_deg = -30.0";
    let near = |near_m: f64| {
        format!(
            "{}near_m = {near_m:?}\n",
            X.replace("X", &format!("X{near_m:.0}"))
        )
    };
    let found = two_tracks(start, ARC, X);
    assert!(
        told(
            &found,
            "crossings[0].tracks",
            "cross at 69.8 m, 230.2 m of `a`"
        ),
        "{found:#?}"
    );
    let one = two_tracks(start, ARC, &near(60.0));
    assert!(
        told(&one, "track[0]", "trains on both would touch"),
        "{one:#?}"
    );
    let both = two_tracks(start, ARC, &format!("{}{}", near(60.0), near(250.0)));
    assert!(both.is_empty(), "{both:#?}");
    let same = two_tracks(start, ARC, &format!("{}{}", near(60.0), near(90.0)));
    assert!(
        told(
            &same,
            "crossings[1].tracks",
            "`X90` is where `X60` is already"
        ),
        "{same:#?}"
    );
}

/// Provokes: a crossing for which no fixed rails can be laid.
#[test]
fn crossings_that_cannot_be_laid_are_refused() {
    for (start, plan, said) in [
        (through(5.0), STRAIGHT, "at 5.0 deg, 1 in 11.4"),
        (
            format!("{}, up_m = 0.004", through(40.0)),
            STRAIGHT,
            "up to 4.0 mm above",
        ),
        (
            format!("{}, up_m = 6.0", through(40.0)),
            STRAIGHT,
            "passes over the other",
        ),
        (
            through(40.0),
            "kind = \"straight\", length_m = 99.0",
            "do not cross each other in plan",
        ),
        // 1.6 m (1 + cos 40 deg) / sin 40 deg are 4.4 m.
        (
            through(40.0),
            "kind = \"straight\", length_m = 103.0",
            "from 95.6 to 104.4 m of track `b`",
        ),
    ] {
        let found = two_tracks(&start, plan, X);
        assert!(
            told(&found, "crossings[0].tracks", said),
            "{said}: {found:#?}"
        );
    }
    let square = "[[crossings]]\nname = \"Y\"\ntracks = [\"u2\", \"c\"]\n[[track]]\nname = \"c\"
plan = [{ kind = \"straight\", length_m = 100.0 }]
sections = [{ kind = \"open\", from_m = 0.0, width_m = 40.0 }]
start = { east_m = 124.0, north_m = -50.0, heading_deg = 90.0 }\n";
    let found = problems(&format!("{SCISSORS}\n{square}"));
    let said = "its rails begin 3.2 m behind the toe of switch `W1`, whose blades reach to 7.";
    assert!(told(&found, "crossings[1].tracks", said), "{found:#?}");
}

/// Provokes: a fault of an entry that passes, or is told of another key.
#[test]
fn every_fault_of_a_crossing_is_reported_with_its_key() {
    assert!(problems(SCISSORS).is_empty(), "{:#?}", problems(SCISSORS));
    let entry = "[[crossings]]\nname = \"X\"\ntracks = [\"A\", \"B\"]\n";
    for (wrong, key, said) in [
        ("", "track[6]", "trains on both would touch"),
        (
            "[[crossings]]\nname = \"W1\"\ntracks = [\"A\", \"B\"]\n",
            "crossings[0].name",
            "name of `switches[0]` too",
        ),
        (
            "[[crossings]]\nname = \"X.1\"\ntracks = [\"A\", \"B\"]\n",
            "crossings[0].name",
            "has a dot",
        ),
        (
            "[[crossings]]\nname = \"X\"\ntracks = [\"A\", \"C\"]\n",
            "crossings[0].tracks[1]",
            "there is no track `C`",
        ),
        (
            "[[crossings]]\nname = \"X\"\ntracks = [\"A\", \"A\"]\n",
            "crossings[0].tracks",
            "no track crosses itself",
        ),
        (
            "[[crossings]]\nname = \"X\"\ntracks = [\"u2\", \"d2\"]\n",
            "crossings[0].tracks",
            "do not cross",
        ),
        (
            "[[crossings]]\nname = \"X\"\ntracks = [\"A\", \"B\"]\nnear_m = -1.0\n",
            "crossings[0].near_m",
            "-1",
        ),
    ] {
        assert!(SCISSORS.contains(entry));
        let found = problems(&SCISSORS.replacen(entry, wrong, 1));
        assert!(told(&found, key, said), "{wrong}: {found:#?}");
    }
    let twice = problems(&SCISSORS.replacen(entry, &format!("{entry}{entry}"), 1));
    assert!(
        told(&twice, "crossings[1].name", "name of `crossings[0]` too"),
        "{twice:#?}"
    );
    let three = problems(&SCISSORS.replacen("[\"A\", \"B\"]", "[\"A\", \"B\", \"u2\"]", 1));
    assert!(
        told(&three, "crossings[0].tracks", "names 3 tracks"),
        "{three:#?}"
    );
}
